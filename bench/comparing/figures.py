"""Figures of a comparison, from its numbers."""

from pathlib import Path

import numpy as np
from scipy.stats import kstwo

from trackmark.bench.comparing.comparison import Comparison
from trackmark.bench.comparing.tables import shown_pairs
from trackmark.bench.statistics.survival import kaplan_meier
from trackmark.reports.comparison import (
    Point,
    Steps,
    difference_plot,
    profile_plot,
    speed_accuracy_plot,
    survival_plot,
)
from trackmark.reports.figures import write_figure

SHOWN_PAIRS = 4
"""Number of pairs whose differences are drawn."""


def write_figures(comparison: Comparison, folder: Path) -> list[Path]:
    """Draw what the comparison's numbers allow into a folder, and give the files."""
    measure = comparison.measure
    title = f"{measure.title} on {len(comparison.sequences)} sequences"
    quantity = measure.head
    profiles = {name: _profile(comparison, name) for name in comparison.scores}
    figures = {"profiles": profile_plot(profiles, quantity, title)}
    differences = {
        pair.label: pair.differences * measure.scale
        for pair in shown_pairs(comparison)[:SHOWN_PAIRS]
    }
    if differences:
        margin = measure.margin * measure.scale
        figures["differences"] = difference_plot(
            differences, comparison.sequences, quantity, margin, title
        )
    if survivals := _survivals(comparison):
        words = f"Time to failure on {len(comparison.sequences)} sequences"
        figures["survival"] = survival_plot(survivals, words)
    points = {
        standing.tracker: Point(
            standing.milliseconds,
            standing.mean * measure.scale,
            *(np.array(standing.interval or (np.nan, np.nan)) * measure.scale).tolist(),
        )
        for standing in comparison.standings
        if np.isfinite(standing.milliseconds)
    }
    if points:
        figures["speed-accuracy"] = speed_accuracy_plot(points, quantity, title)
    return [write_figure(folder / f"{name}.png", figure) for name, figure in figures.items()]


def _profile(comparison: Comparison, tracker: str) -> Steps:
    """Share of sequences above each score; the band (Kolmogorov's) holds for all scores at once."""
    means = np.sort([float(run.mean()) for run in comparison.scores[tracker]])
    n = len(means)
    places = np.concatenate([[min(0.0, means[0])], means]) * comparison.measure.scale
    shares = np.concatenate([np.arange(n, 0, -1), [0]]) / n
    reach = float(kstwo.ppf(0.95, n))
    return Steps(places, shares, np.clip(shares - reach, 0, 1), np.clip(shares + reach, 0, 1))


def _survivals(comparison: Comparison) -> dict[str, Steps]:
    survivals = {}
    for name, (ends, lost) in comparison.losses.items():
        if len(ends):
            survival = kaplan_meier(ends, lost)
            columns = [np.concatenate([[1.0], column]) for column in survival[1:]]
            survivals[name] = Steps(np.concatenate([[0.0], survival.times]), *columns)
    return survivals
