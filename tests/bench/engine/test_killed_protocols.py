"""A kill in a run by another protocol than one pass costs nothing that was finished."""

import signal
import sys

import pytest

from tests.bench.engine.conftest import send
from trackmark import bench
from trackmark.bench.experiments.experiment import Experiment, SequenceSource
from trackmark.bench.store.results import Results
from trackmark.bench.store.unfinished import unfinished_runs

TRACKMARK = [sys.executable, "-c", "from trackmark.bench.cli import main; main()"]
FRAMES = 20
SEEDS = 2

TRACKER = '''
"""Walks at random; waits once, long after it was begun for the first time."""
import os
import time
from pathlib import Path

import numpy as np
from trackmark.trackers.base.interface import Estimate, Randomness, TrackerPlugin

calls = 0


class Draws(TrackerPlugin):
    """A random walk, sure of itself."""

    randomness = Randomness.GENERATOR

    def init(self, image, box, mask=None):
        self.random = np.random.default_rng(self.seed)
        self.box = box.copy()

    def update(self, image):
        global calls
        calls += 1
        here = Path(os.environ.get("TRACKER_WAITS", __file__))
        if calls == 50 and not here.exists():
            here.touch()
            while True:
                time.sleep(0.05)
        self.box[:2] += 2 * self.random.normal(size=2)
        drawn = self.random.random()
        return Estimate(self.box.copy(), confidence=drawn, details={"drawn": drawn})
'''

EVERYDAY = "tre:starts=4:least=5"
OTHERS = ["anchors:spacing=7", "long-term", "real-time:seconds=0.05/0.01", "sre", "supervised"]


@pytest.mark.parametrize(
    "protocol", [EVERYDAY, *(pytest.param(one, marks=pytest.mark.weekly) for one in OTHERS)]
)
def test_what_a_kill_leaves_is_gone_on_with(
    protocol, tmp_path, otb, begin, wait_until, contents, without_processes
):
    (tmp_path / "walk.py").write_text(TRACKER)
    for name in "AB":
        otb(tmp_path / name, FRAMES)
    tracker = f"{tmp_path}/walk.py:Draws"
    sources = tuple(SequenceSource(str(tmp_path / name)) for name in "AB")
    with without_processes():
        calm = Experiment("calm", (tracker,), sources, SEEDS, protocol=protocol)
        undisturbed = contents(bench.run(calm, tmp_path / "results", jobs=1))
    assert len(undisturbed) == len(sources) * SEEDS

    asked = ["run", "--trackers", tracker, "--sequences", f"{tmp_path}/A,{tmp_path}/B"]
    asked += ["--protocol", protocol, "--seeds", str(SEEDS), "--name", "killed", "--jobs", "1"]
    asked += ["--output", str(tmp_path / "results"), "--frame-limit", "600"]
    cache = {"TRACKMARK_CACHE": str(tmp_path / "cache")}
    waits = tmp_path / "waits"
    command = begin([*TRACKMARK, *asked], tmp_path, TRACKER_WAITS=str(waits), **cache)
    folder = tmp_path / "results" / "killed"
    wait_until(waits.exists)
    reached = [(reached, frames) for _, reached, frames in unfinished_runs(folder)]
    rows = {len(columns["frame"]) // 4 for _, _, columns in undisturbed.values()}
    assert reached
    assert all(0 < some < frames and frames in rows for some, frames in reached)
    send(command.process.pid, signal.SIGKILL)
    assert command.wait() == -signal.SIGKILL
    wait_until(lambda: not command.living())
    kept = {file: file.stat().st_mtime_ns for file in Results(folder).files()}
    assert len(kept) < len(undisturbed)

    again = begin([*TRACKMARK, *asked], tmp_path, **cache)
    assert again.wait() == 0, again.complained
    assert contents(folder) == undisturbed
    assert all(file.stat().st_mtime_ns == stamp for file, stamp in kept.items())
