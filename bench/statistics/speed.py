"""Whether a tracker became slower: from CPU times taken in turns, in sessions.

A session clocks two sides in turns, each in a fresh process, and gives one number, the log of the
ratio of their times. Sessions are the unit of evidence: within one, times follow from each other
(bursts of other load), and where code and data happen to lie in memory stays the same.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import expm1, inf, log, log1p, sqrt
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr, stdtrit

from bench.statistics.regression import Sample

__all__ = [
    "FEWEST_SESSIONS",
    "SLOWDOWN",
    "Pace",
    "PaceState",
    "judge_pace",
    "log_ratio",
    "sample_of",
    "sessions_for",
    "sessions_lacking",
    "sessions_needed",
]

SLOWDOWN = 0.05
"""That must be seen."""

MARGIN = 0.01
"""Slowdown that means nothing: how a compiler lays out equal code makes as much."""

FALSE_ALARM = 0.01
MISSED = 0.05

FEWEST_SESSIONS = 6
_MOST_SESSIONS = 1000
_LEAST_SPREAD = 1e-4

PaceState = Literal["slower", "cannot tell", "faster", "as fast"]


@dataclass(frozen=True)
class Pace:
    """What became of a tracker's speed; changes are relative, 0.05 where it takes 5 % longer."""

    state: PaceState
    change: float
    low: float  # 95 % interval
    high: float
    sessions: int


def log_ratio(times: NDArray[np.float64]) -> float:
    """Log of the second side's time to the first one's, of a session.

    `times`: CPU seconds, shape (2, passes, turns). Other load only ever adds to a turn's time, and
    not the same to every kind of work; so the least over passes stands for a turn.
    """
    first, second = times.min(axis=1).sum(axis=1).tolist()
    return log(second / first)


def sample_of(logs: Sequence[float]) -> Sample:
    """Mean and spread of the sessions' logs."""
    return Sample(float(np.mean(logs)), float(np.std(logs, ddof=1)), len(logs))


def judge_pace(now: Sample, before: Sample | None = None, tests: int = 1) -> Pace:
    """Judge sessions.

    Parameters
    ----------
    now : Sample
        Logs of the ratio to the old version, or to the reference where `before` is given.
    before : Sample, optional
        Logs of the old version's ratio to the reference.
    tests : int
        Trackers that share the 1 % of false alarms.
    """
    difference, error, degrees = _compared(now, before)
    half = float(stdtrit(degrees, 0.975)) * error
    beyond = float(stdtrit(degrees, 1 - MISSED)) * error
    state: PaceState = "cannot tell"
    if _p(difference - log1p(MARGIN), error, degrees) < FALSE_ALARM / tests:
        state = "slower"
    elif _p(-difference - log1p(MARGIN), error, degrees) < FALSE_ALARM / tests:
        state = "faster"
    elif difference + beyond < log1p(SLOWDOWN):
        state = "as fast"
    low, high = expm1(difference - half), expm1(difference + half)
    return Pace(state, expm1(difference), low, high, now.n)


def sessions_needed(now: Sample, before: Sample | None = None, tests: int = 1) -> float:
    """Sessions after which a slowdown of 5 % is seen in 95 % of cases; see `judge_pace`.

    Infinite where those of `before` are too few for any number.
    """
    return _least(lambda n: _compared(now._replace(n=n), before), tests)


def sessions_for(now: Sample, tests: int = 1) -> float:
    """Sessions of a tracker and the reference that suffice, with as many after a change."""
    return _least(lambda n: _compared(now._replace(n=n), now._replace(n=n)), tests)


def sessions_lacking(logs: Sequence[float], needed: Callable[[Sample], float]) -> int:
    """Sessions to run next, at most as many as there were: 0 where no more are needed, or help.

    `needed`: how many in all, given those so far.
    """
    if len(logs) < FEWEST_SESSIONS:
        return FEWEST_SESSIONS - len(logs)
    all_in_all = needed(sample_of(logs))
    return 0 if all_in_all == inf else min(max(int(all_in_all) - len(logs), 0), len(logs))


def _least(test: Callable[[int], tuple[float, float, float]], tests: int) -> float:
    for n in range(FEWEST_SESSIONS, _MOST_SESSIONS):
        _, error, degrees = test(n)
        # Half of what may be missed: a spread of few sessions may be too small by chance.
        steps = stdtrit(degrees, 1 - FALSE_ALARM / tests) + stdtrit(degrees, 1 - MISSED / 2)
        if steps * error <= log1p(SLOWDOWN) - log1p(MARGIN):
            return float(n)
    return inf


def _compared(now: Sample, before: Sample | None) -> tuple[float, float, float]:
    """Difference of the logs, its standard error, degrees of freedom (Welch's)."""
    samples = [now] if before is None else [now, before]
    # Two sessions that agree by chance to the last digit are no proof.
    squares = [max(sample.spread, _LEAST_SPREAD) ** 2 / sample.n for sample in samples]
    parts = [square**2 / (sample.n - 1) for square, sample in zip(squares, samples, strict=True)]
    difference = now.mean - (before.mean if before else 0.0)
    return difference, sqrt(sum(squares)), sum(squares) ** 2 / sum(parts)


def _p(difference: float, error: float, degrees: float) -> float:
    """That nothing above zero is behind a difference."""
    return float(stdtr(degrees, -difference / error))
