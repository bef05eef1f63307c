"""Small sequences and trackers that misbehave, for the harness's tests."""

import numpy as np
import pytest

import datasets


class Noise:
    """Frames of reproducible noise, made when asked for."""

    def __init__(self, n, height=24, width=32):
        self.n, self.shape = n, (height, width, 3)
        self.asked = []

    def __len__(self):
        return self.n

    def __getitem__(self, frame):
        self.asked.append(frame)
        return np.random.default_rng(frame).integers(0, 256, self.shape, dtype=np.uint8)


def straight_line(n, absent=()):
    """Truth of a 8x6 target that moves one pixel a frame."""
    boxes = np.array([[2.0 + 0.5 * i, 3.0, 8.0, 6.0] for i in range(n)])
    boxes[list(absent)] = np.nan
    return boxes


@pytest.fixture
def make_sequence():
    def make(n=20, absent=(), name="line", **options):
        return datasets.Sequence(
            name, Noise(n), straight_line(n, absent), fingerprint=f"noise {n} {absent}", **options
        )

    return make
