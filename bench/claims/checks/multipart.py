"""Checks of the multi-part paper.

What they read, by the table's name:

- `identity`: a scene a row; `identical` (bool), whether the adaptive run's boxes are, to the
  bit, those of the representation that it picked;
- `layout`: a target a row, its halves swapped; `single`, `multi`: histogram distances;
- `switch`: a first rectangle a row; `sequence`, `initial`, `kept_scene`, `distance` (between its
  halves), `multi_share` (of the rectangles jittered around it that the switch calls multi);
- `times`: a pair of measurements a row; `kernel` ('one pass', 'two calls'), `single`, `multi`
  [seconds];
- `losses`: a run of the adaptive tracker a row, columns of the scores; `near_occlusion` (bool):
  lost within ten frames of an occlusion; `towards`: the circumstances, in a word.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

import numpy as np
import pandas as pd

from bench.claims.checks.runs import labelled, runs_by_reading
from bench.claims.findings import Check, Evidence, Finding
from bench.statistics.separation import auc, error_share, zero_error_thresholds
from bench.statistics.verdicts import (
    all_kept,
    check,
    conjunction,
    no_worse,
    number,
    ratio_above,
)

__all__ = ["CHECKS"]

CELL = ["sequence", "scene"]
AS_SLOW = 0.98  # ratio above which a time is no shorter than the other


def identity(evidence: Evidence) -> list[Finding]:
    """The proposed method is one of the two, to the bit."""
    table = evidence.tables.get("identity")
    if table is None:
        return []
    same = int(table["identical"].sum())
    reason = f"boxes are identical in {same} of {len(table)} scenes."
    return [Finding(evidence.claim.id, check(same == len(table), float(same), reason, len(table)))]


def layout(evidence: Evidence) -> list[Finding]:
    """One histogram does not see swapped halves, two do."""
    table = evidence.tables.get("layout")
    if table is None:
        return []
    blind, sighted = (evidence.setting(key) for key in ("single_below", "multi_above"))
    single, multi = float(table["single"].max()), float(table["multi"].min())
    reason = f"distance after a swap of the halves: single {single:.3f}, multi {multi:.3f}."
    verdict = check(single < blind and multi > sighted, multi, reason, len(table))
    return [Finding(evidence.claim.id, verdict)]


def right_picks(evidence: Evidence) -> list[Finding]:
    """One threshold picks the wanted representation on every sequence."""
    found = []
    for finding, table in _rectangles(evidence):
        wanted = table["sequence"].isin(evidence.names("two_coloured"))
        share = table["multi_share"].where(wanted, 1 - table["multi_share"])
        if share.empty:
            continue
        by_sequence = share.groupby(table["sequence"]).mean()
        worst = str(by_sequence.idxmin())
        least = float(by_sequence.min())
        reason = (
            f"{100 * share.mean():.0f} % of the picks are right, on the worst sequence "
            f"({worst}) {100 * least:.0f} %."
        )
        passed = least >= evidence.setting("least")
        found.append(finding(verdict=check(passed, least, reason, len(table))))
    return found


def separation(evidence: Evidence) -> list[Finding]:
    """The distance between the halves tells the two classes of targets apart."""
    found = []
    for finding, table in _rectangles(evidence):
        is_two = table["sequence"].isin(evidence.names("two_coloured")).to_numpy()
        distances = table["distance"].to_numpy(np.float64)
        two, plain = distances[is_two], distances[~is_two]
        if not len(two) or not len(plain):
            continue
        area = auc(two, plain)
        threshold = evidence.setting("threshold")
        margins = two.min() - threshold, threshold - plain.max()
        free = zero_error_thresholds(two, plain)
        words = (
            f"thresholds from {free[0]:.3f} to {free[1]:.3f} make no error"
            if free
            else ("no threshold is without error")
        )
        reason = (
            f"area under the curve {area:.3f}; {words}; at {threshold:g} "
            f"{100 * error_share(two, plain, threshold):.0f} % are wrong, margins "
            f"{margins[0]:+.3f} and {margins[1]:+.3f}."
        )
        passed = area >= evidence.setting("least")
        found.append(finding(verdict=check(passed, area, reason, len(table))))
    return found


def slower(evidence: Evidence) -> list[Finding]:
    """Multi takes longer than single; one pass over the pixels is the headline."""
    table = evidence.tables.get("times")
    if table is None:
        return []
    least = evidence.setting("least")
    return [
        Finding(
            evidence.claim.id,
            ratio_above(pairs["multi"], pairs["single"], least),
            reading={} if kernel == "one pass" else {"variant": f"kernel={kernel}"},
        )
        for kernel, pairs in table.groupby("kernel", sort=False)
    ]


def preferable(evidence: Evidence) -> list[Finding]:
    """On plain targets single is as good or better, and no slower."""
    table = evidence.tables.get("times")
    if table is None:
        return []
    pairs = table[table["kernel"] == "one pass"]
    time = ratio_above(pairs["multi"], pairs["single"], AS_SLOW)
    found = []
    for finding, runs in runs_by_reading(evidence, evidence.scores, "plain"):
        for metric in ("frames_inside", "first_loss"):
            gain = _shares(runs, "single", metric) - _shares(runs, "multi", metric)
            gain = gain.dropna().groupby(CELL).mean()
            parts = [no_worse(gain), time]
            verdict = conjunction(parts, ["single no worse", "single no slower"])
            found.append(finding(verdict=verdict, metric=metric))
    return found


def through_occlusion(evidence: Evidence) -> list[Finding]:
    """The target is kept to the end, and not lost at an occlusion."""
    table = evidence.tables.get("losses")
    if table is None:
        return []
    found = []
    for finding, runs in runs_by_reading(evidence, table, "sequences"):
        keys = [runs[key] for key in CELL]
        kept = (runs["first_loss"] >= runs["frames"]).groupby(keys)
        clear = (~runs["near_occlusion"].astype(bool)).groupby(keys)
        parts = [all_kept(kept.sum(), kept.size()), all_kept(clear.sum(), clear.size())]
        verdict = conjunction(parts, ["kept to the end", "not lost at an occlusion"])
        found.append(finding(verdict=verdict, metric="first_loss"))
    return found


def lost_to(evidence: Evidence) -> list[Finding]:
    """Prints when the target is lost, and in which circumstances."""
    table = evidence.tables.get("losses")
    if table is None:
        return []
    found = []
    for finding, runs in runs_by_reading(evidence, table, "sequences"):
        if len(runs) < 2:
            continue
        lost = runs[runs["first_loss"] < runs["frames"]]
        causes = ", ".join(f"{name} {n}" for name, n in lost["towards"].value_counts().items())
        beside = number(runs["first_loss"] / runs["frames"])
        words = f"lost in {len(lost)} of {len(runs)} runs: {causes or 'never'}"
        verdict = replace(beside, reason=f"{beside.reason[:-1]}; {words}.")
        found.append(finding(verdict=verdict, metric="first_loss"))
    return found


CHECKS: Mapping[str, Check] = {
    function.__name__.replace("_", "-"): function
    for function in (
        identity,
        layout,
        right_picks,
        separation,
        slower,
        preferable,
        through_occlusion,
        lost_to,
    )
}
"""By the name that the ledger gives."""


def _shares(runs: pd.DataFrame, representation: str, metric: str) -> "pd.Series[float]":
    chosen = runs[runs["representation"] == representation]
    keys = [chosen[key] for key in (*CELL, "light")]
    return (chosen[metric] / chosen["frames"]).groupby(keys).mean()


def _rectangles(evidence: Evidence) -> Iterator[tuple[Callable[..., Finding], pd.DataFrame]]:
    """First rectangles by how they were drawn."""
    if "switch" not in evidence.tables:
        return
    table = evidence.tables["switch"]
    for initial in evidence.claim.readings.columns["initial"]:
        part = table[table["initial"] == initial]
        if len(part):
            yield labelled(evidence, {"initial": initial}, "drawn"), part
            yield labelled(evidence, {"initial": initial}, "kept"), part[part["kept_scene"]]
