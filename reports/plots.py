"""Plots of scores over frames, thresholds and time.

They take a frame table: a row an evaluated frame of a run, with the columns `tracker`,
`sequence`, `repetition`, `frame`, `overlap` (in [0, 1]) and `centre_error` (pixels).
"""

from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from reports.files import write_file
from reports.palette import LINE_STYLES, colour

__all__ = [
    "frame_plot",
    "precision_plot",
    "share_curve",
    "speed_plot",
    "success_plot",
    "write_figure",
]

ERROR_LIMIT = 50
"""Largest centre error of precision plots, in pixels."""


def share_curve(
    values: pd.DataFrame, column: str, thresholds: NDArray[np.float64], *, at_least: bool
) -> NDArray[np.float64]:
    """Share of frames on the good side of each threshold; every sequence counts once.

    Parameters
    ----------
    values : DataFrame
        Frame table of one tracker.
    column : str
        `overlap` or `centre_error`.
    thresholds : ndarray of float64, shape (k,)
        In the unit of the column.
    at_least : bool
        Good is `>=` the threshold, else `<=`.

    Returns
    -------
    ndarray of float64, shape (k,)
        In [0, 1].
    """
    curves = []
    for _, frames in values.groupby("sequence"):
        ordered = np.sort(frames[column].to_numpy())
        if at_least:
            share = 1.0 - np.searchsorted(ordered, thresholds, "left") / len(ordered)
        else:
            share = np.searchsorted(ordered, thresholds, "right") / len(ordered)
        curves.append(share)
    return np.asarray(np.mean(curves, axis=0))


def success_plot(
    frames: pd.DataFrame, title: str, trackers: Sequence[str], incomplete: Collection[str] = ()
) -> Figure:
    """Share of frames with at least an overlap, for every overlap.

    The legend gives the area beneath each curve, which is the mean overlap.

    Parameters
    ----------
    frames : DataFrame
        Frame table.
    title : str
        Headline.
    trackers : sequence of str
        All trackers of the report, in order: each keeps its colour in every plot.
    incomplete : collection of str
        Trackers some of whose runs failed or are missing; they get no curve, but a word.
    """
    thresholds = np.linspace(0.0, 1.0, 1001)
    figure, axes = _figure(title)
    for position, tracker, values in _by_tracker(frames, trackers, incomplete):
        curve, label = np.full(len(thresholds), np.nan), f"{tracker} (incomplete)"
        if len(values):
            curve = share_curve(values, "overlap", thresholds, at_least=True)
            area = values.groupby("sequence")["overlap"].mean().mean()
            label = f"{tracker} ({area:.3f})"
        axes.plot(thresholds, curve, label=label, **_style(position))
    axes.set(xlabel="overlap", ylabel="share of frames with at least that", xlim=(0, 1))
    _finish(figure, axes, title="tracker (area)")
    return figure


def precision_plot(
    frames: pd.DataFrame, title: str, trackers: Sequence[str], incomplete: Collection[str] = ()
) -> Figure:
    """Share of frames with at most a centre error, for every error up to 50 pixels.

    Parameters as `success_plot`.
    """
    thresholds = np.linspace(0.0, ERROR_LIMIT, 501)
    figure, axes = _figure(title)
    for position, tracker, values in _by_tracker(frames, trackers, incomplete):
        curve, label = np.full(len(thresholds), np.nan), f"{tracker} (incomplete)"
        if len(values):
            curve = share_curve(values, "centre_error", thresholds, at_least=False)
            at_20 = share_curve(values, "centre_error", np.array([20.0]), at_least=False)[0]
            label = f"{tracker} ({at_20:.3f})"
        axes.plot(thresholds, curve, label=label, **_style(position))
    axes.set(xlabel="centre error [px]", ylabel="share of frames with at most that")
    axes.set_xlim(0, ERROR_LIMIT)
    _finish(figure, axes, title="tracker (at 20 px)")
    return figure


def frame_plot(frames: pd.DataFrame, sequence: str, trackers: Sequence[str]) -> Figure:
    """Overlap and centre error against the frame: median and quartiles over repetitions.

    Parameters as `success_plot`; runs that failed are not in the frame table.
    """
    figure = Figure(figsize=(9.0, 5.6), dpi=140, layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(sequence, fontsize=11)
    upper, lower = figure.subplots(2, 1, sharex=True)
    here = frames[frames["sequence"] == sequence]
    for position, tracker, values in _by_tracker(here, trackers):
        if values.empty:
            continue
        for axes, column in ((upper, "overlap"), (lower, "centre_error")):
            by_frame = values.groupby("frame")[column]
            median = by_frame.median()
            axes.plot(median.index, median, label=tracker, **_style(position))
            if values["repetition"].max() > values["repetition"].min():
                low, high = by_frame.quantile(0.25), by_frame.quantile(0.75)
                axes.fill_between(
                    median.index, low, high, color=colour(position), alpha=0.2, linewidth=0
                )
    upper.set(ylabel="overlap", ylim=(-0.02, 1.02))
    lower.set(ylabel="centre error [px]", xlabel="frame")
    lower.set_ylim(bottom=0)
    for axes in (upper, lower):
        axes.grid(alpha=0.3)
        axes.spines[["top", "right"]].set_visible(False)
    handles, labels = upper.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=9, frameon=False)
    return figure


def speed_plot(runs: pd.DataFrame, title: str) -> Figure:
    """CPU time per frame: a dot at the median, a bar to the 95th percentile.

    Parameters
    ----------
    runs : DataFrame
        Timing runs with `tracker`, `cpu_seconds_median` and `cpu_seconds_p95`; disturbed
        and failed passes have NaN there, and their trackers get no dot: a mean over the
        rest would be another one.
    title : str
        Headline.
    """
    figure, axes = _figure(title)
    columns = ["cpu_seconds_median", "cpu_seconds_p95"]
    trackers = list(runs["tracker"].unique())
    for position, tracker in enumerate(trackers):
        row = runs.loc[runs["tracker"] == tracker, columns].mean(skipna=False)
        if not np.isfinite(row["cpu_seconds_median"]):
            continue
        median, tail = row["cpu_seconds_median"] * 1e3, row["cpu_seconds_p95"] * 1e3
        axes.plot([median, tail], [position] * 2, color=colour(position), linewidth=2)
        axes.plot([median], [position], "o", color=colour(position))
        axes.annotate(f"{median:.3g} ms", (median, position), (0, 7), textcoords="offset points",
                      ha="center", fontsize=9)  # fmt: skip
    axes.set_yticks(range(len(trackers)), trackers)
    axes.set_ylim(len(trackers) - 0.4, -0.6)
    axes.set_xscale("log")
    axes.set_xlabel("CPU time a frame [ms]: median, bar to the 95th percentile")
    axes.grid(alpha=0.3, axis="x")
    axes.spines[["top", "right"]].set_visible(False)
    return figure


def write_figure(path: Path, figure: Figure) -> Path:
    """Write a figure as PNG, SVG or PDF by its suffix, without a date in it.

    Raises
    ------
    OSError
        Where it can't be written.
    """
    key = {".svg": "Date", ".pdf": "CreationDate"}.get(path.suffix)
    metadata: dict[str, str | None] = {key: None} if key else {"Software": None}
    write: Callable[[Path], None] = lambda file: figure.savefig(file, metadata=metadata)  # noqa: E731
    return write_file(path, write)


def _by_tracker(
    frames: pd.DataFrame, trackers: Sequence[str], incomplete: Collection[str] = ()
) -> list[tuple[int, str, pd.DataFrame]]:
    """Position, name and frames of every tracker; no frames for one that is incomplete."""
    return [
        (position, tracker, frames[(frames["tracker"] == tracker) & (tracker not in incomplete)])
        for position, tracker in enumerate(trackers)
    ]


def _figure(title: str) -> tuple[Figure, Axes]:
    figure = Figure(figsize=(8.0, 4.6), dpi=140, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    axes.set_title(title, fontsize=11)
    return figure, axes


def _style(position: int) -> dict[str, Any]:
    return {
        "color": colour(position),
        "linestyle": LINE_STYLES[position % len(LINE_STYLES)],
        "linewidth": 1.8,
    }


def _finish(figure: Figure, axes: Axes, title: str) -> None:
    axes.set_ylim(0, 1.02)
    axes.grid(alpha=0.3)
    axes.spines[["top", "right"]].set_visible(False)
    figure.legend(loc="outside right upper", title=title, fontsize=9, frameon=False)
