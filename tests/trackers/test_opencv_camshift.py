"""OpenCV's CamShift behind our interface."""

import cv2
import numpy as np
import pytest

from trackmark import trackers
from trackmark.trackers.base.parameters import TrackerError

RED, GREEN = (20, 72, 200), (60, 180, 40)
BOX = np.array([30.0, 20, 18, 24])


def image_with(x, y, colour=RED):
    image = np.full((90, 120, 3), GREEN, np.uint8)
    image[y : y + 24, x : x + 18] = colour
    return image


def test_boxes_are_those_of_opencvs_function_called_by_hand():
    noise = np.random.default_rng(0).normal(0, 20, (6, 90, 120, 3))
    images = [
        np.clip(image_with(30 + 2 * i, 20) + noise[i], 0, 255).astype(np.uint8) for i in range(6)
    ]
    tracker = trackers.create("opencv-camshift", hue_bins=20, minimum_saturation=0.3)
    tracker.init(images[0], BOX)
    hsv = cv2.cvtColor(images[0], cv2.COLOR_BGR2HSV)[20:44, 30:48]
    counts = np.bincount(hsv[hsv[..., 1] >= 77][:, 0] // 9, minlength=20)
    window = (30, 20, 18, 24)
    for image in images[1:]:
        hsv = cv2.cvtColor(image, cv2.COLOR_BGR2HSV)
        weights = np.rint(255 * counts / counts.max())[hsv[..., 0] // 9]
        weights[hsv[..., 1] < 77] = 0
        stop = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 10, 2)
        _, window = cv2.CamShift(weights.astype(np.uint8), window, stop)
        assert tracker.update(image).box.tolist() == list(window)


def test_absent_target_is_invisible_and_empty_box_rejected():
    tracker = trackers.create("opencv-camshift")
    tracker.init(image_with(30, 20), BOX)
    estimate = tracker.update(image_with(0, 0, GREEN))
    assert not estimate.visible
    assert estimate.box.tolist() == BOX.tolist()
    for limits in ({"minimum_value": 0.9}, {"maximum_value": 0.5}):
        tracker = trackers.create("opencv-camshift", **limits)
        with pytest.raises(TrackerError, match="opencv-camshift: no pixel of the box"):
            tracker.init(image_with(30, 20), BOX)
