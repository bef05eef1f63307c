"""Pool of workers: equal results for any number of workers, repetition after harm, limits."""

import os
import signal
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.bench.conftest import KNOB_TRACKER
from tests.bench.engine.conftest import command_line
from trackmark import bench
from trackmark.bench.engine import engine, heartbeat, pool
from trackmark.bench.engine.pool import Pool, Worker
from trackmark.bench.engine.work_unit import Limits
from trackmark.bench.execution.executor import Execution, run_experiment
from trackmark.bench.execution.plan import make_plan
from trackmark.bench.execution.scheduling import missing_units
from trackmark.bench.experiments.experiment import Experiment, ExperimentError, SequenceSource
from trackmark.bench.experiments.tracker_files import resolve_trackers
from trackmark.bench.machine_errors import MachineError
from trackmark.bench.store.files import ResultsError
from trackmark.bench.store.layout import run_key
from trackmark.bench.store.results import Results
from trackmark.bench.store.run_rows import list_scored_runs
from trackmark.datasets import SequenceError, readers

FRAMES = 12

# Statement in each update, by tracker name.
ACTS = {
    "Averages": "np.mean([1.0])",
    "Raises": "raise ValueError('no wish')",
    "Ends": "os._exit(3)",
    "Spoils": "np.mean = lambda *a: 0.5; os.umask(0o777)",
    "LeavesThread": "_thread.start_new_thread(time.sleep, (1e6,))",  # `threading` does not list it
    "LeavesDaemon": "subprocess.Popen(['sleep', DAEMON], env={}, start_new_session=True)",
    "Reads": "self.box = self.box + [np.mean([1.0]), 0, 0, 0]",
    "ChangesItsFile": "Path(__file__).write_text('#')",
    "Prints": "print(end='.', flush=True)",
}
HEAD = f"""
import _thread, os, subprocess, time
from pathlib import Path
import numpy as np
DAEMON = "86413.{os.getpid()}"
"""


@pytest.fixture
def data(workspace, otb):
    """Return a folder with two sequences and a file with the trackers of `ACTS`."""
    for name in "AB":
        otb(workspace / "data" / name, FRAMES)
    source = HEAD + KNOB_TRACKER.replace("class Knob(", "class Base(")
    for name, act in ACTS.items():
        source += f"\n\nclass {name}(Base):\n    def update(self, image):\n        {act}\n"
        source += "        return super().update(image)\n"
    (workspace / "acts.py").write_text(source)
    return workspace


def experiment(data, *names, sequences="AB", name="trial", **options):
    """Return an experiment; capitalised names are of `ACTS`."""
    trackers = [f"{data}/acts.py:{name}" if name[0].isupper() else name for name in names]
    sources = tuple(SequenceSource(str(data / "data" / sequence)) for sequence in sequences)
    return Experiment(name, tuple(trackers), sources, **options)


def failures(folder):
    """Return the failures by tracker class, sequence and repetition; empty for finished runs."""
    return {
        (row["tracker"].rpartition(":")[2], row["sequence"], row["repetition"]): row["failure"]
        for row in list_scored_runs(Results(folder))
    }


def one_unit(data, *names, repetitions=1):
    """Return the planned units of the trackers on sequence A as a single unit."""
    requested = experiment(data, *names, sequences="A", repetitions=repetitions)
    units = list(missing_units(make_plan(requested, Results(data / "none"))))
    return replace(units[0], entries=tuple(entry for unit in units for entry in unit.entries))


@pytest.fixture
def tasks(monkeypatch):
    """Record the number of runs of each request, and whether it was for a fresh process."""
    requests = []
    plain = Worker.send

    def send(self, request):
        requests.append((len(request.unit.entries), not self._used))
        plain(self, request)

    monkeypatch.setattr(Worker, "send", send)
    return requests


def test_one_worker_or_two_give_the_results_of_evaluate(
    data, contents, without_processes, monkeypatch
):
    names = ("static", f"{data}/knob.py:Knob", "camshift")
    requested = experiment(data, *names, repetitions=2)
    with without_processes():
        folder_without_workers = run_experiment(
            replace(requested, name="one"), data / "results", jobs=1
        )
    opened, read = [], readers.read
    monkeypatch.setattr(readers, "read", lambda *args: opened.append(args[0]) or read(*args))
    execution = Execution(requested, data / "results", jobs=2)
    seen = []
    list(execution.rows(seen.append))
    assert len(execution.units) == 4
    assert len(opened) == 4  # each sequence for the plan and for its ground truth
    assert len(contents(folder_without_workers)) == 2 * 4
    assert contents(folder_without_workers) == contents(execution.folder)
    assert execution.units.work == seen[-1] == 2 * FRAMES * 4
    assert 0 <= min(seen) <= max(seen) <= execution.units.work
    results = Results(folder_without_workers)
    for row in list_scored_runs(results):
        stored = results.read(run_key(row))
        tracker = row["tracker"].replace("knob.py", f"{data}/knob.py")
        alone = bench.evaluate_run(tracker, str(data / "data" / row["sequence"]), row["repetition"])
        assert alone.identity == stored.identity
        np.testing.assert_array_equal(alone.boxes, stored.boxes)
    assert Execution(replace(requested, name="one"), data / "results").units.runs == 0


@pytest.mark.parametrize(
    "options",
    [
        pytest.param({"protocol": "tre:starts=3:least=2"}, marks=pytest.mark.slow, id="tre"),
        pytest.param({"timing": True}, id="timing"),
        pytest.param({"arrays": True}, marks=pytest.mark.slow, id="arrays"),
    ],
)
def test_run_of_a_worker_equals_that_of_this_process(data, without_processes, options):
    names = ("camshift:window=adaptive",)
    requested = experiment(data, *names, sequences="A", **options)
    worker_folder = run_experiment(requested, data / "results", jobs=1)
    with without_processes():
        local_folder = run_experiment(replace(requested, name="here"), data / "results", jobs=1)
    (row,) = list_scored_runs(Results(worker_folder))
    a, b = (Results(folder).read(run_key(row)) for folder in (worker_folder, local_folder))
    assert a.identity == b.identity
    assert a.arrays.keys() == b.arrays.keys()
    for frame, named in a.arrays.items():
        assert {n: v.tobytes() for n, v in named.items()} == {
            n: v.tobytes() for n, v in b.arrays[frame].items()
        }
    for name in ("boxes", "visible", "confidence"):
        assert getattr(a, name).tobytes() == getattr(b, name).tobytes()
    assert [s.tolist() for s in a.segments] == [s.tolist() for s in b.segments]
    assert (a.times is None) == (b.times is None)
    assert a.circumstances.keys() == b.circumstances.keys()


def test_harmful_tracker_gets_units_of_its_own(data, tasks):
    unit = one_unit(data, "static", "Ends", "Averages")
    units = [unit, replace(unit, fingerprint="again")]
    with closing(Pool(Limits())) as workers:
        runs_by_unit = dict(workers.perform(units))
    for runs in runs_by_unit.values():
        assert runs.keys() == set(unit.entries)
        failed = {run.identity.tracker_name for run in runs.values() if run.failure}
        assert failed == {"acts.py:Ends"}
    alone = recorded = (1, True)
    assert tasks[:5] == [(3, True), alone, alone, recorded, alone]
    assert tasks[5:] == [(2, False), alone, recorded]


def test_equal_failures_of_a_tracker_are_repeated_once(data, tasks):
    unit = one_unit(data, "static", "Raises", repetitions=5)
    with closing(Pool(Limits())) as workers:
        ((_, runs),) = workers.perform([unit])
    failed = [run.identity.tracker_name for run in runs.values() if run.failure]
    assert (len(runs), failed) == (6, ["acts.py:Raises"] * 5)
    assert tasks == [(6, True), (1, True)]


def test_tracker_file_shares_no_process(data, contents, without_processes):
    names = ("Reads", "static")
    with without_processes():
        plain = run_experiment(experiment(data, *names), data / "plain", jobs=1)
    spoilt = run_experiment(experiment(data, "Spoils", *names), data / "spoilt", jobs=1)
    boxes = contents(spoilt)
    assert {path: boxes[path] for path in contents(plain)} == contents(plain)
    modes = {file.stat().st_mode & 0o777 for file in spoilt.rglob("*") if file.is_file()}
    assert modes == {(plain / "runs.db").stat().st_mode & 0o777}


def test_each_tracker_is_timed_in_a_process_of_its_own(data, monkeypatch):
    processes = {}
    plain = Worker.send

    def send(self, request):
        (entry,) = request.unit.entries
        processes.setdefault(entry.tracker, set()).add(self._process.pid)
        plain(self, request)

    monkeypatch.setattr(Worker, "send", send)
    folder = run_experiment(
        experiment(data, "LeavesThread", "static", timing=True), data / "results", jobs=1
    )
    assert set(failures(folder).values()) == {""}
    first, second = processes.values()
    assert not first & second


def test_processes_that_a_tracker_or_its_import_starts_are_ended(data, wait_until):
    run_experiment(experiment(data, "LeavesDaemon", sequences="A"), data / "results", jobs=1)
    command = f"sleep 86414.{os.getpid()}"
    start = f"import subprocess\nsubprocess.Popen({command.split()}, start_new_session=True)\n"
    (data / "starts.py").write_text(start + KNOB_TRACKER)
    resolve_trackers([f"{data}/starts.py"])
    for number in (86413, 86414):
        wait_until(lambda number=number: not running(f"sleep {number}.{os.getpid()}"))


def running(command):
    numbers = [int(place.name) for place in Path("/proc").glob("[0-9]*")]
    return [number for number in numbers if command in command_line(number)]


def test_tracker_whose_file_changes_while_it_runs_leaves_nothing(data):
    with pytest.raises(SequenceError, match="changed during its runs"):
        run_experiment(experiment(data, "ChangesItsFile", sequences="A"), data / "results", jobs=1)
    assert Results(data / "results" / "trial").list_keys() == []


def test_output_of_a_worker_is_cut_to_its_end(data, monkeypatch):
    monkeypatch.setattr(pool, "_MAX_OUTPUT", 50_000)
    sizes = []
    plain = Worker.check

    def check(self, ready):
        self._output.write(b"loud" * 10_000)  # output of the worker before each check
        answer = plain(self, ready)
        sizes.append(os.fstat(self._output.fileno()).st_size)
        return answer

    monkeypatch.setattr(Worker, "check", check)
    with closing(Pool(Limits())) as workers:
        ((_, runs),) = workers.perform([one_unit(data, "Raises")])
    assert len(sizes) > 1
    assert max(sizes) < 100_000
    assert [run.output for run in runs.values()] == ["loud" * (1 << 12)]


def test_output_of_a_run_excludes_that_of_earlier_runs(data):
    unit = one_unit(data, "Prints")
    with closing(Pool(Limits())) as workers:
        both = [runs for _, runs in workers.perform([unit, replace(unit)])]
    assert [run.output for runs in both for run in runs.values()] == ["." * (FRAMES - 1)] * 2


def test_worker_that_is_killed_while_it_starts_is_replaced_once(data, monkeypatch):
    kills = []
    plain = Worker.send

    def send(self, request):
        if len(kills) < most:
            kills.append(self._process.pid)
            os.kill(self._process.pid, signal.SIGKILL)
        plain(self, request)

    monkeypatch.setattr(Worker, "send", send)
    unit = one_unit(data, "static")
    most = 1
    with closing(Pool(Limits())) as workers:
        ((_, runs),) = workers.perform([unit])
    assert [run.failure for run in runs.values()] == [""]
    kills, most = [], 2
    with closing(Pool(Limits())) as workers, pytest.raises(ResultsError, match="cannot start"):
        list(workers.perform([unit]))


def test_unknown_engine_is_named_with_the_closest():
    with pytest.raises(ExperimentError, match=r"unknown engine 'lokal'\. Did you mean 'local'"):
        engine("lokal")
    with pytest.raises(ExperimentError, match="--address"):
        engine("local", address="tcp://somewhere")


@pytest.mark.parametrize("name", ["frame_seconds", "run_seconds", "memory_bytes"])
@pytest.mark.parametrize("value", [0, -1, float("nan")])
def test_limit_that_can_not_be_kept_is_refused(name, value):
    with pytest.raises(ExperimentError, match=name):
        Limits(**{name: value})


def test_full_disk_of_a_worker_is_no_failure_of_a_tracker(data, monkeypatch):
    """A worker whose message does not fit on the disk reports this by a number."""

    def read_state(self):
        return heartbeat.read_state(self._shared.fileno())._replace(length=heartbeat.NO_ROOM)

    monkeypatch.setattr(Worker, "read_state", read_state)
    with pytest.raises(MachineError, match="no space for temporary files"):
        run_experiment(experiment(data, "Averages"), data, jobs=1)
    assert Results(data / "trial").list_keys() == []


def test_full_disk_during_a_call_is_no_failure_of_the_tracker(data):
    statement = "raise OSError(28, 'No space left on device', '/dev/shm/frame')"
    (data / "full.py").write_text(KNOB_TRACKER.replace("return Estimate", f"{statement}  #"))
    sources = (SequenceSource(str(data / "data" / "A")),)
    requested = Experiment("trial", (f"{data}/full.py",), sources)
    with pytest.raises(MachineError, match=r"Knob on A, .*: /dev/shm/frame: No space left .* Free"):
        run_experiment(requested, data, jobs=1)
    assert Results(data / "trial").list_keys() == []
