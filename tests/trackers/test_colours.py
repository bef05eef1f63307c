"""Mixtures of Gaussians and posteriors of colours, compared with scikit-learn and SciPy."""

import warnings

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.stats import multivariate_normal
from sklearn.exceptions import ConvergenceWarning
from sklearn.mixture import GaussianMixture

from trackmark.trackers.contours.mixture import (
    Mixture,
    density,
    fit_mixture,
    from_components,
    project_mixture,
    refine_mixture,
    refine_on_planes,
    to_components,
)
from trackmark.trackers.contours.plane_cue import plane_basis, plane_normal
from trackmark.trackers.contours.posterior import BLOCK, posterior, posterior_tables, region_scores


def some_mixture(seed, m=3, d=2):
    rng = np.random.default_rng(seed)
    roots = rng.normal(0, 0.1, (m, d, d))
    covariances = roots @ np.swapaxes(roots, 1, 2) + 1e-3 * np.eye(d)
    return Mixture(rng.dirichlet(np.ones(m)), rng.random((m, d)), covariances)


def drawn(mixture, n, seed):
    rng = np.random.default_rng(seed)
    chosen = rng.choice(len(mixture.weights), n, p=mixture.weights)
    parts = zip(mixture.means[chosen], mixture.covariances[chosen], strict=True)
    return np.array([rng.multivariate_normal(*part) for part in parts])


def by_scikit_learn(points, start, iterations, regularisation):
    model = GaussianMixture(
        len(start.weights),
        tol=0,
        reg_covar=regularisation,
        max_iter=iterations,
        weights_init=start.weights,
        means_init=start.means,
        precisions_init=np.linalg.inv(start.covariances),
        random_state=0,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # after a fixed number of steps
        model.fit(points)
    return Mixture(model.weights_, model.means_, model.covariances_)


def assert_same(actual, expected, **tolerance):
    for part, other in zip(actual, expected, strict=True):
        np.testing.assert_allclose(part, other, **tolerance)


@pytest.mark.parametrize("d", [2, 3])
def test_refined_mixture_equals_that_of_scikit_learn(d):
    points = drawn(some_mixture(d, m=4, d=d), 300, 1)
    start = some_mixture(7, m=3, d=d)
    before = [part.copy() for part in start]
    actual = refine_mixture(points, start, 2, 1e-3)
    assert_same(actual, by_scikit_learn(points, start, 2, 1e-3), rtol=1e-8, atol=1e-10)
    assert_same(start, before)


def slow_start(points, m, uniforms, regularisation):
    """Return the mixture of the points nearest to the centres of k-means++."""
    centres = []
    for uniform in uniforms:
        chances = [min((((p - c) ** 2).sum() for c in centres), default=1.0) for p in points]
        reached, wanted = 0.0, uniform * sum(chances)
        for point, chance in zip(points, chances, strict=True):
            reached += chance
            if reached > wanted:
                centres.append(point)
                break
    owners = np.array([np.argmin([((p - c) ** 2).sum() for c in centres]) for p in points])
    groups = [points[owners == component] for component in range(m)]
    return Mixture(
        np.array([len(group) / len(points) for group in groups]),
        np.array([group.mean(axis=0) for group in groups]),
        np.array(
            [np.cov(group.T, bias=True) + regularisation * np.eye(len(group.T)) for group in groups]
        ),
    )


@pytest.mark.parametrize("d", [2, 3])
def test_fit_mixture_starts_from_k_means_plus_plus(d):
    points = drawn(some_mixture(d, m=4, d=d), 80, 1)
    start = slow_start(points, 4, np.random.default_rng(5).random(4), 3e-4)
    assert_same(fit_mixture(points, 4, np.random.default_rng(5), 0), start, rtol=1e-9)
    expected = by_scikit_learn(points, start, 15, 3e-4)
    assert_same(fit_mixture(points, 4, np.random.default_rng(5)), expected, rtol=1e-7)


def test_components_without_points_have_weight_zero():
    points = np.repeat([[0.2, 0.3], [0.8, 0.5]], [30, 10], axis=0)
    actual = fit_mixture(points, 4, np.random.default_rng(0))
    assert sorted(actual.weights.round(9)) == [0, 0, 0.25, 0.75]
    assert {tuple(mean) for mean in actual.means.round(9)} == {(0.2, 0.3), (0.8, 0.5)}
    np.testing.assert_allclose(actual.covariances, np.tile(3e-4 * np.eye(2), (4, 1, 1)), atol=1e-15)
    again = refine_mixture(points + 0.01, actual, 3)
    np.testing.assert_array_equal(again.weights == 0, actual.weights == 0)
    assert all(np.isfinite(part).all() for part in again)


BASIS = np.linalg.qr(np.random.default_rng(8).normal(size=(3, 2)))[0]


def bases(n):
    normals = plane_normal(BASIS) + np.random.default_rng(n).normal(0, 0.2, (n, 3))
    return plane_basis(normals / np.linalg.norm(normals, axis=1, keepdims=True), BASIS)


def test_projected_mixture_is_the_marginal_density():
    mixture = some_mixture(3, d=3)
    points = np.random.default_rng(0).random((5, 2))
    heights = np.linspace(-4, 4, 8001)
    lines = points @ BASIS.T + heights[:, np.newaxis, np.newaxis] * plane_normal(BASIS)
    along = density(mixture, lines.reshape(-1, 3)).reshape(8001, 5)
    expected = along.sum(axis=0) * (heights[1] - heights[0])
    np.testing.assert_allclose(
        density(project_mixture(mixture, BASIS), points), expected, rtol=1e-9
    )


def test_mixtures_on_planes_are_refined_projections():
    mixture = some_mixture(4, m=3, d=3)
    points = drawn(some_mixture(5, m=4, d=3), 150, 0)
    several = bases(4)
    actual = refine_on_planes(points, mixture, several, 2, 1e-3)
    for plane, basis in enumerate(several):
        part = Mixture(*(array[plane] for array in actual))
        start = project_mixture(mixture, basis)
        assert_same(part, refine_mixture(points @ basis, start, 2, 1e-3), rtol=1e-10)
        assert_same(
            Mixture(*(a[plane] for a in project_mixture(mixture, several))), start, rtol=1e-12
        )
    assert_same(refine_on_planes(points, mixture, several, 0), project_mixture(mixture, several))


component = st.tuples(
    st.floats(0, 1),
    st.floats(-2, 2),
    st.floats(-2, 2),
    st.floats(1e-4, 0.2),
    st.floats(1e-4, 0.2),
    st.floats(-10, 10),
)


@given(st.lists(component, min_size=1, max_size=4))
def test_components_are_convertible_to_covariances_and_back(numbers):
    given_ones = np.array(numbers)
    mixture = from_components(given_ones)
    for covariance, (*_, first, second, angle) in zip(mixture.covariances, numbers, strict=True):
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        expected = turn @ np.diag([first, second]) @ turn.T
        np.testing.assert_allclose(covariance, expected, atol=1e-14)
    actual = to_components(mixture)
    np.testing.assert_array_equal(actual[:, :3], given_ones[:, :3])
    ordered = np.sort(given_ones[:, 3:5], axis=1)[:, ::-1]
    np.testing.assert_allclose(actual[:, 3:5], ordered, atol=1e-14)
    assert (np.abs(actual[:, 5]) <= np.pi / 2).all()
    assert_same(from_components(actual), mixture, atol=1e-14)


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


@pytest.mark.parametrize("prior", [0.5, 0.1])
def test_posterior_equals_that_of_scipy_densities(prior):
    rng = np.random.default_rng(0)
    target, background = (from_components(components(rng, m)) for m in (2, 5))
    points = rng.uniform(-0.5, 1.7, (200, 2))
    wanted = prior * slow_density(target, points)
    others = (1 - prior) * slow_density(background, points)
    actual = posterior(points, target, background, prior)
    np.testing.assert_allclose(actual, wanted / (wanted + others), rtol=1e-9)


def test_posterior_of_a_distant_colour_follows_the_wider_tail():
    narrow, wide = (
        Mixture(np.ones(1), np.zeros((1, 2)), variance * np.eye(2)[np.newaxis])
        for variance in (2e-4, 4e-4)
    )
    far = np.array([[1.5, 0.0]])  # 100 deviations away
    assert posterior(far, narrow, wide) == 0
    assert posterior(far, wide, narrow) == 1


def case(seed, n=7, k=90, planes=3, m=(2, 5), least=2e-4):
    rng = np.random.default_rng(seed)
    target, background = (components(rng, n, count, least=least) for count in m)
    projected = rng.uniform(-0.5, 1.7, (planes, k, 2))
    return projected, rng.integers(0, planes, n), target, background, rng.normal(size=k) / k


def slow_tables(projected, planes, target, background, prior):
    rows = zip(planes, target, background, strict=True)
    return np.array(
        [
            posterior(projected[plane], from_components(first), from_components(other), prior)
            for plane, first, other in rows
        ]
    )


@settings(max_examples=40)
@given(
    st.integers(0, 10**6),
    st.floats(0.01, 0.99),
    st.tuples(st.integers(1, 3), st.integers(1, 6)),
)
@example(8810, 0.0625, (1, 1))  # 6.6e-5 apart
def test_posterior_tables_are_accurate_to_four_digits(seed, prior, m):
    projected, planes, target, background, contrast = case(seed, m=m)
    tables, scores = posterior_tables(projected, planes, target, background, prior, contrast)
    assert tables.dtype == np.float32
    expected = slow_tables(projected, planes, target, background, prior)
    np.testing.assert_allclose(tables, expected, atol=1e-4)
    np.testing.assert_allclose(scores, tables.astype(float) @ contrast, rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("k", [1, BLOCK - 1, BLOCK, BLOCK + 1, 2 * BLOCK + 37])
def test_posterior_table_has_any_number_of_colours(k):
    *arrays, contrast = case(k, n=3, k=k)
    tables, scores = posterior_tables(*arrays, 0.5, contrast)
    np.testing.assert_allclose(tables, slow_tables(*arrays, 0.5), atol=1e-4)
    np.testing.assert_allclose(scores, tables.astype(float) @ contrast, rtol=1e-12, atol=1e-14)


def test_region_scores_use_the_mixtures_of_each_plane():
    projected, _, target, background, contrast = case(1, n=4, planes=4)
    actual = region_scores(
        projected, from_components(target), from_components(background), contrast, 0.3
    )
    expected = slow_tables(projected, range(4), target, background, 0.3) @ contrast
    np.testing.assert_allclose(actual, expected, atol=1e-5)
    assert np.ptp(actual) > 1e-3
