"""`nummiaro2003/person` and `students`: presence and occlusions of the target."""

import numpy as np
import pytest
from hypothesis import given, settings

from tests.datasets.synthetic.scenes import SEEDS, runs, unless_sealed
from trackmark import datasets
from trackmark.datasets.synthetic.multipart.look import WalkerLook
from trackmark.datasets.synthetic.multipart.plan import Person, body_boxes
from trackmark.datasets.synthetic.nummiaro2003.campus import person, students
from trackmark.datasets.synthetic.nummiaro2003.campus.scene import VisitPlan, VisitScene
from trackmark.datasets.synthetic.parameters import SceneParameters
from trackmark.datasets.synthetic.render.views import sample_fixed_views, straight_path

pytestmark = unless_sealed("nummiaro2003/person") and unless_sealed("nummiaro2003/students")

PERSON, STUDENTS = "nummiaro2003/person", "nummiaro2003/students"


def opened(name, **parameters):
    return datasets.load(":".join([name, *(f"{key}={value}" for key, value in parameters.items())]))


def planned(module, parameters, **values):
    """Return the plan of a scene without its slow ground truth."""
    return module.scene(parameters(**values)).plan


def spells(flags):
    """Return first frame and length of every run of True."""
    return [(start, end - start) for start, end in runs(flags).tolist()]


def check_the_story_of_the_students(sequence):
    """Check that occlusions occur at the paper's frames."""
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
    assert len(spells((seen < 0.9) & present)) == 4  # and nothing else hides him


def test_students_occlusions_follow_the_paper():
    check_the_story_of_the_students(opened(STUDENTS))


@pytest.mark.slow
def test_students_occlusions_follow_the_paper_in_many_scenes():
    for seed in (1, 2, *range(100, 160)):
        check_the_story_of_the_students(opened(STUDENTS, scene=seed))


@settings(max_examples=5, deadline=None)
@given(seed=SEEDS)
def test_people_avoid_cars_trees_and_each_other(seed):
    plan = planned(person, SceneParameters, scene=seed)
    courses = [person_.course for person_ in plan.people]
    for car in (prop for prop in plan.posts if prop.z < person.DOORSTEP):
        for course in courses:
            beside = np.abs(course.x - car.x) > 2.3
            assert (beside | (np.abs(course.z - car.z) > 1.0)).all()
    for number, course in enumerate(courses):
        for other in courses[:number]:
            assert np.hypot(course.x - other.x, course.z - other.z).min() > 0.45
    plan = planned(students, SceneParameters, scene=seed)
    tree = plan.posts[0]
    for person_ in plan.people:
        assert np.hypot(person_.course.x - tree.x, person_.course.z - tree.z).min() > 0.9


@settings(max_examples=4, deadline=None)
@given(seed=SEEDS)
def test_bystanders_wear_other_colours_than_the_target(seed):
    target, *others = (person_.look for person_ in students._plan(seed).people)
    assert len(others) == 7
    worn = [target.shirt, target.trousers]
    for other in others:
        for garment in (other.shirt, other.trousers, *([other.bag] if other.bag else [])):
            assert min(np.abs(np.subtract(garment, worn_colour)).max() for worn_colour in worn) > 25


@pytest.fixture(scope="module")
def visit():
    return datasets.load(STUDENTS)


def test_target_changes_only_its_own_pixels(visit):
    plan = visit.frames.plan
    surroundings = type(plan.street("even"))
    nobody = VisitPlan(
        plan.seed, plan.views, plan.people, slice(0, 0), plan.posts, surroundings=surroundings
    )
    without = VisitScene(nobody, "even")
    first = visit.first_frame
    assert np.isnan(without.truth().boxes).all()
    for frame in (0, first - 1):
        assert np.isnan(visit.boxes[frame]).all()
        assert np.isnan(visit.regions["tight"][frame]).all()
        assert not visit.mask(frame).any()
        assert (visit[frame] == without.render(frame)).all()
    for frame in (first, first + 70, first + 160):
        x, y, width, height = visit.regions["tight"][frame]
        rows, columns = np.nonzero((visit[frame] != without.render(frame)).any(axis=2))
        reach = 0.1 * height  # of the blur, and of the shadow at his feet
        assert (rows.min() >= y - 3) & (rows.max() < y + height + reach)
        assert (columns.min() >= x - reach - 3) & (columns.max() < x + width + reach + 3)


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
