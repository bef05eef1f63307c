"""Ground truth of the walking scenes: closed forms, silhouettes, visible parts."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.datasets.synthetic.scenes import SEEDS
from trackmark import datasets
from trackmark.datasets.synthetic.multipart.designs import DESIGNS
from trackmark.datasets.synthetic.multipart.scene import WalkingScene
from trackmark.datasets.synthetic.multipart.street_walk import multipart_plan
from trackmark.datasets.synthetic.render.prop import coverage_extents, visible_part


def overlap(box, other):
    """Return the area that two boxes share."""
    low = np.maximum(box[:2], other[:2])
    return np.prod(np.clip(np.minimum(box[:2] + box[2:], other[:2] + other[2:]) - low, 0, None))


@pytest.fixture(scope="module", params=["1", "2", "5", "8"])
def sequence(request):
    return datasets.load(f"multipart/{request.param}")


def test_lengths_and_sizes_equal_the_papers():
    summaries = [datasets.summary(f"multipart/{number}") for number in range(1, 9)]
    assert [summary.length for summary in summaries] == [788, 534, 1315, 1308, 300, 269, 377, 229]
    assert {summary.size for summary in summaries} == {(640, 480)}


def test_boxes_and_full_regions_have_body_proportions(sequence):
    x, y, height = sequence.frames.plan.places[0].T
    box = np.stack([x - 0.12 * height, y - height + 0.14 * height, 0.24 * height, 0.78 * height])
    full = np.stack([x - 0.13 * height, y - height, 0.26 * height, height])
    np.testing.assert_allclose(sequence.boxes, box.T, atol=1e-9)
    np.testing.assert_allclose(sequence.regions["full"], full.T, atol=1e-9)


def test_places_follow_the_pinhole_model(sequence):
    plan = sequence.frames.plan
    for frame in (0, len(plan) // 3, len(plan) - 1):
        camera = plan.views[frame]
        for person, place in zip(plan.people, plan.places[:, frame], strict=True):
            x, z = person.course.x[frame], person.course.z[frame]
            column = 320 + camera.shift_x + 700 * (x - camera.x) / z
            row = camera.horizon + camera.shift_y + 700 * camera.eye / z
            assert place == pytest.approx([column, row, 700 * person.stature / z], abs=1 / 64)


def test_tight_region_overlaps_the_full_region(sequence):
    tight, full = sequence.regions["tight"], sequence.regions["full"]
    assert np.abs(tight[:, 3] / full[:, 3] - 1).max() < 0.09
    shared = [overlap(a, b) for a, b in zip(tight, full, strict=True)]
    assert (np.array(shared) / np.prod(tight[:, 2:], axis=1)).min() > 0.4


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


def test_sequence_4_changes_size_by_a_third():
    sequence = datasets.load("multipart/4")
    assert sequence.attributes["scale_change"].any()
    assert np.ptp(np.log(sequence.boxes[:, 3])) > np.log(1.3)


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


coverages = st.builds(
    lambda left, top, height, width, seed: (
        left,
        top,
        np.random.default_rng(seed).integers(0, 256, (height, width), dtype=np.uint8),
    ),
    st.integers(-20, 650),
    st.integers(-20, 490),
    st.integers(1, 30),
    st.integers(1, 30),
    st.integers(0, 99),
)


@settings(max_examples=80, deadline=None)
@given(target=coverages, others=st.lists(coverages, max_size=3))
def test_visible_part_agrees_with_slow_reference(target, others):
    def whole(coverage):
        picture = np.zeros((600, 800))
        left, top, alpha = coverage
        picture[50 + top : 50 + top + len(alpha), 50 + left : 50 + left + alpha.shape[1]] = alpha
        return picture[50:530, 50:690]

    expected = whole(target)
    for other in others:
        expected = expected * (1 - whole(other) / 255)
    left, top, seen = visible_part(target, others)
    result = np.zeros((480, 640))
    result[top : top + len(seen), left : left + seen.shape[1]] = seen
    assert np.abs(result - expected).max() <= 0.5 * len(others) + 1e-9


def test_coverage_extents_use_a_threshold_of_one_half():
    alpha = np.zeros((9, 12), np.uint8)
    alpha[2:7, 3:11] = 127
    alpha[3:6, 4:9] = 128
    assert coverage_extents((-4, 100, alpha)).tolist() == [0, 103, 5, 3]


@settings(max_examples=4, deadline=None)
@given(seed=SEEDS, number=st.sampled_from("5678"))
def test_fixed_scenes_have_short_occlusions_and_clear_start(seed, number):
    plan = multipart_plan(number, seed)
    boxes, seen = plan.measured
    assert boxes.shape == (len(plan), 4)
    assert (seen[:10] > 0.85).all()
    assert seen.min() < 0.7
    hidden = np.diff(np.flatnonzero(np.diff(seen < 0.3, prepend=False, append=False)))[::2]
    assert (hidden < 8).all()  # a person passes, which takes no longer
    assert (seen < 0.9).mean() < 0.4


def test_background_of_followed_target_changes_rapidly():
    scene = WalkingScene(multipart_plan("1", 0), "even")
    first, second = (scene.render(frame)[100:220].astype(int) for frame in (300, 340))
    assert np.abs(first - second).mean() > 12
