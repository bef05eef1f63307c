"""Plots of scores over frames, thresholds and time.

They take a frame table: a row an evaluated frame of a run, with the columns `tracker`,
`sequence`, `repetition`, `frame`, `overlap` (in [0, 1]) and `centre_error` (pixels) of what was
said at once, and `revised`: whether the run revised some boxes later. Headlines say it then.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from trackmark.reports.figures import (
    CROWDED,
    OTHERS,
    add_legend,
    add_names,
    bare_figure,
    draw_line,
    fold,
    new_figure,
)
from trackmark.reports.palette import colour
from trackmark.reports.series import draw_median
from trackmark.reports.tables import timed_by

TRACE_WORDS: Mapping[str, str] = {
    "online": "said at once (online)",
    "revised": "said in the end (revised)",
}
"""What pictures call boxes of trackers that revise some of them later."""

ERROR_LIMIT = 50  # largest centre error of precision plots [pixels]


def share_curve(
    values: pd.DataFrame, column: str, thresholds: NDArray[np.float64], *, at_least: bool
) -> NDArray[np.float64]:
    """Share of frames on the good side of each of k thresholds, (k,) in [0, 1].

    Every sequence of the tracker's frame table counts once. Thresholds are in the unit of the
    column, `overlap` or `centre_error`; good is `>=` (`at_least`) or `<=`, and a frame without a
    value is never good.
    """
    curves = [
        share_of(frames[column].to_numpy(np.float64), thresholds, at_least=at_least)
        for _, frames in values.groupby("sequence")
    ]
    return np.asarray(np.mean(curves, axis=0))


def share_of(
    values: NDArray[np.float64], thresholds: NDArray[np.float64], *, at_least: bool
) -> NDArray[np.float64]:
    """As `share_curve`, of the frames of one sequence: `values` (n,), n at least 1."""
    ordered = np.sort(np.where(np.isnan(values), -np.inf if at_least else np.inf, values))
    if at_least:
        return np.asarray(1.0 - np.searchsorted(ordered, thresholds, "left") / len(ordered))
    return np.asarray(np.searchsorted(ordered, thresholds, "right") / len(ordered))


def success_plot(
    frames: pd.DataFrame, title: str, trackers: Sequence[str], incomplete: Collection[str] = ()
) -> Figure:
    """Share of frames with at least an overlap, for every overlap.

    The legend gives the area beneath each curve, which is the mean overlap.

    Parameters
    ----------
    frames : DataFrame
        Frame table.
    trackers : sequence of str
        All trackers of the report, in order: each keeps its colour in every plot.
    incomplete : collection of str
        Trackers some of whose runs failed or are missing; they get no curve, but a word.
    """

    def area(values: pd.DataFrame) -> float:
        return float(values["overlap"].fillna(0).groupby(values["sequence"]).mean().mean())

    thresholds = np.linspace(0.0, 1.0, 1001)
    figure, (axes,) = new_figure(_headline(title, frames), 4.6)
    for position, tracker, values in _by_tracker(frames, trackers, incomplete):
        _draw_shares(axes, values, "overlap", thresholds, position, tracker, area)
    axes.set(xlabel="overlap", ylabel="share of frames with at least that")
    add_names(figure, axes, "tracker (area)")
    return figure


def precision_plot(
    frames: pd.DataFrame, title: str, trackers: Sequence[str], incomplete: Collection[str] = ()
) -> Figure:
    """Share of frames with at most a centre error, for every error up to 50 pixels.

    Parameters as `success_plot`.
    """

    def share_at_20(values: pd.DataFrame) -> float:
        return float(share_curve(values, "centre_error", np.array([20.0]), at_least=False)[0])

    thresholds = np.linspace(0.0, ERROR_LIMIT, 501)
    figure, (axes,) = new_figure(_headline(title, frames), 4.6)
    for position, tracker, values in _by_tracker(frames, trackers, incomplete):
        _draw_shares(axes, values, "centre_error", thresholds, position, tracker, share_at_20)
    axes.set(xlabel="centre error [px]", ylabel="share of frames with at most that")
    add_names(figure, axes, "tracker (share at 20 px)")
    return figure


def curve_plot(
    curves: Mapping[str, NDArray[np.float64]],
    x: str,
    y: str,
    title: str,
    trackers: Sequence[str],
) -> Figure:
    """Curves that a metrics preset defines, or points where they have one alone.

    Parameters
    ----------
    curves : mapping of str to ndarray of float64, shape (k, 2)
        Points by tracker; those that lack are named as incomplete.
    x, y, title : str
        What the axes show, and the headline.
    trackers : sequence of str
        As of `success_plot`.
    """
    figure, (axes,) = new_figure(title, 4.6)
    for position, tracker in enumerate(trackers):
        points = curves.get(tracker, np.full((1, 2), np.nan))
        label = tracker if tracker in curves else f"{tracker} (incomplete)"
        draw_line(axes, points[:, 0], points[:, 1], label, position)
    axes.set(xlabel=x, ylabel=y, ylim=(0, 1.02))
    if all(len(points) == 1 for points in curves.values()):
        axes.set_xlim(0, 1.02)
    add_names(figure, axes, "tracker")
    return figure


def frame_plot(
    frames: pd.DataFrame, sequence: str, trackers: Sequence[str], incomplete: Collection[str] = ()
) -> Figure:
    """Overlap and centre error against the frame: median and quartiles over repetitions.

    Where there are more lines than a plot has room for, each has a row of its own. Parameters as
    `success_plot`. Frames that were not evaluated, because the target is
    absent, are gaps. Runs that failed are not in the frame table: where there are several
    runs, or should be, the legend says how many the median is over.
    """
    here = frames[frames["sequence"] == sequence]
    every_frame = pd.RangeIndex(here["frame"].min(), here["frame"].max() + 1)
    heading = ""
    drawn: list[tuple[int, str, pd.DataFrame]] = []
    for position, tracker, values in _by_tracker(here, trackers):
        runs = values["repetition"].nunique()
        if not runs and tracker not in incomplete:
            continue
        label = tracker
        if runs > 1 or tracker in incomplete:
            label = f"{tracker} ({runs} run{'' if runs == 1 else 's'})"
        drawn.append((position, label, values))
        if runs > 1:
            heading = "median and quartiles over runs"
    headline = _headline(sequence, here)
    if len(drawn) > CROWDED:
        return _frame_panels(headline, drawn, heading, every_frame)
    figure, (upper, lower) = new_figure(headline, 5.0, rows=2)
    for position, label, values in drawn:
        for axes, column in ((upper, "overlap"), (lower, "centre_error")):
            draw_median(axes, values, column, position, label, every_frame)
    upper.set(ylabel="overlap", ylim=(-0.02, 1.02))
    lower.set(ylabel="centre error [px]", xlabel="frame")
    lower.set_ylim(bottom=0)
    add_legend(figure, heading)
    return figure


def speed_plot(runs: pd.DataFrame, title: str, trackers: Sequence[str]) -> Figure:
    """CPU time per frame: a dot at the median, a bar to the 95th percentile.

    Parameters
    ----------
    runs : DataFrame
        Timing runs with `tracker` and the columns that `reports.tables.timed_by` names, which are
        NaN in disturbed and failed passes: the trackers of these get a word instead of a dot, as a
        mean over the rest would be another one.
    trackers : sequence of str
        All trackers of the report, in order; those that were not timed get no row.
    """
    clock = timed_by(runs)
    columns = [f"{clock}_median", f"{clock}_p95"]
    means = {
        str(tracker): times[columns].mean(skipna=False).to_numpy() * 1e3
        for tracker, times in runs.groupby("tracker")
    }
    timed = [(position, name) for position, name in enumerate(trackers) if name in means]
    figure, (axes,) = new_figure(title, 1.4 + 0.42 * len(timed))
    for row, (position, tracker) in enumerate(timed):
        median, tail = means[tracker]
        if np.isfinite(median):
            _time_bar(axes, row, median, tail, colour(position))
        else:
            options: dict[str, Any] = {"va": "center", "fontsize": 9}
            options["transform"] = axes.get_yaxis_transform()
            axes.text(0.01, row, "disturbed or failed", **options)
    axes.set_yticks(range(len(timed)), [fold(tracker, 36) for _, tracker in timed])
    axes.set_ylim(len(timed) - 0.4, -0.7)
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter("{x:g}")
    axes.margins(x=0.12)
    axes.grid(visible=False, axis="y")
    how = "warm" if clock == "warm_seconds" else "as decoded"
    axes.set_xlabel(f"CPU time a frame, {how} [ms]: median, bar to the 95th percentile")
    return figure


def _frame_panels(
    title: str,
    drawn: Sequence[tuple[int, str, pd.DataFrame]],
    heading: str,
    every_frame: pd.RangeIndex,
) -> Figure:
    """A row a line, the others' medians in grey behind it: overlap left, centre error right."""
    figure = bare_figure(f"{title}: {heading}" if heading else title, 0.8 + 1.15 * len(drawn))
    grid = figure.subplots(len(drawn), 2, sharex=True, sharey="col", squeeze=False)
    for number, (column, name) in enumerate(
        {"overlap": "overlap", "centre_error": "error [px]"}.items()
    ):
        medians = [values.groupby("frame")[column].median() for _, _, values in drawn]
        for axes, (position, label, values) in zip(grid[:, number], drawn, strict=True):
            for median in medians:
                axes.plot(every_frame, median.reindex(every_frame), **OTHERS)
            draw_median(axes, values, column, position, label, every_frame)
            axes.grid(alpha=0.3)
            axes.tick_params(labelsize=7)
            axes.set_ylabel(name, fontsize=7)
        grid[-1, number].set_xlabel("frame", fontsize=9)
    for axes, (_, label, _) in zip(grid[:, 0], drawn, strict=True):
        axes.set_title(fold(label, 96), fontsize=7, loc="left")
    grid[0, 0].set_ylim(-0.02, 1.02)
    grid[0, 1].set_ylim(bottom=0)
    return figure


def _draw_shares(
    axes: Axes,
    values: pd.DataFrame,
    column: str,
    thresholds: NDArray[np.float64],
    position: int,
    tracker: str,
    figure_of: Callable[[pd.DataFrame], float],
) -> None:
    """A tracker's share curve, named with its figure; an incomplete one has a name alone."""
    curve, label = np.full(len(thresholds), np.nan), f"{tracker} (incomplete)"
    if len(values):
        curve = share_curve(values, column, thresholds, at_least=column == "overlap")
        label = f"{tracker} ({figure_of(values):.3f})"
    draw_line(axes, thresholds, curve, label, position)
    axes.set(xlim=(0, thresholds[-1]), ylim=(0, 1.02))


def _headline(title: str, frames: pd.DataFrame) -> str:
    """A title that says which boxes these are, where others were said later."""
    return f"{title}, {TRACE_WORDS['online']}" if frames["revised"].any() else title


def _time_bar(axes: Axes, row: int, median: float, tail: float, shade: str) -> None:
    axes.plot([median, tail], [row] * 2, color=shade, linewidth=2)
    axes.plot([median], [row], "o", color=shade)
    options: dict[str, Any] = {"textcoords": "offset points", "ha": "center", "fontsize": 9}
    axes.annotate(f"{median:.3g} ms", (median, row), (0, 6), **options)


def _by_tracker(
    frames: pd.DataFrame, trackers: Sequence[str], incomplete: Collection[str] = ()
) -> list[tuple[int, str, pd.DataFrame]]:
    """Position, name and frames of every tracker; no frames for one that is incomplete."""
    return [
        (position, tracker, frames[(frames["tracker"] == tracker) & (tracker not in incomplete)])
        for position, tracker in enumerate(trackers)
    ]
