"""Worker process: runs the units that its parent requests.

`bench.engine.pool` starts the process. `perform` opens the sequence of a unit and returns its runs.
The parent process, in which no tracker runs, stores and scores them.
"""

import ctypes
import faulthandler
import json
import os
import pickle
import resource
import select
import signal
import sys
import threading
import traceback
from dataclasses import replace
from math import nan
from typing import Any

import cv2
import numpy as np

from trackmark import datasets
from trackmark.bench.engine.heartbeat import Heartbeat
from trackmark.bench.engine.process_state import (
    ProcessState,
    can_open_files,
    limit_memory,
)
from trackmark.bench.engine.stack_trace import select_line
from trackmark.bench.engine.work_unit import Entry, Failure, Request, Unit, UnusableTrackerError
from trackmark.bench.evaluation.ground_truth import select_ground_truth
from trackmark.bench.evaluation.loop import NULL_OBSERVER, Observer, run_protocol
from trackmark.bench.evaluation.recorder import (
    COLUMNS,
    MAX_TRACEBACK_CHARACTERS,
    NotAttributableError,
    segment_frames,
)
from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.experiments.tracker_spec import (
    Identity,
    TrackerSpec,
    parse_trackers,
    planned_values,
    run_identity,
)
from trackmark.bench.external.process import ExternalTrackerError
from trackmark.bench.machine_errors import MachineError, machine_fault
from trackmark.bench.numba_compilation import prepare_numba
from trackmark.bench.protocols import TIMING
from trackmark.datasets import Sequence, SequenceError
from trackmark.trackers import Randomness, TrackerError

_IDLE_SECONDS = 60.0  # a Dask worker can outlive its command
_DEATH_SIGNAL = 1  # Linux: PR_SET_PDEATHSIG
_SUBREAPER = 36  # Linux: PR_SET_CHILD_SUBREAPER
_NO_MEMORY = "the memory is exhausted"
_GLOBAL_NUMBERS = (
    "it used the global random generators (numpy.random or random), which are not seeded for "
    "trackers of the package. Use the seed that the tracker receives, or declare "
    "Randomness.PROCESS."
)


def main() -> None:
    """Process requests until the parent has ended, or has sent none for a while.

    The command-line arguments are the descriptors of an inherited socket, of the heartbeat file and
    of the file for stack traces, the parent's process id, and a memory limit [bytes]. After each
    message in the heartbeat file, one byte is sent through the socket.
    """
    channel, shared, trace, parent, memory = map(int, sys.argv[1:])
    del sys.argv[1:]  # they are not arguments of a tracker
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the command handles Ctrl-C
    faulthandler.enable(trace, all_threads=False)
    # The parent aborts a hung worker; prevent a core dump.
    resource.setrlimit(resource.RLIMIT_CORE, (0, resource.getrlimit(resource.RLIMIT_CORE)[1]))
    _end_with(parent)
    cv2.setNumThreads(1)
    # The last lines must be in the output file if the process crashes.
    sys.stdout.reconfigure(encoding="utf-8", errors="backslashreplace", line_buffering=True)  # type: ignore[union-attr]  # a file
    heartbeat = Heartbeat(shared)
    prepare_numba(heartbeat.compiling)
    limit_memory(memory)
    used = False
    while select.select([channel], [], [], _IDLE_SECONDS)[0] and os.read(channel, 1):
        request = pickle.loads(heartbeat.read_message())  # noqa: S301  # written by the parent
        threads = threading.active_count()
        try:
            answer = _answer(request, heartbeat, used)
            worn = threading.active_count() > threads
            heartbeat.write_message(answer | {"worn": worn})
        except MachineError:  # the answer itself cannot be written
            heartbeat.write_no_room()
        used = True
        os.write(channel, b".")


def _answer(request: Request, heartbeat: Heartbeat, used: bool) -> dict[str, Any]:
    """Return the result of a request, or an error.

    An error has one key: `machine` (message, for a full disk), `harm` (reason, if a tracker may be
    the cause), `error` (message, for an error of the sequence) or `defect` (traceback of a defect
    of the harness). `used` is whether trackers were called in this process before.
    """
    try:
        if request.failure:
            result = [record_failure(request.unit, request.failure)]
        else:
            result = perform(request.unit, request.run_seconds, heartbeat)
        sys.stdout.flush()
    except (SequenceError, MemoryError) as error:
        if fault := machine_fault(error):
            return {"machine": str(fault)}
        # If decoding lacks memory or files, a tracker that was called may have used them up.
        called = used or heartbeat.has_called
        if isinstance(error, MemoryError) or (isinstance(error.__cause__, MemoryError) and called):
            return {"harm": _NO_MEMORY}
        if called and not can_open_files():
            return {"harm": "it opened all files that its process may open"}
        kind = "unusable" if isinstance(error, UnusableTrackerError) else "error"
        return {kind: str(error)}
    except NotAttributableError as error:
        return {"harm": str(error)}
    except Exception as error:  # noqa: BLE001  # trackers' errors are caught where they are called
        if fault := machine_fault(error):
            return {"machine": str(fault)}
        if heartbeat.has_called or request.unit.owner:  # a tracker may have modified the harness
            text = "".join(traceback.format_exception_only(error)).strip()
            text = text[:MAX_TRACEBACK_CHARACTERS]
            return {"harm": f"the harness failed after the tracker was called: {text}"}
        return {"defect": traceback.format_exc()}
    except BaseException as error:  # noqa: BLE001  # raised by a tracker to end the process
        return {"harm": f"it raised {type(error).__name__}"}
    return {"result": result}


def perform(unit: Unit, run_seconds: float, observer: Observer = NULL_OBSERVER) -> list[Run]:
    """Return the runs of a unit, in the order of its entries.

    Raises `SequenceError` if the sequence cannot be read to its end, or if the sequence or a
    tracker differs from the plan. Raises `NotAttributableError` if one of several trackers harms
    the process.
    """
    sequence, trackers = _open(unit)
    before = ProcessState.current()
    walk = run_protocol(
        zip(trackers, [entry.repetition for entry in unit.entries], strict=True),
        sequence,
        unit.protocol,
        keep_arrays=unit.arrays,
        run_seconds=run_seconds,
        observer=observer,
    )
    observer.on_loop_end()
    runs = _check_state(walk.runs, before, trackers)
    if unit.protocol != TIMING:
        measured = {"frame_seconds": walk.frame_seconds}
        runs = [replace(run, circumstances={**run.circumstances, **measured}) for run in runs]
    _check_unchanged(unit)  # boxes must not be stored under another version
    return runs


def record_failure(unit: Unit, failure: Failure) -> Run:
    """Return the only run of a unit as failed, with its rows up to the failure."""
    sequence, (tracker,) = _open(unit)
    key = run_identity(tracker, sequence, unit.entries[0].repetition, unit.protocol)
    segments = segment_frames(unit.protocol, sequence, tracker.init)
    n = sum(map(len, segments)) or len(sequence)
    rows = np.full((n, COLUMNS), nan)
    if len(failure.rows) == rows.nbytes:
        rows = np.frombuffer(failure.rows).reshape(rows.shape).copy()
    if not segments:
        init_boxes = select_ground_truth(sequence, tracker.init, sequence.name).boxes
        rows[sequence.first_frame, :4] = init_boxes[sequence.first_frame]
    is_known = 0 <= failure.frame < len(sequence)
    where = f"{sequence.frame_name(failure.frame)}: " if is_known else ""
    line = f" at {select_line(failure.stack, tracker.file)}" if failure.stack else ""
    return Run(
        identity=key,
        boxes=rows[:, :4],
        visible=rows[:, 4] == 1,
        confidence=rows[:, 5],
        failure=where + failure.reason + line,
        output=failure.output,
        segments=segments,
    )


def _open(unit: Unit) -> tuple[Sequence, list[TrackerSpec]]:
    """Return the sequence of a unit, and the trackers in the order of its entries.

    Raises `SequenceError` if the sequence cannot be opened or has changed since the plan, and
    `UnusableTrackerError` if a tracker cannot be created as planned.
    """
    sequence = datasets.load(unit.source.text, truth=unit.source.truth)
    texts = [entry.tracker for entry in unit.entries]
    try:
        chosen = parse_trackers(texts)
    except (TrackerError, OSError) as error:
        text = str(error)
        if isinstance(error, ExternalTrackerError):
            text = text.partition("\n")[0]  # its output can differ in each worker
        raise UnusableTrackerError(
            f"{text.removesuffix('.')}. This happens in a worker process, which imports the file "
            "again."
        ) from None
    trackers = [chosen[text] for text in texts]
    for entry, tracker in zip(unit.entries, trackers, strict=True):
        identity = run_identity(tracker, sequence, entry.repetition, unit.protocol)
        if identity.version != entry.version:
            problem = _difference(entry, identity)
            raise UnusableTrackerError(problem) if problem else _changed(entry.tracker, sequence)
    return sequence, trackers


def _check_unchanged(unit: Unit) -> None:
    """Raise `SequenceError` if the sequence or a tracker has changed since `_open`."""
    try:
        _open(unit)
    except SequenceError:
        texts = dict.fromkeys(entry.tracker for entry in unit.entries)
        sequence = datasets.load(unit.source.text, truth=unit.source.truth)
        raise _changed(", ".join(texts), sequence) from None


def _changed(tracker: str, sequence: Sequence) -> SequenceError:
    return SequenceError(
        f"{tracker} on {sequence.name}: the tracker or the sequence changed during its runs, "
        "which were not stored. Run the same command again."
    )


def _difference(entry: Entry, identity: Identity) -> str:
    """Return the error of a tracker whose equal source gives other values in each process.

    The text is empty if the source or the sequence differs.
    """
    planned, current = json.loads(entry.planned or "{}"), planned_values(identity)
    if not planned or planned["tracker_version"] != current["tracker_version"]:
        return ""
    # Each worker finds another value: without it, equal errors are printed once.
    remedy = "Expected: a value that does not depend on the process, the time or a random number."
    for name in current["parameters"]:
        old = planned["parameters"].get(name)
        if old != current["parameters"][name]:
            return (
                f"{entry.tracker}: the default of the argument {name!r} differs in each process, "
                f"for example {old!r}. {remedy}"
            )
    old = planned["tracker"]
    if old != current["tracker"]:
        return f"{entry.tracker}: its name differs in each process, for example {old!r}. {remedy}"
    return ""


def _check_state(runs: list[Run], before: ProcessState, trackers: list[TrackerSpec]) -> list[Run]:
    """Restore the process state; return the runs. A run that used global random numbers fails.

    Raises `NotAttributableError` if one of several trackers changed the state, because runs of the
    others may depend on it.
    """
    now = ProcessState.current()
    if now == before:
        return runs
    before.restore()
    if len(runs) > 1:
        raise NotAttributableError("a tracker changed the shared state of the process")
    (run,), (tracker,) = runs, trackers
    declared = tracker.randomness is Randomness.PROCESS
    if now.numbers == before.numbers or run.failure or declared:
        return runs
    return [replace(run, failure=_GLOBAL_NUMBERS)]


def _end_with(parent: int) -> None:
    """End this process when its parent ends; on other systems than Linux, after the unit."""
    if sys.platform == "linux":
        # The kernel ends the process at once, even if a tracker blocks all threads.
        ctypes.CDLL(None).prctl(_DEATH_SIGNAL, signal.SIGKILL)
        # Orphaned processes of a tracker remain descendants of this process, and are ended with it.
        ctypes.CDLL(None).prctl(_SUBREAPER, 1)
    if os.getppid() != parent:  # the parent has ended in the meantime
        os._exit(1)
