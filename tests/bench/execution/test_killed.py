"""Commands that are killed, interrupted or paused: no finished run is lost or repeated."""

import os
import random
import shutil
import signal
import time

import pytest

from tests.bench.execution.conftest import TRACKMARK, send
from trackmark.bench.execution.executor import run_experiment
from trackmark.bench.experiments.experiment import Experiment, SequenceSpec
from trackmark.bench.store.run_store import RunStore

FRAMES = 60
SEQUENCES = "AB"
SEEDS = 3
RUNS = len(SEQUENCES) * (1 + SEEDS)

TRACKER = '''
"""Random walk; environment variables slow it down, or stop it once in frame 30."""
import os
import time
from pathlib import Path

import numpy as np
from trackmark.trackers.base.interface import Estimate, Randomness, TrackerPlugin


class Draws(TrackerPlugin):
    """A random walk."""

    randomness = Randomness.GENERATOR

    def init(self, image, box, mask=None):
        self.random = np.random.default_rng(self.seed)
        self.box = box.copy()
        self.frame = 0

    def update(self, image):
        self.frame += 1
        time.sleep(float(os.environ.get("TRACKER_SECONDS", 0)))
        here = Path(os.environ.get("TRACKER_WAITS", __file__))
        if self.frame == 30 and not here.exists():
            self.wait(here)
        self.box[:2] += self.random.normal(size=2)
        drawn = self.random.random()
        return Estimate(self.box.copy(), details={"drawn": drawn}, revised={1: self.box.copy()})

    def wait(self, here):
        """Create the file `here` and wait for `here.on`; only the first process does so."""
        try:
            here.touch(exist_ok=False)
        except FileExistsError:
            return
        while not here.with_suffix(".on").exists():
            time.sleep(0.01)
'''


@pytest.fixture(scope="module")
def data_folder(tmp_path_factory, otb):
    """Return a folder with two sequences and a tracker file."""
    folder = tmp_path_factory.mktemp("data_folder")
    (folder / "walk.py").write_text(TRACKER)
    for name in SEQUENCES:
        otb(folder / name, FRAMES)
    return folder


@pytest.fixture(scope="module")
def start(data_folder, begin):
    """Return a function that starts a command with `RUNS` runs; `name` is its results folder."""

    def start_one(name, jobs=2, **variables):
        sequences = ",".join(str(data_folder / sequence) for sequence in SEQUENCES)
        command = [*TRACKMARK, "run", "--trackers", f"static,{data_folder}/walk.py:Draws"]
        command += ["--repetitions", str(SEEDS), "--sequences", sequences, "--name", name]
        command += ["--jobs", str(jobs), "--results-root", str(data_folder / "results")]
        command += ["--frame-limit", "600"]
        return begin(command, data_folder, TRACKMARK_CACHE=str(data_folder / "cache"), **variables)

    return start_one


def stamps(folder):
    """Return the metadata of every finished run, with date and times."""
    results = RunStore(folder)
    return {cell: dict(results.read(cell).metadata) for cell in results.list_keys()}


@pytest.fixture(scope="module")
def run_here(data_folder, without_processes):
    """Return a function that performs the runs of the command in this process."""
    sources = tuple(SequenceSpec(str(data_folder / name)) for name in SEQUENCES)

    def run(name):
        chosen = Experiment(name, ("static", f"{data_folder}/walk.py:Draws"), sources, SEEDS)
        with without_processes():
            return run_experiment(chosen, data_folder / "results", jobs=1)

    return run


@pytest.fixture(scope="module")
def undisturbed(run_here, contents):
    """Return the contents of the results of an undisturbed command."""
    stored_contents = contents(run_here("undisturbed"))
    assert len(stored_contents) == RUNS
    return stored_contents


def strike(command, target):
    """Kill a command, one of its workers, or all; return whether one of them lived."""
    targets = command.living() if target == "all" else [command.process.pid]
    if target == "worker":
        targets = command.workers()[:1]
    hits = [command.process.poll() is None and send(number, signal.SIGKILL) for number in targets]
    return any(hits)


def test_work_continues_after_ctrl_c_and_a_kill(
    data_folder, start, run_here, wait_until, undisturbed, contents, evidence
):
    """Check that workers end with the command, even within a frame."""
    folder = data_folder / "results" / "stopped"
    command = start("stopped", TRACKER_WAITS=str(data_folder / "first"))
    wait_until(lambda: (data_folder / "first").exists() and RunStore(folder).list_keys())
    os.killpg(command.process.pid, signal.SIGINT)
    assert command.wait() == 130
    finished_stamps = stamps(folder)
    assert 1 <= len(finished_stamps) < RUNS
    assert f"{len(finished_stamps)} of {RUNS} runs are in" in command.stderr
    assert "same command" in command.stderr
    assert "Traceback" not in command.stderr
    assert command.living() == []

    command = start("stopped", TRACKER_WAITS=str(data_folder / "second"))
    wait_until((data_folder / "second").exists)
    assert command.workers()
    send(command.process.pid, signal.SIGKILL)
    assert command.wait() == -signal.SIGKILL
    wait_until(lambda: not command.living())
    assert finished_stamps.items() <= stamps(folder).items()
    finished_stamps = stamps(folder)
    assert len(finished_stamps) < RUNS

    assert run_here("stopped") == folder
    assert finished_stamps.items() <= stamps(folder).items(), "a finished run was lost or repeated"
    assert contents(folder) == undisturbed
    evidence("Ctrl-C and a kill cost nothing that was finished")


@pytest.mark.weekly
@pytest.mark.parametrize("seed", range(1, 6))
def test_200_kills_cost_no_finished_run(data_folder, start, undisturbed, contents, evidence, seed):
    """Kill commands at random moments, one after another, until one ends."""
    began = time.monotonic()
    assert start(f"timed-{seed}", TRACKER_SECONDS="0.001").wait() == 0
    seconds = time.monotonic() - began
    moments, kills, folder = random.Random(seed), 0, data_folder / "results" / f"killed-{seed}"
    finished_stamps = {}
    while kills < 40 or finished_stamps:
        command = start(folder.name, TRACKER_SECONDS="0.001")
        if kills < 40:
            time.sleep(moments.uniform(0.1, 0.95) * seconds)
            kills += strike(command, moments.choice(["all", "command", "worker"]))
        status = command.wait()
        now = stamps(folder)
        assert finished_stamps.items() <= now.items(), "a finished run was lost or repeated"
        finished_stamps = now
        if status == 0:  # the command survived, or lost only a worker
            assert contents(folder) == undisturbed
            shutil.rmtree(folder)
            finished_stamps = {}
        elif status != -signal.SIGKILL:  # two workers were killed while they started
            assert "a worker process cannot start" in command.stderr
    evidence(f"{kills} of {kills} kills cost nothing that was finished")


@pytest.mark.slow
def test_paused_command_overwrites_nothing(
    data_folder, start, run_here, wait_until, undisturbed, contents
):
    """Let another command finish the work during the pause."""
    folder, pause_file = data_folder / "results" / "paused", data_folder / "here"
    slow = start("paused", 1, TRACKER_WAITS=str(pause_file))
    wait_until(pause_file.exists)
    stopped = slow.living()
    assert slow.process.pid in stopped
    assert slow.workers()
    for number in reversed(stopped):
        send(number, signal.SIGSTOP)
    assert RunStore(folder).list_keys() == []
    assert run_here("paused") == folder
    before = stamps(folder)
    assert len(before) == RUNS
    pause_file.with_suffix(".on").touch()
    for number in stopped:
        send(number, signal.SIGCONT)
    assert slow.wait() == 0, slow.stderr
    assert stamps(folder) == before
    assert contents(folder) == undisturbed
