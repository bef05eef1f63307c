"""Functions that run trackers on sequences: in memory, or stored in a folder."""

import warnings
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from trackmark import datasets
from trackmark.bench.api.results import Results, load_results
from trackmark.bench.api.tracker_arguments import resolve_trackers, tracker_texts
from trackmark.bench.comparing.run_summary import tracker_line
from trackmark.bench.evaluation.loop import run_protocol
from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.evaluation.sequence_cache import evaluated_sequences, load_sequence
from trackmark.bench.execution.executor import run_experiment
from trackmark.bench.experiments.experiment import Experiment, SequenceSource, default_name
from trackmark.bench.experiments.tracker_spec import TrackerSpec
from trackmark.bench.metrics import canonical_name
from trackmark.bench.protocols import ONE_PASS, parse_protocol, stored_protocol
from trackmark.datasets import Sequence, SequenceError
from trackmark.trackers import Randomness


def evaluate(
    trackers: Any,
    sequences: Any,
    *,
    repetitions: int = 1,
    protocol: str = ONE_PASS,
    metrics: str = "native",
    jobs: int = 1,
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
    jobs : int
        Number of processes; only 1 is possible. `trackmark.run` uses several processes.
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
        For an object that is not a tracker or a sequence.
    TrackerError, SequenceError, ProtocolError, ValueError
        For invalid or unknown names or values, and for a sequence without ground truth.
    """
    if jobs != 1:
        raise ValueError(
            f"jobs is {jobs}. Expected: 1, as evaluate uses this process only. Use trackmark.run "
            "for several processes; it stores the runs in a folder."
        )
    if repetitions < 1:
        raise ValueError(f"repetitions is {repetitions}. Expected: 1 or more.")
    canonical_name(metrics)
    stored = parse_protocol(protocol).text
    specs = resolve_trackers(trackers, repetitions, seed)
    opened = _open_sequences(sequences)
    for sequence, _ in opened:
        sequence.check_runnable()
    runs: dict[tuple[str, str, int], Run] = {}
    for sequence, source in opened:
        origin = {"source": source} if source else {}
        for entries in _passes(specs, repetitions, stored):
            passed = run_protocol(entries, sequence, stored, raise_errors=raise_errors)
            for run_of_pass in passed.runs:
                identity = run_of_pass.identity
                circumstances = {**run_of_pass.circumstances, **origin}
                key = identity.tracker, sequence.name, identity.repetition
                runs[key] = replace(run_of_pass, circumstances=circumstances)
        evaluated_sequences[sequence.fingerprint] = sequence
    reason = "has no source file that determines its boxes"
    in_memory = {spec.label: reason for spec in specs if spec.file is None}
    if seed is not None:
        in_memory = {spec.label: f"was evaluated with seed={seed}" for spec in specs}
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
    canonical_name(metrics)
    texts, names = tracker_texts(trackers), [name for name, _ in _sequence_texts(sequences)]
    folder = Path("results") / default_name(texts, names) if output is None else Path(output)
    folder = folder.expanduser()
    experiment = Experiment(
        name=folder.name,
        trackers=texts,
        sequences=tuple(SequenceSource(text) for _, text in _sequence_texts(sequences)),
        repetitions=repetitions,
        protocol=protocol,
    )
    stored = run_experiment(experiment, folder.parent, jobs)
    results = load_results(stored, metrics=metrics, protocol=protocol)
    _warn_of_failures(results)
    return results


def _listed(sequences: Any) -> list[Any]:
    return list(sequences) if isinstance(sequences, list | tuple) else [sequences]


def _sequence_texts(sequences: Any) -> Iterator[tuple[str, str]]:
    """Yield each text or path of an argument with each sequence that it selects."""
    for entry in _listed(sequences):
        if not isinstance(entry, str | Path):
            raise TypeError(
                f"{entry!r}: worker processes open sequences by name. Give a name or path, or use "
                "trackmark.evaluate."
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
        elif isinstance(entry, str | Path):
            pairs = [
                (load_sequence(text), SequenceSource(text).absolute().text)
                for _, text in _sequence_texts(entry)
            ]
        else:
            raise TypeError(f"{entry!r} is not a sequence. Expected: a name, a path or a Sequence.")
        for sequence, source in pairs:
            other, _ = opened.setdefault(sequence.name, (sequence, source))
            if other.fingerprint != sequence.fingerprint:
                raise SequenceError(
                    f"two different sequences are called {sequence.name!r}. Evaluate them in two "
                    "calls."
                )
    if not opened:
        raise SequenceError("no sequence is given. Give at least one.")
    return list(opened.values())


def _passes(
    specs: list[TrackerSpec], repetitions: int, stored: str
) -> Iterator[list[tuple[TrackerSpec, int]]]:
    """Yield the runs of each pass over a sequence.

    Trackers share the images of a pass. Trackers that use the random numbers of the process, and
    trackers whose time counts, have their own passes.
    """
    shared = []
    for spec in specs:
        once = spec.randomness is Randomness.NONE
        entries = [(spec, repetition) for repetition in range(1 if once else repetitions)]
        if spec.randomness is Randomness.PROCESS or stored_protocol(stored).time_dependent:
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
    place = tracker_line(text)
    warnings.warn(
        f"{len(failed)} of {len(results.runs)} runs failed. First: {key.tracker} on "
        f"{key.sequence}, {text.splitlines()[0]}{f' ({place})' if place else ''}. "
        "results.failures lists all; evaluate(..., raise_errors=True) raises the exception.",
        RuntimeWarning,
        stacklevel=3,
    )
