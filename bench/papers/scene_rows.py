"""Runs that the numbers of a page link to: worst scenes of a claim, worst run of a cell."""

from collections.abc import Iterable
from math import isfinite, nan
from typing import NamedTuple

import numpy as np
import pandas as pd

from trackmark.bench.claims.claim_tests import scene_differences
from trackmark.bench.claims.row_verdicts import SETTINGS, VerdictRow
from trackmark.bench.papers.context import Context
from trackmark.bench.papers.description import MainRow
from trackmark.bench.papers.measures import find_measure
from trackmark.bench.papers.plan import scene_names, tracker_text

SHOWN_SCENES = 6  # of a claim in a setting
KINDS = {"overlap": "overlap", "frames": "loss"}  # of the worst frame, by unit; else by error


class ShownRun(NamedTuple):
    """A run to open at its worst frame: text forms, also of the trackers that are drawn with it."""

    tracker: str
    sequence: str
    kind: str
    beside: tuple[str, ...]


class SceneRow(NamedTuple):
    """A scene of a claim: better minus worse (NaN without sides), then one value per tracker."""

    scene: str
    numbers: list[float]
    runs: list[ShownRun | None]


def claim_scenes(row: VerdictRow, setting: str, context: Context) -> list[SceneRow]:
    """Return the scenes that speak most against a claim, worst first; none for times."""
    claim, evidence = row.claim, row.evidence[setting]
    if evidence.first.empty:
        return []
    if claim.test.startswith(("order", "no-worse")):
        order = scene_differences(claim, evidence)
    else:
        first = evidence.first.set_index(["sequence", "rank"])["value"]
        order = (-first if evidence.lower_is_better else first).groupby(level=[0, 1]).min()
    table = pd.concat([evidence.first, evidence.second]).set_index(["sequence", "rank"])
    texts = [tracker_text(context.description, name, setting) for name in claim.trackers]
    scene_rows = []
    for sequence, rank in order.sort_values(kind="stable").index[:SHOWN_SCENES]:
        scene_table = table.loc[[(sequence, rank)]]
        ahead = float(order[sequence, rank]) if claim.worse else nan
        scene, values = (
            str(scene_table["scene"].iloc[0]),
            dict(zip(scene_table["tracker"], scene_table["value"], strict=True)),
        )
        if "" in values:  # a measure of the scene, without a run
            scene_rows.append(SceneRow(scene, [ahead, values[""]], [None, None]))
            continue
        members = scene_names(context.description, sequence, claim.n_scenes)[rank]
        runs = [_worst([text], members, claim.measure, texts, context) for text in texts]
        numbers = [ahead, *(values.get(text, nan) for text in texts)]
        scene_rows.append(SceneRow(scene, numbers, [runs[0], *runs]))
    return scene_rows


def main_runs(context: Context) -> list[list[ShownRun | None]]:
    """Return the worst run behind each cell of the main table, by row and setting."""
    rows = context.description.main.rows
    return [[_main_run(row, setting, context) for setting in SETTINGS] for row in rows]


def _main_run(row: MainRow, setting: str, context: Context) -> ShownRun | None:
    texts = [tracker_text(context.description, name, setting) for name in row.trackers]
    names = [scene_names(context.description, name, context.scenes) for name in row.sequences]
    scenes = [member for sequence in names for members in sequence for member in members]
    return _worst(texts, scenes, row.measures[0], texts, context) if row.measures else None


def _worst(
    texts: list[str], scenes: Iterable[str], measured: str, beside: list[str], context: Context
) -> ShownRun | None:
    """Return the run with the worst mean over repetitions; None without runs."""
    measure = find_measure(measured, context.description.name)
    pairs = {
        (text, scene): context.runs.judged_runs(text, scene) for scene in scenes for text in texts
    }
    means = {pair: float(np.mean([*map(measure, runs)])) for pair, runs in pairs.items() if runs}
    means = {pair: mean for pair, mean in means.items() if isfinite(mean)}
    if not means:
        return None
    worst = (max if measure.lower_is_better else min)(means, key=means.__getitem__)
    return ShownRun(*worst, KINDS.get(measure.unit, "centre_error"), tuple(beside))
