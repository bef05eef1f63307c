"""What is asked of runs of the filters and CamShifts that `paper.toml` can't say."""

from collections.abc import Mapping
from math import inf, isfinite, nan
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.claims.findings import Check, Evidence, Finding
from bench.claims.sides import Table, light_rows
from bench.metrics.centre_error import centre_error
from bench.papers.context import Context
from bench.papers.measures import Course
from bench.papers.runs import as_run
from bench.papers.wang2010.timing import time_rows
from bench.statistics.verdicts import LEAST_CELLS, Verdict, check, too_few, undecided

__all__ = ["CHECKS", "of_run", "published", "scores"]

PROPOSED, TRADITIONAL = "wang2010", "particle-filter"
TABLE_TENNIS, HAND, CUP = (f"wang2010/{name}" for name in ("table-tennis", "hand", "cup"))

SUCCESS, LAST = 0.9, 10
"""A run succeeds that is within the tolerance in this share of frames, and in all of the last."""

LOST, SETTLED = 5, 5
"""Frames in a row beyond the tolerance that make a loss, and within it that make a return."""

CENTRED, SHOWN = 48, 57
"""Indices of the paper's frame 49, in which the hand is centred on the face, and of frame 58."""

TEN_BY_RULE = 400
"""Particles for which the formula √N / 2 gives a radius of 10 pixels."""

LEAST_NUMBERS = 4  # of particles, that make a curve
NEAR = 0.9  # of the greatest share: where a curve has reached its plateau
NEEDED = {PROPOSED: 60, TRADITIONAL: 400}
"""Particles that the paper says are needed on the first sequence."""


def of_run(course: Course) -> dict[str, float]:
    """Events of a run; a yes or no is 1 or 0, NaN where what is asked did not arise."""
    within = course.within[~np.isnan(course.within)] == 1.0
    known = {
        "success": float(within.mean() >= SUCCESS and within[-LAST:].all()),
        "stayed_lost": _stayed_lost(within),
    }
    inside = course.within == 1.0  # by frame, absent or not
    if course.sequence == TABLE_TENNIS:
        deviates = not inside[11:15].all()
        known |= {
            "deviates_12_to_15": float(deviates),
            "back_at_16": float(inside[15]) if deviates else nan,
            "still_wrong_at_16": float(deviates and not inside[15]),
        }
    elif course.sequence == HAND:
        to_the_face = centre_error(course.truth.boxes[[CENTRED]], course.boxes[[SHOWN]])[0]
        known |= {
            "holds_10_and_38": float(inside[[9, 37]].all()),
            "lost_at_58_and_100": float(not inside[[57, 99]].any()),
            "on_the_face_at_58": float(to_the_face <= course.tolerance),
        }
    elif course.sequence == CUP:
        known["lost_at_36_and_44_and_51"] = float(not inside[[35, 43, 50]].any())
    return known


def _stayed_lost(within: NDArray[np.bool_]) -> float:
    """Whether a target once lost is never back; NaN where it is not lost, or too late to tell."""
    losses = _starts(~within, LOST)
    if not len(losses) or losses[0] + LOST + SETTLED > len(within):
        return nan
    return float(not len(_starts(within[losses[0] :], SETTLED)))


def _starts(flags: NDArray[np.bool_], length: int) -> NDArray[np.intp]:
    """Where so many flags in a row begin."""
    if len(flags) < length:
        return np.empty(0, np.intp)
    rows = np.lib.stride_tricks.sliding_window_view(flags, length)
    return np.flatnonzero(rows.all(axis=1))


def scores(runs: pd.DataFrame) -> pd.DataFrame:
    """The runs, and those whose radius is 10 by the formula as such."""
    filters = runs["tracker"].isin([PROPOSED, TRADITIONAL])
    ten = filters & (runs["particles"] == TEN_BY_RULE) & (runs["radius"] == "rule")
    return pd.concat([runs, as_run(runs[ten], radius=10)], ignore_index=True)


def least_particles(evidence: Evidence) -> list[Finding]:
    """The traditional filter succeeds, and the least number with which it does lies in a range."""
    least, most = evidence.setting("least"), evidence.setting("most")
    found = []
    for labels, curves in _curves(evidence, [TRADITIONAL]):
        number = particles_needed(curves[TRADITIONAL], evidence.setting("share"))
        words = _words(curves[TRADITIONAL], number)
        reason = f"{words}, to be compared with {least:g} to {most:g}."
        verdict = _checked(least <= number <= most, number, reason, labels.pop("scenes_seen"))
        found.append(Finding(evidence.claim.id, verdict, **labels))
    return found


def fewer_particles(evidence: Evidence) -> list[Finding]:
    """The proposed filter succeeds with the paper's number, the traditional one needs far more."""
    share, ratio = evidence.setting("share"), evidence.setting("ratio")
    particles = int(evidence.setting("particles"))
    found = []
    for labels, curves in _curves(evidence, [PROPOSED, TRADITIONAL]):
        ours, theirs = (particles_needed(curve, share) for curve in curves.values())
        with_papers = float(curves[PROPOSED].get(particles, 0.0))
        # Where the traditional filter never succeeds, it needs more than was tried.
        more = ours < inf and theirs >= ratio * ours
        reason = (
            f"with {particles} particles the proposed filter succeeds in {100 * with_papers:.0f} % "
            f"of the runs; proposed: {_words(curves[PROPOSED], ours)}; traditional: "
            f"{_words(curves[TRADITIONAL], theirs)}."
        )
        passed = with_papers >= share and more
        verdict = _checked(passed, with_papers, reason, labels.pop("scenes_seen"))
        found.append(Finding(evidence.claim.id, verdict, **labels))
    return found


CHECKS: Mapping[str, Check] = {
    "least-particles": least_particles,
    "fewer-particles": fewer_particles,
}
"""By the name that the ledger gives."""


def _curves(
    evidence: Evidence, trackers: list[str]
) -> list[tuple[dict[str, Any], dict[str, "pd.Series[float]"]]]:
    """Success by number of particles and tracker, under each reading with curves of all of them.

    What a reading says of the proposed filter's radius holds here of both: the traditional one's
    is what the proposed one has, or what the formula gives.
    """
    readings = evidence.claim.readings
    needed = ("tracker", "settled", "sequence", "scene", "particles", "failure", "success")
    lookup = Table(light_rows(evidence.scores, needed), readings)
    sequences = evidence.names("sequences")
    numbers = sorted(evidence.scores["particles"].dropna().unique())
    found: dict[object, tuple[dict[str, Any], dict[str, pd.Series[float]]]] = {}
    for reading in readings.all(lambda axis: PROPOSED in axis.over):
        curves, asked, scenes = {}, [], []
        for tracker in trackers:
            both = {"radius": reading.parameters(PROPOSED).get("radius", "rule")}
            told = {**both, **reading.parameters(tracker)}
            runs = pd.concat(
                [lookup.runs(tracker, {**told, "particles": int(n)}, sequences) for n in numbers]
            )
            failed = runs.loc[runs["failure"] != "", "scene"]
            runs = runs[~runs["scene"].isin(failed)]
            asked.append(tuple(sorted(map(str, told.items()))))
            scenes.append(runs["scene"].nunique())
            if len(runs["particles"].unique()) >= LEAST_NUMBERS:
                curves[tracker] = success_by_number(runs)
        if len(curves) < len(trackers):
            continue
        labels = {
            "reading": reading.names,
            "same": frozenset([readings.places(reading)]),
            "post_hoc": reading.post_hoc,
            "scenes_seen": min(scenes),
        }
        known = found.setdefault(tuple(asked), (labels, curves))
        known[0]["same"] |= labels["same"]
    return [
        ({**labels, "scenes": scenes}, curves)
        for labels, curves in found.values()
        for scenes in ("drawn", "kept")
    ]


def success_by_number(runs: pd.DataFrame) -> "pd.Series[float]":
    """Share of successful runs by number of particles, the mean over scenes."""
    by_scene = runs.groupby(["particles", "scene"])["success"].mean()
    return by_scene.groupby("particles").mean()


def particles_needed(curve: "pd.Series[float]", share: float) -> float:
    """Least number that reaches the curve's plateau; infinite for one lower than the share."""
    plateau = curve.max()
    return float(curve.index[curve >= NEAR * plateau].min()) if plateau >= share else inf


def _words(curve: "pd.Series[float]", number: float) -> str:
    needed = (
        f"{number:g} are needed" if number < inf else f"up to {curve.index.max():g} do not suffice"
    )
    shares = ", ".join(f"{count:g}: {100 * share:.0f}" for count, share in curve.items())
    return f"{needed} (success in % by number: {shares})"


def _checked(passed: bool, statistic: float, reason: str, cells: int) -> Verdict:
    if cells < LEAST_CELLS:
        return undecided(too_few(cells))
    return check(passed, statistic, reason, cells)


def published(context: Context) -> list[dict[str, Any]]:
    """The paper's times and numbers of particles beside ours, for scripts."""
    rows = time_rows(context.tables["method_times"])
    for tracker, number in NEEDED.items():
        runs = context.across(tracker, TABLE_TENNIS, {"preset": "as-written"}, "particles")
        needed = particles_needed(success_by_number(runs), SUCCESS) if len(runs) else inf
        rows.append(
            {
                "table": "particles",
                "label": tracker,
                "column": "particles needed on the first sequence",
                "published": number,
                "measured": needed if isfinite(needed) else None,
                "interval": None,
            }
        )
    return rows
