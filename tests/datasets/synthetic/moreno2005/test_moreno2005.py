"""Scenes of `moreno2005`: book, ellipse, leaf and octopus."""

import cv2
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from shapely import affinity
from shapely.geometry import Point, Polygon

from tests.datasets.synthetic.scenes import SEEDS, grown, scenes_of, slow_if_unchanged
from trackmark.datasets.synthetic.moreno2005.book import (
    Bending,
    BookScene,
    bend_sheet,
    lit_share,
    self_shadow,
)
from trackmark.datasets.synthetic.moreno2005.ellipse import HALF_AXES
from trackmark.datasets.synthetic.moreno2005.ellipse import sample_plan as sample_ellipse_plan
from trackmark.datasets.synthetic.moreno2005.leaf import sample_shapes
from trackmark.datasets.synthetic.moreno2005.octopus import FLOOR_KINDS, OWN, SKINS
from trackmark.datasets.synthetic.moreno2005.octopus import sample_plan as sample_octopus_plan
from trackmark.datasets.synthetic.parameters import SceneParameters
from trackmark.datasets.synthetic.render.triangles import grid_triangles

pytestmark = slow_if_unchanged(
    "moreno2005/book", "moreno2005/ellipse", "moreno2005/leaf", "moreno2005/octopus"
)


FRAMES = 100
open_book, book_image = scenes_of("moreno2005/book")


def flat_places(half_width=40.0, height=100.0, rows=26, columns=21):
    u, v = np.meshgrid(np.linspace(-half_width, half_width, columns), np.linspace(-height, 0, rows))
    return u.ravel(), v.ravel()


@settings(max_examples=4, deadline=None)
@given(seed=SEEDS)
def test_book_is_flat_at_first_then_bends(seed):
    setting = BookScene(SceneParameters(scene=seed))
    surfaces = map(setting.surface, range(0, FRAMES, 3))
    shadow = [self_shadow(surface, setting.lamp) for surface in surfaces]
    assert shadow[0] < 0.25
    assert max(shadow) > 0.4
    ends = np.array([[bending.left, bending.right] for bending in setting.plan.bendings])
    assert np.abs(ends[:5]).max() < 0.3
    assert np.abs(ends).max() > 0.5
    assert np.abs(np.diff(ends, axis=0)).max() < 0.9


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
        share = self_shadow(scene.surface(frame), scene.lamp)
        assert flagged[frame] == (share >= 0.25)


def test_book_light_turns_smoothly_yellow():
    corner = [book_image(0, frame)[:60, :80].mean(axis=(0, 1)) for frame in range(0, FRAMES, 33)]
    blue, green, red = np.array(corner).T
    assert (np.diff(blue / red) < 0.01).all()
    assert blue[-1] / blue[0] < 0.65
    assert 0.85 < green[-1] / green[0] < 1
    assert red[-1] / red[0] > 1.02
    gains = open_book(0).illuminants
    assert np.abs(np.diff(gains, axis=0)).max() < 0.02
    assert gains[0] == pytest.approx([1.12, 1.0, 0.90])


open_ellipse, _ = scenes_of("moreno2005/ellipse")


def region(plan, frame, samples=720):
    """Return the ellipse as a Shapely polygon."""
    circle = Point(0, 0).buffer(1, quad_segs=samples // 4)
    oval = affinity.scale(circle, *plan.half_axes[frame], origin=(0, 0))
    turned = affinity.rotate(oval, plan.angle[frame], origin=(0, 0), use_radians=True)
    return affinity.translate(turned, *plan.centre[frame])


@settings(max_examples=12, deadline=None)
@given(seed=SEEDS)
def test_ellipse_shape_and_colour_change_smoothly(seed):
    plan = sample_ellipse_plan(seed)
    assert HALF_AXES[0] - 0.1 < plan.half_axes.min() < plan.half_axes.max() < HALF_AXES[1] + 0.1
    assert np.abs(np.diff(np.log(plan.half_axes), axis=0)).max() < 0.13
    assert (np.ptp(plan.half_axes, axis=0) > 0.5).all()
    assert np.abs(np.diff(plan.angle)).max() < 0.21
    assert np.ptp(plan.angle) > 0.1
    assert 0.08 <= plan.colour.min() < plan.colour.max() <= 0.92
    assert np.linalg.norm(np.ptp(plan.colour, axis=0)) > 0.25


def test_ellipse_shape_steps_are_small_and_independent():
    steps = []
    for seed in range(20):
        plan = sample_ellipse_plan(seed)
        shape = np.column_stack([np.log(plan.half_axes), plan.angle])
        steps.append(np.diff(shape, axis=0))
    new = np.stack(steps)
    assert np.abs(new.std(axis=(0, 1)) - 0.03).max() < 0.002
    assert abs((new[:, 1:] * new[:, :-1]).mean() / new.var()) < 0.06


def test_ellipse_colour_follows_a_curved_path_at_even_speed():
    lengths, straight, missed = [], [], []
    for seed in range(20):
        colour = sample_ellipse_plan(seed).colour
        steps = np.diff(colour, axis=0)
        lengths.append(np.linalg.norm(steps, axis=1))
        straight.append(np.linalg.norm(colour[20:] - colour[:-20], axis=1).mean())
        # Deviation from a straight path after ten frames.
        foreseen = colour[1:-10] + 10 * steps[:-10]
        missed.append(np.linalg.norm(colour[11:] - foreseen, axis=1).mean())
    assert np.mean(lengths) == pytest.approx(0.05, abs=0.003)
    assert np.max(lengths) < 0.08
    assert np.mean(straight) < 0.5 * 20 * np.mean(lengths)
    assert np.mean(missed) > 0.5 * 10 * np.mean(lengths)


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


open_leaf, leaf_image = scenes_of("moreno2005/leaf")


def middles(seed):
    shapes = sample_shapes(np.random.default_rng(seed))
    return np.stack([shape.place for shape in shapes])


@settings(max_examples=6, deadline=None)
@given(seed=SEEDS)
def test_leaf_moves_fastest_at_the_light_change(seed):
    steps = np.hypot(*np.diff(middles(seed), axis=0).T)
    assert 14 < steps[0] < 19.6
    assert steps[1:].max() < 15.1
    assert (steps > 7).sum() >= 4
    assert 2.5 < steps.mean() < 7


@pytest.mark.parametrize("seed", range(3))
def test_leaf_motion_is_hard_to_predict(seed):
    """Check that predictions from the last one or two speeds often have large errors."""
    way = middles(seed)
    second, third = (np.diff(way, order, axis=0) for order in (2, 3))
    for error in (second, third):
        assert np.percentile(np.hypot(*error.T), 95) > 7
    ahead = np.diff(way, axis=0)
    turn = (ahead[1:] * ahead[:-1]).sum(axis=1)
    assert 0.02 < (turn < 0).mean() < 0.5


@pytest.mark.parametrize("seed", range(2))
def test_leaf_outline_is_nearly_affine_with_small_bends(seed):
    setting = open_leaf(seed)
    first = np.column_stack([setting.points(0)[0][:, :2], np.ones(len(setting.points(0)[0]))])
    gains, left = [], []
    for frame in range(0, FRAMES, 7):
        points = setting.points(frame)[0][:, :2]
        affine = np.linalg.lstsq(first, points, rcond=None)[0]
        gains.append(np.linalg.svd(affine[:2])[1])
        left.append(np.sqrt(((first @ affine - points) ** 2).sum(axis=1).mean()))
    longest, shortest = np.array(gains).T
    assert np.ptp(shortest / longest) > 0.1
    assert 0.3 < max(left) < 6
    angles = np.array([shape.angle for shape in setting.shapes])
    assert np.ptp(angles) > 0.6
    assert np.abs(np.diff(angles)).max() > 0.12


@pytest.mark.parametrize("seed", range(2))
def test_small_share_of_foliage_has_the_leaf_colour(seed):
    shares = leaf_image(seed, 30) / leaf_image(seed, 30).sum(axis=2, keepdims=True)
    mask = open_leaf(seed).mask(30)
    low, high = np.percentile(shares[mask], [5, 95], axis=0)
    alike = ((shares > low) & (shares < high)).all(axis=2)
    assert 0.003 < alike[~grown(mask, 3)].mean() < 0.3
    assert alike[mask].mean() > 0.6


@pytest.mark.parametrize("seed", range(2))
def test_leaf_light_changes_once_and_by_channel(seed):
    means = [
        leaf_image(seed, frame)[open_leaf(seed).mask(frame)].mean(axis=0) for frame in (0, 1, 2)
    ]
    gains = means[1] / means[0]
    assert gains.max() < 0.9
    assert gains.max() / gains.min() > 1.5
    assert means[2] == pytest.approx(means[1], rel=0.15)


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


@settings(max_examples=8, deadline=None)
@given(seed=SEEDS)
def test_octopus_crawls_through_the_image(seed):
    plan = sample_octopus_plan(seed)
    steps = np.hypot(*np.diff(plan.place, axis=0).T)
    assert 0.3 < steps.min() < steps.max() < 4
    assert np.hypot(*(plan.place[-1] - plan.place[0])) > 130
    assert np.abs(np.diff(plan.boxes, axis=0)).max() < 6


@settings(max_examples=6, deadline=None)
@given(seed=SEEDS)
def test_octopus_outline_changes_are_nearly_affine(seed):
    plan = sample_octopus_plan(seed)
    left = []
    for frame in range(0, 90, 15):
        first, second = (plan.posture(k).balls[:, :2] for k in (frame, frame + 10))
        homogeneous = np.hstack([first, np.ones((len(first), 1))])
        affine, *_ = np.linalg.lstsq(homogeneous, second, rcond=None)
        left.append(np.linalg.norm(second - homogeneous @ affine, axis=1))
    rest = np.concatenate(left)
    assert 0.1 < np.sqrt((rest**2).mean()) < 1.5
    moved = plan.posture(40).balls[:, :2] - plan.posture(39).balls[:, :2]
    assert np.linalg.norm(moved, axis=1).max() < 7


@settings(max_examples=8, deadline=None)
@given(seed=SEEDS)
def test_octopus_starts_with_own_texture_and_changes_twice(seed):
    plan = sample_octopus_plan(seed)
    looks = [plan.texture_change(frame) for frame in range(FRAMES)]
    assert looks[0] == (OWN, 0, 0.0)
    worn = np.zeros((FRAMES, OWN + 1))
    for weights, (before, after, share) in zip(worn, looks, strict=True):
        weights[before] += 1 - share
        weights[after] += share
    assert np.abs(np.diff(worn, axis=0)).max() < 0.2  # gradual changes
    assert (worn[:, 0] > 0.99).sum() >= 3
    (first, second) = plan.changes
    assert 8 <= first[0] < first[1] < second[0]
    assert len({*plan.kinds}) == 4
    # It starts on one floor and ends on another.
    shares = plan.zones.shares(plan.place)
    assert shares.sum(axis=1) == pytest.approx(1)
    assert shares[:25, 0].mean() > 0.7
    assert shares[-25:, 1].mean() > 0.7


def test_octopus_is_camouflaged_a_third_of_the_time():
    plans = [sample_octopus_plan(seed) for seed in range(16)]
    assert {kind for plan in plans for kind in plan.kinds} == {*FLOOR_KINDS, *SKINS}
    camouflaged = [plan.camouflaged for plan in plans]
    assert 0.2 < np.mean(camouflaged) < 0.5
    assert np.mean([flags[:58].any() and flags[75:].any() for flags in camouflaged]) > 0.3


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
