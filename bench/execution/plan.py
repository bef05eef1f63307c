"""Plan of an experiment: its runs and their states. `scheduling.py` groups them into work units."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import cached_property, partial
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.evaluation.ground_truth import reference
from trackmark.bench.evaluation.recorder import segment_frames
from trackmark.bench.experiments.experiment import Experiment, ExperimentError, SequenceSource
from trackmark.bench.experiments.tracker_files import resolve_trackers
from trackmark.bench.experiments.tracker_spec import BOXES, TrackerSpec, run_identity
from trackmark.bench.protocols import STORED_ONE_PASS
from trackmark.bench.store.layout import RunKey, run_key
from trackmark.bench.store.maintenance import RecordedData, different, recorded_data
from trackmark.bench.store.manifest import Manifest
from trackmark.bench.store.results import MAX_RUNS, Results
from trackmark.bench.store.run_rows import list_runs
from trackmark.datasets import Sequence, SequenceError
from trackmark.trackers import Randomness

WORTH_WORKERS = 12
"""Sequences from which on worker processes, which take seconds to start, open them sooner."""


class State(IntEnum):
    """What is known of a run that was asked for."""

    LEFT = 0
    """Nothing is there."""

    STALE = 1
    """A run lies in its place that something else determined: it will be run again."""

    FAILED = 2
    """It is there, and the tracker failed."""

    DONE = 3
    """It is there, finished."""


@dataclass(frozen=True)
class PlannedSequence:
    """What must be known of a sequence once it has been opened and checked."""

    source: SequenceSource
    name: str  # as `datasets.Sequence` has them
    fingerprint: str
    frames: int  # of a run: of all its segments, where the protocol has some
    images_beyond_truth: int  # images that nobody reads
    starts: frozenset[str]  # truths that a run can start from; see `bench.evaluation.reference`
    opening_seconds: float  # how long it took to open it
    protocol: str = STORED_ONE_PASS  # by which `frames` are those of a run, in all its segments


KnownSequences = dict[SequenceSource, PlannedSequence]
"""Sequences that were opened before, and need not be again."""


@dataclass(frozen=True, eq=False)
class Plan:
    """All runs of an experiment and their states.

    The runs on each sequence are the repetitions of the first tracker, then of the second, …
    """

    experiment: Experiment
    trackers: dict[str, TrackerSpec]  # by their texts; all are different
    repetitions: NDArray[np.int64]  # number of runs on a sequence, shape (trackers,)
    sequences: list[PlannedSequence]
    versions: list[list[str]]  # `Identity.version` by sequence and tracker
    stored: Mapping[RunKey, tuple[str, str]]  # version and status of the stored runs

    def __len__(self) -> int:
        return len(self.sequences) * len(self.run_trackers)

    @cached_property
    def protocol(self) -> str:
        """Protocol under which runs are stored."""
        return self.experiment.filed_under

    @cached_property
    def run_trackers(self) -> NDArray[np.int64]:
        """Number of the tracker of each run on a sequence."""
        return np.repeat(np.arange(len(self.repetitions)), self.repetitions)

    @cached_property
    def run_repetitions(self) -> NDArray[np.int64]:
        """Repetition of each run on a sequence."""
        first = np.cumsum(self.repetitions) - self.repetitions
        return np.arange(len(self.run_trackers)) - first[self.run_trackers]

    @cached_property
    def requested(self) -> dict[RunKey, str]:
        """Requested versions by run; sequence by sequence."""
        labels = [chosen.label for chosen in self.trackers.values()]
        numbers = list(zip(self.run_trackers.tolist(), self.run_repetitions.tolist(), strict=True))
        return {
            (labels[tracker], sequence.name, repetition, self.protocol): versions[tracker]
            for sequence, versions in zip(self.sequences, self.versions, strict=True)
            for tracker, repetition in numbers
        }

    @cached_property
    def states(self) -> NDArray[np.uint8]:
        """States of the runs (`State`), shape (sequences, runs on a sequence)."""
        states = [self.state(cell) for cell in self.requested]
        return np.array(states, np.uint8).reshape(len(self.sequences), len(self.run_trackers))

    def state(self, cell: RunKey) -> State:
        """Return the state of a requested run."""
        version, status = self.stored.get(cell, ("", ""))
        if not version:
            return State.LEFT
        if version != self.requested[cell]:
            return State.STALE
        return State.FAILED if status == "failed" else State.DONE

    @property
    def frames(self) -> NDArray[np.int64]:
        """Frames of a run, by sequence."""
        return np.array([sequence.frames for sequence in self.sequences], np.int64)

    def count(self, state: State) -> int:
        """Return the number of runs in a state."""
        return int((self.states == state).sum())

    def counts(self) -> NDArray[np.int64]:
        """Return the numbers of runs, shape (trackers, states)."""
        counts = np.zeros((len(self.repetitions), len(State)), np.int64)
        np.add.at(counts, (np.tile(self.run_trackers, len(self.sequences)), self.states.ravel()), 1)
        return counts

    def manifest(self) -> Manifest:
        """Return the requests that are stored with the results."""
        return Manifest(self.experiment.title or self.experiment.name, self.requested)

    def seen_in(self, rows: Iterable[Mapping[str, Any]]) -> "Plan":
        """Return the plan with the states of stored runs; see `bench.store.run_rows.list_runs`."""
        stored = {run_key(row): (row["version"], row["status"]) for row in rows}
        return replace(self, stored=stored)


def make_plan(
    experiment: Experiment,
    results: Results,
    known: KnownSequences | None = None,
    opened: Callable[[int, int], None] = lambda *_: None,
    jobs: int = 1,
) -> Plan:
    """Settle trackers and sequences, and look up which runs are there.

    `experiment`: what is asked for. `results`: where the runs lie, and go. `known`: sequences that
    were opened for another plan; those of this one are added. `opened`: told how many sequences
    have been opened, and of how many. `jobs`: processes that open them, where there are many.

    Raises `TrackerError`, `SequenceError`, `ExperimentError`, `ResultsError` for anything that can
    be known to fail before the first run.
    """
    trackers = _distinct_trackers(experiment)
    repetitions = [
        1
        if entry.randomness is Randomness.NONE and not experiment.timing
        else experiment.repeated.get(text, experiment.repetitions)
        for text, entry in trackers.items()
    ]
    sequences: list[PlannedSequence] = []
    versions: list[list[str]] = []
    protocol = experiment.filed_under
    known = {} if known is None else known
    _forget_others(known, experiment)
    left = [source for source in dict.fromkeys(experiment.sequences) if source not in known]
    if jobs > 1 and len(left) >= WORTH_WORKERS:
        _open_by_workers(left, known, opened, jobs, _frames_by(experiment))
    for found in _distinct_sequences(experiment, known, opened):
        for entry in trackers.values():
            if entry.init not in found.starts:  # then this says why
                reference(_opened(found.source), entry.init, found.name)
        sequences.append(found)
        versions.append(
            [run_identity(one, found, 0, protocol).version for one in trackers.values()]
        )
    number = len(sequences) * sum(repetitions)
    if number > MAX_RUNS:
        raise ExperimentError(
            f"{number} runs are requested; an experiment has at most {MAX_RUNS}. "
            "Request fewer seeds, or split the sequences between several experiments."
        )
    counts = np.array(repetitions, np.int64)
    rows = list_runs(results)
    plan = Plan(experiment, trackers, counts, sequences, versions, {}).seen_in(rows)
    _check_names(plan, rows, results.folder)
    return plan


def _distinct_trackers(experiment: Experiment) -> dict[str, TrackerSpec]:
    """Trackers by text: what is the same but for its spelling runs once."""
    found: dict[str, tuple[str, TrackerSpec]] = {}
    for text, entry in resolve_trackers(experiment.trackers).items():
        other = found.setdefault(entry.label, (text, entry))[1]
        if (other.file, other.version) != (entry.file, entry.version):
            raise ExperimentError(
                f"two trackers are called {entry.label!r}: {other.file} and {entry.file}. "
                "Call one something else with as=NAME."
            )
    return dict(found.values())


def _distinct_sequences(
    experiment: Experiment, known: KnownSequences, opened: Callable[[int, int], None]
) -> list[PlannedSequence]:
    """Sequences, no name twice, checked to be runnable."""
    found: dict[str, PlannedSequence] = {}
    for number, source in enumerate(experiment.sequences):
        opened(number, len(experiment.sequences))
        if source not in known:
            known[source] = _planned(source, _frames_by(experiment))
        sequence = known[source]
        other = found.setdefault(sequence.name, sequence)
        if other.fingerprint != sequence.fingerprint:
            raise ExperimentError(
                f"two different sequences are called {sequence.name!r}: {other.source.text} and "
                f"{source.text}. Rename a folder or a file."
            )
    return list(found.values())


def _frames_by(experiment: Experiment) -> str:
    """The protocol that says how many frames a run has; timing runs have those of one pass."""
    return STORED_ONE_PASS if experiment.timing else experiment.filed_under


def _forget_others(known: KnownSequences, experiment: Experiment) -> None:
    """Leave out sequences whose runs have other numbers of frames, by other protocols."""
    protocol = _frames_by(experiment)
    for source in experiment.sequences:
        if source in known and known[source].protocol != protocol:
            del known[source]


def _open_by_workers(
    left: list[SequenceSource],
    known: KnownSequences,
    opened: Callable[[int, int], None],
    jobs: int,
    protocol: str,
) -> None:
    from loky import ProcessPoolExecutor

    executor = ProcessPoolExecutor(max_workers=jobs)
    try:
        # `map` would cancel what is left where one raises, for which loky's thread has a traceback.
        futures = [executor.submit(_planned, source, protocol) for source in left]
        for number, future in enumerate(futures):
            sequence = future.result()
            opened(number, len(left))
            known[sequence.source] = sequence
    finally:
        executor.shutdown(wait=True, kill_workers=True)


def _check_names(plan: Plan, rows: list[dict[str, Any]], folder: Path) -> None:
    """Refuse sequences called like others whose runs lie there: those runs would be replaced."""
    known = recorded_data(rows)
    for sequence in plan.sequences:
        if sequence.name not in known:
            continue
        origin = sequence.source.absolute()
        here = RecordedData(sequence.fingerprint, origin.text, str(origin.truth or ""))
        if other := different(here, known[sequence.name]):
            raise ExperimentError(
                f"{folder} holds runs on other data that are called {sequence.name!r}, too: "
                f"{other}. Keep runs on {here} elsewhere, with --name or --output."
            )


def _planned(source: SequenceSource, protocol: str) -> PlannedSequence:
    began = perf_counter()
    sequence = _opened(source)
    fingerprint = sequence.fingerprint
    return PlannedSequence(
        source=source,
        name=sequence.name,
        fingerprint=fingerprint,
        frames=sum(map(len, segment_frames(protocol, sequence, BOXES))) or len(sequence),
        images_beyond_truth=sequence.images_beyond_truth,
        starts=frozenset(filter(partial(_can_start, sequence), [BOXES, *sequence.regions])),
        opening_seconds=perf_counter() - began,
        protocol=protocol,
    )


def _opened(source: SequenceSource) -> Sequence:
    sequence = datasets.load(source.text, truth=source.truth)
    sequence.check_runnable()
    return sequence


def _can_start(sequence: Sequence, region: str) -> bool:
    try:
        reference(sequence, region)
    except SequenceError:
        return False
    return True
