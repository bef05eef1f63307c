"""Overhead of the evaluation loop per frame and tracker, and the time to store a run."""

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
from trackmark.bench.store.results import Results
from trackmark.trackers import Estimate

FRAMES = 2000


class Repeated:
    """One image again and again: nothing to decode."""

    image = np.zeros((480, 640, 3), np.uint8)

    def __len__(self):
        return FRAMES

    def __getitem__(self, frame):
        return self.image


class Idle:
    """The quickest tracker there can be."""

    def __init__(self, seed):
        self.estimate = Estimate(np.array([1.0, 2.0, 60.0, 140.0]))

    def init(self, image, box, mask=None):
        pass

    def update(self, image):
        return self.estimate


class Talking(Idle):
    """One with details, as the papers' trackers have."""

    def __init__(self, seed):
        details = {"positive_appearances": 3.0, "half_width": 1.0, "updated": 0.0}
        self.estimate = Estimate(np.array([1.0, 2.0, 60.0, 140.0]), True, 0.5, details=details)


@pytest.fixture(scope="module")
def still():
    boxes = np.tile([1.0, 2.0, 60.0, 140.0], (FRAMES, 1))
    return datasets.Sequence("still", Repeated(), boxes, fingerprint="still")


@pytest.mark.parametrize("maker", [Idle, Talking])
@pytest.mark.parametrize("trackers", [1, 20])
def test_overhead_per_frame_and_tracker(benchmark, still, maker, trackers):
    entries = [(parse_tracker(maker), repetition) for repetition in range(trackers)]

    def go():
        return run_protocol(entries, still).overhead

    overhead = benchmark.pedantic(go, rounds=3, iterations=1)
    if benchmark.enabled:
        benchmark.extra_info["microseconds per frame and tracker"] = round(overhead * 1e6, 2)


def test_the_harness_costs_little_beside_opencvs_mean_shift(still):
    # 20 microseconds where mean shift with its back-projection takes 740: 2.7 %.
    entries = [(parse_tracker(Talking), repetition) for repetition in range(4)]
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


@pytest.mark.benchmark(timer=time.perf_counter)  # what another process takes
@pytest.mark.parametrize("arguments", [["--help"], ["list"]])
def test_the_command_answers(benchmark, arguments):
    script = Path(sys.executable).parent / "trackmark"
    benchmark(subprocess.run, [script, *arguments], stdout=subprocess.DEVNULL, check=True)


def test_writing_a_run(benchmark, still, tmp_path):
    (run,) = run_protocol([(parse_tracker(Talking), 0)], still).runs
    results = Results(tmp_path)
    benchmark.pedantic(results.write, args=(run,), rounds=5)
