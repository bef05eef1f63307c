"""Time to failure: against closed forms."""

import numpy as np
import pytest

from trackmark.bench.statistics.survival import kaplan_meier


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
