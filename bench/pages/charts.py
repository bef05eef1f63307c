"""Charts of an experiment's page; their points open frames in the player."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import isfinite
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from trackmark.bench.pages.player_runs import ERRORS, OVERLAPS, PageRun, PageRuns, SequenceRuns
from trackmark.bench.reporting.shared_charts import speed_chart, survival_chart, survival_line
from trackmark.bench.reporting.tables import SUMMARY
from trackmark.bench.statistics.rules import MIN_UNITS
from trackmark.bench.statistics.units import units_of
from trackmark.reports.page.content import Chart, Line, PlayerPosition
from trackmark.reports.page.svg import CROWDED, TOP, at_reference
from trackmark.reports.tables import Table
from trackmark.reports.write import file_names

_MAX_POINTS = 120
"""Maximum number of points of a curve over the frames of a sequence."""

_VIDEO_TIME = 40.0  # of a frame at 25 frames per second [ms]

_INDEX_OF_20 = int(np.flatnonzero(ERRORS == 20.0)[0])
"""Index of the threshold of precision that papers state [20 px]."""


class _ShareChart(NamedTuple):
    """Definition of a chart of the share of frames by threshold."""

    title: str
    kind: str  # of the worst frame
    thresholds: NDArray[np.float64]
    axes: tuple[str, str]
    words: str
    figure: str  # meaning of the number in parentheses after the label
    caption: str
    reference: float


_SUCCESS = _ShareChart(
    "Success",
    "overlap",
    OVERLAPS,
    ("overlap", "share of frames with at least that"),
    "Share of frames with at least an overlap with the true box, by tracker; in parentheses the "
    "area below the curve, which is the mean overlap.",
    "area",
    "Share of frames whose overlap reaches a threshold. A point opens the nearest frame.",
    0.5,
)
_PRECISION = _ShareChart(
    "Precision",
    "centre_error",
    ERRORS,
    ("centre error [px]", "share of frames with at most that"),
    "Share of frames with at most a centre error, by tracker; in parentheses the share at 20 px.",
    "share at 20 px",
    "Share of frames whose centre error is at most a threshold. A point opens the nearest frame.",
    20.0,
)


def share_charts(runs: PageRuns, trackers: Sequence[str]) -> list[Chart]:
    """Return the success and the precision plot; all sequences have equal weights.

    `trackers`: trackers without unfinished runs.
    """
    n = sum(bool(stage.clips) for stage in runs.stages)
    over = f"Means over n = {n} sequences, of their repetitions first; no interval is drawn."
    charts = []
    for definition in (_SUCCESS, _PRECISION) if trackers and runs.stages else ():
        lines = [_share_line(runs, runs.trackers.index(name), definition) for name in trackers]
        lines.sort(key=lambda line: line.position)
        chart = Chart(
            definition.title,
            *definition.axes,
            lines,
            f"{definition.words} {over}",
            top=1.0,
            figure=definition.title.lower(),
            value_name=definition.figure,
            caption=definition.caption,
            percent=True,
            reference=definition.reference,
        )
        values = ", ".join(f"{line.label} {at_reference(chart, line)}" for line in lines)
        left_out = " Trackers with failed runs are left out." * (len(runs.trackers) > len(lines))
        aria = f"{definition.caption} At {definition.reference:g}: {values}"
        charts.append(replace(chart, aria=aria, caption=definition.caption + left_out))
    return charts


def _share_line(runs: PageRuns, tracker: int, chart: _ShareChart) -> Line:
    """Return the curve of a tracker; a point opens the frame nearest to its threshold.

    Among equally near frames, the frame of the worst run is opened.
    """
    curve = chart.title.lower()
    by_sequence = [stage.clips_of(tracker) for stage in runs.stages]
    judged = [
        (position, clip)
        for position, clips in enumerate(by_sequence)
        for clip in clips
        if curve in clip.shares
    ]
    if not judged:
        return Line(runs.trackers[tracker], tracker, [np.nan], [np.nan])
    curves = [[clip.shares[curve].shares for clip in c if clip.shares] for c in by_sequence]
    shares = np.mean([np.mean(values, axis=0) for values in curves if values], axis=0)
    overlaps = [[-clip.worst["overlap", "online"][0] for clip in c] for c in by_sequence if c]
    figure = shares[_INDEX_OF_20]
    if curve == "success":
        figure = np.mean([np.mean(values) for values in overlaps])
    judged.sort(key=lambda entry: (-entry[1].worst[chart.kind, "online"][0], entry[0]))
    nearest = np.argmin([clip.shares[curve].distances for _, clip in judged], axis=0)
    places = []
    for point, (position, clip) in enumerate(judged[index] for index in nearest):
        frame = int(clip.shares[curve].frames[point])
        places.append(PlayerPosition(position, tracker, clip.take.repetition, frame))
    label = runs.trackers[tracker]
    return Line(label, tracker, chart.thresholds, shares, places=places, value=f"{figure:.3f}")


def finished_clips(stage: SequenceRuns) -> Iterator[tuple[int, list[PageRun]]]:
    """Yield the index of each tracker with its one-pass runs on a sequence that did not fail."""
    for tracker in sorted({clip.take.tracker for clip in stage.clips}):
        if clips := [clip for clip in stage.clips_of(tracker) if not clip.take.failure]:
            yield tracker, clips


def timeline_charts(runs: PageRuns) -> dict[str, Chart]:
    """Return the median overlap of the repetitions by frame, a chart per sequence."""
    charts, names = {}, file_names([stage.name for stage in runs.stages])
    for position, stage in enumerate(runs.stages):
        by_tracker = dict(finished_clips(stage))
        lines = [
            _timeline(position, runs.trackers[tracker], clips)
            for tracker, clips in by_tracker.items()
            if tracker < TOP or len(by_tracker) <= CROWDED
        ]
        most = max(map(len, by_tracker.values()), default=0)
        median = f": the median over up to {most} repetitions" if most > 1 else ""
        which = f" of the first {TOP} trackers" * (len(by_tracker) > CROWDED)
        caption = f"Overlap by frame{which}{median}. A point opens its frame."
        words = f"Overlap over the frames of {stage.name}, by tracker{median}."
        if lines:
            named: dict[str, Any] = {
                "figure": f"frames-{names[stage.name]}",
                "caption": caption,
                "named": False,
            }
            chart = Chart(stage.name, "frame", "overlap", lines, words, top=1.0, **named)
            charts[stage.name] = chart
    return charts


def _timeline(position: int, name: str, clips: Sequence[PageRun]) -> Line:
    """Return a line through the lowest overlap of each interval; it opens the worst repetition."""
    overlaps = np.array([clip.overlaps for clip in clips])
    judged = np.isfinite(overlaps).any(axis=0)
    medians = np.full(overlaps.shape[1], np.nan)
    medians[judged] = np.nanmedian(overlaps[:, judged], axis=0)
    frames = [
        int(interval[np.nanargmin(medians[interval])])
        if judged[interval].any()
        else int(interval[0])
        for interval in np.array_split(np.arange(len(medians)), min(_MAX_POINTS, len(medians)))
    ]
    worst = max(clips, key=lambda clip: clip.worst["overlap", "online"][0])
    place = PlayerPosition(position, worst.take.tracker, worst.take.repetition, 0)
    return Line(name, worst.take.tracker, frames, medians[frames], places=[place])


def survival_charts(scored: pd.DataFrame, runs: PageRuns) -> list[Chart]:
    """Return the survival plot: the share of runs without failure by frame."""
    if "first_loss" not in scored:
        return []
    finished = scored[scored["first_loss"].notna() & scored["frames"].notna()]
    numbers = {stage.name: position for position, stage in enumerate(runs.stages)}
    lines = []
    for position, name in enumerate(runs.trackers):
        rows = finished[finished["tracker"] == name]
        if rows.empty:
            continue
        first, frames = (rows[column].to_numpy(float) for column in ("first_loss", "frames"))
        ends, lost = np.minimum(first, frames), first < frames
        cells = zip(ends, lost, rows["sequence"], rows["repetition"], strict=True)
        lost_at = {
            int(end): PlayerPosition(numbers[str(sequence)], position, int(repetition), int(end))
            for end, failed, sequence, repetition in cells
            if failed and str(sequence) in numbers
        }
        lines.append(survival_line(name, position, ends, lost, lost_at))
    words = (
        "Share of runs that have not lost the target by frame, with 95 % bands (Kaplan-Meier, "
        f"n = {len(finished)} runs); higher is better."
    )
    return [survival_chart(lines, words)] if lines else []


def speed_charts(summary: Table, runs: PageRuns) -> list[Chart]:
    """Return the plot of mean overlap, with its interval, against the time per frame."""
    data, quantity = summary.data, SUMMARY[0]
    dots = []
    for position, name in enumerate(runs.trackers):
        scores = data[data["tracker"] == name].set_index("measure")
        if not {quantity.name, "milliseconds"} <= set(scores.index):
            continue
        score, low, high = (float(scores[end][quantity.name]) for end in ("mean", "low", "high"))
        time = float(scores["mean"]["milliseconds"])
        if isfinite(score) and isfinite(time):
            place = runs.place(name, None, "overlap")
            dots.append(Line(name, position, [time], [score], [low], [high], [place]))
    if not dots:
        return []
    (head,) = (head for head in summary.heads if "time a frame" in head)
    units = units_of([stage.name for stage in runs.stages])
    bars, caption = f"bars: 95 % interval of the mean {units.scope}", "bar: 95 % interval"
    if len(units) < MIN_UNITS:
        bars = caption = f"no intervals: {MIN_UNITS} {units.plural} needed"
    words = (
        f"{quantity.title.capitalize()} against {head}; {bars}; n = {len(units)} {units.plural}. "
        "Up and to the left is better."
    )
    caption = f"Mean overlap against time per frame; {caption}. Up and to the left is better."
    chart = speed_chart(dots, head, quantity.head, words)
    reference: dict[str, Any] = {"reference": _VIDEO_TIME, "reference_label": "25 fps"}
    return [replace(chart, top=1.0, caption=caption, **reference)]
