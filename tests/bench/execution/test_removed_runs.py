"""Removal of stored runs while a command stores others."""

import pytest

from trackmark.bench.execution.executor import Execution
from trackmark.bench.experiments.experiment import Experiment, SequenceSpec
from trackmark.bench.store import runs as runs_module
from trackmark.bench.store.database import open_database
from trackmark.bench.store.maintenance import find_damage
from trackmark.bench.store.run_store import RunStore
from trackmark.bench.store.runs import Runs


@pytest.fixture
def execution(workspace, otb, in_this_process):
    """Return an execution of two tasks, each with one run."""
    otb(workspace / "data" / "Other", 5)
    sources = (SequenceSpec(str(workspace / "data" / name)) for name in ("Small", "Other"))
    return Execution(Experiment("trial", ("static",), tuple(sources)), workspace, jobs=1)


def test_removal_during_a_command_loses_only_removed_runs(execution):
    results = RunStore(execution.folder)
    rows = execution.rows()
    first = next(rows)
    results.remove(results.list_keys())
    later = [row["sequence"] for row in rows]
    assert first["sequence"] not in later
    assert later
    runs = Runs.open(execution.folder).table
    assert runs[runs["status"] == "finished"]["sequence"].tolist() == later
    assert find_damage(execution.folder) == []


def test_run_opens_the_database_once_per_task(execution, monkeypatch):
    opened = []

    def spy(folder, **options):
        opened.append(options)
        return open_database(folder, **options)

    rows = execution.rows()
    next(rows)
    for module in ("truth", "run_store", "runs"):
        monkeypatch.setattr(f"trackmark.bench.store.{module}.open_database", spy)
    assert len(list(rows)) == 1
    assert len(opened) == 1


def test_missing_ground_truth_costs_only_its_runs(run_trial, workspace, otb, caplog):
    otb(workspace / "data" / "Other", 5)
    sequences = [str(workspace / "data" / name) for name in ("Small", "Other")]
    folder = run_trial(workspace, ["static"], sequences)
    with open_database(folder, for_writing=True) as database:
        database.delete("truth", "sequence = ?", "Other")
    runs = Runs.open(folder).table.set_index("sequence")
    assert runs["status"].to_dict() == {"Small": "finished", "Other": "missing"}
    assert "no ground truth of Other" in caplog.text
    assert len(find_damage(folder)) == 1


def test_run_removed_before_its_scoring_is_named(run_trial, workspace, monkeypatch, caplog):
    folder = run_trial(workspace, ["static", "camshift"], [str(workspace / "data" / "Small")])
    with open_database(folder, for_writing=True) as database:
        database.delete("score")
    plain = RunStore.read

    def read_after_removal(store, key):
        store.remove([key])
        return plain(store, key)

    # Runs that exceed the memory limit are read again, and can be missing then.
    monkeypatch.setattr(runs_module, "MAX_KEPT", 0)
    with monkeypatch.context() as patch:
        patch.setattr(RunStore, "read", read_after_removal)
        assert Runs.open(folder).table["status"].tolist() == ["missing", "missing"]
    assert "has no run of camshift on Small, repetition 0" in caplog.text
