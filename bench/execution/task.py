"""Tasks, which workers execute, and the limits of their trackers."""

from dataclasses import dataclass
from typing import NamedTuple

from trackmark.bench.experiments.experiment import ExperimentError, SequenceSpec
from trackmark.bench.experiments.tracker_spec import Identity
from trackmark.datasets import SequenceError


class PlannedRun(NamedTuple):
    """Run that a task executes: the tracker, and the identity that the plan has computed.

    The worker computes the identity again: a run is only stored if nothing has changed meanwhile.
    """

    tracker: str  # specification, as requested
    identity: Identity
    # Version of the stored (stale or failed) run that may be replaced; empty if no run is stored.
    replaces: str = ""


@dataclass(frozen=True)
class Task:
    """Runs on one sequence that a worker executes in lock step, so that it reads each frame once.

    All runs have the same protocol. A task for timing has a single run.
    """

    source: SequenceSpec
    runs: tuple[PlannedRun, ...]
    n_frames: int
    keep_arrays: bool = False  # whether arrays, masks and maps are stored
    # Whether each tracker, also of the package, has a process of its own.
    is_isolated: bool = False

    @property
    def protocol(self) -> str:
        """Protocol of the runs, as in `Identity`."""
        return self.runs[0].identity.protocol

    @property
    def work(self) -> int:
        """Amount of work: frames times trackers."""
        return self.n_frames * len(self.runs)


OPENING_SECONDS = 3600.0
"""Longest time in which a worker sends no message while it opens a sequence [s]."""


class RepeatError(Exception):
    """Reason to repeat a task with a process for each tracker."""


class UnusableTrackerError(SequenceError):
    """Error of a tracker that a worker cannot create as it was planned."""


LEAST_MEMORY = 512_000_000
"""Minimum memory limit of a process [bytes]: 512 MB, as `--memory-limit 512MB` is parsed."""


@dataclass(frozen=True)
class Limits:
    """Limits of a tracker."""

    frame_seconds: float = 60.0  # wall time of one frame, or of the initialisation
    run_seconds: float = 6 * 3600.0  # all frames of a run together
    # Memory limit of a process; by default the machine's memory divided by its cores.
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
