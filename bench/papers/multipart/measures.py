"""What is asked of runs of the multi-part tracker that `paper.toml` can't say."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pandas as pd

import bench
import datasets
from bench.claims.findings import Check, Evidence, Finding
from bench.claims.verdicts import CELL
from bench.papers.context import Context
from bench.papers.measures import Course
from bench.papers.multipart.scenes import JITTERS, THRESHOLD, Appearance, states_of
from bench.papers.multipart.tables import published
from bench.papers.multipart.timing import kernel_pairs
from bench.papers.runs import as_run
from bench.papers.timing import tracker_times
from bench.statistics.separation import auc, auc_interval, error_share, zero_error_thresholds
from bench.statistics.verdicts import (
    LEAST_CELLS,
    Outcome,
    Verdict,
    all_kept,
    check,
    conjunction,
    no_worse,
    number,
    ratio_above,
    share_at_least,
    too_few,
)

__all__ = ["CHECKS", "of_run", "published", "scores", "tables"]

SINGLE, MULTI = (f"multipart:representation={name}" for name in ("single", "multi"))

NEAR_OCCLUSION = 10  # frames
OCCLUDED = 0.9  # visible fraction below which the target is occluded
AS_SLOW = 0.98  # ratio above which a time is no shorter than the other
IDENTITY_SCENES, IDENTITY_FRAMES = 2, 15


def of_run(course: Course) -> dict[str, float]:
    """What the switch sees at the start, and whether something hides the target at its loss."""
    distances = course.detail("part_distance")
    lost = int(course.scores["first_loss"])
    hidden = course.truth.visibility[max(lost - NEAR_OCCLUSION, 0) : lost + NEAR_OCCLUSION + 1]
    near = lost < len(course.truth.boxes) and bool((hidden < OCCLUDED).any())
    return {
        "part_distance": float(distances[np.isfinite(distances)][0]),
        "near_occlusion": float(near),
    }


def scores(runs: pd.DataFrame) -> pd.DataFrame:
    """The runs, and those of the representation that the proposed method picks as its own (Eq. 7).

    With equal random numbers they are the same to the bit, so they are copied, not run.
    """
    picked = np.where(runs["part_distance"] > runs["threshold"], "multi", "single")
    proposed = runs[(runs["representation"] == picked) & (runs["failure"] == "")]
    # What it would have picked is not known of a run that failed: it failed, too.
    failed = runs[runs["failure"] != ""]
    copies = as_run(pd.concat([proposed, failed]), representation="adaptive")
    return pd.concat([runs, copies], ignore_index=True)


def tables(context: Context) -> dict[str, pd.DataFrame]:
    """What claims read beside the runs.

    `identity`, a scene a row: `identical` (bool), whether the adaptive run's boxes are, to the bit,
    those of the representation that it picked. `layout`, a target a row, its halves swapped:
    `single`, `multi` (distances). `times`: see `timing.kernel_pairs`; `updates`, whole ones: see
    `bench.papers.timing.tracker_times`.
    """
    found = {"identity": _identity(), "layout": _layout()}
    if context.description.experiment("time") in context.asked:  # a quick look times nothing
        found |= {"times": kernel_pairs(context), "updates": tracker_times(context, "time")}
    return found


def _identity() -> pd.DataFrame:
    rows = []
    for scene in range(IDENTITY_SCENES):
        sequence = datasets.load(f"stress/twin:scene={scene}")[:IDENTITY_FRAMES]
        adaptive = bench.evaluate("multipart:init=full", sequence)
        pick = MULTI if adaptive.details["part_distance"][-1] > THRESHOLD else SINGLE
        other = bench.evaluate(f"{pick}:init=full", sequence)
        rows.append({"scene": scene, "identical": np.array_equal(adaptive.boxes, other.boxes)})
    return pd.DataFrame(rows)


def _layout() -> pd.DataFrame:
    image = np.full((120, 80, 3), 128, np.uint8)
    box = np.array([20.0, 20.0, 40.0, 80.0])
    image[20:60, 20:60], image[60:100, 20:60] = (40, 40, 190), (180, 70, 40)
    swapped = image.copy()
    swapped[20:60], swapped[60:100] = image[60:100], image[20:60]
    single, multi = Appearance(image, box).distances(swapped, states_of(box[np.newaxis]))
    return pd.DataFrame({"single": single, "multi": multi})


def identity(evidence: Evidence) -> list[Finding]:
    """The proposed method is one of the two, to the bit."""
    table = evidence.tables["identity"]
    same = int(table["identical"].sum())
    reason = f"boxes are identical in {same} of {len(table)} scenes."
    return [Finding(evidence.claim.id, check(same == len(table), float(same), reason, len(table)))]


def layout(evidence: Evidence) -> list[Finding]:
    """One histogram does not see swapped halves, two do."""
    table = evidence.tables["layout"]
    blind, sighted = (evidence.setting(key) for key in ("single_below", "multi_above"))
    single, multi = float(table["single"].max()), float(table["multi"].min())
    reason = f"distance after a swap of the halves: single {single:.3f}, multi {multi:.3f}."
    verdict = check(single < blind and multi > sighted, multi, reason, len(table))
    found = replace(verdict, of="distance by two histograms", counted="target")
    return [Finding(evidence.claim.id, found)]


def right_picks(evidence: Evidence) -> list[Finding]:
    """One threshold picks the wanted representation on every sequence."""
    found = []
    for finding, (table,) in evidence.by_reading(evidence.tables["switch"], [{}]):
        wanted = table["sequence"].isin(evidence.names("two_coloured"))
        share = table["multi_share"].where(wanted, 1 - table["multi_share"])
        if share.empty:
            continue
        # Of the rectangles of one scene, nearly all are picked alike: the scene is the unit.
        right = (JITTERS * share).round().groupby(table["sequence"])
        limits = evidence.setting("least"), evidence.setting("lower")
        parts = {
            str(name): share_at_least(cells, np.full(len(cells), JITTERS), *limits)
            for name, cells in right
        }
        together = conjunction(list(parts.values()), list(parts))
        reason = f"{100 * share.mean():.0f} % of all picks are right; {together.reason}"
        found.append(finding(verdict=replace(together, reason=reason, counted="scene")))
    return found


def separation(evidence: Evidence) -> list[Finding]:
    """The distance between the halves tells the two classes of targets apart."""
    found = []
    for finding, (table,) in evidence.by_reading(evidence.tables["switch"], [{}]):
        is_two = table["sequence"].isin(evidence.names("two_coloured")).to_numpy()
        distances = table["distance"].to_numpy(np.float64)
        two, plain = distances[is_two], distances[~is_two]
        if not len(two) or not len(plain):
            continue
        area, threshold = auc(two, plain), evidence.setting("threshold")
        interval = auc_interval(area, len(two), len(plain))
        margins = two.min() - threshold, threshold - plain.max()
        free = zero_error_thresholds(two, plain)
        words = (
            f"thresholds from {free[0]:.3f} to {free[1]:.3f} make no error"
            if free
            else "no threshold is without error"
        )
        reason = (
            f"area under the curve {area:.3f} (95 %: {interval.low:.3f} to {interval.high:.3f}); "
            f"{words}; at {threshold:g} "
            f"{100 * error_share(two, plain, threshold):.0f} % are wrong, margins "
            f"{margins[0]:+.3f} and {margins[1]:+.3f}."
        )
        fewest = min(len(two), len(plain))
        outcome: Outcome = "undecided"
        if fewest < LEAST_CELLS:
            reason = f"{too_few(fewest).removesuffix('.')} of each class; {reason}"
        elif interval.low > evidence.setting("least"):
            outcome = "holds"
        elif interval.high < evidence.setting("least"):
            outcome = "does-not-hold"
        found.append(finding(verdict=Verdict(outcome, area, interval, len(table), reason)))
    return found


def preferable(evidence: Evidence) -> list[Finding]:
    """On plain targets single is as good or better, and no slower."""
    if "times" not in evidence.tables:
        return []
    table = evidence.tables["times"]
    pairs = table[table["kernel"] == "one pass"]
    time = replace(ratio_above(pairs["multi"], pairs["single"], AS_SLOW), counted="pair")
    found = []
    plain = evidence.names("plain")
    for finding, sides in evidence.by_reading(evidence.scores, [SINGLE, MULTI], plain):
        for metric in ("frames_inside", "first_loss"):
            single, multi = (_shares(runs, metric) for runs in sides)
            tracked = no_worse((single - multi).dropna().groupby(CELL).mean())
            parts = [replace(tracked, unit="of the frames"), time]
            verdict = conjunction(parts, ["single no worse", "single no slower"])
            found.append(finding(verdict=verdict, metric=metric))
    return found


def _shares(runs: pd.DataFrame, metric: str) -> "pd.Series[float]":
    keys = [runs[key] for key in (*CELL, "light")]
    return (runs[metric] / runs["frames"]).groupby(keys).mean()


def through_occlusion(evidence: Evidence) -> list[Finding]:
    """The target is kept to the end, and not lost at an occlusion."""
    found = []
    sequences = evidence.names("sequences")
    for finding, (runs,) in evidence.by_reading(evidence.scores, ["multipart"], sequences):
        keys = [runs[key] for key in CELL]
        kept = (runs["first_loss"] >= runs["frames"]).groupby(keys)
        clear = (runs["near_occlusion"] == 0.0).groupby(keys)
        parts = [all_kept(one.sum(), one.size()) for one in (kept, clear)]
        verdict = conjunction(parts, ["kept to the end", "not lost at an occlusion"])
        found.append(finding(verdict=verdict, metric="first_loss"))
    return found


def lost_to(evidence: Evidence) -> list[Finding]:
    """Prints when the target is lost, and how often something hides it then."""
    found = []
    sequences = evidence.names("sequences")
    for finding, (runs,) in evidence.by_reading(evidence.scores, ["multipart"], sequences):
        if len(runs) < 2:
            continue
        lost = runs[runs["first_loss"] < runs["frames"]]
        near = int(lost["near_occlusion"].sum())
        shares = runs["first_loss"] / runs["frames"]
        beside = replace(number(shares, most=1.0), counted="run")
        words = f"lost in {len(lost)} of {len(runs)} runs, {near} of them near an occlusion"
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
        preferable,
        through_occlusion,
        lost_to,
    )
}
"""By the name that the ledger gives."""
