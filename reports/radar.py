"""Radar plots: one axis per attribute, one closed line per tracker."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes

from trackmark.reports.figures import add_legend, bare_figure, named_line


def radar_plot(
    values: Mapping[str, Sequence[float]], heads: Sequence[str], quantity: str, title: str
) -> Figure:
    """Draw scores by attribute, from 0 in the centre to the best score at the edge.

    `values`: scores by tracker, in the order of `heads`; NaN leaves a gap.
    """
    figure = bare_figure(title, 6.5)
    axes = figure.add_subplot(projection="polar")
    assert isinstance(axes, PolarAxes)
    angles = np.linspace(0, 2 * np.pi, len(heads), endpoint=False)
    axes.set_theta_zero_location("N")
    axes.set_theta_direction(-1)
    axes.set_xticks(angles, heads, fontsize=9)
    axes.tick_params(axis="x", pad=12)
    axes.grid(alpha=0.3)
    for position, (label, scores) in enumerate(values.items()):
        axes.plot([*angles, angles[0]], [*scores, scores[0]], **named_line(label, position))
    axes.set_ylim(0)
    axes.tick_params(axis="y", labelsize=8)
    add_legend(figure, f"{quantity}; number of sequences in brackets")
    return figure
