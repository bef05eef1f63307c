"""Backend `dask`: results equal to the bit, lost workers, wrong source."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.bench.execution.conftest import TRACKMARK
from trackmark.bench.execution.cluster import ClusterError, _run_task, connect, with_absolute_paths
from trackmark.bench.execution.task import Limits, PlannedRun, Task
from trackmark.bench.experiments.experiment import SequenceSpec
from trackmark.bench.store.run_store import RunStore

ACTS = {
    "slow": "__import__('time').sleep(0.3)",
    # It kills the first Dask worker that performs it, as a lost machine would.
    "killer": """import os, pathlib, signal
        mark = pathlib.Path(__file__).with_name('killed')
        if not mark.exists():
            mark.touch()
            parent = pathlib.Path(f'/proc/{os.getppid()}/stat').read_text()  # of the task's worker
            os.kill(int(parent.rpartition(')')[2].split()[1]), signal.SIGKILL)""",
}


@pytest.fixture
def data(workspace, otb):
    """Create four sequences of 12 frames, and trackers in files."""
    pytest.importorskip("distributed", reason="the extra 'dask' is not installed")
    for name in "ABCD":
        otb(workspace / "data" / name, 12)
    for name, act in ACTS.items():
        source = (workspace / "knob.py").read_text().replace("return Estimate", f"{act}\n        #")
        (workspace / f"{name}.py").write_text(source.replace("#(", "return Estimate("))
    return workspace


@pytest.fixture
def start(data, begin):
    """Start a command in the folder of the data; all its paths are relative."""

    def start_one(name, trackers="static,knob.py:Knob,camshift", **options):
        options = {"backend": "dask", "jobs": 2} | options
        command = [*TRACKMARK, "run", "--json", "--repetitions", "2", "--name", name]
        command += ["--trackers", trackers, "--sequences", "data/A,data/B,data/C,data/D"]
        command += [f"--{option}={value}" for option, value in options.items()]
        return begin(command, data)

    return start_one


def stored_runs(data, name):
    results = RunStore(data / "results" / name)
    return [results.read(file) for file in results.list_keys()]


@pytest.mark.weekly
def test_results_of_two_workers_equal_the_local_backend(data, start, contents):
    for name in ("local", "dask"):
        command = start(name, backend=name)
        assert command.wait() == 0, command.stderr
    expected = contents(data / "results/local")
    assert len(expected) == 4 * 4
    assert contents(data / "results/dask") == expected


@pytest.mark.weekly
def test_task_of_a_lost_worker_runs_on_another(data, start):
    command = start("x", "static,killer.py:Knob")
    assert command.wait() == 0, command.stderr
    assert (data / "killed").exists()
    runs = stored_runs(data, "x")
    assert (len(runs), [run.failure for run in runs if run.failure]) == (4 * 3, [])


@pytest.mark.weekly
@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGKILL])
def test_all_processes_end_after_the_command(start, wait_until, end):
    command = start("x", "slow.py:Knob")
    assert command.process.stdout.readline()
    assert len(command.living()) >= 5  # a command, two Dask workers, their children
    os.killpg(command.process.pid, end) if end is signal.SIGINT else command.process.kill()
    command.wait()
    wait_until(lambda: not command.living())


@pytest.fixture
def scheduler(data, wait_until):
    """Start a Dask scheduler with one worker, which works in another folder."""
    address = data / "scheduler.json"
    options = ("--scheduler-file", str(address), "--no-dashboard")
    elsewhere = data / "elsewhere"
    elsewhere.mkdir()

    def start(*command):
        return subprocess.Popen(
            [sys.executable, "-m", "distributed.cli." + command[0], *command[1:], *options],
            cwd=elsewhere,
            env=os.environ | {"PYTHONPATH": os.pathsep.join([str(Path.cwd()), *sys.path])},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )

    processes = [start("dask_scheduler", "--port", "0", "--host", "127.0.0.1")]
    try:
        wait_until(address.is_file)
        processes.append(start("dask_worker", "--nthreads", "1", "--no-nanny"))
        text = json.loads(address.read_text())["address"]
        yield text, processes
    finally:
        for process in processes:
            process.kill()
            process.wait()


def wait_for_workers(address):
    code = f"from distributed import Client; Client({address!r}).wait_for_workers(1, timeout=600)"
    subprocess.run([sys.executable, "-c", code], check=True, stderr=subprocess.DEVNULL)


@pytest.mark.weekly
def test_lost_scheduler_is_reported_in_one_line(data, start, scheduler):
    address, processes = scheduler
    wait_for_workers(address)
    command = start("x", "slow.py:Knob", address=address)
    assert command.process.stdout.readline()
    processes[0].kill()
    assert command.wait() == 2
    assert "the Dask scheduler is lost" in command.stderr
    assert "run the same command again" in command.stderr.splitlines()[-1]
    assert 1 <= len(stored_runs(data, "x")) < 8


@pytest.mark.parametrize(
    ("typed", "sent"),
    [
        ("own.py:Own:step=2", "{}/own.py:Own:step=2"),
        ("own.py", "{}/own.py:"),
        ("own.py:as=mine", "{}/own.py:as=mine"),
        ("camshift:window=adaptive", "camshift:window=adaptive"),
    ],
)
def test_path_of_a_tracker_file_is_sent_as_absolute(typed, sent):
    task = Task(SequenceSpec("samples/face"), (PlannedRun(typed, None),), 120)
    (run,) = with_absolute_paths(task).runs
    assert run.tracker == sent.format(Path.cwd())


def test_worker_with_another_source_is_refused(monkeypatch):
    monkeypatch.setattr("socket.gethostname", lambda: "node-7")
    task = Task(SequenceSpec("samples/face"), (), 120)
    error = _run_task("command", Limits(), "another", task)
    assert isinstance(error, ClusterError)
    assert str(error).startswith("the worker on node-7 has another version of trackmark's source")


def test_missing_dask_is_one_line_with_the_remedy(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(
        ImportError, match=r"\Athe backend 'dask' .* pip install 'trackmark\[dask\]'\Z"
    ):
        connect(None, None)
