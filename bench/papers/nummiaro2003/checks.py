"""Tests that the ledger can't say: when the model is updated, fast frames, time and area."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from math import log
from typing import Any

import numpy as np
import pandas as pd

from bench.claims.findings import Check, Evidence, Finding
from bench.claims.verdicts import CELL
from bench.statistics.correlation import rank_correlation as correlation
from bench.statistics.intervals import Interval, odds_ratio
from bench.statistics.verdicts import (
    LEAST_CELLS,
    NOWHERE,
    Verdict,
    above,
    conjunction,
    order,
    share_at_least,
    too_few,
    undecided,
)

__all__ = ["CHECKS"]

UPDATING = "nummiaro2003:model_update=true:reinitialise=true"
STRETCH, RESAMPLES = 20, 1000  # frames that are alike in time and area; of such stretches


def update_condition(evidence: Evidence) -> list[Finding]:
    """While tracking, the model is updated in good frames, and hardly ever in others."""
    names = ("good_frames", "good_updates", "other_frames", "other_updates", "waiting_frames")
    found = []
    for finding, runs in _updating(evidence):
        cells = runs.groupby(CELL)[[*names]].sum()
        good, good_updates, other, other_updates, waiting = cells.sum().tolist()
        if not good or not other:
            continue
        follows = cells[cells["good_frames"] > 0]
        share = share_at_least(
            follows["good_updates"], follows["good_frames"], evidence.setting("least")
        )
        parts = [_odds(cells[[*names[:4]]], evidence), replace(share, unit="of the good frames")]
        reason = (
            f"updates in {100 * good_updates / good:.1f} % of the good frames and "
            f"{100 * other_updates / other:.1f} % of {other:.0f} others, which "
            f"{(cells['other_frames'] > 0).sum()} scenes have; odds to be compared with "
            f"{evidence.setting('odds'):g} (while tracking; "
            f"{100 * other_updates / (other + waiting):.1f} % of the others with the "
            f"{waiting:.0f} in which it initialises)."
        )
        verdict = conjunction(parts, ["ratio of odds", "updates in good frames"], reason)
        found.append(finding(verdict=verdict))
    return found


def fast_frames(evidence: Evidence) -> list[Finding]:
    """The centre is inside in fast frames nearly as often as in the others."""
    found = []
    for finding, runs in _updating(evidence):
        known = runs.dropna(subset=["inside_fast", "inside_otherwise"])
        reserve = known["inside_fast"] - evidence.setting("least") * known["inside_otherwise"]
        by_cell = reserve.groupby([known[key] for key in CELL]).mean()
        of = f"fast frames less {evidence.setting('least'):g} of the others"
        found.append(finding(verdict=replace(order(by_cell, margin=0.0), of=of)))
    return found


def rank_correlation(evidence: Evidence) -> list[Finding]:
    """Two columns of a table of frames rise together; stretches of frames are drawn anew."""
    (name,), (first,), (second,) = map(evidence.names, ("table", "first", "second"))
    table = evidence.tables.get(name)
    if table is None or not {*evidence.names("on")} <= {*table["sequence"]}:
        return []
    if table[[first, second]].isna().any(axis=None):
        return []
    value, _ = correlation(table[first], table[second])
    places = [table["sequence"], table["frame"] // STRETCH]
    stretches = [rows[[first, second]].to_numpy() for _, rows in table.groupby(places)]
    if len(stretches) < LEAST_CELLS:
        return [Finding(evidence.claim.id, undecided(too_few(len(stretches))))]
    generator = np.random.default_rng(0)
    drawn = generator.integers(len(stretches), size=(RESAMPLES, len(stretches)))
    samples = [np.concatenate([stretches[one] for one in row]) for row in drawn]
    low, high = np.quantile([correlation(*sample.T)[0] for sample in samples], [0.025, 0.975])
    least = evidence.setting("least")
    words = (
        f"rank correlation of {first} and {second} {value:.3f} (95 %: {low:.3f} to {high:.3f}), to "
        f"be compared with {least:g}."
    )
    found = above(value, Interval(low, high), least, len(stretches), words)
    return [Finding(evidence.claim.id, replace(found, counted="section"))]


CHECKS: Mapping[str, Check] = {
    "update-condition": update_condition,
    "fast-frames": fast_frames,
    "rank-correlation": rank_correlation,
}
"""By the name that the ledger gives."""


def _updating(evidence: Evidence) -> Iterator[tuple[Any, pd.DataFrame]]:
    """Runs with model update and with re-initialisation, by reading."""
    for finding, (runs,) in evidence.by_reading(evidence.scores, [UPDATING], evidence.names("on")):
        if len(runs):
            yield finding, runs


def _odds(cells: pd.DataFrame, evidence: Evidence) -> Verdict:
    """Whether updates are so many times as likely in good frames, by counts a cell."""
    odds, around = odds_ratio(*cells.to_numpy(np.float64).T)
    of_both, limit = int((cells["other_frames"] > 0).sum()), evidence.setting("odds")
    if of_both < LEAST_CELLS:
        return Verdict("undecided", odds, NOWHERE, len(cells), too_few(of_both))
    found = above(log(odds), Interval(*map(log, around)), log(limit), of_both, "")
    return replace(found, statistic=odds, interval=around, cells=len(cells))
