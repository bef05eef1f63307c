"""Figures of a comparison."""

from pathlib import Path

import numpy as np
from scipy.stats import kstwo

from trackmark.bench.comparing.comparison import Comparison
from trackmark.bench.comparing.tables import shown_pairs
from trackmark.bench.reporting.shared_charts import speed_chart, survival_chart, survival_line
from trackmark.reports.figures import write_figure
from trackmark.reports.page.content import Chart, Line
from trackmark.reports.plots import chart_plot, difference_plot

SHOWN_PAIRS = 4
"""Number of pairs whose differences are drawn."""


def write_figures(comparison: Comparison, folder: Path) -> list[Path]:
    """Write the figures of a comparison into a folder; return the files."""
    measure = comparison.measure
    title = f"{measure.title} on {len(comparison.sequences)} sequences"
    profiles = [
        _profile(comparison, name, position) for position, name in enumerate(comparison.scores)
    ]
    words = "share of sequences with at least this score"
    profile = Chart("", measure.head, words, profiles, "", "step", top=1.0)
    figures = {"profiles": chart_plot(profile, title)}
    differences = {
        pair.label: pair.differences * measure.scale
        for pair in shown_pairs(comparison)[:SHOWN_PAIRS]
    }
    if differences:
        margin = measure.margin * measure.scale
        figures["differences"] = difference_plot(
            differences, comparison.sequences, measure.head, margin, title
        )
    survivals = [
        survival_line(name, position, ends, lost)
        for position, (name, (ends, lost)) in enumerate(comparison.losses.items())
        if len(ends)
    ]
    if survivals:
        words = f"Time to failure on {len(comparison.sequences)} sequences"
        figures["survival"] = chart_plot(survival_chart(survivals), words)
    points = list[Line]()
    for standing in comparison.standings:
        if np.isfinite(standing.milliseconds):
            ends = np.array(standing.interval or (np.nan, np.nan)) * measure.scale
            x, y, low, high = standing.milliseconds, standing.mean * measure.scale, *ends
            mark = f" ({standing.clock})" if standing.clock else ""
            label = standing.tracker + mark
            points.append(Line(label, len(points), [x], [y], [low], [high]))
    if points:
        chart = speed_chart(points, "time a frame [ms]", measure.head)
        figures["speed-accuracy"] = chart_plot(chart, title)
    return [write_figure(folder / f"{name}.png", figure) for name, figure in figures.items()]


def _profile(comparison: Comparison, tracker: str, position: int) -> Line:
    """Return the share of sequences above each score, with Kolmogorov's simultaneous band."""
    means = np.sort([float(run.mean()) for run in comparison.scores[tracker]])
    n = len(means)
    places = np.concatenate([[min(0.0, means[0])], means]) * comparison.measure.scale
    shares = np.concatenate([np.arange(n, 0, -1), [0]]) / n
    reach = float(kstwo.ppf(0.95, n))
    band = np.clip(shares - reach, 0, 1), np.clip(shares + reach, 0, 1)
    return Line(tracker, position, places, shares, *band)
