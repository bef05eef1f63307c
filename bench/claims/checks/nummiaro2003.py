"""Checks of the paper on an adaptive colour-based particle filter.

Of the scores they read `good_frames`, `good_updates`, `other_frames`, `other_updates` (counts, of
the frames in which it tracks, as it is never updated in those in which it initialises: half of the
target is visible and the centre is inside, the others, and those of either in which the model was
updated), `waiting_frames` (others in which it initialises), `inside_fast` and `inside_otherwise`
(shares). Beside them, the table that a setting names.
"""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from bench.claims.checks.runs import runs_by_reading
from bench.claims.findings import Check, Evidence, Finding
from bench.claims.measuring import CELL
from bench.statistics.verdicts import check, order

__all__ = ["CHECKS"]

_HALF = 0.5  # added to every count, so that odds are finite


def update_condition(evidence: Evidence) -> list[Finding]:
    """While tracking, the model is updated in good frames, and hardly ever in others."""
    found = []
    updating = _updating(evidence.scores)
    for finding, runs in runs_by_reading(evidence, updating, "sequences"):
        good, good_updates, other, other_updates, waiting = (
            float(runs[name].sum())
            for name in (
                *("good_frames", "good_updates", "other_frames", "other_updates"),
                "waiting_frames",
            )
        )
        if not good or not other:
            continue
        odds = _odds(good_updates, good) / _odds(other_updates, other)
        share = good_updates / good
        reason = (
            f"updates in {100 * share:.1f} % of the good frames and "
            f"{100 * other_updates / other:.1f} % of {other:.0f} others, a ratio of odds of "
            f"{odds:.2f} (while tracking; {100 * other_updates / (other + waiting):.1f} % of the "
            f"others with the {waiting:.0f} in which it initialises)."
        )
        passed = odds > evidence.setting("odds") and share > evidence.setting("least")
        found.append(finding(verdict=check(passed, odds, reason, len(runs))))
    return found


def fast_frames(evidence: Evidence) -> list[Finding]:
    """The centre is inside in fast frames nearly as often as in the others."""
    least = evidence.setting("least")
    found = []
    for finding, runs in runs_by_reading(evidence, _updating(evidence.scores), "sequences"):
        known = runs.dropna(subset=["inside_fast", "inside_otherwise"])
        keys = [known[key] for key in CELL]
        reserve = (known["inside_fast"] - least * known["inside_otherwise"]).groupby(keys).mean()
        found.append(finding(verdict=order(reserve, margin=0.0)))
    return found


def rank_correlation(evidence: Evidence) -> list[Finding]:
    """Two columns of a table rise together."""
    (name,), (first,), (second,) = map(evidence.names, ("table", "first", "second"))
    table = evidence.tables.get(name)
    if table is None:
        return []
    value = float(table[first].corr(table[second], method="spearman"))
    if not np.isfinite(value):
        return []
    least = evidence.setting("least")
    words = f"rank correlation of {first} and {second} {value:.3f}, to be compared with {least:g}."
    return [Finding(evidence.claim.id, check(value > least, value, words, len(table)))]


CHECKS: Mapping[str, Check] = {
    "update-condition": update_condition,
    "fast-frames": fast_frames,
    "rank-correlation": rank_correlation,
}
"""By the name that the ledger gives."""


def _updating(scores: pd.DataFrame) -> pd.DataFrame:
    """Runs of the paper's tracker with model update, and with re-initialisation."""
    chosen = (scores["tracker"] == "nummiaro2003") & (scores["update"] == "with")
    return scores[chosen & (scores["reinitialisation"] == "with")]


def _odds(successes: float, trials: float) -> float:
    return (successes + _HALF) / (trials - successes + _HALF)
