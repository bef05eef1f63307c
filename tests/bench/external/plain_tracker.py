"""Tracker for other interpreters, whose modes are failures of trackers; needs NumPy only."""

import os
import signal
import sys
import time
from pathlib import Path

import numpy as np


class Drift:
    """Move the box by the mean of the image and by a random step."""

    name = property(lambda self: "not the tracker's name")

    def __init__(self, step=0.5, mode="calm", most=np.inf, options=(), seed=0):
        self.step, self.mode = step, mode
        self.random = np.random.RandomState(seed)
        self.frames = 0
        if mode == "slow start":
            hang()

    def init(self, image, box, mask=None):
        assert image.dtype == np.uint8
        self.box = np.array(box)
        self.first = image
        self.mean = image.mean()

    def update(self, image):
        self.frames += 1
        assert self.first.mean() == self.mean  # images that a tracker keeps do not change
        self.box = self.box + [self.step * self.random.rand(), image.mean() / 1000, 0, 0]
        if self.frames == 3:
            self.misbehave()
        if self.mode == "nan" and self.frames == 3:
            return [np.nan, 1, 2, 3]
        if self.mode == "rich":
            return self.rich_estimate(image)
        return self.box, 0.25

    def rich_estimate(self, image):
        mask = np.zeros(image.shape[:2], bool)
        mask[3:9, 5:12] = True
        return {
            "box": self.box,
            "confidence": np.float32(0.5),
            "visible": np.bool_(False),
            "mask": mask,
            "details": {"frames": np.float32(self.frames)},
        }

    def misbehave(self):
        sys.stdout.write("last words\n")
        if self.mode == "raise":
            raise ValueError("broken")
        if self.mode == "signal":
            os.kill(os.getpid(), signal.SIGSEGV)
        if self.mode == "hang":
            hang()
        if self.mode == "flood":
            sys.stdout.write("x" * 10_000_000)
            sys.stderr.write("y" * 10_000_000)


def hang():
    sys.stderr.write("waiting\n")
    Path(os.environ["HANGS"]).touch()
    time.sleep(9999)
