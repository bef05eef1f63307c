"""Times of trackers: seconds in `update` without decoding; the initialisation is separate.

Trackers with one thread are compared by CPU time: other load can double the wall time and affects
the CPU time less. They are compared by *warm* times, on images in memory. The *as-decoded* time is
that of an update right after decoding, which evicts the CPU caches. In measurements it was 1.4 to
3.1 times as long.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

DISTURBED_RATIO = 1.1
"""Ratio of wall time to CPU time above which a pass counts as disturbed by other load."""


@dataclass(frozen=True)
class Times:
    """Times of a timing run, in seconds."""

    wall: NDArray[Any]  # (n,): as-decoded time of `update`; NaN if it was not called
    cpu: NDArray[Any]
    initialisation_wall: float  # time of `init`
    initialisation_cpu: float
    warm_wall: NDArray[Any] | None = None  # None in results of older versions of trackmark
    warm_cpu: NDArray[Any] | None = None


def is_disturbed(times: Times) -> bool:
    """Return whether a pass took clearly more wall time than CPU time.

    In this case other load used the core, or the tracker waited or ran several threads. The times
    then do not show the speed of the tracker.
    """
    passes = [(times.wall, times.cpu)]
    if times.warm_wall is not None and times.warm_cpu is not None:
        passes.append((times.warm_wall, times.warm_cpu))
    return any(np.nansum(wall) > DISTURBED_RATIO * np.nansum(cpu) for wall, cpu in passes)


def time_scores(times: Times) -> dict[str, float]:
    """Return median and upper quantiles of the times per frame, and the initialisation time [s].

    Scores `warm_seconds_…` are CPU times of the warm pass, if there is one. Other scores are
    as-decoded times. All are NaN if a pass was disturbed.
    """
    disturbed = is_disturbed(times)
    scores = {"disturbed": float(disturbed)}
    for clock, values in (("warm", times.warm_cpu), ("cpu", times.cpu), ("wall", times.wall)):
        if values is None:
            continue
        seconds = values[np.isfinite(values)]
        for key, q in (("median", 0.5), ("p95", 0.95), ("p99", 0.99)):
            usable = len(seconds) and not disturbed
            scores[f"{clock}_seconds_{key}"] = float(np.quantile(seconds, q)) if usable else np.nan
    scores["initialisation_seconds"] = np.nan if disturbed else times.initialisation_cpu
    return scores
