"""Charts of an experiment's page, from its runs; their points open the frames behind them."""

from collections.abc import Mapping, Sequence
from math import isfinite

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from trackmark.bench.pages.player_runs import ERRORS, OVERLAPS, Clip, Reading, Stage
from trackmark.bench.reporting.tables import SUMMARY
from trackmark.bench.statistics.rules import MIN_UNITS
from trackmark.bench.statistics.survival import kaplan_meier
from trackmark.bench.statistics.units import units_of
from trackmark.reports.page.content import Chart, Line, Place
from trackmark.reports.tables import Table
from trackmark.reports.write import file_names

_BINS = 120
"""Points of a curve over the frames of a sequence."""

_AT_20 = int(np.flatnonzero(ERRORS == 20.0)[0])
"""Of the thresholds of precision the one that papers give [20 px]."""


def share_charts(reading: Reading, trackers: Sequence[str]) -> list[Chart]:
    """Shares of frames by overlap and by centre error, each sequence counting once.

    `trackers`: those all of whose runs finished.
    """
    if not trackers or not reading.stages:
        return []
    success, precision = list[Line](), list[Line]()
    for name in trackers:
        number = reading.trackers.index(name)
        for lines, kind, thresholds in (
            (success, "success", OVERLAPS),
            (precision, "precision", ERRORS),
        ):
            found = [getattr(stage, kind).get(number, []) for stage in reading.stages]
            shares = np.mean([np.mean(one, axis=0) for one in found if one], axis=0)
            places = _nearest(reading, name, kind)
            told = _area(reading, name) if kind == "success" else float(shares[_AT_20])
            lines.append(Line(name, number, thresholds, shares, places=places, told=f"{told:.3f}"))
    n = sum(bool(stage.clips) for stage in reading.stages)
    over = (
        f"Means over n = {n} sequences, of their repetitions first; no interval is drawn. A point "
        "opens the frame that is nearest to its threshold."
    )
    return [
        Chart(
            "Success",
            "overlap",
            "share of frames with at least that",
            success,
            "Share of frames with at least an overlap (intersection over union with the truth), by "
            "tracker, in parentheses the area beneath the curve, which is the mean overlap; "
            f"further right is better. {over}",
            top=1.0,
            figure="success",
            told="area",
        ),
        Chart(
            "Precision",
            "centre error [px]",
            "share of frames with at most that",
            precision,
            "Share of frames with at most a centre error (between the centres of box and truth), "
            f"by tracker, in parentheses the share at 20 px; higher is better. {over}",
            top=1.0,
            figure="precision",
            told="share at 20 px",
        ),
    ]


def _nearest(reading: Reading, tracker: str, curve: str) -> list[Place | None]:
    """For every threshold of a curve, the frame of all of a tracker's runs that is nearest.

    `curve`: `success` or `precision`. Of frames that are as near, those of the worst run.
    """
    kind = "overlap" if curve == "success" else "centre_error"
    found = [
        (-clip.worst[kind, "online"][0], position, clip)
        for position, stage in enumerate(reading.stages)
        for clip in stage.clips
        if reading.trackers[clip.tracker] == tracker and curve in clip.nearest
    ]
    found.sort(key=lambda one: one[:2])
    if not found:
        return []
    chosen = np.argmin([clip.nearest[curve][0] for _, _, clip in found], axis=0)
    return [
        Place(position, clip.tracker, clip.repetition, int(clip.nearest[curve][1][point]))
        for point, (_, position, clip) in enumerate(found[one] for one in chosen)
    ]


def _area(reading: Reading, tracker: str) -> float:
    """Mean overlap, each sequence counting once."""
    number = reading.trackers.index(tracker)
    found = [
        [-clip.worst["overlap", "online"][0] for clip in stage.clips if clip.tracker == number]
        for stage in reading.stages
    ]
    return float(np.mean([np.mean(one) for one in found if one]))


def error_charts(reading: Reading) -> list[Chart]:
    """Centre error over the frames, a chart a sequence: the median of the repetitions."""
    charts, names = [], file_names([stage.name for stage in reading.stages])
    for position, stage in enumerate(reading.stages):
        by_tracker: dict[int, list[Clip]] = {}
        for clip in stage.clips:
            if not clip.failure:
                by_tracker.setdefault(clip.tracker, []).append(clip)
        lines = [
            _error_line(position, stage, reading.trackers[number], clips)
            for number, clips in sorted(by_tracker.items())
        ]
        runs = max(map(len, by_tracker.values()), default=0)
        median = f": the median over up to {runs} repetitions" if runs > 1 else ""
        words = (
            f"Centre error over the frames of {stage.name}, by tracker{median} (no interval is "
            "drawn); lower is better."
        )
        figure = f"frames-{names[stage.name]}"
        if lines:
            chart = Chart(stage.name, "frame", "centre error [px]", lines, words, figure=figure)
            charts.append(chart)
    return charts


def _error_line(position: int, stage: Stage, name: str, clips: Sequence[Clip]) -> Line:
    """Of each stretch of frames the worst one, and there the repetition that is furthest off."""
    errors = np.array([clip.errors for clip in clips])
    known = np.isfinite(errors).any(axis=0)
    medians = np.full(errors.shape[1], np.nan)
    medians[known] = np.nanmedian(errors[:, known], axis=0)
    frames = [
        int(stretch[np.nanargmax(medians[stretch])]) if known[stretch].any() else int(stretch[0])
        for stretch in np.array_split(np.arange(len(medians)), min(_BINS, len(medians)))
    ]
    places = [
        Place(position, clips[0].tracker, clips[_furthest(errors[:, frame])].repetition, frame)
        for frame in frames
    ]
    return Line(name, clips[0].tracker, frames, medians[frames], places=places)


def _furthest(errors: NDArray[np.float32]) -> int:
    return int(np.nanargmax(errors)) if np.isfinite(errors).any() else 0


def survival_chart(scored: pd.DataFrame, reading: Reading) -> list[Chart]:
    """Share of runs that have not lost the target, over frames."""
    if "first_loss" not in scored:
        return []
    finished = scored[scored["first_loss"].notna() & scored["frames"].notna()]
    numbers = {stage.name: position for position, stage in enumerate(reading.stages)}
    lines = []
    for position, name in enumerate(reading.trackers):
        runs = finished[finished["tracker"] == name]
        if runs.empty:
            continue
        first, frames = (runs[column].to_numpy(float) for column in ("first_loss", "frames"))
        ends, lost = np.minimum(first, frames), first < frames
        found = kaplan_meier(ends, lost)
        rows = zip(ends.tolist(), lost, runs["sequence"], runs["repetition"], strict=True)
        at = {
            end: Place(numbers[str(sequence)], position, int(repetition), int(end))
            for end, failed, sequence, repetition in rows
            if failed and str(sequence) in numbers
        }
        places = [None, *(at.get(time) for time in found.times.tolist())]
        shares, low, high = (np.concatenate([[1.0], part]) for part in found[1:])
        times = np.append(0.0, found.times)
        lines.append(Line(name, position, times, shares, low, high, places))
    words = (
        "Share of runs that have not lost the target (ten visible frames on end with the centre "
        "outside the box), over frames, with 95 % bands (Kaplan and Meier's, "
        f"n = {len(finished)} runs); higher is better."
    )
    chart = Chart(
        "", "frame", "share of runs not lost", lines, words, "step", top=1.0, figure="survival"
    )
    return [chart] if lines else []


def speed_chart(tables: Mapping[str, Table], reading: Reading) -> list[Chart]:
    """Mean overlap against the time a frame, with its interval, as the summary has them."""
    if "summary" not in tables:
        return []
    data, quantity = tables["summary"].data, SUMMARY[0]
    lines = []
    for position, name in enumerate(reading.trackers):
        of = data[data["tracker"] == name].set_index("measure")
        if not {quantity.name, "milliseconds"} <= set(of.index):
            continue
        means, *ends = (of[column].to_dict() for column in ("mean", "low", "high"))
        score, low, high = (float(one[quantity.name]) for one in (means, *ends))
        time = float(means["milliseconds"])
        if isfinite(score) and isfinite(time):
            place = reading.place(name, None, "overlap")
            lines.append(Line(name, position, [time], [score], [low], [high], [place]))
    (head,) = (head for head in tables["summary"].heads if "time a frame" in head)
    quantities = f"{quantity.title.capitalize()} against {head}"
    units = units_of([stage.name for stage in reading.stages])
    bars = f"bars: 95 % interval of the mean {units.scope}"
    if len(units) < MIN_UNITS:
        bars = f"no intervals: {MIN_UNITS} {units.plural} needed"
    words = f"{quantities}; {bars}; n = {len(units)} {units.plural}. Up and to the left is better."
    chart = Chart(
        "", head, quantity.head, lines, words, "dots", logarithmic=True, figure="speed-accuracy"
    )
    return [chart] if lines else []
