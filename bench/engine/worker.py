"""Worker process: performs the units that its parent requests.

Only `bench.engine.pool` starts it. `perform` runs a unit, from opening the sequence to the runs;
the parent stores and scores them, where no tracker has run.
"""

import ctypes
import faulthandler
import os
import pickle
import resource
import select
import signal
import socket
import sys
import threading
import time
import traceback
from collections.abc import Collection
from contextlib import suppress
from dataclasses import dataclass, replace
from math import nan
from typing import Any, NamedTuple

import cv2
import numpy as np

from trackmark import datasets
from trackmark.bench.engine.heartbeat import Heartbeat, NoRoomError
from trackmark.bench.engine.process_state import (
    ProcessState,
    can_open_files,
    limit_memory,
    peak_memory,
    reset_peak,
)
from trackmark.bench.engine.stack_trace import select_line
from trackmark.bench.engine.work_unit import Entry, Failure, Outcome, Probed, Unit
from trackmark.bench.evaluation.ground_truth import reference
from trackmark.bench.evaluation.loop import UNOBSERVED, Observer, run_protocol
from trackmark.bench.evaluation.recorder import (
    COLUMNS,
    LONGEST_TRACEBACK,
    NotAttributableError,
    frames_of_segments,
)
from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.experiments.tracker_spec import Contestant, Identity, contestants, identify
from trackmark.bench.numba_compilation import attend
from trackmark.bench.protocols import TIMING
from trackmark.datasets import Sequence, SequenceError
from trackmark.trackers import Randomness, TrackerError

_PARENT_SECONDS = 1.0
_IDLE_SECONDS = 60.0  # a Dask worker outlives the command that it worked for
_DEATH_SIGNAL = 1  # Linux: PR_SET_PDEATHSIG
_SUBREAPER = 36  # Linux: PR_SET_CHILD_SUBREAPER
_SHORTEST = 2  # frames of a pass
_NO_MEMORY = "the memory is exhausted"
_GLOBAL_NUMBERS = (
    "it drew from the process's global random numbers (numpy.random or random), so that its boxes "
    "can't be repeated. Use the seed that it is given, or declare Randomness.PROCESS."
)


@dataclass(frozen=True)
class Request:
    """Request to run a unit; or to record its only run as failed, or to probe its trackers."""

    unit: Unit
    run_seconds: float
    failure: Failure | None = None
    probed_frames: int = 0

    def perform(self, observer: Observer) -> Outcome | Probed:
        """Do what is requested."""
        if self.failure:
            return record_failure(self.unit, self.failure)
        if self.probed_frames:
            return probe(self.unit, self.probed_frames, observer)
        return perform(self.unit, self.run_seconds, observer)


def main() -> None:
    """Perform requests until the parent is gone, or has none for a while.

    The command line holds the descriptors of an inherited socket, of the file of the heartbeat and
    of the file of stack traces, the process number of the parent, and a memory limit in bytes. Each
    message in the file is followed by one byte through the socket.
    """
    channel, shared, trace, parent, memory = map(int, sys.argv[1:])
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the command's business
    faulthandler.enable(trace, all_threads=False)
    # The parent aborts a hung worker: do not write its memory to disk.
    resource.setrlimit(resource.RLIMIT_CORE, (0, resource.getrlimit(resource.RLIMIT_CORE)[1]))
    _end_with(parent)
    cv2.setNumThreads(1)
    # What was printed last must be in the file if the process dies.
    sys.stdout.reconfigure(line_buffering=True, errors="backslashreplace")  # type: ignore[union-attr]  # a file
    heartbeat = Heartbeat(shared)
    attend(heartbeat.compiling)
    limit_memory(memory)
    used = False
    while select.select([channel], [], [], _IDLE_SECONDS)[0] and os.read(channel, 1):
        request = pickle.loads(heartbeat.read_message())  # noqa: S301  # of the parent
        threads = threading.active_count()
        try:
            answer = _answer(request, heartbeat, used)
            worn = threading.active_count() > threads
            heartbeat.write_message(answer | {"worn": worn})
        except NoRoomError:
            heartbeat.write_no_room()
        used = True
        os.write(channel, b".")


def _answer(request: Request, heartbeat: Heartbeat, used: bool) -> dict[str, Any]:
    """Return the result of a request, or what went wrong.

    `harm` is the reason if a tracker may be the cause; `error` is wrong with the sequence; `defect`
    is one of the harness. `used`: whether trackers were called in this process before.
    """
    try:
        result = request.perform(heartbeat)
        sys.stdout.flush()
    except (SequenceError, MemoryError) as error:
        # A tracker that was called may hold the memory or the files that decoding lacks.
        called = used or heartbeat.has_called
        if isinstance(error, MemoryError) or (isinstance(error.__cause__, MemoryError) and called):
            return {"harm": _NO_MEMORY}
        if called and not can_open_files():
            return {"harm": "it used up the files that its process may open"}
        return {"error": str(error)}
    except NotAttributableError as error:
        return {"harm": str(error)}
    except NoRoomError:
        raise
    except Exception as error:  # noqa: BLE001  # trackers' errors are caught where they are called
        if heartbeat.has_called or request.unit.owner:  # a tracker may have changed the harness
            text = "".join(traceback.format_exception_only(error)).strip()[:LONGEST_TRACEBACK]
            return {"harm": f"the harness fails after it: {text}"}
        return {"defect": traceback.format_exc()}
    except BaseException as error:  # noqa: BLE001  # raised by a tracker to end the process
        return {"harm": f"it raised {type(error).__name__}"}
    return {"probed" if isinstance(result, Probed) else "outcome": result}


def perform(unit: Unit, run_seconds: float, observer: Observer = UNOBSERVED) -> Outcome:
    """Run a unit; runs whose tracker or sequence has changed since it was planned are left out.

    Raises `SequenceError` if the sequence can't be read to its end, or nothing is left. Raises
    `NotAttributableError` if one of several trackers harms the process.
    """
    clock = _Clock()
    opened, changed = _open(unit)
    before = ProcessState.current()
    entries = list(
        zip(opened.trackers, [entry.repetition for entry in opened.entries], strict=True)
    )
    walk = run_protocol(
        entries,
        opened.sequence,
        unit.protocol,
        keep_arrays=unit.arrays,
        run_seconds=run_seconds,
        observer=observer,
    )
    observer.ended()
    runs = _check_state(walk.runs, before, opened.trackers)
    if unit.protocol != TIMING:
        measured = {"overhead": walk.overhead, "frame_seconds": walk.frame_seconds}
        runs = [replace(run, circumstances={**run.circumstances, **measured}) for run in runs]
    # Boxes of one version must never be stored as those of another.
    still, changed_since = _open(replace(unit, entries=tuple(opened.entries)))
    made = dict(zip(opened.entries, runs, strict=True))
    outcome = clock.outcome([made[entry] for entry in still.entries], still, walk.overhead)
    return replace(outcome, errors=[*changed, *changed_since])


def record_failure(unit: Unit, failure: Failure) -> Outcome:
    """Record the only run of a unit as failed, with the frames that it reached."""
    clock = _Clock()
    opened, _ = _open(unit)
    sequence, (tracker,), (key,) = opened.sequence, opened.trackers, opened.identities
    segments = frames_of_segments(unit.protocol, sequence, tracker.init)
    n = sum(map(len, segments)) or len(sequence)
    rows = np.full((n, COLUMNS), nan)
    if len(failure.rows) == rows.nbytes:
        rows = np.frombuffer(failure.rows).reshape(rows.shape).copy()
    if not segments:
        init_boxes = reference(sequence, tracker.init, sequence.name).boxes
        rows[sequence.first_frame, :4] = init_boxes[sequence.first_frame]
    frame = -1 if failure.frame is None else failure.frame
    where = f"{sequence.frame_name(frame)}: " if 0 <= frame < len(sequence) else ""
    line = f" at {select_line(failure.stack, tracker.file)}" if failure.stack else ""
    run = Run(
        identity=key,
        boxes=rows[:, :4],
        visible=rows[:, 4] == 1,
        confidence=rows[:, 5],
        failure=where + failure.reason + line,
        output=failure.output,
        segments=segments,
    )
    return clock.outcome([run], opened, nan)


def probe(unit: Unit, frames: int, observer: Observer = UNOBSERVED) -> Probed:
    """Time a unit's trackers on the first `frames` frames of its sequence, at least 3."""
    sequence = datasets.load(unit.source.text, truth=unit.source.truth)
    chosen = contestants(entry.tracker for entry in unit.entries)
    entries = [(chosen[entry.tracker], entry.repetition) for entry in unit.entries]
    first = sequence.first_frame
    # The first pass compiles kernels and fills caches; the second measures the initialisation.
    _, beginning, whole = (
        run_protocol(entries, sequence[first : first + n], observer=observer)
        for n in (_SHORTEST, _SHORTEST, frames)
    )
    counted = max(1, min(frames, len(sequence) - first) - _SHORTEST)
    seconds = [
        nan if b.failure else float(b.circumstances["seconds"] - a.circumstances["seconds"])
        for a, b in zip(beginning.runs, whole.runs, strict=True)
    ]
    return Probed([max(0.0, value) / counted for value in seconds], whole.frame_seconds)


class _Clock:
    """Clock of a unit."""

    def __init__(self) -> None:
        reset_peak()
        self._wall, self._cpu = time.perf_counter(), time.process_time()

    def outcome(self, runs: list[Run], opened: "_Opened", overhead: float) -> Outcome:
        """Return the outcome of a unit that ends now."""
        return Outcome(
            runs=runs,
            entries=opened.entries,
            overhead=overhead,
            seconds=time.perf_counter() - self._wall,
            cpu_seconds=time.process_time() - self._cpu,
            peak_memory=peak_memory(),
            host=socket.gethostname(),
            process=os.getpid(),
        )


class _Opened(NamedTuple):
    """Sequence of a unit, and tracker and identity by entry."""

    sequence: Sequence
    entries: list[Entry]
    trackers: list[Contestant]
    identities: list[Identity]


def _open(unit: Unit) -> tuple[_Opened, list[str]]:
    """Open the entries of a unit whose tracker and sequence are as planned.

    Return them and a sentence on each other one. Raises `SequenceError` if the sequence can't be
    opened, or nothing is as planned.
    """
    sequence = datasets.load(unit.source.text, truth=unit.source.truth)
    chosen = _import_trackers({entry.tracker for entry in unit.entries})
    opened = _Opened(sequence, [], [], [])
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
        opened.entries.append(entry)
        opened.trackers.append(tracker)
        opened.identities.append(key)
    if not opened.entries:
        raise SequenceError("\n".join(dict.fromkeys(changed)))
    return opened, changed


def _import_trackers(texts: Collection[str]) -> dict[str, Contestant]:
    """Return trackers by their texts, without those that are gone."""
    try:
        return contestants(texts)
    except (TrackerError, OSError):
        found: dict[str, Contestant] = {}
        for text in texts:
            with suppress(TrackerError, OSError):
                found |= contestants([text])
        return found


def _check_state(runs: list[Run], before: ProcessState, trackers: list[Contestant]) -> list[Run]:
    """Restore the state of the process; return the runs, failed if one drew global numbers.

    Raises `NotAttributableError` if one of several trackers changed the state: runs of the others
    may depend on it.
    """
    now = ProcessState.current()
    if now == before:
        return runs
    before.restore()
    if len(runs) > 1:
        raise NotAttributableError("what the trackers have in common was changed")
    (run,), (tracker,) = runs, trackers
    declared = tracker.randomness is Randomness.PROCESS
    if now.numbers == before.numbers or run.failure or declared:
        return runs
    return [replace(run, failure=_GLOBAL_NUMBERS)]


def _end_with(parent: int) -> None:
    """End this process when its parent is gone."""
    if sys.platform == "linux":
        # At once, and even if a tracker lets no thread run.
        ctypes.CDLL(None).prctl(_DEATH_SIGNAL, signal.SIGKILL)
        # Processes that a tracker starts and abandons stay descendants, and are ended too.
        ctypes.CDLL(None).prctl(_SUBREAPER, 1)
    threading.Thread(target=_watch_parent, args=(parent,), daemon=True).start()


def _watch_parent(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_PARENT_SECONDS)
    os._exit(1)
