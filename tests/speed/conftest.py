"""Fixture that limits OpenCV to one thread, as the trackers that it is compared with."""

import cv2
import pytest


@pytest.fixture(scope="module", autouse=True)
def one_thread():
    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    yield
    cv2.setNumThreads(before)
