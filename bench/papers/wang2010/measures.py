"""What is asked of runs of the filters and CamShifts that `paper.toml` can't say."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from math import inf, isfinite, nan
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from bench.claims.failures import with_worst_scores
from bench.claims.findings import Check, Evidence, Finding
from bench.claims.sides import Table, light_rows
from bench.metrics.centre_error import centre_error
from bench.papers.context import Context
from bench.papers.measures import Course
from bench.papers.runs import as_run
from bench.papers.wang2010.timing import time_rows
from bench.statistics.rules import SHARE_LIMIT
from bench.statistics.verdict_rules import conjunction, share

__all__ = ["CHECKS", "of_run", "published", "scores"]

Array = NDArray[np.float64]

PROPOSED, TRADITIONAL = "wang2010", "particle-filter"
HAND, CUP = "wang2010/hand", "wang2010/cup"
TABLE_TENNIS, FIRST_VERSION = "wang2010/table-tennis:version=2", "wang2010/table-tennis"

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
    if course.sequence in (TABLE_TENNIS, FIRST_VERSION):
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
    """Judge whether the least number with which the traditional filter succeeds lies in a range."""
    least, most = evidence.setting("least"), evidence.setting("most")
    found = []
    for labels, (runs,) in _curves(evidence, [TRADITIONAL]):
        table = success_by_number(runs)
        needed = partial(particles_needed, table.columns, share=evidence.setting("share"))
        numbers = needed(table.to_numpy())
        in_range = (numbers >= least) & (numbers <= most)
        verdict = share(in_range, np.ones(len(numbers)), comparisons=evidence.comparisons)
        words = f"{_words(table, needed)}, to be compared with {least:g} to {most:g}"
        of, reason = f"{least:g} to {most:g} needed", f"{verdict.reason}; {words}"
        verdict = replace(verdict, of=of, unit="of the scenes", reason=reason)
        found.append(Finding(evidence.claim.id, verdict, **labels))
    return found


def fewer_particles(evidence: Evidence) -> list[Finding]:
    """Judge whether the proposed filter succeeds with few, and the traditional one needs more."""
    ratio, particles = evidence.setting("ratio"), evidence.setting("particles")
    found = []
    for labels, (ours, theirs) in _curves(evidence, [PROPOSED, TRADITIONAL]):
        tables = [success_by_number(runs) for runs in (ours, theirs)]
        needs = [
            partial(particles_needed, table.columns, share=evidence.setting("share"))
            for table in tables
        ]
        by_scene = ours[ours["particles"] == particles].groupby("scene")["success"]
        own, other = (
            pd.Series(need(table.to_numpy()), table.index)
            for need, table in zip(needs, tables, strict=True)
        )
        both = pd.concat([own, other], axis=1).dropna().to_numpy()
        more = (both[:, 0] < inf) & (both[:, 1] >= ratio * both[:, 0])
        parts = {
            f"success with {particles:g} particles": partial(
                share, by_scene.sum(), by_scene.count(), SHARE_LIMIT
            ),
            f"{ratio:g} times as many needed": partial(
                share, more, np.ones(len(more)), SHARE_LIMIT
            ),
        }
        verdict = conjunction(parts, evidence.comparisons)
        words = "; ".join(
            f"{name}: {_words(table, need)}"
            for name, table, need in zip(("proposed", "traditional"), tables, needs, strict=True)
        )
        reason = f"{verdict.reason}; {words}"
        verdict = replace(verdict, unit="of the scenes", reason=reason)
        found.append(Finding(evidence.claim.id, verdict, **labels))
    return found


CHECKS: Mapping[str, Check] = {
    "least-particles": least_particles,
    "fewer-particles": fewer_particles,
}
"""By the name that the ledger gives."""


def _curves(
    evidence: Evidence, trackers: list[str]
) -> list[tuple[dict[str, Any], list[pd.DataFrame]]]:
    """Runs by tracker with several numbers of particles, under each reading with some of all.

    What a reading says of the proposed filter's radius holds here of both: the traditional one's
    is what the proposed one has, or what the formula gives.
    """
    readings = evidence.claim.readings
    needed = ("tracker", "settled", "sequence", "scene", "particles", "failure", "success")
    lookup = Table(light_rows(evidence.scores, needed), readings)
    sequences = evidence.names("sequences")
    numbers = sorted(evidence.scores["particles"].dropna().unique())
    found: dict[object, tuple[dict[str, Any], list[pd.DataFrame]]] = {}
    for reading in readings.all(lambda axis: PROPOSED in axis.over):
        curves, asked = [], []
        for tracker in trackers:
            both = {"radius": reading.parameters(PROPOSED).get("radius", "rule")}
            told = {**both, **reading.parameters(tracker)}
            runs = pd.concat(
                [lookup.runs(tracker, {**told, "particles": int(n)}, sequences) for n in numbers]
            )
            runs = with_worst_scores(runs, ["success"])
            asked.append(tuple(sorted(map(str, told.items()))))
            if len(runs["particles"].unique()) >= LEAST_NUMBERS:
                curves.append(runs)
        if len(curves) < len(trackers):
            continue
        labels = {
            "reading": reading.names,
            "same": frozenset([readings.places(reading)]),
            "post_hoc": reading.post_hoc,
        }
        known = found.setdefault(tuple(asked), (labels, curves))
        known[0]["same"] |= labels["same"]
    return [
        ({**labels, "scenes": scenes}, curves)
        for labels, curves in found.values()
        for scenes in ("drawn", "kept")
    ]


def success_by_number(runs: pd.DataFrame) -> pd.DataFrame:
    """Share of successful runs, a scene a row and a number of particles a column."""
    return runs.pivot_table("success", "scene", "particles").dropna()


def particles_needed(numbers: ArrayLike, shares: ArrayLike, *, share: float) -> Array:
    """Least number that reaches a curve's plateau; infinite for a plateau lower than the share.

    `numbers`, shape (k,), ascend; `shares`, shape (..., k), are those of successes.
    """
    curves = np.asarray(shares, np.float64)
    plateau = curves.max(axis=-1, keepdims=True)
    first = np.argmax(curves >= NEAR * plateau, axis=-1)
    return np.where(plateau[..., 0] >= share, np.asarray(numbers, np.float64)[first], inf)


def _words(table: pd.DataFrame, needed: Callable[[Array], Array]) -> str:
    curve = table.mean()
    number = float(needed(curve.to_numpy()))
    words = (
        f"{number:g} are needed" if number < inf else f"up to {curve.index.max():g} do not suffice"
    )
    shares = ", ".join(f"{count:g}: {100 * share:.0f}" for count, share in curve.items())
    return f"{words} (success in % by number: {shares})"


def published(context: Context) -> list[dict[str, Any]]:
    """The paper's times and numbers of particles beside ours, for scripts."""
    times = context.tables.get("method_times")
    rows = [] if times is None else time_rows(times)
    for tracker, number in NEEDED.items():
        runs = context.across(tracker, TABLE_TENNIS, {"preset": "as-written"}, "particles")
        table = success_by_number(runs)
        shares = table.mean().to_numpy()
        needed = (
            float(particles_needed(table.columns, shares, share=SUCCESS)) if len(table) else inf
        )
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
