"""Kernel-weighted histograms of ellipses against loops in plain Python."""

from math import floor, sqrt

import cv2
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from trackers.base.sharing import SharedFrame
from trackers.histograms.bins import JointBins
from trackers.histograms.counting import ellipse_histograms
from trackers.histograms.ellipses import KERNELS, coefficients, ellipse_counts

HEIGHT, WIDTH, BINS = 25, 33, 11


def picture(seed, height=HEIGHT, width=WIDTH):
    return np.random.default_rng(seed).integers(0, 256, (height, width, 3)).astype(np.uint8)


def codes_of(seed):
    return np.random.default_rng(seed).integers(0, BINS, (HEIGHT, WIDTH)).astype(np.uint16)


def inside(row, column, ellipse):
    x, y, half_x, half_y = ellipse
    return ((column + 0.5 - x) / half_x) ** 2 + ((row + 0.5 - y) / half_y) ** 2 <= 1


def falls(ellipse, kernel):
    _, _, half_x, half_y = ellipse
    if kernel == "isotropic":
        return (1 / (half_x**2 + half_y**2),) * 2
    return (0, 0) if kernel == "uniform" else (1 / half_x**2, 1 / half_y**2)


def slow_counts(codes, ellipse, kernel, weight):
    """Weighted counts of all bins, and the pixels."""
    counts, pixels = [0] * BINS, 0
    for row, line in enumerate(codes):
        for column, code in enumerate(line):
            if inside(row, column, ellipse):
                counts[code] += weight(row, column, ellipse, kernel)
                pixels += 1
    return counts, pixels


def whole_weight(row, column, ellipse, kernel):
    x, y, *_ = ellipse
    fall_x, fall_y = (65536 * fall for fall in falls(ellipse, kernel))
    return 65536 - floor(fall_x * (column + 0.5 - x) ** 2) - floor(fall_y * (row + 0.5 - y) ** 2)


def exact_weight(row, column, ellipse, kernel):
    x, y, *_ = ellipse
    fall_x, fall_y = falls(ellipse, kernel)
    return 1 - fall_x * (column + 0.5 - x) ** 2 - fall_y * (row + 0.5 - y) ** 2


# In sixty-fourths of a pixel, so that no pixel's centre lies on a rim by rounding alone.
place = st.integers(-20 * 64, 50 * 64).map(lambda n: n / 64 + 0.003)
half_axis = st.integers(3 * 64, 30 * 64).map(lambda n: n / 64 + 0.001)
some_ellipses = st.lists(st.tuples(place, place, half_axis, half_axis), min_size=1, max_size=4).map(
    np.array
)


@given(st.integers(0, 99), some_ellipses, st.sampled_from(KERNELS), st.booleans())
@example(0, np.array([[16.0, 12.0, 3.0, 3.0], [-300.0, 12.0, 3.0, 3.0]]), "epanechnikov", False)
def test_counts_are_those_of_a_loop_with_the_same_whole_weights(seed, ellipses, kernel, transposed):
    codes = codes_of(seed)
    laid = np.ascontiguousarray(codes.T) if transposed else codes
    found = ellipse_counts(laid, (0, 0), transposed, ellipses, kernel, np.arange(BINS), BINS)
    for i, ellipse in enumerate(ellipses):
        counts, pixels = slow_counts(codes, ellipse, kernel, whole_weight)
        # Products rounded in another order may move a weight by 1 of 65536.
        np.testing.assert_allclose(found.counts[i], counts, rtol=1e-9, atol=2 * pixels**0.5)
        assert found.pixels[i] == pixels
        assert found.totals[i] == found.counts[i].sum()
    assert (found.counts >= 0).all()


@pytest.mark.parametrize("kernel", KERNELS)
def test_coefficients_are_those_of_exact_weights(kernel):
    rng = np.random.default_rng(3)
    codes = codes_of(8)
    ellipses = np.column_stack(
        [rng.uniform(-2, WIDTH, 20), rng.uniform(0, HEIGHT, 20), rng.uniform(3, 14, (20, 2))]
    )
    found = ellipse_counts(codes, (0, 0), False, ellipses, kernel, np.arange(BINS), BINS)
    model = rng.dirichlet(np.ones(BINS))
    ours = coefficients(found.counts, found.totals, model[np.newaxis])
    for i, ellipse in enumerate(ellipses):
        counts, _ = slow_counts(codes, ellipse, kernel, exact_weight)
        total = sum(counts)
        expected = sum(sqrt(c / total * q) for c, q in zip(counts, model, strict=True))
        assert ours[i] == pytest.approx(expected, abs=1e-5)


def test_bins_that_are_not_asked_for_count_in_the_total_alone():
    codes, ellipses = codes_of(2), np.array([[12.0, 12.0, 9.0, 7.0]])
    every = ellipse_counts(codes, (0, 0), False, ellipses, "isotropic", np.arange(BINS), BINS)
    some = ellipse_counts(codes, (0, 0), False, ellipses, "isotropic", np.array([7, 3]), BINS)
    np.testing.assert_array_equal(some.counts, every.counts[:, [7, 3]])
    np.testing.assert_array_equal(some.totals, every.totals)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e300])
def test_ellipses_that_are_nowhere_count_nothing(value):
    ellipses = np.array([[value, 12.0, 5.0, 5.0], [12.0, value, 5.0, 5.0]])
    found = ellipse_counts(codes_of(0), (0, 0), False, ellipses, "uniform", np.arange(BINS), BINS)
    assert not found.totals.any()
    assert not coefficients(found.counts, found.totals, np.full((1, BINS), 1 / BINS)).any()


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("space", ["rgb", "hsv"])
def test_the_window_alone_and_the_shared_frame_give_the_same_bits(space, kernel):
    image, colours = picture(4, 60, 80), JointBins(space, 8)
    rng = np.random.default_rng(0)
    for high in (1.0, 2.5):
        sizes = rng.uniform(3, 12, (30, 1)) * [1.0, high]
        ellipses = np.hstack([rng.uniform(-10, 90, (30, 2)), sizes])
        bins = np.arange(colours.n_bins)
        alone = ellipse_histograms(SharedFrame(image), ellipses, kernel, colours, bins)
        shared = ellipse_histograms(SharedFrame(image, 99), ellipses, kernel, colours, bins)
        for one, other in zip(alone, shared, strict=True):
            np.testing.assert_array_equal(one, other)
        assert alone.totals.any()


@given(st.integers(0, 99), st.integers(1, 6))
def test_coefficients_of_equal_histograms_are_one_and_of_disjoint_ones_nought(seed, n):
    rng = np.random.default_rng(seed)
    counts = rng.integers(0, 10**9, (n, 7))
    counts[:, 0] += 1
    totals = counts.sum(axis=1)
    np.testing.assert_allclose(coefficients(counts, totals, counts / totals[:, np.newaxis]), 1.0)
    counts[:, 3] = 0
    only = np.zeros((1, 7))
    only[0, 3] = 1.0
    assert not coefficients(counts, counts.sum(axis=1), only).any()


@pytest.mark.parametrize("bins", [2, 5, 8, 16, 32])
def test_rgb_bins_divide_every_channel_evenly(bins):
    image = picture(0)
    blue, green, red = (image[..., i].astype(int) * bins // 256 for i in range(3))
    colours = JointBins("rgb", bins)
    np.testing.assert_array_equal(colours.codes(image), (red * bins + green) * bins + blue)
    np.testing.assert_array_equal(colours.codes(image, transposed=True), colours.codes(image).T)
    assert colours.n_bins == bins**3


@pytest.mark.parametrize("bins", [8, 16])
def test_hsv_has_half_as_many_bins_of_value(bins):
    image = picture(2)
    hue, saturation, value = np.moveaxis(cv2.cvtColor(image, cv2.COLOR_BGR2HSV).astype(int), 2, 0)
    half = bins // 2
    expected = (hue * bins // 180 * bins + saturation * bins // 256) * half + value * half // 256
    colours = JointBins("hsv", bins)
    np.testing.assert_array_equal(colours.codes(image), expected)
    np.testing.assert_array_equal(colours.codes(image, transposed=True), expected.T)
    assert colours.n_bins == bins * bins * half
