"""Cameras, solids and ways of the scenes with cars."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.datasets.synthetic.scenes import SEEDS
from trackmark.datasets.synthetic.nummiaro2003.driving.car import Car, CarAt
from trackmark.datasets.synthetic.nummiaro2003.driving.scene import (
    BRAKING,
    Bend,
    Route,
    limit_acceleration,
)
from trackmark.datasets.synthetic.nummiaro2003.driving.shape import sample_car_shape
from trackmark.datasets.synthetic.nummiaro2003.driving.view import PerspectiveView, heading_axes

angles = st.floats(-3.1, 3.1)


def projected(view, point):
    """Column, row and depth, one rotation after the other."""
    x, y, z = np.subtract(point, view.place)
    across = x * math.cos(view.yaw) - z * math.sin(view.yaw)
    ahead = x * math.sin(view.yaw) + z * math.cos(view.yaw)
    depth = ahead * math.cos(view.pitch) - y * math.sin(view.pitch)
    up = ahead * math.sin(view.pitch) + y * math.cos(view.pitch)
    return (
        view.centre[0] + view.focal * across / depth,
        view.centre[1] - view.focal * up / depth,
        depth,
    )


@given(yaw=angles, pitch=st.floats(-0.5, 0.5), x=st.floats(-20, 20), z=st.floats(3, 60))
def test_the_camera_projects_as_a_pinhole(yaw, pitch, x, z):
    view = PerspectiveView(560.0, (320.0, 240.0), (3.0, 1.4, -7.0), yaw, pitch)
    turned = heading_axes(yaw) @ [x, 0.8, z]
    point = turned + [3.0, 0.0, -7.0]
    expected = projected(view, point)
    if expected[2] < 0.5:
        return
    assert view.project(point).tolist() == pytest.approx(expected, abs=1e-4)
    ground = point * [1, 0, 1]
    assert view.place_of(ground[0], ground[2]) == pytest.approx(view.project(ground), abs=1e-6)
    assert view.shifted(5, -3).project(point)[:2] == pytest.approx(
        np.add(expected[:2], [5, -3]), abs=1e-4
    )


def test_far_ground_is_on_the_horizon():
    view = PerspectiveView(560.0, (320.0, 240.0), (3.0, 6.0, -7.0), 0.4, 0.2)
    far = np.array([math.sin(0.4), 0.0, math.cos(0.4)]) * 1e7
    assert view.project(far)[1] == pytest.approx(view.horizon, abs=0.01)


@settings(max_examples=20)
@given(seed=SEEDS)
def test_car_faces_are_plane_with_unit_normals(seed):
    facets = sample_car_shape(np.random.default_rng(seed)).facets
    for corners, count, normal in zip(facets.corners, facets.counts, facets.normals, strict=True):
        heights = (corners[:count] - corners[0]) @ normal
        assert np.abs(heights).max() < 1e-9
        assert normal @ normal == pytest.approx(1)


@settings(max_examples=20)
@given(seed=SEEDS, heading=angles)
def test_car_box_has_its_length_width_and_height(seed, heading):
    shape = sample_car_shape(np.random.default_rng(seed))
    view = PerspectiveView(
        5000.0, (320.0, 240.0), (0.0, 0.7, -100.0), 0.0, 0.0
    )  # nearly parallel rays
    box = CarAt(Car(shape, (0.0, 0.0, 0.0), 0), 0.0, 0.0, heading).box(view)
    metre = 50.0
    # The corners of the outline are cut off.
    outline = abs(math.sin(heading)) * shape.length + abs(math.cos(heading)) * shape.width
    assert 0.87 * outline * metre < box[2] < 1.04 * outline * metre
    assert box[3] == pytest.approx(shape.roof * metre, rel=0.05)


@given(straight=st.floats(8, 30), turn=st.floats(0.5, 2), radius=st.floats(5, 12), heading=angles)
def test_route_ends_turned_by_its_bend(straight, turn, radius, heading):
    way = Route(2.0, -3.0, heading, [Bend(straight, turn, radius), Bend(15.0)])
    assert way.length == pytest.approx(straight + turn * radius + 15, abs=0.3)
    start, end = way.places_at(np.array([0.0, way.length]))
    assert start[:2] == pytest.approx([2.0, -3.0], abs=0.1)
    assert end[2] - heading == pytest.approx(turn, abs=0.02)
    along = np.array([math.sin(heading), math.cos(heading)])
    right = np.array([math.cos(heading), -math.sin(heading)])
    after = 15.0 * np.array([math.cos(turn), math.sin(turn)])
    arc = radius * np.array([math.sin(turn), 1 - math.cos(turn)])
    ahead, aside = np.array([straight, 0]) + arc + after
    np.testing.assert_allclose(end[:2], [2.0, -3.0] + along * ahead + right * aside, atol=0.6)


def test_limit_acceleration_brakes_before_bends():
    limit = np.full(800, 12.0)
    limit[400:440] = 4.0
    speed = limit_acceleration(limit, 1.0)
    assert (speed <= limit + 1e-9).all()
    assert speed[-1] == 1.0
    steps = np.diff(speed * speed) / (2 * 0.05)
    assert np.abs(steps).max() < BRAKING + 1e-9
    assert speed[420] == 4.0
    assert speed[0] < 12.0


def test_route_is_driven_in_the_requested_frames():
    way = Route(0.0, 0.0, 0.0, [Bend(30.0, math.pi / 2, 6.0), Bend(20.0)])
    travelled = way.travelled(300, 6.0, 0.5)
    assert len(travelled) == 300
    assert travelled[[0, -1]] == pytest.approx([0.0, way.length])
    assert (np.diff(travelled) > 0).all()
    speeds = np.diff(travelled)
    bend = (travelled[:-1] > 32) & (travelled[:-1] < 37)
    assert speeds[bend].mean() < 0.8 * speeds[20:60].mean()
