"""Hostile trackers: each is contained and named, and its neighbours say what they always say."""

import json
import re
import sys

import numpy as np
import pytest

from bench.store.index import read_index
from bench.store.results import Results
from tests.bench.engine import hostile

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

LIMITS = {"frame_seconds": 2.0, "run_seconds": 4.0, "memory_bytes": 1 << 30}
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
            if key[0].startswith("calm.py")
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
        trackers = [f"{ground}/calm.py:Draws", *(f"{source}:{name}" for name in names)]
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
    assert len(said) == 4
    return said


HERE = rf"^{3:04}\.png: "
FIRST = rf"^{0:04}\.png: "

# What they raise and answer, and what they do to what is theirs: they fail in the process itself.
ANSWERS = {
    "RaisesAtOnce": FIRST + "RuntimeError: no wish to begin",
    "Raises": HERE + "RuntimeError: no wish to go on",
    "RaisesWhenMade": FIRST + "RuntimeError: no wish to be made",
    "Exits": HERE + "SystemExit",
    "Recurses": HERE + "RecursionError",
    "RaisesTheUnspeakable": HERE + ".*UnspeakableError",
    "AnswersNothing": HERE + ".*returned None",
    "WritesToImage": HERE + ".*read-only",
    "UnlocksImage": HERE + "ValueError: cannot set WRITEABLE",
    "WritesToImagesBase": HERE + "ValueError",
    "RaisesAtLength": HERE + "RuntimeError: xxx",
    "PrintsAndRaises": HERE + "RuntimeError: said enough",
}

# What harms the process, and with it everybody in it.
HARM = {
    "Interrupts": HERE + "it raised KeyboardInterrupt",
    "StopsIteration": HERE + "it raised GeneratorExit",
    "WritesToBuffersOwner": "image",
    "EndsWell": HERE + "its process ended with status 0",
    "EndsBadly": HERE + "its process ended with status 3",
    "EndsAtOnce": FIRST + "its process ended with status 3",
    "Segfaults": HERE + "its process was killed by SIGSEGV",
    "Aborts": HERE + "its process was killed by SIGABRT",
    "RecursesDeeply": HERE + "its process was killed by SIGSEGV",
    "KillsItself": HERE + "its process was killed by SIGKILL",
    "TerminatesItself": HERE + "its process was killed by SIGTERM",
    "InterruptsItself": HERE,
    "Forks": "forked",
    "ForksAtOnce": "forked",
    "ClosesDescriptors": HERE + "it closed file descriptors",
    "ClosesAndOpensDescriptors": HERE + "it closed file descriptors",
    "WritesToDescriptors": "file descriptors",
    "PrintsAndEnds": HERE + "its process ended with status 3",
    "DrawsFromNumpy": "global random numbers",
    "DrawsFromRandom": "global random numbers",
    "ReseedsNumpy": "global random numbers",
    "ReseedsRandom": "global random numbers",
    "HangsInPython": HERE + "no answer within 2 s",
    "HangsInC": HERE + "no answer within 2 s",
    "HangsWithoutThreads": HERE + "no answer within 2 s",
    "HangsAtOnce": FIRST + "no answer within 2 s",
    "HangsWhenMade": FIRST + "no answer within 2 s",
    "HangsInItsAnswer": HERE + "no answer within 2 s",
    "HangsInItsError": HERE + "no answer within 2 s",
    "IsSlow": "limit of 4 s",
    "HangsWhenDropped": "no answer within 2 s",
    "AllocatesAtOnce": HERE + ".*emory",
    "Allocates": HERE + ".*emory",
    "AllocatesInC": HERE + "its process was killed by SIGSEGV",
}

# What others do not suffer from.
HARMLESS = [
    "KeepsTheBox",
    "HandlesSignals",
    "StartsThread",
    "LeavesChildren",
    "LeavesDaemons",
    "Prints",
    "ChangesFolder",
    "ChangesEnvironment",
    "ChangesArithmetic",
    "SetsAnAlarm",
]


def assert_contained(done, undisturbed, expected):
    assert done.status == 0, done.complained
    assert done.said == ""
    assert done.calm() == undisturbed
    found = done.hostile()
    assert found.keys() == set(expected)
    for name, failures in found.items():
        assert len(failures) == 2
        for failure in failures:
            if expected[name] is None:
                assert failure == "", name
            else:
                assert re.search(expected[name], failure), (name, failure[-2000:])
                assert len(failure) < 100_000, name


@pytest.mark.parametrize(
    "names", [["Recurses", "PrintsAndRaises"], pytest.param(ANSWERS, marks=pytest.mark.slow)]
)
def test_what_trackers_raise_and_answer_is_theirs_alone(together, undisturbed, names):
    done = together(*names)
    assert_contained(done, undisturbed, {name: ANSWERS[name] for name in names})
    printed = done.runs["hostile.py:PrintsAndRaises", "A"].output
    assert printed.endswith("word 19999\n")
    assert len(printed) < 100_000


@pytest.mark.slow
def test_what_harms_a_process_is_traced_to_its_culprit(together, undisturbed):
    chosen = ["Segfaults", "HangsInC", "Forks", "DrawsFromNumpy", "AllocatesAtOnce"]
    expected = {name: HARM[name] for name in chosen}
    done = together(*expected)
    assert_contained(done, undisturbed, expected)


@pytest.mark.slow
def test_what_harms_nobody_costs_nobody_anything(together, undisturbed):
    expected = dict.fromkeys(
        ["KeepsTheBox", "HandlesSignals", "StartsThread", "Prints", "LeavesChildren"]
    )
    done = together(*expected)
    assert_contained(done, undisturbed, expected)
    kept = done.runs["hostile.py:KeepsTheBox", "A"].boxes
    np.testing.assert_array_equal(kept[:, 0], 4 + np.arange(FRAMES))
    assert done.runs["hostile.py:Prints", "A"].output == "", "no failure, no output"


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
@pytest.mark.parametrize("name", [*ANSWERS, *HARM])
def test_a_hostile_tracker_is_contained_and_named(together, undisturbed, name):
    done = together(name)
    assert_contained(done, undisturbed, {name: (ANSWERS | HARM)[name]})
    if name == "PrintsAndEnds":
        assert done.runs[f"hostile.py:{name}", "A"].output == "famous last words\n"


@pytest.mark.slow
@pytest.mark.parametrize("name", [*HARMLESS, "LeaksDescriptors", "ForbidsFiles"])
def test_what_is_no_harm_or_takes_from_the_process_costs_nobody_else(together, undisturbed, name):
    assert_contained(together(name), undisturbed, {name: None if name in HARMLESS else "."})


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
