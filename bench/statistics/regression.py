"""Whether scores have dropped: before against after, by cell and over all cells.

A cell is a tracker on a sequence; what varies within it is its seeds. A tracker that never draws
gives the same again: its differences are facts and need no test.

Two tests share the significance of 5 %, half each, so that an unchanged tracker is accused in at
most 5 %: one of the mean difference over all cells that vary, which finds a small drop everywhere,
and one a cell, corrected by Holm, which finds a drop on one sequence.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, inf, nan, sqrt
from typing import Literal, NamedTuple

import numpy as np
from scipy.special import ndtri, stdtr, stdtrit

from bench.statistics.paired import holm

__all__ = [
    "Change",
    "Judgement",
    "Sample",
    "State",
    "judge",
    "repetitions_for",
    "repetitions_needed",
]

State = Literal["identical", "better", "changed, no worse", "cannot tell", "worse"]

LEVEL = 0.05 / 2
"""Of the test over all cells, and of those by cell together."""

CONFIDENCE = 0.95
POWER = 0.80


class Sample(NamedTuple):
    """Mean, standard deviation and number of a cell's repetitions; `spread` 0 where none draws."""

    mean: float
    spread: float
    n: int


@dataclass(frozen=True)
class Change:
    """What became of a cell; differences are after minus before, positive where it is better."""

    state: State
    difference: float
    low: float  # one-sided 95 % bounds of the difference
    high: float
    p: float  # that there is no drop: by cell, corrected by Holm; NaN where nothing varies
    detectable: float  # smallest drop of this cell that is found in 80 % of cases


@dataclass(frozen=True)
class Judgement:
    """Of all cells together; `changes` are in their order."""

    state: State
    changes: Sequence[Change]
    difference: float  # mean over the cells that vary; NaN where none does
    p: float  # that their mean has not dropped
    detectable: float  # smallest drop of their mean that is found in 80 % of cases


class _Test(NamedTuple):
    difference: float
    error: float  # standard error; 0 where nothing varies
    degrees: float


def judge(
    cells: Sequence[tuple[Sample, Sample]],
    identical: Sequence[bool],
    margin: float,
    detect: float,
) -> Judgement:
    """Judge cells before and after, and all together.

    Parameters
    ----------
    cells : sequence of (Sample, Sample)
        Before and after, of scores of which more is better.
    identical : sequence of bool
        Whether a cell gave the very same boxes: then nothing is tested.
    margin : float
        Drop that means nothing in practice; a smaller one is none.
    detect : float
        Drop that must not go unseen: where a cell's may be as large, it can't be told.

    Returns
    -------
    Judgement
        `worse` where a cell is, or the mean over the cells that vary; else `cannot tell` where
        some cell can't be told; else `better`, `changed, no worse` or `identical`.
    """
    tests = [_tested(before, after) for before, after in cells]
    varying = [
        place
        for place, (test, same) in enumerate(zip(tests, identical, strict=True))
        if test.error > 0 and not same
    ]
    drops = holm([_p(tests[place], 1) for place in varying])
    gains = holm([_p(tests[place], -1) for place in varying])
    levels = {place: (d, g) for place, d, g in zip(varying, drops, gains, strict=True)}
    changes = [
        _change(test, same, levels.get(place), len(varying), margin, detect)
        for place, (test, same) in enumerate(zip(tests, identical, strict=True))
    ]
    whole = _together([tests[place] for place in varying])
    p = _p(whole, 1) if whole.error > 0 else nan
    states = {change.state for change in changes}
    state: State = "identical"
    if "worse" in states or (p < LEVEL and whole.difference < -margin):
        state = "worse"
    elif "cannot tell" in states:
        state = "cannot tell"
    elif "better" in states or (_gained(whole) and whole.difference > margin):
        state = "better"
    elif "changed, no worse" in states:
        state = "changed, no worse"
    return Judgement(state, changes, whole.difference, p, _detectable(whole, LEVEL))


def repetitions_needed(before: Sample, after: Sample, detect: float, cells: int) -> float:
    """Repetitions after the change with which a drop of `detect` is found in 80 % of cases.

    `cells` share the significance. Infinite where the repetitions before are too few for that.
    """
    spread = _pooled(before, after)
    left = (detect / _steps(cells)) ** 2 - spread**2 / before.n
    if spread == 0.0:
        return float(after.n)
    return float(ceil(spread**2 / left)) if left > 0 else inf


def repetitions_for(sample: Sample, detect: float, cells: int) -> int:
    """Repetitions of a cell that find a drop of `detect`, with as many after a change."""
    return max(2, ceil(2 * (sample.spread * _steps(cells) / detect) ** 2))


def _steps(cells: int) -> float:
    """Standard errors by which a drop must exceed zero to be found so surely."""
    return float(ndtri(1 - LEVEL / max(cells, 1))) + float(ndtri(POWER))


def _change(
    test: _Test,
    same: bool,
    levels: tuple[float, float] | None,
    cells: int,
    margin: float,
    detect: float,
) -> Change:
    difference = test.difference
    if same:
        return Change("identical", 0.0, 0.0, 0.0, nan, 0.0)
    if levels is None:
        state: State = "changed, no worse"
        if abs(difference) > margin:
            state = "better" if difference > 0 else "worse"
        return Change(state, difference, difference, difference, nan, 0.0)
    half = float(stdtrit(test.degrees, CONFIDENCE)) * test.error
    low, high = difference - half, difference + half
    drop, gain = levels
    if drop < LEVEL and difference < -margin:
        state = "worse"
    elif gain < LEVEL and difference > margin:
        state = "better"
    else:
        state = "changed, no worse" if low > -detect else "cannot tell"
    return Change(state, difference, low, high, drop, _detectable(test, LEVEL / cells))


def _tested(before: Sample, after: Sample) -> _Test:
    """Welch's: the spreads need not be equal."""
    difference = after.mean - before.mean
    squares = [sample.spread**2 / sample.n for sample in (before, after)]
    if any(sample.spread > 0 and sample.n < 2 for sample in (before, after)):
        raise ValueError("a spread needs two repetitions or more.")
    if sum(squares) <= 0:
        return _Test(difference, 0.0, inf)
    parts = [
        square**2 / (sample.n - 1)
        for square, sample in zip(squares, (before, after), strict=True)
        if square > 0
    ]
    return _Test(difference, sqrt(sum(squares)), sum(squares) ** 2 / sum(parts))


def _together(tests: Sequence[_Test]) -> _Test:
    """Mean difference over cells, whose errors add up."""
    if not tests:
        return _Test(nan, 0.0, inf)
    squares = np.array([test.error**2 for test in tests])
    degrees = squares.sum() ** 2 / sum(
        square**2 / test.degrees for square, test in zip(squares.tolist(), tests, strict=True)
    )
    mean = float(np.mean([test.difference for test in tests]))
    return _Test(mean, sqrt(squares.sum()) / len(tests), float(degrees))


def _gained(test: _Test) -> bool:
    return test.error > 0 and _p(test, -1) < LEVEL


def _p(test: _Test, sign: int) -> float:
    """One-sided p that there is no drop (1), or no gain (-1)."""
    return float(stdtr(test.degrees, sign * test.difference / test.error))


def _detectable(test: _Test, level: float) -> float:
    quantile = float(stdtrit(test.degrees, 1 - level)) if np.isfinite(test.degrees) else 0.0
    return (quantile + float(ndtri(POWER))) * test.error


def _pooled(before: Sample, after: Sample) -> float:
    """Standard deviation of one repetition, from both samples."""
    degrees = [max(sample.n - 1, 0) for sample in (before, after)]
    if not sum(degrees):
        return max(before.spread, after.spread)
    return sqrt((degrees[0] * before.spread**2 + degrees[1] * after.spread**2) / sum(degrees))
