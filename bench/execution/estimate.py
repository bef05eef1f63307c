"""Estimate of the time that the remaining runs of a plan take.

The time of a run is estimated from earlier runs of the same tracker on the same sequence. If there
are none, runs on other sequences are used, then runs with other parameters. A tracker without any
earlier run is timed on the first frames of the shortest sequence (a probe, which is not stored).
"""

import heapq
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import partial
from math import floor, isfinite, log10, nan
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.engine import probe
from trackmark.bench.engine.work_unit import Entry, Limits, Unit
from trackmark.bench.execution.plan import Plan
from trackmark.bench.execution.scheduling import Units, owner_of
from trackmark.bench.store.database import open_database
from trackmark.bench.store.files import ResultsError
from trackmark.bench.store.layout import DATABASE
from trackmark.trackers import Randomness

PROBED_FRAMES = 12
_START_SECONDS = (2.0, 5.0)  # of a worker process, with its imports
_PROBE_SECONDS = 10.0  # time limit of a frame, so that an estimate is quick
_STORE_SECONDS = 0.01  # to score and write a run


class Basis(IntEnum):
    """Basis on which the time of a run is estimated."""

    NOTHING = 0
    """None: the tracker never ran, and failed in the probe."""

    PROBE = 1
    """The tracker's first frames on the shortest sequence."""

    NAME = 2
    """Runs of the tracker with other parameters."""

    TRACKER = 3
    """Runs of the tracker on other sequences."""

    SEQUENCE = 4
    """Runs of the tracker on the same sequence."""


_RANGES = {
    Basis.NOTHING: (1.0, 1.0),
    Basis.PROBE: (0.5, 2.5),
    Basis.NAME: (0.4, 2.2),
    Basis.TRACKER: (0.6, 1.8),
    Basis.SEQUENCE: (0.7, 1.6),
}
"""Lowest and highest observed ratio of the real to the estimated time of a unit, by basis."""


@dataclass(frozen=True)
class Estimate:
    """Estimated time of the remaining runs."""

    low: float  # wall time [s]
    high: float
    bases: dict[Basis, int]  # number of runs by basis


Measured = tuple[str, str, str, float, float, int]
"""Measured times of a tracker on a sequence: name and label of the tracker, sequence, mean time per
frame of the tracker and of decoding or rendering [s], number of runs."""

_MEASURED = """
    SELECT json_extract(t.identity, '$.tracker_name'), r.tracker, r.sequence,
        avg(r.seconds / max(r.frames, 1)), avg(r.frame_seconds), count(*)
    FROM run r JOIN tracker t USING (version) WHERE r.status = 'finished' GROUP BY 1, 2, 3
"""


def read_measured_times(output: Path) -> list[Measured]:
    """Return the times of finished runs of all experiments in a results folder."""
    measured: list[Measured] = []
    for file in sorted(output.glob(f"*/{DATABASE}")):
        with (
            suppress(ResultsError),
            open_database(file.parent) as database,
        ):  # skips damaged files
            measured += [tuple(row) for row in database.select(_MEASURED)]
    return measured


def estimate(units: Units, measured: Sequence[Measured], limits: Limits) -> Estimate:
    """Estimate the time of the remaining runs of a plan.

    `units` are the remaining work units. `measured` holds times of earlier runs. `limits` apply to
    the probe.

    Raises `SequenceError` if the sequence for the probe cannot be read.
    """
    plan, wanted = units.plan, units.wanted
    runs = np.zeros((len(plan.sequences), len(plan.trackers)), np.int64)
    np.add.at(runs.T, plan.run_trackers, wanted.T)
    if not runs.any():
        return Estimate(0.0, 0.0, {})
    seconds, basis = _tracker_seconds(plan, measured)
    means = _means(((sequence,), reading, n) for _, _, sequence, _, reading, n in measured)
    reading = np.array([means.get((sequence.name,), nan) for sequence in plan.sequences])
    unknown = np.flatnonzero((basis == Basis.NOTHING).any(axis=0) & runs.any(axis=0))
    if len(unknown) or np.isnan(reading).all():
        took, frame_seconds = _probed(plan, unknown.tolist(), limits)
        seconds[:, unknown] = np.where(np.isfinite(took), took, 0.0)
        basis[:, unknown] = np.where(np.isfinite(took), Basis.PROBE, Basis.NOTHING)
        reading = np.where(np.isnan(reading), frame_seconds, reading)
    reading = np.where(np.isnan(reading), np.nanmean(reading), reading)
    sequence_numbers = {sequence.source: number for number, sequence in enumerate(plan.sequences)}
    tracker_numbers = {text: number for number, text in enumerate(plan.trackers)}

    def unit_seconds(side: int, unit: Unit) -> float:
        """Return the lower (`side` 0) or upper (1) estimate of the time of a unit [s]."""
        sequence = sequence_numbers[unit.source]
        trackers = [tracker_numbers[entry.tracker] for entry in unit.entries]
        frame = reading[sequence] + float(seconds[sequence, trackers].sum())
        opening = 2 * plan.sequences[sequence].opening_seconds
        factors = [_RANGES[Basis(kind)][side] for kind in basis[sequence, trackers]]
        factor = max(factors) if side else min(factors)
        return float(factor * (unit.frames * frame + opening + _STORE_SECONDS * len(trackers)))

    low, high = (
        start + _makespan(units, partial(unit_seconds, side))
        for side, start in enumerate(_START_SECONDS)
    )
    bases = {kind: int(runs[basis == kind].sum()) for kind in Basis}
    return Estimate(low, high, {kind: count for kind, count in bases.items() if count})


def words(estimate: Estimate) -> str:
    """Return the range of an estimate as text, with at most two significant digits."""
    size, unit = next(
        (size, unit)
        for size, unit in ((86400, "days"), (3600, "hours"), (60, "minutes"), (1, "seconds"))
        if estimate.high >= 2 * size or size == 1
    )
    numbers = [max(seconds, 1.0) / size for seconds in (estimate.low, estimate.high)]
    low, high = (round(number, 1 - floor(log10(number))) for number in numbers)
    return f"{low:g} to {high:g} {unit}"


def _makespan(units: Units, seconds: Callable[[Unit], float]) -> float:
    """Return the time until all workers have finished [s]; a free worker takes the next unit."""
    ends = [0.0] * units.workers
    for unit in units:
        heapq.heapreplace(ends, ends[0] + seconds(unit))
    return max(ends)


def _tracker_seconds(
    plan: Plan, measured: Sequence[Measured]
) -> tuple[NDArray[np.float64], NDArray[np.uint8]]:
    """Return the time per frame [s] and its `Basis`, two arrays (sequences, trackers)."""
    shape = len(plan.sequences), len(plan.trackers)
    seconds, basis = np.zeros(shape), np.zeros(shape, np.uint8)
    by_name = _means(((name,), seconds, n) for name, _, _, seconds, _, n in measured)
    by_tracker = _means(((label,), seconds, n) for _, label, _, seconds, _, n in measured)
    by_both = _means(
        ((label, sequence), seconds, n) for _, label, sequence, seconds, _, n in measured
    )
    for i, planned in enumerate(plan.sequences):
        for j, spec in enumerate(plan.trackers.values()):
            candidates = (
                (Basis.SEQUENCE, by_both.get((spec.label, planned.name))),
                (Basis.TRACKER, by_tracker.get((spec.label,))),
                (Basis.NAME, by_name.get((spec.name,))),
            )
            means = ((level, mean) for level, mean in candidates if mean is not None)
            basis[i, j], seconds[i, j] = next(means, (Basis.NOTHING, 0.0))
    return seconds, basis


def _means(
    values: Iterable[tuple[tuple[str, ...], float | None, int]],
) -> dict[tuple[str, ...], float]:
    """Return means by key, weighted by the number of runs."""
    sums: dict[tuple[str, ...], list[float]] = {}
    for key, value, n in values:
        if value is not None:
            total = sums.setdefault(key, [0.0, 0.0])
            total[0] += value * n
            total[1] += n
    return {key: total / n for key, (total, n) in sums.items()}


def _probed(plan: Plan, trackers: list[int], limits: Limits) -> tuple[NDArray[np.float64], float]:
    """Time trackers; return the times per frame of each (NaN if it failed) and of reading [s]."""
    shortest = min(plan.sequences, key=lambda sequence: sequence.frames)
    texts = list(plan.trackers)
    groups: list[list[int]] = [[]]
    for number in trackers:
        spec = plan.trackers[texts[number]]
        if owner_of(spec) or spec.randomness is Randomness.PROCESS:
            groups.append([number])
        else:
            groups[0].append(number)
    took: dict[int, float] = {}
    reading = 0.0
    probe_limits = replace(limits, frame_seconds=min(limits.frame_seconds, _PROBE_SECONDS))
    while groups:
        group = groups.pop(0)
        entries = tuple(Entry(texts[number], 0, "") for number in group)
        owner = owner_of(plan.trackers[texts[group[0]]]) if group else ""
        unit = Unit(shortest.source, entries, "accuracy", shortest.frames, owner)
        result = probe(unit, PROBED_FRAMES, probe_limits)
        if result is not None:
            took |= dict(zip(group, result.seconds, strict=True))
            reading = result.frame_seconds if isfinite(result.frame_seconds) else reading
        elif len(group) > 1:  # a tracker crashed or hung the process
            groups += [[number] for number in group]
    return np.array([took.get(number, np.nan) for number in trackers]), reading
