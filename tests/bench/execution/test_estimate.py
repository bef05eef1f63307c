"""Tests of the estimated time of missing runs."""

import sqlite3
from dataclasses import replace

import pytest

from trackmark.bench.execution.estimate import TimeEstimate, estimate_time
from trackmark.bench.execution.executor import run_experiment
from trackmark.bench.execution.plan import make_plan, missing_tasks
from trackmark.bench.experiments.experiment import Experiment, SequenceSpec
from trackmark.bench.store.run_store import RunStore


def estimated(folder, experiment, workers=1):
    plan = make_plan(experiment, RunStore(folder / "results" / experiment.name))
    return estimate_time(missing_tasks(plan, n_workers=workers), folder / "results")


@pytest.fixture
def trial(workspace):
    sequence = SequenceSpec(str(workspace / "data" / "Small"))
    return Experiment("trial", ("static", "camshift"), (sequence,))


def test_estimate_multiplies_frames_by_measured_times(workspace, trial, in_this_process):
    folder = run_experiment(trial, workspace / "results", jobs=1)
    assert estimated(workspace, trial) == TimeEstimate(0.0, [])
    with sqlite3.connect(folder / "runs.db") as database:
        database.execute("UPDATE run SET seconds = 2 * frames, reading_seconds = 0.5")
        (frames,) = database.execute("SELECT frames FROM run").fetchone()
    again = replace(trial, name="again")
    assert estimated(workspace, again) == TimeEstimate(frames * (2 + 2 + 0.5), [])
    assert estimated(workspace, again, workers=2) == TimeEstimate(
        frames * (2 + 2 + 0.5 + 0.5) / 2, []
    )


def test_estimate_names_trackers_without_stored_runs(workspace, trial, in_this_process):
    assert estimated(workspace, trial) == TimeEstimate(0.0, ["static", "camshift"])
    run_experiment(replace(trial, trackers=("static",)), workspace / "results", jobs=1)
    only_camshift = replace(trial, name="new", trackers=("camshift",))
    assert estimated(workspace, only_camshift) == TimeEstimate(0.0, ["camshift"])
    result = estimated(workspace, replace(trial, name="again"))
    assert result.without_times == ["camshift"]
    assert result.seconds > 0
