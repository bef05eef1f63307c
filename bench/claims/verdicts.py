"""Verdict of a test on the rows of its sides."""

from collections.abc import Sequence
from dataclasses import replace
from math import inf, isnan, nan
from typing import Any, Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.claims import kinds
from bench.claims.ledger import Claim
from bench.claims.readings import in_words
from bench.claims.sides import limited
from bench.statistics.rules import SHARE_LIMIT
from bench.statistics.verdict_rules import (
    Verdict,
    inconclusive,
    no_worse,
    number,
    order,
    plural,
    share,
    time,
)

__all__ = ["CELL", "verdict_of"]

CELL = ["sequence", "scene"]

Sides = Sequence[pd.DataFrame]
"""Rows of each side of a test, in its own order."""

Key = tuple[object, ...]

Values = dict[Key, float]
"""A number by cell and what else tells runs apart, in their order."""


def verdict_of(
    claim: Claim, test: kinds.PartTest, sides: Sides, metric: str, comparisons: int = 1
) -> Verdict:
    """Return the verdict on these rows, of each side under one reading, by one metric.

    With `comparisons` = m its interval is at level 1 - 0.05 / m.
    """
    counted = claim.cells.get(test.table, test.counted)
    of, unit = metric, "px" if metric.startswith(kinds.IN_PIXELS) else ""
    if isinstance(test, kinds.Comparison):
        verdict = _compared(test, sides, metric, comparisons, counted)
    elif isinstance(test, kinds.RatioTest):
        longer, shorter = sides[0][test.longer], sides[0][test.shorter]
        verdict = time(longer, shorter, test.least, comparisons, counted=counted)
        of, unit = f"{test.longer} to {test.shorter}", verdict.unit
    elif isinstance(test, kinds.NumberTest):
        values = [*_reduced(_keys(sides[0], CELL), _scaled(sides[0], metric), "mean").values()]
        most = 1.0 if metric in kinds.COUNTS else test.most.get(metric)
        verdict = number([value for value in values if not isnan(value)], most=most)
    else:
        good, trials, of = _successes(test, sides, metric)
        counted = "scene" if set(CELL) <= set(sides[0]) and counted == "row" else counted
        limit = SHARE_LIMIT if isinstance(test, kinds.BoundTest) else test.limit
        verdict = share(good, trials, limit, comparisons, counted=counted)
        unit = f"of the {plural(counted)}"
    if isinstance(test, kinds.Comparison | kinds.NumberTest):
        unit = claim.units.get(metric, "of the frames" if metric in kinds.COUNTS else unit)
    return replace(verdict, of=in_words(of), unit=unit, counted=counted)


def _compared(
    test: kinds.Comparison, sides: Sides, metric: str, comparisons: int, counted: str
) -> Verdict:
    limit = 1.0 if metric in kinds.COUNTS else inf  # of differences of shares
    margin = _margin(sides, test, metric)
    if isinstance(test, kinds.InteractionTest):
        values = _paired_gains(test, sides, metric)
        return order(values, margin, comparisons, limit=2 * limit, counted=counted)
    if isinstance(test, kinds.NoWorseTest):
        both = set.intersection(*(set(side["repetition"]) for side in sides))
        sides = [side[side["repetition"].isin(both)] for side in sides]
        values = [*_differences(sides, test, metric).values()]
        return no_worse(values, margin, comparisons, limit=limit, counted=counted)
    values = [*_differences(sides, test, metric).values()]
    verdict = order(values, margin, comparisons, limit=limit, counted=counted)
    for column, least in test.needs.items():
        needed = float(sides[0][column].mean())
        words = f"{column.replace('_', ' ')} {100 * needed:.1f} %"
        if not needed >= least:
            return inconclusive(f"there is nothing to compare: {words}")
        verdict = replace(verdict, reason=f"{verdict.reason}; {words}")
    return verdict


def _paired_gains(test: kinds.InteractionTest, sides: Sides, metric: str) -> list[float]:
    """Return each scene's difference of differences.

    Scenes of different sequences are paired by their numbers.
    """
    first = [limited(side[side["sequence"].isin(test.on)], test.where) for side in sides]
    second = [limited(side, test.against) for side in sides]
    gains, others = (_differences(part, test, metric) for part in (first, second))
    if not {key[0] for key in gains} & {key[0] for key in others}:
        gains, others = (
            _reduced([key[1:] for key in one], np.array([*one.values()], np.float64), "mean")
            for one in (gains, others)
        )
    return [gain - others[key] for key, gain in gains.items() if key in others]


def _successes(
    test: kinds.AllTest | kinds.BestTest | kinds.ShareTest | kinds.BoundTest,
    sides: Sides,
    metric: str,
) -> tuple[Sequence[float], Sequence[float], str]:
    """Return successes and trials of each scene, and what a success is."""
    rows = sides[0]
    if isinstance(test, kinds.BestTest):
        near = _near_best(test, [_values(side, test, metric) for side in sides])
        return near, [1.0] * len(near), metric
    if isinstance(test, kinds.BoundTest):
        values = rows[test.metric].to_numpy(np.float64)
        within = values >= test.least if test.least is not None else values <= (test.most or 0.0)
        if not set(CELL) <= set(rows):
            return within.astype(float).tolist(), [1.0] * len(rows), test.metric
        good, trials, of = within.astype(float), np.ones(len(rows)), test.metric
    elif isinstance(test, kinds.AllTest):
        lost = np.asarray(rows["first_loss"] < rows["frames"], np.float64)
        good, of = (lost, "lost") if test.kind == "lost" else (1 - lost, "never lost")
        trials = np.ones(len(rows))
    else:
        rows = rows[rows[metric].notna()]  # without a value a row is no trial
        trials = rows[test.trials].to_numpy(np.float64) if test.trials else np.ones(len(rows))
        good, of = _scaled(rows, metric) * trials, metric
    keys = _keys(rows, CELL)
    sums, counts = (_reduced(keys, values, "sum") for values in (good, trials))
    kept = [key for key, count in counts.items() if count > 0]
    return [sums[key] for key in kept], [counts[key] for key in kept], of


def _near_best(test: kinds.BestTest, values: Sequence[Values]) -> list[float]:
    """Return for each scene whether ours is nowhere behind the best of the others."""
    ours, *others = values
    near: dict[Key, bool] = {}
    for key, value in ours.items():
        known = [other[key] for other in others if key in other]
        behind = np.fmax.reduce(known) - value if len(known) == len(others) else np.nan
        if not np.isnan(behind):
            near[key[:2]] = near.get(key[:2], True) and -behind >= -test.margin
    return [float(one) for one in near.values()]


def _margin(sides: Sides, test: kinds.Comparison, metric: str) -> float:
    """The margin in the metric's unit: of errors it is a share of the worse side's mean."""
    if not metric.startswith(kinds.ERRORS):
        return test.margin
    mean = pd.Series(_values(sides[1], test, metric).values()).mean()
    return test.margin * float(mean) if np.isfinite(mean) else test.margin


def _differences(sides: Sides, test: kinds.Comparison, metric: str) -> Values:
    """Return better less worse by cell; lights and the like of a cell are compared one by one."""
    better, worse = (_values(side, test, metric) for side in sides)
    sign = -1.0 if metric.startswith(kinds.ERRORS) else 1.0
    pairs = {key: sign * (value - worse[key]) for key, value in better.items() if key in worse}
    known = {key: value for key, value in pairs.items() if not isnan(value)}
    return _reduced([key[:2] for key in known], np.array([*known.values()], np.float64), "mean")


def _values(runs: pd.DataFrame, test: kinds.CellTest, metric: str) -> Values:
    """Means over repetitions, by cell and what else tells runs apart."""
    named = {column for limits in (test.where, *test.groups.values()) for column in limits}
    if isinstance(test, kinds.InteractionTest):
        named |= set(test.against)
    told = {"light"}.intersection(runs)  # which tables beside the scores need not say
    keys = [*CELL, *sorted(told | named.difference(CELL))]
    return _reduced(_keys(runs, keys), _scaled(runs, metric), "mean")


def _scaled(runs: pd.DataFrame, metric: str) -> NDArray[np.float64]:
    """A metric as it is judged: counts as shares of the length."""
    values = runs[metric].to_numpy(np.float64)
    return values / runs["frames"].to_numpy(np.float64) if metric in kinds.COUNTS else values


def _keys(runs: pd.DataFrame, columns: Sequence[str]) -> list[Key]:
    """What stands in these columns of each row."""
    return list(zip(*(runs[column].tolist() for column in columns), strict=True))


def _reduced(
    keys: Sequence[Key], values: NDArray[np.float64], how: Literal["mean", "sum"]
) -> Values:
    """Mean or sum of the known values of each key, in the keys' order; not of keys with gaps.

    A test has few rows and is judged under many readings: to have pandas sort them out by several
    columns takes longer than all else.
    """
    whole = {key for key in keys if not any(part is None or part != part for part in key)}
    places = {key: place for place, key in enumerate(sorted(whole, key=_numbers_first))}
    place_of_row = np.array([places.get(key, -1) for key in keys], np.int64)
    values, rows = values[place_of_row >= 0], place_of_row[place_of_row >= 0]
    if np.bincount(rows).max(initial=0) > 2:
        found = pd.Series(values).groupby(rows).agg(how).to_numpy()
    else:  # in whatever order two numbers are added
        known = ~np.isnan(values)
        found = np.bincount(rows[known], values[known], len(places))
        if how == "mean":
            counts = np.bincount(rows[known], minlength=len(places))
            found = np.divide(found, counts, out=np.full(len(places), nan), where=counts > 0)
    return dict(zip(places, found.tolist(), strict=True))


def _numbers_first(key: Key) -> list[tuple[bool, Any]]:
    """Sorts labels of which some are numbers and some are texts."""
    return [(isinstance(part, str), part) for part in key]
