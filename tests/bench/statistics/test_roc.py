"""How well numbers tell two classes apart."""

import numpy as np
import pytest

from trackmark.bench.statistics.roc import auc, error_share, zero_error_thresholds


def test_the_area_under_the_curve_is_the_share_of_pairs_in_order():
    generator = np.random.default_rng(0)
    two, plain = generator.integers(0, 9, 30) / 10, generator.integers(0, 7, 20) / 10
    pairs = [(t > p) + 0.5 * (t == p) for t in two for p in plain]
    assert auc(two, plain) == pytest.approx(np.mean(pairs))
    assert auc(plain, two) == pytest.approx(1 - np.mean(pairs))


def test_thresholds_without_error_make_none():
    two, plain = [0.5, 0.45, 0.9], [0.1, 0.3]
    low, high = zero_error_thresholds(two, plain)
    assert (low, high) == (0.3, 0.45)
    assert error_share(two, plain, low) == 0
    assert error_share(two, plain, high) > 0
    assert zero_error_thresholds([0.3], [0.3]) is None
