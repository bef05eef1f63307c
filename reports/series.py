"""Plots of numbers by frame: median and quartiles over repetitions."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from trackmark.reports.figures import add_legend, draw_line, new_figure
from trackmark.reports.palette import colour

QUARTILES = "median and quartiles over"


def quantile_by_frame(values: NDArray[np.floating], q: float = 0.5) -> NDArray[np.floating]:
    """Return a quantile over runs, given (runs, frames); NaN for frames without values."""
    has_values = np.isfinite(values).any(axis=0)
    quantiles = np.full(values.shape[1], np.nan)
    quantiles[has_values] = np.nanquantile(values[:, has_values], q, axis=0)
    return quantiles


def draw_median(
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
    draw_line(axes, frames, quantile_by_frame(values), label, position)
    if len(values) > 1:
        low, high = (quantile_by_frame(values, q) for q in (0.25, 0.75))
        axes.fill_between(frames, low, high, color=colour(position), alpha=0.2, linewidth=0)


def series_plot(
    panels: Mapping[str, Mapping[str, NDArray[np.floating]]],
    title: str,
    quantity: str,
    labels: Sequence[str],
    over: str,
    first: int = 0,
    row_height: float = 1.4,
) -> Figure:
    """Draw one number by frame in panels below each other.

    `panels`: values (runs, frames) by panel and label. `quantity`: quantity of the ordinate with
    its unit. `labels`: all lines in the order of their colours. `over`: meaning of a row of values.
    `first`: number of the first frame. `row_height`: height of a panel [inches].
    """
    figure, all_axes = new_figure(title, 0.8 + row_height * len(panels), len(panels))
    repeated = False
    for axes, (panel, lines) in zip(all_axes, panels.items(), strict=True):
        for label, values in lines.items():
            frames = first + np.arange(values.shape[1])
            draw_median(axes, frames, values, labels.index(label), label)
            repeated |= len(values) > 1
        axes.tick_params(labelsize=8)
        axes.xaxis.set_major_locator(MaxNLocator(4))
        axes.set_ylabel(f"{panel}\n{quantity}", fontsize=8)
    all_axes[-1].set_xlabel("frame", fontsize=8)
    for axes in all_axes:
        axes.set_ylim(bottom=0)
    add_legend(figure, f"{QUARTILES} {over}" if repeated else "")
    return figure
