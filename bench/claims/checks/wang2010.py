"""Checks of the paper on CamShift inside a particle filter: particles needed.

Those on particles read a table `particles` of the filters' runs: `sequence`, `scene`, `tracker`,
`particles`, `success`, `kept_scene`, and columns of readings.
"""

from collections.abc import Callable, Iterator, Mapping
from math import inf

import pandas as pd

from bench.claims.checks.runs import runs_by_reading
from bench.claims.findings import Check, Evidence, Finding
from bench.statistics.verdicts import (
    LEAST_CELLS,
    Verdict,
    check,
    undecided,
)

__all__ = ["CHECKS", "particles_needed", "success_by_number"]

PROPOSED, TRADITIONAL = "wang2010", "particle-filter"
LEAST_NUMBERS = 4  # of particles, that make a curve
NEAR = 0.9  # of the greatest share: where a curve has reached its plateau


def least_particles(evidence: Evidence) -> list[Finding]:
    """The traditional filter succeeds, and the least number with which it does lies in a range."""
    least, most = evidence.setting("least"), evidence.setting("most")
    found = []
    for finding, runs in _curves(evidence, [TRADITIONAL]):
        curve = success_by_number(runs, TRADITIONAL)
        number = particles_needed(curve, evidence.setting("share"))
        reason = (
            f"{_words(curve, number)}, to be compared with {least:g} to {most:g} ({_told(curve)})."
        )
        verdict = _checked(least <= number <= most, number, reason, runs)
        found.append(finding(verdict=verdict))
    return found


def fewer_particles(evidence: Evidence) -> list[Finding]:
    """The proposed filter succeeds with the paper's number, the traditional one needs far more."""
    share, ratio = evidence.setting("share"), evidence.setting("ratio")
    particles = int(evidence.setting("particles"))
    found = []
    for finding, runs in _curves(evidence, [PROPOSED, TRADITIONAL]):
        ours, theirs = (success_by_number(runs, tracker) for tracker in (PROPOSED, TRADITIONAL))
        numbers = [particles_needed(curve, share) for curve in (ours, theirs)]
        with_papers = float(ours.get(particles, 0.0))
        # Where the traditional filter never succeeds, it needs more than was tried.
        more = numbers[0] < inf and numbers[1] >= ratio * numbers[0]
        reason = (
            f"with {particles} particles the proposed filter succeeds in {100 * with_papers:.0f} % "
            f"of the runs; proposed: {_words(ours, numbers[0])} ({_told(ours)}); traditional: "
            f"{_words(theirs, numbers[1])} ({_told(theirs)})."
        )
        verdict = _checked(with_papers >= share and more, with_papers, reason, runs)
        found.append(finding(verdict=verdict))
    return found


def success_by_number(runs: pd.DataFrame, tracker: str) -> "pd.Series[float]":
    """Share of successful runs by number of particles, the mean over scenes."""
    chosen = runs[runs["tracker"] == tracker]
    by_scene = chosen.groupby(["particles", "scene"])["success"].mean()
    return by_scene.groupby("particles").mean()


def particles_needed(curve: "pd.Series[float]", share: float) -> float:
    """Least number that reaches the curve's plateau; infinite for one lower than the share."""
    plateau = curve.max()
    return float(curve.index[curve >= NEAR * plateau].min()) if plateau >= share else inf


CHECKS: Mapping[str, Check] = {
    "least-particles": least_particles,
    "fewer-particles": fewer_particles,
}
"""By the name that the ledger gives."""


def _curves(
    evidence: Evidence, trackers: list[str]
) -> Iterator[tuple[Callable[..., Finding], pd.DataFrame]]:
    """Runs of trackers with several numbers of particles each, whatever the paper's number is."""
    if "particles" not in evidence.tables:
        return
    every = evidence.tables["particles"]
    tested = every[every["tracker"].isin(trackers)].drop(columns="budget")
    for finding, runs in runs_by_reading(evidence, tested, "sequences"):
        numbers = runs.groupby("tracker")["particles"].nunique()
        if (numbers.reindex(trackers, fill_value=0) >= LEAST_NUMBERS).all():
            yield finding, runs


def _words(curve: "pd.Series[float]", number: float) -> str:
    return f"{number:g} are needed" if number < inf else f"up to {curve.index.max()} do not suffice"


def _told(curve: "pd.Series[float]") -> str:
    shares = ", ".join(f"{number}: {100 * share:.0f}" for number, share in curve.items())
    return f"success in % by number: {shares}"


def _checked(passed: bool, statistic: float, reason: str, runs: pd.DataFrame) -> Verdict:
    cells = runs["scene"].nunique()
    if cells < LEAST_CELLS:
        return undecided(f"{cells} cells decide nothing; {LEAST_CELLS} are needed.")
    return check(passed, statistic, reason, cells)
