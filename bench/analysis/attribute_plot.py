"""Plot of scores against attributes of sequences."""

from collections.abc import Sequence
from math import ceil
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from trackmark.bench.analysis.by_attribute import Curve
from trackmark.datasets import attributes
from trackmark.reports.figures import add_legend, bare_figure, named_line
from trackmark.reports.tables import ScoreMeasure

_N_COLUMNS = 3


def plot_attributes(curves: Sequence[Curve], measure: ScoreMeasure, title: str) -> Figure:
    """Draw a dot per sequence, and means of bins of sequences with their 95 % intervals.

    Each attribute has a panel. A tracker has the same colour in all panels.
    """
    labels = list(dict.fromkeys(curve.label for curve in curves))
    panels: dict[str, list[Curve]] = {}
    for curve in curves:
        panels.setdefault(attributes.ATTRIBUTES[curve.attribute].heading, []).append(curve)
    n_rows = ceil(len(panels) / _N_COLUMNS)
    figure = bare_figure(title, 0.6 + 2.2 * n_rows)
    grid = figure.subplots(n_rows, _N_COLUMNS, sharey=True, squeeze=False)
    for axes in grid.ravel()[len(panels) :]:
        axes.set_visible(False)
    for axes, (heading, panel_curves) in zip(grid.ravel(), panels.items(), strict=False):
        axes.grid(alpha=0.3)
        axes.spines[["top", "right"]].set_visible(False)
        for curve in panel_curves:
            _draw_curve(axes, curve, measure.scale, labels.index(curve.label))
        axes.set_xlabel(heading, fontsize=9)
        axes.tick_params(labelsize=8)
    for axes in grid[:, 0]:
        axes.set_ylabel(measure.heading, fontsize=9)
    add_legend(figure, "dots: sequences; lines: means over bins, 95 % intervals")
    return figure


def _draw_curve(axes: Axes, curve: Curve, scale: float, position: int) -> None:
    """Draw the sequences and the bins of a tracker, with scores multiplied by a factor."""
    style = named_line(curve.label, position) | {"markersize": 4.0}
    dots: dict[str, Any] = {"color": style["color"], "alpha": 0.35, "linewidths": 0}
    axes.scatter(curve.attribute_values, curve.scores * scale, 8, **dots)
    points = [(bin_.centre, bin_.mean, bin_.low, bin_.high) for bin_ in curve.bins]
    centres, means, low, high = (np.reshape(points, (-1, 4)) * [1.0, *[scale] * 3]).T
    axes.errorbar(centres, means, (means - low, high - means), **style)
