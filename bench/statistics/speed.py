"""Speed of a tracker against an older revision, from CPU times of interleaved sessions.

A session times both sides in turns, each in a fresh process, and gives one number, the log of the
ratio of their times. Sessions are the unit of evidence: within one, times depend on each other
(bursts of other load), and the place of code and data in memory stays the same.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import expm1, inf, log, log1p, nan, sqrt
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

SLOWDOWN = 0.05
"""Slowdown that must not be missed."""

MARGIN = 0.01
"""Irrelevant slowdown: the layout of equal code by a compiler causes as much."""

FALSE_ALARM = 0.01
MISSED = 0.05

MIN_SESSIONS = 6
_MAX_SESSIONS = 1000
_MIN_SPREAD = 1e-4

PaceLabel = Literal["slower", "inconclusive", "faster", "as fast"]


class Sample(NamedTuple):
    """Mean, standard deviation and number of the sessions' logs."""

    mean: float
    spread: float
    n: int


@dataclass(frozen=True)
class Pace:
    """Change of a tracker's speed; changes are relative, 0.05 if it takes 5 % longer."""

    state: PaceLabel
    change: float = nan
    low: float = nan  # 95 % interval
    high: float = nan
    sessions: int = 0
    reason: str = ""  # why the tracker could not be timed


def log_ratio(times: NDArray[np.float64]) -> float:
    """Return the log of the second side's time divided by the first one's in a session.

    `times`: CPU seconds, shape (2, passes, turns). Other load can only add to the time of a turn,
    by different amounts for different work. The least over passes is therefore the turn's time.
    """
    first, second = times.min(axis=1).sum(axis=1).tolist()
    return log(second / first)


def sample_of(logs: Sequence[float]) -> Sample:
    """Return mean and spread of the sessions' logs."""
    return Sample(float(np.mean(logs)), float(np.std(logs, ddof=1)), len(logs))


def judge_pace(now: Sample, tests: int = 1) -> Pace:
    """Judge sessions by Student's t.

    `now`: logs of the ratio to the old version. `tests`: trackers that share the 1 % of false
    alarms.
    """
    levels = [0.975, 1 - MISSED, 1 - FALSE_ALARM / tests]
    half, missed, alarm = (_error(now) * stdtrit(now.n - 1, levels)).tolist()
    state: PaceLabel = "inconclusive"
    if now.mean - alarm > log1p(MARGIN):
        state = "slower"
    elif now.mean + alarm < -log1p(MARGIN):
        state = "faster"
    elif now.mean + missed < log1p(SLOWDOWN):
        state = "as fast"
    return Pace(state, expm1(now.mean), expm1(now.mean - half), expm1(now.mean + half), now.n)


def sessions_needed(now: Sample, tests: int = 1) -> float:
    """Return the sessions after which a slowdown of 5 % is seen in 95 % of cases."""
    for n in range(MIN_SESSIONS, _MAX_SESSIONS):
        # Half of what may be missed: a spread of few sessions may be too small by chance.
        steps = stdtrit(n - 1, 1 - FALSE_ALARM / tests) + stdtrit(n - 1, 1 - MISSED / 2)
        if steps * _error(now._replace(n=n)) <= log1p(SLOWDOWN) - log1p(MARGIN):
            return float(n)
    return inf


def missing_sessions(logs: Sequence[float], tests: int = 1) -> int:
    """Return how many sessions to run next, at most as many as there are logs.

    The result is 0 if no more are needed or no number helps.
    """
    if len(logs) < MIN_SESSIONS:
        return MIN_SESSIONS - len(logs)
    needed = sessions_needed(sample_of(logs), tests)
    return 0 if needed == inf else min(max(int(needed) - len(logs), 0), len(logs))


def _error(now: Sample) -> float:
    """Return the standard error."""
    # Two sessions that agree by chance to the last digit prove nothing.
    return max(now.spread, _MIN_SPREAD) / sqrt(now.n)
