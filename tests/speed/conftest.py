"""Frames that the particle filters are timed on; OpenCV on one thread."""

import cv2
import numpy as np
import pytest


@pytest.fixture(scope="module", autouse=True)
def one_thread():
    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    yield
    cv2.setNumThreads(before)


@pytest.fixture(scope="module")
def clip():
    """Frames of a red and blue target with some texture on ground of many colours."""
    rng = np.random.default_rng(0)
    ground = np.zeros((480, 640, 3))
    for scale in (3, 12, 40):
        noise = cv2.GaussianBlur(rng.uniform(0, 1, ground.shape), (0, 0), scale)
        ground += cv2.normalize(noise, None, 0, 80, cv2.NORM_MINMAX)
    target = np.empty((140, 60, 3))
    target[:70], target[70:] = (45, 45, 190), (180, 70, 40)
    target += cv2.GaussianBlur(rng.normal(0, 60, target.shape), (0, 0), 2)
    images, boxes = [], []
    for frame in range(40):
        image = ground + rng.normal(0, 4, ground.shape)
        x, y = round(290 + 120 * np.sin(frame / 14)), round(170 + 80 * np.cos(frame / 11))
        image[y : y + 140, x : x + 60] = target + rng.normal(0, 4, target.shape)
        images.append(np.clip(image, 0, 255).astype(np.uint8))
        boxes.append((x, y, 60, 140))
    return images, np.array(boxes, float)
