"""The filters on colour and motion beside what else one could use: 640x480, target 60x140.

Ratios of processor time in one process, on the same frames and in turns; `pytest -s` shows
them, and how well each follows. The motion of the whole frame is measured in each.
"""

from statistics import median
from time import thread_time

import cv2
import numpy as np
import pytest

import trackers
from tests.speed.rivals import MeanShift, compare, run, say
from trackers.base.sharing import SharedFrame


def tracker_of(clip, name="wang2010", **parameters):
    tracker = trackers.create(name, **parameters)
    run(tracker, clip, n=3)  # compiles
    return tracker


@pytest.fixture(scope="module")
def small_clip():
    """A ball of 12 pixels on ground of many colours, at the size of the paper's sequence."""
    rng = np.random.default_rng(0)
    ground = cv2.GaussianBlur(rng.uniform(0, 255, (115, 142, 3)), (0, 0), 2)
    images, boxes = [], []
    for frame in range(40):
        image = ground + rng.normal(0, 4, ground.shape)
        x, y = round(65 + 40 * np.sin(frame / 14)), round(50 + 30 * np.cos(frame / 11))
        image[y : y + 12, x : x + 12] = (40, 140, 230) + rng.normal(0, 6, (12, 12, 3))
        images.append(np.clip(image, 0, 255).astype(np.uint8))
        boxes.append((x, y, 12, 12))
    return images, np.array(boxes, float)


@pytest.mark.parametrize("preset", ["as-written", "recommended", "robust"])
def test_it_costs_at_most_three_times_opencvs_mean_shift_on_the_whole_frame(clip, preset):
    # When written 2.4 to 2.5.
    assert compare(clip, tracker_of(clip, preset=preset), MeanShift()) > 1 / 3


def test_the_other_trackers_beside_opencvs_mean_shift(clip):
    for name in ("particle-filter", "camshift-improved"):
        say(name)
        assert compare(clip, tracker_of(clip, name), MeanShift()) > 1 / 5


def test_on_frames_as_small_as_the_papers_it_costs_a_few_mean_shifts(small_clip):
    # When written 0.20 ms, 3.7 times as much.
    assert compare(small_clip, tracker_of(small_clip), MeanShift()) > 1 / 8


def test_a_cloud_over_the_whole_frame_costs_a_few_usual_frames(clip):
    images, _ = clip
    tracker = tracker_of(clip)
    rng = np.random.default_rng(0)
    lost, usual = [], []
    for _ in range(2):
        run(tracker, clip, usual)
        for image in images[1:]:
            tracker._places = np.column_stack([rng.uniform(30, 610, 60), rng.uniform(70, 410, 60)])
            begin = thread_time()
            tracker.update(image)
            lost.append(thread_time() - begin)
    say(f"lost {median(lost) * 1e3:.3f} ms: {median(lost) / median(usual):.1f} usual frames")
    # When written 2.2 to 2.6, 3 is the target; memory shared with others makes it vary.
    assert median(lost) < 4 * median(usual)


def test_time_grows_no_faster_than_the_number_of_particles(clip):
    seconds = {n: [] for n in (60, 600, 6000)}
    for n, own in seconds.items():
        run(tracker_of(clip, particles=n, radius=4), clip, own, 12)
    found = {n: median(own) for n, own in seconds.items()}
    say({n: f"{value * 1e3:.3f} ms" for n, value in found.items()})
    assert found[6000] < 11 * found[600]
    assert found[600] < 11 * found[60]


def test_many_in_lock_step_cost_less_than_each_alone(clip):
    images, truth = clip
    company = [trackers.create("wang2010", seed) for seed in range(20)]
    alone, together = [], []
    frame = SharedFrame(images[0], len(company))
    for tracker in company:
        tracker.init_shared(frame, truth[0])
    for image in images[1:12]:
        frame = SharedFrame(image, len(company))
        begin = thread_time()
        for tracker in company:
            tracker.update_shared(frame)
        together.append(thread_time() - begin)
    run(tracker_of(clip), clip, alone, 12)
    ratio = median(together) / median(alone) / len(company)
    say(f"each in company costs {ratio:.2f} of one alone")
    assert ratio < 0.8
