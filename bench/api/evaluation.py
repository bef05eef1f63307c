"""Functions that run trackers on sequences: in memory, or stored in a folder."""

import warnings
from collections.abc import Iterator
from dataclasses import replace
from numbers import Integral
from pathlib import Path
from threading import RLock
from typing import Any

from trackmark import datasets
from trackmark.bench.api.results import Results, load_experiment, preset_for
from trackmark.bench.api.tracker_arguments import resolve_trackers, tracker_texts, unsaved_reason
from trackmark.bench.comparing.run_summary import tracker_line
from trackmark.bench.evaluation.loop import run_protocol
from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.evaluation.scoring import can_score
from trackmark.bench.evaluation.sequence_cache import are_equal, load_sequence, remember_evaluated
from trackmark.bench.execution.executor import run_experiment
from trackmark.bench.experiments.experiment import Experiment, SequenceSource, default_name
from trackmark.bench.experiments.tracker_spec import TrackerSpec
from trackmark.bench.external.plugin import close_idle_processes
from trackmark.bench.external.process import FRAME_FOLDER, FRAME_PREFIX
from trackmark.bench.process_tree import in_child
from trackmark.bench.protocols import ONE_PASS, parse_protocol, stored_protocol
from trackmark.datasets import Sequence, SequenceError
from trackmark.reports.temporary_paths import remove_abandoned
from trackmark.trackers import Randomness, TrackerError

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
) -> Results:
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
        Protocol, for example `supervised:skip=10`; see docs/protocols.md.
    metrics : str
        Default metrics of the results: one of `trackmark.metrics.names()`.
    seed : int, optional
        Selects other random numbers for all runs. Such results cannot be saved.
    raise_errors : bool
        Raise the first exception of a tracker. By default it ends only its own run, which is then
        `failed`, and a `RuntimeWarning` is issued.

    Returns
    -------
    Results
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
    stored = _check(protocol, metrics, repetitions=repetitions, seed=base_seed)
    specs = resolve_trackers(trackers, repetitions, seed)
    opened = _open_sequences(sequences)
    for sequence, _ in opened:
        sequence.check_runnable()
    in_memory = {spec.label: unsaved_reason(spec) for spec in specs}
    runs: dict[tuple[str, str, int], Run] = {}
    remove_abandoned(Path(FRAME_FOLDER), FRAME_PREFIX)
    try:
        for sequence, source in opened:
            try:
                sequence_runs = _run_trackers(specs, repetitions, sequence, stored, raise_errors)
            except SequenceError as error:  # the runs on other sequences are not lost
                if raise_errors or len(opened) == 1:
                    raise
                warnings.warn(f"{error} Its runs are missing.", RuntimeWarning, stacklevel=2)
                continue
            origin = {"source": source} if source else {}
            for run_of_tracker in sequence_runs:
                key = (
                    run_of_tracker.identity.tracker,
                    sequence.name,
                    run_of_tracker.identity.repetition,
                )
                circumstances = {**run_of_tracker.circumstances, **origin}
                runs[key] = replace(run_of_tracker, circumstances=circumstances)
    finally:
        close_idle_processes()
    results = Results(runs, stored, metrics, [sequence for sequence, _ in opened], in_memory)
    _warn_of_failures(results)
    return results


def run(
    trackers: Any,
    sequences: Any,
    output: str | Path | None = None,
    *,
    repetitions: int = 1,
    protocol: str = ONE_PASS,
    metrics: str = "native",
    jobs: int | None = None,
) -> Results:
    """Run trackers on sequences in worker processes, and store the runs in a folder.

    Stored runs are not repeated, so that an interrupted call can be continued. A tracker that
    crashes or hangs ends only its own run.

    Parameters
    ----------
    trackers : str, Path or list of these
        Specifications, such as `camshift:window=adaptive` or `matcher.py:Matcher`.
    sequences : str, Path or list of these
        Names, paths, patterns with `*` and `?`, suites or folders of sequences.
    output : str or Path, optional
        Folder of these results; by default a folder in `results` whose name depends on trackers and
        sequences, as for `trackmark run`.
    repetitions, protocol, metrics
        As for `evaluate`.
    jobs : int, optional
        Number of worker processes; one per core by default.

    Returns
    -------
    Results
        All runs in the folder by the protocol.

    Raises
    ------
    TrackerError, SequenceError, ExperimentError, ProtocolError, ResultsError, ValueError
        If a part cannot be executed. Finished runs stay stored.
    """
    _check(protocol, metrics, repetitions=repetitions, jobs=1 if jobs is None else jobs)
    texts, selected = tracker_texts(trackers), list(_sequence_texts(sequences))
    default = Path("results") / default_name(texts, [text for text, _ in selected])
    folder = (default if output is None else Path(output)).expanduser().absolute()
    experiment = Experiment(
        name=folder.name,
        trackers=texts,
        sequences=tuple(SequenceSource(name) for _, name in selected),
        repetitions=repetitions,
        protocol=protocol,
    )
    stored = run_experiment(experiment, folder.parent, jobs)
    results = load_experiment(stored, metrics, protocol)
    _warn_of_failures(results)
    return results


def _check(protocol: str, metrics: str, **numbers: int) -> str:
    """Return the stored name of a protocol; raise an error for invalid arguments."""
    if in_child():
        raise TrackerError(
            "a file that trackmark imports as a tracker starts runs itself. Put them below "
            "if __name__ == '__main__':"
        )
    for name, value in numbers.items():
        least = 0 if name == "seed" else 1
        if not isinstance(value, Integral) or value < least:
            raise ValueError(f"{name} is {value!r}. Expected: an integer of {least} or more.")
    stored = parse_protocol(protocol).text
    if not can_score(preset := preset_for(metrics, stored), stored):
        raise ValueError(f"{preset} cannot score runs by the protocol {protocol}.")
    return stored


def _listed(sequences: Any) -> list[Any]:
    return list(sequences) if isinstance(sequences, list | tuple) else [sequences]


def _sequence_texts(sequences: Any) -> Iterator[tuple[str, str]]:
    """Yield each text or path of an argument with each sequence that it selects."""
    for entry in _listed(sequences):
        if not isinstance(entry, str | Path):
            raise TypeError(
                f"{entry!r} is not a name or path of a sequence. trackmark.evaluate also takes a "
                "Sequence."
            )
        text = str(entry.expanduser().absolute()) if isinstance(entry, Path) else entry
        for name in datasets.matching(text):
            yield text, name


def _open_sequences(sequences: Any) -> list[tuple[Sequence, str]]:
    """Return the sequences of an argument with their absolute texts, empty for Sequence objects.

    Raises `SequenceError` for two different sequences of one name.
    """
    opened: dict[str, tuple[Sequence, str]] = {}
    for entry in _listed(sequences):
        if isinstance(entry, Sequence):
            pairs = [(entry, "")]
        else:
            pairs = [
                (load_sequence(text), SequenceSource(text).absolute().text)
                for _, text in _sequence_texts(entry)
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


def _run_trackers(
    specs: list[TrackerSpec],
    repetitions: int,
    sequence: Sequence,
    stored: str,
    raise_errors: bool,
) -> list[Run]:
    """Return the runs on a sequence, in the order of the trackers and repetitions."""
    with _one_thread:
        passes = [
            run_protocol(entries, sequence, stored, raise_errors=raise_errors)
            for entries in _passes(specs, repetitions, stored)
        ]
    runs = [run for each in passes for run in each.runs]
    labels = [spec.label for spec in specs]
    return sorted(
        runs, key=lambda run: (labels.index(run.identity.tracker), run.identity.repetition)
    )


def _passes(
    specs: list[TrackerSpec], repetitions: int, stored: str
) -> Iterator[list[tuple[TrackerSpec, int]]]:
    """Yield the runs of each pass over a sequence.

    Trackers share the images of a pass. Trackers that use the random numbers of the process,
    trackers whose time counts, and each process of a tracker have their own passes.
    """
    time_dependent = stored_protocol(stored).time_dependent
    shared = []
    for spec in specs:
        once = spec.randomness is Randomness.NONE
        entries = [(spec, repetition) for repetition in range(1 if once else repetitions)]
        if spec.randomness is Randomness.PROCESS or time_dependent or spec.call_seconds:
            yield from ([entry] for entry in entries)
        else:
            shared += entries
    if shared:
        yield shared


def _warn_of_failures(results: Results) -> None:
    """Issue a warning with the first failed run."""
    failed = [run for run in results.runs.values() if run.failure]
    if not failed:
        return
    key, text = failed[0].identity, failed[0].failure
    place, reason = tracker_line(text), text.splitlines()[0].rstrip(".")
    warnings.warn(
        f"{len(failed)} of {len(results.runs)} runs failed. First: {key.tracker} on "
        f"{key.sequence}, {reason}{f' ({place})' if place else ''}. "
        "results.failures lists all; evaluate(..., raise_errors=True) raises the exception.",
        RuntimeWarning,
        stacklevel=3,
    )
