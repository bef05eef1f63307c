"""Weights and resampling against closed forms and their contracts."""

from math import ceil, floor

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trackmark.trackers.base.particles import (
    SCHEMES,
    effective_sample_size,
    mean_state,
    normalise_log_weights,
)

OTHERS = ["systematic", "stratified", "residual"]
logs = st.lists(st.floats(-50, 50), min_size=1, max_size=30).map(np.array)


@given(logs, st.floats(-5000, 5000))
def test_weights_are_the_exponentials_ratios_however_small(log_weights, shift):
    weights = normalise_log_weights(log_weights + shift)
    expected = np.exp(log_weights - log_weights.max())
    np.testing.assert_allclose(weights, expected / expected.sum(), rtol=1e-9)


def test_normalise_log_weights_handles_underflow():
    assert np.exp(-5000.0) == 0.0
    weights = normalise_log_weights(np.array([-5000.0, -5001.0, -np.inf]))
    np.testing.assert_allclose(weights, [1 / (1 + np.exp(-1)), 1 / (1 + np.e), 0], rtol=1e-12)
    assert normalise_log_weights(np.full(4, -np.inf)).tolist() == [0.25] * 4


@given(st.integers(1, 50), st.integers(0, 50))
def test_k_of_n_equal_weights_count_as_k_and_have_their_mean(k, others):
    weights = np.concatenate([np.full(k, 1 / k), np.zeros(others)])
    assert effective_sample_size(weights) == pytest.approx(k)
    states = np.random.default_rng(k).normal(size=(k + others, 3))
    np.testing.assert_allclose(mean_state(weights, states), states[:k].mean(axis=0), atol=1e-12)


def copies(name, weights, uniforms):
    chosen = SCHEMES[name](weights, uniforms)
    assert len(chosen) == len(weights)
    return np.bincount(chosen, minlength=len(weights))


weighted = st.lists(st.floats(0, 1), min_size=1, max_size=25).filter(any).map(np.array)


@pytest.mark.parametrize("name", SCHEMES)
@given(weighted, st.integers(0, 999))
def test_as_many_go_on_and_none_that_weighs_nothing(name, weights, seed):
    weights = weights / weights.sum()
    uniforms = np.random.default_rng(seed).random(len(weights))
    actual = copies(name, weights, uniforms)
    assert actual.sum() == len(weights)
    assert not actual[weights == 0].any()
    expected = len(weights) * weights
    for n, share in zip(actual, expected, strict=True):
        if name == "systematic":
            assert floor(share - 1e-9) <= n <= ceil(share + 1e-9)
        if name == "stratified":
            assert floor(share - 1e-9) - 1 <= n <= ceil(share + 1e-9) + 1
        if name == "residual":
            assert n >= floor(share - 1e-9)


@pytest.mark.parametrize("name", SCHEMES)
@pytest.mark.parametrize("extreme", [0.0, np.nextafter(1.0, 0.0)])
def test_resampling_never_selects_weight_zero(name, extreme):
    weights = np.array([0.0, 0.3, 0.0, 0.7, 0.0])
    chosen = SCHEMES[name](weights, np.full(5, extreme))
    assert set(chosen.tolist()) <= {1, 3}


@pytest.mark.parametrize("n", [49, 200])  # 49 · (1/49) is less than 1 in floating point
@pytest.mark.parametrize("name", OTHERS)
def test_equal_weights_leave_every_particle_in_place(name, n):
    uniforms = np.random.default_rng(0).random(n)
    assert SCHEMES[name](np.full(n, 1 / n), uniforms).tolist() == list(range(n))


WEIGHTS = np.random.default_rng(3).dirichlet(np.ones(12))
N_TRIALS = 2000


@pytest.fixture(scope="module")
def trials():
    """Copies of each particle in many trials, by scheme."""
    uniforms = np.random.default_rng(4).random((N_TRIALS, 12))
    return {name: np.array([copies(name, WEIGHTS, u) for u in uniforms]) for name in SCHEMES}


@pytest.mark.parametrize("name", SCHEMES)
def test_expected_copies_are_proportional_to_weights(trials, name):
    standard_error = trials[name].std(axis=0) / np.sqrt(N_TRIALS) + 1e-9
    assert (np.abs(trials[name].mean(axis=0) - 12 * WEIGHTS) < 4 * standard_error).all()


def test_multinomial_resampling_has_the_largest_variance(trials):
    actual = trials["multinomial"]
    variance = 12 * WEIGHTS * (1 - WEIGHTS)
    np.testing.assert_allclose(actual.var(axis=0), variance, rtol=0.15)
    strays = {name: copies.var(axis=0).sum() for name, copies in trials.items()}
    assert all(strays[name] < 0.6 * strays["multinomial"] for name in OTHERS)
