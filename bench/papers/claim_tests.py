"""Tests of claims: each judges one value per scene (`Evidence`) by a rule of `verdict_rules`.

Before a rule applies, the scenes must be able to show the claim. Otherwise the verdict is "not
testable here". The tests are, in this order: problem not posed, equal runs, floor or ceiling, lost
before the event, the rule of the claim, and criteria of the scenes that favour the claim.
"""

from dataclasses import dataclass, field, replace
from math import inf, nan

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from trackmark.bench.papers.claims import Claim
from trackmark.bench.statistics.intervals import Interval, share_interval
from trackmark.bench.statistics.rules import MIN_SCENES
from trackmark.bench.statistics.verdict_rules import (
    CEILING_SHARE,
    FLOOR_SHARE,
    Verdict,
    at_ceiling,
    at_floor,
    conjunction,
    inconclusive,
    kept_interval,
    no_worse,
    order,
    share,
)

HALF = 0.5
"""Share of scenes above which equal runs, or losses before the event, make a claim untestable."""

FLOOR_UNITS = ("share", "frames", "overlap", "J")
"""Units of measures that show nothing if every tracker loses the target."""

CEILING_UNITS = ("share", "frames")
"""Units of measures that show nothing if both sides keep the target. An accuracy still does."""

BY_CONSTRUCTION = "a criterion of the scenes uses this result"

Values = NDArray[np.float64]


@dataclass(frozen=True)
class Evidence:
    """Values from which a claim is judged in one setting.

    Attributes
    ----------
    first, second : DataFrame
        One row per sequence, scene and tracker: `sequence`, `rank` (index of the scene, from 0),
        `tracker`, `value`. `first` contains the trackers of `better` or
        `trackers`, or values of a measure of scenes. `second` contains those of `worse`.
    kept_first, kept_second : DataFrame
        Tables of the same form: 1 if a scene is kept, else 0, or the kept share of the members of a
        set; empty if floor and ceiling do not apply.
    lower_is_better : bool
        True if smaller values are better.
    largest : float
        Largest possible absolute difference.
    unit, unit_noun : str
        Unit of the values; name of a statistical unit, in the singular.
    lost_before : array
        1 if the target is lost before the event, else 0, by scene; empty without an event.
    equal_runs : float
        Share of the scenes in which the compared trackers have equal boxes; NaN if unknown.
    not_posed : str
        Sentence on scenes that seldom meet the criteria of difficulty; empty if they meet them.
    favoured : bool
        True if a criterion of the scenes uses the result that the claim states.
    failed : str
        Sentence on failed runs; empty if none failed.
    """

    first: pd.DataFrame = field(default_factory=pd.DataFrame)
    second: pd.DataFrame = field(default_factory=pd.DataFrame)
    kept_first: pd.DataFrame = field(default_factory=pd.DataFrame)
    kept_second: pd.DataFrame = field(default_factory=pd.DataFrame)
    lower_is_better: bool = False
    largest: float = inf
    unit: str = ""
    unit_noun: str = "scene"
    lost_before: Values = field(default_factory=lambda: np.zeros(0))
    equal_runs: float = nan
    not_posed: str = ""
    favoured: bool = False
    failed: str = ""


def judge(claim: Claim, evidence: Evidence) -> Verdict:  # name: claims are judged
    """Return the verdict on a claim in one setting."""
    verdict = _judge_by_rule(claim, evidence)
    if reason := _obstacle(claim, evidence):
        return replace(verdict, verdict="not testable here", reason=reason)
    if verdict.verdict == "holds" and evidence.favoured:
        return replace(verdict, verdict="by construction", reason=BY_CONSTRUCTION)
    return verdict


def scene_differences(claim: Claim, evidence: Evidence) -> "pd.Series[float]":
    """Return better minus worse by sequence and scene; positive values support the claim."""
    sign = -1.0 if evidence.lower_is_better else 1.0
    if not claim.worse:
        return _by_scene(evidence.first)  # values of the measure are differences
    first, second = (_by_scene(table) for table in _chosen_sides(evidence))
    differences: pd.Series[float] = sign * (first - second)
    return differences.dropna()


def compared_trackers(evidence: Evidence) -> tuple[dict[str, str], dict[str, str]]:
    """Return the trackers of both sides that are compared, by sequence.

    They are the least favourable ones for the claim: the worst of the first side, and the best of
    the second, by their means on the sequence.
    """
    sign = -1.0 if evidence.lower_is_better else 1.0
    return _with_smallest_mean(evidence.first, sign), _with_smallest_mean(evidence.second, -sign)


def _with_smallest_mean(table: pd.DataFrame, sign: float) -> dict[str, str]:
    """Return the tracker whose mean on a sequence, times `sign`, is smallest, by sequence."""
    trackers: dict[str, str] = {}
    for sequence, rows in table.groupby("sequence", sort=False):
        means = sign * rows.groupby("tracker", sort=False)["value"].mean()
        trackers[str(sequence)] = str(means.idxmin())
    return trackers


def _judge_by_rule(claim: Claim, evidence: Evidence) -> Verdict:  # name: claims are judged
    """Return the verdict by the rule of the claim's test alone."""
    if evidence.first.empty or (claim.worse and evidence.second.empty):
        return inconclusive("no runs")
    if claim.test == "share":
        verdict = share(_succeeded(evidence.first))
    else:
        verdict = _judge_differences(claim, evidence)
    return replace(verdict, unit=claim.unit or evidence.unit, counted=evidence.unit_noun)


def _judge_differences(claim: Claim, evidence: Evidence) -> Verdict:  # name: claims are judged
    values, margin = scene_differences(claim, evidence).to_numpy(), claim.margin or 0.0
    limit = evidence.largest
    if claim.test == "order":
        return order(values, margin, limit=limit)
    if claim.test == "no-worse":
        return no_worse(values, margin, limit=limit)
    return conjunction(
        {
            f"{claim.better[0].name} not worse": lambda m: no_worse(values, margin, m, limit=limit),
            f"{claim.worse[0].name} not worse": lambda m: no_worse(-values, margin, m, limit=limit),
        }
    )


def _obstacle(claim: Claim, evidence: Evidence) -> str:
    """Return why the scenes cannot show the claim; empty if they can."""
    if evidence.not_posed:
        return f"problem not posed: {evidence.not_posed}"
    if claim.test == "order" and evidence.equal_runs > HALF:
        return f"equal boxes in {100 * evidence.equal_runs:.0f} % of the scenes"
    return _floor_or_ceiling(claim, evidence) or _lost_before(evidence.lost_before)


def _floor_or_ceiling(claim: Claim, evidence: Evidence) -> str:
    """Return why the kept targets leave no room for a difference; empty if there is room."""
    tables = evidence.kept_first, evidence.kept_second
    if any(table.empty for table in tables):
        return ""
    sides = [
        _interval(_of_trackers(table, chosen), evidence)
        for table, chosen in zip(tables, compared_trackers(evidence), strict=True)
    ]
    if claim.test == "no-worse":
        name, able = "the reference keeps", sides[1:]
    else:
        of_trackers = [rows for table in tables for _, rows in table.groupby("tracker")]
        name, able = "all keep", [_interval(rows, evidence) for rows in of_trackers]
    if evidence.unit in FLOOR_UNITS and at_floor(able):
        return f"floor: {name} less than {100 * FLOOR_SHARE:.0f} %"
    if evidence.unit in CEILING_UNITS and at_ceiling(sides):
        return f"ceiling: both sides keep more than {100 * CEILING_SHARE:.0f} %"
    return ""


def _interval(kept_shares: pd.DataFrame, evidence: Evidence) -> Interval:
    return kept_interval(kept_shares["value"].to_numpy(), sets=evidence.unit_noun == "set")


def _lost_before(lost: Values) -> str:
    """Return the reason if most runs lose the target before the event; empty otherwise."""
    if len(lost) < MIN_SCENES or share_interval(float(lost.sum()), len(lost)).low <= HALF:
        return ""
    return f"lost before the event in {lost.sum():g} of {len(lost)} scenes"


def _succeeded(table: pd.DataFrame) -> Values:
    """Return the success of each scene: that of its worst sequence and tracker."""
    return table.groupby("rank")["value"].min().to_numpy(np.float64)


def _chosen_sides(evidence: Evidence) -> list[pd.DataFrame]:
    sides = (evidence.first, evidence.second)
    return [
        _of_trackers(table, chosen)
        for table, chosen in zip(sides, compared_trackers(evidence), strict=True)
    ]


def _of_trackers(table: pd.DataFrame, trackers: dict[str, str]) -> pd.DataFrame:
    """Return the rows of one tracker per sequence."""
    return table[table["tracker"] == table["sequence"].map(trackers)]


def _by_scene(table: pd.DataFrame) -> "pd.Series[float]":
    values: pd.Series[float] = table.set_index(["sequence", "rank"])["value"]
    return values
