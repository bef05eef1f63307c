"""Survival curves against closed forms."""

import numpy as np
import pytest

from trackmark.bench.statistics.survival import kaplan_meier


def test_survival_without_censoring_is_remaining_share():
    survival = kaplan_meier([1, 2, 3, 4], [True] * 4)
    assert survival.times.tolist() == [1, 2, 3, 4]
    assert survival.shares == pytest.approx([0.75, 0.5, 0.25, 0])


def test_censored_run_counts_until_its_end():
    # By hand: 5 at risk, one lost; one ends; 3 at risk, one lost.
    survival = kaplan_meier([1, 2, 3, 4, 4], [True, False, True, False, False])
    assert survival.shares == pytest.approx([0.8, 0.8, 0.8 * 2 / 3, 0.8 * 2 / 3])
    assert (survival.low < survival.shares).all()
    assert (survival.shares < survival.high).all()


def test_survival_without_failures_has_no_band():
    survival = kaplan_meier([10, 10], [False, False])
    assert survival.shares.tolist() == [1.0]
    assert np.isnan(survival.low).all()
