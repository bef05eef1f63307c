"""Failures of trackers that crash or hang: the reason names the line of source."""

import pytest

from trackmark import bench
from trackmark.bench.engine.unit import Limits
from trackmark.bench.experiments.experiment import Experiment, SequenceSource
from trackmark.bench.store.index import read_index
from trackmark.bench.store.results import Results

SOURCE = """
import ctypes, os, signal
from trackmark.trackers.base.interface import Estimate, TrackerPlugin

class Calm(TrackerPlugin):
    def init(self, image, box, mask=None):
        self.box = box

    def update(self, image):
        self.act()
        return Estimate(self.box)

    def act(self):
        pass

class Hangs(Calm):
    def act(self):
        while True:
            self.box = self.box  # hangs

class Crashes(Calm):
    def act(self):
        ctypes.string_at(0)  # crashes

class Stops(Calm):
    def act(self):
        os.kill(os.getpid(), signal.SIGSTOP)

exec(compile("def aborts(self, image): __import__('os').abort()", "/elsewhere/library.py", "exec"))

class Aborts(Calm):
    update = aborts
"""


@pytest.fixture(scope="module")
def failures(tmp_path_factory, otb):
    """Run the trackers with a calm one; return their failures by class."""
    folder = tmp_path_factory.mktemp("grün")  # `faulthandler` escapes such a path
    file = folder / "own.py"
    file.write_text(SOURCE)
    otb(folder / "A", 4)
    names = ("Calm", "Hangs", "Crashes", "Stops", "Aborts")
    experiment = Experiment(
        "lines", tuple(f"{file}:{name}" for name in names), (SequenceSource(str(folder / "A")),)
    )
    results = bench.run(experiment, folder / "results", jobs=2, limits=Limits(frame_seconds=2))
    return {
        row["tracker"].partition(":")[2]: row["failure"] for row in read_index(Results(results))
    }


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("Calm", ""),
        ("Hangs", "no answer within 2 s at own.py, line {hangs}, in act"),
        ("Crashes", "its process was killed by SIGSEGV at own.py, line {crashes}, in act"),
        ("Stops", "no answer within 2 s"),
        ("Aborts", "its process was killed by SIGABRT at library.py, line 1, in aborts"),
    ],
)
def test_reason_names_the_line_of_a_crash_or_hang(failures, name, reason):
    lines = {
        line.partition("  # ")[2]: number
        for number, line in enumerate(SOURCE.splitlines(), 1)
        if "  # " in line
    }
    assert failures[name].partition(".png: ")[2] == reason.format(**lines)
