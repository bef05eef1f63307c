"""Plots of scores against attributes of sequences, one panel per attribute."""

from collections.abc import Mapping, Sequence
from math import ceil
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from trackmark.reports.figures import add_legend, bare_figure, line_style, named_line
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
    `quantity`: name of the score with its unit.
    """
    labels = list(dict.fromkeys(entry.label for group in panels.values() for entry in group))
    rows = ceil(len(panels) / COLUMNS)
    figure = bare_figure(title, 0.6 + 2.2 * rows)
    grid = figure.subplots(rows, COLUMNS, sharey=True, squeeze=False)
    for axes in grid.ravel()[len(panels) :]:
        axes.set_visible(False)
    for number, (axes, (name, entries)) in enumerate(
        zip(grid.ravel(), panels.items(), strict=False)
    ):
        axes.grid(alpha=0.3)
        axes.spines[["top", "right"]].set_visible(False)
        for entry in entries:
            _draw(axes, entry, labels.index(entry.label))
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
