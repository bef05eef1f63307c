"""The plain methods against definitions and painted images.

`tests/trackers/test_wang2010.py` compares them with the trackers.
"""

import colorsys
from math import sqrt

import numpy as np
import pytest

from trackmark.bench.papers.wang2010.plain_maps import (
    colour_bins,
    colour_map,
    make_template,
    mean_shift,
    motion_threshold,
    moving,
)

RED, DULL = (0, 0, 250), (90, 100, 95)  # BGR


def noise(seed=0):
    return np.random.default_rng(seed).integers(0, 256, (20, 24, 3), np.uint8)


def disc():
    """Return a red disc on a dull wall, and its box."""
    rows, columns = np.indices((60, 80)) + 0.5
    image = np.full((60, 80, 3), DULL, np.uint8)
    image[(columns - 30) ** 2 + (rows - 20) ** 2 <= 36] = RED
    return image, np.array([24.0, 14.0, 12.0, 12.0])


def test_bins_follow_hue_and_saturation():
    image = noise()
    bins = np.stack(colour_bins(image, 1000, 1000), axis=2) + 0.5
    expected = [colorsys.rgb_to_hsv(*pixel[::-1] / 255)[:2] for pixel in image.reshape(-1, 3)]
    np.testing.assert_allclose(bins.reshape(-1, 2) / 1000, expected, atol=0.00051)


@pytest.mark.parametrize(("maximum", "counts"), [(200, "dull"), (250, "both")])
def test_brighter_pixels_do_not_count(maximum, counts):
    image, box = disc()
    weights = colour_map(image, make_template(image, box, limits=(0.0, 0.0, maximum / 255)))
    assert np.array_equal(weights > 0, (image != RED).any(axis=2) | (counts == "both"))


def test_box_without_pixels_that_count_is_refused():
    image, box = disc()
    with pytest.raises(ValueError, match="no pixel is in the image and within the limits"):
        make_template(image, box, limits=(0.0, 251 / 255, 1.0))


def test_moving_pixels_exceed_mean_and_deviations():
    difference = np.array([[0, 0, 0, 8]])
    assert motion_threshold(difference, 1.5) == pytest.approx(2 + 1.5 * sqrt((3 * 4 + 36) / 4))
    assert moving(difference, 1.5).tolist() == [[False, False, False, True]]
    assert not moving(difference, 2).any()
    assert not moving(np.full((3, 4), 7)).any()  # 7 is not above 7


def test_centre_rounded_off_an_edge_has_the_window_of_the_edge():
    values = np.random.default_rng(0).random((19, 25))
    exact = mean_shift(values, 12.5, 9.0, 6, 5, max_iterations=1)
    for error in (1e-12, -1e-12):
        moved = mean_shift(values, 12.5 + error, 9.0 + error, 6, 5, max_iterations=1)
        assert moved == exact
    assert mean_shift(values, 12.5 - 1e-6, 9.0, 6, 5, max_iterations=1) != exact
