"""From boxes marked in some frames to the truth of all."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trackmark.datasets import SequenceError
from trackmark.datasets.annotation import interpolate

BOX = [10.0, 20.0, 30.0, 40.0]


@given(
    start=st.lists(st.floats(1, 500), min_size=4, max_size=4),
    change=st.lists(st.floats(-0.01, 5), min_size=4, max_size=4),
    keys=st.sets(st.integers(0, 59), min_size=2),
)
def test_uniform_motion_is_met_exactly_between_the_key_frames(start, change, keys):
    frames = np.arange(60)[:, np.newaxis]
    motion = np.array(start) + frames * np.array(change)
    truth = interpolate({frame: motion[frame] for frame in keys}, 60)
    inside = slice(min(keys), max(keys) + 1)
    np.testing.assert_allclose(truth.boxes[inside], motion[inside], atol=1e-9)
    assert np.isnan(truth.boxes[: min(keys)]).all()
    assert np.isnan(truth.boxes[max(keys) + 1 :]).all()


def test_a_box_in_the_middle_is_the_mean_of_its_neighbours():
    truth = interpolate({0: BOX, 4: [20, 20, 50, 40], 5: [20, 20, 50, 40]}, 6)
    assert truth.boxes[2].tolist() == [15, 20, 40, 40]
    assert truth.boxes[1].tolist() == [12.5, 20, 35, 40]


def test_marked_boxes_are_kept_as_they_are_whatever_their_order():
    keys = {7: [0.1, 0.2, 0.3, 0.4], 2: BOX}
    truth = interpolate(keys, 10)
    assert truth.boxes[7].tolist() == keys[7]
    assert truth.boxes[2].tolist() == BOX


def test_absent_frames_are_empty_and_do_not_bend_the_interpolation():
    keys = {0: BOX, 10: [20, 30, 40, 50]}
    without = interpolate(keys, 11)
    truth = interpolate(keys, 11, absent=[(3, 5), (9, 9)])
    gone = [3, 4, 5, 9]
    assert np.isnan(truth.boxes[gone]).all()
    seen = [0, 1, 2, 6, 7, 8, 10]
    np.testing.assert_array_equal(truth.boxes[seen], without.boxes[seen])


def test_sources_tell_marked_interpolated_and_empty_apart():
    truth = interpolate({1: BOX, 4: BOX}, 6, absent=[(3, 3)])
    assert truth.sources == ("", "marked", "interpolated", "", "marked", "")


def test_one_key_frame_is_one_box():
    truth = interpolate({2: BOX}, 4)
    assert np.isfinite(truth.boxes).all(axis=1).tolist() == [False, False, True, False]


@pytest.mark.parametrize(
    ("keys", "absent", "message"),
    [
        ({}, [], "no key frames"),
        ({10: BOX}, [], "frame 10 is outside the sequence: 0 to 9"),
        ({-1: BOX}, [], "frame -1 is outside"),
        ({0: [1, 2, 0, 4]}, [], r"frame 0: \[1.0, 2.0, 0.0, 4.0\] is not a box"),
        ({0: [1, 2, float("nan"), 4]}, [], "frame 0: .* is not a box"),
        ({0: BOX}, [(3, 12)], "frame 12 is outside"),
        ({0: BOX}, [(5, 3)], "absent 5-3: the stretch ends before it begins"),
        ({0: BOX, 4: BOX}, [(3, 5)], "frame 4 has a box, but is within absent 3-5"),
    ],
)
def test_what_cannot_be_is_refused_by_name(keys, absent, message):
    with pytest.raises(SequenceError, match=message):
        interpolate(keys, 10, absent)
