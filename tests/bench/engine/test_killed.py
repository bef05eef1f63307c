"""Kills at any moment: nothing that was finished is lost, and what is left is done as if nothing
had happened. Commands that are stopped, paused, or run twice at once are among it.
"""

import os
import random
import shutil
import signal
import time

import pytest

from tests.bench.engine.conftest import TRACKMARK
from trackmark import bench
from trackmark.bench.experiments.experiment import Experiment, SequenceSource
from trackmark.bench.store.index import read_index
from trackmark.bench.store.layout import cell_of
from trackmark.bench.store.results import Results, run_columns

FRAMES = 60
SEQUENCES = "AB"
SEEDS = 3

TRACKER = '''
"""Draws; takes its time, and waits once in a frame, where the environment says so."""
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
        """Who comes first says that it is here, and waits until somebody has it go on."""
        try:
            here.touch(exist_ok=False)
        except FileExistsError:
            return
        while not here.with_suffix(".on").exists():
            time.sleep(0.01)
'''


@pytest.fixture(scope="module")
def ground(tmp_path_factory, otb):
    """Two sequences and a tracker in a file."""
    folder = tmp_path_factory.mktemp("ground")
    (folder / "walk.py").write_text(TRACKER)
    for name in SEQUENCES:
        otb(folder / name, FRAMES)
    return folder


RUNS = len(SEQUENCES) * (1 + SEEDS)


@pytest.fixture(scope="module")
def trackmark_run(ground, begin):
    """Begin a command that makes `RUNS` runs on the sequences; results lie in `name`."""

    def begin_run(name, jobs=2, *options, **surroundings):
        names = ",".join(str(ground / sequence) for sequence in SEQUENCES)
        arguments = [
            *TRACKMARK,
            *(
                "run",
                "--trackers",
                f"static,{ground}/walk.py:Draws",
                "--seeds",
                str(SEEDS),
            ),
            *("--sequences", names, "--name", name, "--jobs", str(jobs)),
            *("--output", str(ground / "results"), "--frame-limit", "600", *options),
        ]
        return begin(arguments, ground, TRACKMARK_CACHE=str(ground / "cache"), **surroundings)

    return begin_run


def contents(folder):
    """All that lies in a folder of results when the next command begins, but times, host, date."""
    results = Results(folder)
    results.prepare(results.asked())
    found = {"requested": dict(results.asked().cells)}
    for row in read_index(results):
        run = results.read(cell_of(row))
        found[cell_of(row)] = (
            run.identity,
            run.failure,
            run.revised is not None and run.revised.tobytes(),
            {name: values.tobytes() for name, values in run_columns(run).items()},
            {key: value for key, value in row["scores"].items() if value == value},
        )
    found["files"] = sorted(file.name for file in folder.iterdir())
    return found


def stamps(folder):
    """Time at which every finished run was stored, and its own times."""
    results = Results(folder)
    return {cell: dict(results.read(cell).circumstances) for cell in results.cells()}


@pytest.fixture(scope="module")
def run_here(ground, without_processes):
    """Do what the command does, in this process; give the folder."""
    sources = tuple(SequenceSource(str(ground / name)) for name in SEQUENCES)

    def run(name):
        chosen = Experiment(name, ("static", f"{ground}/walk.py:Draws"), sources, SEEDS)
        with without_processes():
            return bench.run(chosen, ground / "results", jobs=1)

    return run


@pytest.fixture(scope="module")
def undisturbed(run_here):
    """Contents of results that nobody disturbed."""
    folder = run_here("undisturbed")
    assert len(Results(folder).cells()) == RUNS
    return contents(folder)


@pytest.fixture
def kill_and_resume(ground, trackmark_run, undisturbed):
    """Kill commands at random moments, one after another, and let another one go on."""
    began = time.monotonic()
    assert trackmark_run("timed", 2, TRACKER_SECONDS="0.001").wait() == 0
    assert contents(ground / "results" / "timed") == undisturbed
    seconds = time.monotonic() - began

    def disturb(kills, seed):
        nonlocal seconds
        moments, counted, round_number, name = random.Random(seed), 0, 0, ""
        kept = {}
        while counted < kills or name:
            if not name:
                name, kept = f"killed-{seed}-{round_number}", {}
                round_number += 1
            folder = ground / "results" / name
            began = time.monotonic()
            command = trackmark_run(name, 2, "--json", TRACKER_SECONDS="0.001")
            if counted < kills:
                time.sleep(moments.uniform(0.1, 0.95) * seconds)
                hit = strike(command, moments.choice(["all", "command", "worker"]))
                counted += hit
            status = command.wait()
            if status == 0 and not kept:  # the machine may be less busy by now
                seconds = min(seconds, time.monotonic() - began)
            now = stamps(folder)
            assert kept.items() <= now.items(), "a finished run was lost, or done again"
            kept = now
            if status == 0:  # it was not hit, or went on without one of its workers
                assert contents(folder) == undisturbed
                shutil.rmtree(folder)
                name = ""
            elif status != -signal.SIGKILL:
                # Its worker had only begun to begin.
                assert "a worker process can't begin" in command.complained
        return counted

    return disturb


def strike(command, whom):
    """Kill a command, a worker of it, or all; tell whether anybody was there."""
    if whom == "all":
        targets = command.living()
    else:
        targets = [command.process.pid] if whom == "command" else command.workers()[:1]
    hits = [command.process.poll() is None and send(target) for target in targets]
    return any(hits)


def send(number, what=signal.SIGKILL):
    try:
        os.kill(number, what)
    except ProcessLookupError:
        return False
    return True


def test_what_ctrl_c_and_a_kill_leave_is_gone_on_with(
    ground, trackmark_run, wait_until, undisturbed, evidence
):
    """Workers end with the command, in the midst of a frame, too."""
    folder = ground / "results" / "stopped"
    command = trackmark_run("stopped", TRACKER_WAITS=str(ground / "first"))
    wait_until(lambda: (ground / "first").exists() and Results(folder).cells())
    os.killpg(command.process.pid, signal.SIGINT)
    assert command.wait() == 130
    kept = stamps(folder)
    assert 1 <= len(kept) < RUNS
    assert f"{len(kept)} of {RUNS} runs are in" in command.complained
    assert "same command" in command.complained
    assert "Traceback" not in command.complained
    assert command.living() == []

    command = trackmark_run("stopped", TRACKER_WAITS=str(ground / "second"))
    wait_until((ground / "second").exists)
    assert command.workers()
    send(command.process.pid)
    assert command.wait() == -signal.SIGKILL
    wait_until(lambda: not command.living())
    assert kept.items() <= stamps(folder).items()
    kept = stamps(folder)
    assert len(kept) < RUNS

    command = trackmark_run("stopped")
    assert command.wait() == 0, command.complained
    assert kept.items() <= stamps(folder).items(), "a finished run was lost, or done again"
    assert contents(folder) == undisturbed
    evidence("Ctrl-C and a kill cost nothing that was finished")


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(1, 6))
def test_200_kills_cost_nothing_that_was_finished(kill_and_resume, evidence, seed):
    kills = kill_and_resume(kills=40, seed=seed)
    evidence(f"{kills} of {kills} kills cost nothing that was finished")


@pytest.fixture(scope="module")
def paused(ground, trackmark_run, run_here, wait_until):
    """Pause a command, do its work here, and let it go on.

    Gives the folder, and its finished runs as they were before it went on.
    """
    folder = ground / "results" / "paused"
    here = ground / "here"
    slow = trackmark_run("paused", 1, TRACKER_WAITS=str(here))
    wait_until(here.exists)
    stopped = slow.living()
    assert slow.process.pid in stopped
    assert slow.workers()
    for number in reversed(stopped):
        send(number, signal.SIGSTOP)
    assert Results(folder).cells() == []
    assert run_here("paused") == folder
    before = stamps(folder)
    assert len(before) == RUNS
    here.with_suffix(".on").touch()
    for number in stopped:
        send(number, signal.SIGCONT)
    assert slow.wait() == 0, slow.complained
    return folder, before


def test_a_command_paused_while_another_did_its_work_overwrites_nothing(paused, undisturbed):
    folder, before = paused
    assert stamps(folder) == before
    assert contents(folder) == undisturbed


@pytest.mark.slow
def test_two_commands_at_once_in_one_folder_lose_nothing_and_do_nothing_twice(
    ground, trackmark_run, undisturbed
):
    folder = ground / "results" / "twice"
    both = [trackmark_run("twice", TRACKER_SECONDS="0.002") for _ in range(2)]
    kept = {}
    while any(command.process.poll() is None for command in both):
        now = stamps(folder) if folder.exists() else {}
        assert kept.items() <= now.items(), "a finished run was lost, or written again"
        kept = now
        time.sleep(0.05)
    assert [command.wait() for command in both] == [0, 0], [c.complained for c in both]
    assert kept.items() <= stamps(folder).items()
    assert contents(folder) == undisturbed
    for command in both:
        assert f"{RUNS} of {RUNS} runs are in" in command.said
