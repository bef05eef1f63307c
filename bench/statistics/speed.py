"""Speed of a tracker compared with an older revision, from times of interleaved sessions.

A session times both revisions alternately, each in a new process. Its result is one number, the
logarithm of the ratio of times. Sessions are the statistical units: times within a session are
dependent because they share other load and memory addresses.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import expm1, inf, log, log1p, nan, sqrt
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

SLOWDOWN = 0.05
"""Slowdown that must be detected."""

MARGIN = 0.01
"""Largest irrelevant slowdown. The memory layout of equal code can cause as much."""

MAX_FALSE_ALARMS = 0.01
MAX_MISSED = 0.05

MIN_SESSIONS = 6
_MAX_SESSIONS = 1000
_MIN_SPREAD = 1e-4  # lower limit of the spread: two sessions can agree by chance to the last digit

SpeedDecision = Literal["slower", "inconclusive", "faster", "not 5 % slower"]


class RatioSample(NamedTuple):
    """Mean, standard deviation and number of log ratios, one per session."""

    mean: float
    spread: float
    n: int


@dataclass(frozen=True)
class SpeedChange:
    """Relative change of a tracker's time: 0.05 if it takes 5 % longer."""

    decision: SpeedDecision
    change: float = nan
    low: float = nan  # 95 % interval
    high: float = nan
    n_sessions: int = 0
    reason: str = ""  # reason why the tracker was not timed


def log_ratio(times: NDArray[np.float64]) -> float:
    """Return the logarithm of the ratio of the second to the first revision's time in a session.

    `times`: wall times minus run delay [s], shape (2, passes, turns). Other load only adds to the
    time of a turn. The minimum over passes therefore estimates the time of a turn.
    """
    first, second = times.min(axis=1).sum(axis=1).tolist()
    return log(second / first)


def ratio_sample(logs: Sequence[float]) -> RatioSample:
    """Return mean and standard deviation of the log ratios of sessions."""
    return RatioSample(float(np.mean(logs)), float(np.std(logs, ddof=1)), len(logs))


def decide_speed(sample: RatioSample, tests: int = 1) -> SpeedChange:
    """Decide by Student's t whether a tracker has become slower.

    `sample` describes the log ratios of its times to those of the old version. If `tests` trackers
    are tested and sessions are independent, the probability of any false alarm is 1 %. A tracker
    is not 5 % slower if the printed interval is below 5 %.
    """
    levels = [0.975, 1 - MAX_FALSE_ALARMS / tests]
    half, alarm = (_standard_error(sample) * stdtrit(sample.n - 1, levels)).tolist()
    decision: SpeedDecision = "inconclusive"
    if sample.mean - alarm > log1p(MARGIN):
        decision = "slower"
    elif sample.mean + alarm < -log1p(MARGIN):
        decision = "faster"
    elif sample.mean + half < log1p(SLOWDOWN):
        decision = "not 5 % slower"
    return SpeedChange(
        decision, expm1(sample.mean), expm1(sample.mean - half), expm1(sample.mean + half), sample.n
    )


def sessions_needed(sample: RatioSample, tests: int = 1) -> float:
    """Return the number of sessions that detects a slowdown of 5 % in 95 % of cases."""
    for n in range(MIN_SESSIONS, _MAX_SESSIONS):
        # Only half of the allowed misses is used: few sessions can agree too well by chance.
        steps = stdtrit(n - 1, 1 - MAX_FALSE_ALARMS / tests) + stdtrit(n - 1, 1 - MAX_MISSED / 2)
        if steps * _standard_error(sample._replace(n=n)) <= log1p(SLOWDOWN) - log1p(MARGIN):
            return float(n)
    return inf


def missing_sessions(logs: Sequence[float], tests: int = 1) -> int:
    """Return how many sessions to run next, at most doubling their number.

    The result is 0 if no more are needed or no number suffices.
    """
    if len(logs) < MIN_SESSIONS:
        return MIN_SESSIONS - len(logs)
    needed = sessions_needed(ratio_sample(logs), tests)
    return 0 if needed == inf else min(max(int(needed) - len(logs), 0), len(logs))


def _standard_error(sample: RatioSample) -> float:
    return max(sample.spread, _MIN_SPREAD) / sqrt(sample.n)
