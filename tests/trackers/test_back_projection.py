"""The hue kernels against the paper's equations written out slowly."""

from fractions import Fraction
from math import floor

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from trackmark.trackers.base.sharing import SharedFrame
from trackmark.trackers.maps.back_projection import (
    HueBins,
    count_bins,
    hue_bin,
    lazy_hue_bins,
    mean_shift,
)

byte = st.integers(0, 255)
colour = st.tuples(byte, byte, byte)
bins = st.integers(1, 254)


def exact_hue(blue, green, red):
    """MATLAB's `rgb2hsv` hue in [0, 1), as a fraction; grey is 0."""
    largest, smallest = max(blue, green, red), min(blue, green, red)
    if largest == smallest:
        return Fraction(0)
    spread = largest - smallest
    if red == largest:
        hue = Fraction(green - blue, spread)
    elif green == largest:
        hue = 2 + Fraction(blue - red, spread)
    else:
        hue = 4 + Fraction(red - green, spread)
    return hue / 6 % 1


@given(colour, bins)
@example((0, 0, 255), 32)
@example((1, 0, 255), 32)  # just below red: the last bin
@example((255, 255, 0), 12)
def test_the_hue_bin_is_the_exact_fractions(bgr, n_bins):
    pixel = tuple(np.uint8(value) for value in bgr)  # as an image hands them over
    assert hue_bin(*pixel, n_bins) == floor(n_bins * exact_hue(*bgr))


# From here on images of few colours, small enough for loops in Python.


def picture(seed, height=17, width=23):
    return np.random.default_rng(seed).integers(0, 256, (height, width, 3), dtype=np.uint8)


def slow_bins(image, n_bins, minimum_saturation, minimum_value, maximum_value=1.0):
    bin_numbers = np.empty(image.shape[:2], int)
    for row, column in np.ndindex(bin_numbers.shape):
        bgr = [int(value) for value in image[row, column]]
        largest, spread = max(bgr), max(bgr) - min(bgr)
        saturation = spread / largest if largest else 0.0
        in_range = minimum_value <= largest / 255 <= maximum_value
        masked = saturation < minimum_saturation or not in_range
        bin_numbers[row, column] = n_bins if masked else floor(n_bins * exact_hue(*bgr))
    return bin_numbers


def slow_moments(weight_of_pixel, left, top, width, height):
    total = np.zeros(3)
    for row, column in np.ndindex(weight_of_pixel.shape):
        if left <= column < left + width and top <= row < top + height:
            total += weight_of_pixel[row, column] * np.array([1, column, row])
    return total


window = st.tuples(st.integers(-8, 25), st.integers(-8, 20), st.integers(1, 30), st.integers(1, 30))


@given(st.integers(0, 99), st.integers(1, 254), window, st.tuples(*[st.floats(0, 1)] * 3))
@example(0, 32, (-8, -8, 40, 40), (0.0, 0.0, 1.0))
def test_count_bins_ignores_masked_and_outside_pixels(seed, n_bins, window, limits):
    image = picture(seed)
    left, top, width, height = window
    expected = np.zeros(n_bins + 1, int)
    for (row, column), bin_number in np.ndenumerate(slow_bins(image, n_bins, *limits)):
        if left <= column < left + width and top <= row < top + height:
            expected[bin_number] += 1
    expected[n_bins] = 0  # masked ones weigh nothing
    np.testing.assert_array_equal(count_bins(hues_of(image, n_bins, *limits), *window), expected)


def hues_of(image, n_bins=32, *limits) -> HueBins:
    return SharedFrame(image).compute(lazy_hue_bins, n_bins, *(limits or (0.0, 0.0, 1.0)))


def test_only_visited_pixels_are_binned():
    hues = hues_of(picture(0))
    count_bins(hues, 3, 4, 5, 6)
    visited = hues.bins != 255
    assert visited[4:10, 3:8].all()
    assert visited.sum() == 30


def slow_mean_shift(projection, centre, size, stop_distance, max_iterations):
    """Section 4 of the specification, in its own coordinates: pixel centres at integers.

    In fractions: a window's edge may fall exactly between two pixels.
    """

    def sums(x, y):
        left = floor(x - Fraction(size[0] - 2, 2))
        top = floor(y - Fraction(size[1] - 2, 2))
        return slow_moments(projection, left, top, *size)

    x, y = (Fraction(value + 0.5) - Fraction(1, 2) for value in centre)  # as it is handed on
    n = 0
    while True:
        m00, m10, m01 = (int(value) for value in sums(x, y))
        n += 1
        if m00 == 0:
            break
        step = np.hypot(float(Fraction(m10, m00) - x), float(Fraction(m01, m00) - y))
        x, y = Fraction(m10, m00), Fraction(m01, m00)
        if step < stop_distance or n == max_iterations:
            break
    return float(x), float(y), n, sums(x, y)[0]


# Centres on a grid of 2^-10 pixels: adding half a pixel must not round them.
@given(
    st.integers(0, 999),
    st.tuples(*(st.integers(-5 << 10, most << 10).map(lambda n: n / 1024) for most in (28, 22))),
    st.tuples(st.integers(1, 14), st.integers(1, 14)),
    st.sampled_from([0.0, 0.1, 0.5, 2.0]),
    st.integers(1, 10),
)
@example(0, (500.0, 400.0), (5, 5), 2.0, 10)  # nothing there: it stays
@example(320, (23.0, 0.0), (4, 12), 0.0, 2)  # a step ends where an edge is between two pixels
def test_mean_shift_is_the_specifications(seed, centre, size, stop_distance, max_iterations):
    image = picture(seed)
    weights = np.append(np.random.default_rng(seed).integers(0, 900, 32), 0)
    projection = weights[slow_bins(image, 32, 0, 0)]
    expected = slow_mean_shift(projection, centre, size, stop_distance, max_iterations)
    x, y, n_iterations, total = mean_shift(
        hues_of(image),
        weights,
        centre[0] + 0.5,
        centre[1] + 0.5,
        *size,
        stop_distance,
        max_iterations,
    )
    assert (x - 0.5, y - 0.5) == pytest.approx(expected[:2], abs=1e-9)
    assert n_iterations == expected[2]
    assert total == expected[3]
