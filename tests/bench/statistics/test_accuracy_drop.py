"""Changes of scores: reference values, agreement with a slow definition, and error rates."""

from math import sqrt
from statistics import NormalDist, fmean, stdev

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from trackmark.bench.statistics.accuracy_drop import (
    advised_seeds,
    decide_by_seeds,
    detectable_drops,
    pooled_spread,
)

DETECT = 0.05
differences = st.lists(st.floats(-0.25, 0.25, width=32), min_size=6, max_size=30)


def slow_interval(values, level):
    """Return the union of Student's and Hall's interval of one sample."""
    n, mean, error = len(values), fmean(values), stdev(values) / sqrt(len(values))
    quantile = float(stats.t.ppf(1 - (1 - level) / 2, n - 1))
    moments = [fmean((value - mean) ** power for value in values) for power in (2, 3)]
    k = moments[1] / moments[0] ** 1.5 / sqrt(n)
    k = 1e-6 if abs(k) < 1e-6 else k
    ends = [3 / k * (np.cbrt(1 + k * (z - k / 6)) - 1) for z in (quantile, -quantile)]
    hall = [mean - error * end for end in ends]
    low, high = min(mean - quantile * error, hall[0]), max(mean + quantile * error, hall[1])
    return max(low, -1.0), min(high, 1.0)


def slow_label(low, high):
    inside = low >= -0.01 and high <= 0.01
    if (low > 0 or high < 0) and not inside:
        return "better" if low > 0 else "worse"
    return "not worse" if low > -DETECT else "inconclusive"


@given(differences, st.integers(1, 20))
def test_decide_by_seeds_equals_slow_definition(values, comparisons):
    if np.ptp(values) < 1e-4:
        return
    change = decide_by_seeds(values, comparisons, DETECT)
    low, high = slow_interval(values, 1 - 0.05 / comparisons)
    assert change.interval == pytest.approx((low, high), abs=1e-7)
    close = [abs(end - limit) for end in (low, high) for limit in (0, 0.01, -0.01, -DETECT)]
    assert change.label == slow_label(low, high) or min(close) < 1e-7
    assert (change.label == "inconclusive") == bool(change.reason)
    assert change.mean == pytest.approx(fmean(values))


@pytest.mark.parametrize(
    ("values", "comparisons", "label", "reason"),
    [
        ([-0.08, -0.12, -0.1, -0.09, -0.11, -0.1], 1, "worse", ""),
        ([0.08, 0.12, 0.1, 0.09, 0.11, 0.1], 1, "better", ""),
        ([-0.005] * 20, 8, "not worse", ""),
        ([-0.03, 0.02] * 10, 1, "not worse", ""),
        ([-0.3, 0.3, -0.2, 0.2, -0.1, 0.1], 1, "inconclusive", "51 to 1200 seeds needed"),
        ([-0.1] * 6, 1, "worse", ""),
        (
            [-0.1] * 6,
            8,
            "inconclusive",
            "the same difference on all 6 seeds, too few for 8 comparisons",
        ),
    ],
)
def test_decide_by_seeds_labels_and_reasons(values, comparisons, label, reason):
    change = decide_by_seeds(values, comparisons, DETECT)
    assert (change.label, change.reason) == (label, reason)


def test_sensitivity_matches_documented_example():
    on_sequence, in_mean = detectable_drops(0.08, 8, 20)
    assert (f"{on_sequence:.2f}", f"{in_mean:.3f}") == ("0.09", "0.025")
    assert advised_seeds(0.08, 8, DETECT) == 68
    assert advised_seeds(0.0, 8, DETECT) == 6
    steps = NormalDist().inv_cdf(1 - 0.025 / 8) + NormalDist().inv_cdf(0.8)
    assert on_sequence == pytest.approx(0.08 * steps * sqrt(2 / 20))


def test_pooled_spread_is_root_mean_square():
    assert pooled_spread([[0.1, 0.3], [0.5, 0.5]]) == pytest.approx(sqrt(0.02 / 2))
