"""Intervals: against closed forms and SciPy, and how often they cover."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from bench.statistics.intervals import (
    difference_interval,
    hall_interval,
    mean_interval,
    odds_ratio,
    prediction_interval,
    share_interval,
    wilson_interval,
)

POPULATIONS = {
    "normal": (lambda g, n: g.normal(0.05, 0.1, n), 0.05),
    "U-shaped": (lambda g, n: g.beta(0.4, 0.4, n) - 0.5, 0.0),
    "half lost": (
        lambda g, n: np.where(g.random(n) < 0.5, g.normal(0, 0.01, n), g.normal(0.4, 0.15, n)),
        0.2,
    ),
}


def bootstrap_t_interval(cells, generator):
    """Of one mean: that of its difference from a group that is surely 0."""
    return difference_interval(cells, [0.0, 0.0], generator)


def coverage(interval, draw, mean, n, rounds):
    generator = np.random.default_rng(n)
    hits = 0
    for _ in range(rounds):
        low, high = interval(draw(generator, n), generator)
        hits += low <= mean <= high
    return hits / rounds


@pytest.mark.parametrize("n", [5, 8, 20])
@pytest.mark.parametrize("population", POPULATIONS)
def test_the_t_interval_covers_what_it_says(population, n):
    draw, mean = POPULATIONS[population]
    share = coverage(lambda cells, _: mean_interval(cells), draw, mean, n, 3000)
    assert (0.93 if n >= 8 else 0.905) <= share <= 0.97


@pytest.mark.slow
@pytest.mark.parametrize("n", [5, 8, 20])
@pytest.mark.parametrize("population", POPULATIONS)
def test_the_bootstrap_t_covers_no_less_and_is_not_the_default_for_being_wider(population, n):
    draw, mean = POPULATIONS[population]
    share = coverage(bootstrap_t_interval, draw, mean, n, 1000)
    assert 0.93 <= share <= 0.995


@pytest.mark.parametrize("population", POPULATIONS)
def test_the_difference_of_two_groups_is_covered(population):
    draw, mean = POPULATIONS[population]
    generator = np.random.default_rng(3)
    hits = 0
    for _ in range(400):
        first, second = draw(generator, 16), generator.normal(0.1, 0.3, 12)
        low, high = difference_interval(first, second, generator, resamples=500)
        hits += low <= mean - 0.1 <= high
    assert 0.92 <= hits / 400 <= 0.985


def test_t_agrees_with_scipy():
    cells = np.random.default_rng(0).normal(size=9)
    expected = stats.ttest_1samp(cells, 0).confidence_interval(0.9)
    assert mean_interval(cells, 0.9) == pytest.approx((expected.low, expected.high))


@given(st.lists(st.tuples(st.integers(0, 9), st.integers(1, 9)), min_size=1, max_size=12))
def test_a_share_lies_in_its_interval_and_losses_mirror_successes(counts):
    good = [successes for successes, _ in counts]
    runs = [successes + more for successes, more in counts]
    low, high = share_interval(good, runs)
    assert 0 <= low < high <= 1
    lost = [more for _, more in counts]
    assert share_interval(lost, runs) == pytest.approx((1 - high, 1 - low), abs=1e-9)


def test_an_interval_for_what_may_be_skewed_is_halls():
    """Its ends are where the transformed t, by its cubic polynomial, is that of Student."""
    cells = np.array([0.0, 0.02, 0.01, 0.4, 0.03, 0.0, 0.1, 0.05])
    n, error = len(cells), cells.std(ddof=1) / np.sqrt(8)
    a = stats.skew(cells) / np.sqrt(n)
    low, high = hall_interval(cells)
    for end, quantile in ((low, 0.975), (high, 0.025)):
        t = (cells.mean() - end) / error
        assert t + a * t**2 / 3 + a**2 * t**3 / 27 + a / 6 == pytest.approx(
            stats.t.ppf(quantile, n - 1)
        )
    assert high - cells.mean() > 2 * (cells.mean() - low)  # towards the tail
    assert hall_interval(-cells) == pytest.approx((-high, -low))
    even = [1.0, 2.0, 3.0, 4.0]
    assert hall_interval(even) == pytest.approx(mean_interval(even))
    assert hall_interval([0.5] * 9) == (0.5, 0.5)


def test_single_trials_are_the_beta_posterior_of_a_flat_prior():
    low, high = stats.beta.ppf([0.018, 0.982], 1 + 9, 1 + 3)
    assert share_interval([1] * 9 + [0] * 3, [1] * 12) == pytest.approx((low, high), abs=1e-3)


@given(st.integers(0, 40), st.integers(1, 40))
def test_wilson_agrees_with_scipy(successes, more):
    trials = successes + more
    expected = stats.binomtest(successes, trials).proportion_ci(method="wilson")
    assert wilson_interval(successes / trials, trials) == pytest.approx(
        (expected.low, expected.high), abs=1e-12
    )


def test_a_prediction_interval_is_the_closed_form():
    half = stats.t.ppf(0.975, 2) * np.sqrt(4 / 3)
    assert prediction_interval([1.0, 2.0, 3.0]) == pytest.approx((2 - half, 2 + half))


def test_a_prediction_interval_holds_one_more_run():
    generator = np.random.default_rng(5)
    hits = 0
    for _ in range(3000):
        values = generator.normal(size=7)
        low, high = prediction_interval(values[:6])
        hits += low <= values[6] <= high
    assert hits / 3000 == pytest.approx(0.95, abs=0.015)


def test_bootstrap_t_draws_from_the_generator_alone():
    cells = np.arange(9.0)
    one, two = (bootstrap_t_interval(cells, np.random.default_rng(1)) for _ in range(2))
    assert one == two
    assert one != bootstrap_t_interval(cells, np.random.default_rng(2))


def test_bootstrap_t_of_a_constant_is_a_point_and_of_two_values_is_endless():
    generator = np.random.default_rng(0)
    assert bootstrap_t_interval([2.0] * 8, generator) == (2.0, 2.0)
    assert np.isinf(bootstrap_t_interval([0.0, 1.0], generator)).all()


@pytest.mark.parametrize("values", [[1.0], [], [1.0, np.nan], [1.0, np.inf], [[1.0, 2.0]]])
def test_too_few_or_no_numbers_are_refused(values):
    for interval in (mean_interval, prediction_interval):
        with pytest.raises(ValueError, match="an interval needs"):
            interval(values)
    with pytest.raises(ValueError, match="an interval needs"):
        bootstrap_t_interval(values, np.random.default_rng(0))


@pytest.mark.parametrize(("share", "trials"), [(-0.1, 5), (1.1, 5), (0.5, 0)])
def test_a_share_that_is_none_is_refused(share, trials):
    with pytest.raises(ValueError, match="a share of"):
        wilson_interval(share, trials)


def test_an_odds_ratio_is_that_of_all_cells_and_its_interval_covers():
    ratio, around = odds_ratio(*np.array([[100, 50, 40, 10], [100, 50, 40, 10]], float).T)
    assert ratio == pytest.approx(3, rel=0.03)
    assert around.low == pytest.approx(around.high, rel=0.01)  # cells that are all alike
    generator = np.random.default_rng(0)
    inside = []
    for _ in range(400):
        trials = np.array([generator.integers(100, 900, 40), np.r_[[100] * 16, [0] * 24]], float)
        shares = generator.beta([[2.0], [0.5]], [[2.0], [2.5]], (2, 40))  # odds of 1 and of 1 to 5
        counts = generator.binomial(trials.astype(int), shares).astype(float)
        _, (low, high) = odds_ratio(trials[0], counts[0], trials[1], counts[1])
        inside.append(low <= 5 <= high)
    assert 0.9 < np.mean(inside) < 0.98
