"""Rasteriser of facets, compared with a slow definition of the visible facet per sample."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from trackmark.datasets.synthetic.nummiaro2003.driving.laying import (
    FULL,
    lay_behind,
    lay_facets,
    sprite_of,
)
from trackmark.datasets.synthetic.nummiaro2003.driving.shape import (
    Face,
    Lens,
    assemble_facets,
    blank_pictures,
    pack_pictures,
)
from trackmark.datasets.synthetic.nummiaro2003.driving.view import PerspectiveView, facet_pose

SIZE = 48, 40  # width and height
LENS = Lens(40.0, 24.0, 20.0)
VIEW = PerspectiveView(LENS.focal, (LENS.column, LENS.row), (0.0, 0.0, 0.0), 0.0, 0.0)
PLAIN = np.array([[[0.0, 0, 0, 0], [0, 0, 0, 0]]])


def laid(faces, projections=PLAIN, pictures=None, view=VIEW):
    """Return a canvas with some faces, given in world coordinates."""
    canvas = np.zeros((SIZE[1], SIZE[0], 3), np.uint8)
    occupied, shadow = np.zeros(canvas.shape[:2], np.uint16), np.zeros(canvas.shape[:2], np.uint8)
    facets = assemble_facets(faces, np.asarray(projections, float))
    images = blank_pictures(level=200.0) if pictures is None else pictures
    order = np.arange(len(faces))
    pose = facet_pose(view, facets)
    lay_facets(canvas, occupied, shadow, facets, images, blank_pictures(), LENS, pose, order)
    return canvas, occupied, shadow, pose.gains


def samples():
    """Return the places (x, y) of all samples in the image, (4 rows, 4 columns, 2)."""
    x, y = ((np.arange(4 * n) + 0.5) / 4 for n in SIZE)
    return np.stack(np.meshgrid(x, y), axis=-1)


def bits(occupied):
    """Return a flag per sample, (4 rows, 4 columns)."""
    spread = (occupied[..., None].astype(int) >> np.arange(16)) & 1
    return spread.reshape(*occupied.shape, 4, 4).transpose(0, 2, 1, 3).reshape(4 * SIZE[1], -1) == 1


def inside(corners):
    """Return the samples in a convex polygon of image corners, borders included."""
    flags = []
    for (x, y), (x_next, y_next) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        place = samples()
        flags.append((x_next - x) * (place[..., 1] - y) - (y_next - y) * (place[..., 0] - x))
    signs = np.array(flags)
    return (signs >= 0).all(axis=0) | (signs <= 0).all(axis=0)


def seen_at(points):
    """Return image corners, rounded like the kernel's, for points in front of the camera."""
    places = [(24 + 40 * x / z, 20 - 40 * y / z) for x, y, z in points]
    return np.floor(np.array(places) * 64 + 0.5) / 64


places = st.tuples(st.floats(-4, 4), st.floats(-4, 4))


@settings(max_examples=30)
@given(places=st.tuples(places, places, places), tilt=st.floats(-0.6, 0.6))
def test_triangle_occupies_the_covered_samples(places, tilt):
    points = np.array([[x, y, 5 + tilt * x] for x, y in places])
    if abs(np.cross(points[1] - points[0], points[2] - points[0])).max() < 0.1:
        return
    _, occupied, _, _ = laid([Face(points, np.array([0.0, 0.0, -1.0]), 0)])
    image = seen_at(points)
    if abs(np.cross(*np.append(np.diff(image, axis=0), np.zeros((2, 1)), axis=1))[2]) < 0.05:
        return  # less than the corners' rounding
    np.testing.assert_array_equal(bits(occupied), inside(image))


def test_back_faces_are_not_drawn():
    square = np.array([[-1, -1, 5], [1, -1, 5], [1, 1, 5], [-1, 1, 5]], float)
    assert laid([Face(square, np.array([0.0, 0.0, -1.0]), 0)])[1].any()
    assert not laid([Face(square, np.array([0.0, 0.0, 1.0]), 0)])[1].any()


def test_adjacent_facets_leave_no_gap_and_first_is_in_front():
    left = np.array([[-3, -3, 5], [0.37, -3, 5], [-0.2, 3, 5], [-3, 3, 5]], float)
    right = np.array([[0.37, -3, 5], [3, -3, 5], [3, 3, 5], [-0.2, 3, 5]], float)
    whole = np.array([[-3, -3, 5], [3, -3, 5], [3, 3, 5], [-3, 3, 5]], float)
    out = np.array([0.0, 0.0, -1.0])
    pair = laid([Face(left, out, 0), Face(right, out, 0)])
    single = laid([Face(whole, out, 0)])
    np.testing.assert_array_equal(pair[1], single[1])
    assert np.abs(pair[0].astype(int) - single[0]).max() <= 1
    two = pack_pictures([np.full((1, 1, 3), 30.0), np.full((1, 1, 3), 220.0)])
    near, far = whole * [0.5, 0.5, 1], whole * [2, 2, 1] + [0, 0, 3]
    ahead = laid([Face(near, out, 0), Face(far, out, 1)], np.repeat(PLAIN, 2, axis=0), two)
    assert ahead[0][20, 24, 0] < 40
    assert ahead[0][1, 1, 0] > 150


def test_facets_are_clipped_behind_the_camera():
    floor = np.array([[-50, -1, -50], [50, -1, -50], [50, -1, 500], [-50, -1, 500]], float)
    _, occupied, _, _ = laid([Face(floor, np.array([0.0, 1.0, 0.0]), 0)])
    assert (occupied[21:] == FULL).all()
    assert not occupied[:20].any()


@pytest.mark.parametrize("place", [(0.0, 0.0, 0.0), (2.0, -1.25, 7.5)])
@pytest.mark.parametrize("slant", [0.0, 0.5])
def test_facet_texture_agrees_with_ray_intersection(slant, place):
    """A slanted wall; its picture's blue is a gradient along x, its red along y."""
    side = 64
    rows, columns = np.indices((side, side))
    image = np.stack([columns * 3.0, np.full((side, side), 100.0), rows * 3.0], axis=-1)
    wall = np.array(
        [
            [-3, -3, 6 - 3 * slant],
            [3, -3, 6 + 3 * slant],
            [3, 3, 6 + 3 * slant],
            [-3, 3, 6 - 3 * slant],
        ]
    )
    x, y, _ = place
    projection = [[[8.0, 0, 0, 32 - 8 * x], [0, 8.0, 0, 32 - 8 * y]]]
    face = Face(wall + place, np.array([0.0, 0.0, -1.0]), 0)
    view = replace(VIEW, place=place)
    canvas, occupied, _, gains = laid([face], projection, pack_pictures([image]), view)
    errors = []
    for row, column in np.argwhere(occupied == FULL):
        across, up = (column + 0.5 - 24) / 40, (20 - row - 0.5) / 40
        z = 6 / (1 - slant * across)  # of the plane z = 6 + slant * x on the ray
        u, v = 8 * across * z + 32 - 0.5, 8 * up * z + 32 - 0.5
        if 0 <= u < side - 1 and 0 <= v < side - 1:
            expected = np.array([3 * u, 100.0, 3 * v]) * gains[0] / 256
            errors.append(np.abs(canvas[row, column] - expected).max())
    assert len(errors) > 500
    assert max(errors) < 3.0


def test_distant_facets_use_coarser_pictures():
    """Black and white lines finer than a pixel become grey, without aliasing."""
    image = np.zeros((64, 64, 3))
    image[::2] = 240.0
    floor = np.array([[-90, -1, 1], [90, -1, 1], [90, -1, 900], [-90, -1, 900]], float)
    projection = [[[16.0, 0, 0, 0], [0, 0, 16.0, 0]]]
    face = Face(floor, np.array([0.0, 1.0, 0.0]), 0)
    canvas, _, _, gains = laid([face], projection, pack_pictures([image]))
    far = canvas[23:27].astype(float)
    assert far.mean() == pytest.approx(120 * gains[0] / 256, abs=3)
    assert far.std() < 4


def test_soft_facets_occupy_no_samples():
    square = np.array([[-1, -1, 5], [1, -1, 5], [1, 1, 5], [-1, 1, 5]], float)
    face = Face(square, np.array([0.0, 0.0, -1.0]), 0, soft=True)
    canvas, occupied, shadow, _ = laid([face])
    assert not occupied.any()
    assert not canvas.any()
    assert shadow[20, 24] == 200
    assert shadow[2, 2] == 0


def test_a_sprite_of_facets_is_covered_by_samples_and_shadow():
    triangle = np.array([[-2, -2, 5], [2, -1.3, 5], [0.3, 2, 5]], float)
    colour, occupied, _, _ = laid([Face(triangle, np.array([0.0, 0.0, -1.0]), 0)])
    shadow = np.zeros(occupied.shape, np.uint8)
    shadow[5:9] = 90
    sprite = sprite_of(colour, occupied, shadow)
    assert (sprite[1:-1, 1:-1, :3] == colour).all()
    assert not sprite[[0, -1]].any()
    assert not sprite[:, [0, -1]].any()
    share = np.array([[bin(int(b)).count("1") for b in row] for row in occupied]) / 16
    expected = np.minimum(255 * share + shadow, 255)
    assert np.abs(sprite[1:-1, 1:-1, 3] - expected).max() < 1


def test_lay_behind_fills_the_free_samples():
    triangle = np.array([[-2, -2, 5], [2, -1.3, 5], [0.3, 2, 5]], float)
    canvas, occupied, _, _ = laid([Face(triangle, np.array([0.0, 0.0, -1.0]), 0)])
    before = canvas.copy()
    behind = np.full(canvas.shape, 160, np.uint8)
    lay_behind(canvas, occupied, behind[:30])
    assert (canvas[30:] == before[30:]).all()
    assert (canvas[:30][occupied[:30] == 0] == 160).all()
    assert (canvas[occupied == FULL] == before[occupied == FULL]).all()
    mixed = canvas[:30][(occupied[:30] != 0) & (occupied[:30] != FULL)]
    assert mixed.min() >= 156  # no dark seam between both
