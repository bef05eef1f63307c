"""Cells of a colour grid against NumPy's unique rows, and counts against masks."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trackers.contours.cells import cells_inside, colour_cells


def picture(seed, rows=13, columns=17):
    """Of several colours, so that cells have many pixels, and extreme ones."""
    rng = np.random.default_rng(seed)
    image = rng.integers(0, 256, (rows, columns, 3), dtype=np.uint8)
    image[: rows // 2] = image[: rows // 2] // 64 * 85
    return image


@pytest.mark.parametrize("levels", [1, 2, 16, 20, 64])
def test_cells_are_the_unique_rows_of_the_grid_and_have_their_pixels_mean(levels):
    image = picture(levels)
    rgb = image[..., ::-1].reshape(-1, 3).astype(int)
    _, numbers, sizes = np.unique(
        rgb * levels // 256, axis=0, return_inverse=True, return_counts=True
    )
    cells = colour_cells(image, levels)
    np.testing.assert_array_equal(cells.image, numbers.reshape(13, 17))
    np.testing.assert_array_equal(cells.sizes, sizes)
    means = [rgb[numbers == cell].mean(axis=0) / 255 for cell in range(len(sizes))]
    np.testing.assert_allclose(cells.colours, means, rtol=1e-14)
    assert (cells.image.dtype, cells.sizes.dtype, cells.colours.dtype) == (
        np.int32,
        np.int64,
        np.float64,
    )


def test_a_large_picture_of_one_colour_has_exactly_that_colour():
    image = np.full((480, 640, 3), (10, 200, 255), np.uint8)
    cells = colour_cells(image)
    np.testing.assert_array_equal(cells.colours, [[255 / 255, 200 / 255, 10 / 255]])
    assert cells.sizes.tolist() == [480 * 640]
    assert not cells.image.any()


edge = st.integers(-5, 25)


@given(st.integers(0, 50), edge, edge, edge, edge)
def test_counts_inside_a_rectangle_are_those_of_its_mask(seed, x0, y0, x1, y1):
    cells = colour_cells(picture(seed), 5)
    rows, columns = np.mgrid[:13, :17]
    mask = (columns >= x0) & (columns < x1) & (rows >= y0) & (rows < y1)
    expected = np.bincount(cells.image[mask], minlength=len(cells.sizes))
    np.testing.assert_array_equal(cells_inside(cells, x0, y0, x1, y1), expected)
