"""Tests of claims: each judges one value per scene (`Evidence`) by a rule of `verdict_rules`."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import inf, nan

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from trackmark.bench.papers.claims import Claim
from trackmark.bench.statistics.intervals import Interval
from trackmark.bench.statistics.verdict_rules import (
    Verdict,
    conjunction,
    inconclusive,
    no_worse,
    number,
    order,
    share,
    success,
    time,
)

FLOOR = 0.5  # minimum share of scenes in which a reference keeps the target

Values = NDArray[np.float64]


@dataclass(frozen=True)
class Evidence:
    """Values from which a claim is judged in one setting.

    Attributes
    ----------
    first, second : DataFrame
        One row per sequence, scene and tracker: `sequence`, `rank` (index of the scene, from 0),
        `tracker`, `value` (mean over repetitions). `first` contains the trackers of `better` or
        `trackers`, or values of a measure of scenes. `second` contains those of `worse`.
    lower_is_better : bool
        True if smaller values are better.
    largest : float
        Largest possible absolute difference.
    unit, unit_noun : str
        Unit of the values; name of a statistical unit, in the singular.
    reference_kept : float
        Share of the scenes in which the trackers of `second` keep the target; NaN if unknown.
    lost_before : float
        Share of the scenes in which the target is lost before the event; NaN without an event.
    failed : str
        Sentence on failed runs; empty if none failed.
    times : sequence of pairs of arrays
        For tests of time: longer and shorter times, or times and an empty array. The pair with the
        smallest ratio decides.
    """

    first: pd.DataFrame = field(default_factory=pd.DataFrame)
    second: pd.DataFrame = field(default_factory=pd.DataFrame)
    lower_is_better: bool = False
    largest: float = inf
    unit: str = ""
    unit_noun: str = "scene"
    reference_kept: float = nan
    lost_before: float = nan
    failed: str = ""
    times: Sequence[tuple[Values, Values]] = ()


def judge(claim: Claim, evidence: Evidence) -> Verdict:  # name: claims are judged
    """Return the verdict on a claim in one setting."""
    if claim.test == "time":
        return _judge_time(claim, evidence)
    if evidence.first.empty or (claim.worse and evidence.second.empty):
        return inconclusive("no runs")
    if claim.test == "share":
        verdict = share(_succeeded(evidence.first))
    elif claim.test == "number":
        verdict = number(_by_scene(evidence.first, hardest="").to_numpy())
    else:
        verdict = _judge_differences(claim, evidence)
    return replace(verdict, unit=evidence.unit, counted=evidence.unit_noun)


def notes(evidence: Evidence) -> list[str]:
    """Return remarks that limit a verdict."""
    remarks = []
    if evidence.lost_before > FLOOR:
        remarks.append(f"lost before the event in {100 * evidence.lost_before:.0f} % of the scenes")
    if evidence.reference_kept <= FLOOR:
        remarks.append(_floor(evidence))
    return [*remarks, evidence.failed] if evidence.failed else remarks


def scene_differences(claim: Claim, evidence: Evidence) -> "pd.Series[float]":
    """Return better minus worse by sequence and scene; positive values support the claim."""
    sign = -1.0 if evidence.lower_is_better else 1.0
    first = sign * _by_scene(evidence.first, "min", sign)
    if not claim.worse:
        return sign * first  # values of the measure are differences
    differences: pd.Series[float] = first - sign * _by_scene(evidence.second, "max", sign)
    return differences.dropna()


def _judge_differences(claim: Claim, evidence: Evidence) -> Verdict:  # name: claims are judged
    values, margin = scene_differences(claim, evidence).to_numpy(), claim.margin or 0.0
    limit = evidence.largest
    if claim.test == "order":
        return order(values, margin, limit=limit)
    if claim.test == "no-worse both ways":
        verdict = conjunction(
            {
                f"{claim.better[0].name} not worse": lambda m: no_worse(
                    values, margin, m, limit=limit
                ),
                f"{claim.worse[0].name} not worse": lambda m: no_worse(
                    -values, margin, m, limit=limit
                ),
            }
        )
    else:
        verdict = no_worse(values, margin, limit=limit)
    if verdict.verdict == "holds" and evidence.reference_kept <= FLOOR:
        # If both trackers fail, their equality is no evidence.
        return replace(verdict, verdict="inconclusive", reason=_floor(evidence))
    return verdict


def _floor(evidence: Evidence) -> str:
    return f"the reference keeps the target in {100 * evidence.reference_kept:.0f} % of the scenes"


def _judge_time(claim: Claim, evidence: Evidence) -> Verdict:  # name: claims are judged
    if not evidence.times:
        return inconclusive("no times")
    if claim.limit is not None and evidence.unit:
        (values, _), *_ = evidence.times
        below = time(np.full(len(values), claim.limit), values)
        low, high = below.interval
        interval = Interval(claim.limit / high, claim.limit / low)
        value = claim.limit / below.statistic
        reason = below.reason.replace("above 1", f"below {claim.limit:g} {evidence.unit}")
        reason = reason.replace("below 1", f"above {claim.limit:g} {evidence.unit}")
        return replace(below, statistic=value, interval=interval, unit=evidence.unit, reason=reason)
    ratios = [float(np.mean(np.log(longer / shorter))) for longer, shorter in evidence.times]
    longer, shorter = evidence.times[int(np.argmin(ratios))]
    return time(longer, shorter, claim.limit or 1.0)


def _succeeded(table: pd.DataFrame) -> Values:
    """Return the success of each scene: that of its worst sequence and tracker."""
    by_scene = table.assign(value=success(table["value"])).groupby("rank")["value"].min()
    return by_scene.to_numpy(np.float64)


def _by_scene(table: pd.DataFrame, hardest: str, sign: float = 1.0) -> "pd.Series[float]":
    """Return one value per sequence and scene.

    If there are several trackers, the tracker whose mean on the sequence, times `sign`, is smallest
    (`min`) or largest (`max`) is used.
    """
    values_by_sequence: list[pd.Series[float]] = []
    for _, rows in table.groupby("sequence", sort=False):
        means = sign * rows.groupby("tracker", sort=False)["value"].mean()
        tracker = means.idxmax() if hardest == "max" else means.idxmin()
        tracker_rows = rows[rows["tracker"] == tracker]
        values_by_sequence.append(tracker_rows.set_index(["sequence", "rank"])["value"])
    joined: pd.Series[float] = pd.concat(values_by_sequence)
    return joined
