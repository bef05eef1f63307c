"""Masks, boxes and visibility, compared with images in which the target is repainted.

Variants that change one property share the rest of the ground truth.
"""

from contextlib import contextmanager
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.datasets.synthetic.scenes import grown, mask_edges, unless_sealed
from trackmark import datasets
from trackmark.datasets.synthetic.nummiaro2003.driving.shape import SHADOW
from trackmark.datasets.synthetic.render.figure.body import ROWS
from trackmark.datasets.synthetic.wang2010.hand.setting import BLUE, MATERIAL, SKIN


@cache
def opened(name):
    sequence = datasets.load(name)
    return sequence, sequence.frames


@contextmanager
def restored(array):
    """Yield an array and restore its content afterwards."""
    before = array.copy()
    try:
        yield array
    finally:
        array[:] = before


@contextmanager
def other_ellipse(scene, frame):
    with restored(scene.plan.colour) as colour:
        colour[frame] = (colour[frame] + 0.5) % 1
        yield


@contextmanager
def other_skin(scene, frame):
    with restored(scene._skin._looks) as looks:
        looks[:] = 1.5 - looks
        yield


@contextmanager
def other_print(scene, frame):
    with restored(scene.setting._mesh.texture) as texture:
        texture[:] = 1 - texture
        yield


@contextmanager
def other_leaf(scene, frame):
    with restored(scene.setting._blade.mesh.texture) as texture:
        texture[:] = (0.9, 0.1, 0.8)
        yield


@contextmanager
def other_target(scene, frame):
    """Repaint the target green where it is opaque."""
    first, second = scene._target._textures
    with restored(first), restored(second):
        for look in (first, second):
            look[..., :3] = np.round(look[..., 3:] / 255 * (40, 250, 40))
        yield


@contextmanager
def other_ball(scene, frame):
    usual = scene._ball
    scene._ball = usual.silhouette(0)
    yield
    scene._ball = usual


@contextmanager
def other_palm(scene, frame):
    with restored(scene.hand.cones) as painted:
        painted[painted[..., MATERIAL] == SKIN, BLUE : BLUE + 3] = (220, 60, 20)
        yield


@contextmanager
def other_glaze(scene, frame):
    setting = scene.setting
    usual, (first, *others) = setting.carried, setting._held
    glaze = replace(first.finish, colour=(40.0, 150.0, 230.0))
    setting._held = [replace(first, finish=glaze), *others]
    del setting.carried
    yield
    setting._held, setting.carried = [first, *others], usual


@contextmanager
def other_clothes(scene, frame):
    with restored(scene.plan.walkers[0]._textures) as textures:
        textures[:] = (40, 250, 40)
        yield


@contextmanager
def other_paint(scene, frame):
    pictures = scene.plan.cars[0][0].pictures
    with restored(pictures.pixels[: pictures.starts[SHADOW, 0]]) as pixels:
        pixels[:] = 0xF014F0
        yield


@contextmanager
def other_head(scene, frame):
    with restored(scene.worker._atlas[:ROWS]) as atlas:
        atlas[:] = 255 - atlas
        yield


# Sequence, frame, what is drawn otherwise, least change that counts [grey levels], and for
# what the lens, the film's coarse colour and soft edges blur.
PAINTED = [
    ("moreno2005/ellipse", 33, other_ellipse, 40, 0.93, 1),
    ("moreno2005/octopus", 45, other_skin, 30, 0.95, 1),
    ("moreno2005/book", 47, other_print, 15, 0.9, 2),
    ("moreno2005/leaf", 47, other_leaf, 15, 0.97, 2),
    ("nguyen2002/clip-01", 36, other_target, 16, 0.9, 4),
    ("nguyen2002/clip-20", 100, other_target, 16, 0.9, 4),
    ("wang2010/table-tennis:scene=2", 4, other_ball, 20, 0.95, 1),
    ("wang2010/table-tennis:scene=2", 11, other_ball, 20, 0.95, 3),
    ("wang2010/hand:scene=2", 41, other_palm, 25, 0.97, 1),
    ("wang2010/cup", 35, other_glaze, 30, 0.85, 1),
    ("multipart/5", 100, other_clothes, 25, 0.93, 4),
    ("multipart/8", 60, other_clothes, 25, 0.93, 4),
    ("stress/twin", 20, other_clothes, 25, 0.93, 4),
    ("nummiaro2003/students", 60, other_clothes, 25, 0.93, 4),
    ("nummiaro2003/car", 220, other_paint, 25, 0.97, 3),
    ("nummiaro2003/traffic:scene=1", 180, other_paint, 25, 0.97, 3),
    ("nummiaro2003/head", 30, other_head, 12, 0.9, 2),
]


@pytest.mark.parametrize(
    ("name", "frame", "paint", "least", "share", "beyond"),
    [
        pytest.param(*row, id=row[0], marks=unless_sealed(row[0].partition(":")[0]))
        for row in PAINTED
    ],
)
def test_mask_marks_the_pixels_of_the_target_paint(name, frame, paint, least, share, beyond):
    _, scene = opened(name)
    before, mask = scene.render(frame).astype(int), scene.mask(frame)
    with paint(scene, frame):
        changed = np.abs(scene.render(frame) - before).max(axis=2) > least
    assert mask.any()
    assert changed[mask].mean() > share
    assert not changed[~grown(mask, beyond)].any()
    assert (scene.render(frame) == before).all()


TIGHT = [
    ("moreno2005/ellipse", 1.5),
    ("moreno2005/octopus", 1.5),
    ("nummiaro2003/car", 2.0),
    ("moreno2005/book", 1.5),
    ("moreno2005/leaf", 2.6),  # a thin stalk
    ("nguyen2002/lights", 2.2),  # as tight as a tilt allows
    ("wang2010/hand", 1.25),
    ("wang2010/hand:scene=11", 1.25),
    ("wang2010/table-tennis", 1.5),
    ("nummiaro2003/head", 2.5),
]


@pytest.mark.parametrize(
    ("name", "pixels"),
    [pytest.param(*row, marks=unless_sealed(row[0].partition(":")[0])) for row in TIGHT],
)
def test_boxes_are_tight_around_masks(name, pixels):
    sequence, _ = opened(name)
    clear = np.flatnonzero(sequence.visibility > 0.94)
    for frame in clear[:: len(clear) // 9]:
        x, y, width, height = sequence.boxes[frame]
        edges = mask_edges(sequence.mask(frame))
        assert edges == pytest.approx([x, y, x + width, y + height], abs=pixels)


@pytest.mark.parametrize(
    ("name", "options", "affected"),
    [
        ("multipart/8", "light=dappled", "shade"),
        ("stress/twin", "light=dappled", ""),
    ],
)
def test_light_parameter_changes_only_shade(name, options, affected):
    plain, variant = (opened(text)[0] for text in (name, f"{name}:{options}"))
    assert np.array_equal(plain.boxes, variant.boxes, equal_nan=True)
    assert (plain.visibility == variant.visibility).all()
    assert (plain.mask(60) == variant.mask(60)).all()
    for key, flags in plain.attributes.items():
        assert np.array_equal(flags, variant.attributes[key]) == (key != affected)
    assert plain.fingerprint != variant.fingerprint


def test_dappled_light_darkens_the_ground_only():
    even, dappled = (
        datasets.load(f"multipart/8:light={light}")[100] for light in ("even", "dappled")
    )
    change = dappled.astype(int) - even
    assert (change[300:] < -10).mean() > 0.1
    assert (change > 3).mean() < 0.01
    assert (change[:150] == 0).mean() > 0.99
