"""Interpolation of ground truth between marked boxes."""

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
def test_uniform_motion_is_interpolated_exactly(start, change, keys):
    frames = np.arange(60)[:, np.newaxis]
    motion = np.array(start) + frames * np.array(change)
    truth = interpolate({frame: motion[frame] for frame in keys}, 60)
    inside = slice(min(keys), max(keys) + 1)
    np.testing.assert_allclose(truth.boxes[inside], motion[inside], atol=1e-9)
    assert np.isnan(truth.boxes[: min(keys)]).all()
    assert np.isnan(truth.boxes[max(keys) + 1 :]).all()


def test_marked_boxes_are_kept_exactly():
    keys = {7: [0.1, 0.2, 0.3, 0.4], 2: BOX}
    truth = interpolate(keys, 10)
    assert truth.boxes[[2, 7]].tolist() == [BOX, keys[7]]
    assert interpolate({2: BOX}, 4).sources == ("", "", "marked", "")


def test_absent_frames_do_not_change_the_interpolation():
    keys = {0: BOX, 10: [20, 30, 40, 50]}
    expected = interpolate(keys, 11).boxes.copy()
    expected[[3, 4, 5, 9]] = np.nan
    truth = interpolate(keys, 11, absent=[(3, 5), (9, 9)])
    np.testing.assert_array_equal(truth.boxes, expected)
    between = ["interpolated"] * 2
    assert truth.sources == ("marked", *between, "", "", "", *between, "interpolated", "", "marked")


@pytest.mark.parametrize(
    ("keys", "absent", "message"),
    [
        ({}, [], "no key frames"),
        ({10: BOX}, [], "frame 10 is outside the sequence. Expected: 0 to 9"),
        ({-1: BOX}, [], "frame -1 is outside"),
        ({0: [1, 2, 0, 4]}, [], r"frame 0: invalid box \[1.0, 2.0, 0.0, 4.0\]"),
        ({0: [1, 2, float("nan"), 4]}, [], "frame 0: invalid box"),
        ({0: BOX}, [(3, 12)], "frame 12 is outside"),
        ({0: BOX}, [(5, 3)], "absent 5-3: the interval ends before it starts"),
        ({0: BOX, 4: BOX}, [(3, 5)], "frame 4 has a box, but is inside absent 3-5"),
    ],
)
def test_invalid_input_is_refused(keys, absent, message):
    with pytest.raises(SequenceError, match=message):
        interpolate(keys, 10, absent)
