"""`nummiaro2003/person` and `students`: presence and occlusions of the target."""

import numpy as np
import pytest
from hypothesis import given, settings

from tests.datasets.synthetic.scenes import SEEDS, runs, unless_sealed
from trackmark import datasets
from trackmark.datasets.synthetic.knobs import SceneKnobs
from trackmark.datasets.synthetic.multipart.look import WalkerLook
from trackmark.datasets.synthetic.multipart.plan import Person, body_boxes
from trackmark.datasets.synthetic.nummiaro2003.campus import person, students
from trackmark.datasets.synthetic.nummiaro2003.campus.scene import VisitPlan
from trackmark.datasets.synthetic.render.views import sample_fixed_views, straight_path

pytestmark = unless_sealed("nummiaro2003/person") and unless_sealed("nummiaro2003/students")

PERSON, STUDENTS = "nummiaro2003/person", "nummiaro2003/students"


def opened(name, **knobs):
    return datasets.load(":".join([name, *(f"{key}={value}" for key, value in knobs.items())]))


def planned(module, knobs, **values):
    """Return the plan of a scene without its slow ground truth."""
    return module.scene(knobs(**values)).plan


def spells(flags):
    """Return first frame and length of every run of True."""
    return [(start, end - start) for start, end in runs(flags).tolist()]


def check_occlusions_of_students(sequence):
    """Check the frames of the occlusions against the paper."""
    seen, present = sequence.visibility, sequence.present
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


def test_students_occlusions_follow_the_paper():
    check_occlusions_of_students(opened(STUDENTS))


@pytest.mark.slow
def test_students_occlusions_follow_the_paper_in_many_scenes():
    for seed in (1, 2, *range(100, 160)):
        check_occlusions_of_students(opened(STUDENTS, scene=seed))


@settings(max_examples=5, deadline=None)
@given(seed=SEEDS)
def test_people_avoid_cars_trees_and_each_other(seed):
    plan = planned(person, SceneKnobs, scene=seed)
    courses = [walker.course for walker in plan.people]
    for car in (prop for prop in plan.posts if prop.z < person.DOORSTEP):
        for course in courses:
            beside = np.abs(course.x - car.x) > 2.3
            assert (beside | (np.abs(course.z - car.z) > 1.0)).all()
    for number, course in enumerate(courses):
        for other in courses[:number]:
            assert np.hypot(course.x - other.x, course.z - other.z).min() > 0.45
    plan = planned(students, SceneKnobs, scene=seed)
    tree = plan.posts[0]
    for walker in plan.people:
        assert np.hypot(walker.course.x - tree.x, walker.course.z - tree.z).min() > 0.9


@settings(max_examples=4, deadline=None)
@given(seed=SEEDS)
def test_bystanders_wear_other_colours_than_the_target(seed):
    target, *others = (walker.look for walker in students._plan(seed).people)
    assert len(others) == 7
    worn = [target.shirt, target.trousers]
    for other in others:
        for garment in (other.shirt, other.trousers, *([other.bag] if other.bag else [])):
            assert min(np.abs(np.subtract(garment, worn_colour)).max() for worn_colour in worn) > 25


@pytest.fixture(scope="module")
def visit():
    return datasets.load(STUDENTS)


def test_absent_student_has_no_ground_truth(visit):
    for frame in (0, visit.first_frame - 1):
        assert np.isnan(visit.boxes[frame]).all()
        assert np.isnan(visit.regions["tight"][frame]).all()
        assert not visit.mask(frame).any()


def test_target_is_absent_when_its_box_leaves_the_image():
    way = straight_path(240, 120, (0.0, 8.0), (1.3, 0.0), 0.0)
    someone = Person(WalkerLook((0, 0, 90), (90, 0, 0)), 0, 1.75, way)
    views = sample_fixed_views(np.random.default_rng(0), 240)
    passing = VisitPlan(0, views, [someone], slice(10, None))
    x, _, width, _ = body_boxes(*passing.places[0].T).T
    ((first, frames),) = spells(passing.present)
    assert first > 20
    assert first + frames < 220
    assert x[first] + width[first] > 0 >= x[first - 1] + width[first - 1]
    assert x[first + frames - 1] < 640 <= x[first + frames]


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
