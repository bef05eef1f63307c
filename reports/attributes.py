"""Plots of scores against attributes of sequences, one panel per attribute."""

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


class AttributeScores(NamedTuple):
    """Scores of a tracker against an attribute."""

    label: str
    places: NDArray[np.float64]  # (n,): attribute by sequence
    scores: NDArray[np.float64]  # (n,)
    bins: NDArray[np.float64]  # (k, 4): mean of the attribute, mean of the scores, its interval


def attribute_plot(
    panels: Mapping[str, Sequence[AttributeScores]], quantity: str, title: str
) -> Figure:
    """Draw a dot per sequence, and means of bins of sequences with their 95 % intervals.

    `panels`: scores by attribute with its unit; a label has the same colour in each panel.
    `quantity`: name of the score with its unit. With more than `CROWDED` labels an attribute has
    several panels: each shows some labels, with the lines of the others in grey.
    """
    labels = list(dict.fromkeys(entry.label for group in panels.values() for entry in group))
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
        for entry in panels[name]:
            if entry.label in group:
                _draw(axes, entry, labels.index(entry.label))
            else:
                axes.plot(*entry.bins[:, :2].T, **OTHERS)
        axes.set_xlabel(name, fontsize=9)
        axes.tick_params(labelsize=8)
        if number % COLUMNS == 0:
            axes.set_ylabel(quantity, fontsize=9)
    for position, label in enumerate(labels):
        grid[0, 0].plot([], [], **named_line(label, position))
    add_legend(figure, "dots: sequences; lines: means over bins, 95 % intervals")
    return figure


def _draw(axes: Axes, entry: AttributeScores, position: int) -> None:
    shade = colour(position)
    axes.scatter(entry.places, entry.scores, 8, color=shade, alpha=0.35, linewidths=0)
    centres, means, low, high = entry.bins.T
    style = line_style(position) | {"markersize": 4.0}
    axes.errorbar(centres, means, (means - low, high - means), **style)
