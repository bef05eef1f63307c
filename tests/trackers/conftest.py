"""Fixture that creates clips of a moving target."""

from dataclasses import dataclass

import numpy as np
import pytest


@dataclass(frozen=True)
class Clip:
    """Images of a textured target that moves over textured ground, and its boxes."""

    images: list
    boxes: np.ndarray


def moving_target(
    n_frames=8,
    height=90,
    width=120,
    size=(20, 30),
    start=(30, 25),
    velocity=(2, 1),
    *,
    seed=0,
    grey=False,
):
    rng = np.random.default_rng(seed)
    ground = rng.integers(60, 120, (height, width, 3), dtype=np.uint8)
    target = rng.integers(0, 256, (size[1], size[0], 3), dtype=np.uint8)
    target[..., 2] |= 0xC0  # reddish
    images, boxes = [], []
    for frame in range(n_frames):
        left, top = (round(s + frame * v) for s, v in zip(start, velocity, strict=True))
        image = ground.copy()
        first_row, first_column = max(top, 0), max(left, 0)
        seen = image[first_row : max(top + size[1], 0), first_column : max(left + size[0], 0)]
        seen[:] = target[first_row - top :, first_column - left :][: len(seen), : seen.shape[1]]
        if grey:
            image[:] = image.mean(axis=2, keepdims=True).astype(np.uint8)
        image.flags.writeable = False
        images.append(image)
        boxes.append((left, top, *size))
    return Clip(images, np.array(boxes, dtype=np.float64))


@pytest.fixture(name="moving_target", scope="session")
def _moving_target():
    """Return the function that creates a `Clip`."""
    return moving_target
