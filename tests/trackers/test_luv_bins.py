"""Luv bins against OpenCV's conversion and the ranges written out in fractions."""

from fractions import Fraction
from itertools import product
from math import floor, hypot

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trackers.histograms.bins import LuvBins

RANGES = {
    "full": None,  # bytes themselves
    "natural": ((-60, 120), (-80, 80)),
    "srgb-gamut": ((-83, 175), (-134, 107)),
}
SCHEMES = [LuvBins(*reading) for reading in product(["both", "perez"], RANGES)]


def slow_votes(luv, binning, uv_range):
    """Bins that one pixel votes in, from OpenCV's three bytes."""
    lightness, u, v = (int(value) for value in luv)
    if uv_range == "full":
        u_bin, v_bin = u * 10 // 256, v * 10 // 256
    else:
        exact = Fraction(354 * u, 255) - 134, Fraction(262 * v, 255) - 140
        u_bin, v_bin = (
            min(max(floor(10 * (value - low) / (high - low)), 0), 9)
            for value, (low, high) in zip(exact, RANGES[uv_range], strict=True)
        )
    chromaticity, grey = u_bin * 10 + v_bin, 100 + lightness * 10 // 256
    if binning == "both":
        return [chromaticity, grey]
    coloured = hypot(u * 354 / 255 - 134, v * 262 / 255 - 140) >= 17.9
    return [chromaticity if coloured else grey]


def picture(seed, height=19, width=53):
    """Half of it anything, half of it nearly grey."""
    rng = np.random.default_rng(seed)
    image = rng.integers(0, 256, (height, width, 3), dtype=np.uint8)
    image[: height // 2] = np.clip(
        image[: height // 2, :, :1] + image[: height // 2] % 48.0, 0, 255
    )
    return image


@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
def test_votes_are_those_of_opencvs_bytes(scheme):
    image = picture(0)
    luv = cv2.cvtColor(image, cv2.COLOR_BGR2LUV)
    votes = scheme.votes[scheme.codes(image)]
    assert votes.shape[2] == scheme.votes_a_pixel
    for row, column in np.ndindex(luv.shape[:2]):
        expected = slow_votes(luv[row, column], scheme.binning, scheme.uv_range)
        assert votes[row, column].tolist() == expected, luv[row, column]


def test_perez_takes_greys_for_greys_and_colours_for_colours():
    image = np.array([[(0, 0, 0), (128, 128, 128), (255, 255, 255), (20, 20, 230)]], np.uint8)
    scheme = LuvBins("perez")
    votes = scheme.votes[scheme.codes(image)][0, :, 0].tolist()
    assert votes[:3] == [100, 105, 109]
    assert votes[3] < 100


@given(st.integers(0, 99), st.integers(0, 18), st.integers(0, 22), st.integers(1, 23))
def test_a_window_has_the_bytes_and_the_codes_of_the_whole_image(seed, top, left, size):
    image = picture(seed)
    window = np.s_[top : top + size, left : left + size]
    luv = cv2.cvtColor(image, cv2.COLOR_BGR2LUV)
    np.testing.assert_array_equal(cv2.cvtColor(image[window], cv2.COLOR_BGR2LUV), luv[window])
    scheme = LuvBins()
    np.testing.assert_array_equal(scheme.codes(image[window]), scheme.codes(image)[window])
