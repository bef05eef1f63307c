"""`nummiaro2003/car` and `traffic`: cameras, routes, cars and rasteriser of facets."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.datasets.synthetic.scenes import SEEDS, unless_sealed
from trackmark.datasets.synthetic.nummiaro2003.driving.car import Car, CarAt
from trackmark.datasets.synthetic.nummiaro2003.driving.laying import (
    lay_facets,
)
from trackmark.datasets.synthetic.nummiaro2003.driving.parking import parking_plan
from trackmark.datasets.synthetic.nummiaro2003.driving.plan import (
    BRAKING,
    Bend,
    Route,
    limit_acceleration,
)
from trackmark.datasets.synthetic.nummiaro2003.driving.shape import (
    Face,
    Lens,
    assemble_facets,
    blank_pictures,
    pack_pictures,
    sample_car_shape,
)
from trackmark.datasets.synthetic.nummiaro2003.driving.traffic import traffic_plan
from trackmark.datasets.synthetic.nummiaro2003.driving.view import (
    PerspectiveView,
    facet_pose,
    heading_axes,
)

pytestmark = unless_sealed("nummiaro2003/car") and unless_sealed("nummiaro2003/traffic")

NAMES = ("nummiaro2003/car", "nummiaro2003/traffic")
PLANS = {"nummiaro2003/car": parking_plan, "nummiaro2003/traffic": traffic_plan}


@settings(max_examples=3)
@given(seed=SEEDS, name=st.sampled_from(NAMES))
def test_no_other_car_has_the_targets_paint(seed, name):
    plan = PLANS[name](seed)
    target = plan.cars[0][0].paint
    others = [car.paint for car, _ in plan.cars[1:]] + [
        parked.car.paint for parked in plan.layout.parked
    ]
    assert len(others) > 5
    for paint in others:
        assert np.abs(np.subtract(paint, target)).max() > 30


@settings(max_examples=3)
@given(seed=SEEDS, name=st.sampled_from(NAMES))
def test_cars_do_not_drive_through_one_another(seed, name):
    plan = PLANS[name](seed)
    course = plan.cars[0][1]
    for _, other in plan.cars[1:]:
        assert np.hypot(course.x - other.x, course.z - other.z).min() > 2.6
    for parked in plan.layout.parked:
        assert np.hypot(course.x - parked.x, course.z - parked.z).min() > 2.2


angles = st.floats(-3.1, 3.1)


def projected(view, point):
    """Return column, row and depth, from one rotation after the other."""
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
def test_perspective_view_equals_rotations_and_projection(yaw, pitch, x, z):
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
