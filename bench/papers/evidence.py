"""Evidence for claims: values by scene from stored runs or rendered scenes, or times."""

from math import inf, nan

import numpy as np
import pandas as pd

from trackmark.bench.pages.page_frames import Progress
from trackmark.bench.papers import SETTINGS
from trackmark.bench.papers.cases import Case, cases
from trackmark.bench.papers.claim_tests import Evidence
from trackmark.bench.papers.claims import Claim
from trackmark.bench.papers.measures import Measure
from trackmark.bench.papers.runs import Context
from trackmark.bench.papers.scene_values import scene_values
from trackmark.bench.papers.verdicts import VerdictRow, judge_row
from trackmark.bench.statistics.verdict_rules import success

BOUNDED = ("share", "overlap")  # units of measures with values in [0, 1]


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
    measure = claim.measure
    if measure.subject == "time":
        return Evidence(times=measure.function(context, setting), unit=measure.unit)
    if measure.subject == "scene":
        return _of_scenes(claim, setting, context)
    first, second = (
        cases(trackers, claim.sequences, setting, claim.n_scenes)
        for trackers in (claim.trackers or claim.better, claim.worse)
    )
    n_members = max(len(sequence.members) for sequence in claim.sequences)
    return Evidence(
        _values(first, measure, context),
        _values(second, measure, context),
        lower_is_better=measure.lower_is_better,
        largest=float(n_members) if measure.unit in BOUNDED else inf,
        unit=measure.unit,
        unit_noun="set" if n_members > 1 else "scene",
        reference_kept=_kept_share(claim, second, context),
        lost_before=_lost_before(claim, first, context),
        failed=_failed(first + second, context),
    )


def _values(claim_cases: list[Case], measure: Measure, context: Context) -> pd.DataFrame:
    tables = [context.runs.values(case, measure) for case in claim_cases]
    return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame()


def _kept_share(claim: Claim, reference: list[Case], context: Context) -> float:
    """Return the share of scenes in which the reference of a no-worse test keeps the target."""
    if not claim.test.startswith("no-worse"):
        return nan
    values = _values(reference, context.paper.kept_measure, context)
    n_members = {sequence.name: len(sequence.members) for sequence in claim.sequences}
    share = values["value"] / values["sequence"].map(n_members)
    successes = pd.Series(success(share), values.index)
    return float(successes.groupby(values["tracker"]).mean().max())


def _lost_before(claim: Claim, claim_cases: list[Case], context: Context) -> float:
    """Return the share of scenes in which most runs lose the target before the event.

    A scene in which exactly half of the runs lose it counts as half.
    """
    if claim.measure.lost_before is None or not claim.trackers:
        return nan
    values = _values(claim_cases, claim.measure.lost_before, context)
    return float(success(values["value"]).mean()) if len(values) else nan


def _failed(claim_cases: list[Case], context: Context) -> str:
    """Return a sentence on failed runs with the reason of the first; empty if none failed."""
    records = [
        measured.record
        for case in claim_cases
        for scene in case.scenes_of_members
        for measured in context.runs.measured_runs(case.tracker, scene)
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
