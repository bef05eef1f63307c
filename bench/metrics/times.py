"""Time per frame: seconds in `update` alone, without decoding; initialisation is separate.

CPU time is the figure for trackers of one thread: other load doubles wall time and affects CPU time
less. Trackers are compared by *warm* times, on images in memory. Decoding evicts the CPU caches:
the next update, *as decoded*, took 1.4 to 3.1 times as long.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

DISTURBED_RATIO = 1.1
"""Wall time over CPU time from which a pass counts as disturbed by other load."""


@dataclass(frozen=True)
class Times:
    """Times of a timing run, in seconds."""

    wall: NDArray[Any]  # (n,): of `update` alone, as decoded; NaN if it was not called
    cpu: NDArray[Any]
    initialisation_wall: float  # of `init`
    initialisation_cpu: float
    warm_wall: NDArray[Any] | None = None  # None in runs that were stored before warm times were
    warm_cpu: NDArray[Any] | None = None


def is_disturbed(times: Times) -> bool:
    """Return whether a pass spent noticeably more wall time than CPU time.

    Then other load held the core, or the tracker waited or ran more than one thread: its wall time
    is not its speed.
    """
    passes = [(times.wall, times.cpu)]
    if times.warm_wall is not None and times.warm_cpu is not None:
        passes.append((times.warm_wall, times.warm_cpu))
    return any(np.nansum(wall) > DISTURBED_RATIO * np.nansum(cpu) for wall, cpu in passes)


def time_scores(times: Times) -> dict[str, float]:
    """Return the median and tails of the times per frame [s], and the time of initialisation.

    `warm_seconds_` are CPU times of the warm pass, if there is one; the others are as decoded. All
    are NaN if a pass was disturbed.
    """
    disturbed = is_disturbed(times)
    scores = {"disturbed": float(disturbed)}
    for clock, values in (("warm", times.warm_cpu), ("cpu", times.cpu), ("wall", times.wall)):
        if values is None:
            continue
        taken = values[np.isfinite(values)]
        for key, q in (("median", 0.5), ("p95", 0.95), ("p99", 0.99)):
            usable = len(taken) and not disturbed
            scores[f"{clock}_seconds_{key}"] = float(np.quantile(taken, q)) if usable else np.nan
    scores["initialisation_seconds"] = np.nan if disturbed else times.initialisation_cpu
    return scores
