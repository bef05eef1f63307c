"""Hostile trackers: each is contained and named, and its neighbours say what they always say."""

import json
import re
import runpy
import sys
import warnings
from dataclasses import replace

import numpy as np
import pytest

import datasets
from bench.evaluation.loop import run_in_lock_step
from bench.experiments.contestant import contestants
from bench.store.index import read_index
from bench.store.results import Results
from tests.bench.engine import hostile, hostile_answers

# Run as a command in a session of its own: a hostile tracker may signal all that it can reach.
COMMAND = """
import json, sys
import bench
from bench.engine.unit import Limits
from bench.experiments.experiment import SequenceSource

trackers, sequences, output, jobs, limits = json.loads(sys.argv[1])
chosen = bench.Experiment("trial", tuple(trackers), tuple(map(SequenceSource, sequences)))
bench.run(chosen, output, jobs=jobs, limits=Limits(**limits))
"""

LIMITS = {"frame_seconds": 5.0, "run_seconds": 4.0, "memory_bytes": 1 << 30}
FRAMES = 12
PATIENCE = 600  # for a command on a busy machine; nothing waits for it but a defect
TRACKMARK = [sys.executable, "-c", "from bench.cli import main; main()"]

CALM = '''
"""Neighbours that notice what is done to image, random numbers, place and arithmetic."""
import os
import time
import zlib

import numpy as np
from trackers.base.interface import Estimate, Randomness, TrackerPlugin


class Watches(TrackerPlugin):
    """Its boxes depend on all pixels."""

    def init(self, image, box, mask=None):
        self.box = box.copy()

    def update(self, image):
        time.sleep(float(os.environ.get("CALM_SECONDS", 0)))
        said = {
            "folder": zlib.crc32(os.getcwd().encode()),
            "cache": zlib.crc32(os.environ.get("TRACKMARK_CACHE", "").encode()),
            "strict": float(np.geterr()["divide"] == "raise"),
        }
        return Estimate(self.box + [image.mean(), image.std(), 0, 0], details=said)


class Draws(Watches):
    """Its boxes depend on a generator of its own too."""

    randomness = Randomness.GENERATOR

    def init(self, image, box, mask=None):
        super().init(image, box)
        self.random = np.random.default_rng(self.seed)

    def update(self, image):
        self.box[:2] += self.random.normal(size=2)
        return super().update(image)
'''


@pytest.fixture(scope="module")
def ground(tmp_path_factory, otb):
    """Two sequences and two calm trackers, in a folder."""
    folder = tmp_path_factory.mktemp("ground")
    (folder / "calm.py").write_text(CALM)
    for name in "AB":
        otb(folder / name, FRAMES, first=0)
    return folder


class Done:
    """What a command left: its status, what it printed, its runs by tracker and sequence."""

    def __init__(self, folder, command):
        self.folder, self.status = folder, command.process.returncode
        self.said, self.complained = command.said, command.complained
        results = Results(folder)
        rows = read_index(results)
        self.runs = {
            (row["tracker"], row["sequence"]): results.read(folder / row["path"]) for row in rows
        }

    def calm(self):
        """What the neighbours said, to the bit."""
        return {
            key: (
                run.failure,
                run.boxes.tobytes(),
                run.visible.tobytes(),
                {name: values.tobytes() for name, values in run.details.items()},
            )
            for key, run in self.runs.items()
            if not key[0].startswith("hostile.py")
        }

    def hostile(self):
        """Failures of the others by class, one a sequence; empty where a run is finished."""
        found = {}
        for (tracker, _), run in sorted(self.runs.items()):
            if tracker.startswith("hostile.py"):
                found.setdefault(tracker.partition(":")[2], []).append(run.failure)
        return found


@pytest.fixture(scope="module")
def run_together(ground, begin, wait_until):
    """Run hostile trackers with calm ones in lock step, until the command has ended."""

    def run(folder, names, sequences="AB", jobs=2, **surroundings):
        source = folder / "hostile.py"
        source.write_text(hostile.source())
        trackers = ["static", f"{ground}/calm.py:Draws", *(f"{source}:{name}" for name in names)]
        request = [
            [*trackers, f"{ground}/calm.py:Watches"],
            [str(ground / name) for name in sequences],
            str(folder / "results"),
            jobs,
            LIMITS,
        ]
        arguments = [sys.executable, "-c", COMMAND, json.dumps(request)]
        surroundings["TRACKMARK_CACHE"] = str(ground / "cache")
        command = begin(arguments, ground, **surroundings)
        try:
            command.wait(PATIENCE)
            wait_until(lambda: not command.living())
        finally:
            command.kill()
        return Done(folder / "results" / "trial", command)

    return run


@pytest.fixture
def together(run_together, tmp_path):
    """`run_together` in a folder of the test's own."""
    return lambda *names, **options: run_together(tmp_path, names, **options)


@pytest.fixture(scope="module")
def undisturbed(run_together, tmp_path_factory):
    """What the neighbours say when nobody misbehaves."""
    said = run_together(tmp_path_factory.mktemp("undisturbed"), ()).calm()
    assert len(said) == 6
    return said


def assert_contained(done, undisturbed, names):
    assert done.status == 0, done.complained
    assert done.said == ""
    sequences = {sequence for _, sequence in done.runs}
    assert done.calm() == {key: said for key, said in undisturbed.items() if key[1] in sequences}
    found = done.hostile()
    assert found.keys() == set(names)
    wrong = {}
    for name, failures in found.items():
        words = hostile.CLASSES[name][0]
        for failure in failures:
            if bool(failure) != bool(words) or not re.search(words, failure):
                wrong[name] = words, failure[-2000:]
            assert len(failure) < 100_000, name
        assert len(failures) == len(sequences)
    assert not wrong


def test_what_trackers_raise_and_answer_is_theirs_alone(tmp_path, ground):
    """In one pass over a sequence, beside calm ones."""
    (tmp_path / "answers.py").write_text(hostile_answers.source())
    made = runpy.run_path(str(tmp_path / "answers.py"))
    calm = contestants([f"{ground}/calm.py:Draws", "static", f"{ground}/calm.py:Watches"])
    first, *others = calm.values()

    def angry(name):
        kind = made[name]
        return replace(
            first, label=name, name=name, make=lambda seed: kind(kind.Parameters(), seed)
        )

    rows = hostile_answers.ROWS
    sequence = datasets.load(str(ground / "A"))
    chosen = [first, *map(angry, rows), *others]
    with warnings.catch_warnings(action="ignore"):
        runs = run_in_lock_step([(entry, 0) for entry in chosen], sequence).runs
    for entry, run in zip(chosen, runs, strict=True):
        reason, _, _ = run.failure.partition("\n")
        if entry.name not in rows:
            (alone,) = run_in_lock_step([(entry, 0)], sequence).runs
            assert reason == ""
            assert run.boxes.tobytes() == alone.boxes.tobytes()
        else:
            act, words = rows[entry.name]
            assert bool(reason) == bool(words), (act, reason)
            assert re.search(words, reason), (act, reason)
            assert len(run.failure) < 100_000, act


def test_all_hostile_trackers_are_contained_and_named(together, undisturbed, ground):
    """Those of other ways than to answer: each has a process, and harms that alone."""
    done = together(*hostile.EVERYDAY, sequences="A", jobs=4)
    assert_contained(done, undisturbed, hostile.EVERYDAY)
    assert not (ground / "loaded").exists(), "what was sent as a pickle was loaded"
    assert len(hostile_answers.ROWS) + len(hostile.EVERYDAY) >= 200
    printed = done.runs["hostile.py:PrintsAndRaises", "A"].output
    assert printed.endswith("word 19999\n")
    assert len(printed) < 100_000


@pytest.mark.slow
def test_more_hostile_trackers_are_contained_and_named(together, undisturbed):
    """On two sequences, so that each meets again what it has left of its process."""
    names = [name for name, (words, *_) in hostile.CLASSES.items() if words is not None]
    done = together(*names, jobs=4)
    assert_contained(done, undisturbed, names)
    assert done.runs["hostile.py:PrintsAndEnds", "A"].output == "famous last words\n"
    assert done.runs["hostile.py:Prints", "A"].output == "", "no failure, no output"
    kept = done.runs["hostile.py:KeepsTheBox", "A"].boxes
    np.testing.assert_array_equal(kept[:, 0], 4 + np.arange(FRAMES))


def test_the_command_says_that_runs_failed_and_prints_nothing_of_trackers(ground, begin, tmp_path):
    source = tmp_path / "hostile.py"
    source.write_text(hostile.source())
    names = ("Prints", "PrintsAndEnds", "HangsInC")
    arguments = [
        *TRACKMARK,
        *("run", "--json", "--sequences", f"{ground}/A", "--output", str(tmp_path)),
        *("--frame-limit", "2"),
        *("--trackers", ",".join(["static", *(f"{source}:{name}" for name in names)])),
    ]
    command = begin(arguments, ground, TRACKMARK_CACHE=str(ground / "cache"))
    assert command.wait() == 1, command.complained
    rows = [json.loads(line) for line in command.said.splitlines()]
    assert rows, command.complained
    assert {row["tracker"].partition(":")[2]: row["status"] for row in rows} == {
        "": "finished",
        "Prints": "finished",
        "PrintsAndEnds": "failed",
        "HangsInC": "failed",
    }
    assert "loud" not in command.complained
    assert "Traceback" not in command.complained


@pytest.mark.slow
def test_a_tracker_that_removes_its_source_costs_its_own_runs(together, undisturbed):
    """Nobody can say any more what it was."""
    done = together("RemovesItsSource")
    assert done.status == 1
    assert (
        "hostile.py:RemovesItsSource on A: the tracker or the sequence changed" in done.complained
    )
    assert done.calm() == undisturbed
    assert done.hostile() == {}


@pytest.mark.slow
def test_an_alarm_that_comes_late_costs_nobody_else(together, undisturbed):
    """In the same process another sequence is under way when it comes."""
    done = together("SetsAnAlarm", jobs=1, CALM_SECONDS="0.05")
    assert done.status == 0, done.complained
    assert done.calm() == undisturbed


@pytest.mark.slow
@pytest.mark.parametrize("name", ["InterruptsTheCommand", "KillsTheCommand"])
def test_a_tracker_that_ends_the_command_costs_nothing_that_was_done(together, undisturbed, name):
    """Nothing keeps a process from signalling another one of the same user."""
    stopped = together(name)
    assert stopped.status != 0
    assert stopped.calm().items() <= undisturbed.items()
    assert together().calm() == undisturbed
