"""Plots of the example: densities of one iteration, and errors by number of samples."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from trackmark.reports.figures import add_legend, bare_figure, line_style, new_figure

Array = NDArray[np.float64]

_MARKER_GREYS = ("black", "0.45", "0.75")


@dataclass(frozen=True)
class Densities:
    """Densities of two quantities at one step."""

    first: Array  # (n,): marginal density of the first quantity
    second: Array  # (m,): marginal density of the second quantity
    both: Array  # (m, n): joint density; rows are values of the second
    marks: Mapping[str, tuple[float, float]]  # pairs that are marked in the plot, by label


def density_plot(
    title: str,
    times: Mapping[str, Densities],
    grids: tuple[Array, Array],
    names: tuple[str, str],
    markers: Sequence[str] = ("x", "o"),
) -> Figure:
    """Draw one row per step: both marginal densities and the joint one.

    `times` contains the densities of each step by its label, and `markers` the Matplotlib marker of
    each step. `grids` are equally spaced values of both quantities, shapes (n,) and (m,), and
    `names` their names.
    """
    figure = bare_figure(title, 2.4 * len(times) + 0.4)
    grid = figure.subplots(len(times), 3, squeeze=False)
    for row, (when, densities), marker in zip(grid, times.items(), markers, strict=True):
        alone = zip(row[:2], grids, (densities.first, densities.second), names, strict=True)
        for index, (axes, values, density, name) in enumerate(alone):
            axes.plot(values, density, color="black", linewidth=1.4)
            axes.set(xlabel=name, xlim=(values[0], values[-1]), ylim=(0, None))
            _mark(axes, {key: (pair[index], 0.0) for key, pair in densities.marks.items()}, marker)
        row[0].set_ylabel(f"{when}\ndensity")
        plane = row[2]
        edges = [(values[0], values[-1]) for values in grids]
        plane.imshow(
            densities.both,
            origin="lower",
            extent=(*edges[0], *edges[1]),
            aspect="auto",
            cmap="Blues",
        )
        plane.set(xlabel=names[0], ylabel=names[1])
        _mark(plane, densities.marks, marker)
    handles, labels = [], []
    for axes in grid[:, 2]:
        found_handles, found_labels = axes.get_legend_handles_labels()
        handles += found_handles
        labels += found_labels
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=8, frameon=False)
    for axes in grid.flat:
        axes.tick_params(labelsize=8)
    return figure


def _mark(axes: Axes, marks: Mapping[str, tuple[float, float]], marker: str) -> None:
    for grey, (label, (x, y)) in zip(_MARKER_GREYS, marks.items(), strict=False):
        look: dict[str, Any] = {"markersize": 8, "markeredgewidth": 2.0}
        look |= {} if marker == "x" else {"markerfacecolor": grey}
        axes.plot(x, y, marker, label=label, color=grey, clip_on=False, zorder=3, **look)


def error_plot(points: pd.DataFrame, title: str, labels: Sequence[str], heading: str) -> Figure:
    """Draw errors with intervals against the number of samples, one line per label.

    `points`: table with the columns `label`, `samples`, `value`, `low` and `high`.
    """
    figure, (axes,) = new_figure(title, 3.4)
    for position, label in enumerate(labels):
        line = points[points["label"] == label].sort_values("samples")
        reach = line["value"] - line["low"], line["high"] - line["value"]
        look: dict[str, Any] = {"capsize": 2, "elinewidth": 1, **line_style(position)}
        axes.errorbar(line["samples"], line["value"], reach, label=label, **look)
    ends = [points["samples"].min(), points["samples"].max()]
    axes.set(xlabel="number of samples", ylabel="error", xscale="log")
    axes.set_xticks(ends, [f"{value:g}" for value in ends])
    axes.set_xticks([], minor=True)
    axes.set_ylim(bottom=0)
    add_legend(figure, heading)
    return figure
