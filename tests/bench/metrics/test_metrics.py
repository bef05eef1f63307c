"""Native metrics against closed forms, pixel counting and properties."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.bench.metrics.artificial_runs import truth_of
from trackmark.bench.metrics.boxes import (
    centre_error,
    centre_inside,
    centres,
    is_well_formed,
    overlap,
)
from trackmark.bench.metrics.interface import RunEstimates
from trackmark.bench.metrics.sets.native import LOSS_FRAMES, first_loss, score_run

numbers = st.floats(-200, 200, allow_nan=False)
sizes = st.floats(0.01, 100)
boxes = st.tuples(numbers, numbers, sizes, sizes).map(np.array)
pixel_boxes = st.tuples(*[st.integers(0, 12)] * 2, *[st.integers(1, 12)] * 2)


def native(truth, estimate, visible=None):
    return score_run(truth, RunEstimates(estimate, visible)).scores


def line(n, box=(10.0, 10.0, 20.0, 10.0)):
    return np.tile(box, (n, 1))


@given(pixel_boxes, pixel_boxes)
def test_overlap_of_whole_pixel_boxes_equals_pixel_count(a, b):
    masks = np.zeros((2, 30, 30), bool)
    for mask, (x, y, w, h) in zip(masks, (a, b), strict=True):
        mask[y : y + h, x : x + w] = True
    expected = masks.all(axis=0).sum() / masks.any(axis=0).sum()
    assert overlap([a], [b])[0] == pytest.approx(expected, abs=1e-12)


@given(boxes, boxes, numbers, numbers)
def test_overlap_is_symmetric_bounded_and_invariant_to_moves(a, b, dx, dy):
    value, move = overlap([a], [b])[0], [dx, dy, 0, 0]
    assert overlap([a], [a])[0] == 1.0
    assert overlap([b], [a])[0] == value
    assert 0.0 <= value <= 1.0
    assert overlap([a + move], [b + move])[0] == pytest.approx(value, abs=1e-6)


ODD = st.sampled_from([0.0, 1.0, -3.0, 5.0, np.nan, np.inf, -np.inf, 1e308, -1e308, 5e-324])


@given(st.tuples(ODD, ODD, ODD, ODD), boxes)
def test_malformed_estimate_is_a_miss(odd, target):
    value = overlap([target], [odd])[0]
    assert 0.0 <= value <= 1.0
    if not is_well_formed(np.array([odd]))[0]:
        assert value == 0.0
        assert centre_error([target], [odd])[0] == np.inf
        assert not centre_inside([target], [odd])[0]


def test_absent_target_has_neither_overlap_nor_error():
    absent, box = [[np.nan] * 4], [[0, 0, 1, 1]]
    assert np.isnan([overlap(absent, box), centre_error(absent, box)]).all()
    assert np.isnan(centre_error(absent, absent)).all()
    assert not centre_inside(absent, box)[0]


def test_centre_error_and_centre_inside_closed_forms():
    np.testing.assert_array_equal(centres([[3, 7, 1, 1]]), [[3.5, 7.5]])
    assert centre_error([[0, 0, 10, 10]], [[3, 4, 10, 10]])[0] == 5.0
    assert centre_error([[0, 0, 10, 10]], [[0, 0, 16, 18]])[0] == 5.0
    far = centre_error([[0, 0, 10, 10]] * 2, [[1e99, 0, 10, 10], [1e101, 0, 10, 10]])
    assert far.tolist() == [1e99, np.inf]
    inside = centre_inside([[0, 0, 10, 20]] * 5, [[x, y, 2, 2] for x, y in EDGES])
    assert inside.tolist() == [True, False, False, True, False]


EDGES = [(-1, 4), (9, 4), (-1.1, 4), (4, -1), (4, 19)]
"""Points at the left edge, right edge, left of the box, top edge and bottom edge."""


def test_absent_frames_are_neither_hits_nor_misses():
    boxes, visible = line(12), np.ones(12, bool)
    boxes[[0, 1, 7, 8]] = np.nan
    visible[8] = False
    scores = native(truth_of(boxes), line(12), visible)
    assert scores["evaluated_frames"] == 7
    assert scores["mean_overlap"] == 1.0
    assert scores["absent_frames"] == 2  # those before initialisation do not count
    assert scores["absence_reported"] == 0.5


@pytest.mark.parametrize(("height", "frames"), [(5.0, 1), (4.999, 0)])
def test_overlap_of_exactly_one_half_is_a_success(height, frames):
    target = truth_of(line(2, (0.0, 0.0, 10.0, 10.0)))
    scores = native(target, np.array([[0, 0, 10, 10], [0, 0, 10, height]]))
    assert scores["success_frames"] == scores["success_rate"] == frames


def test_centre_error_statistics_equal_numpy():
    truth = line(6, (0.0, 0.0, 6.0, 8.0))
    estimate, errors = truth.copy(), [1, 2, 3, 4, 10]
    estimate[1:, 0] += errors
    scores = native(truth_of(truth), estimate)
    assert scores["centre_error"] == pytest.approx(np.mean(errors))
    assert scores["centre_error_median"] == pytest.approx(np.median(errors))
    assert scores["centre_error_p90"] == pytest.approx(np.quantile(errors, 0.9))
    assert scores["normalised_centre_error"] == pytest.approx(np.mean(errors) / 10)


def test_malformed_estimates_are_counted():
    estimate = line(11)
    estimate[3] = np.nan
    scores = native(truth_of(line(11)), estimate)
    assert (scores["malformed_boxes"], scores["centre_error"]) == (1, np.inf)
    assert scores["centre_error_median"] == 0.0
    assert scores["mean_overlap"] == pytest.approx(0.9)


def test_inside_frames_uses_region_full():
    body, full = line(5, (10.0, 10.0, 4.0, 4.0)), line(5, (0.0, 0.0, 30.0, 30.0))
    estimate = line(5, (20.0, 20.0, 4.0, 4.0))
    assert native(truth_of(body), estimate)["inside_frames"] == 0
    assert native(truth_of(body, regions={"full": full}), estimate)["inside_frames"] == 4


@given(st.data(), st.integers(1, 60))
def test_first_loss_equals_slow_definition(data, n):
    def rows(values):
        return np.array(data.draw(st.lists(st.sampled_from(values), min_size=n, max_size=n)))

    inside = rows([False] * 4 + [True])
    evaluated = rows([False, True]) | (np.arange(n) % 3 > 0)
    visibility = rows([0.0, 0.29, 0.3, 1.0, np.nan])
    counted = [i for i in range(n) if evaluated[i] and not visibility[i] < 0.3]
    windows = [counted[k : k + LOSS_FRAMES] for k in range(len(counted) - LOSS_FRAMES + 1)]
    expected = next((window[0] for window in windows if not inside[window].any()), n)
    assert first_loss(inside, evaluated, visibility) == expected


@pytest.mark.parametrize(
    ("outside", "hidden", "first"),
    [(range(20, 29), (), 40), (range(20, 30), (), 20), ([*range(20, 29), 32], (29, 30, 31), 20)],
    ids=["nine frames", "ten frames", "hidden frames between"],
)
def test_loss_needs_ten_visible_frames_outside(outside, hidden, first):
    estimate, visibility = line(40), np.ones(40)
    estimate[list(outside), 0] += 100
    visibility[list(hidden)] = 0.1
    assert native(truth_of(line(40), visibility=visibility), estimate)["first_loss"] == first
