"""CamShift beside OpenCV's mean shift on the same frames: 640x480, target 60x140."""

from statistics import median
from time import thread_time

import cv2
import numpy as np
import pytest

import trackers

SIZE = 60, 140
STOP = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 10, 2)


@pytest.fixture(scope="module")
def clip():
    """Frames of a red and blue target on coloured ground, and its first box."""
    rng = np.random.default_rng(0)
    ground = cv2.GaussianBlur(rng.integers(0, 256, (480, 640, 3), dtype=np.uint8), (0, 0), 3)
    ground = cv2.normalize(ground, None, 60, 160, cv2.NORM_MINMAX)
    ground[..., 1] = np.maximum(ground[..., 1], ground.max(axis=2))  # greenish, no red or blue
    images = []
    for frame in range(40):
        image = ground.copy()
        x, y = round(290 + 120 * np.sin(frame / 14)), round(170 + 80 * np.cos(frame / 11))
        image[y : y + 140, x : x + 60] = (20, 72, 200)
        image[y + 70 : y + 140, x : x + 60] = (200, 56, 30)
        noise = rng.normal(0, 4, image.shape)
        images.append(np.clip(image + noise, 0, 255).astype(np.uint8))
    return images, np.array([290.0, 250.0, 60.0, 140.0])


class MeanShift:
    """OpenCV's mean shift on the hue back-projection of the whole frame."""

    def init(self, image, box):
        self.window = tuple(box.astype(int))
        x, y, width, height = self.window
        hsv = cv2.cvtColor(image[y : y + height, x : x + width], cv2.COLOR_BGR2HSV)
        counts = cv2.calcHist([hsv], [0], None, [32], [0, 180])
        self.counts = cv2.normalize(counts, None, 0, 255, cv2.NORM_MINMAX)

    def update(self, image):
        hsv = cv2.cvtColor(image, cv2.COLOR_BGR2HSV)
        projection = cv2.calcBackProject([hsv], [0], self.counts, [0, 180], 1)
        _, self.window = cv2.meanShift(projection, self.window, STOP)


def run(tracker, clip, seconds=None):
    images, box = clip
    tracker.init(images[0], box)
    for image in images[1:]:
        begin = thread_time()
        tracker.update(image)
        if seconds is not None:
            seconds.append(thread_time() - begin)


@pytest.fixture
def camshift(clip):
    tracker = trackers.create("camshift")
    run(tracker, clip)  # compiles
    return tracker


def test_camshift_costs_less_than_opencvs_mean_shift_on_the_whole_frame(clip, camshift):
    ours, theirs = [], []
    for _ in range(3):  # in turns, so that both meet the same machine
        run(camshift, clip, ours)
        run(MeanShift(), clip, theirs)
    assert median(ours) < 0.8 * median(theirs)  # 0.3 where this was written


def test_speed_of_camshift(benchmark, clip, camshift):
    benchmark(run, camshift, clip)


def test_speed_of_adaptive_camshift(benchmark, clip, camshift):
    benchmark(run, trackers.create("camshift", window="adaptive"), clip)


def test_speed_of_opencvs_mean_shift(benchmark, clip):
    benchmark(run, MeanShift(), clip)
