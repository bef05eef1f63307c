"""Plots of scores over thresholds, frames and time, drawn by Matplotlib."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator
from numpy.typing import NDArray

from trackmark.reports.figures import (
    CROWDED,
    OTHERS,
    add_legend,
    add_names,
    bare_figure,
    draw_line,
    fold,
    named_line,
    new_figure,
)
from trackmark.reports.page.content import Chart, Line
from trackmark.reports.palette import colour
from trackmark.reports.series import QUARTILES, draw_median, quantile_by_frame

Array = NDArray[np.float64]


def chart_plot(chart: Chart, title: str, trackers: Sequence[str] = ()) -> Figure:
    """Draw a chart of a page.

    `trackers`: all trackers of the report in the order of their colours. Trackers without a line,
    because runs failed or are missing, are labelled as incomplete.
    """
    figure, (axes,) = new_figure(title, 4.0 if chart.kind == "dots" else 4.5)
    lines = {line.position: line for line in chart.lines}
    missing = {n: _missing(name, n) for n, name in enumerate(trackers) if n not in lines}
    for _, line in sorted((lines | missing).items()):
        _draw(axes, line, chart.kind, shaded=len(lines | missing) < CROWDED)
    axes.set(xlabel=chart.x, ylabel=chart.y)
    if chart.top is not None:
        axes.set_ylim(0, 1.02 * chart.top)
    if chart.kind != "dots":
        _limit(axes, chart)
    if chart.logarithmic:
        logarithmic_axis(axes, (1, 2, 5))
    if chart.kind == "dots":
        axes.margins(x=0.15)
        add_legend(figure)
    else:
        heading = f"tracker ({chart.value_name})" if chart.value_name else "tracker"
        add_names(figure, axes, heading if chart.kind == "line" else "")
    return figure


def _missing(name: str, position: int) -> Line:
    return Line(f"{name} (incomplete)", position, [np.nan], [np.nan])


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


def logarithmic_axis(axes: Axes, digits: Sequence[int]) -> None:
    """Make the abscissa logarithmic, with plain tick labels that begin with `digits`."""
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=digits))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_locator(NullLocator())


class FrameScores(NamedTuple):
    """Scores of a tracker's runs on a sequence, (runs, frames); NaN if a frame is not judged."""

    overlaps: Array
    errors: Array  # of the centre [px]


def frame_plot(
    title: str, scores: Mapping[int, FrameScores], trackers: Sequence[str], incomplete: set[str]
) -> Figure:
    """Draw overlap and centre error against the frame: median and quartiles over repetitions.

    `scores`: scores by index of the tracker. The legend states the number of runs if there are
    several or the tracker is `incomplete`. More than `CROWDED` trackers get one row each.
    """
    judged = np.any([np.isfinite(entry.errors).any(axis=0) for entry in scores.values()], axis=0)
    first, last = np.flatnonzero(judged)[[0, -1]]
    labels, repeated = {}, any(len(entry.errors) > 1 for entry in scores.values())
    for position, entry in scores.items():
        n, name = len(entry.errors), trackers[position]
        counted = n > 1 or name in incomplete
        labels[position] = f"{name} ({n} run{'s' * (n != 1)})" if counted else name
    heading = f"{QUARTILES} runs" if repeated else ""
    if len(scores) > CROWDED:
        whole = f"{title}: {heading}" if heading else title
        figure = bare_figure(whole, 0.8 + 1.15 * len(scores))
        grid = figure.subplots(len(scores), 2, sharex=True, sharey="col", squeeze=False)
    else:
        figure, axes = new_figure(title, 5.0, rows=2)
        grid = np.array([axes] * len(scores))
    frames = np.arange(first, last + 1)
    for column, part in enumerate(("overlaps", "errors")):
        values = {k: getattr(entry, part)[:, first : last + 1] for k, entry in scores.items()}
        for panel, (position, its) in zip(grid[:, column], values.items(), strict=True):
            for others in values.values() if len(scores) > CROWDED else ():
                panel.plot(frames, quantile_by_frame(others), **OTHERS)
            draw_median(panel, frames, its, position, labels[position])
    _name_frame_axes(grid, list(labels.values()), crowded=len(scores) > CROWDED)
    if len(scores) <= CROWDED:
        add_legend(figure, heading)
    return figure


def _name_frame_axes(grid: NDArray[Any], labels: Sequence[str], *, crowded: bool) -> None:
    """Label and scale the axes of a frame plot; a crowded one has a row per label."""
    small = {"fontsize": 7} if crowded else {}
    for upper, lower in grid if crowded else grid[:1]:
        upper.set_ylabel("overlap", **small)
        lower.set_ylabel("error [px]" if crowded else "centre error [px]", **small)
    if crowded:
        for axes in grid.flat:
            axes.grid(alpha=0.3)
            axes.tick_params(labelsize=7)
        for (axes, _), label in zip(grid, labels, strict=True):
            axes.set_title(fold(label, 96), fontsize=7, loc="left")
        grid[-1, 0].set_xlabel("frame", fontsize=9)
    grid[-1, 1].set_xlabel("frame", **({"fontsize": 9} if crowded else {}))
    grid[0, 0].set_ylim(-0.02, 1.02)
    grid[0, 1].set_ylim(bottom=0)


def speed_plot(
    times: Mapping[str, tuple[float, float]], clock: str, title: str, trackers: Sequence[str]
) -> Figure:
    """Draw CPU time per frame: a dot at the median, a bar to the 95th percentile.

    `times`: both times by tracker [s]; NaN for a tracker with disturbed or failed passes, which
    gets a text instead of a dot. `clock`: `warm` or `as decoded`. `trackers`: all trackers of the
    report in order; trackers without times get no row.
    """
    timed = [(position, name) for position, name in enumerate(trackers) if name in times]
    figure, (axes,) = new_figure(title, 1.4 + 0.42 * len(timed))
    words: dict[str, Any] = {"fontsize": 9}
    for row, (position, name) in enumerate(timed):
        median, tail = np.array(times[name]) * 1e3
        if np.isfinite(median):
            axes.plot([median, tail], [row] * 2, color=colour(position), linewidth=2)
            axes.plot([median], [row], "o", color=colour(position))
            above = {"textcoords": "offset points", "ha": "center", **words}
            axes.annotate(f"{median:.3g} ms", (median, row), (0, 6), **above)
        else:
            beside = {"va": "center", "transform": axes.get_yaxis_transform(), **words}
            axes.text(0.01, row, "disturbed or failed", **beside)
    axes.set_yticks(range(len(timed)), [fold(name, 36) for _, name in timed])
    axes.set_ylim(len(timed) - 0.4, -0.7)
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter("{x:g}")
    axes.margins(x=0.12)
    axes.grid(visible=False, axis="y")
    axes.set_xlabel(f"CPU time a frame, {clock} [ms]: median, bar to the 95th percentile")
    return figure
