"""Street: geometry measured in the image, light, static objects."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

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
    canvas[..., 0] = 0  # yellow: not a colour of streets
    street.draw(canvas, camera, **motion)
    return canvas


def shift_between(first, second, rows, limit=120):
    """Return the shift of a strip of rows [columns], with subpixel accuracy."""
    strip = first[rows, limit:-limit].astype(np.float32)
    score = cv2.matchTemplate(second[rows].astype(np.float32), strip, cv2.TM_SQDIFF)[0]
    best = int(score.argmin())
    low, middle, high = score[best - 1 : best + 2]
    return best + 0.5 * (low - high) / (low - 2 * middle + high) - limit


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
def test_street_fills_every_pixel_within_its_reach(street, x, right, down, motion, travel):
    camera = replace(STILL, x=x, shift_x=right, shift_y=down)
    picture = seen(street, camera, motion=(motion, 0.0), travel=travel)
    yellow = (picture[..., 0] == 0) & (picture[..., 1] == 255) & (picture[..., 2] == 255)
    assert not yellow.any()


def test_motion_blurs_only_horizontally(street):
    camera = replace(STILL, x=1.0)
    sharp, blurred = seen(street, camera), seen(street, camera, motion=(6.0, 0.0))
    across, down = (
        [np.abs(np.diff(p.astype(int), axis=axis)).mean() for p in (sharp, blurred)]
        for axis in (1, 0)
    )
    assert across[1] < 0.7 * across[0]
    assert down[1] > 0.7 * down[0]


def test_shade_darkens_the_ground_by_its_gain(street, dappled):
    bright, shaded = seen(street).astype(float), seen(dappled).astype(float)
    for row in (350, 420, 460):
        z = 700.0 * 1.6 / (row + 0.5 - 190.0)
        x = (np.arange(640) + 0.5 - 320.0) * z / 700.0
        expected = np.array([dappled.gains(place, z, [0.0])[0] for place in x])
        ratio = shaded[row].sum(axis=1) / bright[row].sum(axis=1)
        assert np.corrcoef(ratio, expected)[0, 1] > 0.9 or expected.std() < 0.02
        assert np.abs(ratio - expected).mean() < 0.05


def test_post_has_its_width_and_position(street):
    post = street.post(1.5, 5.0, 0.3)
    camera = replace(STILL, x=1.5)
    left, _, alpha = post.coverage(camera)
    columns = left + np.flatnonzero((alpha[: len(alpha) // 2] > 127).any(axis=0))
    assert len(columns) == pytest.approx(0.3 * 140, abs=2)
    assert columns.mean() + 0.5 == pytest.approx(320, abs=1.5)
