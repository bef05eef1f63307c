"""Trackers that walk at random and misbehave on request."""

import numpy as np

from trackmark.trackers import Estimate


class Walker:
    """Tracker that takes a random step per frame and records the sums of its images."""

    def __init__(self, seed):
        self.random = np.random.default_rng(seed)
        self.shown = []

    def init(self, image, box, mask=None):
        self.box = box.copy()
        self.shown.append(int(image.sum()))

    def update(self, image):
        self.shown.append(int(image.sum()))
        self.box = self.box + [*self.random.normal(size=2), 0, 0]
        return Estimate(self.box, details={"brightness": image.mean()})


def misbehaving(act, call_number=3):
    """Return a tracker class that calls `act` in its update number `call_number`."""

    class Misbehaving(Walker):
        def __init__(self, seed):
            super().__init__(seed)
            self.calls = 0

        def update(self, image):
            self.calls += 1
            return act(image, self) if self.calls == call_number else super().update(image)

    return Misbehaving
