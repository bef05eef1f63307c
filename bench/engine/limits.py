"""How much time and memory a tracker may take before it counts as failed."""

from dataclasses import dataclass

from bench.experiments.experiment import ExperimentError

__all__ = ["LEAST_MEMORY", "Limits"]

LEAST_MEMORY = 512 << 20
"""Bytes without which no unit can be performed."""


@dataclass(frozen=True)
class Limits:
    """What a tracker may take.

    Attributes
    ----------
    frame_seconds : float
        For one frame, and for its initialisation, by the wall clock.
    run_seconds : float
        For all frames of a run together.
    memory_bytes : int or None
        For the process in which a unit runs; by default the machine's memory, shared equally
        by its cores.
    """

    frame_seconds: float = 60.0
    run_seconds: float = 6 * 3600.0
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
