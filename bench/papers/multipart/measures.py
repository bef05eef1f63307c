"""What is asked of runs of the multi-part tracker that `paper.toml` can't say."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

import bench
import datasets
from bench.claims.findings import Check, Evidence, Finding
from bench.claims.verdicts import CELL
from bench.papers.context import Context
from bench.papers.measures import Course
from bench.papers.multipart.scenes import THRESHOLD, Appearance, states_of
from bench.papers.multipart.tables import published
from bench.papers.multipart.timing import kernel_pairs
from bench.papers.runs import as_run
from bench.papers.timing import tracker_times
from bench.statistics.rules import SHARE_LIMIT
from bench.statistics.separation import auc, error_share, zero_error_thresholds
from bench.statistics.verdict_rules import (
    Judge,
    Verdict,
    conjunction,
    no_worse,
    number,
    order,
    share,
    time,
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
    """Judge whether the proposed method is one of the two, to the bit."""
    same = evidence.tables["identity"]["identical"]
    verdict = share(same, np.ones(len(same)), comparisons=evidence.comparisons)
    return [Finding(evidence.claim.id, verdict)]


def layout(evidence: Evidence) -> list[Finding]:
    """Judge whether one histogram does not see swapped halves, and two do."""
    table = evidence.tables["layout"]
    blind, sighted = (evidence.setting(key) for key in ("single_below", "multi_above"))
    as_claimed = (table["single"] < blind) & (table["multi"] > sighted)
    trials = np.ones(len(table))
    verdict = share(as_claimed, trials, comparisons=evidence.comparisons, counted="target")
    single, multi = float(table["single"].max()), float(table["multi"].min())
    words = f"distance after a swap of the halves: single {single:.3f}, multi {multi:.3f}"
    return [Finding(evidence.claim.id, replace(verdict, reason=f"{verdict.reason}; {words}"))]


def right_picks(evidence: Evidence) -> list[Finding]:
    """Judge whether one threshold picks the wanted representation on every sequence."""
    found = []
    for finding, (table,) in evidence.by_reading(evidence.tables["switch"], [{}]):
        wanted = table["sequence"].isin(evidence.names("two_coloured"))
        picks = table["multi_share"].where(wanted, 1 - table["multi_share"])
        if picks.empty:
            continue
        parts = {
            str(name): partial(share, right, np.ones(len(right)), evidence.setting("limit"))
            for name, right in picks.groupby(table["sequence"])
        }
        together = conjunction(parts, evidence.comparisons)
        reason = f"{together.reason}; {100 * picks.mean():.0f} % of all picks are right"
        found.append(finding(verdict=replace(together, reason=reason)))
    return found


def separation(evidence: Evidence) -> list[Finding]:
    """Judge by each scene's area under the curve whether the distance separates the classes."""
    found = []
    least, threshold = evidence.setting("least"), evidence.setting("threshold")
    for finding, (table,) in evidence.by_reading(evidence.tables["switch"], [{}]):
        is_two = table["sequence"].isin(evidence.names("two_coloured"))
        two, plain = table.loc[is_two, "distance"], table.loc[~is_two, "distance"]
        if two.empty or plain.empty:
            continue
        scenes = [
            auc(rows.loc[is_two, "distance"], rows.loc[~is_two, "distance"]) - least
            for _, rows in table.groupby("scene")
            if is_two[rows.index].nunique() == 2
        ]
        free = zero_error_thresholds(two, plain)
        words = (
            f"thresholds from {free[0]:.3f} to {free[1]:.3f} make no error"
            if free
            else "no threshold is without error"
        )
        reason = (
            f"area over all scenes {auc(two, plain):.3f}; {words}; at {threshold:g} "
            f"{100 * error_share(two, plain, threshold):.0f} % are wrong, margins "
            f"{two.min() - threshold:+.3f} and {threshold - plain.max():+.3f}"
        )
        verdict = order(scenes, 0.0, evidence.comparisons, limit=1.0)
        of = f"area less {least:g}"
        reason = f"{verdict.reason}; {reason}"
        found.append(finding(verdict=replace(verdict, of=of, reason=reason)))
    return found


def preferable(evidence: Evidence) -> list[Finding]:
    """On plain targets single is as good or better, and no slower."""
    if "times" not in evidence.tables:
        return []
    table = evidence.tables["times"]
    pairs = table[table["kernel"] == "one pass"]
    times = partial(time, pairs["multi"], pairs["single"], AS_SLOW)
    found = []
    plain = evidence.names("plain")
    for finding, sides in evidence.by_reading(evidence.scores, [SINGLE, MULTI], plain):
        for metric in ("frames_inside", "first_loss"):
            single, multi = (_shares(runs, metric) for runs in sides)
            gains = (single - multi).dropna().groupby(CELL).mean()

            def tracked(comparisons: int, gains: ArrayLike = gains) -> Verdict:
                verdict = no_worse(gains, comparisons=comparisons, limit=1.0)
                return replace(verdict, unit="of the frames")

            parts: dict[str, Judge] = {"single no worse": tracked, "single no slower": times}
            verdict = conjunction(parts, evidence.comparisons)
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
        parts = {
            name: partial(share, one.sum(), one.size(), SHARE_LIMIT)
            for name, one in (("kept to the end", kept), ("not lost at an occlusion", clear))
        }
        verdict = conjunction(parts, evidence.comparisons)
        found.append(finding(verdict=verdict, metric="first_loss"))
    return found


def lost_to(evidence: Evidence) -> list[Finding]:
    """Prints when the target is lost, and how often something hides it then."""
    found = []
    sequences = evidence.names("sequences")
    for finding, (runs,) in evidence.by_reading(evidence.scores, ["multipart"], sequences):
        lost = runs[runs["first_loss"] < runs["frames"]]
        near = int(lost["near_occlusion"].sum())
        shares = (runs["first_loss"] / runs["frames"]).groupby([runs[key] for key in CELL]).mean()
        verdict = number(shares, most=1.0)
        words = f"lost in {len(lost)} of {len(runs)} runs, {near} of them near an occlusion"
        verdict = replace(verdict, reason=f"{verdict.reason}; {words}")
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
