"""Changes of scores: reference values, agreement with a slow definition, and error rates."""

from math import inf, sqrt
from statistics import fmean, stdev

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from trackmark.bench.statistics.accuracy_drop import (
    advised_repetitions,
    decide_by_repetitions,
    found_drop,
    missed_drops,
    share_found,
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
def test_decide_by_repetitions_equals_slow_definition(values, comparisons):
    if np.ptp(values) < 1e-4:
        return
    change = decide_by_repetitions(values, comparisons, DETECT)
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
        ([-0.3, 0.3, -0.2, 0.2, -0.1, 0.1], 1, "inconclusive", "51 to 1200 repetitions needed"),
        ([-0.1] * 6, 1, "worse", ""),
        (
            [-0.1] * 6,
            8,
            "inconclusive",
            "the same difference on all 6 repetitions, too few for 8 comparisons",
        ),
    ],
)
def test_decide_by_repetitions_labels_and_reasons(values, comparisons, label, reason):
    change = decide_by_repetitions(values, comparisons, DETECT)
    assert (change.label, change.reason) == (label, reason)


def normal_scores(generator, n_repetitions):
    return 0.6 + 0.08 * generator.standard_normal(n_repetitions)


def lossy_scores(generator, n_repetitions):
    """Return scores of a tracker that loses the target in a tenth of its runs."""
    lost = generator.random(n_repetitions) < 0.1
    return np.where(lost, 0.1, 0.7) + 0.01 * generator.standard_normal(n_repetitions)


@pytest.mark.slow
@pytest.mark.parametrize("draw", [normal_scores, lossy_scores])
@pytest.mark.parametrize(("n_repetitions", "n_sequences"), [(6, 8), (20, 8), (20, 1)])
def test_promised_drop_is_found_in_80_percent(draw, n_repetitions, n_sequences):
    """Apply the rule itself to new scores of many baselines, each with its promised drop."""
    generator = np.random.default_rng(7)
    is_worse = {False: [], True: []}
    for _ in range(60):
        scores = [draw(generator, n_repetitions) for _ in range(n_sequences)]
        for in_mean in is_worse:
            comparisons = 1 if in_mean else n_sequences
            drop = found_drop(missed_drops(scores, n_repetitions, comparisons, in_mean=in_mean))
            for _ in range(10):
                new = [draw(generator, n_repetitions) for _ in range(n_sequences)]
                differences = np.array(new) - scores
                of_check = differences.mean(axis=0) if in_mean else differences[0]
                label = decide_by_repetitions(of_check - drop, comparisons, DETECT).label
                is_worse[in_mean].append(label == "worse")
    for shares in is_worse.values():
        assert 0.7 < np.mean(shares) < 0.92


def test_promised_drop_is_not_inside_the_margin():
    """Seeds with a small spread: intervals of smaller drops are inside ±0.01."""
    scores = 0.6 + np.random.default_rng(1).normal(0, 0.0005, (8, 20))
    for in_mean in (False, True):
        missed = missed_drops(scores, 20, 8, in_mean=in_mean)
        drop = found_drop(missed)
        assert 0.01 <= drop <= 0.011
        assert share_found(missed, drop) >= 0.8
    assert share_found(missed, 0.009) < 0.8


def test_equal_differences_on_few_repetitions_find_no_drop():
    constant = [[0.5] * 6] * 8
    assert found_drop(missed_drops(constant, 6, 8)) == inf
    assert found_drop(missed_drops(constant, 20, 8)) == pytest.approx(0.011)
    assert advised_repetitions(constant, 6, 8, DETECT) == 12


def test_advised_repetitions_find_the_drop():
    scores = np.random.default_rng(3).normal(0.6, 0.08, (8, 20))
    assert share_found(missed_drops(scores, 20, 8), DETECT) < 0.3
    advised = advised_repetitions(scores, 20, 8, DETECT)
    assert 60 < advised < 120
    assert share_found(missed_drops(scores, advised, 8), DETECT) >= 0.8
    assert share_found(missed_drops(scores, advised * 3 // 4, 8), DETECT) < 0.8
    assert advised_repetitions(scores, 20, 8, 0.009) is None  # inside the margin with any number
    assert advised_repetitions([[0.0, 1.0] * 10], 20, 1, 0.01) is None
