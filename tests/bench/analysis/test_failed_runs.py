"""Worst scores of failed runs, and notes on them."""

from dataclasses import replace
from math import hypot

import numpy as np
import pandas as pd
import pytest

from tests.bench.conftest import KNOB_TRACKER
from trackmark import datasets
from trackmark.bench import metrics
from trackmark.bench.analysis.by_metrics import metric_tables
from trackmark.bench.analysis.score_tables import failed_runs
from trackmark.bench.evaluation.scoring import worst_result
from trackmark.bench.store.runs import Runs

N_FRAMES = 15


@pytest.fixture(scope="module")
def stored(tmp_path_factory, run_trial):
    """Provide results of three trackers on two scenes: one fails on the first, another on both."""
    folder = tmp_path_factory.mktemp("failed")
    sequences = [f"plain/target:length={N_FRAMES}:scene={n}" for n in (0, 1)]
    x = datasets.load(sequences[0]).boxes[0, 0]
    for name, condition in (("partly", f"if abs(self.box[0] - {x}) < 1e-6: "), ("broken", "")):
        statement = f"{condition}raise ValueError('empty')\n        return Estimate"
        (folder / f"{name}.py").write_text(KNOB_TRACKER.replace("return Estimate", statement))
    trackers = ("static", f"{folder / 'partly.py'}", f"{folder / 'broken.py'}")
    return Runs.open(run_trial(folder, trackers, sequences))


def failed_run(runs):
    rows = [row for row in runs.evaluated_rows() if row["status"] == "failed"]
    _, run, truth = next(runs.read(rows))
    return run, truth


def test_failed_runs_have_the_worst_native_scores(stored):
    filled = stored.scored("native")
    failed = filled[filled["status"] == "failed"].iloc[0]
    assert failed[["mean_overlap", "success_rate", "inside_rate"]].tolist() == [0, 0, 0]
    assert failed["first_loss"] == 1
    _, truth = failed_run(stored)
    diagonal = hypot(*truth.image_size)
    errors = ["centre_error", "centre_error_median", "centre_error_p90"]
    assert failed[errors].tolist() == [diagonal] * 3
    assert failed["evaluated_frames"] == N_FRAMES - 1
    unchanged = filled["status"] == "finished"
    pd.testing.assert_frame_equal(filled[unchanged], stored.table[unchanged])


def test_failed_centre_error_is_bounded_without_an_image_size(stored):
    run, truth = failed_run(stored)
    scores = worst_result(run, replace(truth, image_size=None), "native").scores
    corners = truth.boxes[:, :2] + truth.boxes[:, 2:]
    assert scores["centre_error"] == hypot(*corners.max(axis=0))


@pytest.mark.parametrize("name", ["otb", "vot-supervised", "long-term"])
def test_failed_runs_have_the_worst_scores_of_presets(stored, name):
    run, truth = failed_run(stored)
    preset = metrics.find_metrics(name)
    if preset.run_kind == "supervised":
        states = np.zeros(len(run.boxes), np.int32)
        states[0] = 1
        identity = replace(run.identity, protocol="supervised")
        run = replace(run, states=states, identity=identity)
    scores = worst_result(run, truth, name).scores
    for key, column in preset.metrics.items():
        if column.direction == "higher" and key != "first_loss":
            assert scores[key] == 0, key
        elif column.direction == "lower":
            assert 0 < scores[key] < np.inf, key
    if name == "vot-supervised":
        assert scores["failures"] == 3  # frames 1, 7 and 13


def test_failed_runs_note_has_number_and_first_reason(stored):
    failures = failed_runs(stored.table, "0")
    where = f"sequence plain/target:length={N_FRAMES}, ValueError: empty"
    assert failures.left_out == ["broken.py:Knob"]
    assert failures.notes == {
        "partly.py:Knob": f"1 of 2 runs failed (counted as 0): {where}",
        "broken.py:Knob": f"2 of 2 runs failed (left out): {where}",
    }


def test_runs_without_worst_score_are_unchanged(stored):
    filled = stored.scored("native")
    assert filled["mean_overlap"][filled["tracker"] == "broken.py:Knob"].isna().all()
    unscored = stored.scored("vot-supervised")
    assert unscored["failures"][unscored["status"] == "failed"].isna().all()


SCORES = {"native": "mean_overlap", "otb": "success_auc"}


@pytest.mark.parametrize("name", SCORES)
def test_tables_count_failed_runs_as_worst(stored, name):
    tables = {table.name: table for table in metric_tables(stored, [name]).tables}
    summary = tables["summary" if name == "native" else f"metrics-{name}"]
    data = summary.records[summary.records["measure"] == SCORES[name]]
    means = data.groupby("tracker", sort=False)["mean"].first()
    assert np.isnan(means["broken.py:Knob"])
    assert 0 < means["partly.py:Knob"] < means["static"]
    assert [note for note in summary.notes if note.startswith("partly")] == [
        "partly.py:Knob: 1 of 2 runs failed (counted as the worst score): "
        f"sequence plain/target:length={N_FRAMES}, ValueError: empty"
    ]
