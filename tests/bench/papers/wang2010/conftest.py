"""Painted squares: what the maps say of them is known."""

from types import SimpleNamespace

import numpy as np
import pytest
from bench.papers.wang2010.silhouettes import silhouettes

from datasets import Sequence

SHAPE, SIDE = (120, 160), 20
GREY = (128, 128, 128)


def square(x, y=50, side=SIDE):
    """Pixels of a square whose left top corner is there."""
    mask = np.zeros(SHAPE, bool)
    mask[y : y + side, x : x + side] = True
    return mask


def painted(*things):
    """Things of the given colour on grey, each over those before it."""
    image = np.full((*SHAPE, 3), GREY, np.uint8)
    for mask, colour in things:
        image[mask] = colour
    return image


class Painted(list):
    """Images, and what moves in them."""

    things = ()


@silhouettes.register
def _(scene: Painted, frame):
    return [masks[frame] for masks in scene.things]


def sequence(images, masks, *others, name="painted", **more):
    """A sequence of which these are the target's masks, and those of other things."""
    first = np.argwhere(masks[0]).min(axis=0)[::-1]
    corners = [np.argwhere(mask).min(axis=0)[::-1] if mask.any() else first for mask in masks]
    boxes = np.array([[*corner, SIDE, SIDE] for corner in corners], float)
    scene = Painted(images)
    scene.things = (masks, *others)
    return Sequence(name, scene, boxes, fingerprint="p", masks=lambda frame: masks[frame], **more)


@pytest.fixture(scope="session")
def paint():
    """`square(x, y)`, `image(*things)`, and a `sequence(images, masks, *others)` of these."""
    return SimpleNamespace(square=square, image=painted, sequence=sequence)
