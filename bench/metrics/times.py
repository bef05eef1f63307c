"""Time per frame: seconds in `update` alone, decoding excluded, initialisation apart.

CPU time is the figure for trackers of one thread: other load doubles wall time and hardly
touches it.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["DISTURBED_RATIO", "Times", "is_disturbed", "time_scores"]

DISTURBED_RATIO = 1.1
"""Wall time over CPU time from which a pass counts as disturbed by other load."""


@dataclass(frozen=True)
class Times:
    """Times of a timing run, in seconds.

    Attributes
    ----------
    wall, cpu : ndarray of float64, shape (n,)
        Time in `update` alone, by frame; NaN where it was not called.
    initialisation_wall, initialisation_cpu : float
        Time in `init`.
    """

    wall: NDArray[Any]
    cpu: NDArray[Any]
    initialisation_wall: float
    initialisation_cpu: float


def is_disturbed(times: Times) -> bool:
    """Whether the pass spent noticeably more wall time than CPU time.

    Then something else held the core, or the tracker waited or ran more than one thread:
    either way its wall time is no speed.
    """
    return bool(np.nansum(times.wall) > DISTURBED_RATIO * np.nansum(times.cpu))


def time_scores(times: Times) -> dict[str, float]:
    """Times per frame, in seconds: median and tails; initialisation apart.

    All are NaN in a disturbed pass, whose times are no speed.
    """
    disturbed = is_disturbed(times)
    scores = {"disturbed": float(disturbed)}
    for clock, values in (("cpu", times.cpu), ("wall", times.wall)):
        taken = values[np.isfinite(values)]
        for key, q in (("median", 0.5), ("p95", 0.95), ("p99", 0.99)):
            usable = len(taken) and not disturbed
            scores[f"{clock}_seconds_{key}"] = float(np.quantile(taken, q)) if usable else np.nan
    scores["initialisation_seconds"] = np.nan if disturbed else times.initialisation_cpu
    return scores
