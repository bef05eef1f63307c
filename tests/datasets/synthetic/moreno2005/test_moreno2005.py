"""Scenes of `moreno2005`: book, ellipse and octopus."""

import cv2
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from shapely import affinity
from shapely.geometry import Point, Polygon

from tests.datasets.synthetic.scenes import grown, scenes_of, slow_if_unchanged
from trackmark.datasets.synthetic.moreno2005.book import (
    Bending,
    bend_sheet,
    lit_share,
    self_shadow,
)
from trackmark.datasets.synthetic.render.triangles import grid_triangles

pytestmark = slow_if_unchanged("moreno2005/book", "moreno2005/ellipse", "moreno2005/octopus")


FRAMES = 100
open_book, book_image = scenes_of("moreno2005/book")


def flat_places(half_width=40.0, height=100.0, rows=26, columns=21):
    u, v = np.meshgrid(np.linspace(-half_width, half_width, columns), np.linspace(-height, 0, rows))
    return u.ravel(), v.ravel()


@given(left=st.floats(-1.3, 1.6), right=st.floats(-1.3, 1.6), slant=st.floats(-0.8, 0.8))
@example(left=1.5, right=-1.0, slant=-0.75)  # bends of opposite sign
@example(left=-1.3, right=1.6, slant=0.8)
@settings(max_examples=20, deadline=None)
def test_bent_sheet_keeps_lengths_and_perpendicular_normals(left, right, slant):
    u, v = flat_places()
    # Where the bend changes, the mean of the normals at both ends of an edge is off by up to an
    # eighth of the change of the bend over the edge.
    change = max(abs(right - left), abs(left), abs(right)) / 40.0
    points, normals, _ = bend_sheet(Bending(left, right, slant), 40.0, u, v)
    flat = np.stack([u, v, 0 * u], axis=1)
    for corners in (
        np.moveaxis(grid_triangles(26, 21), 1, 0)[[0, 1]],
        np.moveaxis(grid_triangles(26, 21), 1, 0)[[1, 2]],
    ):
        lengths = [np.linalg.norm(p[corners[0]] - p[corners[1]], axis=1) for p in (points, flat)]
        assert lengths[0] == pytest.approx(lengths[1], rel=0.01)
        middle = normals[corners].mean(axis=0)
        across = ((points[corners[0]] - points[corners[1]]) * middle).sum(axis=1)
        assert (np.abs(across) < 0.05 + lengths[1] ** 2 * change / 8).all()
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1)
    assert points[(u == 0) & (v == 0)] == pytest.approx(np.zeros((1, 3)), abs=0.05)


def blocked_slowly(points, triangles, start, towards):
    """Return whether a ray hits a triangle more than a pixel away (Möller and Trumbore)."""
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    cross = np.cross(towards, c - a)
    area = ((b - a) * cross).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        first = ((start - a) * cross).sum(axis=1) / area
        other = np.cross(start - a, b - a)
        second = other @ towards / area
        far = (other * (c - a)).sum(axis=1) / area
        return bool(((first >= 0) & (second >= 0) & (first + second <= 1) & (far > 1)).any())


@pytest.mark.parametrize(
    "bending", [Bending(-1.2, 0.3, 0.0), Bending(0.2, -1.25, -0.6), Bending(-1.0, -1.0, -0.4)]
)
def test_lit_share_agrees_with_ray_triangle_intersection(bending):
    random = np.random.default_rng(1)
    lamp = np.array(
        [[-0.85, -0.35, 0.4], [0.85, -0.3, 0.42], [0.5, -0.82, 0.28], [-0.4, 0.86, 0.3]]
    )
    u, v = flat_places(rows=61, columns=61)
    points, normals, section = bend_sheet(bending, 40.0, u, v)
    chosen = random.choice(len(u), 60, replace=False)
    agree, blocked = [], []
    for towards in lamp:
        left = lit_share(section, bending, (40.0, 100.0), u[chosen], v[chosen], towards[None])
        for place, share in zip(chosen, left, strict=True):
            if normals[place] @ towards > 0.05:
                slow = blocked_slowly(points, grid_triangles(61, 61), points[place], towards)
                agree.append(slow == (share == 0))
                blocked.append(slow)
    assert 0.05 < np.mean(blocked) < 0.9
    assert np.mean(agree) > 0.97  # except at borders of the shadow


def test_self_shadow_attribute_marks_darker_frames():
    scene = open_book(0)
    flagged = scene.truth().attributes["self-shadow"]
    assert 15 < flagged.sum() < 85
    frames = range(0, FRAMES, 4)
    levels = np.array([book_image(0, frame)[scene.mask(frame)].mean() for frame in frames])
    assert levels[flagged[::4]].mean() < 0.75 * levels[~flagged[::4]].mean()
    for frame in frames:
        share = self_shadow(scene.setting.surface(frame), scene.setting.lamp)
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


@pytest.mark.parametrize("seed", [0, 2])  # scene 1 is never camouflaged
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
