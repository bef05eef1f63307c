"""Light, by the laws of light."""

import numpy as np
import pytest

from trackmark.datasets.synthetic.render.lamp import (
    RADIUS,
    REACH,
    Lamp,
    lamp_light,
    lamp_visibility,
    plane_crossings,
    shadow_softness,
)

UP = np.array([0.0, 0.0, 1.0])


def lamp_at(*place):
    return Lamp(np.array(place, float), np.ones(3))


def test_light_falls_with_the_square_of_the_distance():
    point = np.array([10.0, 20.0, 0.0])
    near, far = (lamp_light(np.array([10.0, 20.0, d]), point, UP)[0] for d in (REACH, 2 * REACH))
    assert near == pytest.approx(1)
    assert far == pytest.approx(1 / 4)


@pytest.mark.parametrize("angle", [0.0, 0.4, 1.2])
def test_light_falls_with_the_cosine_of_the_angle(angle):
    normal = np.array([np.sin(angle), 0, np.cos(angle)])
    light, _ = lamp_light(np.array([0, 0, REACH]), np.zeros(3), normal)
    assert light == pytest.approx(np.cos(angle))


def test_a_surface_that_faces_away_has_neither_light_nor_shine():
    assert lamp_light(np.array([0, 0, REACH]), np.zeros(3), -UP) == (0.0, 0.0)


def test_reflection_is_half_way_between_lamp_and_camera():
    place = REACH * np.array([np.sin(0.8), 0, np.cos(0.8)])
    angles = np.linspace(0, 0.8, 81)
    shine = [lamp_light(place, np.zeros(3), np.array([np.sin(a), 0, np.cos(a)]))[1] for a in angles]
    assert angles[np.argmax(shine)] == pytest.approx(0.4)
    assert max(shine) == pytest.approx(1)


def test_light_comes_through_a_plane_on_the_line_to_the_lamp():
    lamp, point = lamp_at(300, -50, 200), np.array([[100.0, 120.0, -80.0]])
    column, row = plane_crossings(lamp, point, 10.0)[0]
    through = np.array([column, row, 10.0]) - point[0]
    assert np.cross(through, lamp.place - point[0]) == pytest.approx(np.zeros(3), abs=1e-9)


def test_a_plane_behind_a_point_is_not_in_its_light():
    assert plane_crossings(lamp_at(0, 0, 200), np.array([[100.0, 120.0, 50.0]]), 10.0).max() < -1e3


def test_shadow_softness_grows_with_the_distance():
    lamp = lamp_at(0, 0, 200)
    assert shadow_softness(lamp, 20.0, 20.0) == 0
    assert 0 < shadow_softness(lamp, 40.0, 20.0) < shadow_softness(lamp, 90.0, 20.0) < RADIUS


@pytest.mark.parametrize("side", [-1, 1])
def test_wall_shadow_has_its_geometric_length(side):
    fine, high = 2, 30.0
    depths = np.zeros((80, 400))
    depths[:, 196:204] = high  # a wall in columns 98 to 102 [pixels]
    lamp = np.array([100 + side * 150.0, 20.0, 150.0])
    seen = lamp_visibility(depths, lamp, fine)[40, :, 0]
    columns = (np.arange(400) + 0.5) / fine
    off = -side * (columns - 100)
    reach = 2 + high / (150 - high) * (150 + 2)
    assert (seen[(off > 5) & (off < reach - 10)] < 0.05).all()
    assert (seen[off > reach + 10] > 0.95).all()
    assert (seen[off < -4] == 1).all()
    edge = seen[np.abs(off - reach) < 8]
    assert ((edge > 0) & (edge < 1)).any()  # the lamp is no point
