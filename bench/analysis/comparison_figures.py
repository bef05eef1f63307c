"""Figure of the differences of a comparison."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from trackmark.bench.analysis.comparison import Comparison
from trackmark.bench.analysis.comparison_tables import shown_pairs
from trackmark.bench.output_files import write_file
from trackmark.reports.figures import fold, new_figure, save_figure
from trackmark.reports.palette import colour

SHOWN_PAIRS = 4
"""Number of pairs whose differences are drawn."""

_MAX_HEIGHT = 24.0  # inches
_MAX_NAMED_ROWS = 200  # in all panels; more rows have no room for their names


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
    figure = _difference_plot(differences, comparison.sequences, measure.heading, margin, title)
    return [write_file(folder / "differences.png", lambda file: save_figure(file, figure))]


def _difference_plot(
    differences: Mapping[str, ArrayLike],
    sequences: Sequence[str],
    quantity: str,
    margin: float,
    title: str,
) -> Figure:
    """Draw a dot per sequence for each pair, sorted by the differences.

    `differences`: differences (n,) by pair (`A - B`), in the order of the n `sequences`; each pair
    is a panel. `quantity`: name of the score with its unit. `margin`: largest irrelevant
    difference; a grey band shows ± margin.
    """
    height = 0.9 + len(differences) * (0.7 + 0.2 * len(sequences))
    figure, panels = new_figure(title, min(height, _MAX_HEIGHT), n_rows=len(differences))
    named = len(differences) * len(sequences) <= _MAX_NAMED_ROWS
    for axes, (pair, pair_differences) in zip(panels, differences.items(), strict=True):
        values = np.asarray(pair_differences, np.float64)
        order = np.argsort(values, kind="stable")
        rows = np.arange(len(values))
        axes.axvspan(-margin, margin, color="#dddddd", linewidth=0)
        axes.axvline(0.0, color="black", linewidth=0.8)
        axes.hlines(rows, 0.0, values[order], color=colour(0), linewidth=1.0)
        axes.plot(values[order], rows, "o", color=colour(0), markersize=4)
        axes.axvline(values.mean(), color=colour(1), linestyle="--", linewidth=1.4)
        if named:
            axes.set_yticks(rows, [fold(sequences[row], 44) for row in order], fontsize=7)
        else:
            axes.set_yticks([])
            axes.set_ylabel(f"{len(rows)} sequences", fontsize=9)
        axes.set_title(fold(pair, 64), fontsize=9, loc="left")
        axes.set_ylim(-0.8, len(values) - 0.2)
    panels[-1].set_xlabel(f"difference of {quantity} (dashed: the mean; grey: the margin)")
    return figure
