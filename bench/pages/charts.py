"""Charts of an experiment's page; their points open frames in the player."""

from collections.abc import Sequence
from dataclasses import replace
from math import isfinite, nan

import numpy as np
import pandas as pd

from trackmark.bench.analysis.run_tables import SUMMARY
from trackmark.bench.analysis.score_tables import means_by_tracker
from trackmark.bench.analysis.times import TIME
from trackmark.bench.pages.content import PlayerRun
from trackmark.bench.pages.player_runs import ERRORS, OVERLAPS, PageRuns
from trackmark.bench.statistics.rules import MIN_UNITS
from trackmark.bench.statistics.survival import kaplan_meier
from trackmark.bench.statistics.units import units_of
from trackmark.reports.charts import Chart, Line, PlayerPosition
from trackmark.reports.svg import CROWDED, TOP, at_reference
from trackmark.reports.tables import Table

_MAX_POINTS = 40
"""Maximum number of points of a curve over the frames of a sequence."""

_VIDEO_TIME = 40.0  # of a frame at 25 frames per second [ms]

_INDEX_OF_20 = int(np.flatnonzero(ERRORS == 20.0)[0])
"""Index of the threshold of precision that papers state [20 px]."""


_SUCCESS = Chart(
    "Success",
    "overlap",
    "share of frames with at least that",
    [],
    "Share of frames whose overlap reaches a threshold. A point opens the nearest frame.",
    figure="success",
    top=1.0,
    value_name="area",
    is_percent=True,
    reference=0.5,
)
_PRECISION = Chart(
    "Precision",
    "centre error [px]",
    "share of frames with at most that",
    [],
    "Share of frames with at most a centre error. A point opens the nearest frame.",
    figure="precision",
    top=1.0,
    value_name="share at 20 px",
    is_percent=True,
    reference=20.0,
)


def share_charts(runs: PageRuns, trackers: Sequence[str]) -> list[Chart]:
    """Return the success and the precision plot; all sequences have equal weights.

    `trackers`: trackers without unfinished runs.
    """
    left_out = " Trackers with failed runs are left out." * (len(runs.trackers) > len(trackers))
    charts = []
    for template in (_SUCCESS, _PRECISION) if trackers and runs.sequences else ():
        positions = sorted(map(runs.trackers.index, trackers))
        lines = [_share_line(runs, position, template.figure) for position in positions]
        values = ", ".join(f"{line.label} {at_reference(template, line)}" for line in lines)
        caption = template.description + left_out
        description = f"{caption} At {template.reference:g}: {values}"
        charts.append(replace(template, lines=lines, description=description, caption=caption))
    return charts


def _share_line(runs: PageRuns, tracker: int, curve: str) -> Line:
    """Return the `success` or `precision` curve of a tracker.

    A point opens the frame nearest to its threshold; among equally near ones that of the worst run.
    """
    label = runs.trackers[tracker]
    by_sequence = [
        [run for run in sequence.one_pass if run.tracker == tracker] for sequence in runs.sequences
    ]
    scored = [
        (index, run)
        for index, of_tracker in enumerate(by_sequence)
        for run in of_tracker
        if curve in run.shares
    ]
    if not scored:
        return Line(label, tracker, [np.nan], [np.nan])
    curves = [[run.shares[curve].shares for run in c if run.shares] for c in by_sequence]
    shares = np.mean([np.mean(values, axis=0) for values in curves if values], axis=0)
    thresholds, figure, criterion = ERRORS, shares[_INDEX_OF_20], "centre_error"
    if curve == "success":
        overlaps = [[-run.severity for run in c] for c in by_sequence if c]
        thresholds, figure, criterion = OVERLAPS, np.mean([*map(np.mean, overlaps)]), "overlap"
    scored.sort(
        key=lambda scored_run: (-scored_run[1].worst[criterion, "online"][0], scored_run[0])
    )
    nearest = np.argmin([run.shares[curve].distances for _, run in scored], axis=0)
    positions = []
    for point, (index, run) in enumerate(scored[position] for position in nearest):
        positions.append(run.position(index, int(run.shares[curve].frames[point])))
    return Line(label, tracker, thresholds, shares, positions=positions, value=f"{figure:.3f}")


def timeline_charts(runs: PageRuns) -> dict[str, Chart]:
    """Return the median overlap of the repetitions by frame, a chart per sequence."""
    charts = {}
    for position, sequence in enumerate(runs.sequences):
        finished: dict[int, list[PlayerRun]] = {}
        for run in sequence.one_pass:
            if not run.failure:
                finished.setdefault(run.tracker, []).append(run)
        is_crowded = len(finished) > CROWDED
        lines = [
            _timeline(position, runs.trackers[tracker], finished[tracker])
            for tracker in sorted(finished)
            if tracker < TOP or not is_crowded
        ]
        max_repetitions = max(map(len, finished.values()), default=0)
        which = f" of the first {TOP} trackers" * is_crowded
        which += f": the median over up to {max_repetitions} repetitions" * (max_repetitions > 1)
        description = f"Overlap by frame{which}. A point opens its frame."
        if lines:
            name = sequence.name
            chart = Chart(name, "frame", "overlap", lines, description, top=1.0)
            charts[name] = replace(chart, has_line_names=False)
    return charts


def _timeline(position: int, name: str, repetitions: Sequence[PlayerRun]) -> Line:
    """Return a line through the lowest overlap of each interval; it opens the worst repetition."""
    medians = pd.DataFrame([run.overlaps for run in repetitions]).median().to_numpy(np.float64)
    intervals = np.array_split(np.arange(len(medians)), min(_MAX_POINTS, len(medians)))
    lowest = [np.argmin(np.nan_to_num(medians[interval], nan=np.inf)) for interval in intervals]
    frames = [int(interval[i]) for interval, i in zip(intervals, lowest, strict=True)]
    worst = max(repetitions, key=lambda run: run.severity)
    opened = worst.position(position, 0)
    return Line(name, worst.tracker, frames, medians[frames], positions=[opened])


def survival_charts(scored: pd.DataFrame, runs: PageRuns) -> list[Chart]:
    """Return the survival plot: the share of runs without failure by frame."""
    if "first_loss" not in scored:
        return []
    finished = scored[scored["first_loss"].notna() & scored["frames"].notna()]
    index_of_sequence = {sequence.name: index for index, sequence in enumerate(runs.sequences)}
    lines = []
    for position, name in enumerate(runs.trackers):
        rows = finished[finished["tracker"] == name]
        if rows.empty:
            continue
        first, frames = (rows[column].to_numpy(float) for column in ("first_loss", "frames"))
        ends, lost = np.minimum(first, frames), first < frames
        cells = zip(ends, lost, rows["sequence"], rows["repetition"], strict=True)
        lost_at = {
            int(end): PlayerPosition(
                index_of_sequence[str(sequence)], position, int(repetition), int(end)
            )
            for end, failed, sequence, repetition in cells
            if failed and str(sequence) in index_of_sequence
        }
        survival = kaplan_meier(ends, lost)
        shares, low, high = (np.concatenate([[1.0], part]) for part in survival[1:])
        points = [None, *map(lost_at.get, survival.times.tolist())]
        x = np.append(0.0, survival.times)
        lines.append(Line(name, position, x, shares, low, high, points))
    description = (
        "Share of runs that have not lost the target by frame, with 95 % bands (Kaplan-Meier, "
        f"n = {len(finished)} runs); higher is better."
    )
    quantity = "share of runs not lost"
    chart = Chart("", "frame", quantity, lines, description, "step", top=1.0, figure="survival")
    return [chart] if lines else []


def speed_charts(summary: Table, runs: PageRuns) -> list[Chart]:
    """Return the plot of mean overlap against the time per frame; none for a single tracker."""
    quantity, dots = SUMMARY[0], []
    scores, times = (means_by_tracker(summary, name) for name in (quantity.name, TIME.name))
    for name, score in scores.iterrows():
        time = times["mean"].get(name, nan)
        if isfinite(score["mean"] + time):
            opened = runs.worst_position(str(name), None, "overlap")
            point = [time], [score["mean"]], [score["low"]], [score["high"]], [opened]
            dots.append(Line(str(name), runs.trackers.index(name), *point))
    if len(dots) < 2:
        return []
    dots.sort(key=lambda dot: dot.position)
    units = units_of([sequence.name for sequence in runs.sequences])
    bars = "bar: 95 % interval"
    if len(units) < MIN_UNITS:
        bars = f"no intervals: {MIN_UNITS} {units.plural} needed"
    description = f"{quantity.title.capitalize()} against time per frame; {bars}. "
    description += "Up and to the left is better."
    chart = Chart(
        "",
        "time per frame [ms]",
        quantity.heading,
        dots,
        description,
        "dots",
        logarithmic=True,
        top=1.0,
        figure="speed-accuracy",
        reference=_VIDEO_TIME,
        reference_label="25 fps",
    )
    return [chart]
