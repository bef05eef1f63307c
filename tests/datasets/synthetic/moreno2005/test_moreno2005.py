"""Scenes of `moreno2005`: book, ellipse and octopus."""

import cv2
import numpy as np
import pytest
from shapely import affinity
from shapely.geometry import Point, Polygon

from tests.datasets.synthetic.scenes import grown, scenes_of, slow_if_unchanged
from trackmark.datasets.synthetic.moreno2005.book import self_shadow

pytestmark = slow_if_unchanged("moreno2005/book", "moreno2005/ellipse", "moreno2005/octopus")


FRAMES = 100
open_book, book_image = scenes_of("moreno2005/book")


def test_self_shadow_attribute_marks_darker_frames():
    scene = open_book(0)
    flagged = scene.truth().attributes["self-shadow"]
    assert 15 < flagged.sum() < 85
    frames = range(0, FRAMES, 4)
    levels = np.array([book_image(0, frame)[scene.mask(frame)].mean() for frame in frames])
    assert levels[flagged[::4]].mean() < 0.75 * levels[~flagged[::4]].mean()
    for frame in frames:
        share = self_shadow(scene.surface(frame), scene.lamp)
        assert flagged[frame] == (share >= 0.25)


open_ellipse, _ = scenes_of("moreno2005/ellipse")


def region(plan, frame, samples=720):
    """Return the ellipse as a Shapely polygon."""
    circle = Point(0, 0).buffer(1, quad_segs=samples // 4)
    oval = affinity.scale(circle, *plan.half_axes[frame], origin=(0, 0))
    turned = affinity.rotate(oval, plan.angle[frame], origin=(0, 0), use_radians=True)
    return affinity.translate(turned, *plan.centre[frame])


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_similar_patch_touches_the_ellipse_in_marked_frames(seed):
    scene = open_ellipse(seed)
    similar = scene.truth().attributes["similar patch"]
    assert 0.03 < similar.mean() < 0.5
    for frame in np.flatnonzero(similar).tolist():
        colour = scene.plan.colour[frame]
        alike = [patch for patch in scene.patches if np.linalg.norm(patch.colour - colour) <= 0.15]
        seen = scene._backdrop[..., ::-1] / 255
        mask = scene.mask(frame)
        ring = (grown(mask, 1)) & ~mask
        gap = np.linalg.norm(seen[ring] - colour, axis=1)
        assert alike
        assert (gap < 0.45).sum() >= 6  # shadows and texture change the painted colour
        rims = [region_of(patch).distance(region(scene.plan, frame)) for patch in alike]
        assert min(rims) < 1.5


def region_of(patch):
    return Polygon(patch.outline).buffer(0)


def test_unmarked_frames_have_no_adjacent_similar_patch():
    scene = open_ellipse(1)
    similar = scene.truth().attributes["similar patch"]
    for frame in np.flatnonzero(~similar).tolist():
        whole = region(scene.plan, frame)
        for number, patch in enumerate(scene.patches):
            if np.linalg.norm(patch.colour - scene.plan.colour[frame]) > 0.15:
                continue
            left = region_of(patch)
            for later in scene.patches[number + 1 :]:
                left = left.difference(region_of(later))
            beside = left.intersection(whole.buffer(1)).difference(whole)
            assert beside.area < 20


open_octopus, octopus_image = scenes_of("moreno2005/octopus")


def ring_around(mask, near=4, far=16):
    """Return the pixels around a mask at distances from `near` to `far`."""
    inner, outer = (
        cv2.dilate(
            mask.astype(np.uint8),
            cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1,) * 2),
        )
        > 0
        for reach in (near, far)
    )
    return outer & ~inner


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_camouflaged_octopus_resembles_its_surroundings(seed):
    scene = open_octopus(seed)
    flags = scene.truth().attributes["camouflaged"]
    colours, textures = np.empty(FRAMES), np.empty(FRAMES)
    for frame in range(0, FRAMES, 4):
        seen, mask = octopus_image(seed, frame) / 255, scene.mask(frame)
        ring = ring_around(mask)
        colours[frame] = np.linalg.norm(seen[mask].mean(axis=0) - seen[ring].mean(axis=0))
        shares = [
            cv2.calcHist(
                [seen.astype(np.float32)], [0, 1, 2], area.astype(np.uint8), [6] * 3, [0, 1] * 3
            ).ravel()
            / area.sum()
            for area in (mask, ring)
        ]
        textures[frame] = np.sqrt(shares[0] * shares[1]).sum()
    sampled = np.arange(FRAMES) % 4 == 0
    start = sampled & (np.arange(FRAMES) < 8)
    assert colours[sampled & flags].mean() < 0.12
    assert colours[sampled & flags].mean() < 0.6 * colours[start].mean()
    assert textures[sampled & flags].mean() > 1.2 * textures[start].mean()
    assert textures[sampled & flags].mean() > 0.55
