"""A test's verdict on the rows of its sides."""

from collections.abc import Sequence
from dataclasses import replace
from math import isnan, nan
from typing import Any, Literal
from zlib import crc32

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.claims import kinds
from bench.claims.ledger import Claim
from bench.claims.readings import in_words
from bench.claims.sides import limited
from bench.statistics.intervals import Interval
from bench.statistics.outcomes import LEAST_CELLS, Verdict, check, conjunction, undecided
from bench.statistics.verdicts import (
    above,
    all_kept,
    equal,
    no_worse,
    number,
    order,
    order_of_groups,
    ratio_above,
    share_at_least,
)

__all__ = ["CELL", "in_units", "verdict_of"]

CELL = ["sequence", "scene"]

Sides = Sequence[pd.DataFrame]
"""Rows of each side of a test, in its own order."""

Key = tuple[object, ...]

Values = dict[Key, float]
"""A number by cell and what else tells runs apart, in their order."""


def verdict_of(claim: str, test: kinds.PartTest, sides: Sides, metric: str) -> Verdict:
    """Verdict on the cells of these rows, of each side under one reading, by one metric.

    Random numbers come from the claim's id: the same scores give the same verdict.
    """
    if isinstance(test, kinds.BoundTest):
        return _bound(test, sides[0])
    if isinstance(test, kinds.RatioTest):
        return ratio_above(sides[0][test.longer], sides[0][test.shorter], test.least)
    if isinstance(test, kinds.NoWorseTest):
        both = set.intersection(*(set(side["repetition"]) for side in sides))
        sides = [side[side["repetition"].isin(both)] for side in sides]
    if isinstance(test, kinds.InteractionTest):
        generator = np.random.default_rng(crc32(claim.encode()))
        first = [limited(side[side["sequence"].isin(test.on)], test.where) for side in sides]
        second = [limited(side, test.against) for side in sides]
        groups = [_differences(part, test, metric) for part in (first, second)]
        return order_of_groups(groups[0], groups[1], generator, _margin(sides, test, metric))
    if isinstance(test, kinds.Comparison):
        return _compared(test, sides, metric)
    if isinstance(test, kinds.BestTest):
        return _best(test, [_values(side, test, metric) for side in sides])
    if isinstance(test, kinds.NumberTest):
        values = _scaled(sides[0], metric)
        values = values[~np.isnan(values)]
        if len(values) < 2:
            return undecided("fewer than two runs.")
        return number(values, most=1.0 if metric in kinds.COUNTS else test.most.get(metric))
    if isinstance(test, kinds.ShareTest):
        return _share(test, sides[0], metric)
    return _kept(test, sides[0])


def in_units(claim: Claim, test: kinds.PartTest, metric: str, verdict: Verdict) -> Verdict:
    """The verdict with what was estimated, its unit, and the unit of repetition."""
    of, unit = metric, "px" if metric.startswith(kinds.IN_PIXELS) else ""
    if isinstance(test, kinds.BoundTest):
        of = test.metric
    elif isinstance(test, kinds.RatioTest):
        of, unit = f"{test.longer} to {test.shorter}", verdict.unit
    elif isinstance(test, kinds.AllTest | kinds.LostTest):
        of, unit = "lost" if isinstance(test, kinds.LostTest) else "never lost", "of the runs"
    elif isinstance(test, kinds.ShareTest) and metric not in kinds.COUNTS:
        unit = f"of the {test.trials}".replace("_", " ") if test.trials else verdict.unit
    elif isinstance(test, kinds.BestTest):
        unit = "of the scenes"
    elif metric in kinds.COUNTS:
        unit = "of the frames"
    interval = verdict.interval
    if metric in kinds.COUNTS:  # differences of shares, or of these differences
        most = 2.0 if isinstance(test, kinds.InteractionTest) else 1.0
        interval = Interval(max(interval.low, -most), min(interval.high, most))
    return replace(
        verdict,
        interval=interval,
        of=in_words(of),
        unit=claim.units.get(of, unit),
        counted=claim.cells.get(test.table, test.counted),
    )


def _compared(
    test: kinds.OrderTest | kinds.EqualTest | kinds.NoWorseTest, sides: Sides, metric: str
) -> Verdict:
    differences, margin = _differences(sides, test, metric), _margin(sides, test, metric)
    if isinstance(test, kinds.EqualTest):
        return equal(differences, margin)
    if isinstance(test, kinds.NoWorseTest):
        return no_worse(differences, margin)
    verdict = order(differences, margin)
    for column, least in test.needs.items():
        share = float(sides[0][column].mean())
        words = f"{column.replace('_', ' ')} {100 * share:.1f} %"
        if not share >= least:
            return undecided(f"there is nothing to compare: {words}.")
        verdict = replace(verdict, reason=f"{verdict.reason.removesuffix('.')}; {words}.")
    return verdict


def _best(test: kinds.BestTest, values: Sequence[Values]) -> Verdict:
    """In which cells ours is nowhere behind the best of the others."""
    ours, *others = values
    near: dict[Key, bool] = {}
    for key, value in ours.items():
        known = [other[key] for other in others if key in other]
        behind = np.fmax.reduce(known) - value if len(known) == len(others) else np.nan
        if not np.isnan(behind):
            near[key[:2]] = near.get(key[:2], True) and -behind >= -test.margin
    return share_at_least(list(near.values()), np.ones(len(near)), test.least, test.lower)


def _kept(test: kinds.AllTest | kinds.LostTest, runs: pd.DataFrame) -> Verdict:
    flags = np.asarray(runs["first_loss"] >= runs["frames"], np.float64)
    kept, every = _sums(runs, flags), _sums(runs, np.ones(len(runs)))
    if isinstance(test, kinds.LostTest):
        return share_at_least(every - kept, every, test.share)
    return all_kept(kept, every)


def _share(test: kinds.ShareTest, runs: pd.DataFrame, metric: str) -> Verdict:
    """Rows without a value were no trial: what is asked did not arise in them."""
    runs = runs[runs[metric].notna()]
    trials = runs[test.trials].to_numpy(np.float64) if test.trials else np.ones(len(runs))
    good = _scaled(runs, metric) * trials
    verdict = share_at_least(_sums(runs, good), _sums(runs, trials), test.least, test.lower)
    if test.table == kinds.SCORES and set(runs[metric].tolist()) <= {0.0, 1.0}:
        verdict = replace(verdict, unit="of the runs")  # a yes or no each; others are shares of it
    if metric not in kinds.COUNTS or verdict.cells < LEAST_CELLS:
        return verdict
    words = f"{100 * verdict.statistic:.1f} % of the length on average over {verdict.cells} cells."
    return replace(verdict, reason=words)


def _sums(runs: pd.DataFrame, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sum of a value a run in each cell."""
    return np.array([*_reduced(_keys(runs, CELL), values, "sum").values()])


def _bound(test: kinds.BoundTest, rows: pd.DataFrame) -> Verdict:
    sign = 1.0 if test.least is not None else -1.0  # so that more is better
    limit = sign * float(test.least if test.least is not None else test.most or 0.0)
    low_name, high_name = test.interval or (test.metric, test.metric)
    if sign < 0:
        low_name, high_name = high_name, low_name
    low, high = (sign * rows[name].to_numpy(np.float64) for name in (low_name, high_name))
    words, against = in_words(test.metric), f"to be compared with {sign * limit:g}."
    if test.interval is None:
        worst = int(low.argmin())
        value = float(rows[test.metric].iloc[worst])
        reason = f"the {'least' if sign > 0 else 'greatest'} {words} is {value:.3g}, {against}"
        return check(bool(low[worst] >= limit), value, reason, len(rows))
    values = sign * rows[test.metric].to_numpy(np.float64)
    found = [
        above(value, Interval(*ends), limit, int(degrees) + 1, "")
        for value, *ends, degrees in zip(
            values.tolist(), low.tolist(), high.tolist(), rows[kinds.DEGREES].tolist(), strict=True
        )
    ]
    whole = conjunction(found, [f"row {place}" for place in range(len(found))], "")
    value, ends = sign * whole.statistic, sorted(sign * end for end in whole.interval)
    words += f" of the row that decides, of {len(rows)}," if len(rows) > 1 else ""
    reason = f"the {words} is {value:.3g} (95 %: {ends[0]:.3g} to {ends[1]:.3g}), {against}"
    return replace(
        whole,
        statistic=value,
        interval=Interval(*ends),
        cells=len(rows),
        reason=f"{reason}{whole.reason}",
    )


def _margin(sides: Sides, test: kinds.Comparison, metric: str) -> float:
    """The margin in the metric's unit: of errors it is a share of the worse side's mean."""
    if not metric.startswith(kinds.ERRORS):
        return test.margin
    mean = pd.Series(_values(sides[1], test, metric).values()).mean()
    return test.margin * float(mean) if np.isfinite(mean) else test.margin


def _differences(sides: Sides, test: kinds.Comparison, metric: str) -> NDArray[np.float64]:
    """Better less worse by cell; lights and the like of a cell are compared one by one."""
    better, worse = (_values(side, test, metric) for side in sides)
    differences = {key: value - worse[key] for key, value in better.items() if key in worse}
    known = {key: value for key, value in differences.items() if not isnan(value)}
    cells = _reduced([key[:2] for key in known], np.array([*known.values()], np.float64), "mean")
    pairs = np.array([*cells.values()], np.float64)
    return -pairs if metric.startswith(kinds.ERRORS) else pairs


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
