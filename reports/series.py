"""Numbers over frames: median and quartiles over repetitions, or whatever repeats.

They take a series table: a row a frame of a run, with the columns `label` (which line it belongs
to), `repetition`, `frame` and `value`. A frame without a row, or with NaN, is a gap.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from trackmark.reports.figures import add_legend, draw_line, new_figure
from trackmark.reports.palette import colour

QUARTILES = "median and quartiles over"
REPETITIONS = "repetitions"
_GREYS = (0.93, 0.82, 0.7)
_LEVEL_STYLE: dict[str, Any] = {"color": "black", "linestyle": "--", "linewidth": 1.2}
_TRUTH_STYLE: dict[str, Any] = {"color": "#444444", "linestyle": (0, (4, 2)), "linewidth": 1.3}


def draw_median(
    axes: Axes, runs: pd.DataFrame, column: str, position: int, label: str, every_frame: pd.Index
) -> None:
    """Draw the median over repetitions as a line, and their quartiles as a band about it.

    `runs` have `frame`, `repetition` and `column`; a single repetition gets no band. Colour and
    dashes follow from the line's `position` among others. Of the frames from the first to the
    last, `every_frame`, those without a value are gaps.
    """
    by_frame = runs.groupby("frame")[column]
    median = by_frame.median().reindex(every_frame)
    draw_line(axes, median.index, median, label, position)
    if _repeated(runs):
        low, high = (by_frame.quantile(q).reindex(every_frame) for q in (0.25, 0.75))
        axes.fill_between(median.index, low, high, color=colour(position), alpha=0.2, linewidth=0)


def series_plot(
    series: pd.DataFrame,
    title: str,
    quantity: str,
    labels: Sequence[str],
    truth: NDArray[np.float64] | None = None,
    over: str = REPETITIONS,
) -> Figure:
    """One number over frames, a line a label.

    The ordinate is a `quantity` with its unit; lines, `labels`, keep their colours; `truth` (n,) is
    the true number by frame, drawn dashed and grey; `over` is what `repetition` counts.
    """
    figure, (axes,) = new_figure(title, 3.6)
    _draw_lines(axes, series, labels, truth)
    axes.set(xlabel="frame", ylabel=quantity)
    axes.set_ylim(bottom=0)
    add_legend(figure, _heading(series, over))
    return figure


def series_grid(
    series: pd.DataFrame,
    title: str,
    quantity: str,
    labels: Sequence[str],
    truths: Mapping[str, NDArray[np.float64]],
    over: str = REPETITIONS,
    row_height: float = 1.4,
    *,
    shades: Mapping[str, Mapping[str, NDArray[np.bool_]]] | None = None,
    level: tuple[str, float] | None = None,
) -> Figure:
    """One number over frames, as small multiples: a row a reading, a column a scene.

    The series table has `reading` and `scene`, too, both text, in the order to be shown. `truths`
    (n,) are by scene; a row is so many inches high. `shades` are by scene frames (n,) to be shaded,
    by what the legend says of them, each kind darker than the last; `level` is a number that is
    drawn as a dashed line, after what the legend says of it. See `series_plot` for the rest.
    """
    readings = list(dict.fromkeys(series["reading"]))
    scenes = list(dict.fromkeys(series["scene"]))
    height = 0.8 + row_height * len(readings)
    figure, all_axes = new_figure(title, height, len(readings), len(scenes))
    places = [(reading, scene) for reading in readings for scene in scenes]
    for axes, (reading, scene) in zip(all_axes, places, strict=True):
        here = series[(series["reading"] == reading) & (series["scene"] == scene)]
        _draw_lines(axes, here, labels, truths.get(scene))
        if level is not None:
            axes.axhline(level[1], label=level[0], **_LEVEL_STYLE)
        _shade([axes], (shades or {}).get(scene, {}))
        axes.tick_params(labelsize=8)
        axes.xaxis.set_major_locator(MaxNLocator(4))
        if reading == readings[0]:
            axes.set_title(scene, fontsize=9)
        if scene == scenes[0]:
            axes.set_ylabel(f"{reading}\n{quantity}", fontsize=8)
        if reading == readings[-1]:
            axes.set_xlabel("frame", fontsize=8)
    all_axes[0].set_ylim(bottom=0)
    add_legend(figure, _heading(series, over))
    return figure


def appearance_plot(
    frames: pd.DataFrame, title: str, threshold: float, shades: Mapping[str, NDArray[np.bool_]]
) -> Figure:
    """Positive appearances a frame above, and beneath how many runs were initialising.

    A row is a frame of a run: `repetition`, `frame`, `positive_appearances` (samples that fulfil
    the appearance condition), `mode` (0 initialising, 1 tracking). The mode changes at `threshold`
    appearances, a dashed line; `shades` are frames (n,) as in `series_grid`.
    """
    figure, (upper, lower) = new_figure(title, 4.4, rows=2, heights=(3, 1))
    every_frame = pd.RangeIndex(frames["frame"].min(), frames["frame"].max() + 1)
    draw_median(upper, frames, "positive_appearances", 0, "positive appearances", every_frame)
    upper.axhline(threshold, label="threshold b·N", **_LEVEL_STYLE)
    initialising = 1.0 - frames.groupby("frame")["mode"].mean().reindex(every_frame)
    lower.fill_between(every_frame, initialising, step="mid", color=colour(1), linewidth=0)
    _shade([upper, lower], shades)
    upper.set(ylabel="samples", xlim=(every_frame[0], every_frame[-1]))
    upper.set_ylim(bottom=0)
    runs = frames["repetition"].nunique()
    lower.set(ylabel="runs in\ninitialisation", xlabel="frame", ylim=(0, 1))
    lower.set_yticks([0, 0.5, 1], ["0", "", str(runs)])
    add_legend(figure, f"{QUARTILES} {REPETITIONS}" if runs > 1 else "")
    return figure


def _draw_lines(
    axes: Axes, series: pd.DataFrame, labels: Sequence[str], truth: NDArray[np.float64] | None
) -> None:
    if truth is not None:
        axes.plot(np.arange(len(truth)), truth, label="truth", **_TRUTH_STYLE)
    for position, label in enumerate(labels):
        runs = series[series["label"] == label]
        if len(runs):
            every_frame = pd.RangeIndex(runs["frame"].min(), runs["frame"].max() + 1)
            draw_median(axes, runs, "value", position, label, every_frame)


def _shade(all_axes: Sequence[Axes], shades: Mapping[str, NDArray[np.bool_]]) -> None:
    """Shade frames in all axes, each kind darker than the last; the first axes name the kinds."""
    for grey, (kind, flags) in zip(_GREYS, shades.items(), strict=False):
        for number, (start, stop) in enumerate(_spans(flags)):
            for axes in all_axes:
                label = kind if axes is all_axes[0] and number == 0 else None
                axes.axvspan(
                    start - 0.5, stop - 0.5, color=str(grey), zorder=0, linewidth=0, label=label
                )


def _heading(series: pd.DataFrame, over: str) -> str:
    return f"{QUARTILES} {over}" if _repeated(series) else ""


def _repeated(runs: pd.DataFrame) -> bool:
    """Whether there are several repetitions: only then there are quartiles."""
    return len(runs["repetition"].unique()) > 1


def _spans(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First frame and the one after the last, of every stretch of frames that are flagged."""
    edges = np.diff(np.concatenate([[False], flags, [False]]).astype(int))
    starts, stops = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    return list(zip(starts.tolist(), stops.tolist(), strict=True))
