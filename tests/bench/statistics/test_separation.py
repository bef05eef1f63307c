"""How well numbers tell two classes apart."""

import numpy as np
import pytest

from bench.statistics.separation import auc, auc_interval, error_share, zero_error_thresholds


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


@pytest.mark.parametrize("apart", [0.0, 1.0, 1.8])
@pytest.mark.parametrize("members", [8, 40])
def test_the_interval_of_an_area_leaves_the_truth_on_either_side_in_few_cases(members, apart):
    generator = np.random.default_rng(members)
    truth = auc(generator.normal(apart, 1, 4000), generator.normal(0, 1, 4000))
    found = [
        auc_interval(auc(*generator.normal([[apart], [0]], 1, (2, members))), members, members)
        for _ in range(400)
    ]
    low, high = np.transpose(found)
    assert (low <= high).all()
    assert (low > truth).mean() < 0.05
    assert (high < truth).mean() < 0.06


def test_the_interval_of_an_area_has_some_width_where_nothing_is_told_wrongly():
    low, high = auc_interval(1.0, 8, 8)
    assert (round(low, 3), high) == (0.756, 1.0)
    assert auc_interval(0.0, 8, 8) == pytest.approx((0.0, 1 - low))
