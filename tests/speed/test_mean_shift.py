"""Kernel-weighted mean shift beside OpenCV's on a hue back-projection: 640x480, target 60x140."""

import pytest

import trackers
from tests.speed.rivals import MeanShift, compare, run


def warm(clip, name, **parameters):
    tracker = trackers.create(name, **parameters)
    run(tracker, clip, n=3)  # compiles, fills tables
    return tracker


@pytest.mark.parametrize(
    ("name", "preset", "at_most"),
    [  # 0.45, 0.9, 0.75 and 1.2 where this was written
        ("mean-shift", "as-written", 0.75),
        ("mean-shift", "recommended", 1.2),
        ("mean-shift-kalman", "as-written", 1.1),
        ("mean-shift-kalman", "recommended", 1.6),
    ],
)
def test_it_costs_no_more_than_opencvs_mean_shift_on_the_whole_frame(clip, name, preset, at_most):
    assert compare(clip, warm(clip, name, preset=preset), MeanShift()) > 1 / at_most


@pytest.mark.parametrize("name", ["mean-shift", "mean-shift-kalman"])
def test_speed_of_mean_shift(benchmark, clip, name):
    benchmark(run, warm(clip, name), clip)
