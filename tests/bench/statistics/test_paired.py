"""Paired comparisons: against SciPy, brute force and published examples, and how often they err."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from bench.statistics.intervals import mean_interval
from bench.statistics.paired import (
    cells_mean,
    cells_needed,
    critical_difference,
    holm,
    probability_better,
    scores_interval,
    signed_rank,
    smallest_p,
)

steps = st.lists(st.integers(-6, 6), min_size=1, max_size=9)


@given(steps)
def test_signed_rank_is_the_share_of_signs_that_are_as_far_out(given_steps):
    values = [step for step in given_steps if step]
    ranks = stats.rankdata(np.abs(values))
    sums = [(np.array(signs) * ranks).sum() for signs in product((0, 1), repeat=len(values))]
    observed = ranks[np.array(values) > 0].sum() if values else 0.0
    below, above = np.mean(np.array(sums) <= observed), np.mean(np.array(sums) >= observed)
    # The unit does not matter, nor do the last digits.
    assert signed_rank(0.1 * np.array(given_steps)) == pytest.approx(
        min(1.0, 2 * min(below, above))
    )


def test_signed_rank_agrees_with_scipy_where_nothing_ties():
    values = np.random.default_rng(0).normal(0.3, 1, 25)
    assert signed_rank(values) == pytest.approx(stats.wilcoxon(values, method="exact").pvalue)
    assert signed_rank([0.0, 0.0]) == 1.0


@pytest.mark.parametrize("n", [5, 8, 11])
def test_the_smallest_p_is_that_of_equal_signs(n):
    assert signed_rank(np.arange(1.0, n + 1)) == smallest_p(n)


def test_holm_is_what_statsmodels_gives():
    # multipletests([.01, .04, .03, .005, .9], method="holm")
    expected = [0.04, 0.09, 0.09, 0.025, 0.9]
    assert holm([0.01, 0.04, 0.03, 0.005, 0.9]) == pytest.approx(expected)


def test_critical_differences_are_those_of_demsar():
    # His table 5: q of 2.343, 2.728, 3.164 for 3, 5, 10 methods.
    for methods, quantile in ((3, 2.343), (5, 2.728), (10, 3.164)):
        found = critical_difference(methods, 20) / np.sqrt(methods * (methods + 1) / 120)
        assert found == pytest.approx(quantile, abs=1e-3)


def test_the_mean_over_given_cells_is_welchs_for_one_cell():
    first, second = np.array([1.0, 2.0, 4.0, 4.5]), np.array([0.0, 1.0, 0.5])
    found = cells_mean([first], [second])
    expected = stats.ttest_ind(first, second, equal_var=False)
    assert found.p == pytest.approx(expected.pvalue)
    assert found.interval == pytest.approx(tuple(expected.confidence_interval()))


def test_cells_that_never_draw_add_no_doubt():
    assert cells_mean([[1.0], [3.0]]).interval == (2.0, 2.0)
    one = cells_mean([[1.0, 2.0, 3.0]]).interval
    two = cells_mean([[1.0, 2.0, 3.0], [2.0]]).interval
    assert two == pytest.approx((2 - (2 - one.low) / 2, 2 + (one.high - 2) / 2))


def test_ties_are_half_won():
    share, interval = probability_better([0.1, 0.0, 0.0, -0.2])
    assert share == 0.5
    assert interval.low < 0.5 < interval.high


def test_what_was_asked_for_shows_the_difference_in_four_cases_of_five():
    generator = np.random.default_rng(5)
    for difference, tests in ((0.05, 1), (0.1, 1), (0.05, 10)):
        needed = int(cells_needed(difference, 0.1, margin=0.01, tests=tests))
        draws = generator.normal(difference, 0.1, (1000, needed))
        assert np.mean([signed_rank(row) * tests < 0.05 for row in draws]) == pytest.approx(
            0.8, abs=0.05
        )
    # Within the margin the aim is an interval that lies in it.
    for difference in (0.0, 0.005):
        needed = int(cells_needed(difference, 0.1, margin=0.02))
        draws = generator.normal(difference, 0.1, (1000, needed))
        equal = np.mean([mean_interval(row).inside(0.02) for row in draws])
        assert 0.76 <= equal <= 0.93  # more where one end alone is near
    assert cells_needed(0.01, 0.1, margin=0.01) == np.inf
    assert cells_needed(1.0, 0.1, margin=0.01, tests=45) == 11  # fewer can't reach p < .05 / 45


def test_the_interval_of_a_score_has_one_degree_less_than_students():
    scores = np.array([0.1, 0.9, 0.8, 0.2, 0.7])
    half = stats.t.ppf(0.975, 3) * stats.sem(scores)
    assert scores_interval(scores) == pytest.approx((scores.mean() - half, scores.mean() + half))


LOST_SHARE = 0.5
POPULATIONS = {
    "normal": lambda g, shape: g.normal(0.5, 0.1, shape),
    "U-shaped": lambda g, shape: g.beta(0.5, 0.5, shape),
    "half lost": lambda g, shape: np.where(
        g.random(shape) < LOST_SHARE, g.normal(0.05, 0.03, shape), g.normal(0.65, 0.08, shape)
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("n", [5, 8, 20])
@pytest.mark.parametrize("population", POPULATIONS)
def test_what_is_printed_covers_and_equal_trackers_are_called_different_rarely(population, n):
    generator = np.random.default_rng(n)
    draw = POPULATIONS[population]
    first, second = draw(generator, (4000, n)), draw(generator, (4000, n))
    differences = first - second
    intervals = [mean_interval(row) for row in differences]
    assert 0.93 <= np.mean([low <= 0 <= high for low, high in intervals]) <= 0.975
    own, mean = [scores_interval(row) for row in first], draw(generator, 10**6).mean()
    assert 0.925 <= np.mean([low <= mean <= high for low, high in own]) <= 0.975
    # Wilson's interval jumps: 93 % at most can be had for one half of 8 or 5.
    shares = [probability_better(row)[1] for row in differences]
    assert 0.92 <= np.mean([low <= 0.5 <= high for low, high in shares]) <= 0.97
    assert np.mean([signed_rank(row) < 0.05 for row in differences]) <= 0.06


@pytest.mark.slow
@pytest.mark.parametrize("spread", [0.02, 0.15])
@pytest.mark.parametrize("cells", [2, 8])
def test_intervals_over_new_seeds_cover(cells, spread):
    generator = np.random.default_rng(1)
    truth = generator.uniform(0.2, 0.8, cells)
    hits = 0
    for _ in range(3000):
        low, high = cells_mean(generator.normal(truth, spread, (6, cells)).T).interval
        hits += low <= truth.mean() <= high
    assert 0.93 <= hits / 3000 <= 0.97


@pytest.mark.slow
def test_pooled_frames_call_equal_trackers_different():
    """Why frames are not the unit: overlaps of neighbouring frames are nearly the same number."""
    generator = np.random.default_rng(0)
    pooled = by_sequence = 0
    for _ in range(300):
        noise = generator.normal(0, 1, (2, 10, 300))
        for frame in range(1, 300):
            noise[..., frame] = (
                0.95 * noise[..., frame - 1] + np.sqrt(1 - 0.95**2) * noise[..., frame]
            )
        difference = noise[0] - noise[1]
        pooled += stats.wilcoxon(difference.ravel()).pvalue < 0.05
        by_sequence += signed_rank(difference.mean(axis=1)) < 0.05
    assert pooled / 300 > 0.6
    assert by_sequence / 300 < 0.08
