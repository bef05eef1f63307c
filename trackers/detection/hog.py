"""People by histograms of oriented gradients (Dalal & Triggs 2005), as OpenCV trained them."""

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.trackers.base.interface import Image
from trackmark.trackers.base.parameters import TrackerError

MARGIN = np.array([0.15, 0.12])  # of 64 x 128 pixels, around people 96 pixels high


def people(least_score: float = 0.0) -> Callable[[Image], NDArray[np.float64]]:
    """Detector of upright people at least 128 pixels high.

    From a distance of `least_score` from the classifier's margin on something is a person. The
    detector gives boxes of shape (k, 4) in an image [pixels], the highest score first: its windows
    without the margin around the person that it was trained with. Raises TrackerError where the
    installed OpenCV has no HOG detector.
    """
    if not hasattr(cv2, "HOGDescriptor"):
        raise TrackerError(
            f"the installed OpenCV {cv2.__version__} has no HOG detector; install "
            "opencv-contrib-python-headless in place of opencv-python-headless."
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
