"""Street: geometry measured in the image, light, static objects."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from trackmark.datasets.synthetic.render.sprite import draw_rows, instants
from trackmark.datasets.synthetic.render.street.ground import DEPTH, SLANT_X, SLANT_Z
from trackmark.datasets.synthetic.render.street.street import HOUSES, Reach, Street
from trackmark.datasets.synthetic.render.views import Viewpoint

STILL = Viewpoint(focal=700.0, eye=1.6, horizon=190.0, centre=320.0)
REACH = Reach((0.0, 3.0), (-40.0, 40.0), (-12.0, 12.0))


@pytest.fixture(scope="module")
def street():
    return Street(5, (640, 480), STILL, REACH)


@pytest.fixture(scope="module")
def dappled():
    return Street(5, (640, 480), STILL, REACH, "dappled")


def seen(street, camera=STILL, **motion):
    canvas = np.full((480, 640, 3), 255, np.uint8)
    canvas[..., 0] = 0  # a yellow that no street has
    street.draw(canvas, camera, **motion)
    return canvas


def shift_between(first, second, rows, limit=120):
    """Columns by which a strip of rows moved, to a fraction of a pixel."""
    strip = first[rows, limit:-limit].astype(np.float32)
    score = cv2.matchTemplate(second[rows].astype(np.float32), strip, cv2.TM_SQDIFF)[0]
    best = int(score.argmin())
    low, middle, high = score[best - 1 : best + 2]
    return best + 0.5 * (low - high) / (low - 2 * middle + high) - limit


def test_the_camera_projects_as_a_pinhole():
    camera = replace(STILL, x=2.0, shift_x=7.0, shift_y=-3.0)
    assert camera.scale(7.0) == 100.0
    assert camera.column(3.0, 7.0) == 320.0 + 7.0 + 100.0
    assert camera.row(0.0, 7.0) == 190.0 - 3.0 + 160.0
    assert camera.row(1.6, 3.3) == 190.0 - 3.0  # the eye's height is on the horizon


def test_houses_move_by_their_distance(street):
    first, second = (seen(street, replace(STILL, x=x)) for x in (1.0, 2.0))
    moved = shift_between(first, second, slice(60, 200))
    assert moved == pytest.approx(-700.0 / HOUSES, abs=0.3)


@pytest.mark.parametrize("row", [290, 350, 430])
def test_ground_moves_by_its_distance(street, row):
    first, second = (seen(street, replace(STILL, x=x)) for x in (1.0, 1.25))
    z = 700.0 * 1.6 / (row + 0.5 - 190.0)
    moved = shift_between(first, second, slice(row, row + 1))
    assert moved == pytest.approx(-0.25 * 700.0 / z, abs=0.35)


def test_camera_rotation_shifts_the_whole_image(street):
    first = seen(street, replace(STILL, x=1.0))
    turned = seen(street, replace(STILL, x=1.0, shift_x=24.0))
    for rows in (slice(60, 200), slice(300, 301), slice(440, 441)):
        assert shift_between(first, turned, rows) == pytest.approx(24.0, abs=0.05)
    nodded = seen(street, replace(STILL, x=1.0, shift_y=8.0))
    np.testing.assert_array_equal(nodded[8:200], first[:192])
    np.testing.assert_array_equal(nodded[300:], first[292:-8])


@settings(max_examples=10, deadline=None)
@given(
    x=st.floats(0, 3),
    right=st.floats(-40, 40),
    down=st.floats(-12, 12),
    motion=st.floats(-6, 6),
    travel=st.floats(-0.05, 0.05),
)
def test_every_pixel_is_filled_within_the_reach(street, x, right, down, motion, travel):
    camera = replace(STILL, x=x, shift_x=right, shift_y=down)
    picture = seen(street, camera, motion=(motion, 0.0), travel=travel)
    yellow = (picture[..., 0] == 0) & (picture[..., 1] == 255) & (picture[..., 2] == 255)
    assert not yellow.any()


def test_motion_blurs_sideways_alone(street):
    camera = replace(STILL, x=1.0)
    sharp, blurred = seen(street, camera), seen(street, camera, motion=(6.0, 0.0))
    across, down = (
        [np.abs(np.diff(p.astype(int), axis=axis)).mean() for p in (sharp, blurred)]
        for axis in (1, 0)
    )
    assert across[1] < 0.7 * across[0]
    assert down[1] > 0.7 * down[0]


@given(st.floats(-40, 40))
def test_instants_are_centred_and_close_enough(displacement):
    moments = instants(displacement)
    assert len(moments) in (1, 2, 4, 8)
    assert abs(moments.mean()) < 1e-12
    assert np.abs(moments).max() < 0.5
    if len(moments) < 8:
        assert abs(displacement) / len(moments) <= 2 + 1e-9 or abs(displacement) <= 2 * len(moments)


def test_rows_are_sampled_bilinearly_and_averaged():
    generator = np.random.default_rng(0)
    panorama = generator.integers(0, 256, (6, 40, 3), dtype=np.uint8)
    lefts = generator.integers(0, 64 * 20, (2, 6))
    canvas = np.zeros((4, 16, 3), np.uint8)
    draw_rows(canvas, panorama, -40, lefts, 0, 4)
    for y in range(4):
        place = y + 40 / 64
        row, v = int(place), place % 1
        expected = np.zeros((16, 3))
        for k in range(2):
            for line, weight in ((row, 1 - v), (row + 1, v)):
                columns = np.arange(16) + lefts[k, line] / 64
                left, u = columns.astype(int), (columns % 1)[:, None]
                source = panorama[line].astype(float)
                expected += weight * (source[left] * (1 - u) + source[left + 1] * u) / 2
        assert np.abs(canvas[y] - expected).max() <= 0.51


def test_street_gains_follow_the_ground_below_the_ray(street, dappled):
    heights = np.linspace(0, 1.8, 10)
    assert (street.gains(1.0, 6.0, heights) == 1).all()
    for x, z in ((0.3, 5.0), (2.2, 7.5), (1.1, 9.0)):
        along = dappled.gains(x, z, heights)
        ground = [dappled.gains(x + SLANT_X * h, z + SLANT_Z * h, [0.0])[0] for h in heights]
        np.testing.assert_allclose(along, ground)
    everywhere = np.array(
        [
            dappled.gains(x, z, [0.0])[0]
            for x in np.arange(0, 16, 0.3)
            for z in np.arange(4, 10, 0.5)
        ]
    )
    assert everywhere.min() >= 1 - DEPTH
    assert everywhere.max() <= 1
    assert everywhere.std() > 0.08


def test_shade_darkens_the_ground_by_its_gain(street, dappled):
    bright, shaded = seen(street).astype(float), seen(dappled).astype(float)
    for row in (350, 420, 460):
        z = 700.0 * 1.6 / (row + 0.5 - 190.0)
        x = (np.arange(640) + 0.5 - 320.0) * z / 700.0
        expected = np.array([dappled.gains(place, z, [0.0])[0] for place in x])
        ratio = shaded[row].sum(axis=1) / bright[row].sum(axis=1)
        assert np.corrcoef(ratio, expected)[0, 1] > 0.9 or expected.std() < 0.02
        assert np.abs(ratio - expected).mean() < 0.05


def test_props_cover_the_pixels_that_they_draw(street):
    camera = replace(STILL, x=1.5)
    visible = 0
    for prop in street.props:
        left, top, alpha = prop.coverage(camera)
        if left < 0 or left + alpha.shape[1] > 640:
            continue
        dark, light = np.zeros((480, 640, 3), np.uint8), np.full((480, 640, 3), 255, np.uint8)
        prop.draw(dark, camera)
        prop.draw(light, camera)
        drawn = 255 - (light.astype(int) - dark).mean(axis=2)
        whole = np.zeros((1200, 640))
        whole[400 + top : 400 + top + len(alpha), left : left + alpha.shape[1]] = alpha
        difference = np.abs(cv2.blur(drawn, (3, 3)) - cv2.blur(whole[400:880], (3, 3)))
        assert difference.mean() < 6
        assert abs(camera.column(prop.x, prop.z) - (left + alpha.shape[1] / 2)) <= 1
        visible += 1
    assert visible >= 2


def test_a_post_hides_what_is_behind_its_place(street):
    post = street.post(1.5, 5.0, 0.3)
    camera = replace(STILL, x=1.5)
    left, _, alpha = post.coverage(camera)
    columns = left + np.flatnonzero((alpha[: len(alpha) // 2] > 127).any(axis=0))
    assert len(columns) == pytest.approx(0.3 * 140, abs=2)
    assert columns.mean() + 0.5 == pytest.approx(320, abs=1.5)
