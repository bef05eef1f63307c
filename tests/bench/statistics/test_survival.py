"""Time to failure: against closed forms, SciPy, and permuted runs."""

import numpy as np
import pytest
from scipy import stats

from bench.statistics.survival import kaplan_meier, log_rank


def test_without_censoring_it_is_the_share_that_is_left():
    found = kaplan_meier([1, 2, 3, 4], [True] * 4)
    assert found.times.tolist() == [1, 2, 3, 4]
    assert found.shares == pytest.approx([0.75, 0.5, 0.25, 0])


def test_a_run_that_ends_unlost_counts_until_then():
    # By hand: 5 at risk, one lost; one ends; 3 at risk, one lost.
    found = kaplan_meier([1, 2, 3, 4, 4], [True, False, True, False, False])
    assert found.shares == pytest.approx([0.8, 0.8, 0.8 * 2 / 3, 0.8 * 2 / 3])
    assert (found.low < found.shares).all()
    assert (found.shares < found.high).all()


def test_where_nobody_is_lost_there_is_no_band():
    found = kaplan_meier([10, 10], [False, False])
    assert found.shares.tolist() == [1.0]
    assert np.isnan(found.low).all()


def test_log_rank_on_one_sequence_is_scipys():
    generator = np.random.default_rng(3)
    times = generator.integers(1, 12, (2, 15)).astype(float)
    lost = generator.random((2, 15)) < 0.7
    excess, p = log_rank([(times[0], lost[0], times[1], lost[1])])
    data = [stats.CensoredData.right_censored(t, ~k) for t, k in zip(times, lost, strict=True)]
    expected = stats.logrank(*data)
    assert p == pytest.approx(expected.pvalue)
    assert np.sign(excess) == np.sign(expected.statistic)


def test_strata_keep_a_hard_sequence_from_looking_like_a_bad_tracker():
    """The second tracker ran mostly where everybody is lost early: alike within each sequence."""
    hard, easy = [5.0, 6.0, 7.0], [50.0, 60.0, 70.0]
    lost = [True, True, True]
    _, pooled = log_rank([(easy + hard[:1], lost + lost[:1], hard + easy[:1], lost + lost[:1])])
    _, stratified = log_rank([(hard[:1], lost[:1], hard, lost), (easy, lost, easy[:1], lost[:1])])
    assert stratified > 0.3
    assert pooled < stratified


def test_equal_trackers_are_told_apart_in_one_case_of_twenty():
    generator = np.random.default_rng(0)
    called = 0
    for _ in range(400):
        strata = []
        for scale in (20, 60, 120, 200):
            times = generator.exponential(scale, (2, 10)).round() + 1
            ends = np.minimum(times, 100)
            strata.append((ends[0], times[0] < 100, ends[1], times[1] < 100))
        called += log_rank(strata)[1] < 0.05
    assert called / 400 < 0.08
    assert log_rank([([100.0], [False], [100.0], [False])]) == (0.0, 1.0)
