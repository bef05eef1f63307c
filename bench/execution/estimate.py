"""How long the rest of a plan will take: from what was measured before, or from a probe.

The best that is known counts: what the same tracker took on the same sequence; on others; what
trackers of its name took; and for a tracker that never ran, its first frames on the shortest
sequence, of which nothing is kept.
"""

import heapq
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import partial
from math import floor, isfinite, log10
from pathlib import Path

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from trackmark.bench.engine import probe
from trackmark.bench.engine.work_unit import Entry, Limits, Unit
from trackmark.bench.execution.plan import Plan
from trackmark.bench.execution.scheduling import Units, owner_of
from trackmark.bench.store.columns import codes
from trackmark.bench.store.files import ResultsError
from trackmark.bench.store.index import read_table
from trackmark.bench.store.results import Results
from trackmark.trackers import Randomness

PROBED_FRAMES = 12
_START_SECONDS = (2.0, 5.0)  # of a worker process, with its imports
_PROBE_SECONDS = 10.0  # for a frame; who asks for an estimate does not wait for long
_STORE_SECONDS = 0.01  # to score and write a run


class Basis(IntEnum):
    """What the time of a run is estimated from."""

    NOTHING = 0
    """Its tracker never ran, and failed when it was probed."""

    PROBE = 1
    """Its tracker's first frames on the shortest sequence."""

    NAME = 2
    """Runs of its tracker with other parameters."""

    TRACKER = 3
    """Runs of its tracker on other sequences."""

    SEQUENCE = 4
    """Runs of its tracker on its sequence."""


_RANGES = {
    Basis.NOTHING: (1.0, 1.0),
    Basis.PROBE: (0.5, 2.5),
    Basis.NAME: (0.4, 2.2),
    Basis.TRACKER: (0.6, 1.8),
    Basis.SEQUENCE: (0.7, 1.6),
}
"""By what factors the time of a unit turns out to differ, as far as was seen."""


@dataclass(frozen=True)
class Estimate:
    """How long the rest will take."""

    low: float  # in seconds, by the wall clock
    high: float
    bases: dict[Basis, int]  # numbers of runs by what their time was estimated from


def measured_before(output: Path) -> list[pa.Table]:
    """Indexes of all experiments in a folder of results; none where there is no such folder."""
    indexes = []
    for plan in sorted(output.glob("*/plan.json")):
        with suppress(ResultsError):  # what is wrong with another experiment is its own business
            indexes.append(read_table(Results(plan.parent)))
    return indexes


def estimate(units: Units, indexes: Sequence[pa.Table], limits: Limits) -> Estimate:
    """Estimate the time of what is left to do, once sequences and trackers have been settled.

    `units`: what is left, and how it is shared out. `indexes`: what was measured before; see
    `bench.store.index.read_table`. `limits`: kept while trackers are probed.

    Raises `SequenceError` where the sequence to probe on can't be read.
    """
    plan, wanted = units.plan, units.wanted
    runs = np.zeros(plan.versions.shape, np.int64)
    np.add.at(runs.T, plan.run_trackers, wanted.T)
    if not runs.any():
        return Estimate(0.0, 0.0, {})
    seconds, basis = _tracker_seconds(plan, indexes)
    reading = _reading_seconds(plan, indexes)
    unknown = np.flatnonzero((basis == Basis.NOTHING).any(axis=0) & runs.any(axis=0))
    if len(unknown) or np.isnan(reading).all():
        took, frame_seconds = _probed(plan, unknown.tolist(), limits)
        seconds[:, unknown] = np.where(np.isfinite(took), took, 0.0)
        basis[:, unknown] = np.where(np.isfinite(took), Basis.PROBE, Basis.NOTHING)
        reading = np.where(np.isnan(reading), frame_seconds, reading)
    reading = np.where(np.isnan(reading), np.nanmean(reading), reading)
    of = {sequence.source: number for number, sequence in enumerate(plan.sequences)}
    numbers = {text: number for number, text in enumerate(plan.trackers)}

    def of_unit(side: int, unit: Unit) -> float:
        """Opening twice, reading frames, trackers, writing."""
        sequence = of[unit.source]
        trackers = [numbers[entry.tracker] for entry in unit.entries]
        frame = reading[sequence] + float(seconds[sequence, trackers].sum())
        opening = 2 * plan.sequences[sequence].opening_seconds
        factors = [_RANGES[Basis(kind)][side] for kind in basis[sequence, trackers]]
        factor = max(factors) if side else min(factors)
        return float(factor * (unit.frames * frame + opening + _STORE_SECONDS * len(trackers)))

    low, high = (
        start + _makespan(units, partial(of_unit, side))
        for side, start in enumerate(_START_SECONDS)
    )
    bases = {kind: int(runs[basis == kind].sum()) for kind in Basis}
    return Estimate(low, high, {kind: count for kind, count in bases.items() if count})


def words(found: Estimate) -> str:
    """The range for people, at most two digits each."""
    size, unit = next(
        (size, unit)
        for size, unit in ((86400, "days"), (3600, "hours"), (60, "minutes"), (1, "seconds"))
        if found.high >= 2 * size or size == 1
    )
    low, high = (_two_digits(max(seconds, 1.0) / size) for seconds in (found.low, found.high))
    return f"{low:g} to {high:g} {unit}"


def _two_digits(number: float) -> float:
    return round(number, 1 - floor(log10(number)))


def _makespan(units: Units, seconds: Callable[[Unit], float]) -> float:
    """When the last worker ends, each of which takes the next unit when it is through."""
    ends = [0.0] * units.workers
    for unit in units:
        heapq.heapreplace(ends, ends[0] + seconds(unit))
    return max(ends)


def _tracker_seconds(
    plan: Plan, indexes: Sequence[pa.Table]
) -> tuple[NDArray[np.float64], NDArray[np.uint8]]:
    """Seconds of a tracker for a frame, and their basis, by sequence and tracker."""
    shape = plan.versions.shape
    labels = [chosen.label for chosen in plan.trackers.values()]
    names = [chosen.name for chosen in plan.trackers.values()]
    sequences = [sequence.name for sequence in plan.sequences]
    seconds, basis = np.zeros(shape), np.zeros(shape, np.uint8)
    levels = (
        (Basis.NAME, {"tracker_name": names}),
        (Basis.TRACKER, {"tracker": labels}),
        (Basis.SEQUENCE, {"sequence": sequences, "tracker": labels}),
    )
    for level, keys in levels:
        mean = _mean_rates(indexes, "seconds", keys)
        known = np.broadcast_to(np.isfinite(mean), shape)
        seconds[known] = np.broadcast_to(mean, shape)[known]
        basis[known] = level
    return seconds, basis


def _reading_seconds(plan: Plan, indexes: Sequence[pa.Table]) -> NDArray[np.float64]:
    """Seconds to decode or render a frame, by sequence; NaN where they are not known."""
    names = {"sequence": [sequence.name for sequence in plan.sequences]}
    return _mean_rates(indexes, "frame_seconds", names)


def _mean_rates(
    indexes: Sequence[pa.Table], column: str, keys: dict[str, list[str]]
) -> NDArray[np.float64]:
    """Mean of a column by names in others; `seconds` are those of a frame. NaN where none are."""
    shape = tuple(len(names) for names in keys.values())
    total, count = np.zeros(shape), np.zeros(shape)
    for index in indexes:
        values = index[column].to_numpy(zero_copy_only=False).astype(float)
        if column == "seconds":
            values = values / np.maximum(index["frames"].to_numpy(), 1)
        statuses, (status,) = codes(index["status"])
        finished = np.array([name == "finished" for name in statuses.to_pylist()], bool)[status]
        usable = finished & np.isfinite(values)
        places = []
        for name, wanted in keys.items():
            # Several may have one name: it goes to the first, and comes to the others below.
            first = {text: wanted.index(text) for text in dict.fromkeys(wanted)}
            known, (numbers,) = codes(index[name])
            place = np.array([first.get(text, -1) for text in known.to_pylist()], np.int64)
            places.append(place[numbers])
            usable &= places[-1] >= 0
        chosen = tuple(place[usable] for place in places)
        np.add.at(total, chosen, values[usable])
        np.add.at(count, chosen, 1)
    with np.errstate(invalid="ignore"):
        mean = total / count
    for axis, wanted in enumerate(keys.values()):
        mean = np.take(mean, [wanted.index(text) for text in wanted], axis=axis)
    return mean


def _probed(plan: Plan, trackers: list[int], limits: Limits) -> tuple[NDArray[np.float64], float]:
    """Seconds of trackers for a frame, NaN for those that failed; and those to read one."""
    shortest = min(plan.sequences, key=lambda sequence: sequence.frames)
    texts = list(plan.trackers)
    groups: list[list[int]] = [[]]
    for number in trackers:
        chosen = plan.trackers[texts[number]]
        if owner_of(chosen) or chosen.randomness is Randomness.PROCESS:
            groups.append([number])
        else:
            groups[0].append(number)
    took: dict[int, float] = {}
    reading = 0.0
    brief = replace(limits, frame_seconds=min(limits.frame_seconds, _PROBE_SECONDS))
    while groups:
        group = groups.pop(0)
        entries = tuple(Entry(texts[number], 0, "") for number in group)
        owner = owner_of(plan.trackers[texts[group[0]]]) if group else ""
        unit = Unit(shortest.source, entries, "accuracy", shortest.frames, owner)
        found = probe(unit, PROBED_FRAMES, brief)
        if found is not None:
            took |= dict(zip(group, found.seconds, strict=True))
            reading = found.frame_seconds if isfinite(found.frame_seconds) else reading
        elif len(group) > 1:  # somebody among them harms the process
            groups += [[number] for number in group]
    return np.array([took.get(number, np.nan) for number in trackers]), reading
