"""Plan of an experiment: its runs, their statuses, and the tasks of the missing runs."""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import cached_property
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.evaluation.ground_truth import segment_frames, select_ground_truth
from trackmark.bench.execution.task import PlannedRun, Task
from trackmark.bench.experiments.experiment import Experiment, ExperimentError, SequenceSpec
from trackmark.bench.experiments.tracker_spec import (
    BOXES,
    TrackerSpec,
    UnusableTrackersError,
    resolve_specs,
    run_identity,
)
from trackmark.bench.metrics.times import MAX_RUN_DELAY
from trackmark.bench.protocols import ONE_PASS, TIMING
from trackmark.bench.store.database import RunKey, run_key
from trackmark.bench.store.run_rows import SequenceOrigin, find_other_origin, origins_by_name
from trackmark.bench.store.run_store import MAX_RUNS, RunStore
from trackmark.bench.store.runs import list_runs
from trackmark.datasets import Sequence, SequenceError
from trackmark.datasets.interface import UnusableSequencesError
from trackmark.trackers import Randomness

MIN_SEQUENCES_FOR_WORKERS = 12
"""Minimum number of sequences for which worker processes are started to open them."""


class RunStatus(IntEnum):
    """Status of a requested run."""

    MISSING = 0
    """No run is stored."""

    STALE = 1
    """The stored run has another version: it will be executed again."""

    DISTURBED = 2
    """The stored timing run was disturbed by other load: it will be measured again."""

    FAILED = 3
    """The run is stored, and its tracker failed."""

    FINISHED = 4
    """The run is stored and finished."""


@dataclass(frozen=True)
class PlannedSequence:
    """Properties of a sequence that was opened and validated."""

    source: SequenceSpec
    name: str  # this and the next as in `datasets.Sequence`
    fingerprint: str
    n_frames: int  # number of frames of a run, in all segments
    remarks: tuple[str, ...]  # see `datasets.Sequence`
    starts: frozenset[str]  # regions that can initialise a tracker; see `ground_truth`


OpenedSequences = dict[tuple[SequenceSpec, str], PlannedSequence]
"""Sequences that were already opened, by source and protocol."""


@dataclass(frozen=True, eq=False)
class Plan:
    """All runs of an experiment and their statuses.

    On each sequence, the runs are the repetitions of the first tracker, then those of the second, …
    """

    experiment: Experiment
    trackers: dict[str, TrackerSpec]  # by specification; no tracker occurs twice
    repetitions: NDArray[np.int64]  # number of runs on a sequence, shape (trackers,)
    sequences: list[PlannedSequence]
    versions: list[list[str]]  # `Identity.version` by sequence and tracker
    stored_versions: Mapping[RunKey, tuple[str, RunStatus]]

    def __len__(self) -> int:
        return len(self.sequences) * len(self.run_trackers)

    @cached_property
    def run_trackers(self) -> NDArray[np.int64]:
        """Index of the tracker of each run on a sequence."""
        return np.repeat(np.arange(len(self.repetitions)), self.repetitions)

    @cached_property
    def run_repetitions(self) -> NDArray[np.int64]:
        """Repetition of each run on a sequence."""
        first = np.cumsum(self.repetitions) - self.repetitions
        return np.arange(len(self.run_trackers)) - first[self.run_trackers]

    @cached_property
    def requested(self) -> dict[RunKey, str]:
        """Requested version of each run, ordered by sequence."""
        protocol = self.experiment.protocol_key
        labels = [spec.label for spec in self.trackers.values()]
        pairs = list(zip(self.run_trackers.tolist(), self.run_repetitions.tolist(), strict=True))
        return {
            (labels[tracker], sequence.name, repetition, protocol): versions[tracker]
            for sequence, versions in zip(self.sequences, self.versions, strict=True)
            for tracker, repetition in pairs
        }

    @cached_property
    def statuses(self) -> NDArray[np.uint8]:
        """Statuses of the runs (`RunStatus`), shape (sequences, runs on a sequence)."""
        statuses = [self.status(key) for key in self.requested]
        return np.array(statuses, np.uint8).reshape(len(self.sequences), len(self.run_trackers))

    def status(self, key: RunKey) -> RunStatus:
        """Return the status of a requested run."""
        version, status = self.stored_versions.get(key, ("", RunStatus.MISSING))
        return status if version in ("", self.requested[key]) else RunStatus.STALE

    @property
    def n_frames(self) -> NDArray[np.int64]:
        """Number of frames of a run, by sequence."""
        return np.array([sequence.n_frames for sequence in self.sequences], np.int64)

    def count(self, status: RunStatus) -> int:
        """Return the number of runs in a status."""
        return int((self.statuses == status).sum())

    def counts(self) -> NDArray[np.int64]:
        """Return the numbers of runs, shape (trackers, statuses)."""
        counts = np.zeros((len(self.repetitions), len(RunStatus)), np.int64)
        trackers = np.tile(self.run_trackers, len(self.sequences))
        np.add.at(counts, (trackers, self.statuses.ravel()), 1)
        return counts

    def with_stored(self, rows: Iterable[Mapping[str, Any]]) -> "Plan":
        """Return the plan with statuses determined from the stored runs (`rows` of `list_runs`).

        A tracker that drew from global generators in a stored run is stochastic from then on.
        Raises `ExperimentError` for too many runs.
        """
        rows = list(rows)
        drew = {(row["tracker"], row["tracker_version"]) for row in rows if row["generators"]}
        trackers = dict(self.trackers)
        for listed, spec in trackers.items():
            if spec.randomness is Randomness.NONE and (spec.label, spec.digest) in drew:
                trackers[listed] = replace(spec, randomness=Randomness.PROCESS)
        stored_versions = {}
        for row in rows:
            status = RunStatus.FAILED if row["status"] == "failed" else RunStatus.FINISHED
            is_timing_run = status == RunStatus.FINISHED and row["protocol"] == TIMING
            if is_timing_run and (row["run_delay_share"] or 0.0) > MAX_RUN_DELAY:
                status = RunStatus.DISTURBED
            stored_versions[run_key(row)] = row["version"], status
        return replace(
            self,
            trackers=trackers,
            repetitions=_repetitions(self.experiment, trackers, len(self.sequences)),
            stored_versions=stored_versions,
        )


def make_plan(
    experiment: Experiment,
    store: RunStore,
    opened_sequences: OpenedSequences | None = None,
    progress: Callable[[int, int], None] = lambda *_: None,
    jobs: int = 1,
) -> Plan:
    """Resolve trackers and sequences, and read the statuses of the runs.

    `opened_sequences` contains sequences that were opened for another plan; the sequences of this
    plan are added. `progress` is called with the numbers of opened and of all sequences. `jobs` is
    the number of processes that open sequences, if there are many.

    Raises `TrackerError`, `SequenceError`, `ExperimentError` or `ResultsError` for every error that
    can be detected before the first run.
    """
    try:
        trackers = _distinct_trackers(experiment)
    except UnusableTrackersError as error:
        _raise_with_sequences(error, experiment.sequences)
    sequences: list[PlannedSequence] = []
    versions: list[list[str]] = []
    protocol = experiment.protocol_key
    opened_sequences = {} if opened_sequences is None else opened_sequences
    # Timing runs have the frames of one-pass runs.
    frame_protocol = ONE_PASS if experiment.is_timing else protocol
    keys = dict.fromkeys((source, frame_protocol) for source in experiment.sequences)
    unopened = [key for key in keys if key not in opened_sequences]
    _open_all(unopened, opened_sequences, progress, jobs)
    for sequence in _distinct_sequences([opened_sequences[key] for key in keys]):
        for spec in trackers.values():
            if spec.init not in sequence.starts:  # raises the error that explains why
                select_ground_truth(_open(sequence.source), spec.init, sequence.name)
        sequences.append(sequence)
        versions.append(
            [run_identity(spec, sequence, 0, protocol).version for spec in trackers.values()]
        )
    rows = list_runs(store.folder)
    counts = _repetitions(experiment, trackers, len(sequences))
    plan = Plan(experiment, trackers, counts, sequences, versions, {}).with_stored(rows)
    _check_names(plan, rows, store.folder)
    return plan


def _repetitions(
    experiment: Experiment, trackers: Mapping[str, TrackerSpec], n_sequences: int
) -> NDArray[np.int64]:
    """Return the number of runs of each tracker on a sequence.

    Raises `ExperimentError` if there are too many runs in total.
    """
    repetitions = [
        1
        if spec.randomness is Randomness.NONE and not experiment.is_timing
        else experiment.repetitions_by_tracker.get(spec_text, experiment.repetitions)
        for spec_text, spec in trackers.items()
    ]
    n_runs = n_sequences * sum(repetitions)
    if n_runs > MAX_RUNS:
        raise ExperimentError(
            f"{n_runs} runs are requested; an experiment has at most {MAX_RUNS}. "
            "Request fewer repetitions, or divide the sequences among several experiments."
        )
    return np.array(repetitions, np.int64)


def _distinct_trackers(experiment: Experiment) -> dict[str, TrackerSpec]:
    """Return trackers by specification; of several specifications of a tracker, keep the first."""
    by_label: dict[str, tuple[str, TrackerSpec]] = {}
    for listed, spec in resolve_specs(experiment.trackers).items():
        other_listed, other = by_label.setdefault(spec.label, (listed, spec))
        if (other.file, other.version) != (spec.file, spec.version):
            raise ExperimentError(
                f"two different trackers are called {spec.label!r}: {other_listed} and {listed}. "
                "Give one of them another name with as=NAME."
            )
    return dict(by_label.values())


def _open_all(
    keys: list[tuple[SequenceSpec, str]],
    opened_sequences: OpenedSequences,
    progress: Callable[[int, int], None],
    jobs: int,
) -> None:
    """Open sequences and add them to `opened_sequences`.

    Raises one `SequenceError` that names all sequences that cannot be used.
    """
    planned: Iterable[PlannedSequence | str] = map(_try_open, keys)
    if jobs > 1 and len(keys) >= MIN_SEQUENCES_FOR_WORKERS:
        from trackmark.bench.execution.pool import map_in_workers

        planned = map_in_workers(_try_open, keys, jobs)
    errors: dict[str, str] = {}
    for index, (key, result) in enumerate(zip(keys, planned, strict=True)):
        progress(index, len(keys))
        if isinstance(result, str):
            errors[key[0].spec] = result
        else:
            opened_sequences[key] = result
    if errors:
        raise UnusableSequencesError(errors, len(keys))


def _raise_with_sequences(
    error: UnusableTrackersError, sources: Collection[SequenceSpec]
) -> NoReturn:
    """Raise the error on trackers, with the sequences that cannot be used in its message."""
    errors: dict[str, str] = {}
    for source in sources:
        try:
            _open(source)
        except SequenceError as unusable:
            errors[source.spec] = str(unusable)
    if errors:
        sequences_error = UnusableSequencesError(errors, len(sources))
        raise UnusableTrackersError(error.errors, error.usable, sequences_error) from None
    raise error


def _try_open(key: tuple[SequenceSpec, str]) -> PlannedSequence | str:
    """Return the sequence of a source and protocol, or the message if it cannot be used."""
    source, protocol = key
    try:
        sequence = _open(source)
        n_frames = sum(map(len, segment_frames(protocol, sequence, BOXES))) or len(sequence)
    except SequenceError as error:
        return str(error)
    starts = {BOXES}
    for region in sequence.regions:
        with suppress(SequenceError):
            select_ground_truth(sequence, region)
            starts.add(region)
    return PlannedSequence(
        source,
        sequence.name,
        sequence.fingerprint,
        n_frames,
        tuple(sequence.remarks),
        frozenset(starts),
    )


def _distinct_sequences(sequences: Iterable[PlannedSequence]) -> list[PlannedSequence]:
    """Return the sequences by name; raise `ExperimentError` if two have the same name."""
    by_name: dict[str, PlannedSequence] = {}
    for sequence in sequences:
        other = by_name.setdefault(sequence.name, sequence)
        if other.fingerprint != sequence.fingerprint:
            raise ExperimentError(
                f"two different sequences are called {sequence.name!r}: {other.source.spec} and "
                f"{sequence.source.spec}. Rename a folder or a file."
            )
    return list(by_name.values())


def _check_names(plan: Plan, rows: list[dict[str, Any]], folder: Path) -> None:
    """Raise `ExperimentError` if stored runs used another sequence of the same name."""
    stored_origins = origins_by_name(rows)
    for sequence in plan.sequences:
        if sequence.name not in stored_origins:
            continue
        origin = sequence.source.absolute()
        planned = SequenceOrigin(sequence.fingerprint, origin.spec, str(origin.truth or ""))
        if other := find_other_origin(planned, stored_origins[sequence.name]):
            raise ExperimentError(
                f"{folder} contains runs on another sequence that is also called "
                f"{sequence.name!r}: {other}. Store runs on {planned} in another folder, with "
                "--name or --results-root."
            )


def _open(source: SequenceSpec) -> Sequence:
    sequence = datasets.load(source.spec, truth=source.truth)
    sequence.check_runnable()
    return sequence


MAX_TRACKER_PROCESSES = 4
"""Maximum number of runs of a task whose trackers have processes of their own.

The processes of a task exist at the same time, and each can hold a model in memory.
"""


@dataclass(frozen=True, eq=False)
class Tasks:
    """Tasks of a plan, created one after another.

    The longest sequences come first, so that no worker finishes much later than the others. A task
    has at most one worker's share of the total work, unless it has a single run. The last
    sequences, which are fewer than the workers, are split among all workers. If results depend on
    time, each run has its own task, and trackers take turns: slow changes of the machine then
    affect all of them.
    """

    plan: Plan
    requested: NDArray[np.bool_]  # runs to execute, shape (sequences, runs on a sequence)
    n_workers: int  # number of tasks that are executed at the same time

    @property
    def n_runs(self) -> int:
        """Number of runs."""
        return int(self.requested.sum())

    @property
    def work(self) -> int:
        """Total work: frames times trackers."""
        return int(self._work_by_sequence.sum())

    def __len__(self) -> int:
        return int(self._n_parts.sum())

    def __iter__(self) -> Iterator[Task]:
        longest_first = np.argsort(-self._work_by_sequence, kind="stable")
        for sequence in longest_first[: np.count_nonzero(self._work_by_sequence)].tolist():
            runs = np.flatnonzero(self.requested[sequence])
            if self.plan.experiment.time_dependent:
                runs = runs[np.argsort(self.plan.run_repetitions[runs], kind="stable")]
            n_parts = int(self._n_parts[sequence])
            for offset in range(n_parts):
                # Neighbouring runs are of the same tracker, and are equally likely to be slow.
                yield self._task(sequence, runs[offset::n_parts].tolist())

    @cached_property
    def _work_by_sequence(self) -> NDArray[np.int64]:
        return np.asarray(self.plan.n_frames * self.requested.sum(axis=1), np.int64)

    @cached_property
    def _n_parts(self) -> NDArray[np.int64]:
        """Number of tasks of each sequence."""
        n_runs: NDArray[np.int64] = self.requested.sum(axis=1)
        if self.plan.experiment.time_dependent:
            return n_runs
        max_runs = np.maximum(self.work // (self.n_workers * self.plan.n_frames), 1)
        n_parts: NDArray[np.int64] = -(-n_runs // max_runs)
        # The last sequences are split among all workers, so that no worker waits.
        busy = np.argsort(-self._work_by_sequence, kind="stable")[: np.count_nonzero(n_runs)]
        last = busy[len(busy) - len(busy) % self.n_workers :]
        n_parts[last] = np.maximum(n_parts[last], self.n_workers)
        isolated = np.array([spec.is_isolated for spec in self.plan.trackers.values()])
        n_isolated = (self.requested & isolated[self.plan.run_trackers]).sum(axis=1)
        n_parts = np.maximum(n_parts, -(-n_isolated // MAX_TRACKER_PROCESSES))
        return np.asarray(np.minimum(n_parts, n_runs), np.int64)

    def _task(self, sequence: int, runs: list[int]) -> Task:
        plan, planned = self.plan, self.plan.sequences[sequence]
        specs, protocol = list(plan.trackers), plan.experiment.protocol_key
        planned_runs = []
        for run in runs:
            spec = specs[plan.run_trackers[run]]
            repetition = int(plan.run_repetitions[run])
            identity = run_identity(plan.trackers[spec], planned, repetition, protocol)
            key = identity.tracker, planned.name, repetition, protocol
            version, _ = plan.stored_versions.get(key, ("", RunStatus.MISSING))
            planned_runs.append(PlannedRun(spec, identity, version))
        arrays = plan.experiment.keeps_arrays
        return Task(planned.source, tuple(planned_runs), planned.n_frames, keep_arrays=arrays)


def missing_tasks(plan: Plan, *, n_workers: int = 1, retry_failed: bool = False) -> Tasks:
    """Return the tasks of the missing runs of a plan.

    `n_workers` is the number of tasks that run at the same time. `retry_failed` is whether failed
    runs count as missing.
    """
    highest = RunStatus.FAILED if retry_failed else RunStatus.DISTURBED
    return Tasks(plan, plan.statuses <= highest, n_workers)
