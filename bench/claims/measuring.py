"""A test's verdict on the rows of one reading."""

from dataclasses import replace
from typing import TypeAlias
from zlib import crc32

import numpy as np
import pandas as pd

from bench.claims.kinds import (
    COUNTS,
    ERRORS,
    AllTest,
    BestTest,
    BoundTest,
    CellTest,
    EqualTest,
    InteractionTest,
    Limits,
    LostTest,
    NoWorseTest,
    NumberTest,
    OrderTest,
    PartTest,
    RatioTest,
    Rows,
    ShareTest,
)
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

__all__ = ["CELL", "limited", "matching", "named_columns", "selections", "verdict_of"]

CELL = ["sequence", "scene"]

_Comparison: TypeAlias = OrderTest | EqualTest | NoWorseTest | InteractionTest


def selections(test: CellTest) -> list[Rows]:
    """The rows that a test compares."""
    if isinstance(test, _Comparison):
        return [test.better, test.worse]
    if isinstance(test, BestTest):
        return [test.rows, *test.others]
    return [test.rows]


def named_columns(test: PartTest) -> list[str]:
    """Columns that a test needs beside those that every table has."""
    named = set(test.where)
    if isinstance(test, BoundTest):
        return sorted(named | {test.metric})
    if isinstance(test, RatioTest):
        return sorted(named | {test.longer, test.shorter})
    named |= {column for limits in test.groups.values() for column in limits}
    named |= {column for rows in selections(test) for column in rows}
    named |= set(test.metrics)
    if isinstance(test, InteractionTest):
        named |= set(test.against)
    if isinstance(test, OrderTest):
        named |= set(test.needs)
    if isinstance(test, ShareTest) and test.trials:
        named.add(test.trials)
    return sorted(named)


def verdict_of(claim: str, test: PartTest, rows: pd.DataFrame, metric: str) -> Verdict:
    """Verdict on the cells of these rows.

    Parameters
    ----------
    claim : str
        Its id, from which random numbers come: the same scores give the same verdict.
    test : PartTest
        What is tested.
    rows : DataFrame
        Of one reading, in whatever cells are meant.
    metric : str
        Which of the test's.
    """
    if isinstance(test, BoundTest):
        return _bound(test, rows)
    if isinstance(test, RatioTest):
        return ratio_above(rows[test.longer], rows[test.shorter], test.least)
    if isinstance(test, OrderTest):
        return _order(test, rows, metric)
    if isinstance(test, EqualTest):
        return equal(_differences(rows, test, metric), _margin(rows, test, metric))
    if isinstance(test, NoWorseTest):
        both = [set(matching(rows, side)["repetition"]) for side in selections(test)]
        rows = rows[rows["repetition"].isin(set.intersection(*both))]
        return no_worse(_differences(rows, test, metric), _margin(rows, test, metric))
    if isinstance(test, InteractionTest):
        generator = np.random.default_rng(crc32(claim.encode()))
        ours = limited(rows[rows["sequence"].isin(test.sequences)], test.where)
        theirs = limited(rows, test.against)
        groups = [_differences(part, test, metric) for part in (ours, theirs)]
        return order_of_groups(groups[0], groups[1], generator, _margin(rows, test, metric))
    if isinstance(test, BestTest):
        others = [_values(rows, test, selection, metric) for selection in test.others]
        best = pd.concat(others, axis=1, join="inner").max(axis=1)
        near = (_values(rows, test, test.rows, metric) - best).dropna() >= -test.margin
        near = near.groupby(CELL).mean() == 1.0
        return share_at_least(near, np.ones(len(near)), test.least, test.lower)
    runs = matching(rows, test.rows)
    if isinstance(test, NumberTest):
        shares = _scaled(runs, metric).dropna().to_numpy(np.float64)
        return number(shares) if len(shares) > 1 else undecided("fewer than two runs.")
    if isinstance(test, ShareTest):
        return _share(test, runs, metric)
    return _kept(test, runs)


def _order(test: OrderTest, rows: pd.DataFrame, metric: str) -> Verdict:
    verdict = order(_differences(rows, test, metric), _margin(rows, test, metric))
    for column, least in test.needs.items():
        share = float(matching(rows, test.better)[column].mean())
        words = f"{column.replace('_', ' ')} {100 * share:.1f} %"
        if not share >= least:
            return undecided(f"there is nothing to compare: {words}.")
        verdict = replace(verdict, reason=f"{verdict.reason.removesuffix('.')}; {words}.")
    return verdict


def _kept(test: AllTest | LostTest, runs: pd.DataFrame) -> Verdict:
    kept = (runs["first_loss"] >= runs["frames"]).groupby([runs[key] for key in CELL])
    if isinstance(test, LostTest):
        return share_at_least(kept.size() - kept.sum(), kept.size(), test.share)
    return all_kept(kept.sum(), kept.size())


def _share(test: ShareTest, runs: pd.DataFrame, metric: str) -> Verdict:
    """Rows without a value were no trial: what is asked did not arise in them."""
    runs = runs[runs[metric].notna()]
    trials = runs[test.trials] if test.trials else pd.Series(1.0, runs.index)
    keys = [runs[key] for key in CELL]
    good = (runs[metric].astype(np.float64) * trials).groupby(keys).sum()
    return share_at_least(good, trials.groupby(keys).sum(), test.least, test.lower)


def _bound(test: BoundTest, rows: pd.DataFrame) -> Verdict:
    values = rows[test.metric].to_numpy(np.float64)
    words = test.metric.replace("_", " ")
    if test.least is not None:
        least = float(values.min())
        reason = f"the least {words} is {least:.3g}, to be compared with {test.least:g}."
        return check(least >= test.least, least, reason, len(values))
    most = float(values.max())
    reason = f"the greatest {words} is {most:.3g}, to be compared with {test.most:g}."
    return check(test.most is not None and most <= test.most, most, reason, len(values))


def _margin(rows: pd.DataFrame, test: _Comparison, metric: str) -> float:
    """The margin in the metric's unit: of errors it is a share of the worse side's mean."""
    if not metric.startswith(ERRORS):
        return test.margin
    mean = _values(rows, test, test.worse, metric).mean()
    return test.margin * float(mean) if np.isfinite(mean) else test.margin


def _differences(rows: pd.DataFrame, test: _Comparison, metric: str) -> "pd.Series[float]":
    """Better less worse by cell; lights and the like of a cell are compared one by one."""
    better = _values(rows, test, test.better, metric)
    pairs = (better - _values(rows, test, test.worse, metric)).dropna().groupby(CELL).mean()
    return -pairs if metric.startswith(ERRORS) else pairs


def _values(rows: pd.DataFrame, test: CellTest, selection: Rows, metric: str) -> "pd.Series[float]":
    """Means over repetitions, by cell and what else tells runs apart."""
    runs = matching(rows, selection)
    named = {column for limits in (test.where, *test.groups.values()) for column in limits}
    if isinstance(test, InteractionTest):
        named |= set(test.against)
    told = {"light"}.intersection(runs)  # which tables beside the scores need not say
    keys = [*CELL, *sorted(told | named.difference(CELL))]
    return _scaled(runs, metric).groupby([runs[key] for key in keys]).mean()


def _scaled(runs: pd.DataFrame, metric: str) -> "pd.Series[float]":
    """A metric as it is judged: counts as shares of the length."""
    return runs[metric] / runs["frames"] if metric in COUNTS else runs[metric].astype(np.float64)


def matching(rows: pd.DataFrame, selection: Rows) -> pd.DataFrame:
    """Rows with these values."""
    return limited(rows, {column: [value] for column, value in selection.items()})


def limited(rows: pd.DataFrame, limits: Limits) -> pd.DataFrame:
    """Rows with one of the values that are let through, in every column."""
    for column, values in limits.items():
        rows = rows[rows[column].isin(values)]
    return rows
