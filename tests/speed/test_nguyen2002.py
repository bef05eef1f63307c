"""The template of Kalman filters beside what else one could use: 320x240, target 60x80.

Ratios of processor time in one process, on the same frames and in turns; `pytest -s` shows
them, and how well each follows. The target is 0.7 ms a frame as written and 1.1 as recommended:
whether it is met, a reproduction of the paper prints.

Bounds of what is told as a multiple are 1.6 or 1.7 times what was measured when they were written,
which differed by a tenth at most from time to time, on two cores with work for seven: so much may
other machines differ, and what takes twice as long is noticed.
"""

from statistics import median
from time import thread_time

import cv2
import numpy as np
import pytest

import trackers
from tests.speed.rivals import MeanShift, compare, run, say


def textured(rng, rows, columns, scale):
    noise = cv2.GaussianBlur(rng.uniform(0, 1, (rows, columns, 3)), (0, 0), scale)
    return cv2.normalize(noise, None, 0, 255, cv2.NORM_MINMAX)


@pytest.fixture(scope="module")
def small_clip():
    """Frames of a textured target before textured ground; a board covers it in frames 50 to 90."""
    rng = np.random.default_rng(0)
    ground, target = textured(rng, 240, 320, 4), textured(rng, 80, 60, 2)
    board = textured(rng, 240, 96, 6)
    images, boxes = [], []
    for frame in range(120):
        x, y = round(100 + 40 * np.sin(frame / 20)), round(80 + 20 * np.cos(frame / 15))
        image = ground + rng.normal(0, 2, ground.shape)
        image[y : y + 80, x : x + 60] = target + rng.normal(0, 2, target.shape)
        left = round(-96 + 8 * (frame - 45))
        seen = slice(max(left, 0), min(left + 96, 320))
        if seen.stop > seen.start:
            image[:, seen] = board[:, seen.start - left : seen.stop - left]
        images.append(np.clip(image, 0, 255).astype(np.uint8))
        boxes.append((x, y, 60, 80))
    return images, np.array(boxes, float)


def nguyen2002(clip, **parameters):
    tracker = trackers.create("nguyen2002", **parameters)
    run(tracker, clip)  # compiles
    return tracker


MEAN_SHIFTS = {"as-written": (2.3, 4.2), "recommended": (3.0, 6.2)}
"""What a frame cost when this was written, by preset: of one component, and of three."""


@pytest.mark.parametrize("features", ["intensity", "rgb", "invariants", "arctan"])
@pytest.mark.parametrize("preset", MEAN_SHIFTS)
def test_it_costs_some_mean_shifts(small_clip, features, preset):
    ours = nguyen2002(small_clip, features=features, preset=preset)
    usual = MEAN_SHIFTS[preset][features != "intensity"]
    assert compare(small_clip, ours, MeanShift()) > 1 / (1.7 * usual)


def test_what_an_occlusion_costs_when_its_end_is_found(small_clip):
    images, truth = small_clip
    tracker = nguyen2002(small_clip, features="rgb")
    tracker.init(images[0], truth[0])
    usual, bursts = [], []
    for image in images[1:]:
        begin = thread_time()
        estimate = tracker.update(image)
        seconds = thread_time() - begin
        (bursts if estimate.revised else usual).append(seconds)
    assert bursts, "no occlusion was found"
    frames = max(bursts) / median(usual)
    say(f"usual {median(usual) * 1e3:.2f} ms; the burst at the end is {frames:.0f} usual frames")
    assert frames < 1.6 * 32  # thirty are seen again, and one is searched for farther away


def test_time_grows_with_the_targets_area_at_most(small_clip):
    images, truth = small_clip
    seconds = {}
    for factor in (0.5, 1.0):
        centres = truth[:, :2] + truth[:, 2:] / 2
        smaller = np.concatenate([centres - factor * truth[:, 2:] / 2, factor * truth[:, 2:]], 1)
        own = seconds.setdefault(factor, [])
        run(nguyen2002((images, smaller), features="rgb"), (images, smaller), own)
    ratio = median(seconds[1.0]) / median(seconds[0.5])
    say(f"a target four times as large costs {ratio:.1f} times as much")
    assert ratio < 4  # no more than its area; 2.3 to 2.5 when written
