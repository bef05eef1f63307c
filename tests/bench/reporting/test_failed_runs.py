"""Failed runs have the worst scores, and are named."""

from dataclasses import replace
from math import hypot

import numpy as np
import pandas as pd
import pytest

import bench
from bench import metrics
from bench.experiments.experiment import Experiment, SequenceSource
from bench.reporting import failed_runs as module
from bench.reporting.failed_runs import failed_runs, judge_failed, with_worst_scores
from bench.store.loading import load_results
from bench.store.results import Results
from bench.store.truth import read_truth
from tests.bench.conftest import KNOB_TRACKER

N_FRAMES = 15


@pytest.fixture(scope="module")
def stored(tmp_path_factory, without_processes):
    """Results of two trackers on two scenes; one tracker always fails."""
    folder = tmp_path_factory.mktemp("failed")
    text = KNOB_TRACKER.replace("return Estimate", "raise ValueError('empty')  #")
    (folder / "broken.py").write_text(text)
    sources = tuple(SequenceSource(f"plain/target:length={N_FRAMES}:scene={n}") for n in (0, 1))
    trackers = ("static", f"{folder / 'broken.py'}")
    with without_processes():
        yield bench.run(Experiment("trial", trackers, sources), folder, jobs=1)


def failed_run(folder, runs):
    row = runs[runs["status"] == "failed"].iloc[0]
    key = row["tracker"], row["sequence"], int(row["repetition"]), row["protocol"]
    run = Results(folder).read(folder / module.run_path(*key))
    return run, read_truth(folder, row["sequence"], row["fingerprint"])


def test_failed_runs_have_the_worst_native_scores(stored):
    runs = load_results(stored)
    filled = with_worst_scores(stored, runs)
    failed = filled[filled["status"] == "failed"].iloc[0]
    assert failed[["mean_overlap", "success_share", "inside_share"]].tolist() == [0, 0, 0]
    assert failed["first_loss"] == 1
    _, truth = failed_run(stored, runs)
    diagonal = hypot(*truth.image_size)
    assert (
        failed[["centre_error", "centre_error_median", "centre_error_p90"]].tolist()
        == [diagonal] * 3
    )
    assert failed["evaluated_frames"] == N_FRAMES - 1
    unchanged = runs["status"] == "finished"
    pd.testing.assert_frame_equal(filled[unchanged], runs[unchanged])


def test_failed_centre_error_is_bounded_without_an_image_size(stored):
    run, truth = failed_run(stored, load_results(stored))
    scores = judge_failed(run, replace(truth, image_size=None), "native").scores
    corners = truth.boxes[:, :2] + truth.boxes[:, 2:]
    assert scores["centre_error"] == hypot(*corners.max(axis=0))


WITHOUT_SEGMENTS = [n for n in metrics.names() if metrics.preset(n).protocol != "anchors"]


@pytest.mark.parametrize("name", WITHOUT_SEGMENTS)
def test_failed_runs_have_the_worst_scores_of_presets(without_processes, stored, name):
    run, truth = failed_run(stored, load_results(stored))
    preset = metrics.preset(name)
    if preset.protocol == "supervised":
        states = np.zeros(len(run.boxes), np.int32)
        states[0] = 1
        identity = replace(run.identity, protocol="supervised")
        run = replace(run, states=states, identity=identity)
    scores = judge_failed(run, truth, name).scores
    for key, column in preset.columns.items():
        if column.better == "higher" and key != "first_loss":
            assert scores[key] == 0, key
        elif column.better == "lower":
            assert 0 < scores[key] < np.inf, key
    if name == "vot-supervised":
        assert scores["failures"] == 3  # frames 1, 7 and 13


def test_failed_runs_are_counted_with_the_first_reason(stored):
    failures = failed_runs(load_results(stored), "0")
    (name,) = failures.left_out
    sequence = f"plain/target:length={N_FRAMES}"
    assert failures.notes == {
        name: f"2 of 2 runs failed (left out): sequence {sequence}, ValueError: empty"
    }
