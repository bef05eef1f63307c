"""Masks, boxes and visibility, compared with images in which the target is repainted.

Variants of a scene that differ in one property have otherwise equal ground truth.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.datasets.synthetic.scenes import grown, mask_edges, slow_if_unchanged
from trackmark import datasets
from trackmark.datasets.synthetic.nummiaro2003.driving.view import SHADOW
from trackmark.datasets.synthetic.render.figure.body import ROWS
from trackmark.datasets.synthetic.wang2010.hand import BLUE, MATERIAL, SKIN


@cache
def opened(name):
    sequence = datasets.load(name)
    return sequence, sequence.frames


def repaint(array, values):
    """Change an array in place, and return a function that restores it."""
    before = array.copy()
    array[:] = values
    return lambda: array.__setitem__(slice(None), before)


def repaint_film_target(scene, frame):
    """Repaint the target green where it is opaque."""
    parts = [(look[..., :3], look[..., 3:]) for look in scene._target._textures]
    undo = [repaint(part, np.round(alpha / 255 * (40, 250, 40))) for part, alpha in parts]
    return lambda: [restore() for restore in undo]


def blacken_ball(scene, frame):
    usual = scene._ball
    scene._ball = usual.silhouette(0)
    return lambda: setattr(scene, "_ball", usual)


def repaint_palm(scene, frame):
    cones = scene.hand.cones.copy()
    cones[cones[..., MATERIAL] == SKIN, BLUE : BLUE + 3] = (220, 60, 20)
    return repaint(scene.hand.cones, cones)


def repaint_cup(scene, frame):
    usual, (first, *others) = scene.carried, scene._held
    glaze = replace(first.finish, colour=(40.0, 150.0, 230.0))
    scene._held = [replace(first, finish=glaze), *others]
    del scene.carried
    return lambda: vars(scene).update(_held=[first, *others], carried=usual)


def repaint_clothes(scene, frame):
    return repaint(scene.plan.walkers[0]._textures, (40, 250, 40))


def repaint_car(scene, frame):
    pictures = scene.plan.cars[0][0].pictures
    return repaint(pictures.pixels[: pictures.starts[SHADOW, 0]], 0xF014F0)


def repaint_ellipse(scene, frame):
    return repaint(scene.plan.colour[frame], (scene.plan.colour[frame] + 0.5) % 1)


def invert(find_array, total=1):
    """Return a function that inverts an array of a scene."""
    return lambda scene, frame: repaint(find_array(scene), total - find_array(scene))


# Sequence, frame, repainting, least change [grey levels], least share of changed pixels in the
# mask, and reach of blur outside the mask [pixels].
PAINTED = [
    ("moreno2005/ellipse", 33, repaint_ellipse, 40, 0.93, 1),
    ("moreno2005/octopus", 45, invert(lambda scene: scene._skin._textures, 1.5), 30, 0.95, 1),
    ("moreno2005/book", 47, invert(lambda scene: scene._mesh.texture), 15, 0.9, 2),
    ("moreno2005/leaf", 47, invert(lambda scene: scene._blade.mesh.texture), 15, 0.97, 2),
    ("nguyen2002/clip-01", 36, repaint_film_target, 16, 0.9, 4),
    ("nguyen2002/clip-20", 100, repaint_film_target, 16, 0.9, 4),
    ("wang2010/table-tennis:scene=2", 4, blacken_ball, 20, 0.95, 1),
    ("wang2010/table-tennis:scene=2", 11, blacken_ball, 20, 0.95, 3),
    ("wang2010/hand:scene=2", 41, repaint_palm, 25, 0.97, 1),
    ("wang2010/cup", 35, repaint_cup, 30, 0.85, 1),
    ("multipart/5", 100, repaint_clothes, 25, 0.93, 4),
    ("multipart/8", 60, repaint_clothes, 25, 0.93, 4),
    ("stress/twin", 20, repaint_clothes, 25, 0.93, 4),
    ("nummiaro2003/students", 60, repaint_clothes, 25, 0.93, 4),
    ("nummiaro2003/car", 220, repaint_car, 25, 0.97, 3),
    ("nummiaro2003/traffic:scene=1", 180, repaint_car, 25, 0.97, 3),
    ("nummiaro2003/head", 30, invert(lambda scene: scene.worker._atlas[:ROWS], 255), 12, 0.9, 2),
]


@pytest.mark.parametrize(
    ("name", "frame", "paint", "least", "share", "beyond"),
    [
        pytest.param(*row, id=row[0], marks=slow_if_unchanged(row[0].partition(":")[0]))
        for row in PAINTED
    ],
)
def test_mask_marks_the_pixels_of_the_target_paint(name, frame, paint, least, share, beyond):
    _, scene = opened(name)
    before, mask = scene.render(frame).astype(int), scene.mask(frame)
    restore = paint(scene, frame)
    try:
        changed = np.abs(scene.render(frame) - before).max(axis=2) > least
    finally:
        restore()
    assert mask.any()
    assert changed[mask].mean() > share
    assert not changed[~grown(mask, beyond)].any()
    assert (scene.render(frame) == before).all()


TIGHT = [
    ("moreno2005/ellipse", 1.5),
    ("moreno2005/octopus", 1.5),
    ("nummiaro2003/car", 2.0),
    ("moreno2005/book", 1.5),
    ("moreno2005/leaf", 2.6),  # the stalk is thin
    ("nguyen2002/lights", 2.2),  # as tight as a tilt allows
    ("wang2010/hand", 1.25),
    ("wang2010/hand:scene=11", 1.25),
    ("wang2010/table-tennis", 1.5),
    ("nummiaro2003/head", 2.5),
]


@pytest.mark.parametrize(
    ("name", "pixels"),
    [pytest.param(*row, marks=slow_if_unchanged(row[0].partition(":")[0])) for row in TIGHT],
)
def test_boxes_are_tight_around_masks(name, pixels):
    sequence, _ = opened(name)
    clear = np.flatnonzero(sequence.visibility > 0.94)
    for frame in clear[:: len(clear) // 9]:
        x, y, width, height = sequence.boxes[frame]
        edges = mask_edges(sequence.mask(frame))
        assert edges == pytest.approx([x, y, x + width, y + height], abs=pixels)


@pytest.mark.parametrize(
    "name", [pytest.param("wang2010/cup", marks=slow_if_unchanged("wang2010/cup"))]
)
def test_box_of_partly_hidden_cup_is_tight(name):
    """The hand covers a part of the cup in all frames."""
    sequence, cup = opened(name)
    for frame in range(0, 80, 9):
        x, y, width, height = sequence.boxes[frame]
        whole = cup.seen(frame)[0] >= 0.5
        edges = mask_edges(whole[:, ::-1] if cup.plan.mirrored else whole)
        assert edges == pytest.approx([x, y, x + width, y + height], abs=1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "options", "affected"),
    [("stress/twin", "light=dappled", "")]
    + [
        pytest.param(
            "multipart/8", "light=dappled", "shade", marks=slow_if_unchanged("multipart/8")
        )
    ],
)
def test_light_parameter_changes_only_the_shade_attribute(name, options, affected):
    plain, variant = (opened(text)[0] for text in (name, f"{name}:{options}"))
    assert np.array_equal(plain.boxes, variant.boxes, equal_nan=True)
    assert (plain.visibility == variant.visibility).all()
    assert (plain.mask(60) == variant.mask(60)).all()
    for key, flags in plain.attributes.items():
        assert np.array_equal(flags, variant.attributes[key]) == (key != affected)
    assert plain.fingerprint != variant.fingerprint
