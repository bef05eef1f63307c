"""Evidence for claims: values by scene from stored runs or rendered scenes, or times."""

from math import inf, nan

import numpy as np
import pandas as pd

from trackmark.bench.claims.claim_tests import Evidence
from trackmark.bench.claims.claims_file import Claim
from trackmark.bench.claims.row_verdicts import SETTINGS, VerdictRow, judge_row
from trackmark.bench.pages.page_frames import Watch
from trackmark.bench.papers.measures import Measure, find_measure
from trackmark.bench.papers.plan import scene_names, tracker_text
from trackmark.bench.papers.runs import Context
from trackmark.bench.papers.scene_values import scene_values
from trackmark.bench.statistics.verdict_rules import success

BOUNDED = ("share", "overlap")  # units of measures with values in [0, 1]


def verdict_rows(context: Context, watch: Watch = lambda *_: None) -> list[VerdictRow]:
    """Judge all claims in both settings; `watch` gets the number of judged claims and of all."""
    rows = list[VerdictRow]()
    for claim in context.claims.values():
        watch(len(rows), len(context.claims))
        of_claim = {setting: evidence(claim, setting, context) for setting in SETTINGS}
        rows.append(judge_row(claim, of_claim))
    return rows


def evidence(claim: Claim, setting: str, context: Context) -> Evidence:
    """Return the values from which a claim is judged in a setting."""
    module, _, name = claim.measure.partition(".")
    if module == "timing":
        return _times(claim, setting, context, name)
    if module == "scenes":
        return _of_scenes(claim, setting, context, name)
    measure = find_measure(claim.measure, context.description.name)
    first = _values(claim, claim.of or claim.better, setting, context, measure)
    second = _values(claim, claim.worse, setting, context, measure)
    members = max(len(context.description.sequences[name].members) for name in claim.sequences)
    return Evidence(
        first,
        second,
        lower_is_better=measure.lower_is_better,
        largest=float(members) if measure.unit in BOUNDED else inf,
        unit=measure.unit,
        counted="set" if members > 1 else "scene",
        reference_kept=_kept_share(claim, setting, context),
        lost_before=_lost_before(claim, setting, context, measure),
        failed=_failed(claim, setting, context),
    )


def _values(
    claim: Claim, trackers: tuple[str, ...], setting: str, context: Context, measure: Measure
) -> pd.DataFrame:
    pieces = [
        context.runs.values(
            tracker_text(context.description, tracker, setting), sequence, measure, claim.n_scenes
        )
        for tracker in trackers
        for sequence in claim.sequences
    ]
    return pd.concat(pieces, ignore_index=True) if pieces else pd.DataFrame()


def _kept_share(claim: Claim, setting: str, context: Context) -> float:
    """Return the share of scenes in which the reference of a no-worse test keeps the target."""
    if not claim.test.startswith("no-worse"):
        return nan
    measure = find_measure("kept", context.description.name)
    values = _values(claim, claim.worse, setting, context, measure)
    members = {k: len(sequence.members) for k, sequence in context.description.sequences.items()}
    share = values["value"] / values["sequence"].map(members)
    successes = pd.Series(success(share), values.index)
    return float(successes.groupby(values["tracker"]).mean().max())


def _lost_before(claim: Claim, setting: str, context: Context, measure: Measure) -> float:
    """Return the share of scenes in which most runs lose the target before the event.

    A scene in which exactly half of the runs lose it counts as half.
    """
    if measure.lost_before is None or not claim.of:
        return nan
    before = Measure(measure.lost_before, f"lost before {measure.text}", "share", True, None)
    values = _values(claim, claim.of, setting, context, before)
    return float(success(values["value"]).mean()) if len(values) else nan


def _failed(claim: Claim, setting: str, context: Context) -> str:
    """Return a sentence on failed runs with the reason of the first; empty if none failed."""
    texts = [tracker_text(context.description, tracker, setting) for tracker in claim.trackers]
    scenes = [
        member
        for sequence in claim.sequences
        for members in scene_names(context.description, sequence, claim.n_scenes)
        for member in members
    ]
    failures = [
        line for text in texts for scene in scenes for line in context.runs.failures(text, scene)
    ]
    total = sum(len(context.runs.files(text, scene)) for text in texts for scene in scenes)
    if not failures:
        return ""
    return f"{len(failures)} of {total} runs failed and count as lost. First: {failures[0]}"


def _of_scenes(claim: Claim, setting: str, context: Context, name: str) -> Evidence:
    function = context.function(f"scenes.{name}")
    unit, lower_is_better, _ = function.declared
    pieces = []
    for sequence in claim.sequences or ("",):
        if sequence:
            named = scene_names(context.description, sequence, claim.n_scenes)
            scenes = [members[0] for members in named]
        else:
            scenes = [str(number) for number in range(claim.n_scenes)]
        values = scene_values(function, scenes, setting, context.folder, context.jobs)
        rows = {"sequence": sequence, "rank": np.arange(len(scenes)), "scene": scenes}
        pieces.append(pd.DataFrame({**rows, "tracker": "", "value": values}))
    return Evidence(
        pd.concat(pieces, ignore_index=True),
        lower_is_better=lower_is_better,
        largest=1.0 if unit in BOUNDED else inf,
        unit=unit,
        counted="scene" if claim.sequences else "run",
    )


def _times(claim: Claim, setting: str, context: Context, name: str) -> Evidence:
    function = context.function(f"timing.{name}")
    unit, *_ = function.declared
    return Evidence(times=function(context, setting), unit=unit)
