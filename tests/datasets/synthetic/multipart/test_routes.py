"""Walking paths and cameras, before rendering."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.datasets.synthetic.scenes import SEEDS
from trackmark.datasets.synthetic.multipart import casting, routes
from trackmark.datasets.synthetic.multipart.designs import DESIGNS
from trackmark.datasets.synthetic.render import views
from trackmark.datasets.synthetic.render.views import (
    FRAMES_PER_SECOND,
    Viewpoint,
    straight_path,
    walk_through_points,
)

FOLLOWED = [design for design in DESIGNS.values() if design.follows]
FIXED = [design for design in DESIGNS.values() if not design.follows]


def columns(seen, course):
    """Return the image column of a walker's axis in every frame."""
    return np.array([seen[t].column(course.x[t], course.z[t]) for t in range(len(course.x))])


def test_straight_path_has_matching_speed_gait_and_heading():
    course = straight_path(100, 40, (2.0, 8.0), (-1.3, 0.0), 0.25)
    assert (course.x[40], course.z[40]) == (2.0, 8.0)
    assert np.diff(course.x) * FRAMES_PER_SECOND == pytest.approx(-1.3)
    assert np.abs(course.heading) == pytest.approx(np.pi, abs=0.02)
    assert course.stride == pytest.approx(1)
    assert course.phase[0] == pytest.approx(0.25, abs=0.01)
    assert np.diff(course.phase).mean() * FRAMES_PER_SECOND == pytest.approx(1.3 / 1.42, rel=0.01)


@pytest.mark.parametrize(
    ("goal", "heading"), [((9, 5), 0), ((0, -9), np.pi / 2), ((0, 19), -np.pi / 2)]
)
def test_heading_points_to_the_camera_for_falling_depth(goal, heading):
    course = walk_through_points(40, (0.0, 5.0), iter([goal]), 1.2, 0.0)
    assert course.heading == pytest.approx(heading, abs=0.02)


@settings(max_examples=12, deadline=None)
@given(seed=SEEDS, design=st.sampled_from(FOLLOWED))
def test_followed_target_stays_in_view_and_depth_range(seed, design):
    random = np.random.default_rng(seed)
    course = routes.sample_followed_path(random, design)
    seen = views.sample_following_views(random, course)
    assert len(course.x) == design.length
    assert (course.z > design.depths[0] - 0.6).all()
    assert (course.z < design.depths[1] + 0.6).all()
    place = columns(seen, course)
    assert (place > 110).all()
    assert (place < 530).all()
    assert place.std() > 25  # not always in the middle
    assert np.abs(np.diff(seen.x)).max() < 0.16
    assert np.abs(np.diff(seen.shift_x)).max() > 3  # quick turns
    assert np.ptp(course.heading) > np.pi / 2


@settings(max_examples=15, deadline=None)
@given(seed=SEEDS, number=st.sampled_from(["1", "4"]))
def test_followed_target_changes_size_by_a_third(seed, number):
    z = routes.sample_followed_path(np.random.default_rng(seed), DESIGNS[number]).z
    assert 1.3 < z.max() / z.min() < 2.3


@settings(max_examples=12, deadline=None)
@given(seed=SEEDS, design=st.sampled_from(FIXED))
def test_target_of_fixed_camera_stays_completely_in_view(seed, design):
    random = np.random.default_rng(seed)
    seen = views.sample_fixed_views(random, design.length)
    course = routes.sample_path_in_view(random, design, seen)
    place = columns(seen, course)
    assert (place > 20).all()
    assert (place < 620).all()
    assert np.ptp(place) > 150
    assert seen.still.row(0.0, course.z).max() < 480
    assert seen[0] == seen[design.length - 1] == seen.still


@settings(max_examples=10, deadline=None)
@given(seed=SEEDS, design=st.sampled_from(FIXED))
def test_path_before_target_occludes_at_the_requested_time(seed, design):
    random = np.random.default_rng(seed)
    seen = views.sample_fixed_views(random, design.length)
    target = routes.sample_path_in_view(random, design, seen)
    when = design.length * 0.5
    course = routes.sample_path_before_target(random, seen, target, [], when)
    crossing = np.abs(columns(seen, course) - columns(seen, target))
    first = int(when - 0.05 * design.length) - 1
    last = int(when + 0.05 * design.length) + 2
    near = np.arange(first, last)[crossing[first:last].argmin()]
    assert crossing[near] < 5
    assert course.z[near] < target.z[near] - 0.6


@settings(max_examples=10, deadline=None)
@given(seed=SEEDS, distance=st.floats(0, 3))
def test_path_beside_target_reaches_the_requested_distance(seed, distance):
    random = np.random.default_rng(seed)
    seen = views.sample_fixed_views(random, 150)
    target = straight_path(150, 75, (0.0, 8.0), (0.55, 0.0), 0.0)
    width = 0.24 * 1.75 * seen.still.scale(target.z)
    twin = routes.sample_path_beside_target(random, seen, target, width, distance)
    apart = np.abs(columns(seen, twin) - columns(seen, target)) / width
    assert apart.min() == pytest.approx(distance, abs=1e-6)
    assert apart.argmin() == 75
    assert apart[0] > distance + 4
    assert (twin.z < target.z - 0.5).all()


def test_views_rate_is_the_central_difference():
    random = np.random.default_rng(0)
    assert views.sample_fixed_views(random, 9).rate(4) == (0.0, (0.0, 0.0))
    still = Viewpoint(700.0, 1.6, 190.0, 320.0)
    x, right, down = np.array([[0, 1, 4.0], [5, 5, 9.0], [3, 2, 1.0]])
    seen = views.Views(still, x, right, down)
    assert seen.rate(1) == (2.0, (2.0, -1.0))
    assert seen.rate(0) == (1.0, (0.0, -1.0))
    assert seen.rate(2) == (3.0, (4.0, -1.0))
    assert seen[2] == Viewpoint(700.0, 1.6, 190.0, 320.0, x=4.0, shift_x=9.0, shift_y=1.0)


@settings(max_examples=12, deadline=None)
@given(seed=SEEDS)
def test_overtaking_path_keeps_distance_and_passes_once(seed):
    random = np.random.default_rng(seed)
    seen = views.sample_fixed_views(random, 300)
    target = routes.sample_path_in_view(random, DESIGNS["5"], seen)
    course = routes.sample_overtaking_path(random, seen, target, [], 150, 0.9)
    apart = np.hypot(course.x - target.x, course.z - target.z)
    assert apart.min() > routes.ELBOW_ROOM
    near = np.flatnonzero(np.abs(course.x - target.x) < 1.5)
    assert 50 < len(near) < 120


@settings(max_examples=8, deadline=None)
@given(seed=SEEDS)
def test_crossing_path_passes_before_the_target_in_time(seed):
    random = np.random.default_rng(seed)
    seen = views.sample_fixed_views(random, 377)
    target = routes.sample_path_in_view(random, DESIGNS["7"], seen)
    course = routes.sample_crossing_path(random, seen, target, [], (0.87, 0.9))
    apart = np.abs(columns(seen, course) - columns(seen, target))[300:]
    nearest = 300 + int(apart.argmin())
    assert 0.86 * 377 < nearest < 0.91 * 377
    assert course.z[nearest] < target.z[nearest] - 0.4


@given(seed=SEEDS)
def test_two_coloured_clothes_differ_and_plain_ones_do_not(seed):
    random = np.random.default_rng(seed)
    shirt, trousers = casting.sample_two_coloured_clothes(random)
    assert casting.chroma_distance(shirt, trousers) > 60
    first, second = casting.sample_plain_clothes(random)
    assert casting.chroma_distance(first, second) < 12


@given(seed=SEEDS)
def test_passers_differ_in_chromaticity_from_the_target(seed):
    random = np.random.default_rng(seed)
    target = casting.sample_two_coloured_clothes(random)
    worn = casting.sample_passer_clothes(random, target)
    assert min(casting.chroma_distance(a, b) for a in worn for b in target) > 30


@given(seed=SEEDS)
def test_other_clothes_share_no_colour_with_the_first(seed):
    random = np.random.default_rng(seed)
    first = casting.sample_street_clothes(random)
    other = casting.sample_other_clothes(random, first)
    apart = [np.abs(np.subtract(a, b)).max() for a in first for b in other]
    assert min(apart) > 25
