"""Regressions: against SciPy, and how often they are found and made up."""

import numpy as np
import pytest
from scipy import stats

from bench.statistics.regression import Sample, judge, repetitions_for, repetitions_needed

DETECT = 0.05


def sample(values):
    return Sample(float(np.mean(values)), float(np.std(values, ddof=1)), len(values))


def test_a_cell_is_judged_by_welchs_test():
    generator = np.random.default_rng(0)
    before, after = generator.normal(0.6, 0.02, 12), generator.normal(0.5, 0.05, 8)
    found = judge([(sample(before), sample(after))], [False], 0.01, DETECT)
    expected = stats.ttest_ind(after, before, equal_var=False, alternative="less")
    (change,) = found.changes
    assert (change.p, found.p) == pytest.approx((expected.pvalue, expected.pvalue))
    assert change.high == pytest.approx(expected.confidence_interval(0.95).high)
    assert found.state == change.state == "worse"


def test_what_never_draws_needs_no_test():
    cells = [(Sample(0.5, 0.0, 1), Sample(now, 0.0, 1)) for now in (0.5, 0.495, 0.4, 0.6)]
    found = judge(cells, [True, False, False, False], 0.01, DETECT)
    assert [c.state for c in found.changes] == ["identical", "changed, no worse", "worse", "better"]
    assert found.state == "worse"
    assert np.isnan(found.p)


def test_a_drop_within_the_margin_is_none_however_sure():
    cells = [(Sample(0.5, 0.001, 20), Sample(0.495, 0.001, 20))]
    assert judge(cells, [False], 0.01, DETECT).state == "changed, no worse"


def test_too_few_repetitions_cannot_tell_and_a_small_drop_everywhere_is_found_together():
    one = (Sample(0.5, 0.1, 10), Sample(0.48, 0.1, 10))
    assert judge([one], [False], 0.01, DETECT).state == "cannot tell"
    many = judge([one] * 80, [False] * 80, 0.01, DETECT)
    assert many.state == "worse"
    assert {change.state for change in many.changes} == {"cannot tell"}


def test_identical_cells_are_not_tested():
    found = judge([(Sample(0.5, 0.1, 3), Sample(0.5, 0.1, 3))], [True], 0.01, DETECT)
    assert found.state == "identical"
    assert np.isnan(found.changes[0].p)
    assert judge([], [], 0.01, DETECT).state == "identical"


def test_a_spread_needs_two_repetitions():
    with pytest.raises(ValueError, match="two repetitions"):
        judge([(Sample(0.5, 0.1, 1), Sample(0.5, 0.0, 1))], [False], 0.01, DETECT)


def test_needs_grow_with_the_spread_and_a_small_baseline_can_make_them_endless():
    few, many = Sample(0.5, 0.1, 10), Sample(0.5, 0.1, 1000)
    assert repetitions_needed(few, few, DETECT, 8) == np.inf
    assert repetitions_for(few, DETECT, 8) < repetitions_for(few, DETECT / 2, 8)
    # As many on both sides as the design asks for: nothing is lacking.
    n = repetitions_for(few, DETECT, 8)
    assert repetitions_needed(Sample(0.5, 0.1, n), Sample(0.5, 0.1, n), DETECT, 8) <= n
    assert repetitions_needed(many, many, DETECT, 8) < n


@pytest.mark.slow
@pytest.mark.parametrize("spread", [0.03, 0.08, 0.15])
def test_planted_drops_are_found_and_unchanged_trackers_pass(spread):
    """A drop of .05 on three of eight sequences, with the repetitions that the design asks for."""
    generator = np.random.default_rng(int(spread * 100))
    rounds, found = 300, {0.0: 0, 0.05: 0}
    for drop in found:
        for _ in range(rounds):
            cells = []
            for cell in range(8):
                mean = generator.uniform(0.3, 0.8)
                before = generator.normal(mean, spread, 5)
                needed = repetitions_for(sample(before), DETECT, 8)
                before = np.append(before, generator.normal(mean, spread, max(0, needed - 5)))
                needed = repetitions_for(sample(before), DETECT, 8)
                before = np.append(
                    before, generator.normal(mean, spread, max(0, needed - len(before)))
                )
                after = generator.normal(mean - drop * (cell < 3), spread, len(before))
                cells.append((sample(before), sample(after)))
            found[drop] += judge(cells, [False] * 8, 0.01, DETECT).state == "worse"
    assert found[0.05] / rounds >= 0.8
    assert found[0.0] / rounds <= 0.06
