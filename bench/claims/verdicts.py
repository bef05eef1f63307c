"""A test's verdict on the rows of its sides."""

from collections.abc import Sequence
from dataclasses import replace
from zlib import crc32

import numpy as np
import pandas as pd

from bench.claims import kinds
from bench.claims.sides import limited
from bench.statistics.verdicts import (
    Verdict,
    all_kept,
    check,
    equal,
    no_worse,
    number,
    order,
    order_of_groups,
    ratio_above,
    share_at_least,
    undecided,
)

__all__ = ["CELL", "verdict_of"]

CELL = ["sequence", "scene"]

Sides = Sequence[pd.DataFrame]
"""Rows of each side of a test, in its own order."""


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
        ours, *others = (_values(side, test, metric) for side in sides)
        best = pd.concat(others, axis=1, join="inner").max(axis=1)
        near = (ours - best).dropna() >= -test.margin
        near = near.groupby(CELL).mean() == 1.0
        return share_at_least(near, np.ones(len(near)), test.least, test.lower)
    if isinstance(test, kinds.NumberTest):
        shares = _scaled(sides[0], metric).dropna().to_numpy(np.float64)
        return number(shares) if len(shares) > 1 else undecided("fewer than two runs.")
    if isinstance(test, kinds.ShareTest):
        return _share(test, sides[0], metric)
    return _kept(test, sides[0])


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


def _kept(test: kinds.AllTest | kinds.LostTest, runs: pd.DataFrame) -> Verdict:
    kept = (runs["first_loss"] >= runs["frames"]).groupby([runs[key] for key in CELL])
    if isinstance(test, kinds.LostTest):
        return share_at_least(kept.size() - kept.sum(), kept.size(), test.share)
    return all_kept(kept.sum(), kept.size())


def _share(test: kinds.ShareTest, runs: pd.DataFrame, metric: str) -> Verdict:
    """Rows without a value were no trial: what is asked did not arise in them."""
    runs = runs[runs[metric].notna()]
    trials = runs[test.trials] if test.trials else pd.Series(1.0, runs.index)
    keys = [runs[key] for key in CELL]
    good = (runs[metric].astype(np.float64) * trials).groupby(keys).sum()
    return share_at_least(good, trials.groupby(keys).sum(), test.least, test.lower)


def _bound(test: kinds.BoundTest, rows: pd.DataFrame) -> Verdict:
    values = rows[test.metric].to_numpy(np.float64)
    words = test.metric.replace("_", " ")
    if test.least is not None:
        least = float(values.min())
        reason = f"the least {words} is {least:.3g}, to be compared with {test.least:g}."
        return check(least >= test.least, least, reason, len(values))
    most = float(values.max())
    reason = f"the greatest {words} is {most:.3g}, to be compared with {test.most:g}."
    return check(test.most is not None and most <= test.most, most, reason, len(values))


def _margin(sides: Sides, test: kinds.Comparison, metric: str) -> float:
    """The margin in the metric's unit: of errors it is a share of the worse side's mean."""
    if not metric.startswith(kinds.ERRORS):
        return test.margin
    mean = _values(sides[1], test, metric).mean()
    return test.margin * float(mean) if np.isfinite(mean) else test.margin


def _differences(sides: Sides, test: kinds.Comparison, metric: str) -> "pd.Series[float]":
    """Better less worse by cell; lights and the like of a cell are compared one by one."""
    better, worse = (_values(side, test, metric) for side in sides)
    pairs = (better - worse).dropna().groupby(CELL).mean()
    return -pairs if metric.startswith(kinds.ERRORS) else pairs


def _values(runs: pd.DataFrame, test: kinds.CellTest, metric: str) -> "pd.Series[float]":
    """Means over repetitions, by cell and what else tells runs apart."""
    named = {column for limits in (test.where, *test.groups.values()) for column in limits}
    if isinstance(test, kinds.InteractionTest):
        named |= set(test.against)
    told = {"light"}.intersection(runs)  # which tables beside the scores need not say
    keys = [*CELL, *sorted(told | named.difference(CELL))]
    return _scaled(runs, metric).groupby([runs[key] for key in keys]).mean()


def _scaled(runs: pd.DataFrame, metric: str) -> "pd.Series[float]":
    """A metric as it is judged: counts as shares of the length."""
    return (
        runs[metric] / runs["frames"] if metric in kinds.COUNTS else runs[metric].astype(np.float64)
    )
