"""Overhead of the evaluation loop, and time of commands."""

import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from tests.speed.rivals import MeanShift, seconds_of
from trackmark import datasets
from trackmark.bench.evaluation.loop import run_protocol
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.trackers import Estimate

FRAMES = 2000


class Repeated:
    """Frames that repeat one image without decoding."""

    image = np.zeros((480, 640, 3), np.uint8)

    def __len__(self):
        return FRAMES

    def __getitem__(self, frame):
        return self.image


class Idle:
    """Tracker without computation."""

    def __init__(self, seed):
        self.estimate = Estimate(np.array([1.0, 2.0, 60.0, 140.0]))

    def init(self, image, box, mask=None):
        pass

    def update(self, image):
        return self.estimate


class IdleWithDetails(Idle):
    """Tracker whose estimates have details."""

    def __init__(self, seed):
        details = {"positive_appearances": 3.0, "half_width": 1.0, "updated": 0.0}
        self.estimate = Estimate(np.array([1.0, 2.0, 60.0, 140.0]), True, 0.5, details=details)


@pytest.fixture(scope="module")
def still():
    boxes = np.tile([1.0, 2.0, 60.0, 140.0], (FRAMES, 1))
    return datasets.Sequence("still", Repeated(), boxes, fingerprint="still")


@pytest.mark.parametrize("maker", [Idle, IdleWithDetails])
@pytest.mark.parametrize("trackers", [1, 20])
def test_overhead_per_frame_and_tracker(benchmark, still, maker, trackers):
    entries = [(parse_tracker(maker), repetition) for repetition in range(trackers)]

    def measure_overhead():
        return seconds_of(run_protocol, entries, still) / FRAMES / trackers

    overhead = benchmark.pedantic(measure_overhead, rounds=3, iterations=1)
    if benchmark.enabled:
        benchmark.extra_info["microseconds per frame and tracker"] = round(overhead * 1e6, 2)


def test_loop_overhead_is_below_3_percent_of_mean_shift(still):
    # 20 µs, mean shift with back-projection 740 µs: 2.7 %.
    entries = [(parse_tracker(IdleWithDetails), repetition) for repetition in range(4)]
    image = np.random.default_rng(0).integers(0, 256, (480, 640, 3), dtype=np.uint8)
    mean_shift = MeanShift()
    mean_shift.init(image, np.array([100, 100, 60, 140]))
    run_protocol(entries, still)
    ratios = []
    for _ in range(5):
        harness = seconds_of(run_protocol, entries, still) / FRAMES / len(entries)
        theirs = sum(seconds_of(mean_shift.update, image) for _ in range(50)) / 50
        ratios.append(harness / theirs)
    assert min(ratios) < 0.027


@pytest.mark.benchmark(timer=time.perf_counter)  # time of another process
@pytest.mark.parametrize("arguments", [["--help"], ["list"]])
def test_command_time(benchmark, arguments):
    script = Path(sys.executable).parent / "trackmark"
    benchmark(subprocess.run, [script, *arguments], stdout=subprocess.DEVNULL, check=True)
