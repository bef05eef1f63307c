"""What is said of a run, from errors that are known."""

from types import SimpleNamespace

import numpy as np
import pytest

from bench.papers.wang2010.courses import CUP, HAND, TABLE_TENNIS, course_of, tolerance_of

SIDE = 12.0  # pixels: a tolerance of 6


def course(sequence, errors, **details):
    """Of a run whose centre is so far right of the truth's, frame by frame."""
    errors = np.asarray(errors, float)
    boxes = np.tile([10.0, 20.0, SIDE, SIDE], (len(errors), 1))
    estimate = boxes.copy()
    estimate[:, 0] += errors
    truth = SimpleNamespace(boxes=boxes, visibility=np.ones(len(errors)))
    return course_of(SimpleNamespace(boxes=estimate, details=details), truth, sequence)


def far(n_frames, *frames):
    """Errors of 20 pixels in these frames of the paper, of 1 in others."""
    errors = np.ones(n_frames)
    errors[np.array(frames, int) - 1] = 20.0
    return errors


def test_the_tolerance_is_half_the_mean_side_where_the_target_is_there():
    boxes = np.array([[0, 0, 10.0, 20.0], [0, 0, np.nan, np.nan], [0, 0, 30.0, 20.0]])
    assert tolerance_of(SimpleNamespace(boxes=boxes)) == 10.0


def test_an_error_of_the_tolerance_is_within_it():
    assert course("other", np.full(20, 6.0))["success"] == 1.0
    assert course("other", np.full(20, 6.001))["success"] == 0.0


@pytest.mark.parametrize(
    ("frames", "success"),
    [((1, 2, 3, 4, 5), 1.0), ((1, 2, 3, 4, 5, 6), 0.0), ((41,), 0.0), ((40,), 1.0)],
)
def test_success_is_nine_tenths_of_the_frames_and_all_of_the_last_ten(frames, success):
    found = course(TABLE_TENNIS, far(50, *frames))
    assert found["success"] == success
    assert found["tolerated"] == pytest.approx(1 - len(frames) / 50)


def test_stretches_are_counted_from_one_and_have_their_last_frame():
    found = course(TABLE_TENNIS, np.arange(50.0))
    assert found["centre_error_1_to_11"] == 5.0
    assert found["centre_error_12_to_16"] == 13.0
    assert found["centre_error_1_to_50"] == 24.5
    assert found["error_at_16"] == 15.0
    assert (found["tolerated_at_10"], course(TABLE_TENNIS, np.zeros(50))["tolerated_at_10"]) == (
        0.0,
        1.0,
    )


@pytest.mark.parametrize(
    ("frames", "tolerated", "deviates", "back", "wrong"),
    [
        ((), 1, 0, np.nan, 0),
        ((11, 17), 1, 0, np.nan, 0),
        ((12,), 0, 1, 1, 0),
        ((15,), 0, 1, 1, 0),
        ((15, 16), 0, 1, 0, 1),
        ((16,), 0, 0, np.nan, 0),
    ],
)
def test_what_becomes_of_the_ball_at_the_speed_up(frames, tolerated, deviates, back, wrong):
    found = course(TABLE_TENNIS, far(50, *frames))
    assert found["tolerated_12_to_16"] == tolerated
    assert found["deviates_12_to_15"] == deviates
    assert found["back_at_16"] == pytest.approx(back, nan_ok=True)
    assert found["still_wrong_at_16"] == wrong


def test_what_becomes_of_the_hand_and_of_the_cup():
    hand = course(HAND, far(100, 58, 100))
    assert (hand["tolerated_at_10_and_38"], hand["lost_at_58_and_100"]) == (1.0, 1.0)
    assert course(HAND, far(100, 38, 58))["tolerated_at_10_and_38"] == 0.0
    assert course(HAND, far(100, 38, 58))["lost_at_58_and_100"] == 0.0
    assert hand["on_the_face_at_58"] == 0.0
    cup = course(CUP, far(80, 18, 36, 44, 51))
    assert (cup["tolerated_1_to_17"], cup["lost_at_36_and_44_and_51"]) == (1.0, 1.0)
    assert course(CUP, far(80, 17, 36, 51))["tolerated_1_to_17"] == 0.0
    assert course(CUP, far(80, 36, 51))["lost_at_36_and_44_and_51"] == 0.0


@pytest.mark.parametrize(("off", "there"), [(6.0, 1.0), (6.1, 0.0)])
def test_the_face_is_where_the_hand_was_centred_on_it(off, there):
    boxes = np.tile([10.0, 20.0, SIDE, SIDE], (100, 1))
    boxes[:, 0] += np.arange(100)
    estimate = boxes.copy()
    estimate[57] = boxes[48] + [off, 0, 0, 0]
    truth = SimpleNamespace(boxes=boxes, visibility=np.ones(100))
    found = course_of(SimpleNamespace(boxes=estimate, details={}), truth, HAND)
    assert found["on_the_face_at_58"] == there
    assert found["tolerated_at_58"] == 1.0 - there or off < 6.1


@pytest.mark.parametrize(
    ("frames", "stayed"),
    [
        ((), np.nan),
        (range(10, 14), np.nan),  # four frames are no loss
        (range(10, 15), 0.0),
        (range(10, 51), 1.0),
        ([*range(10, 20), *range(24, 51)], 1.0),  # four frames are no return
        ([*range(10, 20), *range(25, 51)], 0.0),
        (range(42, 51), np.nan),  # too late to tell
        (range(41, 51), 1.0),
    ],
)
def test_lost_is_five_frames_in_a_row_and_back_likewise(frames, stayed):
    found = course(TABLE_TENNIS, far(50, *frames))["stayed_lost"]
    assert found == pytest.approx(stayed, nan_ok=True)


def test_details_are_means_over_the_frames_that_have_them():
    sizes = np.array([np.nan, 0.9, 0.5, 0.7])
    found = course("other", np.ones(4), effective_sample_size=sizes)
    assert found["effective_sample_size"] == pytest.approx(0.7)
    assert found["least_sample_size"] == 0.5
    assert np.isnan(found["spread"])
