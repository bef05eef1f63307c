"""Scores against attributes of sequences: small multiples, a panel an attribute."""

from collections.abc import Mapping, Sequence
from math import ceil
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from trackmark.reports.figures import (
    CROWDED,
    OTHERS,
    add_legend,
    bare_figure,
    line_style,
    named_line,
)
from trackmark.reports.palette import colour

COLUMNS = 3


class Against(NamedTuple):
    """Scores of a label, the same in every panel, against an attribute."""

    label: str
    places: NDArray[np.float64]  # (n,): attribute by sequence
    scores: NDArray[np.float64]  # (n,)
    bins: NDArray[np.float64]  # (k, 4): mean of the attribute, mean of the scores, its interval


def attribute_plot(panels: Mapping[str, Sequence[Against]], quantity: str, title: str) -> Figure:
    """A dot a sequence, and over bins of sequences the mean with its 95 % interval.

    `panels`: by name of the attribute with its unit, a label in the same colour in each.
    `quantity`: what the scores are, with their unit. Where a panel has no room for all labels, an
    attribute has several with some of them each, and the others' lines in grey behind.
    """
    labels = list(dict.fromkeys(one.label for drawn in panels.values() for one in drawn))
    share = ceil(len(labels) / ceil(len(labels) / CROWDED))
    groups = [labels[first : first + share] for first in range(0, len(labels), share)]
    places = [(name, group) for name in panels for group in groups]
    rows = ceil(len(places) / COLUMNS)
    figure = bare_figure(title, 0.6 + 2.2 * rows)
    grid = figure.subplots(rows, COLUMNS, sharey=True, squeeze=False)
    for axes in grid.ravel()[len(places) :]:
        axes.set_visible(False)
    for number, (axes, (name, group)) in enumerate(zip(grid.ravel(), places, strict=False)):
        axes.grid(alpha=0.3)
        axes.spines[["top", "right"]].set_visible(False)
        for one in panels[name]:
            if one.label in group:
                _draw(axes, one, labels.index(one.label))
            else:
                axes.plot(*one.bins[:, :2].T, **OTHERS)
        axes.set_xlabel(name, fontsize=9)
        axes.tick_params(labelsize=8)
        if number % COLUMNS == 0:
            axes.set_ylabel(quantity, fontsize=9)
    for position, label in enumerate(labels):
        grid[0, 0].plot([], [], **named_line(label, position))
    add_legend(figure, "dots: sequences; lines: means over bins, 95 % intervals")
    return figure


def _draw(axes: Axes, one: Against, position: int) -> None:
    shade = colour(position)
    axes.scatter(one.places, one.scores, 8, color=shade, alpha=0.35, linewidths=0)
    centres, means, low, high = one.bins.T
    style = line_style(position) | {"markersize": 4.0}
    axes.errorbar(centres, means, (means - low, high - means), **style)
