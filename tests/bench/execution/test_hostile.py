"""Hostile trackers fail only their own runs; other runs stay equal to the bit."""

import os
import re
import runpy
import warnings
from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest

from tests.bench.execution import hostile, hostile_answers
from trackmark import datasets
from trackmark.bench.evaluation.loop import evaluate_run, run_protocol
from trackmark.bench.execution.pool import Pool
from trackmark.bench.execution.task import Limits, PlannedRun, Task
from trackmark.bench.execution.worker import run_task
from trackmark.bench.experiments.experiment import SequenceSpec
from trackmark.bench.experiments.tracker_spec import parse_tracker, run_identity

FRAMES = 12


@pytest.fixture(scope="module")
def data_folder(tmp_path_factory, otb):
    """Create a folder with a sequence and the trackers; `faulthandler` escapes its name."""
    folder = tmp_path_factory.mktemp("grün")
    (folder / "hostile.py").write_text(hostile.source(folder / "hangs"))
    otb(folder / "A", FRAMES, first=0)
    return folder


@pytest.fixture
def clock_of_hangs(data_folder, monkeypatch):
    """Let the clock of time limits go on only while a tracker hangs, however busy the machine."""
    seconds = 0.0

    def monotonic():
        nonlocal seconds
        marker = data_folder / "hangs"
        try:
            os.kill(int(marker.read_text()), 0)
        except (FileNotFoundError, ValueError, ProcessLookupError):
            return seconds
        seconds += 30
        return seconds

    monkeypatch.setattr("trackmark.bench.external.process.monotonic", monotonic)


@pytest.fixture(scope="module")
def lock_step(data_folder):
    """Return a task of calm trackers and hostile ones, by their names."""
    sequence = datasets.load(str(data_folder / "A"))

    def make(*names):
        texts = ["static", *(f"{data_folder}/hostile.py:{name}" for name in ("Calm", *names))]
        specs = {text: parse_tracker(text) for text in texts}
        runs = [PlannedRun(text, run_identity(specs[text], sequence, 0)) for text in texts]
        return Task(SequenceSpec(str(data_folder / "A")), tuple(runs), FRAMES)

    return make


def by_class(runs):
    assert not isinstance(runs, Exception), runs
    return {run.identity.tracker.rpartition(":")[2]: run for run in runs}


def run_in_pool(*tasks):
    """Return the runs of each task by class."""
    with closing(Pool(1, Limits(memory_bytes=1 << 30))) as pool:
        return [by_class(result) for _, result in pool.run_tasks(tasks)]


@pytest.fixture(scope="module")
def undisturbed(data_folder):
    """Return the content of the calm trackers' runs without hostile trackers."""
    texts = {"static": "static", "Calm": f"{data_folder}/hostile.py:Calm"}
    return {
        name: content(evaluate_run(text, str(data_folder / "A"))) for name, text in texts.items()
    }


def content(run):
    details = {name: values.tobytes() for name, values in run.details.items()}
    return run.failure, run.boxes.tobytes(), details


def wrong(runs, names, undisturbed):
    """Return the runs that differ from what is expected, with the expected pattern or content."""
    assert runs.keys() == {*undisturbed, *names}
    differences = [
        name for name, expected in undisturbed.items() if content(runs[name]) != expected
    ]
    for name in names:
        pattern, run = hostile.CLASSES[name][0], runs[name]
        reason = run.failure.partition("\n")[0]
        as_expected = re.search(pattern, reason) if pattern else not reason
        if not as_expected:
            differences.append((name, pattern, reason))
        assert len(run.failure) < 100_000
        assert len(run.tracker_output) < 20_000
    return differences


def test_hostile_trackers_of_one_task_cost_their_own_runs(lock_step, undisturbed, capfd):
    (runs,) = run_in_pool(lock_step(*hostile.EVERYDAY))
    assert "famous last" in runs["PrintsAndEnds"].failure
    assert np.isfinite(runs["Segfaults"].boxes[:, 0]).tolist() == [True] * 3 + [False] * 9
    assert wrong(runs, hostile.EVERYDAY, undisturbed) == []
    assert "loud" not in "".join(capfd.readouterr())


def test_tracker_that_hangs_costs_its_own_run(lock_step, clock_of_hangs, undisturbed):
    runs = by_class(run_task(lock_step("HangsWithoutThreads"), Limits(frame_seconds=2)))
    assert wrong(runs, ["HangsWithoutThreads"], undisturbed) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in hostile.CLASSES if hostile.hangs(name)])
def test_each_tracker_that_hangs_costs_its_own_run(lock_step, clock_of_hangs, undisturbed, name):
    runs = by_class(run_task(lock_step(name), Limits(frame_seconds=2)))
    assert wrong(runs, [name], undisturbed) == []


@pytest.mark.slow
def test_each_hostile_tracker_is_contained_in_lock_step(lock_step, undisturbed):
    """Run each tracker twice in its own tasks: the second run meets what the first has left."""
    names = [name for name in hostile.CLASSES if not hostile.hangs(name) for _ in range(2)]
    outcomes = zip(names, run_in_pool(*map(lock_step, names)), strict=True)
    differences = [wrong(runs, [name], undisturbed) for name, runs in outcomes]
    assert [item for items in differences for item in items] == []


def test_errors_and_malformed_estimates_cost_one_run(tmp_path, data_folder):
    """Run the hostile trackers in one pass over a sequence, next to calm trackers."""
    (tmp_path / "answers.py").write_text(hostile_answers.source())
    classes = runpy.run_path(str(tmp_path / "answers.py"))
    first, *others = map(parse_tracker, [f"{data_folder}/hostile.py:Calm", "static"])

    def hostile_tracker(name):
        kind = classes[name]
        return replace(
            first, label=name, name=name, make=lambda seed: kind(kind.Parameters(), seed)
        )

    rows = hostile_answers.ROWS
    sequence = datasets.load(str(data_folder / "A"))
    chosen = [first, *map(hostile_tracker, rows), *others]
    with warnings.catch_warnings(action="ignore"):
        runs = run_protocol([(entry, 0) for entry in chosen], sequence).runs
    for entry, run in zip(chosen, runs, strict=True):
        reason, _, _ = run.failure.partition("\n")
        if entry.name not in rows:
            (alone,) = run_protocol([(entry, 0)], sequence).runs
            assert reason == ""
            assert run.boxes.tobytes() == alone.boxes.tobytes()
        else:
            act, words = rows[entry.name]
            assert bool(reason) == bool(words), (act, reason)
            assert re.search(words, reason), (act, reason)
            assert len(run.failure) < 100_000, act
            if words:
                assert run.failure.startswith("0003.png: "), act
                assert np.isfinite(run.boxes[:3]).all(), act
                assert np.isnan(run.boxes[4:]).all(), act
