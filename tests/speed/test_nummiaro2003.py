"""The elliptic particle filter beside what else one could use: 640x480, target 60x140.

Ratios of processor time in one process, on the same frames and in turns; `pytest -s` shows
them, and how well each follows. The first estimates' ellipses are as large as the target: where
they shrink, the later frames cost less.
"""

from statistics import median
from time import thread_time

import numpy as np
import pytest

import trackers
from tests.speed.rivals import MeanShift, compare, run, say
from trackers.base.sharing import SharedFrame
from trackers.histograms.motion import at_rest


def nummiaro2003(clip, **parameters):
    tracker = trackers.create("nummiaro2003", **parameters)
    run(tracker, clip, n=3)  # compiles
    return tracker


@pytest.mark.parametrize("preset", ["as-written", "recommended"])
@pytest.mark.parametrize(("particles", "at_most"), [(100, 1.9), (200, 3.3)])
def test_it_costs_little_more_than_opencvs_mean_shift_on_the_whole_frame(
    clip, preset, particles, at_most
):
    ours = nummiaro2003(clip, preset=preset, particles=particles)
    # When written 1.5 with 100; with 200 2.2 as recommended, where ellipses shrink, else 2.7.
    assert compare(clip, ours, MeanShift()) > 1 / at_most


def test_beside_opencvs_mean_shift_on_the_search_window(clip):
    assert compare(clip, nummiaro2003(clip), MeanShift(40)) > 1 / 8


def test_a_cloud_over_the_whole_frame_costs_at_most_three_usual_frames(clip):
    images, _ = clip
    tracker = nummiaro2003(clip, placement="image")
    rng = np.random.default_rng(0)
    lost, usual = [], []
    for _ in range(2):
        run(tracker, clip, usual)
        half_axes = tracker._mean[4:6]
        for image in images[1:]:
            places = np.column_stack([rng.uniform(30, 610, 100), rng.uniform(70, 410, 100)])
            tracker._particles = at_rest(places, half_axes)
            begin = thread_time()
            tracker.update(image)
            lost.append(thread_time() - begin)
    say(f"lost {median(lost) * 1e3:.3f} ms: {median(lost) / median(usual):.1f} usual frames")
    assert median(lost) < 3 * median(usual)


def test_time_grows_no_faster_than_the_number_of_particles(clip):
    seconds = {n: [] for n in (100, 400, 1600)}
    for n, own in seconds.items():
        run(nummiaro2003(clip, particles=n), clip, own, 12)
    found = {n: median(own) for n, own in seconds.items()}
    say({n: f"{value * 1e3:.3f} ms" for n, value in found.items()})
    assert found[1600] < 4.5 * found[400]
    assert found[400] < 4.5 * found[100]


def test_many_in_lock_step_cost_less_than_each_alone(clip):
    images, truth = clip
    company = [trackers.create("nummiaro2003", seed) for seed in range(40)]
    for tracker in company:
        tracker.init(images[0], truth[0])
    alone, together = [], []
    for number, image in enumerate(images[1:21]):
        frame = SharedFrame(image, 40 if number % 2 else 1)
        begin = thread_time()
        for tracker in company:
            tracker.update_shared(frame)
        (together if number % 2 else alone).append((thread_time() - begin) / 40)
    say(f"alone {median(alone) * 1e3:.3f} ms, in lock step {median(together) * 1e3:.3f} ms")
    assert median(together) < 1.02 * median(alone)


def test_speed_of_nummiaro2003(benchmark, clip):
    benchmark(run, nummiaro2003(clip), clip)
