"""Criteria of wang2010 on a painted square; frames count from 1, as in the paper."""

import numpy as np
import pytest

from tests.bench.papers.criteria.scenes import blank, moving, painted
from trackmark.bench.papers.criteria import wang2010 as criteria

RISING = [40, 39, 37, 35, 27, 19]  # it gets faster by 6 px/frame in frame 5


def test_upward_speed_is_the_mean_to_the_given_frames():
    assert criteria.upward_speed(moving(RISING), first=3, last=4) == pytest.approx(2)
    assert criteria.upward_speed(moving(RISING), first=5, last=5) == pytest.approx(8)


def test_velocity_change_is_counted_in_the_frame_that_shows_it():
    scene = moving(RISING)
    assert criteria.velocity_change(scene, frame=5) == pytest.approx(6)
    assert criteria.velocity_change(scene, frame=6) == pytest.approx(0)
    assert criteria.other_velocity_change(scene, frame=5) == pytest.approx(1 / 6)


@pytest.mark.parametrize(("colour", "contrast"), [((90, 120, 150), 80), ((0, 0, 30), -30)])
def test_contrast_is_positive_for_a_brighter_target(colour, contrast):
    scene = moving([30, 30], colour=colour, ground=40)
    assert criteria.brightness_contrast(scene) == pytest.approx(contrast)


def test_motion_map_marks_the_moving_target_with_its_margin():
    scene = moving(RISING)
    marks = criteria.motion_marks(scene, 6)
    assert marks[scene.mask(5)].mean() > 0.9
    assert not marks[:, :30].any()
    assert not marks[50:].any()
    assert criteria.motion_marked_share(moving([30] * 4)) == 0
    assert criteria.motion_marked_share(scene) > 0.5


def test_motion_map_on_target_halves_with_a_second_target():
    assert criteria.motion_map_on_target(moving(RISING), frame=6) == pytest.approx(1)
    rows, columns = [40, 34, 28], [20, 20, 20]
    left, right = moving(rows, columns), moving(rows, [60, 60, 60])
    images = [np.maximum(left.image(k), right.image(k)) for k in range(3)]
    both = painted(images, left.boxes)
    assert criteria.motion_map_on_target(both, frame=3) == pytest.approx(0.5)


def test_surroundings_distance_is_the_median_of_the_frames():
    coloured, hidden = moving([30]), moving([30], colour=(40, 40, 40))
    images = [hidden.image(0), coloured.image(0), coloured.image(0)]
    scene = painted(images, [hidden.boxes[0]] * 3)
    assert criteria.surroundings_distance(scene, first=1, last=1) == pytest.approx(0, abs=1e-6)
    assert criteria.surroundings_distance(scene, first=1, last=3) == pytest.approx(1)


def test_visible_deviation_is_the_largest_on_either_side():
    visible = np.array([1, 0.45, 0.58, 0.5, 1])
    scene = blank([[5, 5, 5, 5]] * 5, visibility=visible)
    assert criteria.visible_deviation(scene, share=0.5, first=2, last=4) == pytest.approx(0.08)
