"""Plan of an experiment: its runs and their states. `scheduling.py` groups them into work units.

A plan can have a million runs. The state of a run is one byte in an array of sequences by runs, and
work units are created on demand.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import cached_property, partial
from pathlib import Path
from time import perf_counter

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.evaluation.ground_truth import reference
from trackmark.bench.evaluation.recorder import frames_of_segments
from trackmark.bench.experiments.experiment import Experiment, ExperimentError, SequenceSource
from trackmark.bench.experiments.tracker_files import settled
from trackmark.bench.experiments.tracker_spec import BOXES, Contestant, identify
from trackmark.bench.protocols import STORED_ONCE
from trackmark.bench.store.asked import Asked, Cells
from trackmark.bench.store.columns import coded, codes
from trackmark.bench.store.index import read_table
from trackmark.bench.store.recordings import Recording, different, recordings
from trackmark.bench.store.results import Results
from trackmark.datasets import Sequence, SequenceError
from trackmark.trackers import Randomness

MAX_RUNS = 1_000_000
"""Maximum number of runs of an experiment."""

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
    protocol: str = STORED_ONCE  # by which `frames` are those of a run, in all its segments


KnownSequences = dict[SequenceSource, PlannedSequence]
"""Sequences that were opened before, and need not be again."""


@dataclass(frozen=True, eq=False)
class Plan:
    """All runs of an experiment and their states.

    On every sequence the same runs are asked for: those of the first tracker by repetition, then
    those of the second, …
    """

    experiment: Experiment
    trackers: dict[str, Contestant]  # the trackers, by their texts; no two of the same
    repetitions: NDArray[np.int64]  # how often each is run on a sequence, shape (trackers,)
    sequences: list[PlannedSequence]
    versions: NDArray[np.bytes_]  # `Identity.version` of the runs, shape (sequences, trackers)
    states: NDArray[np.uint8]  # by `State`, shape (sequences, runs on a sequence)
    # Number of the version that lies in a run's place; -1 where nothing does, shape (sequences,
    # runs on a sequence).
    replaced: NDArray[np.int32]
    replaced_versions: pa.StringArray

    def __len__(self) -> int:
        return self.states.size

    @cached_property
    def protocol(self) -> str:
        """How trackers are run, as runs are filed under it."""
        return self.experiment.filed_under

    @cached_property
    def run_trackers(self) -> NDArray[np.int64]:
        """Number of the tracker, by run on a sequence."""
        return np.repeat(np.arange(len(self.repetitions)), self.repetitions)

    @cached_property
    def run_repetitions(self) -> NDArray[np.int64]:
        """Repetition, by run on a sequence."""
        first = np.cumsum(self.repetitions) - self.repetitions
        return np.arange(len(self.run_trackers)) - first[self.run_trackers]

    @property
    def frames(self) -> NDArray[np.int64]:
        """Frames of a run, by sequence."""
        return np.array([sequence.frames for sequence in self.sequences], np.int64)

    def count(self, state: State) -> int:
        """Number of runs in a state."""
        return int((self.states == state).sum())

    def counts(self) -> NDArray[np.int64]:
        """Numbers of runs, shape (trackers, states)."""
        found = [np.bincount(column, minlength=len(State)) for column in self.states.T]
        counts = np.zeros((len(self.repetitions), len(State)), np.int64)
        np.add.at(counts, self.run_trackers, np.array(found))
        return counts

    def asked(self) -> Asked:
        """What is noted down with the results."""
        n_sequences, n_trackers = self.versions.shape
        n_runs = len(self.run_trackers)
        tracker = np.tile(self.run_trackers, n_sequences)
        sequence = np.repeat(np.arange(n_sequences), n_runs)
        versions = pa.array(self.versions.ravel(), pa.binary()).cast(pa.string())
        cells = {
            "tracker": coded([chosen.label for chosen in self.trackers.values()], tracker),
            "sequence": coded([found.name for found in self.sequences], sequence),
            "protocol": coded([self.protocol], np.zeros(len(tracker))),
            "version": coded(versions, sequence * n_trackers + tracker),
            "repetition": np.tile(self.run_repetitions, n_sequences).astype(np.int32),
        }
        title = self.experiment.title or self.experiment.name
        return Asked(title, Cells(pa.table(cells)))

    def runs(self, index: pa.Table) -> NDArray[np.int64]:
        """Which run each row of an index is of, counted through `states`; -1 for none of these."""
        labels = {chosen.label: i for i, chosen in enumerate(self.trackers.values())}
        names = {found.name: i for i, found in enumerate(self.sequences)}
        tracker = _numbers(index["tracker"], labels)
        sequence = _numbers(index["sequence"], names)
        protocol = _numbers(index["protocol"], {self.protocol: 0})
        repetition = index["repetition"].to_numpy()
        asked = (tracker >= 0) & (sequence >= 0) & (protocol >= 0)
        asked &= repetition < self.repetitions[tracker]
        first = np.cumsum(self.repetitions) - self.repetitions
        number = sequence * len(self.run_trackers) + first[tracker] + repetition
        return np.where(asked, number, -1)

    def seen_in(self, index: pa.Table) -> "Plan":
        """The plan with the states of the runs in an index."""
        number = self.runs(index)
        rows = np.flatnonzero(number >= 0)
        number = number[rows]
        versions, (version,) = codes(index["version"])
        version = version[rows]
        replaced = np.full(self.states.size, -1, np.int32)
        replaced[number] = version
        present = np.array(versions.cast(pa.binary()).to_pylist(), self.versions.dtype)
        n_runs = len(self.run_trackers)
        planned = self.versions[number // n_runs, self.run_trackers[number % n_runs]]
        statuses, (status,) = codes(index["status"])
        failed = np.array([name == "failed" for name in statuses.to_pylist()], bool)
        states = np.full(self.states.size, State.LEFT, np.uint8)
        states[number] = np.where(
            present[version] != planned,
            State.STALE,
            np.where(failed[status[rows]], State.FAILED, State.DONE),
        )
        shape = self.states.shape
        return replace(
            self,
            states=states.reshape(shape),
            replaced=replaced.reshape(shape),
            replaced_versions=versions,
        )


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
    versions: list[list[bytes]] = []
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
            [identify(entry, found, 0, protocol).version.encode() for entry in trackers.values()]
        )
    shape = len(sequences), sum(repetitions)
    if math.prod(shape) > MAX_RUNS:
        raise ExperimentError(
            f"{math.prod(shape)} runs are requested; an experiment has at most {MAX_RUNS}. "
            "Request fewer seeds, or split the sequences between several experiments."
        )
    plan = Plan(
        experiment,
        trackers,
        np.array(repetitions, np.int64),
        sequences,
        np.array(versions),
        np.zeros(shape, np.uint8),
        np.zeros(shape, np.int32),
        pa.array([], pa.string()),
    )
    index = read_table(results)
    _check_names(plan, index, results.folder)
    return plan.seen_in(index)


def _numbers(column: pa.ChunkedArray, known: dict[str, int]) -> NDArray[np.int64]:
    """Numbers of names that are known, by row; -1 for the others."""
    names, (found,) = codes(column)
    numbers = np.array([known.get(name, -1) for name in names.to_pylist()], np.int64)
    return numbers[found]


def _distinct_trackers(experiment: Experiment) -> dict[str, Contestant]:
    """Trackers by text: what is the same but for its spelling runs once."""
    found: dict[str, tuple[str, Contestant]] = {}
    for text, entry in settled(experiment.trackers).items():
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
    return STORED_ONCE if experiment.timing else experiment.filed_under


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


def _check_names(plan: Plan, index: pa.Table, folder: Path) -> None:
    """Refuse sequences called like others whose runs lie there: those runs would be replaced."""
    known = recordings(index)
    for sequence in plan.sequences:
        if sequence.name not in known:
            continue
        origin = sequence.source.absolute()
        here = Recording(sequence.fingerprint, origin.text, str(origin.truth or ""))
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
        frames=sum(map(len, frames_of_segments(protocol, sequence, BOXES))) or len(sequence),
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
