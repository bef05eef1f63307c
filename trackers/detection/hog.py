"""Detector of people by histograms of oriented gradients (HOG; Dalal & Triggs 2005)."""

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.trackers.base.interface import Image
from trackmark.trackers.base.parameters import TrackerError

MARGIN = np.array([0.15, 0.12])  # share of the 64 x 128 px window around people 96 px high


def people(least_score: float = 0.0) -> Callable[[Image], NDArray[np.float64]]:
    """Return OpenCV's trained detector of upright people, at least 128 pixels high.

    Parameters
    ----------
    least_score : float
        Minimum distance from the classifier's decision boundary.

    Returns
    -------
    callable
        Function from a BGR image to boxes, float64 (k, 4) [pixels], the highest score first. Boxes
        are the detector's windows without the margin of its training images.

    Raises
    ------
    TrackerError
        If the installed OpenCV has no HOG detector.
    """
    if not hasattr(cv2, "HOGDescriptor"):
        raise TrackerError(
            f"the installed OpenCV {cv2.__version__} has no HOG detector; run "
            "`pip install --force-reinstall --no-deps opencv-contrib-python-headless`."
        )
    hog = cv2.HOGDescriptor()
    hog.setSVMDetector(cv2.HOGDescriptor.getDefaultPeopleDetector())

    def detect(image: Image) -> NDArray[np.float64]:
        boxes, scores = hog.detectMultiScale(image, hitThreshold=least_score)
        order = np.argsort(-np.ravel(scores), kind="stable")
        windows = np.reshape(boxes, (-1, 4)).astype(np.float64)[order]
        sizes = windows[:, 2:]
        return np.hstack([windows[:, :2] + MARGIN * sizes, (1 - 2 * MARGIN) * sizes])

    return detect
