"""Which runs an experiment asks for, which of them are there, and how to share out the rest."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import datasets
from bench.contestant import Contestant, contestant, identify
from bench.experiment import Experiment, ExperimentError, SequenceSource
from bench.record import Identity, Protocol
from bench.reference import reference
from bench.store.asked import Asked
from bench.store.index import read_index
from bench.store.layout import Cell as StoredCell
from bench.store.results import Results
from bench.unit import Entry, Unit
from datasets import Sequence
from trackers import Randomness

__all__ = ["Cell", "Plan", "State", "make_plan"]


class State(StrEnum):
    """What is known of a run that was asked for."""

    DONE = "done"
    """It is there, finished."""

    FAILED = "failed"
    """It is there, and the tracker failed."""

    STALE = "stale"
    """A run lies in its place that something else determined: it will be run again."""

    LEFT = "left"
    """Nothing is there."""


@dataclass(frozen=True)
class Cell:
    """One run that was asked for."""

    tracker: str
    randomness: Randomness
    source: SequenceSource
    frames: int
    identity: Identity
    state: State
    replaces: str = ""


@dataclass(frozen=True)
class Plan:
    """All runs of an experiment and their states.

    Attributes
    ----------
    experiment : Experiment
        What was asked for.
    cells : list of Cell
        One a run.
    sequences : list of Sequence
        The sequences, opened and checked.
    """

    experiment: Experiment
    cells: list[Cell]
    sequences: list[Sequence]

    def count(self, state: State) -> int:
        """Number of runs in a state."""
        return sum(cell.state is state for cell in self.cells)

    def units(self, *, retry_failed: bool = False) -> list[Unit]:
        """What is left to do.

        Trackers whose random numbers live in the process never share one with others;
        they come first, since they are the slow ones.
        """
        states = {State.STALE, State.LEFT} | ({State.FAILED} if retry_failed else set())
        alone: list[Unit] = []
        together: dict[SequenceSource, list[Cell]] = {}
        for cell in self.cells:
            if cell.state not in states:
                continue
            if self.experiment.timing or cell.randomness is Randomness.PROCESS:
                alone.append(_unit([cell]))
            else:
                together.setdefault(cell.source, []).append(cell)
        # The longest first: no core waits at the end for a long one that began late.
        shared = [_unit(cells) for cells in together.values()]
        return alone + sorted(shared, key=lambda unit: -unit.work)

    def asked(self) -> Asked:
        """What is noted down with the results."""
        keys = [cell.identity for cell in self.cells]
        cells: dict[StoredCell, str] = {
            (k.tracker, k.sequence, k.repetition, k.protocol): k.version for k in keys
        }
        return Asked(self.experiment.title or self.experiment.name, cells)


def make_plan(experiment: Experiment, results: Results) -> Plan:
    """Settle trackers and sequences, and look up which runs are there.

    Raises
    ------
    TrackerError, SequenceError, ExperimentError, ResultsError
        For anything that can be known to fail before the first run.
    """
    chosen = _distinct_trackers(experiment)
    sequences = _distinct_sequences(experiment)
    protocol: Protocol = "timing" if experiment.timing else "accuracy"
    rows = {row["path"]: row for row in read_index(results)}
    cells = []
    for source, sequence in sequences:
        for text, entry in chosen:
            reference(sequence, entry.init, sequence.name)
            deterministic = entry.randomness is Randomness.NONE and not experiment.timing
            repetitions = experiment.repeated.get(text, experiment.repetitions)
            for repetition in range(1 if deterministic else repetitions):
                key = identify(entry, sequence, repetition, protocol)
                row = rows.get(str(results.path(key).relative_to(results.folder)))
                state, replaces = _state(key, row), row["version"] if row else ""
                cells.append(
                    Cell(text, entry.randomness, source, len(sequence), key, state, replaces)
                )
    return Plan(experiment, cells, [sequence for _, sequence in sequences])


def _state(key: Identity, row: dict[str, Any] | None) -> State:
    if row is None:
        return State.LEFT
    if row["digest"] != key.digest:
        return State.STALE
    return State.FAILED if row["status"] == "failed" else State.DONE


def _unit(cells: Iterable[Cell]) -> Unit:
    cells = list(cells)
    entries = tuple(
        Entry(cell.tracker, cell.identity.repetition, cell.identity.version, cell.replaces)
        for cell in cells
    )
    return Unit(cells[0].source, entries, cells[0].identity.protocol, cells[0].frames)


def _distinct_trackers(experiment: Experiment) -> list[tuple[str, Contestant]]:
    """Trackers by label: what is the same but for its spelling runs once."""
    found: dict[str, tuple[str, Contestant]] = {}
    for text in experiment.trackers:
        entry = contestant(text)
        other = found.setdefault(entry.label, (text, entry))[1]
        if other.file != entry.file:
            raise ExperimentError(
                f"two trackers are called {entry.label!r}: {other.file} and {entry.file}. "
                "Rename a file or a class."
            )
    return list(found.values())


def _distinct_sequences(experiment: Experiment) -> list[tuple[SequenceSource, Sequence]]:
    """Sequences by name, checked to be runnable."""
    found: dict[str, tuple[SequenceSource, Sequence]] = {}
    for source in experiment.sequences:
        sequence = datasets.load(source.text, truth=source.truth)
        sequence.check_runnable()
        other = found.setdefault(sequence.name, (source, sequence))[1]
        if other.fingerprint != sequence.fingerprint:
            raise ExperimentError(
                f"two different sequences are called {sequence.name!r}; {source.text!r} is one of "
                "them. Rename a folder or a file."
            )
    return list(found.values())
