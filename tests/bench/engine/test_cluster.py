"""Dask and Ray: the same results to the bit, lost workers, wrong folders, wrong source."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace

import pytest

from bench.engine import Job, engine
from bench.engine.cluster import (
    ClusterError,
    Task,
    _from_anywhere,
    check_installed,
    source_digest,
)
from bench.engine.unit import Entry, Unit
from bench.experiments.experiment import SequenceSource
from bench.store.results import Results

LIBRARIES = {"dask": "distributed", "ray": "ray"}

# What the command does with an engine. In a process of its own: clusters leave threads behind.
PERFORM = """
import sys
from pathlib import Path

import datasets
from bench.experiments.contestant import contestant, identify
from bench.engine import Job, engine
from bench.experiments.experiment import SequenceSource
from bench.engine.unit import Entry, Unit


def main(name, jobs, address, folder, trackers, *sources):
    units = []
    for source in sources:
        sequence = datasets.load(source)
        entries = tuple(
            Entry(text, repetition, identify(contestant(text), sequence, repetition).version)
            for text in trackers.split(",")
            for repetition in range(2)
        )
        units.append(Unit(SequenceSource(source), entries, "accuracy", len(sequence)))
    asked = iter(units)
    chosen = engine(name, jobs=int(jobs) or None, address=address or None)
    done = chosen.perform(asked, Job(Path(folder)), lambda work: print("progress", work))
    for unit, outcome in done:
        if isinstance(outcome, Exception):
            print("error", outcome, flush=True)
        else:
            print("done", unit.source.text, len(outcome.rows), outcome.process, flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
"""


@pytest.fixture(params=LIBRARIES)
def cluster(request):
    """Name of an engine that is installed."""
    if find_spec(LIBRARIES[request.param]) is None:
        pytest.skip(f"the extra {request.param!r} is not installed; `make test-full` does")
    return request.param


@pytest.fixture
def data(here, otb):
    """Four sequences of 12 frames, a tracker in a file, and the script above."""
    for name in "ABCD":
        otb(here / "data" / name, 12)
    (here / "perform.py").write_text(PERFORM)
    return here


def begin(data, engine, jobs, address, folder, trackers="static,knob.py:Knob,camshift"):
    """Start the script in the folder of the data; all its paths are relative."""
    return subprocess.Popen(
        [
            *(sys.executable, "perform.py", engine, str(jobs), address, folder),
            *(trackers, *(f"data/{name}" for name in "ABCD")),
        ],
        cwd=data,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        # A terminal's child listens to Ctrl-C; one of a job in the background does not.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
        env=os.environ | {"PYTHONPATH": str(Path.cwd()), "RAY_AUTH_MODE": "disabled"},
    )


def perform(*arguments, **options):
    process = begin(*arguments, **options)
    out, err = process.communicate(timeout=600)
    return process.returncode, out, err


def at_work(data):
    """Living processes that began in the folder of the data: command, workers, children."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            place, called = (process / "cwd").readlink(), (process / "cmdline").read_bytes()
        except OSError:  # it has ended, or is no one's business
            continue
        # Two agents of Ray outlive a killed command; they perform nothing.
        if place.is_relative_to(data) and b"Agent" not in called:
            found.append(int(process.name))
    return found


def wait_until(condition, seconds=600):
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.1)


@pytest.mark.slow
def test_two_workers_of_a_cluster_make_the_results_of_the_local_engine_to_the_bit(
    cluster, data, contents
):
    status, _, said = perform(data, "local", 1, "", "results/local")
    assert status == 0, said
    status, out, said = perform(data, cluster, 2, "", f"results/{cluster}")
    assert status == 0, said
    expected = contents(data / "results/local")
    assert len(expected) == 4 * 6
    assert contents(data / "results" / cluster) == expected
    lines = [line.split() for line in out.splitlines()]
    assert sorted(line[1] for line in lines if line[0] == "done") == [f"data/{c}" for c in "ABCD"]
    progress = [int(line[1]) for line in lines if line[0] == "progress"]
    assert progress == [12 * 6 * i for i in range(1, 5)]
    assert not list((data / "results" / cluster).glob(".*command-*"))


@pytest.mark.slow
def test_a_tracker_that_kills_its_process_never_reaches_the_cluster(cluster, data):
    source = (data / "knob.py").read_text()
    death = "import os; os._exit(3)\n        return Estimate"
    (data / "deadly.py").write_text(source.replace("return Estimate", death))
    status, out, said = perform(data, cluster, 2, "", "results/x", "static,deadly.py:Knob")
    assert status == 0, said
    assert out.count("done") == 4
    stored = [
        Results(data / "results/x").read(file) for file in Results(data / "results/x").files()
    ]
    failed = [run for run in stored if run.failure]
    assert len(stored) == 4 * 4
    assert {run.identity.tracker_name for run in failed} == {"deadly.py:Knob"}
    assert len(failed) == 4 * 2
    assert "lost" not in out


@pytest.mark.slow
def test_a_unit_of_a_worker_that_is_lost_is_done_by_another(cluster, data):
    """A sequence's pass kills the first worker that performs it, as a lost machine would."""
    killer = """import os, pathlib, signal
        worker = os.getppid()
        if not pathlib.Path(MARK).exists():
            pathlib.Path(MARK).write_text(str(worker))
            os.kill(worker, signal.SIGKILL)
        return Estimate"""
    killer = killer.replace("MARK", repr(str(data / "killed")))
    source = (data / "knob.py").read_text()
    (data / "killer.py").write_text(source.replace("return Estimate", killer))
    status, out, said = perform(data, cluster, 2, "", "results/x", "static,killer.py:Knob")
    assert status == 0, said
    assert (data / "killed").exists()
    assert out.count("done") == 4
    stored = [
        Results(data / "results/x").read(file) for file in Results(data / "results/x").files()
    ]
    assert len(stored) == 4 * 4
    assert not [run.failure for run in stored if run.failure]


@pytest.mark.slow
@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGKILL])
def test_nothing_runs_on_after_a_command_that_was_stopped_or_killed(cluster, data, end):
    source = (data / "knob.py").read_text()
    pause = "__import__('time').sleep(0.3)\n        return Estimate"
    (data / "slow.py").write_text(source.replace("return Estimate", pause))
    process = begin(data, cluster, 2, "", "results/x", "slow.py:Knob")
    try:
        assert process.stdout.readline().startswith(("done", "progress"))
        assert len(at_work(data)) >= 5  # a command, two workers, their children
        if end is signal.SIGINT:
            os.killpg(process.pid, end)  # as a terminal does
            process.communicate(timeout=600)
            assert not list((data / "results/x").glob(".*command-*"))
        else:
            process.kill()
            process.wait()
        wait_until(lambda: not at_work(data))
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate(timeout=600)


@pytest.fixture
def scheduler(data):
    """A Dask scheduler with one worker, which works in another folder; and how to end it."""
    pytest.importorskip("distributed", reason="the extra 'dask' is not installed")
    address = data / "scheduler.json"
    options = ("--scheduler-file", str(address), "--no-dashboard")
    elsewhere = data / "elsewhere"
    elsewhere.mkdir()

    def start(*command):
        return subprocess.Popen(
            [sys.executable, "-m", "distributed.cli." + command[0], *command[1:], *options],
            cwd=elsewhere,
            env=os.environ | {"PYTHONPATH": str(Path.cwd())},
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


@pytest.mark.slow
def test_a_worker_in_another_folder_finds_sequences_and_trackers_by_relative_paths(
    data, scheduler, contents
):
    address, _ = scheduler
    wait_for_workers(address)
    status, _, said = perform(data, "local", 1, "", "results/local")
    assert status == 0, said
    status, _, said = perform(data, "dask", 0, address, "results/far")
    assert status == 0, said
    assert contents(data / "results/far") == contents(data / "results/local")


@pytest.mark.slow
def test_a_scheduler_that_ends_is_one_line_that_says_how_to_go_on(data, scheduler):
    address, processes = scheduler
    wait_for_workers(address)
    source = (data / "knob.py").read_text()
    pause = "__import__('time').sleep(0.3)\n        return Estimate"
    (data / "slow.py").write_text(source.replace("return Estimate", pause))
    process = begin(data, "dask", 0, address, "results/x", "slow.py:Knob")
    process.stdout.readline()
    processes[0].kill()
    _, said = process.communicate(timeout=600)
    assert process.returncode == 1
    last = said.strip().splitlines()[-1]
    assert last.startswith("bench.engine.cluster.ClusterError: the Dask scheduler is lost")
    assert "the same command goes on" in last
    assert 2 <= len(Results(data / "results/x").files()) < 8


def unit(data):
    return Unit(SequenceSource(str(data / "data" / "A")), (), "accuracy", 12)


@pytest.mark.parametrize(
    ("typed", "sent"),
    [
        ("own.py:Own:step=2", "{}/own.py:Own:step=2"),
        ("own.py", "{}/own.py:"),
        ("own.py:as=mine", "{}/own.py:as=mine"),
        ("camshift:window=adaptive", "camshift:window=adaptive"),
    ],
)
def test_a_trackers_file_is_sent_as_a_path_that_holds_in_any_folder(typed, sent):
    unit = Unit(SequenceSource("samples/face"), (Entry(typed, 0, ""),), "accuracy", 120)
    (entry,) = _from_anywhere(unit).entries
    assert entry.tracker == sent.format(Path.cwd())


def test_a_folder_that_a_worker_does_not_see_is_named_with_its_machine(data, monkeypatch):
    monkeypatch.setattr("socket.gethostname", lambda: "node-7")
    seen = Task(Job(data / "results"), ".command-1", source_digest())(unit(data))
    assert isinstance(seen, ClusterError)
    assert str(seen).startswith(f"the worker on node-7 does not see the command's folder {data}")


def test_a_worker_with_another_source_is_refused(data, monkeypatch):
    monkeypatch.setattr("socket.gethostname", lambda: "node-7")
    (data / "results").mkdir()
    (data / "results" / ".command-1").touch()
    seen = Task(Job(data / "results"), ".command-1", "another")(unit(data))
    assert isinstance(seen, ClusterError)
    assert "the worker on node-7 runs another source of trackmark" in str(seen)


@pytest.mark.parametrize(
    "address", ["127.0.0.1:{}", "ray://127.0.0.1:{}", "localhost:99999", "auto"]
)
def test_a_ray_address_at_which_nobody_listens_is_one_line_before_ray_is_asked(
    address, monkeypatch
):
    """It would ask again and again, for a quarter of an hour."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    ray = SimpleNamespace(init=pytest.fail, shutdown=lambda: None)
    monkeypatch.setitem(sys.modules, "ray", ray)
    monkeypatch.setenv("RAY_ADDRESS", f"127.0.0.1:{port}")
    with pytest.raises(ClusterError, match=r"no Ray cluster answers at .* Start one, or mend"):
        engine("ray", address=address.format(port))


@pytest.mark.parametrize("extra", LIBRARIES)
def test_an_engine_that_is_not_installed_is_one_line_that_says_what_to_install(extra, monkeypatch):
    monkeypatch.setitem(sys.modules, LIBRARIES[extra], None)
    with pytest.raises(ImportError) as caught:
        check_installed(LIBRARIES[extra], extra)
    assert f"pip install 'trackmark[{extra}]'" in str(caught.value)
    assert "\n" not in str(caught.value)
