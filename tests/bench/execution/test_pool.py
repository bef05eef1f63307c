"""Pool of workers: equal results for any number of workers, repetition of tasks, limits."""

import os
import shlex
import subprocess
import sys
from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from tests.bench.conftest import KNOB_TRACKER
from tests.bench.execution import calls
from tests.bench.execution.conftest import TRACKMARK, command_line
from trackmark.bench import operating_system
from trackmark.bench.evaluation.loop import evaluate_run, run_protocol
from trackmark.bench.execution import pool, worker
from trackmark.bench.execution.executor import Execution, run_experiment
from trackmark.bench.execution.plan import make_plan, missing_tasks
from trackmark.bench.execution.pool import Pool, Worker, map_in_workers
from trackmark.bench.execution.task import Limits, RepeatError
from trackmark.bench.experiments.experiment import Experiment, ExperimentError, SequenceSpec
from trackmark.bench.experiments.tracker_spec import parse_tracker, resolve_specs
from trackmark.bench.operating_system import MachineError
from trackmark.bench.store.database import ResultsError, run_key
from trackmark.bench.store.run_store import RunStore
from trackmark.bench.store.runs import Runs
from trackmark.datasets import SequenceError, readers

FRAMES = 12

# Statement in each update, by tracker name.
ACTS = {
    "Spoils": "np.mean = lambda *a: 0.5; os.umask(0o777)",
    "Reads": "self.box = self.box + [np.mean([1.0]), 0, 0, 0]",
    "LeavesDaemon": "subprocess.Popen(['sleep', DAEMON], env={}, start_new_session=True)",
    "ChangesItsFile": "Path(__file__).write_text('#')",
    "FillsDisk": "raise OSError(28, 'No space left on device', '/dev/shm/frame')",
}
HEAD = f"""
import os, subprocess
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
    sources = tuple(SequenceSpec(str(data / "data" / sequence)) for sequence in sequences)
    return Experiment(name, tuple(trackers), sources, **options)


@pytest.fixture
def run_with(data, monkeypatch):
    """Run a task of two trackers; workers call another function instead of `run_in_worker`."""
    monkeypatch.setenv("PYTHONPATH", str(Path.cwd()))
    requested = experiment(data, "static", "camshift", sequences="A")
    (task,) = missing_tasks(make_plan(requested, RunStore(data / "none")))

    def run(function):
        monkeypatch.setattr(pool, "run_in_worker", function)
        with closing(Pool(1, Limits())) as workers:
            ((same_task, result),) = workers.run_tasks([task])
        assert same_task == replace(task, is_isolated=same_task.is_isolated)
        return result

    return run


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
    assert len(execution.tasks) == 2
    assert len(opened) == 4  # each sequence for the plan and for its ground truth
    assert len(contents(folder_without_workers)) == 2 * 4
    assert contents(folder_without_workers) == contents(execution.folder)
    assert execution.tasks.work == seen[-1] == 2 * FRAMES * 4
    assert 0 <= min(seen) <= max(seen) <= execution.tasks.work
    results = RunStore(folder_without_workers)
    for row in Runs.open(folder_without_workers).stored_rows:
        stored = results.read(run_key(row))
        tracker = row["tracker"].replace("knob.py", f"{data}/knob.py")
        alone = evaluate_run(tracker, str(data / "data" / row["sequence"]), row["repetition"])
        assert alone.identity == stored.identity
        np.testing.assert_array_equal(alone.boxes, stored.boxes)
    assert Execution(replace(requested, name="one"), data / "results").tasks.n_runs == 0


@pytest.mark.parametrize(
    "options",
    [
        pytest.param({"protocol": "tre:starts=3:min_frames=2"}, marks=pytest.mark.slow, id="tre"),
        pytest.param({"is_timing": True}, id="timing"),
        pytest.param({"keeps_arrays": True}, marks=pytest.mark.slow, id="arrays"),
    ],
)
def test_run_of_a_worker_equals_that_of_this_process(data, without_processes, options):
    names = ("camshift:window=adaptive",)
    requested = experiment(data, *names, sequences="A", **options)
    worker_folder = run_experiment(requested, data / "results", jobs=1)
    with without_processes():
        local_folder = run_experiment(replace(requested, name="here"), data / "results", jobs=1)
    (row,) = Runs.open(worker_folder).stored_rows
    a, b = (RunStore(folder).read(run_key(row)) for folder in (worker_folder, local_folder))
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
    assert a.metadata.keys() == b.metadata.keys()


def test_task_of_a_dead_worker_is_repeated_in_isolation(run_with):
    runs = run_with(calls.die_together)
    alone = run_with(worker.run_task)
    assert [run.failure for run in runs] == ["", ""]
    for run, other in zip(runs, alone, strict=True):
        assert run.identity == other.identity
        assert run.boxes.tobytes() == other.boxes.tobytes()


@pytest.mark.parametrize(
    ("function", "reason"),
    [
        (calls.die, "ended with status 3"),
        (calls.stay_silent, "did not answer in time"),
        (calls.exhaust_memory, "the memory is exhausted"),
    ],
)
def test_task_that_ends_two_workers_is_an_error_of_the_sequence(run_with, function, reason):
    error = run_with(function)
    assert isinstance(error, SequenceError)
    assert reason in str(error)
    assert "each tracker in a process of its own" in str(error)
    assert "run the trackers one at a time" in str(error)


def test_defect_of_a_worker_is_raised_with_its_traceback(run_with):
    with pytest.raises(RuntimeError, match=r"a defect of trackmark: (.|\n)*power"):
        run_with(calls.power)


def test_worker_that_is_killed_while_it_starts_is_replaced_once(run_with, monkeypatch):
    send, kills = Worker.send, []

    def kill_and_send(self, *request):
        if len(kills) < n_kills:
            kills.append(self.process.pid)
            self.process.kill()
            self.process.wait()
        send(self, *request)

    monkeypatch.setattr(Worker, "send", kill_and_send)
    n_kills = 1
    assert [run.failure for run in run_with(worker.run_task)] == ["", ""]
    kills, n_kills = [], 2
    with pytest.raises(ResultsError, match=r"was killed by SIGKILL.*A worker cannot start"):
        run_with(worker.run_task)


def test_map_keeps_the_order_and_raises_errors(monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(Path.cwd()))
    square = partial(calls.power, exponent=2)
    assert list(map_in_workers(square, range(6), 2)) == [0, 1, 4, 9, 16, 25]
    environment = {"OMP_NUM_THREADS": "3"}
    assert list(map_in_workers(os.getenv, [*environment], 1, environment)) == ["3"]
    for function, item, error in (
        (calls.fail, -1, SequenceError),
        (calls.fail, 1, RuntimeError),
        (calls.die, 0, MachineError),
    ):
        with pytest.raises(error):
            list(map_in_workers(function, [item], 1))


def test_update_that_takes_too_long_is_repeated_in_isolation(monkeypatch):
    messages = []
    channel = worker._Channel(None)
    monkeypatch.setattr(channel, "send", lambda *message: messages.append(message))
    spec = SimpleNamespace(call_seconds=0.0, is_isolated=False)
    observer = worker._ProgressMessages(channel, [spec, spec], Limits(frame_seconds=2))
    observer._last_message = -1.0
    observer.on_tracker_return(0, 1.9)
    observer.on_frame(3, 3)
    assert messages[-1] == ("silence", (302.0, 6))
    channel.on_compile()
    observer.on_tracker_return(0, 10.0)  # compilation does not count
    with pytest.raises(RepeatError, match="longer than 2 s"):
        observer.on_tracker_return(0, 2.1)


def lacking_memory(seed):
    raise MemoryError


def test_task_that_exhausts_the_memory_is_repeated_in_isolation(make_sequence, monkeypatch):
    """Another tracker of the task can have used the memory of the worker."""
    channel = worker._Channel(None)
    monkeypatch.setattr(channel, "send", lambda *_: None)
    spec = parse_tracker(lacking_memory)
    observer = worker._ProgressMessages(channel, [spec], Limits())
    with pytest.raises(RepeatError, match="the memory is exhausted"):
        run_protocol([(spec, 0)], make_sequence(), observer=observer)


def test_tracker_file_shares_no_process(data, contents, without_processes):
    names = ("Reads", "static")
    with without_processes():
        plain = run_experiment(experiment(data, *names), data / "plain", jobs=1)
    spoilt = run_experiment(experiment(data, "Spoils", *names), data / "spoilt", jobs=1)
    boxes = contents(spoilt)
    assert {key: boxes[key] for key in contents(plain)} == contents(plain)
    modes = {file.stat().st_mode & 0o777 for file in spoilt.rglob("*") if file.is_file()}
    assert modes == {(plain / "runs.db").stat().st_mode & 0o777}


def test_processes_that_a_tracker_or_its_import_starts_are_ended(data, wait_until):
    run_experiment(experiment(data, "LeavesDaemon", sequences="A"), data / "results", jobs=1)
    command = f"sleep 86414.{os.getpid()}"
    start = f"import subprocess\nsubprocess.Popen({command.split()}, start_new_session=True)\n"
    (data / "starts.py").write_text(start + KNOB_TRACKER)
    resolve_specs([f"{data}/starts.py"])
    for number in (86413, 86414):
        wait_until(lambda number=number: not running(f"sleep {number}.{os.getpid()}"))


def running(command):
    numbers = [int(place.name) for place in Path("/proc").glob("[0-9]*")]
    return [number for number in numbers if command in command_line(number)]


def test_tracker_whose_file_changes_while_it_runs_leaves_nothing(data):
    with pytest.raises(SequenceError, match="changed during its runs"):
        run_experiment(experiment(data, "ChangesItsFile", sequences="A"), data / "results", jobs=1)
    assert RunStore(data / "results" / "trial").list_keys() == []


def test_full_disk_during_a_call_is_no_failure_of_the_tracker(data):
    with pytest.raises(MachineError, match=r"FillsDisk on A, .*: /dev/shm/frame: No space .* Free"):
        run_experiment(experiment(data, "FillsDisk", sequences="A"), data, jobs=1)
    assert RunStore(data / "trial").list_keys() == []


@pytest.mark.slow
def test_run_needs_no_space_for_temporary_files(tmp_path):
    code = f"import tempfile; tempfile.tempdir = {str(tmp_path)!r}; {TRACKMARK[2]}"
    command = [*TRACKMARK[:2], code, "run", "--trackers", "static"]
    command += ["--sequences", "plain/target", "--results-root", str(tmp_path.parent / "results")]
    room = ["mount", "-t", "tmpfs", "-o", "size=4k", "none", str(tmp_path)]
    fill = f"{shlex.join(room)} && head -c 4096 /dev/zero > {tmp_path}/full"
    if subprocess.run(["unshare", "-rm", "sh", "-c", fill], check=False).returncode:
        pytest.skip("this user may not mount a file system")
    inside = ["unshare", "-rm", "sh", "-c", f"{fill} && exec {shlex.join(command)}"]
    done = subprocess.run(inside, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr


def test_unknown_backend_is_named_with_the_closest(data):
    with pytest.raises(ExperimentError, match=r"unknown backend 'lokal'\. Did you mean 'local'"):
        run_experiment(experiment(data, "static"), data, backend="lokal")
    with pytest.raises(ExperimentError, match="--address"):
        run_experiment(experiment(data, "static"), data, address="tcp://somewhere")


def test_limit_that_can_not_be_kept_is_refused():
    for name in ("frame_seconds", "run_seconds", "memory_bytes"):
        for value in (0, float("nan")):
            with pytest.raises(ExperimentError, match=name):
                Limits(**{name: value})


def test_memory_of_a_container_counts(tmp_path, monkeypatch):
    group = tmp_path / "memory.max"
    monkeypatch.setattr(operating_system, "_CONTROL_GROUP", group)
    whole = operating_system.machine_memory()
    group.write_text("max\n")
    assert operating_system.machine_memory() == whole
    group.write_text("1048576\n")
    assert operating_system.machine_memory() == 1 << 20


def test_memory_beyond_the_limit_is_an_error():
    code = (
        "from trackmark.bench.operating_system import limit_memory; limit_memory(1 << 30)\n"
        "try: bytearray(2 << 30)\n"
        "except MemoryError: print('refused')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "refused\n"
