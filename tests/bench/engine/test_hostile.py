"""Hostile trackers: each is contained and named, and its neighbours say what they always say."""

import json
import re
import runpy
import sys
import warnings
from dataclasses import replace

import numpy as np
import pytest

from tests.bench.engine import hostile, hostile_answers
from trackmark import bench, datasets
from trackmark.bench.evaluation.loop import run_protocol
from trackmark.bench.experiments.experiment import Experiment, SequenceSource
from trackmark.bench.experiments.tracker_spec import contestants
from trackmark.bench.store.index import read_index
from trackmark.bench.store.results import Results

LIMITS = ["--frame-limit", "5", "--run-limit", "4", "--memory-limit", "1GB"]
FRAMES = 12
PATIENCE = 600  # for a command on a busy machine; nothing waits for it but a defect
TRACKMARK = [sys.executable, "-c", "from trackmark.bench.cli import main; main()"]

CALM = '''
"""Neighbours that notice what is done to image, random numbers, place and arithmetic."""
import os
import time
import zlib

import numpy as np
from trackmark.trackers.base.interface import Estimate, Randomness, TrackerPlugin


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


def runs_in(folder):
    """Stored runs by tracker and sequence."""
    results = Results(folder)
    return {
        (row["tracker"], row["sequence"]): results.read(folder / row["path"])
        for row in read_index(results)
    }


def calm(runs):
    """What the neighbours said, to the bit."""
    return {
        key: (
            run.failure,
            run.boxes.tobytes(),
            run.visible.tobytes(),
            {name: values.tobytes() for name, values in run.details.items()},
        )
        for key, run in runs.items()
        if not key[0].startswith("hostile.py")
    }


class Done:
    """What a command left: its status, what it printed, its runs by tracker and sequence."""

    def __init__(self, folder, command):
        self.folder, self.status = folder, command.process.returncode
        self.said, self.complained = command.said, command.complained
        self.runs = runs_in(folder)

    def hostile(self):
        """Failures of the others by class, one a sequence; empty where a run is finished."""
        found = {}
        for (tracker, _), run in sorted(self.runs.items()):
            if tracker.startswith("hostile.py"):
                found.setdefault(tracker.partition(":")[2], []).append(run.failure)
        return found


@pytest.fixture(scope="module")
def run_together(ground, begin, wait_until):
    """Run hostile trackers with calm ones in lock step, until the command has ended.

    In a session of its own: a hostile tracker may signal all that it can reach.
    """

    def run(folder, names, sequences="AB", jobs=2, **surroundings):
        source = folder / "hostile.py"
        source.write_text(hostile.source())
        trackers = ["static", f"{ground}/calm.py:Draws", *(f"{source}:{name}" for name in names)]
        arguments = [
            *(*TRACKMARK, "run", "--json", "--name", "trial", "--output", str(folder / "results")),
            *("--trackers", ",".join([*trackers, f"{ground}/calm.py:Watches"])),
            *("--sequences", ",".join(str(ground / name) for name in sequences)),
            *("--jobs", str(jobs), *LIMITS),
        ]
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
def undisturbed(ground, without_processes, tmp_path_factory):
    """What the neighbours say when nobody misbehaves and nobody watches."""
    names = ["static", f"{ground}/calm.py:Draws", f"{ground}/calm.py:Watches"]
    sources = tuple(SequenceSource(str(ground / name)) for name in "AB")
    with without_processes(), pytest.MonkeyPatch.context() as patch:
        patch.chdir(ground)
        patch.setenv("TRACKMARK_CACHE", str(ground / "cache"))
        chosen = Experiment("undisturbed", tuple(names), sources)
        folder = bench.run(chosen, tmp_path_factory.mktemp("undisturbed"), jobs=1)
    said = calm(runs_in(folder))
    assert len(said) == 6
    return said


@pytest.fixture(scope="module")
def everyday(run_together, tmp_path_factory):
    """All of `hostile.EVERYDAY` on one sequence: each has a process, and harms that alone."""
    return run_together(tmp_path_factory.mktemp("everyday"), hostile.EVERYDAY, "A", jobs=4)


def assert_contained(done, undisturbed, names):
    failures = any(hostile.CLASSES[name][0] for name in names)
    assert done.status == int(failures), done.complained
    sequences = {sequence for _, sequence in done.runs}
    said = {key: said for key, said in undisturbed.items() if key[1] in sequences}
    assert calm(done.runs) == said
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


def test_all_hostile_trackers_are_contained_and_named(everyday, undisturbed, ground):
    assert_contained(everyday, undisturbed, hostile.EVERYDAY)
    assert not (ground / "loaded").exists(), "what was sent as a pickle was loaded"
    assert len(hostile_answers.ROWS) + len(hostile.EVERYDAY) >= 200
    printed = everyday.runs["hostile.py:PrintsAndRaises", "A"].output
    assert printed.endswith("word 19999\n")
    assert len(printed) < 100_000


def test_the_command_says_that_runs_failed_and_prints_nothing_of_trackers(everyday):
    rows = [json.loads(line) for line in everyday.said.splitlines()]
    assert rows, everyday.complained
    expected = {name: bool(hostile.CLASSES[name][0]) for name in hostile.EVERYDAY}
    failed = {row["tracker"].partition(":")[2]: row["status"] == "failed" for row in rows}
    assert failed == {"": False, "Draws": False, "Watches": False} | expected
    assert "loud" not in everyday.complained
    assert "Traceback" not in everyday.complained


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


@pytest.mark.slow
def test_a_tracker_that_removes_its_source_costs_its_own_runs(together, undisturbed):
    """Nobody can say any more what it was."""
    done = together("RemovesItsSource")
    assert done.status == 2, done.complained
    assert (
        "hostile.py:RemovesItsSource on A: the tracker or the sequence changed" in done.complained
    )
    assert calm(done.runs) == undisturbed
    assert done.hostile() == {}


@pytest.mark.slow
def test_an_alarm_that_comes_late_costs_nobody_else(together, undisturbed):
    """In the same process another sequence is under way when it comes."""
    done = together("SetsAnAlarm", jobs=1, CALM_SECONDS="0.05")
    assert done.status == 0, done.complained
    assert calm(done.runs) == undisturbed


@pytest.mark.slow
@pytest.mark.parametrize("name", ["InterruptsTheCommand", "KillsTheCommand"])
def test_a_tracker_that_ends_the_command_costs_nothing_that_was_done(together, undisturbed, name):
    """Nothing keeps a process from signalling another one of the same user."""
    stopped = together(name)
    assert stopped.status != 0
    assert calm(stopped.runs).items() <= undisturbed.items()
    assert calm(together().runs) == undisturbed
