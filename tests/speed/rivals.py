"""Reference trackers and time measurements of the speed tests."""

from statistics import median
from time import thread_time

import cv2
import numpy as np

from trackmark import trackers

STOP = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 10, 2)


class MeanShift:
    """OpenCV's mean shift on a hue back-projection of the frame or of the window ± `margin`."""

    def __init__(self, margin=1000):
        self.margin = margin

    def init(self, image, box):
        self.window = tuple(box.astype(int))
        x, y, width, height = self.window
        hsv = cv2.cvtColor(image[y : y + height, x : x + width], cv2.COLOR_BGR2HSV)
        counts = cv2.calcHist([hsv], [0], None, [180], [0, 180])
        self.counts = cv2.normalize(counts, None, 0, 255, cv2.NORM_MINMAX)

    def update(self, image):
        x, y, width, height = self.window
        left, top = max(x - self.margin, 0), max(y - self.margin, 0)
        near = image[top : y + height + self.margin, left : x + width + self.margin]
        hsv = cv2.cvtColor(near, cv2.COLOR_BGR2HSV)
        projection = cv2.calcBackProject([hsv], [0], self.counts, [0, 180], 1)
        _, (x, y, width, height) = cv2.meanShift(
            projection, (x - left, y - top, width, height), STOP
        )
        self.window = x + left, y + top, width, height
        return trackers.Estimate(np.array(self.window, float))


def run(tracker, clip, seconds=None, n=40):
    """Track a clip and return the mean overlap."""
    images, truth = clip
    tracker.init(images[0], truth[0])
    overlaps = []
    for image, expected in zip(images[1:n], truth[1:], strict=False):
        begin = thread_time()
        estimate = tracker.update(image)
        if seconds is not None:
            seconds.append(thread_time() - begin)
        first = np.maximum(estimate.box[:2], expected[:2])
        last = np.minimum(estimate.box[:2] + estimate.box[2:], expected[:2] + expected[2:])
        common = np.prod(np.maximum(last - first, 0))
        overlaps.append(common / (np.prod(estimate.box[2:]) + np.prod(expected[2:]) - common))
    return np.mean(overlaps)


def print_ratio(*words):
    print("\n ", *words, end="")  # noqa: T201  # for `pytest -s`


def warm(text, clip):
    """Return the tracker of a spec such as `multipart:particles=400`, compiled and warmed up."""
    name, *options = text.split(":")
    tracker = trackers.create(name, **dict(option.split("=") for option in options))
    run(tracker, clip, n=3)
    return tracker


def seconds_of(function, *arguments):
    """Return the processor time of a call [s]."""
    begin = thread_time()
    function(*arguments)
    return thread_time() - begin


def compare(clip, ours, theirs, rounds=3, n=40):
    """Return the ratio of median times, theirs over ours, measured alternately."""
    our_seconds, their_seconds = [], []
    for _ in range(rounds):
        our_overlap = run(ours, clip, our_seconds, n)
        their_overlap = run(theirs, clip, their_seconds, n)
    ratio = median(their_seconds) / median(our_seconds)
    print_ratio(
        f"ours {median(our_seconds) * 1e3:.3f} ms (p99 {np.percentile(our_seconds, 99) * 1e3:.3f}),"
        f" theirs {median(their_seconds) * 1e3:.3f} ms, {ratio:.2f} times ours;"
        f" overlap {our_overlap:.2f}, theirs {their_overlap:.2f}"
    )
    return ratio
