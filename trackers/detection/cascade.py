"""Detector with a trained cascade of boosted classifiers (Viola & Jones 2001)."""

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.trackers.base.interface import Image
from trackmark.trackers.base.parameters import TrackerError


def cascade(file: str | Path, neighbours: int = 3) -> Callable[[Image], NDArray[np.float64]]:
    """Return a detector that uses a trained cascade, for example of frontal faces.

    Parameters
    ----------
    file : str or Path
        XML file of the cascade; OpenCV's sources include some.
    neighbours : int
        Minimum number of overlapping hits per detection.

    Returns
    -------
    callable
        Function from a BGR image to boxes, float64 (k, 4) [pixels], the largest first.

    Raises
    ------
    TrackerError
        If the installed OpenCV does not support cascades, or the file is not a cascade.
    """
    if not Path(file).is_file():
        raise TrackerError(f"{file}: this cascade file does not exist.")
    if not hasattr(cv2, "CascadeClassifier"):
        raise TrackerError(
            f"the installed OpenCV {cv2.__version__} has no cascade classifier; run "
            "`pip install --force-reinstall --no-deps opencv-contrib-python-headless`."
        )
    try:
        classifier = cv2.CascadeClassifier(str(file))
        unusable = classifier.empty()
    except (cv2.error, SystemError):  # OpenCV's constructors raise SystemError in Python
        unusable = True
    if unusable:
        raise TrackerError(
            f"{file}: OpenCV cannot read this file as a cascade. Expected: an XML file of a "
            "trained cascade."
        )

    def detect(image: Image) -> NDArray[np.float64]:
        grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
        boxes = np.reshape(classifier.detectMultiScale(grey, minNeighbors=neighbours), (-1, 4))
        order = np.argsort(-boxes[:, 2] * boxes[:, 3], kind="stable")
        return boxes.astype(np.float64)[order]

    return detect
