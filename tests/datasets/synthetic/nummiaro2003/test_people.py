"""`nummiaro2003/person` and `students`: when the target is there, and what hides him."""

import numpy as np
import pytest
from hypothesis import given, settings

import datasets
from datasets.synthetic import nummiaro2003
from datasets.synthetic.multipart.look import Look
from datasets.synthetic.multipart.plan import Person, body_boxes
from datasets.synthetic.nummiaro2003.campus import person, students
from datasets.synthetic.nummiaro2003.campus.scene import VisitPlan, VisitScene
from datasets.synthetic.nummiaro2003.knobs import PersonKnobs, StudentsKnobs
from datasets.synthetic.render.views import fixed, straight
from tests.datasets.synthetic.scenes import SEEDS, runs

PERSON, STUDENTS = "nummiaro2003/person", "nummiaro2003/students"


def opened(name, **knobs):
    return datasets.load(":".join([name, *(f"{key}={value}" for key, value in knobs.items())]))


def planned(module, knobs, **values):
    """Plan of a scene, without its truth, which takes most of the time."""
    return module.scene(knobs(**values)).plan


def spells(flags):
    """First frame and length of every run of True."""
    return [(start, end - start) for start, end in runs(flags).tolist()]


def check_the_story_of_the_students(sequence):
    """What the paper tells, at the frames where it tells it."""
    seen, present = sequence.visibility, sequence.present
    assert len(sequence) == 242
    assert spells(present) == [(20, 212)]
    assert (seen[:20] == 0).all()
    assert (seen[232:] == 0).all()
    assert (seen[20:60] > 0.999).all()
    tree, *passers, leaves = spells((seen < 0.5) & present)
    start, frames = spells((seen < 0.1) & present)[0]
    assert 13 <= frames <= 22
    assert start < 121 < start + frames
    assert seen[121] < 0.02
    assert len(passers) == 2
    assert all(1 <= frames <= 6 for _, frames in passers)
    assert tree[0] + tree[1] + 30 < passers[0][0]
    assert passers[0][0] + passers[0][1] + 8 < passers[1][0]
    assert passers[1][0] + passers[1][1] + 8 < leaves[0]
    assert 218 <= leaves[0] <= 231
    assert sum(leaves) == 232
    assert len(spells((seen < 0.9) & present)) == 4  # and nothing else hides him


def test_a_tree_and_two_students_hide_the_target_when_the_paper_says():
    check_the_story_of_the_students(opened(STUDENTS))


@pytest.mark.slow
def test_they_do_so_in_many_scenes():
    for seed in (1, 2, *range(100, 160)):
        check_the_story_of_the_students(opened(STUDENTS, scene=seed))


@pytest.mark.slow
@pytest.mark.parametrize("tree", [2, 3])
def test_a_wider_tree_hides_him_for_longer_and_changes_nothing_else(tree):
    usual, wide = opened(STUDENTS, scene=1), opened(STUDENTS, scene=1, tree=tree)
    assert (usual.boxes[20:232] == wide.boxes[20:232]).all()
    hidden = [((q.visibility < 0.1) & q.present)[:170].sum() for q in (usual, wide)]
    assert hidden[1] > hidden[0] + 18 * (tree - 1)
    before = np.flatnonzero(usual.visibility != wide.visibility)
    assert before.min() > 70
    assert before.max() < 170
    looks = [[person.look for person in q.frames.plan.people] for q in (usual, wide)]
    assert looks[0] == looks[1]
    middle = round(usual.frames.plan.places[0, 121, 0])
    for frame in (10, 121, 203):
        change = (usual[frame] != wide[frame]).any(axis=2)
        assert not change[200:, : middle - 200].any()
        assert not change[200:, middle + 200 :].any()
        assert change[200:, middle - 200 : middle + 200].any()


@pytest.mark.parametrize("seed", range(4))
def test_before_an_empty_start_he_is_out_of_sight_and_then_comes_in_by_an_entry(seed):
    sequence = opened(PERSON, scene=seed, start="empty")
    seen = sequence.visibility
    assert len(sequence) == 310
    assert spells(sequence.present) == [(60, 250)]
    assert 0.1 <= seen[60] < 0.6
    assert (seen[120:] > 0.95).all()
    half = int(np.argmax(seen >= 0.5))
    middle = sequence.boxes[half, :2] + sequence.boxes[half, 2:] / 2
    entries = nummiaro2003.entries(sequence.name)
    outside = np.maximum(entries[:, :2] - middle, middle - entries[:, :2] - entries[:, 2:])
    assert outside.max(axis=1).min() < 3


def test_all_entries_are_used_and_lie_in_the_picture():
    used = set()
    for seed in range(12):
        entries = nummiaro2003.entries(f"{PERSON}:scene={seed}")
        assert entries.shape == (3, 4)
        assert (entries[:, 2:] > 5).all()
        assert (entries[:, :2] >= 0).all()
        assert (entries[:, :2] + entries[:, 2:] <= (640, 480)).all()
        column = planned(person, PersonKnobs, scene=seed, start="empty").places[0, 60, 0]
        used.add("left" if column < 10 else "right" if column > 630 else "door")
    assert used == {"left", "right", "door"}
    assert nummiaro2003.entries(f"{STUDENTS}:scene=3:tree=2").shape == (2, 4)


@settings(max_examples=2, deadline=None)
@given(seed=SEEDS)
def test_who_is_present_from_the_start_walks_the_same_way_and_nothing_hides_him(seed):
    sequence, empty = (opened(PERSON, scene=seed, start=start) for start in ("present", "empty"))
    assert len(sequence) == 250
    assert sequence.present.all()
    assert (sequence.visibility > 0.95).all()
    assert not sequence.attributes["out_of_view"][10:].any()
    assert not sequence.attributes["shade"].any()
    lit = ~empty.attributes["shade"] & empty.present
    whole = int(np.argmax((empty.visibility >= 0.995) & lit))
    start = int(np.argmax((empty.boxes == sequence.boxes[0]).all(axis=1)))
    assert 60 < whole <= start < 120
    assert start < whole + 25  # out of the porch for good
    assert (sequence.boxes[:190] == empty.boxes[start : start + 190]).all()
    assert 1.2 < sequence.boxes[:, 3].max() / sequence.boxes[:, 3].min() < 2.3


@settings(max_examples=5, deadline=None)
@given(seed=SEEDS)
def test_nobody_walks_through_a_car_a_tree_or_another(seed):
    plan = planned(person, PersonKnobs, scene=seed, start="empty")
    there = [(who.course, 60 if i == 0 else 0) for i, who in enumerate(plan.people)]
    for car in (prop for prop in plan.posts if prop.z < person.DOORSTEP):
        for course, first in there:
            beside = np.abs(course.x - car.x) > 2.3
            apart = np.abs(course.z - car.z) > 1.0
            assert (beside | apart)[first:].all()
    for number, (course, first) in enumerate(there):
        for other, second in there[:number]:
            distance = np.hypot(course.x - other.x, course.z - other.z)
            assert distance[max(first, second) :].min() > 0.45
    plan = planned(students, StudentsKnobs, scene=seed)
    tree = plan.posts[0]
    for who in plan.people:
        assert np.hypot(who.course.x - tree.x, who.course.z - tree.z).min() > 0.9


@settings(max_examples=4, deadline=None)
@given(seed=SEEDS)
def test_the_others_wear_other_colours_than_the_target(seed):
    target, *others = (who.look for who in students._plan(seed, 1).people)
    assert len(others) == 7
    worn = [target.shirt, target.trousers]
    for other in others:
        for garment in (other.shirt, other.trousers, *([other.bag] if other.bag else [])):
            assert min(np.abs(np.subtract(garment, one)).max() for one in worn) > 25


@pytest.fixture(scope="module", params=[f"{PERSON}:start=empty", STUDENTS])
def visit(request):
    return datasets.load(request.param)


def test_without_the_target_all_is_the_same_but_where_he_is(visit):
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


def test_a_target_is_absent_as_soon_as_his_box_is_out_of_the_picture():
    way = straight(240, 120, (0.0, 8.0), (1.3, 0.0), 0.0)
    someone = Person(Look((0, 0, 90), (90, 0, 0)), 0, 1.75, way)
    views = fixed(np.random.default_rng(0), 240)
    passing = VisitPlan(0, views, [someone], slice(10, None))
    x, _, width, _ = body_boxes(*passing.places[0].T).T
    ((first, frames),) = spells(passing.present)
    assert first > 20
    assert first + frames < 220
    assert x[first] + width[first] > 0 >= x[first - 1] + width[first - 1]
    assert x[first + frames - 1] < 640 <= x[first + frames]


def test_masks_agree_with_boxes_and_visibility(visit):
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


def test_attributes_are_those_of_the_target_that_is_there(visit):
    assert not any(flags[~visit.present].any() for flags in visit.attributes.values())
    occluded = visit.present & (visit.visibility < 0.9)
    assert (visit.attributes["occlusion"] == occluded).all()
    size = visit.boxes[:, 3] / visit.boxes[visit.first_frame, 3]
    assert (visit.attributes["scale_change"] == ((size < 0.8) | (size > 1.25))).all()
