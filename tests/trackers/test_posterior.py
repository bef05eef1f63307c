"""Posteriors of colours, compared with densities of SciPy."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.stats import multivariate_normal

from trackmark.trackers.contours.mixture import Mixture, from_components
from trackmark.trackers.contours.posterior import BLOCK, posterior, posterior_tables, region_scores


def components(rng, *shape, least=2e-4):
    """Return random components of colours in [0, 1], with eigenvalues down to `least`."""
    numbers = np.empty((*shape, 6))
    numbers[..., 0] = rng.dirichlet(np.ones(shape[-1]), shape[:-1])
    numbers[..., 1:3] = rng.uniform(-0.3, 1.5, (*shape, 2))
    numbers[..., 3:5] = np.exp(rng.uniform(np.log(least), np.log(0.15), (*shape, 2)))
    numbers[..., 5] = rng.uniform(-4, 4, shape)
    return numbers


def slow_density(mixture, points):
    parts = zip(*mixture, strict=True)
    return sum(weight * multivariate_normal(*rest).pdf(points) for weight, *rest in parts)


@pytest.mark.parametrize(("floor", "prior"), [(0.05, 0.5), (2.0, 0.5), (0.05, 0.1)])
def test_posterior_equals_that_of_scipy_densities(floor, prior):
    rng = np.random.default_rng(0)
    target, background = (from_components(components(rng, m)) for m in (2, 5))
    points = rng.uniform(-0.5, 1.7, (200, 2))
    wanted = prior * slow_density(target, points)
    others = (1 - prior) * (slow_density(background, points) + floor)
    actual = posterior(points, target, background, floor, prior)
    np.testing.assert_allclose(actual, wanted / (wanted + others), rtol=1e-9)


def test_posterior_without_floor_follows_the_wider_tail():
    narrow, wide = (
        Mixture(np.ones(1), np.zeros((1, 2)), variance * np.eye(2)[np.newaxis])
        for variance in (2e-4, 4e-4)
    )
    far = np.array([[1.5, 0.0]])  # 100 deviations away
    assert posterior(far, narrow, wide, floor=0.0) == 0
    assert posterior(far, wide, narrow, floor=0.0) == 1
    assert posterior(far, wide, narrow, floor=0.05) == 0


def case(seed, n=7, k=90, planes=3, m=(2, 5), least=2e-4):
    rng = np.random.default_rng(seed)
    target, background = (components(rng, n, count, least=least) for count in m)
    projected = rng.uniform(-0.5, 1.7, (planes, k, 2))
    return projected, rng.integers(0, planes, n), target, background, rng.normal(size=k) / k


def slow_tables(projected, planes, target, background, floor, prior):
    rows = zip(planes, target, background, strict=True)
    return np.array(
        [
            posterior(
                projected[plane], from_components(first), from_components(other), floor, prior
            )
            for plane, first, other in rows
        ]
    )


@settings(max_examples=40)
@given(
    st.integers(0, 10**6),
    st.sampled_from([0.0, 1e-3, 0.05, 1.0]),
    st.floats(0.01, 0.99),
    st.tuples(st.integers(1, 3), st.integers(1, 6)),
)
@example(8810, 0.0, 0.0625, (1, 1))  # 6.6e-5 apart
def test_posterior_tables_are_accurate_to_four_digits(seed, floor, prior, m):
    projected, planes, target, background, contrast = case(seed, m=m)
    tables, scores = posterior_tables(projected, planes, target, background, floor, prior, contrast)
    assert tables.dtype == np.float32
    expected = slow_tables(projected, planes, target, background, floor, prior)
    np.testing.assert_allclose(tables, expected, atol=2e-5 if floor else 1e-4)
    np.testing.assert_allclose(scores, tables.astype(float) @ contrast, rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("k", [1, BLOCK - 1, BLOCK, BLOCK + 1, 2 * BLOCK + 37])
def test_posterior_table_has_any_number_of_colours(k):
    *arrays, contrast = case(k, n=3, k=k)
    tables, scores = posterior_tables(*arrays, 0.05, 0.5, contrast)
    np.testing.assert_allclose(tables, slow_tables(*arrays, 0.05, 0.5), atol=2e-5)
    np.testing.assert_allclose(scores, tables.astype(float) @ contrast, rtol=1e-12, atol=1e-14)


def test_region_scores_use_the_mixtures_of_each_plane():
    projected, _, target, background, contrast = case(1, n=4, planes=4)
    actual = region_scores(
        projected, from_components(target), from_components(background), contrast, 0.05, 0.3
    )
    expected = slow_tables(projected, range(4), target, background, 0.05, 0.3) @ contrast
    np.testing.assert_allclose(actual, expected, atol=1e-5)
    assert np.ptp(actual) > 1e-3
