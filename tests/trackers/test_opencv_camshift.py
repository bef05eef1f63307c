"""OpenCV's CamShift behind our interface."""

import cv2
import numpy as np
import pytest

import trackers
from trackers.base.parameters import TrackerError

RED, GREEN = (20, 72, 200), (60, 180, 40)


def image_with(x, y, colour=RED):
    image = np.full((90, 120, 3), GREEN, np.uint8)
    image[y : y + 24, x : x + 18] = colour
    return image


def test_boxes_are_those_of_opencvs_function_called_by_hand():
    rng = np.random.default_rng(0)
    images = [
        np.clip(image_with(30 + 2 * i, 20) + rng.normal(0, 20, (90, 120, 3)), 0, 255)
        for i in range(6)
    ]
    images = [image.astype(np.uint8) for image in images]
    tracker = trackers.create("opencv-camshift", hue_bins=20, minimum_saturation=0.3)
    tracker.init(images[0], np.array([30.0, 20, 18, 24]))
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


def test_a_target_that_is_gone_is_not_visible_and_the_box_stays():
    tracker = trackers.create("opencv-camshift")
    box = np.array([30.0, 20, 18, 24])
    tracker.init(image_with(30, 20), box)
    estimate = tracker.update(image_with(0, 0, GREEN))
    assert not estimate.visible
    assert estimate.box.tolist() == box.tolist()


def test_a_target_without_a_pixel_that_counts_is_refused():
    for limits in ({"minimum_value": 0.9}, {"maximum_value": 0.5}):
        tracker = trackers.create("opencv-camshift", **limits)
        with pytest.raises(TrackerError, match="opencv-camshift: no pixel of the box"):
            tracker.init(image_with(30, 20), np.array([30.0, 20, 18, 24]))
