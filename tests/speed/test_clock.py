"""Times per frame on an idle and on an occupied machine, and in accuracy and in timing runs.

`make bench` prints the ratios. Times of one-pass runs are trustworthy if other load hardly changes
them; short tables show them without a mark.
"""

import subprocess
import sys
import time

import numpy as np
import pytest

from trackmark import datasets
from trackmark.bench.evaluation.loop import run_protocol
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.trackers.base.plain import to_plugin

TRACKERS = (
    *("static", "camshift", "mean-shift", "mean-shift-kalman", "particle-filter", "wang2010"),
    *("multipart", "nummiaro2003", "nguyen2002", "moreno2005"),
)
ROUNDS = 3


class Sleep20:
    """Tracker that waits 20 ms, as for a GPU."""

    def init(self, image, box):
        self.box = box

    def update(self, image):
        time.sleep(0.02)
        return self.box


PLUGIN = to_plugin(Sleep20)


@pytest.fixture(scope="module")
def sequence():
    return datasets.load("samples/face")[:60]


@pytest.fixture
def occupied():
    """Return a function that occupies every core by another process until the test ends."""
    others = []

    def occupy(number):
        while len(others) > number:
            other = others.pop()
            other.kill()
            other.wait()
        while len(others) < number:
            others.append(subprocess.Popen([sys.executable, "-c", "while True: pass"]))
        time.sleep(0.2)

    yield occupy
    occupy(0)


def measured(name, sequence, protocol):
    tracker = (lambda seed: PLUGIN(PLUGIN.Parameters(), seed)) if name == "Sleep20" else name
    (run,) = run_protocol([(parse_tracker(tracker), 0)], sequence, protocol).runs
    return run.metadata["ms_per_frame_median"]


@pytest.mark.parametrize("name", [*TRACKERS, "Sleep20"])
def test_other_load_hardly_changes_times(benchmark, sequence, occupied, name):
    if not benchmark.enabled:
        pytest.skip("a benchmark: make bench")
    times = {0: [], 2: []}
    measured(name, sequence, "one-pass")  # compiles kernels
    for _ in range(ROUNDS):
        for number in times:
            occupied(number)
            times[number].append(measured(name, sequence, "one-pass"))
    idle, busy = (float(np.median(values)) for values in times.values())
    benchmark.extra_info["ms/frame idle"] = round(idle, 4)
    benchmark.extra_info["occupied/idle"] = round(busy / idle, 2)
    benchmark.pedantic(lambda: None, rounds=1)


@pytest.mark.parametrize("name", TRACKERS)
def test_accuracy_runs_are_as_fast_as_timing_runs(benchmark, sequence, name):
    if not benchmark.enabled:
        pytest.skip("a benchmark: make bench")
    pairs = [[measured(name, sequence, p) for p in ("one-pass", "timing")] for _ in range(ROUNDS)]
    accuracy, timing = np.median(pairs, axis=0).tolist()
    benchmark.extra_info["accuracy/timing"] = round(accuracy / timing, 2)
    benchmark.pedantic(lambda: None, rounds=1)
