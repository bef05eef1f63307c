"""Plots that several papers share: numbers by frame, and images or maps next to each other."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from trackmark.reports.figures import (
    add_legend,
    bare_figure,
    draw_image,
    draw_line,
    new_figure,
    outline_effect,
)
from trackmark.reports.palette import colour


def _draw_median(
    axes: Axes,
    frames: NDArray[np.integer],
    values: NDArray[np.floating],
    position: int,
    label: str,
) -> None:
    """Draw the median of (runs, frames) as a line and the quartiles as a band.

    A single run has no band; a frame without values is a gap. `position`: index of colour and
    dashes.
    """
    by_frame = pd.DataFrame(values)
    draw_line(axes, frames, by_frame.median(), label, position)
    if len(values) > 1:
        low, high = (by_frame.quantile(q) for q in (0.25, 0.75))
        axes.fill_between(frames, low, high, color=colour(position), alpha=0.2, linewidth=0)


def series_plot(
    panels: Mapping[str, Mapping[str, NDArray[np.floating]]],
    title: str,
    quantity: str,
    labels: Sequence[str],
    first: int = 0,
) -> Figure:
    """Draw one number by frame in panels below each other.

    `panels` contains values of the shape (scenes, frames) by panel and label. `quantity` names the
    ordinate with its unit. Lines are coloured in the order of `labels`, so that a tracker has the
    same colour in each panel. Frames are numbered from `first`, as in the paper.
    """
    figure, all_axes = new_figure(title, 0.8 + 1.9 * len(panels), len(panels))
    for axes, (panel, lines) in zip(all_axes, panels.items(), strict=True):
        for label, values in lines.items():
            frames = first + np.arange(values.shape[1])
            _draw_median(axes, frames, values, labels.index(label), label)
        axes.tick_params(labelsize=8)
        axes.xaxis.set_major_locator(MaxNLocator(4))
        axes.set_ylabel(f"{panel}\n{quantity}", fontsize=8)
        axes.set_ylim(bottom=0)
    all_axes[-1].set_xlabel("frame", fontsize=8)
    is_repeated = any(len(values) > 1 for lines in panels.values() for values in lines.values())
    add_legend(figure, "median and quartiles over scenes" if is_repeated else "")
    return figure


@dataclass(frozen=True)
class Panel:
    """Panel of `map_plot`: an image or a map, with a box or a contour."""

    title: str
    image: NDArray[np.uint8] | NDArray[np.float64]  # see `draw_image`
    box: NDArray[np.float64] | None = None  # `[x, y, width, height]` [px]
    contour: NDArray[np.float64] | None = None  # (points, 2): closed polygon [px]


def map_plot(panels: Sequence[Panel], title: str, columns: int) -> Figure:
    """Draw panels of equal size in a grid with so many columns."""
    rows = -(-len(panels) // columns)
    height, width = panels[0].image.shape[:2]
    figure = bare_figure(title, 0.6 + rows * (0.3 + 8.0 / columns * height / width))
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes in grid:
        axes.set_axis_off()
    for axes, panel in zip(grid, panels, strict=False):
        draw_image(axes, panel.image)
        axes.set_title(panel.title, fontsize=9)
        line: dict[str, Any] = {"fill": False, "edgecolor": colour(1)}
        if panel.box is not None:
            x, y, *size = panel.box.tolist()
            axes.add_patch(Rectangle((x, y), *size, **line))
        if panel.contour is not None:
            line |= {"linewidth": 1.8, "path_effects": outline_effect(3.2)}
            axes.add_patch(Polygon(panel.contour, **line))
    return figure
