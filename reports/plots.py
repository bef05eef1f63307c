"""Plots: charts of a page, series, attributes, differences and breaking points, by Matplotlib."""

from collections.abc import Mapping, Sequence
from math import ceil
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator
from numpy.typing import ArrayLike, NDArray

from trackmark.reports.charts import Chart, Line
from trackmark.reports.figures import (
    add_legend,
    bare_figure,
    draw_line,
    fold,
    named_line,
    new_figure,
)
from trackmark.reports.palette import colour
from trackmark.reports.svg import CROWDED

QUARTILES = "median and quartiles over"

_COLUMNS = 3  # of panels of attributes
_MAX_HEIGHT = 24.0  # inches
_MAX_NAMED_ROWS = 200  # in all panels of differences; more rows have no room for their names


def chart_plot(chart: Chart, title: str, trackers: Sequence[str] = ()) -> Figure:
    """Draw a chart of a page.

    `trackers`: all trackers of the report in the order of their colours. Trackers without a line,
    because runs failed or are missing, are labelled as incomplete.
    """
    figure, (axes,) = new_figure(title, 4.0 if chart.kind == "dots" else 4.5)
    lines = {line.position: line for line in chart.lines}
    for position, name in enumerate(trackers):
        incomplete = Line(f"{name} (incomplete)", position, [np.nan], [np.nan])
        lines.setdefault(position, incomplete)
    for _, line in sorted(lines.items()):
        _draw(axes, line, chart.kind, shaded=len(lines) < CROWDED)
    axes.set(xlabel=chart.x, ylabel=chart.y)
    if chart.top is not None:
        axes.set_ylim(0, 1.02 * chart.top)
    if chart.kind == "dots":
        axes.margins(x=0.15)
    else:
        _limit(axes, chart)
    if chart.logarithmic:
        logarithmic_axis(axes)
    heading = f"tracker ({chart.value_name})" if chart.value_name else "tracker"
    add_legend(figure, heading if chart.kind == "line" else "")
    return figure


def _draw(axes: Axes, line: Line, kind: str, *, shaded: bool) -> None:
    """Draw a line of a chart with its band, or a dot with its interval."""
    label = f"{line.label} ({line.value})" if line.value else line.label
    x, y, low, high = (np.asarray(part, float) for part in (line.x, line.y, line.low, line.high))
    if kind == "dots":
        axes.plot(x, y, **named_line(label, line.position) | {"linestyle": "none"})
        if np.isfinite(low).any():
            axes.vlines(x, low, high, color=colour(line.position), lw=1.5)
        return
    steps = {"drawstyle": "steps-post"} if kind == "step" else {}
    draw_line(axes, x, y, label, line.position, **steps)
    if shaded and len(low):
        shade: dict[str, Any] = {"color": colour(line.position), "alpha": 0.15, "linewidth": 0}
        axes.fill_between(x, low, high, step="post" if kind == "step" else None, **shade)


def _limit(axes: Axes, chart: Chart) -> None:
    """Limit the abscissa to the extent of the lines, or to [0, 1] for single points."""
    extents = [np.asarray(line.x, float) for line in chart.lines]
    if extents and all(len(x) == 1 for x in extents):
        axes.set_xlim(0, 1.02)
    elif extents:
        ends = np.concatenate(extents)
        axes.set_xlim(left=min(0.0, float(np.nanmin(ends))))
        if chart.kind == "line":
            axes.set_xlim(right=float(np.nanmax(ends)))


def logarithmic_axis(axes: Axes) -> None:
    """Make the abscissa logarithmic, with plain tick labels that begin with 1, 2 or 5."""
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_locator(NullLocator())


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

    `panels`: values (scenes, frames) by panel and label. `quantity`: quantity of the ordinate with
    its unit. `labels`: all lines in the order of their colours. `first`: number of the first frame.
    """
    figure, all_axes = new_figure(title, 0.8 + 1.9 * len(panels), len(panels))
    for axes, (panel, lines) in zip(all_axes, panels.items(), strict=True):
        for label, values in lines.items():
            frames = first + np.arange(values.shape[1])
            draw_median(axes, frames, values, labels.index(label), label)
        axes.tick_params(labelsize=8)
        axes.xaxis.set_major_locator(MaxNLocator(4))
        axes.set_ylabel(f"{panel}\n{quantity}", fontsize=8)
        axes.set_ylim(bottom=0)
    all_axes[-1].set_xlabel("frame", fontsize=8)
    is_repeated = any(len(values) > 1 for lines in panels.values() for values in lines.values())
    add_legend(figure, f"{QUARTILES} scenes" if is_repeated else "")
    return figure


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
    rows = ceil(len(panels) / _COLUMNS)
    figure = bare_figure(title, 0.6 + 2.2 * rows)
    grid = figure.subplots(rows, _COLUMNS, sharey=True, squeeze=False)
    for axes in grid.ravel()[len(panels) :]:
        axes.set_visible(False)
    for axes, (name, entries) in zip(grid.ravel(), panels.items(), strict=False):
        axes.grid(alpha=0.3)
        axes.spines[["top", "right"]].set_visible(False)
        for label, places, scores, bins in entries:
            style = named_line(label, labels.index(label)) | {"markersize": 4.0}
            dots: dict[str, Any] = {"color": style["color"], "alpha": 0.35, "linewidths": 0}
            axes.scatter(places, scores, 8, **dots)
            centres, means, low, high = bins.T
            axes.errorbar(centres, means, (means - low, high - means), **style)
        axes.set_xlabel(name, fontsize=9)
        axes.tick_params(labelsize=8)
    for axes in grid[:, 0]:
        axes.set_ylabel(quantity, fontsize=9)
    add_legend(figure, "dots: sequences; lines: means over bins, 95 % intervals")
    return figure


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


def difference_plot(
    differences: Mapping[str, ArrayLike],
    sequences: Sequence[str],
    quantity: str,
    margin: float,
    title: str,
) -> Figure:
    """Draw a dot per sequence for each pair, sorted by the differences.

    `differences`: differences (n,) by pair (`A - B`), in the order of the n `sequences`; each pair
    is a panel. `quantity`: name of the score with its unit. `margin`: largest irrelevant
    difference; a grey band shows ± margin.
    """
    height = 0.9 + len(differences) * (0.7 + 0.2 * len(sequences))
    figure, panels = new_figure(title, min(height, _MAX_HEIGHT), rows=len(differences))
    named = len(differences) * len(sequences) <= _MAX_NAMED_ROWS
    for axes, (pair, pair_differences) in zip(panels, differences.items(), strict=True):
        values = np.asarray(pair_differences, np.float64)
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
    curves: Mapping[str, SurvivalCurve], quantity: str, title: str, logarithmic: bool
) -> Figure:
    """Draw the share of runs that survive by level of a difficulty, which grows to the right.

    Dots are groups of runs. A bar at one half is the 95 % interval of the breaking point.
    """
    figure, (axes,) = new_figure(title, 4.0)
    for position, (name, curve) in enumerate(curves.items()):
        draw_line(axes, curve.levels, curve.survival, name, position)
        options: dict[str, Any] = {"color": colour(position), "alpha": 0.5, "linewidths": 0}
        axes.scatter(curve.group_levels, curve.shares, 8 * curve.counts, **options)
        ends = [curve.low, curve.high]
        height = 0.5 - 0.015 * position  # below each other
        axes.plot(ends, [height, height], color=colour(position), linewidth=4, alpha=0.6)
    levels = next(iter(curves.values())).levels
    axes.axhline(0.5, color="0.6", linewidth=1, linestyle=":", zorder=0)
    if logarithmic:
        logarithmic_axis(axes)
    axes.set(xlabel=quantity, ylabel="share of runs that survive")
    axes.set(xlim=(levels[0], levels[-1]), ylim=(-0.03, 1.03))
    add_legend(figure)
    return figure


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
