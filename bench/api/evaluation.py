"""Functions that run trackers on sequences: in memory, or stored in a folder."""

import sys
import warnings
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import replace
from numbers import Integral
from pathlib import Path
from threading import RLock
from typing import Any

from trackmark import datasets
from trackmark.bench.analysis.run_summary import tracker_line
from trackmark.bench.api.process_state import restored_process_state
from trackmark.bench.api.run_bar import RunBar
from trackmark.bench.api.runs import PrintedRuns, load_experiment, metrics_by_name
from trackmark.bench.api.tracker_arguments import (
    resolve_trackers,
    tracker_specs,
    unsaved_reason,
)
from trackmark.bench.evaluation.loop import cached_frames, run_protocol
from trackmark.bench.evaluation.run_record import Run, drawing_note
from trackmark.bench.evaluation.scoring import can_score
from trackmark.bench.evaluation.sequence_cache import are_equal, load_sequence, remember_evaluated
from trackmark.bench.execution.executor import run_experiment
from trackmark.bench.experiments.experiment import Experiment, SequenceSpec, default_name
from trackmark.bench.experiments.tracker_spec import TrackerSpec
from trackmark.bench.external import close_idle_processes
from trackmark.bench.operating_system import FRAME_FOLDER, FRAME_PREFIX, in_child, remove_abandoned
from trackmark.bench.protocols import ONE_PASS, parse_protocol, protocol_of_key
from trackmark.bench.store.truth import stored_truth
from trackmark.datasets import Sequence, SequenceError
from trackmark.trackers import Randomness, TrackerError
from trackmark.trackers.base.estimate_check import value_text

_one_thread = RLock()  # threads share sequences and processes of trackers


def evaluate(
    trackers: Any,
    sequences: Any,
    *,
    repetitions: int = 1,
    protocol: str = ONE_PASS,
    metrics: str = "native",
    seed: int | None = None,
    raise_errors: bool = False,
    progress: bool | None = None,
) -> PrintedRuns:
    """Run trackers on sequences in this process, and keep the runs in memory.

    Parameters
    ----------
    trackers : str, type, callable, object, dict or list
        Specification such as `camshift:window=adaptive` or `matcher.py`, or a class with the
        methods `init(image, box)` and `update(image)`. A function that creates such an object, and
        an object itself, are also trackers. A dict gives trackers names; a list has several. An
        object is used for all sequences, by calls of `init`. A class or a function gets the
        arguments `seed` (an int) and `rng` (a generator) if it has arguments with these names.
    sequences : str, Path, Sequence or list
        Name, path, pattern with `*` and `?`, suite or folder of sequences; a Sequence; or a list of
        these.
    repetitions : int
        Number of runs of stochastic trackers per sequence; other trackers run once.
    protocol : str
        Protocol, for example `supervised:skip_frames=10`; see docs/protocols.md.
    metrics : str
        Default metrics of the results: one of `trackmark.metrics.names()`.
    seed : int, optional
        Selects other random numbers for all runs. Such results cannot be saved.
    raise_errors : bool
        Raise the first exception of a tracker. By default it ends only its own run, which is then
        `failed`, and a `RuntimeWarning` is issued.
    progress : bool, optional
        Show a bar on standard error after a second; by default in a terminal and in a notebook.

    Returns
    -------
    Runs
        One run per tracker, sequence and repetition.

    Raises
    ------
    TypeError
        For an object that is not a tracker, a sequence or the name of metrics.
    TrackerError, SequenceError, ProtocolError, ValueError
        For invalid or unknown names or values, and for a sequence without ground truth. If an image
        of one of several sequences cannot be read, a warning is issued and its runs are missing.
    """
    base_seed = 0 if seed is None else seed
    protocol_key = _check(protocol, metrics, repetitions=repetitions, seed=base_seed)
    specs = resolve_trackers(trackers, repetitions, seed)
    opened = _open_sequences(sequences)
    for sequence, _ in opened:
        sequence.check_runnable()
    unsaved_reasons = {spec.label: unsaved_reason(spec) for spec in specs}
    planned_runs = _planned_runs(specs, repetitions)
    search_path = list(sys.path)
    remove_abandoned(Path(FRAME_FOLDER), FRAME_PREFIX)
    bar = RunBar(is_shown=progress)
    try:
        runs, errors = _run_all(planned_runs, opened, protocol_key, raise_errors, bar)
        # Only a run can show that its tracker draws from global generators.
        drew = {run.identity.tracker for run in runs if "generators" in run.metadata}
        stochastic = [spec for spec in specs if _runs_once(spec) and spec.label in drew]
        missing = [
            (spec, repetition) for spec in stochastic for repetition in range(1, repetitions)
        ]
        readable = [pair for pair in opened if pair[0].name not in errors]
        more, more_errors = _run_all(missing, readable, protocol_key, raise_errors, bar)
    finally:
        bar.close()
        close_idle_processes()
        sys.path[:] = search_path
    errors |= more_errors
    if len(errors) == len(opened):
        first, *other_errors = errors.values()
        if not other_errors:
            raise first
        raise SequenceError(f"{first} None of the {len(opened)} sequences can be read.") from first
    for error in errors.values():
        warnings.warn(f"{error} Its runs are missing.", RuntimeWarning, stacklevel=2)
    _warn_of_drawing(runs, stochastic)
    sequences_run = [sequence for sequence, _ in opened]
    truths = map(stored_truth, sequences_run)
    evaluated = PrintedRuns.in_memory(_in_order([*runs, *more], specs, sequences_run), truths)
    evaluated.protocol, evaluated.metrics = protocol_key, metrics_by_name(metrics, protocol_key)
    evaluated.unsaved_reasons, evaluated.sequences = unsaved_reasons, sequences_run
    _warn_of_failures(evaluated)
    return evaluated


def run(
    trackers: Any,
    sequences: Any,
    folder: str | Path | None = None,
    *,
    repetitions: int = 1,
    protocol: str = ONE_PASS,
    metrics: str = "native",
    jobs: int | None = None,
) -> PrintedRuns:
    """Run trackers on sequences in worker processes, and store the runs in a folder.

    Stored runs are not repeated, so that an interrupted call can be continued. A tracker that
    crashes or hangs ends only its own run.

    Parameters
    ----------
    trackers : str, Path or list of these
        Specifications, such as `camshift:window=adaptive` or `matcher.py:Matcher`.
    sequences : str, Path or list of these
        Names, paths, patterns with `*` and `?`, suites or folders of sequences.
    folder : str or Path, optional
        Folder of these runs; by default a folder in `results` whose name depends on trackers and
        sequences, as for `trackmark run`.
    repetitions, protocol, metrics
        As for `evaluate`.
    jobs : int, optional
        Number of worker processes; one per core by default.

    Returns
    -------
    Runs
        All runs in the folder by the protocol.

    Raises
    ------
    TrackerError, SequenceError, ExperimentError, ProtocolError, ResultsError, ValueError
        If a part cannot be executed. Finished runs stay stored.
    """
    _check(protocol, metrics, repetitions=repetitions, jobs=1 if jobs is None else jobs)
    if not isinstance(folder, str | Path | None):
        raise TypeError(f"folder is {value_text(folder)}. Expected: a text or a Path.")
    specs, selected = tracker_specs(trackers), list(_sequence_specs(sequences))
    default = Path("results") / default_name(specs, [text for text, _ in selected])
    path = (default if folder is None else Path(folder)).expanduser().absolute()
    experiment = Experiment(
        name=path.name,
        trackers=specs,
        sequences=tuple(SequenceSpec(name) for _, name in selected),
        repetitions=repetitions,
        protocol=protocol,
    )
    loaded = load_experiment(run_experiment(experiment, path.parent, jobs), metrics, protocol)
    _warn_of_failures(loaded)
    return loaded


def _check(protocol: str, metrics: str, **integers: int) -> str:
    """Return the key of a protocol; raise an error for invalid arguments."""
    if in_child():
        raise TrackerError(
            "a file that trackmark imports as a tracker starts runs itself. Put them below "
            "if __name__ == '__main__':"
        )
    try:
        Path.cwd()
    except FileNotFoundError:
        raise FileNotFoundError(
            "the working directory was removed. Change to an existing folder by os.chdir."
        ) from None
    for name, value in integers.items():
        minimum = 0 if name == "seed" else 1
        if not isinstance(value, Integral) or isinstance(value, bool) or value < minimum:
            raise ValueError(
                f"{name} is {value_text(value)}. Expected: an integer of {minimum} or more."
            )
    protocol_key = parse_protocol(protocol).key
    if not can_score(name := metrics_by_name(metrics, protocol_key), protocol_key):
        raise ValueError(f"{name} cannot score runs by the protocol {protocol}.")
    return protocol_key


def _listed(sequences: Any) -> list[Any]:
    return list(sequences) if isinstance(sequences, list | tuple) else [sequences]


def _sequence_specs(sequences: Any) -> Iterator[tuple[str, str]]:
    """Yield each text or path of an argument with each sequence that it selects."""
    for item in _listed(sequences):
        if not isinstance(item, str | Path):
            raise TypeError(
                f"{value_text(item)} is not a name or path of a sequence. trackmark.evaluate also "
                "takes a Sequence."
            )
        spec = str(item.expanduser().absolute()) if isinstance(item, Path) else item
        for name in datasets.matching(spec):
            yield spec, name


def _open_sequences(sequences: Any) -> list[tuple[Sequence, str]]:
    """Return the sequences of an argument with their absolute texts, empty for Sequence objects.

    Raises `SequenceError` for two different sequences of one name.
    """
    opened: dict[str, tuple[Sequence, str]] = {}
    for item in _listed(sequences):
        if isinstance(item, Sequence):
            pairs = [(item, "")]
        else:
            pairs = [
                (load_sequence(spec), SequenceSpec(spec).absolute().spec)
                for _, spec in _sequence_specs(item)
            ]
        for sequence, source in pairs:
            other, _ = opened.setdefault(sequence.name, (sequence, source))
            if not are_equal(other, sequence):
                raise SequenceError(
                    f"two different sequences are called {sequence.name!r}. Evaluate them in two "
                    "calls."
                )
    if not opened:
        raise SequenceError("no sequence is given. Give at least one.")
    for sequence, _ in opened.values():
        remember_evaluated(sequence)
    return list(opened.values())


def _runs_once(spec: TrackerSpec) -> bool:
    return spec.randomness is Randomness.NONE


def _planned_runs(specs: list[TrackerSpec], repetitions: int) -> list[tuple[TrackerSpec, int]]:
    """Return the runs on each sequence."""
    counts = [(spec, 1 if _runs_once(spec) else repetitions) for spec in specs]
    return [(spec, repetition) for spec, count in counts for repetition in range(count)]


def _run_all(
    planned_runs: list[tuple[TrackerSpec, int]],
    opened: list[tuple[Sequence, str]],
    protocol_key: str,
    raise_errors: bool,
    bar: RunBar,
) -> tuple[list[Run], dict[str, SequenceError]]:
    """Return the runs on all sequences, and the errors of unreadable sequences by name."""
    runs: list[Run] = []
    bar.expect(len(planned_runs) * len(opened))
    errors: dict[str, SequenceError] = {}
    for sequence, source in opened if planned_runs else ():
        try:
            on_sequence = _run_trackers(planned_runs, sequence, protocol_key, raise_errors, bar)
        except SequenceError as error:  # the runs on other sequences are not lost
            if raise_errors:
                raise
            errors[sequence.name] = error
            continue
        origin = {"source": source} if source else {}
        for run_of_tracker in on_sequence:
            metadata = {**run_of_tracker.metadata, **origin}
            runs.append(replace(run_of_tracker, metadata=metadata))
    return runs, errors


def _run_trackers(
    planned_runs: list[tuple[TrackerSpec, int]],
    sequence: Sequence,
    protocol_key: str,
    raise_errors: bool,
    bar: RunBar,
) -> list[Run]:
    """Return the runs on a sequence."""
    passes = list(_passes(planned_runs, protocol_key))
    runs: list[Run] = []
    with _one_thread, cached_frames(sequence) if len(passes) > 1 else nullcontext():
        for runs_of_pass in passes:
            with restored_process_state(), bar.running(len(runs_of_pass), sequence):
                runs += run_protocol(
                    runs_of_pass, sequence, protocol_key, raise_errors=raise_errors, observer=bar
                ).runs
    return runs


def _passes(
    planned_runs: list[tuple[TrackerSpec, int]], protocol_key: str
) -> Iterator[list[tuple[TrackerSpec, int]]]:
    """Yield the runs of each pass over a sequence.

    Trackers share the images of a pass, unless time counts. A class of the caller can change the
    state of the process, and therefore has a pass of its own. Repetitions of a tracker in another
    process have different passes, so that they use one process, with one model in memory.
    """
    time_dependent = protocol_of_key(protocol_key).time_dependent
    shared: dict[int, list[tuple[TrackerSpec, int]]] = {}
    for spec, repetition in planned_runs:
        uses_process = not spec.is_built_in or spec.randomness is Randomness.PROCESS
        if time_dependent or (uses_process and not spec.is_isolated):
            yield [(spec, repetition)]
        else:
            shared.setdefault(repetition if spec.is_isolated else 0, []).append((spec, repetition))
    yield from shared.values()


def _in_order(runs: list[Run], specs: list[TrackerSpec], sequences: list[Sequence]) -> list[Run]:
    """Return runs in the order of sequences, trackers and repetitions."""
    labels, names = [spec.label for spec in specs], [sequence.name for sequence in sequences]

    def order(run: Run) -> tuple[int, int, int]:
        key = run.identity
        return names.index(key.sequence), labels.index(key.tracker), key.repetition

    return sorted(runs, key=order)


def _warn_of_drawing(runs: list[Run], specs: list[TrackerSpec]) -> None:
    """Issue a warning for each tracker that does not declare its random numbers."""
    for spec in specs:
        names = {
            name
            for run in runs
            if run.identity.tracker == spec.label
            for name in run.metadata.get("generators", ())
        }
        message = drawing_note(spec.label, ", ".join(sorted(names)))
        warnings.warn(message, RuntimeWarning, stacklevel=3)


def _warn_of_failures(runs: PrintedRuns) -> None:
    """Issue a warning with the first failed run."""
    failed = [
        row for row in runs.evaluated_rows(protocol=runs.protocol) if row["status"] == "failed"
    ]
    if not failed:
        return
    first, failure = failed[0], str(failed[0]["failure"])
    line, reason = tracker_line(failure), failure.splitlines()[0].rstrip(".")
    warnings.warn(
        f"{len(failed)} of {len(runs)} runs failed. First: {first['tracker']} on "
        f"{first['sequence']}, {reason}{f' ({line})' if line else ''}. "
        "runs.failures lists all; evaluate(..., raise_errors=True) raises the exception.",
        RuntimeWarning,
        stacklevel=3,
    )
