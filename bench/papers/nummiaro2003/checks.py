"""Tests that the ledger can't say: when the model is updated, fast frames, time and area."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from bench.claims.findings import Check, Evidence, Finding
from bench.claims.verdicts import CELL
from bench.statistics.correlation import rank_correlation as correlation
from bench.statistics.verdict_rules import Verdict, conjunction, order

__all__ = ["CHECKS"]

UPDATING = "nummiaro2003:model_update=true:reinitialise=true"


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
        reserve = follows["good_updates"] / follows["good_frames"] - evidence.setting("least")
        parts = {
            "odds": partial(_odds, cells, evidence.setting("odds")),
            "updates in good frames": partial(order, reserve, 0.0),
        }
        verdict = conjunction(parts, evidence.comparisons)
        reason = (
            f"{verdict.reason}; updates in {100 * good_updates / good:.1f} % of the good frames "
            f"and {100 * other_updates / other:.1f} % of {other:.0f} others (while tracking; "
            f"{100 * other_updates / (other + waiting):.1f} % of the others with the "
            f"{waiting:.0f} in which it initialises)"
        )
        found.append(finding(verdict=replace(verdict, reason=reason)))
    return found


def fast_frames(evidence: Evidence) -> list[Finding]:
    """The centre is inside in fast frames nearly as often as in the others."""
    found = []
    for finding, runs in _updating(evidence):
        known = runs.dropna(subset=["inside_fast", "inside_otherwise"])
        reserve = known["inside_fast"] - evidence.setting("least") * known["inside_otherwise"]
        by_cell = reserve.groupby([known[key] for key in CELL]).mean()
        of = f"fast frames less {evidence.setting('least'):g} of the others"
        verdict = order(by_cell, 0.0, evidence.comparisons, limit=1.0)
        found.append(finding(verdict=replace(verdict, of=of)))
    return found


def rank_correlation(evidence: Evidence) -> list[Finding]:
    """Judge whether two columns of a table of frames rise together on each sequence."""
    (name,), (first,), (second,) = map(evidence.names, ("table", "first", "second"))
    table = evidence.tables.get(name)
    if table is None or not {*evidence.names("on")} <= {*table["sequence"]}:
        return []
    if table[[first, second]].isna().any(axis=None):
        return []
    least = evidence.setting("least")
    reserve = [
        correlation(rows[first], rows[second])[0] - least for _, rows in table.groupby("sequence")
    ]
    verdict = order(reserve, 0.0, evidence.comparisons, limit=1.0, counted="sequence")
    of = f"rank correlation of {first} and {second} less {least:g}"
    return [Finding(evidence.claim.id, replace(verdict, of=of))]


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


def _odds(cells: pd.DataFrame, least: float, comparisons: int) -> Verdict:
    """Judge each scene's log odds of an update in good frames, less those in others.

    Half an update is added to each count, so that the odds are finite.
    """
    both = cells[(cells["good_frames"] > 0) & (cells["other_frames"] > 0)]
    good, other = (
        np.log(both[updates] + 0.5) - np.log(both[frames] - both[updates] + 0.5)
        for updates, frames in (("good_updates", "good_frames"), ("other_updates", "other_frames"))
    )
    verdict = order(good - other - np.log(least), 0.0, comparisons)
    return replace(verdict, unit=f"log odds ratio less log {least:g}")
