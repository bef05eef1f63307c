"""Rank correlation, survival curves, and units of sequences."""

from statistics import NormalDist

import numpy as np
import pytest
from scipy.stats import spearmanr

from trackmark.bench.statistics.correlation import rank_correlation
from trackmark.bench.statistics.survival import kaplan_meier
from trackmark.bench.statistics.units import units_of


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


TWO_FAMILIES = ["cup:scene=1", "cup:scene=2", "cup:scene=2:light=even", "box"]


def test_units_are_families_if_there_are_several():
    units = units_of(TWO_FAMILIES)
    assert (units.unit_kind, units.labels, units.plural) == ("family", ["cup", "box"], "families")
    assert units.means([[0.1, 0.2, 0.3, 0.8]]).tolist() == [[pytest.approx(0.2), 0.8]]


def test_units_are_scenes_of_a_single_family_and_on_request():
    assert units_of(TWO_FAMILIES[:3]).labels == ["cup:scene=1", "cup:scene=2"]
    units = units_of(TWO_FAMILIES, "scene")
    assert (units.unit_kind, len(units), units.n_families) == ("scene", 3, 2)
    assert units.scope == "for new scenes of these sequences only"
    np.testing.assert_allclose(units.means([0.1, 0.2, 0.3, 0.8]), [0.1, 0.25, 0.8])


def test_units_of_recorded_sequences_are_sequences():
    units = units_of(["samples/box", "samples/cup"])
    assert (units.unit_kind, units.scope) == (
        "sequence",
        "for new sequences of the same kind as these",
    )
    assert units_of(["box"]).unit_kind == "sequence"
