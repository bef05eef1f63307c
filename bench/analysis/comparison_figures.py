"""Figure of the differences of a comparison."""

from pathlib import Path

from trackmark.bench.analysis.comparison import Comparison
from trackmark.bench.analysis.comparison_tables import shown_pairs
from trackmark.reports.figures import write_figure
from trackmark.reports.plots import difference_plot

SHOWN_PAIRS = 4
"""Number of pairs whose differences are drawn."""


def write_differences(comparison: Comparison, folder: Path) -> list[Path]:
    """Draw the difference of each shown pair on each sequence; return the file, if any."""
    measure = comparison.measure
    differences = {
        pair.label: pair.differences * measure.scale
        for pair in shown_pairs(comparison)[:SHOWN_PAIRS]
    }
    if not differences:
        return []
    title = f"{measure.title} on {len(comparison.sequences)} sequences"
    margin = measure.margin * measure.scale
    figure = difference_plot(differences, comparison.sequences, measure.head, margin, title)
    return [write_figure(folder / "differences.png", figure)]
