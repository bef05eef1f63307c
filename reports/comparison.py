"""Figures of a comparison: differences by sequence, survival by difficulty."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from trackmark.reports.figures import add_legend, draw_line, fold, new_figure
from trackmark.reports.palette import colour
from trackmark.reports.plots import logarithmic_axis

_MAX_HEIGHT = 24.0  # inches
_MAX_NAMED_ROWS = 200  # in all panels; more rows have no room for their names


class SurvivalCurve(NamedTuple):
    """Survival of a tracker by level of a difficulty.

    `low`, `high`: interval of the breaking point; NaN if it is outside of the range.
    """

    levels: NDArray[np.float64]  # (k,): abscissas of the fitted curve
    survival: NDArray[np.float64]  # (k,)
    group_levels: NDArray[np.float64]  # (m,): mean levels of groups of runs
    shares: NDArray[np.float64]  # (m,): shares that survive
    counts: NDArray[np.float64]  # (m,): numbers of runs
    low: float
    high: float


def difference_plot(
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
    figure, panels = new_figure(title, min(height, _MAX_HEIGHT), rows=len(differences))
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


def breaking_plot(
    curves: Mapping[str, SurvivalCurve], quantity: str, title: str, logarithmic: bool
) -> Figure:
    """Draw the share of runs that survive by level of a difficulty, which grows to the right.

    Dots are groups of runs. A bar at one half is the 95 % interval of the breaking point.
    """
    figure, (axes,) = new_figure(title, 4.0)
    for position, (name, curve) in enumerate(curves.items()):
        draw_line(axes, curve.levels, curve.survival, name, position)
        options: dict[str, Any] = {"color": colour(position), "alpha": 0.5, "linewidths": 0}
        axes.scatter(curve.group_levels, curve.shares, 8 * curve.counts, **options)
        ends = [curve.low, curve.high]
        height = 0.5 - 0.015 * position  # below each other
        axes.plot(ends, [height, height], color=colour(position), linewidth=4, alpha=0.6)
    levels = next(iter(curves.values())).levels
    axes.axhline(0.5, color="0.6", linewidth=1, linestyle=":", zorder=0)
    if logarithmic:
        logarithmic_axis(axes)
    axes.set(xlabel=quantity, ylabel="share of runs that survive")
    axes.set(xlim=(levels[0], levels[-1]), ylim=(-0.03, 1.03))
    add_legend(figure)
    return figure
