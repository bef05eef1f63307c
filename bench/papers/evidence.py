"""Evidence for claims: values by scene from stored runs or rendered scenes."""

from collections.abc import Iterable
from dataclasses import replace
from math import inf, log2, nan

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from trackmark.bench.pages.page_frames import Progress
from trackmark.bench.papers import SETTINGS
from trackmark.bench.papers.cases import Case, PaperSequence, posed_scenes
from trackmark.bench.papers.claim_tests import FLOOR_UNITS, Evidence, compared_trackers
from trackmark.bench.papers.claims import Claim
from trackmark.bench.papers.criteria import favoured
from trackmark.bench.papers.measures import Measure
from trackmark.bench.papers.runs import Context
from trackmark.bench.papers.scene_values import scene_values
from trackmark.bench.papers.settings import parameters
from trackmark.bench.papers.verdicts import VerdictRow, judge_row

BOUNDED = ("share", "overlap", "J")  # units of measures with values in [0, 1]
SUCCEEDS = 0.5  # limit between the values 0 and 1 of a measure of success
DOUBLINGS = "doublings of N"  # unit of the fewest particles, whose logarithm to base 2 is compared
MIN_POSED = 12
"""Minimum number of the first 40 scenes that meet the criteria of difficulty."""


def verdict_rows(context: Context, progress: Progress = lambda *_: None) -> list[VerdictRow]:
    """Judge all claims in both settings; `progress` gets the numbers of judged and all claims."""
    rows = list[VerdictRow]()
    claims = context.paper.claims
    for claim in claims.values():
        progress(len(rows), len(claims))
        of_claim = {setting: evidence(claim, setting, context) for setting in SETTINGS}
        rows.append(judge_row(claim, of_claim))
    return rows


def evidence(claim: Claim, setting: str, context: Context) -> Evidence:
    """Return the values from which a claim is judged in a setting."""
    gathered = (
        _of_scenes(claim, setting, context)
        if claim.measure.subject == "scene"
        else _of_runs(claim, setting, context)
    )
    return replace(
        gathered,
        not_posed=_not_posed(claim.sequences),
        favoured=claim.name in favoured(context.paper.name),
    )


def _of_runs(claim: Claim, setting: str, context: Context) -> Evidence:
    """Return values of a measure of runs, and which of the runs keep the target."""
    measure, sides = claim.measure, claim.sides(setting)
    n_members = max(len(sequence.members) for sequence in claim.sequences)
    values = [_values(side, measure, context) for side in sides]
    unit, lower_is_better, largest = measure.unit, measure.lower_is_better, inf
    if unit in BOUNDED:
        largest = 1.0 if measure.averaged else float(n_members)
    counts_particles = claim.side_rule == "fewest particles"
    if counts_particles:
        values = [_fewest_particles(table) for table in values]
        unit, lower_is_better, largest = DOUBLINGS, True, inf
    gathered = Evidence(
        values[0],
        values[1],
        lower_is_better=lower_is_better,
        largest=largest,
        unit=unit,
        unit_noun="set" if n_members > 1 else "scene",
        lost_before=_lost_before(claim, sides[0], context),
        failed=_failed(sides[0] + sides[1], context),
    )
    if counts_particles or not claim.worse:
        return gathered
    gathered = replace(gathered, equal_runs=_equal_share(claim, gathered, context))
    if unit not in FLOOR_UNITS:
        return gathered
    first, second = (_kept_shares(side, measure, context) for side in sides)
    return replace(gathered, kept_first=first, kept_second=second)


def _values(claim_cases: list[Case], measure: Measure, context: Context) -> pd.DataFrame:
    tables = [context.runs.values(case, measure) for case in claim_cases]
    return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame()


def _kept_shares(claim_cases: list[Case], measure: Measure, context: Context) -> pd.DataFrame:
    """Return which share of the runs of a scene, or of the members of a set, keeps the target."""
    kept_measure = context.paper.kept_measure
    if measure.kept_measure:
        kept_measure = replace(measure, function=measure.kept_measure, averaged=False)
    n_kept = _values(claim_cases, kept_measure, context)
    n_members = {case.sequence.name: len(case.sequence.members) for case in claim_cases}
    return n_kept.assign(value=n_kept["value"] / n_kept["sequence"].map(n_members))


def _fewest_particles(table: pd.DataFrame) -> pd.DataFrame:
    """Return log₂ of the fewest particles with which a scene succeeds, as one row per scene.

    If no number of particles succeeds, the value is that of twice the largest number.
    """
    if table.empty:
        return table
    n_particles = {
        spec: int(dict(parameters(spec))["particles"]) for spec in table["tracker"].unique()
    }
    counts = table["tracker"].map(n_particles)
    needed = counts.where(table["value"] > SUCCEEDS, 2 * max(n_particles.values()))
    by_scene = needed.groupby([table["sequence"], table["rank"]], sort=False).min()
    names = table.drop_duplicates(["sequence", "rank"]).set_index(["sequence", "rank"])
    fewest = names.assign(value=by_scene.map(log2)).reset_index()
    return fewest.assign(tracker=table["tracker"].iloc[0])[table.columns]


def _equal_share(claim: Claim, gathered: Evidence, context: Context) -> float:
    """Return in which share of the scenes the compared trackers have equal boxes."""
    if gathered.first.empty or gathered.second.empty:
        return nan
    first, second = compared_trackers(gathered)
    equal = [
        all(_equal_boxes(first[sequence.name], second[sequence.name], m, context) for m in members)
        for sequence in claim.sequences
        for members in sequence.scenes(claim.n_scenes)
        if sequence.name in first and sequence.name in second
    ]
    return float(np.mean(equal)) if equal else nan


def _equal_boxes(first: str, second: str, scene: str, context: Context) -> bool:
    runs = [context.runs.measured_run(tracker, scene) for tracker in (first, second)]
    boxes = [measured.boxes for measured in runs if measured]
    return all(np.array_equal(boxes[0], other, equal_nan=True) for other in boxes[1:])


def _lost_before(claim: Claim, claim_cases: list[Case], context: Context) -> NDArray[np.float64]:
    """Return 1 for each scene with a loss before the event, else 0; empty without an event."""
    measure = claim.measure
    if measure.lost_before is None or not claim.trackers:
        return np.zeros(0)
    values = _values(claim_cases, replace(measure, function=measure.lost_before), context)
    return values["value"].to_numpy(np.float64)


def _not_posed(sequences: Iterable[PaperSequence]) -> str:
    """Return a sentence on the first sequence whose scenes seldom meet the difficulty criteria."""
    for sequence in sequences:
        for member in dict.fromkeys(sequence.scenes_of or name for name in sequence.members):
            posed, checked = posed_scenes(sequence.paper, member)
            if posed < min(MIN_POSED, checked):
                which = f"{posed} of the first {checked} scenes of {sequence.name}"
                return f"{which} meet the criteria of difficulty"
    return ""


def _failed(claim_cases: list[Case], context: Context) -> str:
    """Return a sentence on failed runs with the reason of the first; empty if none failed."""
    records = [
        measured.record
        for case in claim_cases
        for scene in case.scenes_of_members
        if (measured := context.runs.measured_run(case.tracker, scene))
    ]
    failed = [record for record in records if record.failure]
    if not failed:
        return ""
    reason = failed[0].failure.partition("\n")[0]
    return (
        f"{len(failed)} of {len(records)} runs failed and count as lost. "
        f"First: {failed[0].identity.sequence}, {reason}"
    )


def _of_scenes(claim: Claim, setting: str, context: Context) -> Evidence:
    """Return values of a measure of scenes; without sequences, scenes are numbers."""
    measure = claim.measure
    specs = [tracker.spec(setting) for tracker in claim.trackers]
    scenes_by_sequence = {
        sequence.name: [members[0] for members in sequence.scenes(claim.n_scenes)]
        for sequence in claim.sequences
    } or {"": [str(number) for number in range(claim.n_scenes)]}
    tables = []
    for sequence, scenes in scenes_by_sequence.items():
        values = scene_values(measure.function, scenes, specs, context.folder, context.jobs)
        rows = {"sequence": sequence, "rank": np.arange(len(scenes)), "scene": scenes}
        tables.append(pd.DataFrame({**rows, "tracker": "", "value": values}))
    return Evidence(
        pd.concat(tables, ignore_index=True),
        lower_is_better=measure.lower_is_better,
        largest=1.0 if measure.unit in BOUNDED else inf,
        unit=measure.unit,
        unit_noun="scene" if claim.sequences else "run",
    )
