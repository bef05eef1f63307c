"""`moreno2005/book`: bending, self-shadow and colour of the light."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tests.datasets.synthetic.scenes import SEEDS, scenes_of, unless_sealed
from trackmark.datasets.synthetic.moreno2005.book import (
    Bending,
    BookSetting,
    bend_sheet,
    lit_share,
    self_shadow,
)
from trackmark.datasets.synthetic.render.triangles import grid_triangles

pytestmark = unless_sealed("moreno2005/book")

FRAMES = 100
opened, image = scenes_of("moreno2005/book")


def flat_places(half_width=40.0, height=100.0, rows=26, columns=21):
    u, v = np.meshgrid(np.linspace(-half_width, half_width, columns), np.linspace(-height, 0, rows))
    return u.ravel(), v.ravel()


@settings(max_examples=4, deadline=None)
@given(seed=SEEDS)
def test_book_is_flat_at_first_then_bends(seed):
    setting = BookSetting(seed)
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
    "bending",
    [Bending(-1.2, 0.3, 0.0), Bending(0.2, -1.25, -0.6), Bending(-1.0, -1.0, -0.4)],
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
    scene = opened(0)
    flagged = scene.truth().attributes["self-shadow"]
    assert 15 < flagged.sum() < 85
    frames = range(0, FRAMES, 4)
    levels = np.array([image(0, frame)[scene.mask(frame)].mean() for frame in frames])
    assert levels[flagged[::4]].mean() < 0.75 * levels[~flagged[::4]].mean()
    for frame in frames:
        share = self_shadow(scene.setting.surface(frame), scene.setting.lamp)
        assert flagged[frame] == (share >= 0.25)


def test_book_light_turns_smoothly_yellow():
    corner = [image(0, frame)[:60, :80].mean(axis=(0, 1)) for frame in range(0, FRAMES, 33)]
    blue, green, red = np.array(corner).T
    assert (np.diff(blue / red) < 0.01).all()
    assert blue[-1] / blue[0] < 0.65
    assert 0.85 < green[-1] / green[0] < 1
    assert red[-1] / red[0] > 1.02
    gains = opened(0).setting.illuminants
    assert np.abs(np.diff(gains, axis=0)).max() < 0.02
    assert gains[0] == pytest.approx([1.12, 1.0, 0.90])
