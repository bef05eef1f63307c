"""Tests of plans: finished runs, stale runs and the division of the rest into tasks."""

import shutil
from dataclasses import replace
from pathlib import Path

import cv2
import pytest

from trackmark import trackers
from trackmark.bench.execution.executor import run_experiment
from trackmark.bench.execution.plan import (
    MAX_TRACKER_PROCESSES,
    RunStatus,
    make_plan,
    missing_tasks,
)
from trackmark.bench.experiments.experiment import Experiment, ExperimentError, SequenceSpec
from trackmark.bench.store.run_store import RunStore
from trackmark.datasets import SequenceError

TINY = "plain/target:length=12:width=64:height=64"

pytestmark = pytest.mark.usefixtures("in_this_process")


def append(file, text):
    file.write_text(file.read_text() + text)


def experiment(workspace, **changes):
    settings = {
        "name": "trial",
        "trackers": ("static", f"{workspace / 'knob.py'}:Knob"),
        "sequences": (SequenceSpec(str(workspace / "data" / "Small")),),
        "repetitions": 3,
    } | changes
    return Experiment(**settings)


def statuses(workspace, **changes):
    chosen = experiment(workspace, **changes)
    plan = make_plan(chosen, RunStore(workspace / "results" / chosen.name))
    run_statuses = zip(plan.requested, plan.statuses.ravel(), strict=True)
    return {
        (tracker, repetition): RunStatus(status).name.lower()
        for (tracker, _, repetition, _), status in run_statuses
    }


@pytest.fixture
def finished(workspace):
    run_experiment(experiment(workspace), workspace / "results", jobs=1)
    assert set(statuses(workspace).values()) == {"finished"}
    return workspace


def test_tracker_can_have_its_own_number_of_repetitions(workspace):
    knob = f"{workspace / 'knob.py'}:Knob"
    assert len(statuses(workspace, repetitions_by_tracker={knob: 1})) == 2


@pytest.mark.slow
def test_disturbed_timing_runs_alone_are_measured_again(workspace, monkeypatch):
    run_experiment(experiment(workspace, is_timing=True), workspace / "results", jobs=1)
    monkeypatch.setattr("trackmark.bench.execution.plan.MAX_RUN_DELAY", -1.0)
    timed = experiment(workspace, is_timing=True)
    assert set(statuses(workspace, is_timing=True).values()) == {"disturbed"}
    plan = make_plan(timed, RunStore(workspace / "results" / timed.name))
    assert missing_tasks(plan).n_runs == len(plan)
    monkeypatch.setattr("trackmark.bench.execution.plan.MAX_RUN_DELAY", 1.0)
    assert set(statuses(workspace, is_timing=True).values()) == {"finished"}


def test_missing_region_is_rejected_before_first_run(workspace):
    with pytest.raises(SequenceError, match="no region 'full'"):
        statuses(workspace, trackers=("static:init=full",))


def test_changed_shared_module_makes_runs_stale(finished, monkeypatch, tmp_path):
    copy = tmp_path / "copy" / "trackers"
    shutil.copytree(Path(trackers.__file__).parent, copy)
    monkeypatch.setattr("trackmark.bench.experiments.tracker_spec.PACKAGE", copy)
    assert statuses(finished)["knob.py:Knob", 0] == "finished"
    interface = copy / "base" / "interface.py"
    append(interface, "CHANGED = True\n")
    assert statuses(finished)["knob.py:Knob", 0] == "stale"
    catalogue = copy / "base" / "catalogue.py"
    shutil.copy(Path(trackers.__file__).parent / "base" / "interface.py", interface)
    catalogue.write_text("NOTHING_DEPENDS_ON_THIS = True\n")
    assert statuses(finished)["knob.py:Knob", 0] == "finished"


def change_a_pixel(data):
    file = data / "img" / "0003.png"
    image = cv2.imread(str(file))
    image[7, 9, 1] ^= 1
    cv2.imwrite(str(file), image)


def change_a_box(data):
    file = data / "groundtruth_rect.txt"
    file.write_text(file.read_text().replace("5,6,10,12", "5,6,10,13", 1))


def touch(data):
    for file in data.rglob("*.*"):
        file.touch()


@pytest.mark.parametrize(
    ("change", "status"), [(change_a_pixel, "stale"), (change_a_box, "stale"), (touch, "finished")]
)
def test_changed_sequence_makes_runs_stale_but_mtime_does_not(finished, change, status):
    change(finished / "data" / "Small")
    assert set(statuses(finished).values()) == {status}


def test_timing_runs_are_runs_of_their_own(finished):
    timing = {"is_timing": True, "repetitions": 1}
    assert set(statuses(finished, **timing).values()) == {"missing"}
    run_experiment(experiment(finished, **timing), finished / "results")
    assert set(statuses(finished, **timing).values()) == {"finished"}
    assert set(statuses(finished).values()) == {"finished"}


def test_task_has_few_processes_of_trackers(workspace):
    (workspace / "Twin.py").write_text((workspace / "knob.py").read_text())
    texts = ("static", f"{workspace}/knob.py:Knob", "camshift", f"{workspace}/Twin.py:Knob")
    plan = small_plan(workspace, 2, trackers=texts, repetitions=3)
    tasks = list(missing_tasks(plan))
    assert len(tasks) == 2 * 2
    for task in tasks:
        n_outside = sum(".py" in run.tracker for run in task.runs)
        assert 0 < n_outside <= MAX_TRACKER_PROCESSES
    planned = {
        (task.source, run.identity.version, run.identity.repetition)
        for task in tasks
        for run in task.runs
    }
    assert len(planned) == 2 * (1 + 3 + 1 + 3)


def test_timed_trackers_take_turns(workspace):
    texts = ("static", f"{workspace}/knob.py:Knob", "camshift")
    timed = small_plan(workspace, 2, trackers=texts, repetitions=2, is_timing=True)
    tasks = list(missing_tasks(timed))
    assert [len(task.runs) for task in tasks] == [1] * 3 * 2 * 2
    trackers = [task.runs[0].tracker for task in tasks]
    assert all(sorted(trackers[i : i + 3]) == sorted(texts) for i in range(0, 12, 3))


def test_equal_trackers_are_planned_once(workspace):
    chosen = ("camshift", "camshift:window=fixed", "camshift:hue_bins=32")
    assert list(statuses(workspace, trackers=chosen)) == [("camshift", 0)]


def test_two_sequences_of_one_name_are_refused(workspace):
    other = workspace / "other" / "Small"
    shutil.copytree(workspace / "data" / "Small", other)
    sources = tuple(SequenceSpec(str(path)) for path in (workspace / "data" / "Small", other))
    assert len(statuses(workspace, sequences=sources)) == 4
    (other / "groundtruth_rect.txt").write_text("6,6,10,12\n" * 5)
    with pytest.raises(
        ExperimentError, match="two different sequences are called 'Small'"
    ) as raised:
        statuses(workspace, sequences=sources)
    assert f"{workspace / 'data' / 'Small'} and {other}. " in str(raised.value)


def test_two_trackers_of_one_name_are_refused(workspace):
    (workspace / "elsewhere").mkdir()
    shutil.copy(workspace / "knob.py", workspace / "elsewhere")
    both = tuple(f"{workspace / place / 'knob.py'}:Knob" for place in ("", "elsewhere"))
    with pytest.raises(
        ExperimentError, match=f"are called 'knob.py:Knob': {both[0]} and {both[1]}"
    ):
        statuses(workspace, trackers=both)


def test_failed_runs_are_repeated_only_on_request(workspace):
    file = workspace / "knob.py"
    file.write_text(file.read_text().replace("return Estimate", "raise ValueError  #"))
    run_experiment(experiment(workspace), workspace / "results")
    run_statuses = statuses(workspace)
    assert run_statuses["static", 0] == "finished"
    assert run_statuses["knob.py:Knob", 1] == "failed"
    plan = make_plan(experiment(workspace), RunStore(workspace / "results" / "trial"))
    assert list(missing_tasks(plan)) == []
    (task,) = missing_tasks(plan, retry_failed=True)
    assert len(task.runs) == 3
    assert plan.count(RunStatus.FAILED) == 3


def small_plan(workspace, sequences=1, **changes):
    """Return a plan: on each sequence of five frames, 1 run of a tracker and 3 of another."""
    for i in range(1, sequences):
        shutil.copytree(workspace / "data" / "Small", workspace / "data" / f"Other{i}")
    sources = tuple(SequenceSpec(str(path)) for path in sorted((workspace / "data").iterdir()))
    return make_plan(
        experiment(workspace, sequences=sources, **changes), RunStore(workspace / "none")
    )


@pytest.mark.slow
@pytest.mark.parametrize("sequences", [1, 3])
@pytest.mark.parametrize("workers", [1, 2, 3, 5, 50])
def test_tasks_fit_worker_share_and_cover_every_run_once(workspace, sequences, workers):
    plan = small_plan(workspace, sequences)
    tasks = missing_tasks(plan, n_workers=workers)
    all_tasks = list(tasks)
    assert len(tasks) == len(all_tasks)
    assert tasks.n_runs == 4 * sequences == sum(len(task.runs) for task in all_tasks)
    assert tasks.work == sum(task.work for task in all_tasks) == 4 * 5 * sequences
    for task in all_tasks:
        assert len(task.runs) == 1 or task.work * workers <= tasks.work
    runs = {
        (task.source, run.identity.version, run.identity.repetition)
        for task in all_tasks
        for run in task.runs
    }
    assert len(runs) == tasks.n_runs
    if sequences % workers == 0:
        assert len(all_tasks) == sequences
    # Distribute tasks as a pool does: no worker has more than its share and one run.
    busy = [0] * workers
    for task in all_tasks:
        busy[busy.index(min(busy))] += task.work
    assert max(busy) <= tasks.work / workers + 5


def test_longest_sequences_are_planned_first(workspace, otb):
    sources = [SequenceSpec(str(workspace / "data" / "Small"))]
    sources.append(SequenceSpec(str(otb(workspace / "data" / "Longer", 9))))
    plan = make_plan(experiment(workspace, sequences=tuple(sources)), RunStore(workspace / "none"))
    assert [task.work for task in missing_tasks(plan)] == [36, 20]


@pytest.mark.slow
def test_task_has_the_replaced_version_of_each_run(finished):
    before = make_plan(experiment(finished), RunStore(finished / "results" / "trial"))
    append(finished / "knob.py", "CHANGED = True\n")
    chosen = experiment(finished, repetitions=4)
    plan = make_plan(chosen, RunStore(finished / "results" / "trial"))
    (task,) = missing_tasks(plan)
    old = before.versions[0][1]
    assert [run.replaces for run in task.runs] == [old, old, old, ""]
    assert all(run.identity.version == plan.versions[0][1] != old for run in task.runs)


def test_opened_sequence_is_reused_by_next_plan(workspace, monkeypatch):
    opened_sequences = {}
    first = make_plan(experiment(workspace), RunStore(workspace / "none"), opened_sequences)
    monkeypatch.setattr(
        "trackmark.datasets.load", lambda *_, **__: pytest.fail("a sequence was opened")
    )
    second = make_plan(experiment(workspace), RunStore(workspace / "none"), opened_sequences)
    assert first.versions == second.versions


def test_workers_open_sequences_of_large_plan_equally(workspace, monkeypatch):
    sources = [SequenceSpec(f"{TINY}:scene={scene}") for scene in range(12)]
    large = Experiment("large", ("static",), tuple(sources[:4]))
    results, progress = RunStore(workspace / "results" / "large"), []
    alone = make_plan(large, results)
    monkeypatch.setattr("trackmark.bench.execution.plan.MIN_SEQUENCES_FOR_WORKERS", 4)
    shared = make_plan(large, results, progress=lambda *number: progress.append(number), jobs=2)
    assert progress[:4] == [(number, 4) for number in range(4)]
    for field in ("name", "fingerprint", "n_frames", "starts"):
        assert [getattr(sequence, field) for sequence in shared.sequences] == [
            getattr(sequence, field) for sequence in alone.sequences
        ]
    broken = replace(large, sequences=(SequenceSpec("no/where"), *sources[1:]))
    with pytest.raises(SequenceError, match="no/where"):
        make_plan(broken, results, jobs=2)
