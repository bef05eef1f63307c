"""What is performed in one go, some runs on a sequence in lock step, and what these may take."""

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

from trackmark.bench.experiments.experiment import ExperimentError, SequenceSource


class Entry(NamedTuple):
    """One run of a unit."""

    tracker: str  # text form, as it was asked for
    repetition: int
    version: str  # what was planned: `Identity.version` of the run
    # Version of the stale or failed run that lies in its place and may be replaced; empty where
    # nothing lay there.
    replaces: str = ""


@dataclass(frozen=True)
class Unit:
    """What one process does in one go."""

    source: SequenceSource
    # Its runs. Timing units hold a single one.
    entries: tuple[Entry, ...]
    protocol: str  # as in `Identity`
    frames: int
    # What a process that performs it is kept for: it performs no unit of another owner, then or
    # later. Empty for trackers of the package, which share processes.
    owner: str = ""
    arrays: bool = False  # whether arrays, masks and maps are kept
    truth: str = ""  # path of the ground truth in the results folder; empty if unknown

    @property
    def work(self) -> int:
        """Frames times trackers."""
        return self.frames * len(self.entries)

    def split(self, parts: int) -> "list[Unit]":
        """The same work in at most `parts` units of nearly equal size."""
        parts = min(parts, len(self.entries))
        bounds = [len(self.entries) * i // parts for i in range(parts + 1)]
        return [replace(self, entries=self.entries[start:stop]) for start, stop in pairwise(bounds)]


LEAST_MEMORY = 512 << 20
"""Bytes without which no unit can be performed."""


@dataclass(frozen=True)
class Limits:
    """What a tracker may take."""

    frame_seconds: float = 60.0  # for one frame, and for its initialisation, by the wall clock
    run_seconds: float = 6 * 3600.0  # for all frames of a run together
    # For the process in which a unit runs; by default the machine's memory, shared equally by its
    # cores.
    memory_bytes: int | None = None

    def __post_init__(self) -> None:
        for name in ("frame_seconds", "run_seconds", "memory_bytes"):
            value = getattr(self, name)
            if value is not None and not value > 0:
                raise ExperimentError(f"the limit {name} is {value}; give more than 0.")
        if self.memory_bytes is not None and self.memory_bytes < LEAST_MEMORY:
            raise ExperimentError(
                f"the limit memory_bytes is {self.memory_bytes}; a process with its libraries "
                f"takes {LEAST_MEMORY >> 20} MB."
            )
