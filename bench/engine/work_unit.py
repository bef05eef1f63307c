"""Work units (runs on one sequence in lock step), their limits, requests and failures."""

from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import NamedTuple

from trackmark.bench.engine.stack_trace import CodeLine
from trackmark.bench.experiments.experiment import ExperimentError, SequenceSource
from trackmark.datasets import SequenceError


class Entry(NamedTuple):
    """Run of a unit."""

    tracker: str  # specification, as requested
    repetition: int
    version: str  # `Identity.version` of the run, as planned
    # Version of the stored (stale or failed) run that may be replaced; empty if no run is stored.
    replaces: str = ""
    planned: str = ""  # `planned_values` of the run as JSON


@dataclass(frozen=True)
class Unit:
    """Runs that one process executes together."""

    source: SequenceSource
    entries: tuple[Entry, ...]  # a timing unit has a single entry
    protocol: str  # as in `Identity`
    frames: int
    # Tracker file outside the package; empty for the package's trackers. A process runs units of
    # one owner.
    owner: str = ""
    arrays: bool = False  # whether arrays, masks and maps are kept
    fingerprint: str = ""  # of the planned sequence; empty if unknown
    # Time limit that trackers in processes of their own enforce [s]; replaces a lower frame limit.
    call_seconds: float = 0.0

    @property
    def work(self) -> int:
        """Amount of work: frames times trackers."""
        return self.frames * len(self.entries)

    def split(self, parts: int) -> "list[Unit]":
        """Split this unit into at most `parts` units of nearly equal size."""
        parts = min(parts, len(self.entries))
        bounds = [len(self.entries) * i // parts for i in range(parts + 1)]
        return [replace(self, entries=self.entries[start:stop]) for start, stop in pairwise(bounds)]


class UnusableTrackerError(SequenceError):
    """Error of a tracker that a worker process cannot create as it was planned."""


LEAST_MEMORY = 512_000_000
"""Minimum memory limit of a process [bytes]: 512 MB, as `--memory-limit 512MB` is parsed."""


@dataclass(frozen=True)
class Limits:
    """Limits of a tracker."""

    frame_seconds: float = 60.0  # wall time of one frame, or of the initialisation
    run_seconds: float = 6 * 3600.0  # all frames of a run together
    # Memory limit of a worker process; by default the machine's memory divided by its cores.
    memory_bytes: int | None = None

    def __post_init__(self) -> None:
        for name in ("frame_seconds", "run_seconds", "memory_bytes"):
            value = getattr(self, name)
            if value is not None and not value > 0:
                raise ExperimentError(f"the limit {name} is {value}. Expected: a value above 0.")
        if self.memory_bytes is not None and self.memory_bytes < LEAST_MEMORY:
            raise ExperimentError(
                f"the limit memory_bytes is {self.memory_bytes:,}, below the minimum of "
                f"{LEAST_MEMORY:,} (512 MB) for a process with its libraries. Use a higher limit."
            )


@dataclass(frozen=True)
class Failure:
    """Crash of a worker process, or the reason why its parent ended it."""

    frame: int  # -1 if unknown
    reason: str
    output: str = ""
    rows: bytes = b""  # rows of the run so far, as in `bench.evaluation.recorder.Recorder`
    stack: list[CodeLine] = field(default_factory=list)  # innermost line first, if known
    entry: int = 0  # see `bench.engine.heartbeat.HeartbeatState`
    stalled: bool = False  # whether the heartbeat stopped


@dataclass(frozen=True)
class Request:
    """Request to run a unit, or to record its only run as failed."""

    unit: Unit
    run_seconds: float
    failure: Failure | None = None
    fresh: bool = False  # whether the process must not have run anything before
