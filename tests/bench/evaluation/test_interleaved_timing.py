"""Trackers timed in turns, each in its own process, with a simulated clock."""

from dataclasses import replace

import numpy as np
import pytest

from trackmark.bench.evaluation.interleaved_timing import TurnError, time_interleaved
from trackmark.bench.evaluation.timed_clips import Clip, Setup

TRACKER = """
from trackmark.trackers.base.interface import Estimate, TrackerPlugin
from trackmark.bench.evaluation import timed_clips

ticks = 0.0


class Clock:
    def start(self):
        self.started = ticks

    def stop(self):
        return timed_clips.TurnTime(ticks - self.started, 0.0)


timed_clips.CLOCK = Clock()


class Mine(TrackerPlugin):
    def watch(self, image):
        self.watched = getattr(self, "watched", 0) + 1

    def init(self, image, box, mask=None):
        assert (self.watched, image[0, 0, 0], mask.sum()) == (2, 2, 6)
        self.box = box

    def update(self, image):
        global ticks
        ticks += COST * float(image[0, 0, 0])
        {then}
        return Estimate(self.box)
"""


@pytest.fixture
def clips(tmp_path):
    """Return a clip of eight frames: pixels are frame numbers, the target appears in frame 2."""
    frames = np.zeros((8, 4, 5, 3), np.uint8) + np.arange(8, dtype=np.uint8)[:, None, None, None]
    np.save(tmp_path / "frames.npy", frames)
    np.save(tmp_path / "mask.npy", np.ones((2, 3), bool))
    place, mask = str(tmp_path / "frames.npy"), str(tmp_path / "mask.npy")
    return [Clip(images=place, first=2, box=(0, 0, 2, 2), n_frames=5, mask=mask, seed=(1, 2))]


@pytest.fixture
def tracker(tmp_path):
    def make_setup(name, cost=0.001, then=""):
        file = tmp_path / f"{name}.py"
        file.write_text(TRACKER.replace("COST", str(cost)).replace("{then}", then))
        return Setup(str(file), {})

    return make_setup


def test_slower_tracker_takes_twice_as_long_on_equal_frames(tracker, clips):
    times = time_interleaved([tracker("cheap"), tracker("dear", 0.002)], clips)
    passes, turns = times.shape[1:]
    assert passes >= 3
    assert turns == 5
    assert times[0, 0] == pytest.approx(0.001 * np.arange(3, 8))
    assert times[1] == pytest.approx(2 * times[0])


def test_old_tracker_imports_old_modules(tracker, clips, tmp_path, monkeypatch):
    folders = [tmp_path / name for name in ("now", "then")]
    for folder, cost in zip(folders, (0.002, 0.001), strict=True):
        folder.mkdir()
        (folder / "beside.py").write_text(f"COST = {cost}")
    monkeypatch.setenv("PYTHONPATH", str(folders[0]))
    now = tracker("mine", "__import__('beside').COST")
    then = replace(now, swapped=list(map(str, folders)))
    times = time_interleaved([then, now], clips)
    assert times[1] == pytest.approx(2 * times[0])


@pytest.mark.parametrize(
    ("then", "words"),
    [
        ("raise RuntimeError('no\\nmore')", "RuntimeError: no more"),
        ("import os; os._exit(3)", "the process ended with status 3"),
        ("ticks = float('nan')", "nan is not a duration"),
        ("ticks = 0.0", "0.0 is not a duration"),
    ],
)
def test_tracker_that_cannot_be_timed_is_reported(tracker, clips, then, words):
    with pytest.raises(TurnError, match=words):
        time_interleaved([tracker("bad", then=then)], clips)
