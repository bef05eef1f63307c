"""Kernel-weighted histograms of ellipses, compared with a slow reference."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from tests.trackers.references.ellipses import codes_of, histogram_of, pixels_of
from trackmark.trackers.histograms.bins import JointBins
from trackmark.trackers.histograms.ellipses import (
    KERNELS,
    bhattacharyya_coefficients,
    ellipse_counts,
)

HEIGHT, WIDTH, BINS = 25, 33, 11
EVERY = np.arange(BINS)


def picture(seed, height=HEIGHT, width=WIDTH):
    return np.random.default_rng(seed).integers(0, 256, (height, width, 3)).astype(np.uint8)


def codes(seed):
    return np.random.default_rng(seed).integers(0, BINS, (HEIGHT, WIDTH)).astype(np.uint16)


# Multiples of 1/64 pixel plus an offset: no pixel centre lies on a rim by rounding.
place = st.integers(-20 * 64, 50 * 64).map(lambda n: n / 64 + 0.003)
half_axis = st.integers(3 * 64, 30 * 64).map(lambda n: n / 64 + 0.001)
some_ellipses = st.lists(st.tuples(place, place, half_axis, half_axis), min_size=1, max_size=4).map(
    np.array
)


@given(st.integers(0, 99), some_ellipses, st.sampled_from(KERNELS), st.booleans())
@example(0, np.array([[16.0, 12.0, 3.0, 3.0], [-300.0, 12.0, 3.0, 3.0]]), "epanechnikov", False)
def test_ellipse_counts_are_sums_of_integer_weights(seed, ellipses, kernel, transposed):
    laid = np.ascontiguousarray(codes(seed).T) if transposed else codes(seed)
    actual = ellipse_counts(laid, (0, 0), transposed, ellipses, kernel, EVERY, BINS)
    for i, ellipse in enumerate(ellipses):
        inside, _, _, weights = pixels_of(codes(seed), ellipse, kernel)
        np.testing.assert_array_equal(actual.counts[i], np.bincount(inside, weights, BINS))
        assert actual.pixels[i] == len(inside)
        assert actual.totals[i] == actual.counts[i].sum()
    assert (actual.counts >= 0).all()


@pytest.mark.parametrize("kernel", KERNELS)
def test_coefficients_of_ellipses_are_close_to_exact_ones(kernel):
    rng = np.random.default_rng(3)
    ellipses = np.column_stack(
        [rng.uniform(-2, WIDTH, 20), rng.uniform(0, HEIGHT, 20), rng.uniform(3, 14, (20, 2))]
    )
    actual = ellipse_counts(codes(8), (0, 0), False, ellipses, kernel, EVERY, BINS)
    model = rng.dirichlet(np.ones(BINS))
    expected = [
        np.sqrt(histogram_of(codes(8), BINS, ellipse, kernel, whole=False) * model).sum()
        for ellipse in ellipses
    ]
    ours = bhattacharyya_coefficients(actual.counts, actual.totals, model[np.newaxis])
    np.testing.assert_allclose(ours, expected, atol=1e-5)


def test_ellipse_totals_include_bins_without_counts():
    ellipses = np.array([[12.0, 12.0, 9.0, 7.0]])
    every, some = (
        ellipse_counts(codes(2), (0, 0), False, ellipses, "isotropic", bins, BINS)
        for bins in (EVERY, np.array([7, 3]))
    )
    np.testing.assert_array_equal(some.counts, every.counts[:, [7, 3]])
    np.testing.assert_array_equal(some.totals, every.totals)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e300])
def test_ellipse_of_invalid_position_has_zero_counts(value):
    ellipses = np.array([[value, 12.0, 5.0, 5.0], [12.0, value, 5.0, 5.0]])
    actual = ellipse_counts(codes(0), (0, 0), False, ellipses, "uniform", EVERY, BINS)
    assert not actual.totals.any()
    assert not bhattacharyya_coefficients(
        actual.counts, actual.totals, np.full((1, BINS), 1 / BINS)
    ).any()


@pytest.mark.parametrize(
    ("space", "bins"), [("rgb", 2), ("rgb", 5), ("rgb", 32), ("hsv", 8), ("hsv", 16)]
)
def test_joint_bins_divide_channels_evenly(space, bins):
    colours = JointBins(space, bins)
    actual = colours.codes(picture(2))
    np.testing.assert_array_equal(actual, codes_of(picture(2), space, bins))
    np.testing.assert_array_equal(colours.codes(picture(2), transposed=True), actual.T)
    assert colours.n_bins == bins**3 / (1 if space == "rgb" else 2)
