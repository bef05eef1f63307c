"""Walking scenes: ground truth, `stress/twin` and outlines of walkers."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.datasets.synthetic.scenes import SEEDS, slow_if_unchanged
from trackmark import datasets
from trackmark.datasets.interface import SequenceError
from trackmark.datasets.synthetic.multipart import casting, scene
from trackmark.datasets.synthetic.multipart.designs import DESIGNS
from trackmark.datasets.synthetic.multipart.walker import GaitPose, Walker, WalkerLook

pytestmark = slow_if_unchanged("multipart/1", "stress/twin")


@pytest.fixture(scope="module", params=["1", "2", "5", "8"])
def sequence(request):
    return datasets.load(f"multipart/{request.param}")


def test_lengths_and_sizes_equal_the_papers():
    summaries = [datasets.sequence_size(f"multipart/{number}") for number in range(1, 9)]
    assert [summary.length for summary in summaries] == [788, 534, 1315, 1308, 300, 269, 377, 229]
    assert {summary.size for summary in summaries} == {(640, 480)}


def test_boxes_and_full_regions_have_body_proportions(sequence):
    x, y, height = sequence.frames.plan.places[0].T
    box = np.stack([x - 0.12 * height, y - height + 0.14 * height, 0.24 * height, 0.78 * height])
    full = np.stack([x - 0.13 * height, y - height, 0.26 * height, height])
    np.testing.assert_allclose(sequence.boxes, box.T, atol=1e-9)
    np.testing.assert_allclose(sequence.regions["full"], full.T, atol=1e-9)


def test_positions_follow_the_pinhole_model(sequence):
    plan = sequence.frames.plan
    for frame in (0, len(plan) // 3, len(plan) - 1):
        camera = plan.views[frame]
        for person, place in zip(plan.people, plan.places[:, frame], strict=True):
            x, z = person.path.x[frame], person.path.z[frame]
            column = 320 + camera.shift_x + 700 * (x - camera.x) / z
            row = camera.horizon + camera.shift_y + 700 * camera.eye / z
            assert place == pytest.approx([column, row, 700 * person.stature / z], abs=1 / 64)


def test_walking_target_is_present_in_all_frames(sequence):
    assert sequence.present.all()
    assert (sequence.visibility[:20] > 0.95).all()
    assert (sequence.visibility[-10:] > 0.9).all()
    assert sequence.attributes["out_of_view"].mean() < 0.12
    following = DESIGNS[sequence.name[-1]].follows
    assert sequence.attributes["occlusion"].any() != following
    assert (sequence.visibility < 0.1).sum() < 30
    assert sequence.attributes["turning"].any()
    assert sequence.attributes["clutter"].any()
    assert not sequence.attributes["shade"].any()


@pytest.mark.parametrize(
    ("name", "least", "most"),
    [("multipart/5", 0.4, 0.9), ("multipart/7:scene=1", 0.4, 0.9)]
    + [("stress/pillar", 0.0, 0.25), ("stress/pillar:number=7:scene=1", 0.0, 0.25)],
)
def test_post_hides_a_part_and_pillar_most_of_the_target(name, least, most):
    sequence = datasets.load(name)
    plan = sequence.frames.plan
    (post,) = plan.posts
    column = plan.views.still.column(post.x, post.z)
    behind = np.abs(plan.places[0, :, 0] - column) < 3
    assert behind.any()
    assert (sequence.visibility[behind] >= least).all()
    assert (sequence.visibility[behind] < most).all()
    assert sequence.visibility[behind].size < 30


@pytest.mark.parametrize("number", ["1", "6"])
def test_variants_differ_only_in_clothes_of_overtaking_people(number):
    neutral, exchanged = (
        datasets.load(f"multipart/{number}:scene=100:others={kind}")
        for kind in ("neutral", "exchanged")
    )
    assert (neutral.boxes == exchanged.boxes).all()
    assert (neutral.visibility == exchanged.visibility).all()
    plans = neutral.frames.plan, exchanged.frames.plan
    assert (plans[0].places == plans[1].places).all()
    n_overtaking = DESIGNS[number].overtaking
    target = plans[0].people[0].look
    for k, (first, second) in enumerate(zip(*(plan.people for plan in plans), strict=True)):
        assert (first.look == second.look) == (k == 0 or k > n_overtaking)
    for person in plans[1].people[1 : 1 + n_overtaking]:
        look = person.look
        assert (look.shirt, look.trousers) == (target.trousers, target.jacket or target.shirt)
        assert (look.jacket, look.bag) == (None, None)


def test_neutral_clothes_do_not_depend_on_those_of_the_target(monkeypatch):
    def clothes():
        scene.multipart_plan.cache_clear()
        people = scene.multipart_plan("5", 100).people[1:]
        return [(person.look.shirt, person.look.trousers) for person in people]

    drawn = clothes()
    sample = casting.sample_two_coloured_clothes
    drawings = []

    def other_target(random):
        drawings.append(sample(random))  # the first one is for the target
        return ((1, 2, 3), (4, 5, 6)) if len(drawings) == 1 else drawings[-1]

    monkeypatch.setattr(casting, "sample_two_coloured_clothes", other_target)
    assert clothes() == drawn
    scene.multipart_plan.cache_clear()


def test_plain_targets_have_no_variant_of_others():
    with pytest.raises(SequenceError, match="unknown parameter 'others'"):
        datasets.load("multipart/3:others=exchanged")


def twin(**parameters):
    return datasets.load(":".join(["stress/twin", *(f"{k}={v}" for k, v in parameters.items())]))


@settings(max_examples=6, deadline=None)
@given(seed=SEEDS, distance=st.one_of(st.just(0), st.floats(0, 3).map(lambda d: round(d, 3))))
def test_twin_reaches_the_requested_distance(seed, distance):
    sequence = twin(scene=seed, distance=distance)
    target, second = sequence.frames.plan.places
    apart = np.abs(second[:, 0] - target[:, 0]) / sequence.boxes[:, 2]
    assert apart.min() == pytest.approx(distance, abs=0.01)
    assert apart.argmin() == pytest.approx(75, abs=4)
    assert (sequence.visibility[:20] == 1).all()
    assert (sequence.visibility[-20:] == 1).all()
    if distance == 0:  # the second person can be narrower
        assert sequence.visibility.min() < 0.4
    if distance >= 2:
        assert (sequence.visibility == 1).all()
    assert sequence.present.all()
    assert not sequence.attributes["out_of_view"].any()


@pytest.mark.parametrize("distance", [0, pytest.param(1.5, marks=pytest.mark.slow)])
def test_twin_variants_differ_only_in_clothes(distance):
    same, other = (twin(distance=distance, twin=kind, scene=1) for kind in ("same", "other"))
    assert (same.boxes == other.boxes).all()
    assert (same.visibility == other.visibility).all()
    assert all((same.regions[key] == other.regions[key]).all() for key in same.regions)
    plan = same.frames.plan
    for frame in (75, 110):
        changed = (same[frame] != other[frame]).any(axis=2)
        left, top, alpha = plan.coverage(1, frame)
        rows, columns = np.nonzero(changed)
        reach = 6  # extent of the blur
        assert (rows >= top - 2).all()
        assert (rows < top + len(alpha) + 2).all()
        assert (columns >= left - reach).all()
        assert (columns < left + alpha.shape[1] + reach).all()
    assert (same[75] != other[75]).any()


def test_twin_wears_the_same_or_clearly_other_clothes():
    same, other = (twin(twin=kind, scene=2).frames.plan for kind in ("same", "other"))
    target, double = (person.look for person in same.people)
    unlike = other.people[1].look
    assert (other.people[0].look, other.people[0].seed) == (target, same.people[0].seed)
    assert (double.shirt, double.trousers) == (target.shirt, target.trousers)
    for garment in (unlike.shirt, unlike.trousers):
        for worn in (target.shirt, target.trousers):
            assert np.abs(np.subtract(garment, worn)).max() > 25
    unchanged = ("hair", "skin", "shoes", "weave", "long_hair", "hem", "bulk", "loose", "bag")
    assert all(getattr(unlike, key) == getattr(double, key) for key in unchanged)


def test_twin_distance_changes_only_the_second_person():
    near, far = twin(distance=0), twin(distance=3)
    assert (near.boxes == far.boxes).all()
    assert near.frames.plan.people[0].look == far.frames.plan.people[0].look
    assert near.frames.plan.seed == far.frames.plan.seed


LOOK = WalkerLook(shirt=(40, 50, 170), trousers=(120, 70, 40), bag=(60, 160, 60))
WALKER = Walker(LOOK, 1)


@pytest.mark.parametrize("heading", np.linspace(-np.pi, np.pi, 5))
@pytest.mark.parametrize("phase", [0.0, 0.3, 0.7])
def test_head_and_feet_are_at_the_requested_rows(heading, phase):
    _, top, coverage = WALKER.coverage(160, 280, 240, GaitPose(phase, 1.0, heading))
    rows = top + np.flatnonzero((coverage > 127).any(axis=1))
    assert abs(rows[-1] + 1 - 280) <= 3
    assert -1 <= rows[0] - 40 <= 0.05 * 240  # a wide step lowers the head
    standing = WALKER.coverage(160, 280, 240, GaitPose(phase, 0.0, heading))
    assert abs(standing[1] + np.flatnonzero((standing[2] > 127).any(axis=1))[0] - 40) <= 2
