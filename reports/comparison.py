"""Figures of a comparison: differences by sequence, survival by level of a difficulty."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from trackmark.reports.figures import (
    CROWDED,
    OTHERS,
    add_legend,
    draw_line,
    fold,
    new_figure,
    panels_each,
)
from trackmark.reports.palette import colour
from trackmark.reports.plots import logarithmic_axis

TALLEST = 24.0  # inches
NAMED_ROWS = 200
"""Rows of all panels up to which there is room for a name each in a plot so tall."""


class Breaks(NamedTuple):
    """Survival of a tracker against the level of a difficulty.

    `levels` and `survival` (k,) are the fitted curve; `seen`, `shares` and `counts` (m,) runs in
    groups: mean level, share that survived, how many. The breaking point lies between `low` and
    `high`; NaN where it is beyond the range.
    """

    levels: NDArray[np.float64]
    survival: NDArray[np.float64]
    seen: NDArray[np.float64]
    shares: NDArray[np.float64]
    counts: NDArray[np.float64]
    low: float
    high: float


def difference_plot(
    differences: Mapping[str, ArrayLike],
    sequences: Sequence[str],
    quantity: str,
    margin: float,
    title: str,
) -> Figure:
    """A dot a sequence for every pair, its sequences in the order of the differences.

    Parameters
    ----------
    differences : mapping of str to array of float, shape (n,)
        By pair (`A - B`), in the order of `sequences`; a pair is a panel.
    sequences : sequence of str
        Names of the n sequences.
    quantity : str
        What differs, with its unit.
    margin : float
        Differences within ± margin lie on a grey band: they mean nothing in practice.
    title : str
        Headline.
    """
    height = 0.9 + len(differences) * (0.7 + 0.2 * len(sequences))
    figure, panels = new_figure(title, min(height, TALLEST), rows=len(differences))
    named = len(differences) * len(sequences) <= NAMED_ROWS
    for axes, (pair, found) in zip(panels, differences.items(), strict=True):
        values = np.asarray(found, np.float64)
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
    curves: Mapping[str, Breaks], quantity: str, title: str, logarithmic: bool
) -> Figure:
    """Share of runs that survive against the level of a difficulty, which grows to the right.

    Dots are runs in groups; a bar by one half is the 95 % interval of where the curve crosses it.
    """
    figure, (whole,) = new_figure(title, 4.0)
    whole.set(xlabel=quantity, ylabel="share of runs that survive")
    crowded = len(curves) > CROWDED
    panels = panels_each(figure, whole, list(curves)) if crowded else [whole] * len(curves)
    for position, (axes, (name, curve)) in enumerate(zip(panels, curves.items(), strict=True)):
        for other in curves.values() if crowded else ():
            axes.plot(other.levels, other.survival, **OTHERS)
        draw_line(axes, curve.levels, curve.survival, name, position)
        options: dict[str, Any] = {"color": colour(position), "alpha": 0.5, "linewidths": 0}
        axes.scatter(curve.seen, curve.shares, 8 * curve.counts, **options)
        ends = [curve.low, curve.high]
        height = 0.5 if crowded else 0.5 - 0.015 * position  # beneath one another
        axes.plot(ends, [height, height], color=colour(position), linewidth=4, alpha=0.6)
    some = next(iter(curves.values()))
    for axes in dict.fromkeys(panels):
        axes.axhline(0.5, color="0.6", linewidth=1, linestyle=":", zorder=0)
        axes.set_ylim(-0.03, 1.03)
        if logarithmic:
            logarithmic_axis(axes, (1,) if crowded else (1, 2, 5))
        axes.set_xlim(some.levels[0], some.levels[-1])
    if not crowded:
        add_legend(figure)
    return figure
