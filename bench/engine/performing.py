"""What a child process does (`perform`): one unit of work, from opening the sequence to the files.

What others are judged by, truth and scores, the supervisor writes and makes (`scored`): there no
tracker has run.
"""

import os
import socket
from collections.abc import Collection
from contextlib import suppress
from dataclasses import dataclass, field, replace
from math import nan
from pathlib import Path
from time import perf_counter, process_time
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.engine.process import Surroundings, peak_memory, reset_peak, umask
from trackmark.bench.engine.stack_trace import CodeLine, select_line
from trackmark.bench.engine.unit import Entry, Limits, Unit
from trackmark.bench.evaluation.ground_truth import reference
from trackmark.bench.evaluation.loop import run_protocol
from trackmark.bench.evaluation.observer import UNOBSERVED, NotAttributableError, Observer
from trackmark.bench.evaluation.recorder import COLUMNS, frames_of_segments
from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.experiments.tracker_spec import Contestant, Identity, contestants, identify
from trackmark.bench.protocols import TIMING
from trackmark.bench.store.files import ResultsError
from trackmark.bench.store.index import row_of_file
from trackmark.bench.store.layout import UNFINISHED, beside
from trackmark.bench.store.results import Results
from trackmark.bench.store.unfinished import map_rows, read_rows
from trackmark.datasets import Sequence, SequenceError
from trackmark.trackers import Randomness, TrackerError

_SHORTEST = 2  # frames of a pass
_GLOBAL_NUMBERS = (
    "it drew from the process's global random numbers (numpy.random or random), so that its boxes "
    "can't be repeated. Use the seed that it is given, or declare Randomness.PROCESS."
)


@dataclass(frozen=True)
class Outcome:
    """What became of a unit, and what it cost."""

    rows: list[dict[str, Any]]  # the index's rows of its runs, which lie on disk; see `scored`
    entries: list[Entry]  # what was asked for, by row
    overhead: float  # the harness's own seconds per frame and tracker; NaN in timing runs
    seconds: float  # from opening the sequence to the last file
    cpu_seconds: float
    peak_memory: int  # most memory that its process has had, in bytes
    host: str
    process: int
    errors: list[str] = field(default_factory=list)  # why some of its runs were not kept


@dataclass(frozen=True)
class Failure:
    """Why a run has failed that could not say so itself."""

    frame: int | None  # where; None where it is not known
    reason: str
    output: str
    stack: list[CodeLine] = field(default_factory=list)  # innermost line first, if known


def scored(outcome: Outcome, unit: Unit, folder: Path) -> Outcome:
    """An outcome of `perform`, which knows no more than paths, with whole rows.

    Raises `ResultsError` where a run can't be read, or is none of the unit's.
    """
    results = Results(folder)
    told = len(outcome.entries) + len(outcome.errors)
    asked = told == len(unit.entries) and set(outcome.entries) <= set(unit.entries)
    files = [folder / str(row.get("path")) for row in outcome.rows]
    within = all(file.is_relative_to(folder) for file in files)
    if not (asked and within) or len(files) != len(outcome.entries):
        raise ResultsError("these are runs that nobody asked for.")
    return replace(outcome, rows=[row_of_file(results, file) for file in files])


@dataclass(frozen=True)
class Probed:
    """How long frames took."""

    # A tracker's own time for a frame, by entry of the unit; NaN where it failed.
    seconds: tuple[float, ...]
    frame_seconds: float  # time to decode or render a frame


def perform(
    unit: Unit, folder: Path, limits: Limits | None = None, observer: Observer = UNOBSERVED
) -> Outcome:
    """Run a unit and write its runs.

    `unit`: what to run. `folder`: the experiment's folder of results, with the sequence's truth.
    `limits`: of these, the time of a whole run is kept here; the others are up to the supervisor.
    `observer`: told what is done.

    The outcome's rows hold the paths of the runs alone; see `scored`.

    Raises `SequenceError` where the sequence can't be read to its end; none of the unit's runs is
    written. Raises `ResultsError` where the results can't be written. Raises
    `NotAttributableError`: where one of several trackers harms the process; none of the unit's runs
    is written.
    """
    began = _Began()
    opened, changed = _open(unit, folder)
    frames = [
        map_rows(path, sum(map(len, segments)) or len(opened.sequence), COLUMNS)
        for path, segments in zip(opened.unfinished, opened.segments, strict=True)
    ]
    before = Surroundings.now()
    runs, measured = _runs(opened, (limits or Limits()).run_seconds, frames, observer)
    runs = _checked_surroundings(runs, before, opened)
    misdeeds = observer.misdeeds()
    if misdeeds and len(runs) > 1:
        raise NotAttributableError(*misdeeds.values())  # there may be more who did it
    for number, misdeed in misdeeds.items():
        runs[number] = replace(runs[number], failure=runs[number].failure or misdeed)
    said = observer.printed()
    runs = [
        replace(
            run,
            circumstances={**run.circumstances, **measured},
            output=said.get(number, "") if run.failure else "",
        )
        for number, run in enumerate(runs)
    ]
    # Boxes of one version must never be kept as another's.
    still, changed_since = _open(opened.unit, folder)
    kept = set(still.unit.entries)
    made = zip(runs, opened.unit.entries, strict=True)
    stored = [(run, entry) for run, entry in made if entry in kept]
    outcome = began.outcome(_store(stored, opened), still.unit, measured.get("overhead", nan))
    return replace(outcome, errors=[*changed, *changed_since])


def record_failure(unit: Unit, folder: Path, failure: Failure) -> Outcome:
    """Write the only run of a unit as failed, with the frames that it got to."""
    began = _Began()
    opened, _ = _open(unit, folder)
    sequence = opened.sequence
    (path,), (key,), (chosen,) = opened.unfinished, opened.identities, opened.contestants
    (segments,) = opened.segments
    rows = read_rows(path)
    if rows is None:
        rows = np.full((sum(map(len, segments)) or len(sequence), COLUMNS), nan)
    given = reference(sequence, chosen.init, sequence.name).boxes
    if not segments:
        rows[sequence.first_frame, :4] = given[sequence.first_frame]
    where = "" if failure.frame is None else f"{sequence.frame_name(failure.frame)}: "
    line = f" at {select_line(failure.stack, chosen.file)}" if failure.stack else ""
    run = Run(
        identity=key,
        boxes=rows[:, :4],
        visible=rows[:, 4] == 1,
        confidence=rows[:, 5],
        failure=where + failure.reason + line,
        output=failure.output,
        segments=segments,
    )
    return began.outcome(_store([(run, unit.entries[0])], opened), unit, nan)


def probe(unit: Unit, frames: int, observer: Observer = UNOBSERVED) -> Probed:
    """Show a unit's trackers the first frames of its sequence.

    `unit`: whose trackers. `frames`: how many, at least 3. `observer`: told what is done.
    """
    sequence = datasets.load(unit.source.text, truth=unit.source.truth)
    chosen = contestants(entry.tracker for entry in unit.entries)
    entries = [(chosen[entry.tracker], entry.repetition) for entry in unit.entries]
    first = sequence.first_frame
    # The first pass compiles kernels and fills caches; the second is what a beginning costs.
    _, beginning, whole = (
        run_protocol(entries, sequence[first : first + n], observer=observer)
        for n in (_SHORTEST, _SHORTEST, frames)
    )
    counted = max(1, min(frames, len(sequence) - first) - _SHORTEST)
    took = [
        nan if b.failure else float(b.circumstances["seconds"] - a.circumstances["seconds"])
        for a, b in zip(beginning.runs, whole.runs, strict=True)
    ]
    return Probed(tuple(max(0.0, seconds) / counted for seconds in took), whole.frame_seconds)


class _Began:
    """Clocks of a unit."""

    def __init__(self) -> None:
        reset_peak()
        self._wall, self._cpu = perf_counter(), process_time()

    def outcome(self, rows: list[dict[str, Any]], unit: Unit, overhead: float) -> Outcome:
        """What became of it until now."""
        return Outcome(
            rows=rows,
            entries=list(unit.entries),
            overhead=overhead,
            seconds=perf_counter() - self._wall,
            cpu_seconds=process_time() - self._cpu,
            peak_memory=peak_memory(),
            host=socket.gethostname(),
            process=os.getpid(),
        )


class _Opened(NamedTuple):
    """A unit with everything that it names at hand, by entry."""

    unit: Unit
    sequence: Sequence
    contestants: list[Contestant]
    identities: list[Identity]
    unfinished: list[Path]
    segments: list[tuple[NDArray[np.int32], ...]]  # frames by segment, see `Run`
    results: Results


def _open(unit: Unit, folder: Path) -> tuple[_Opened, list[str]]:
    """Open those entries of a unit whose tracker and sequence are what was planned.

    Gives them, one at least, and a sentence on each other one.

    Raises `SequenceError` where the sequence can't be opened, or nothing is what was planned.
    """
    sequence = datasets.load(unit.source.text, truth=unit.source.truth)
    mask = umask()
    chosen = _contestants({entry.tracker for entry in unit.entries})
    os.umask(mask)  # a file that is imported may change it
    results = Results(folder)
    entries: list[Entry] = []
    opened = _Opened(unit, sequence, [], [], [], [], results)
    changed = []
    for entry in unit.entries:
        tracker = chosen.get(entry.tracker)
        key = tracker and identify(tracker, sequence, entry.repetition, unit.protocol)
        if tracker is None or key is None or key.version != entry.version:
            changed.append(
                f"{entry.tracker} on {sequence.name}: the tracker or the sequence changed while "
                "it ran, so nothing was kept. Run the same command again."
            )
            continue
        entries.append(entry)
        opened.contestants.append(tracker)
        opened.identities.append(key)
        opened.unfinished.append(beside(results.path(key), UNFINISHED))
        opened.segments.append(frames_of_segments(unit.protocol, sequence, tracker.init))
    if not entries:
        raise SequenceError("\n".join(dict.fromkeys(changed)))
    return opened._replace(unit=replace(unit, entries=tuple(entries))), changed


def _contestants(texts: Collection[str]) -> dict[str, Contestant]:
    """Trackers by their texts, without those that are gone."""
    try:
        return contestants(texts)
    except (TrackerError, OSError):
        found: dict[str, Contestant] = {}
        for text in texts:
            with suppress(TrackerError, OSError):
                found |= contestants([text])
        return found


def _runs(
    opened: _Opened, run_seconds: float, rows: list[NDArray[np.float64]], observer: Observer
) -> tuple[list[Run], dict[str, float]]:
    """Make the runs, and tell what was measured beside them."""
    unit = opened.unit
    repetitions = [entry.repetition for entry in unit.entries]
    entries = list(zip(opened.contestants, repetitions, strict=True))
    passed = run_protocol(
        entries,
        opened.sequence,
        unit.protocol,
        keep_arrays=unit.arrays,
        run_seconds=run_seconds,
        rows=rows,
        observer=observer,
    )
    if unit.protocol == TIMING:
        return passed.runs, {}
    return passed.runs, {"overhead": passed.overhead, "frame_seconds": passed.frame_seconds}


def _checked_surroundings(runs: list[Run], before: Surroundings, opened: _Opened) -> list[Run]:
    """Runs whose trackers have left alone what they have in common.

    Of several nobody can tell who did not; and what others did after that is worth nothing.
    """
    now = Surroundings.now()
    if now == before:
        return runs
    before.restore()
    if len(runs) > 1:
        raise NotAttributableError("what the trackers have in common was changed")
    (run,), (chosen,) = runs, opened.contestants
    declared = chosen.randomness is Randomness.PROCESS
    if now.numbers == before.numbers or run.failure or declared:
        return runs
    return [replace(run, failure=_GLOBAL_NUMBERS)]


def _store(runs: list[tuple[Run, Entry]], opened: _Opened) -> list[dict[str, Any]]:
    results = opened.results
    origin = opened.unit.source.absolute()
    source = {"source": origin.text, "truth": str(origin.truth or "")}
    rows = []
    for run, entry in runs:
        told = replace(run, circumstances={**run.circumstances, **source})
        path = results.path(told.identity)
        results.write(told, entry.replaces)  # unless another process was quicker: its run stands
        rows.append({"path": str(path.relative_to(results.folder))})
    return rows
