"""Intervals of a mean and of a share: coverage, closed forms and refused values."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from trackmark.bench.statistics.intervals import interval_ends, mean_interval, share_interval

POPULATIONS = {
    "normal": (lambda g, shape: g.normal(0.05, 0.1, shape), 0.05),
    "U-shaped": (lambda g, shape: g.beta(0.4, 0.4, shape) - 0.5, 0.0),
    "half lost": (
        lambda g, shape: np.where(
            g.random(shape) < 0.5, g.normal(0, 0.01, shape), g.normal(0.4, 0.15, shape)
        ),
        0.2,
    ),
}


@pytest.mark.parametrize("n", [6, 8, 20])
@pytest.mark.parametrize("population", POPULATIONS)
def test_mean_interval_covers_at_its_level(population, n):
    draw, mean = POPULATIONS[population]
    low, high = interval_ends(draw(np.random.default_rng(n), (4000, n)))
    assert 0.94 <= ((low <= mean) & (mean <= high)).mean() <= 0.999


def test_mean_interval_contains_student_and_hall():
    cells = np.array([0.0, 0.02, 0.01, 0.4, 0.03, 0.0, 0.1, 0.05])
    n, error = len(cells), cells.std(ddof=1) / np.sqrt(8)
    student = stats.ttest_1samp(cells, 0).confidence_interval(0.95)
    low, high = mean_interval(cells)
    assert low == pytest.approx(student.low)
    # The transformed t at Hall's upper end, by its cubic polynomial, is Student's quantile.
    a, t = stats.skew(cells) / np.sqrt(n), (cells.mean() - high) / error
    transformed = t + a * t**2 / 3 + a**2 * t**3 / 27 + a / 6
    assert transformed == pytest.approx(stats.t.ppf(0.025, n - 1))
    assert mean_interval(-cells) == pytest.approx((-high, -low))
    assert mean_interval([0.5] * 9) == (0.5, 0.5)


@given(st.integers(0, 40), st.integers(1, 40))
def test_share_interval_agrees_with_scipy(successes, more):
    trials = successes + more
    expected = stats.binomtest(successes, trials).proportion_ci(method="exact")
    interval = share_interval(successes, trials)
    assert interval == pytest.approx((expected.low, expected.high), abs=1e-9)


@pytest.mark.parametrize("values", [[1.0], [], [1.0, np.nan], [1.0, np.inf], [[1.0, 2.0]]])
def test_mean_interval_rejects_unusable_values(values):
    with pytest.raises(ValueError, match="Expected: "):
        mean_interval(values)
