"""Masks, boxes and visibility against pictures: what is drawn otherwise is where truth says.

Scenes with other knobs share all of the truth that doesn't tell of what they change.
"""

from contextlib import contextmanager
from functools import cache

import numpy as np
import pytest

import datasets
from tests.datasets.synthetic.scenes import grown


@cache
def opened(name):
    sequence = datasets.load(name)
    return sequence, sequence.frames


@contextmanager
def kept(array):
    """An array that is as it was afterwards."""
    before = array.copy()
    try:
        yield array
    finally:
        array[:] = before


@contextmanager
def other_ellipse(scene, frame):
    with kept(scene.plan.colour) as colour:
        colour[frame] = (colour[frame] + 0.5) % 1
        yield


@contextmanager
def other_skin(scene, frame):
    with kept(scene._skin._looks) as looks:
        looks[:] = 1.5 - looks
        yield


@contextmanager
def other_print(scene, frame):
    with kept(scene.setting._mesh.texture) as texture:
        texture[:] = 1 - texture
        yield


@contextmanager
def other_leaf(scene, frame):
    with kept(scene.setting._blade.mesh.texture) as texture:
        texture[:] = (0.9, 0.1, 0.8)
        yield


@contextmanager
def other_target(scene, frame):
    """A green one, where it is opaque."""
    first, second = scene._target._looks
    with kept(first), kept(second):
        for look in (first, second):
            look[..., :3] = np.round(look[..., 3:] / 255 * (40, 250, 40))
        yield


# Sequence, frame, what is drawn otherwise, least change that counts [grey levels], and for
# what the lens, the film's coarse colour and soft edges blur.
PAINTED = [
    ("moreno2005/ellipse:scene=3", 33, other_ellipse, 40, 0.93, 1),
    ("moreno2005/octopus", 45, other_skin, 30, 0.95, 1),
    ("moreno2005/book", 47, other_print, 15, 0.9, 2),
    ("moreno2005/leaf", 47, other_leaf, 15, 0.97, 2),
    ("nguyen2002/clip-01", 36, other_target, 16, 0.9, 4),
    ("nguyen2002/clip-20", 100, other_target, 16, 0.9, 4),
]


@pytest.mark.parametrize(
    ("name", "frame", "paint", "least", "share", "beyond"), PAINTED, ids=[p[0] for p in PAINTED]
)
def test_what_changes_with_the_targets_paint_is_the_mask(name, frame, paint, least, share, beyond):
    _, scene = opened(name)
    before, mask = scene.render(frame).astype(int), scene.mask(frame)
    with paint(scene, frame):
        changed = np.abs(scene.render(frame) - before).max(axis=2) > least
    assert mask.any()
    assert changed[mask].mean() > share
    assert not changed[~grown(mask, beyond)].any()
    assert (scene.render(frame) == before).all()


@pytest.mark.parametrize(
    ("name", "pixels"),
    [
        ("moreno2005/book", 1.5),
        ("moreno2005/book:scene=1", 1.5),
        ("moreno2005/leaf", 2.6),  # a thin stalk
        ("moreno2005/leaf:scene=1", 2.6),
        ("nguyen2002/lights", 2.2),  # as tight as a tilt allows
        ("nguyen2002/lights:scene=1", 2.2),
    ],
)
def test_a_box_is_as_tight_as_pixels_allow(name, pixels):
    sequence, _ = opened(name)
    clear = np.flatnonzero(sequence.visibility > 0.94)
    for frame in clear[:: len(clear) // 9]:
        rows, columns = np.nonzero(sequence.mask(frame))
        x, y, width, height = sequence.boxes[frame]
        found = [columns.min(), rows.min(), columns.max() + 1, rows.max() + 1]
        assert found == pytest.approx([x, y, x + width, y + height], abs=pixels)


@pytest.mark.parametrize(
    ("name", "options", "told"),
    [
        ("moreno2005/ellipse", "light=jump", "light change"),
        ("moreno2005/ellipse", "light=repeated", "light change"),
        ("moreno2005/ellipse", "light=shadow", "light change"),
        ("moreno2005/book", "shadow=none", "self-shadow"),
        ("moreno2005/book", "illuminant=constant", ""),
        ("moreno2005/leaf", "jump=middle", "light change"),
        ("moreno2005/leaf", "jump=none", "light change"),
        ("nguyen2002/lights", "lamps=coloured", ""),
    ],
)
def test_knobs_of_the_light_change_nothing_else_of_the_truth(name, options, told):
    one, other = (opened(text)[0] for text in (name, f"{name}:{options}"))
    assert (one.boxes == other.boxes).all()
    assert (one.visibility == other.visibility).all()
    assert (one.mask(60) == other.mask(60)).all()
    for key, flags in one.attributes.items():
        assert np.array_equal(flags, other.attributes[key]) == (key != told)
    assert one.fingerprint != other.fingerprint
