"""Time of shared computations, which each tracker that uses them is charged."""

import time

import numpy as np

from trackmark.trackers.base.sharing import SharedFrame


def compute(image):
    end = time.thread_time() + 0.01
    while time.thread_time() < end:
        pass
    return image.sum()


def test_cached_result_is_charged_with_its_time():
    frame = SharedFrame(np.zeros((4, 5, 3), np.uint8), 2)
    frame.compute(compute)
    assert frame.saved_seconds == 0
    frame.compute(compute)
    assert frame.saved_seconds >= 0.01
