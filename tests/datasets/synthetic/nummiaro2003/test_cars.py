"""`nummiaro2003/car` and `nummiaro2003/traffic`: ground truth and rendering."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.datasets.synthetic.scenes import SEEDS, unless_sealed
from trackmark import datasets
from trackmark.datasets.synthetic.nummiaro2003.driving.parking import parking_plan
from trackmark.datasets.synthetic.nummiaro2003.driving.traffic import traffic_plan
from trackmark.datasets.synthetic.nummiaro2003.driving.view import sort_from_far

pytestmark = unless_sealed("nummiaro2003/car") and unless_sealed("nummiaro2003/traffic")

NAMES = ("nummiaro2003/car", "nummiaro2003/traffic")
PLANS = {"nummiaro2003/car": parking_plan, "nummiaro2003/traffic": traffic_plan}


@settings(max_examples=3)
@given(seed=SEEDS)
def test_target_cars_turn(seed):
    heading = parking_plan(seed).cars[0][1].heading
    assert np.abs(heading - heading[0]).max() == pytest.approx(np.pi, abs=0.2)
    plan = traffic_plan(seed)
    course = plan.cars[0][1]
    places = np.array([view.place for view in plan.views])
    sight = np.arctan2(course.x - places[:, 0], course.z - places[:, 2])
    assert np.abs(course.heading - np.unwrap(sight)).max() > np.radians(30)


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


def test_partial_redraw_equals_full_rendering():
    """Redrawing only the windows of moving cars must not be visible."""
    scene = datasets.load("nummiaro2003/car").frames
    for frame in (60, 180):
        quick = scene._with_moving(frame)
        view = scene.plan.views[frame]
        canvas = np.empty_like(quick)
        scene._world.draw(canvas, view)
        moving = [scene.plan.moving(number, frame) for number in range(len(scene.plan.cars))]
        for thing in sort_from_far([*scene._world.resting, *moving], view, canvas.shape[1]):
            thing.draw(canvas, view)
        difference = np.abs(quick.astype(int) - canvas)
        assert difference.max() <= 8
        assert (difference > 2).mean() < 1e-4
