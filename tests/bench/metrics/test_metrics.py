"""The native metrics against closed forms, pixel counting and properties."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trackmark.bench.metrics.centre_error import centre_error, centre_inside, centres
from trackmark.bench.metrics.native import LOSS_FRAMES, first_loss, native
from trackmark.bench.metrics.overlap import overlap

numbers = st.floats(-200, 200, allow_nan=False)
sizes = st.floats(0.01, 100)
boxes = st.tuples(numbers, numbers, sizes, sizes).map(np.array)


def truth_of(boxes, visibility=None, **regions):
    boxes = np.asarray(boxes, float)
    unknown = np.full(len(boxes), np.nan)
    return SimpleNamespace(
        boxes=boxes,
        regions={key: np.asarray(value, float) for key, value in regions.items()},
        visibility=unknown if visibility is None else np.asarray(visibility, float),
    )


def line(n, box=(10.0, 10.0, 20.0, 10.0)):
    return np.tile(box, (n, 1))


@given(
    st.tuples(*[st.integers(0, 12)] * 2, *[st.integers(1, 12)] * 2),
    st.tuples(*[st.integers(0, 12)] * 2, *[st.integers(1, 12)] * 2),
)
def test_overlap_of_whole_pixel_boxes_is_what_counting_pixels_gives(a, b):
    def pixels(box):
        mask = np.zeros((30, 30), bool)
        x, y, w, h = box
        mask[y : y + h, x : x + w] = True
        return mask

    expected = (pixels(a) & pixels(b)).sum() / (pixels(a) | pixels(b)).sum()
    assert overlap([a], [b])[0] == pytest.approx(expected, abs=1e-12)


@given(boxes)
def test_a_box_overlaps_itself_by_exactly_one(box):
    assert overlap([box], [box])[0] == 1.0


@given(boxes, boxes)
def test_overlap_is_symmetric_and_between_zero_and_one(a, b):
    forth, back = overlap([a], [b])[0], overlap([b], [a])[0]
    assert forth == back
    assert 0.0 <= forth <= 1.0


@given(boxes, boxes, numbers, numbers)
def test_overlap_does_not_change_when_both_boxes_move(a, b, dx, dy):
    move = np.array([dx, dy, 0, 0])
    assert overlap([a], [b])[0] == pytest.approx(overlap([a + move], [b + move])[0], abs=1e-6)


@pytest.mark.parametrize("bad", [[np.nan, 0, 1, 1], [0, 0, np.inf, 1], [0, 0, 0, 5], [0, 0, 5, -1]])
def test_a_malformed_estimate_is_a_miss(bad):
    good = [[0, 0, 5, 5]]
    assert overlap(good, [bad])[0] == 0.0
    assert centre_error(good, [bad])[0] == np.inf
    assert not centre_inside(good, [bad])[0]


def test_an_absent_truth_has_neither_overlap_nor_error():
    absent = [[np.nan] * 4]
    assert np.isnan(overlap(absent, [[0, 0, 1, 1]])[0])
    assert np.isnan(centre_error(absent, [[0, 0, 1, 1]])[0])
    assert not centre_inside(absent, [[0, 0, 1, 1]])[0]


def test_the_centre_of_a_box_of_one_pixel_is_half_a_pixel_in():
    np.testing.assert_array_equal(centres([[3, 7, 1, 1]]), [[3.5, 7.5]])


def test_centre_error_is_pythagoras():
    assert centre_error([[0, 0, 10, 10]], [[3, 4, 10, 10]])[0] == 5.0


def test_the_left_edge_belongs_to_the_box_and_the_right_one_does_not():
    box = [[0.0, 0.0, 10.0, 10.0]]
    assert centre_inside(box, [[-1, 4, 2, 2]])[0]
    assert not centre_inside(box, [[9, 4, 2, 2]])[0]


def test_a_perfect_tracker_scores_one_on_every_frame_after_the_first():
    truth = truth_of(line(30))
    scores = native(truth, line(30))
    assert scores["mean_overlap"] == 1.0
    assert scores["success_frames"] == scores["frames_inside"] == scores["evaluated_frames"] == 29
    assert scores["first_loss"] == 30
    assert scores["centre_error"] == scores["centre_error_p90"] == 0.0


def test_the_given_first_box_counts_for_nothing():
    far = line(10)
    far[0] = [500, 500, 1, 1]
    assert native(truth_of(line(10)), far) == native(truth_of(line(10)), line(10))


def test_evaluation_begins_after_the_first_frame_in_which_the_target_is_present():
    truth = line(10)
    truth[:4] = np.nan
    assert native(truth_of(truth), line(10))["evaluated_frames"] == 5
    assert native(truth_of(truth), line(10))["absent_frames"] == 0


def test_absent_frames_are_neither_hits_nor_misses():
    truth = line(10)
    truth[5:7] = np.nan
    visible = np.ones(10, bool)
    visible[6] = False
    scores = native(truth_of(truth), line(10), visible)
    assert scores["evaluated_frames"] == 7
    assert scores["mean_overlap"] == 1.0
    assert scores["absent_frames"] == 2
    assert scores["absence_reported"] == 0.5


def test_an_overlap_of_exactly_one_half_is_a_success():
    truth = line(2, (0.0, 0.0, 10.0, 10.0))
    estimate = np.array([[0, 0, 10, 10], [0, 0, 10, 5.0]])
    assert native(truth_of(truth), estimate)["success_frames"] == 1
    estimate[1, 3] = 4.999
    assert native(truth_of(truth), estimate)["success_frames"] == 0


def test_mean_overlap_is_the_area_under_the_exact_success_curve():
    rng = np.random.default_rng(5)
    truth = line(200)
    estimate = truth + rng.normal(0, 4, truth.shape) * [1, 1, 0.2, 0.2]
    overlaps = overlap(truth[1:], estimate[1:])
    thresholds = np.linspace(0, 1, 100_001)
    curve = (overlaps[:, None] >= thresholds[::100]).mean(axis=0)
    area = np.trapezoid(curve, thresholds[::100])
    assert native(truth_of(truth), estimate)["mean_overlap"] == pytest.approx(area, abs=2e-3)


def test_centre_error_statistics_are_numpys_and_the_normalised_one_divides_by_the_diagonal():
    truth = line(6, (0.0, 0.0, 6.0, 8.0))
    estimate = truth.copy()
    estimate[1:, 0] += [1, 2, 3, 4, 10]
    scores = native(truth_of(truth), estimate)
    errors = [1, 2, 3, 4, 10]
    assert scores["centre_error"] == pytest.approx(np.mean(errors))
    assert scores["centre_error_median"] == pytest.approx(np.median(errors))
    assert scores["centre_error_p90"] == pytest.approx(np.quantile(errors, 0.9))
    assert scores["normalised_centre_error"] == pytest.approx(np.mean(errors) / 10)


def test_malformed_estimates_are_counted_and_make_the_mean_error_infinite():
    estimate = line(11)
    estimate[3] = np.nan
    scores = native(truth_of(line(11)), estimate)
    assert scores["malformed"] == 1
    assert scores["centre_error"] == np.inf
    assert scores["centre_error_median"] == 0.0
    assert scores["mean_overlap"] == pytest.approx(0.9)


def test_frames_inside_uses_the_full_region_where_there_is_one():
    body, full = line(5, (10.0, 10.0, 4.0, 4.0)), line(5, (0.0, 0.0, 30.0, 30.0))
    estimate = line(5, (20.0, 20.0, 4.0, 4.0))
    assert native(truth_of(body), estimate)["frames_inside"] == 0
    assert native(truth_of(body, full=full), estimate)["frames_inside"] == 4


def loss_by_definition(inside, evaluated, visibility):
    counted = [i for i in range(len(inside)) if evaluated[i] and not visibility[i] < 0.3]
    for start in range(len(counted) - LOSS_FRAMES + 1):
        if not any(inside[i] for i in counted[start : start + LOSS_FRAMES]):
            return counted[start]
    return len(inside)


@given(st.data(), st.integers(1, 60))
def test_first_loss_is_its_definition_frame_by_frame(data, n):
    flags = st.lists(st.booleans(), min_size=n, max_size=n)
    inside = np.array(
        data.draw(st.lists(st.sampled_from([0, 0, 0, 0, 1]), min_size=n, max_size=n)), bool
    )
    evaluated = np.array(data.draw(flags)) | (np.arange(n) % 3 > 0)
    visibility = np.array(
        data.draw(st.lists(st.sampled_from([0.0, 0.29, 0.3, 1.0, np.nan]), min_size=n, max_size=n))
    )
    assert first_loss(inside, evaluated, visibility) == loss_by_definition(
        inside, evaluated, visibility
    )


def test_nine_frames_outside_are_no_loss_and_ten_are():
    truth = line(40)
    estimate = line(40)
    estimate[20:29, 0] += 100
    assert native(truth_of(truth), estimate)["first_loss"] == 40
    estimate[29, 0] += 100
    assert native(truth_of(truth), estimate)["first_loss"] == 20


def test_hidden_frames_do_not_count_for_the_loss():
    estimate = line(40)
    estimate[20:29, 0] += 100
    estimate[32, 0] += 100
    visibility = np.ones(40)
    visibility[29:32] = 0.1
    assert native(truth_of(line(40), visibility), estimate)["first_loss"] == 20


def test_boxes_of_another_length_are_refused():
    with pytest.raises(ValueError, match=r"shape \(9, 4\), the truth \(10, 4\)"):
        native(truth_of(line(10)), line(9))


def test_a_sequence_without_truth_is_refused():
    with pytest.raises(ValueError, match="no truth"):
        native(truth_of(line(4) * np.nan), line(4))
