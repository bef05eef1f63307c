"""Plot of the runs that survive by level of a difficulty."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from trackmark.reports.figures import add_legend, draw_line, new_figure
from trackmark.reports.palette import colour
from trackmark.reports.plots import logarithmic_axis


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


def breaking_plot(
    curves: Mapping[str, SurvivalCurve], quantity: str, title: str, logarithmic: bool
) -> Figure:
    """Draw the share of runs that survive by level of a difficulty, which grows to the right.

    Dots are groups of runs. A bar at one half is the 95 % interval of the breaking point.
    """
    figure, (panel,) = new_figure(title, 4.0)
    for position, (name, curve) in enumerate(curves.items()):
        draw_line(panel, curve.levels, curve.survival, name, position)
        options: dict[str, Any] = {"color": colour(position), "alpha": 0.5, "linewidths": 0}
        panel.scatter(curve.group_levels, curve.shares, 8 * curve.counts, **options)
        ends = [curve.low, curve.high]
        height = 0.5 - 0.015 * position  # below each other
        panel.plot(ends, [height, height], color=colour(position), linewidth=4, alpha=0.6)
    levels = next(iter(curves.values())).levels
    panel.axhline(0.5, color="0.6", linewidth=1, linestyle=":", zorder=0)
    if logarithmic:
        logarithmic_axis(panel)
    panel.set(xlabel=quantity, ylabel="share of runs that survive")
    panel.set(xlim=(levels[0], levels[-1]), ylim=(-0.03, 1.03))
    add_legend(figure)
    return figure
