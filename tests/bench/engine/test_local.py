"""Processes: same boxes on one core and two, and a worker that dies."""

import numpy as np
import pytest

from trackmark import bench
from trackmark.bench.execution.executor import Execution, run
from trackmark.bench.experiments.experiment import Experiment, SequenceSource
from trackmark.bench.store.index import read_index
from trackmark.bench.store.results import Results
from trackmark.datasets import SequenceError, readers

FRAMES = 30


@pytest.fixture
def data(here, otb):
    """Two sequences, so that there is something to share out and to interrupt."""
    for name in "AB":
        otb(here / "data" / name, FRAMES)
    return here


def experiment(data, name="trial", trackers=("static", "{}/knob.py:Knob", "camshift"), seeds=2):
    return Experiment(
        name,
        tuple(text.format(data) for text in trackers),
        tuple(SequenceSource(str(data / "data" / s)) for s in "AB"),
        repetitions=seeds,
    )


def test_one_process_or_two_make_the_results_of_evaluating_one_by_one_and_none_again(
    data, contents, without_processes, monkeypatch
):
    with without_processes():
        one = run(experiment(data, "one"), data / "results", jobs=1)
    opened, read = [], readers.read
    monkeypatch.setattr(readers, "read", lambda *given: opened.append(given[0]) or read(*given))
    execution = Execution(experiment(data), data / "results", jobs=2)
    seen = []
    list(execution.rows(seen.append))
    assert len(execution.units) == 4
    assert len(opened) == 4  # each sequence for the plan and for its ground truth
    assert len(contents(one)) == 2 * 4
    assert contents(one) == contents(execution.folder)
    assert execution.work == seen[-1] == 2 * FRAMES * 4
    assert min(seen) >= 0
    assert max(seen) <= execution.work
    assert 0 < execution.overhead < 0.01
    results = Results(one)
    for row in read_index(results):
        stored = results.read(one / row["path"])
        tracker = row["tracker"].replace("knob.py", f"{data}/knob.py")
        path = data / "data" / row["sequence"]
        alone = bench.evaluate(tracker, str(path), row["repetition"])
        assert alone.identity == stored.identity
        np.testing.assert_array_equal(alone.boxes, stored.boxes)
    times = {file: file.stat().st_mtime_ns for file in results.files()}
    assert Execution(experiment(data, "one"), data / "results").units.runs == 0
    run(experiment(data, "one"), data / "results")
    assert {file: file.stat().st_mtime_ns for file in results.files()} == times


@pytest.mark.parametrize(
    "death",
    [
        pytest.param("import os; os._exit(3)", marks=pytest.mark.slow),
        pytest.param("import ctypes; ctypes.string_at(0)", marks=pytest.mark.slow),
    ],
)
def test_a_tracker_that_kills_its_process_costs_its_own_runs_alone(
    data, death, without_processes, contents
):
    source = (data / "knob.py").read_text()
    deadly = source.replace("return Estimate", f"{death}\n        return Estimate")
    (data / "deadly.py").write_text(deadly)
    trackers = ("static", "{}/deadly.py:Knob", "{}/knob.py:Knob")
    folder = run(experiment(data, "deadly", trackers, seeds=1), data / "results", jobs=1)
    rows = read_index(Results(folder))
    assert len(rows) == 2 * 3
    failed = [row for row in rows if row["status"] == "failed"]
    assert [row["tracker"] for row in failed] == ["deadly.py:Knob"] * 2
    assert all(row["failure"].startswith("0002.png: its process ") for row in failed)
    with without_processes():
        healthy = run(experiment(data, "healthy", trackers[::2], seeds=1), data / "results")
    alive = {path: found for path, found in contents(folder).items() if "deadly" not in path}
    assert alive == contents(healthy)


@pytest.mark.slow
def test_two_workers_are_at_work_at_once(data):
    file = data / "knob.py"
    file.write_text(file.read_text().replace("return Estimate", PAUSE))
    both = experiment(data, "both", ("{}/knob.py:Knob",), seeds=1)
    execution = Execution(both, data / "results", jobs=2)
    rows = list(execution.rows())
    processes = {
        Results(execution.folder).read(execution.folder / row["path"]).details["process"][5]
        for row in rows
    }
    assert len(processes) == 2


PAUSE = """import os, time; time.sleep(0.01)
        return Estimate(self.box, details={"process": float(os.getpid())})  #"""


@pytest.mark.slow
def test_a_culprit_is_found_without_repeating_everybody_alone(data):
    """By the board: the one that was called last is repeated, and the others together."""
    mixed = data / "mixed.py"
    death = "import os; self.parameters.knob == 3 and os._exit(3)\n        return Estimate"
    count = (
        f"self.parameters.knob == 1 and open({str(data / 'inits')!r}, 'a').write('x')\n"
        "        self.box = box"
    )
    text = (data / "knob.py").read_text().replace("return Estimate", death)
    mixed.write_text(text.replace("self.box = box", count))
    chosen = Experiment(
        "mixed",
        (f"{mixed}:Knob:knob=3", f"{mixed}:Knob"),
        (SequenceSource(str(data / "data" / "A")),),
        repetitions=8,
    )
    folder = run(chosen, data / "results", jobs=1)
    statuses = [(row["tracker"], row["status"]) for row in read_index(Results(folder))]
    assert (
        sorted(statuses)
        == [("mixed.py:Knob", "finished")] * 8 + [("mixed.py:Knob:knob=3", "failed")] * 8
    )
    # Eight culprits are peeled off one by one; the others run together each time.
    assert len((data / "inits").read_text()) == 8 * 9


def test_a_tracker_that_changes_while_it_runs_leaves_nothing(data):
    file = data / "knob.py"
    edit = "import pathlib; pathlib.Path(__file__).write_text('#')\n        return Estimate"
    file.write_text(file.read_text().replace("return Estimate", edit))
    chosen = experiment(data, "edited", ("{}/knob.py:Knob",), seeds=1)
    with pytest.raises(SequenceError, match="changed while it ran"):
        run(chosen, data / "results", jobs=1)
    assert Results(data / "results" / "edited").files() == []
