"""Spearman's rank correlation with its interval."""

from statistics import NormalDist

import numpy as np
import pytest
from scipy.stats import spearmanr

from trackmark.bench.statistics.correlation import rank_correlation


def test_rank_correlation_is_spearmans():
    first, second = [1, 2, 2, 5, np.inf, 4], [2, 1, 4, 4, 9, 3]
    r, interval = rank_correlation(first, second)
    assert r == pytest.approx(spearmanr([1, 2, 2, 5, 99, 4], second).statistic)
    half = NormalDist().inv_cdf(0.975) * np.sqrt((1 + r**2 / 2) / (6 - 3))
    assert np.arctanh(interval) == pytest.approx([np.arctanh(r) - half, np.arctanh(r) + half])


def test_rank_correlation_has_no_interval_below_6_pairs():
    assert rank_correlation(range(5), range(5)) == (pytest.approx(1.0), (-1.0, 1.0))
    assert 0.0 < rank_correlation(range(6), range(6))[1].low < 0.9
    assert 0.5 < rank_correlation(range(8), range(8))[1].low < 0.95
    assert np.isnan(rank_correlation([1, 1, 1], [1, 2, 3])[0])


def test_rank_correlation_interval_covers():
    """Check coverage for 8 pairs of normal numbers with a correlation of 0.8."""
    generator = np.random.default_rng(0)
    truth = 6 / np.pi * np.arcsin(0.4)
    covered = []
    for _ in range(1000):
        pairs = generator.multivariate_normal([0, 0], [[1, 0.8], [0.8, 1]], 8)
        low, high = rank_correlation(*pairs.T)[1]
        covered.append(low <= truth <= high)
    assert 0.92 <= np.mean(covered) <= 0.98
