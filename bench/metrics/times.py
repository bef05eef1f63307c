"""Time of a tracker per frame, from the times of its calls.

The clock is wall time minus run delay (`trackers.base.call_clock`): it shows what a user waits for,
on a machine without other load. Decoding, conversion of images, transfer to another process and the
harness are not included. The CPU time of the process tells whether a tracker waits or computes in
several threads.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

MAX_RUN_DELAY = 0.1
"""Run delay as a fraction of the wall time above which other load has disturbed a measurement."""

TIME_FIELDS = (
    *("ms_per_frame", "fps", "ms_per_frame_median", "ms_per_frame_p95", "ms_first_update"),
    *("ms_init", "cpu_ms_per_frame", "run_delay_share"),
)
"""Names of the numbers of `time_fields`."""

RUN_DELAY_CLOCK = "wall time minus run delay"
WALL_CLOCK = "wall time"
"""Clocks of runs. Only times of equal clocks are compared."""

CPU_FACTOR = 1.5
"""Ratio between time and CPU time from which a run gets a note."""

MIN_DIFFERENCE = 1e-4
"""Least difference for a note: of the time per frame to CPU time, or of its mean to its median [s].

Context switches of the process, and reading its counters, cause smaller differences.
"""


def run_delay_share(seconds: float, run_delay: float) -> float:
    """Return the run delay as a fraction of the wall time, which is the sum of both times."""
    wall = seconds + run_delay
    return run_delay / wall if wall else 0.0


@dataclass(frozen=True)
class Times:
    """Times of the calls of a run [s]; arrays of shape (n,) have one value per update."""

    seconds: NDArray[Any]  # wall time minus run delay
    run_delay: NDArray[Any]
    cpu: NDArray[Any]  # CPU time of all threads of the process
    children: NDArray[Any]  # CPU time of child processes that ended during an update
    is_first: NDArray[Any]  # True for the first update after an initialisation
    init: NDArray[Any]  # (initialisations,): time of `init`, minus run delay

    @property
    def run_delay_share(self) -> float:
        """Run delay of all updates as a fraction of their wall time."""
        return run_delay_share(float(self.seconds.sum()), float(self.run_delay.sum()))

    @property
    def is_disturbed(self) -> bool:
        """True if other load took the processor for a considerable time."""
        return self.run_delay_share > MAX_RUN_DELAY


def time_fields(times: Times) -> dict[str, Any]:
    """Return the numbers that describe the times of a run; empty without an update.

    `ms_per_frame` is the mean time of an update, `ms_per_frame_median` and `ms_per_frame_p95` are
    quantiles, and `fps` is the number of frames per second of the mean. The first update after an
    initialisation often compiles code. It is therefore not part of these numbers, unless there is
    no other update. `ms_first_update` and `ms_init` are means over the initialisations of the run.
    `cpu_ms_per_frame` is the mean CPU time of the process and its children. `run_delay_share` is
    defined in `Times`. `time_note` says what a reader must know about the times.
    """
    if not len(times.seconds):
        return {}
    usual = ~times.is_first if not times.is_first.all() else times.is_first
    seconds = times.seconds[usual]
    mean = float(seconds.mean())
    median, percentile_95 = (float(value) for value in np.quantile(seconds, (0.5, 0.95)))
    fields = {
        "ms_per_frame": 1e3 * mean,
        "ms_per_frame_median": 1e3 * median,
        "ms_per_frame_p95": 1e3 * percentile_95,
        "fps": 1 / mean if mean > 0 else np.inf,
        "ms_first_update": 1e3 * float(times.seconds[times.is_first].mean()),
        "ms_init": 1e3 * float(times.init.mean()),
        "cpu_ms_per_frame": 1e3 * float((times.cpu + times.children)[usual].mean()),
        "run_delay_share": times.run_delay_share,
    }
    children = float(times.children[usual].mean())
    note = _note(mean, fields["cpu_ms_per_frame"] / 1e3, children)
    # Less than 5 % of the frames raise the mean above 1.5 times the median.
    is_usual_mean = mean <= max(1.5 * median, median + MIN_DIFFERENCE)
    if not note and not is_usual_mean and seconds[seconds <= percentile_95].mean() <= 1.25 * median:
        note = "a few frames take most of the time"
    return {**fields, "time_note": note} if note else fields


def _note(seconds: float, cpu: float, children: float) -> str:
    """Return how the mean times of an update differ from those of one computing thread.

    `cpu` is the CPU time of the process and its children, `children` that of the children.
    """
    if abs(seconds - cpu) < MIN_DIFFERENCE and children < MIN_DIFFERENCE:
        return ""
    if children > cpu - children:
        return "computes in another process"
    if cpu > CPU_FACTOR * seconds:
        return "computes in several threads"
    return "waits" if seconds > CPU_FACTOR * cpu else ""
