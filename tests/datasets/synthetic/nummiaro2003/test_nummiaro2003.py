"""Scenes of `nummiaro2003`: head, students and traffic."""

import numpy as np
import pytest

from tests.datasets.synthetic.scenes import runs, slow_if_unchanged
from trackmark import datasets
from trackmark.datasets.synthetic.nummiaro2003.driving.traffic import traffic_plan
from trackmark.datasets.synthetic.nummiaro2003.driving.view import facet_pose
from trackmark.datasets.synthetic.nummiaro2003.head import HeadScene
from trackmark.datasets.synthetic.parameters import SceneParameters
from trackmark.datasets.synthetic.render.figure.routine import HEAD_SIDE, PACES

pytestmark = slow_if_unchanged("nummiaro2003/head", "nummiaro2003/students", "nummiaro2003/traffic")


HEAD = "nummiaro2003/head"


@pytest.fixture(scope="module")
def head():
    return datasets.load(HEAD)


@pytest.mark.parametrize("seed", [0, pytest.param(11, marks=pytest.mark.slow)])
def test_ellipse_in_the_head_box_fits_the_head(seed):
    sequence = datasets.load(f"{HEAD}:scene={seed}")
    shares = []
    for frame in range(0, 450, 25):
        x, y, width, height = sequence.boxes[frame]
        left, top, whole, _ = sequence.frames.worker.head_seen(frame)
        head = whole >= 128
        u = (np.arange(head.shape[1]) + left + 0.5 - x - width / 2) / (width / 2)
        v = (np.arange(head.shape[0]) + top + 0.5 - y - height / 2) / (height / 2)
        ellipse = u * u + (v * v)[:, None] <= 1
        shares.append((ellipse & head).sum() / (ellipse | head).sum())
    assert np.median(shares) > 0.86
    assert min(shares) > 0.80


def test_turned_away_marks_frames_without_visible_face(head):
    """Check that paint on the front of the head is invisible exactly in the marked frames."""
    worker = head.frames.worker
    face = slice(66, 92)  # rows of the atlas from the eyes down to the mouth
    atlas = worker._atlas.copy()
    try:
        frames = range(5, 450, 37)
        plain = [head.frames.render(frame).astype(int) for frame in frames]
        worker._atlas[face, :20] = worker._atlas[face, -20:] = (0, 255, 0)
        marked = [head.frames.render(frame).astype(int) for frame in frames]
    finally:
        worker._atlas[:] = atlas
    seen = [np.abs(a - b).max(axis=2).max() > 40 for a, b in zip(plain, marked, strict=True)]
    away = head.attributes["turned_away"][list(frames)]
    assert away.any()
    assert not np.logical_and(seen, away).any()
    assert np.mean(np.array(seen)[~away]) > 0.9


def test_fast_attribute_is_a_tenth_of_the_width_per_frame(head):
    centre = head.boxes[:, :2] + head.boxes[:, 2:] / 2
    speed = np.hypot(*((centre[2:] - centre[:-2]) / 2).T) / head.boxes[1:-1, 2]
    fast = head.attributes["fast"][1:-1]
    clear = np.abs(speed - 0.1) > 0.03  # the size of the box changes as the head turns
    assert (fast[clear] == (speed[clear] > 0.1)).mean() > 0.97


def head_speed(seed):
    """Return the 95th percentile of the speed of the head's centre [mean sides of its box]."""
    worker = HeadScene(SceneParameters(scene=seed)).worker
    places = np.stack([worker.head_place(frame) for frame in range(450)])
    sides = HEAD_SIDE * 700.0 / worker._bones.origins[:, 0, 2]
    return np.percentile(np.hypot(*np.diff(places, axis=0).T) / sides[1:], 95)


def test_head_speeds_cover_the_range_of_recorded_heads():
    """Check that the speeds are log-uniform: half of them are below the geometric mean."""
    speeds = np.array([head_speed(seed) for seed in range(24)])
    assert (speeds > 0.8 * PACES[0]).all()
    assert (speeds < 1.1 * PACES[1]).all()
    below = (speeds < np.sqrt(PACES[0] * PACES[1])).mean()
    assert 0.3 < below < 0.7


def light_on(facing, light):
    """Return the light on a facet that faces a direction (x, y, z)."""
    return np.dot(light[:3], facing) + light[3]


@pytest.mark.parametrize("seed", range(6))
def test_traffic_target_turns_its_rear_from_shade_to_light(seed):
    plan = traffic_plan(seed)
    heading, light = plan.cars[0][1].heading, plan.layout.light
    first, last = (
        light_on((-np.sin(angle), 0, -np.cos(angle)), light) for angle in (heading[0], heading[-1])
    )
    assert first < 0.6
    assert last > 1.0
    assert all(car.light == light for car in plan.layout.parked)
    assert plan.car(0, 0).light == light


def test_light_of_a_facet_follows_its_normal():
    """The gain is 256 times the light: 0.8 + 0.1 for an upright facet that faces x."""
    plan = traffic_plan(0)
    facets = plan.cars[0][0].facets
    gains = facet_pose(plan.views[0], facets, light=(0.1, 0.2, 0.3, 0.8)).gains
    expected = facets.normals @ [0.1, 0.2, 0.3] + 0.8
    assert gains == pytest.approx(256 * expected, abs=0.5001)


def spells(flags):
    """Return first frame and length of every run of True."""
    return [(start, end - start) for start, end in runs(flags).tolist()]


@pytest.fixture(scope="module")
def visit():
    return datasets.load("nummiaro2003/students")


def test_students_occlusions_follow_the_paper(visit):
    seen, present = visit.visibility, visit.present
    tree, *passers, leaves = spells((seen < 0.5) & present)
    start, frames = spells((seen < 0.3) & present)[0]
    assert 6 <= frames <= 14
    assert start < 121 < start + frames
    assert len(passers) == 2
    assert all(1 <= frames <= 6 for _, frames in passers)
    assert tree[0] + tree[1] + 30 < passers[0][0]
    assert passers[0][0] + passers[0][1] + 8 < passers[1][0]
    assert passers[1][0] + passers[1][1] + 8 < leaves[0]
    assert 218 <= leaves[0] <= 231
    assert sum(leaves) == 232
    assert len(spells((seen < 0.9) & present)) == 4  # no other occlusions


def test_absent_student_has_no_ground_truth(visit):
    for frame in (0, visit.first_frame - 1):
        assert np.isnan(visit.boxes[frame]).all()
        assert np.isnan(visit.regions["tight"][frame]).all()
        assert not visit.mask(frame).any()


def test_visit_masks_agree_with_boxes_and_visibility(visit):
    plan = visit.frames.plan
    for frame in (*range(visit.first_frame, visit.first_frame + 12), 121, 181, 203, 225, 231):
        mask = visit.mask(frame)
        whole = (plan.coverage(0, frame)[2] >= 128).sum()
        assert mask.sum() / whole == pytest.approx(visit.visibility[frame], abs=0.05)
        rows, columns = np.nonzero(mask)
        x, y, width, height = visit.regions["tight"][frame]
        assert ((columns >= x) & (columns < x + width) & (rows >= y) & (rows < y + height)).all()
        if visit.visibility[frame] > 0.95:
            x, y, width, height = visit.boxes[frame]
            inside = (columns >= x - 1) & (columns < x + width) & (rows >= y - 1)
            assert inside.mean() > 0.6


def test_visit_attributes_are_false_without_target(visit):
    assert not any(flags[~visit.present].any() for flags in visit.attributes.values())
    occluded = visit.present & (visit.visibility < 0.9)
    assert (visit.attributes["occlusion"] == occluded).all()
    size = visit.boxes[:, 3] / visit.boxes[visit.first_frame, 3]
    assert (visit.attributes["scale_change"] == ((size < 0.8) | (size > 1.25))).all()
