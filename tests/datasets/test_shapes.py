"""Ground-truth polygons and masks."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from trackmark.datasets.shapes import EncodedMask, Shapes

POLYGON = np.array([[1.5, 2], [9, 2], [9, 8]])


def runs_of(mask):
    """Return the lengths of alternating runs outside and inside, row by row."""
    runs, inside = [0], False
    for pixel in mask.ravel().tolist():
        if pixel != inside:
            runs.append(0)
            inside = pixel
        runs[-1] += 1
    return np.array(runs)


@given(arrays(bool, st.tuples(st.integers(1, 6), st.integers(1, 7))), st.integers(0, 3))
def test_mask_is_decoded_from_its_runs(part, shift):
    height, width = part.shape
    encoded = EncodedMask(shift, 2 * shift, width, height, runs_of(part))
    np.testing.assert_array_equal(encoded.pixels(), part)
    mask = encoded.decode((12, 13))
    assert mask.shape == (13, 12)
    assert mask.sum() == part.sum()
    rows, columns = np.nonzero(mask)
    if len(rows):
        size = np.ptp(columns) + 1, np.ptp(rows) + 1
        assert encoded.box() == [columns.min(), rows.min(), *size]
    else:
        assert np.isnan(encoded.box()).all()


@pytest.mark.parametrize("runs", [[3], [5, 2], [4, -1, 3]])
def test_runs_of_another_length_are_refused(runs):
    with pytest.raises(ValueError, match=r"pixels\. Expected: 2x3"):
        EncodedMask(0, 0, 2, 3, np.array(runs))


def test_shapes_belong_to_the_selected_frames():
    mask = EncodedMask(1, 0, 2, 1, np.array([1, 1]))
    shapes = Shapes({0: POLYGON, 2: mask}, range(4), (3, 2))
    assert len(shapes) == 4
    kinds = [None if shape is None else shape.dtype for shape in shapes]
    assert kinds == [np.float64, None, np.bool_, None]
    assert shapes[2].tolist() == [[False, False, True], [False, False, False]]
    assert [shape is None for shape in shapes[::-1]] == [True, False, True, False]
    assert shapes[1:][1:].as_stored() == [mask, None]
    assert shapes[1:-1][1].shape == (2, 3)
