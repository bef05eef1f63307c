"""Histograms of rectangles and ellipses, compared with NumPy."""

from math import floor, sqrt

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from tests.trackers.references.ellipses import pixels_of
from trackmark.trackers.base.sharing import SharedFrame
from trackmark.trackers.histograms import counting
from trackmark.trackers.histograms.bins import N_BINS, LuvBins
from trackmark.trackers.histograms.counting import count_regions
from trackmark.trackers.histograms.ellipses import (
    KERNELS,
    bhattacharyya_coefficients,
    ellipse_counts,
)
from trackmark.trackers.histograms.rectangles import (
    direct_counts,
    integral_counts,
    integral_histogram,
    pixel_regions,
)

HEIGHT, WIDTH, N_CODES, BINS = 21, 27, 40, 13


def votes(n_votes):
    return np.random.default_rng(5).integers(0, BINS, (N_CODES, n_votes), dtype=np.uint8)


def codes(seed):
    return np.random.default_rng(seed).integers(0, N_CODES, (HEIGHT, WIDTH)).astype(np.uint16)


def numpy_counts(codes, votes, regions, bins):
    actual = np.empty((len(regions), len(bins)), int)
    for i, (left, top, right, bottom) in enumerate(regions):
        voted = votes[codes[top:bottom, left:right]].ravel()
        actual[i] = np.bincount(voted, minlength=BINS)[bins]
    return actual


@st.composite
def region(draw):
    left, top = draw(st.integers(0, WIDTH)), draw(st.integers(0, HEIGHT))
    return left, top, draw(st.integers(left, WIDTH)), draw(st.integers(top, HEIGHT))


some_regions = st.lists(region(), min_size=1, max_size=6).map(np.array)
some_bins = st.sets(st.integers(0, BINS - 1)).map(sorted).map(lambda b: np.array(b, int))


@given(st.integers(0, 99), st.sampled_from([1, 2, 3]), some_regions, some_bins)
@example(0, 2, np.array([[0, 0, WIDTH, HEIGHT], [0, 0, 0, 0]]), np.arange(BINS))
def test_direct_and_integral_counts_equal_numpy(seed, n_votes, regions, bins):
    image, by_code = codes(seed), votes(n_votes)
    expected = numpy_counts(image, by_code, regions, bins)
    direct = direct_counts(image, by_code, regions, bins, BINS)
    np.testing.assert_array_equal(direct, expected)
    every = integral_histogram(image, by_code, np.arange(BINS), BINS)
    np.testing.assert_array_equal(integral_counts(*every, regions, bins), expected)
    only_these = integral_histogram(image, by_code, bins, BINS)
    np.testing.assert_array_equal(integral_counts(*only_these, regions, bins), expected)


def test_integral_counts_are_exact_beyond_16_bits():
    image = np.zeros((400, 500), np.uint16)  # 200 000 pixels of one bin
    image[390:, 490:] = 1
    by_code = np.array([[0], [1]], np.uint8)
    histogram = integral_histogram(image, by_code, np.array([0, 1]), 2)
    regions = np.array([[300, 200, 500, 400], [0, 0, 255, 257], [489, 389, 500, 400]])
    expected = [[39900, 100], [65535, 0], [21, 100]]
    np.testing.assert_array_equal(integral_counts(*histogram, regions, np.arange(2)), expected)


@pytest.fixture(scope="module")
def image():
    """Return an image of smooth colours with more than 65535 pixels."""
    rng = np.random.default_rng(1)
    coarse = rng.integers(0, 256, (12, 16, 3), dtype=np.uint8)
    return np.repeat(np.repeat(coarse, 25, axis=0), 25, axis=1) ^ rng.integers(
        0, 32, (300, 400, 3), dtype=np.uint8
    )


PLACES = {
    "close together": (120, 130, 60, 900.0),
    "all over the image": (200, 150, 400, 900.0),
    "far outside": (5000, -4000, 10, 900.0),
    "as large as the image": (200, 150, 20, 110000.0),
}


@pytest.mark.parametrize("n_parts", [1, 2])
@pytest.mark.parametrize("n", [1, 60])
@pytest.mark.parametrize("place", PLACES)
def test_region_counts_equal_numpy_for_any_number_of_sharers(image, place, n, n_parts, monkeypatch):
    x, y, spread, area = PLACES[place]
    rng = np.random.default_rng(2)
    states = np.column_stack(
        [rng.normal([x, y], spread / 2, (n, 2)), rng.uniform(0.5, 2, n) * area]
    )
    regions = pixel_regions(states, 0.8, n_parts, 400, 300, 0.25, 16)
    scheme, bins = LuvBins(), np.arange(0, N_BINS, 3)
    voted = scheme.votes[scheme.codes(image)]
    expected = np.zeros((n_parts, n, len(bins)), int)
    for part, i in np.ndindex(n_parts, n):
        left, top, right, bottom = regions.bounds[part, i]
        inside = voted[top:bottom, left:right].ravel()
        expected[part, i] = np.bincount(inside, minlength=N_BINS)[bins]
        assert regions.pixels[part, i] == (right - left) * (bottom - top)
    for sharers in (1, 500):
        actual = count_regions(SharedFrame(image, sharers), regions, scheme, bins)
        np.testing.assert_array_equal(actual, expected)
    for ways in (["_INTEGRAL"], ["_DIRECT", "_DIRECT_REGION"]):  # cost 0: selected
        with monkeypatch.context() as costs:
            for way in ways:
                costs.setattr(counting, way, 0.0)
            actual = count_regions(SharedFrame(image), regions, scheme, bins)
            np.testing.assert_array_equal(actual, expected)


@given(
    st.floats(-30, 60),
    st.floats(-30, 50),
    st.floats(1, 900),
    st.sampled_from([0.4, 1.0, 2.5]),
    st.sampled_from([1, 2]),
)
@example(20.0, 15.0, 16.0, 1.0, 1)  # exactly 16 pixels
@example(0.0, 0.0, 64.0, 1.0, 1)  # exactly a quarter, 16 pixels
@example(-0.5, 0.0, 64.0, 1.0, 1)
def test_pixel_regions_are_rounded_and_clipped_rectangles(x, y, area, aspect, n_parts):
    width = sqrt(area * aspect)
    height = area / width
    columns = range(floor(x - width / 2 + 0.5), floor(x + width / 2 + 0.5))
    rows = range(floor(y - height / 2 + 0.5), floor(y + height / 2 + 0.5))
    seen_columns = [column for column in columns if 0 <= column < 40]
    seen_rows = [row for row in rows if 0 <= row < 30]
    pixels = len(seen_columns) * len(seen_rows)
    regions = pixel_regions(np.array([[x, y, area]]), aspect, n_parts, 40, 30, 0.25, 16)
    assert regions.pixels.shape == (n_parts, 1)
    if pixels < 16 or 4 * pixels < len(columns) * len(rows):
        assert not regions.pixels.any()
        assert not regions.bounds.any()
        return
    assert regions.pixels.sum() == pixels
    whole = [seen_columns[0], seen_rows[0], seen_columns[-1] + 1, seen_rows[-1] + 1]
    assert [regions.left, regions.top, regions.right, regions.bottom] == whole
    edges = [whole[1], (whole[1] + whole[3]) // 2, whole[3]] if n_parts == 2 else whole[1::2]
    for part in range(n_parts):
        expected = [whole[0], edges[part], whole[2], edges[part + 1]]
        assert regions.bounds[part, 0].tolist() == expected


def test_state_of_nan_has_no_pixels():
    regions = pixel_regions(np.array([[np.nan, 5.0, 100.0]]), 1.0, 2, 40, 30, 0.25, 16)
    assert not regions.pixels.any()


histogram = st.lists(st.integers(0, 5000), min_size=6, max_size=6).filter(any)


N_ROWS, N_COLUMNS = 25, 33
ALL_BINS = np.arange(BINS)


def ellipse_codes(seed):
    return np.random.default_rng(seed).integers(0, BINS, (N_ROWS, N_COLUMNS)).astype(np.uint16)


# Multiples of 1/64 pixel plus an offset: no pixel centre lies on a rim by rounding.
place = st.integers(-20 * 64, 50 * 64).map(lambda n: n / 64 + 0.003)
half_axis = st.integers(3 * 64, 30 * 64).map(lambda n: n / 64 + 0.001)
some_ellipses = st.lists(st.tuples(place, place, half_axis, half_axis), min_size=1, max_size=4).map(
    np.array
)


@given(st.integers(0, 99), some_ellipses, st.sampled_from(KERNELS), st.booleans())
@example(0, np.array([[16.0, 12.0, 3.0, 3.0], [-300.0, 12.0, 3.0, 3.0]]), "epanechnikov", False)
def test_ellipse_counts_are_sums_of_integer_weights(seed, ellipses, kernel, transposed):
    laid = np.ascontiguousarray(ellipse_codes(seed).T) if transposed else ellipse_codes(seed)
    actual = ellipse_counts(laid, (0, 0), transposed, ellipses, kernel, ALL_BINS, BINS)
    for i, ellipse in enumerate(ellipses):
        inside, _, _, weights = pixels_of(ellipse_codes(seed), ellipse, kernel)
        np.testing.assert_array_equal(actual.counts[i], np.bincount(inside, weights, BINS))
        assert actual.pixels[i] == len(inside)
        assert actual.totals[i] == actual.counts[i].sum()
    assert (actual.counts >= 0).all()


def test_ellipse_totals_include_bins_without_counts():
    ellipses = np.array([[12.0, 12.0, 9.0, 7.0]])
    every, some = (
        ellipse_counts(ellipse_codes(2), (0, 0), False, ellipses, "isotropic", bins, BINS)
        for bins in (ALL_BINS, np.array([7, 3]))
    )
    np.testing.assert_array_equal(some.counts, every.counts[:, [7, 3]])
    np.testing.assert_array_equal(some.totals, every.totals)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e300])
def test_ellipse_of_invalid_position_has_zero_counts(value):
    ellipses = np.array([[value, 12.0, 5.0, 5.0], [12.0, value, 5.0, 5.0]])
    actual = ellipse_counts(ellipse_codes(0), (0, 0), False, ellipses, "uniform", ALL_BINS, BINS)
    assert not actual.totals.any()
    assert not bhattacharyya_coefficients(
        actual.counts, actual.totals, np.full((1, BINS), 1 / BINS)
    ).any()
