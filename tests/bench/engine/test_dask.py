"""Dask engine: results equal to the bit, lost workers, wrong folders, wrong source."""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from trackmark.bench.engine import engine
from trackmark.bench.engine.dask import (
    ClusterError,
    _perform_unit,
    with_absolute_paths,
)
from trackmark.bench.engine.work_unit import Entry, Limits, Unit
from trackmark.bench.experiments.experiment import SequenceSource
from trackmark.bench.store.results import Results

# What the command does with an engine. In a process of its own: Dask leaves threads behind.
PERFORM = """
import sys
from pathlib import Path

from trackmark import datasets
from trackmark.bench.experiments.tracker_spec import contestant, identify
from trackmark.bench.engine import engine
from trackmark.bench.experiments.experiment import SequenceSource
from trackmark.bench.engine.work_unit import Entry, Limits, Unit


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
    done = chosen.perform(asked, Limits(), lambda work: print("progress", work))
    results = Results(Path(folder))
    for unit, outcome in done:
        if isinstance(outcome, Exception):
            print("error", outcome, flush=True)
        else:
            for run in outcome.runs:
                results.write(run)
            print("done", unit.source.text, outcome.process, flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
"""


@pytest.fixture
def data(here, otb):
    """Create four sequences of 12 frames, a tracker in a file, and the script above."""
    pytest.importorskip("distributed", reason="the extra 'dask' is not installed")
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
        env=os.environ | {"PYTHONPATH": str(Path.cwd())},
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
            place = (process / "cwd").readlink()
        except OSError:  # it has ended, or is no one's business
            continue
        if place.is_relative_to(data):
            found.append(int(process.name))
    return found


def wait_until(condition, seconds=600):
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.1)


@pytest.mark.slow
def test_results_of_two_workers_equal_the_local_engine(data, contents):
    status, _, said = perform(data, "local", 1, "", "results/local")
    assert status == 0, said
    status, out, said = perform(data, "dask", 2, "", "results/dask")
    assert status == 0, said
    expected = contents(data / "results/local")
    assert len(expected) == 4 * 6
    assert contents(data / "results/dask") == expected
    lines = [line.split() for line in out.splitlines()]
    assert sorted(line[1] for line in lines if line[0] == "done") == [f"data/{c}" for c in "ABCD"]
    progress = [int(line[1]) for line in lines if line[0] == "progress"]
    assert progress == [12 * 6 * i for i in range(1, 5)]
    assert not list((data / "results/dask").glob(".*command-*"))


@pytest.mark.slow
def test_crash_of_a_tracker_does_not_reach_the_worker(data):
    source = (data / "knob.py").read_text()
    death = "import os; os._exit(3)\n        return Estimate"
    (data / "deadly.py").write_text(source.replace("return Estimate", death))
    status, out, said = perform(data, "dask", 2, "", "results/x", "static,deadly.py:Knob")
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
def test_unit_of_a_lost_worker_runs_on_another(data):
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
    status, out, said = perform(data, "dask", 2, "", "results/x", "static,killer.py:Knob")
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
def test_all_processes_end_after_the_command(data, end):
    source = (data / "knob.py").read_text()
    pause = "__import__('time').sleep(0.3)\n        return Estimate"
    (data / "slow.py").write_text(source.replace("return Estimate", pause))
    process = begin(data, "dask", 2, "", "results/x", "slow.py:Knob")
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
    """Start a Dask scheduler with one worker, which works in another folder."""
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
def test_worker_in_another_folder_resolves_relative_paths(data, scheduler, contents):
    address, _ = scheduler
    wait_for_workers(address)
    status, _, said = perform(data, "local", 1, "", "results/local")
    assert status == 0, said
    status, _, said = perform(data, "dask", 0, address, "results/far")
    assert status == 0, said
    assert contents(data / "results/far") == contents(data / "results/local")


@pytest.mark.slow
def test_lost_scheduler_is_reported_in_one_line(data, scheduler):
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
    assert last.startswith("trackmark.bench.engine.dask.ClusterError: the Dask scheduler is lost")
    assert "run the same command again" in last
    assert 2 <= len(Results(data / "results/x").files()) < 8


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
    unit = Unit(SequenceSource("samples/face"), (Entry(typed, 0, ""),), "accuracy", 120)
    (entry,) = with_absolute_paths(unit).entries
    assert entry.tracker == sent.format(Path.cwd())


def test_worker_with_another_source_is_refused(monkeypatch):
    monkeypatch.setattr("socket.gethostname", lambda: "node-7")
    unit = Unit(SequenceSource("samples/face"), (), "accuracy", 120)
    error = _perform_unit("command", Limits(), "another", unit)
    assert isinstance(error, ClusterError)
    assert str(error).startswith("the worker on node-7 runs another source of trackmark")


def test_missing_dask_is_one_line_with_the_remedy(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(
        ImportError, match=r"\Athe engine 'dask' .* pip install 'trackmark\[dask\]'\Z"
    ):
        engine("dask")
