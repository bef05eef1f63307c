"""Decision rules: reference values, agreement of decision and interval, and all reasons."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from trackmark.bench.statistics.rules import (
    MARGIN,
    MIN_UNITS,
    approximate,
    decide,
    p_value,
    star_marks,
    units_needed,
)

EIGHT = [0.12, 0.08, 0.15, -0.02, 0.2, 0.05, 0.11, 0.09]
differences = st.lists(st.floats(-1, 1, width=32), min_size=MIN_UNITS, max_size=40)


@given(differences, st.integers(1, 15))
def test_answer_never_contradicts_printed_interval(values, comparisons):
    answer = decide(values, comparisons=comparisons)
    low, high = answer.interval
    excludes_zero = low > 0 or high < 0
    assert (answer.label in ("better", "worse")) <= excludes_zero
    assert (answer.label == "equivalent") == (max(-low, high) <= MARGIN and len(values) >= 30)
    assert (answer.label == "inconclusive") == bool(answer.reason)
    assert decide(np.negative(values), comparisons=comparisons).label == {
        "better": "worse",
        "worse": "better",
    }.get(answer.label, answer.label)


@given(differences, st.integers(1, 15))
def test_p_value_is_below_level_iff_interval_excludes_zero(values, comparisons):
    assume(np.ptp(values) > 1e-6)
    p = p_value(values, comparisons)
    assume(abs(p - 0.05) > 1e-6)
    low, high = decide(values, comparisons=comparisons).interval
    assert (p < 0.05) == (low > 0 or high < 0)


@pytest.mark.parametrize(
    ("values", "comparisons", "label", "reason"),
    [
        (EIGHT, 1, "better", ""),
        (np.negative(EIGHT), 6, "worse", ""),
        (EIGHT[:5], 1, "inconclusive", "only 5 of 6 sequences"),
        ([0.001, -0.001] * 15, 1, "equivalent", ""),
        ([0.001, -0.001] * 4, 1, "inconclusive", "inside ±0.01, but only 8 of 30 sequences"),
        ([0.1] * 6, 1, "better", ""),
        (
            [0.1] * 6,
            6,
            "inconclusive",
            "the same difference on all 6 sequences, too few for 6 comparisons",
        ),
    ],
)
def test_decide_labels_and_reasons(values, comparisons, label, reason):
    answer = decide(values, comparisons=comparisons)
    assert (answer.label, answer.reason) == (label, reason)


def test_units_needed_matches_documented_examples():
    assert approximate(units_needed(-0.094, (-0.180, 0.010), 8, 0.01)) == "about 19"
    assert approximate(units_needed(0.031, (-0.012, 0.071), 20, 0.02)) == "about 75"
    assert approximate(units_needed(0.002, (-0.1, 0.104), 8, 0.01)) == "more than 500"
    # To be inside the margin: 30 (0.012 / (0.01 - 0.002))².
    assert units_needed(0.002, (-0.010, 0.014), 30, 0.01) == pytest.approx(67.5)


def test_p_value_of_equal_differences_is_a_sign_test():
    assert p_value([0.1] * 6) == 2**-5
    assert p_value([-0.1] * 6, comparisons=3) == 3 * 2**-5
    assert p_value([0.0] * 6) == 1.0


@given(st.integers(0, 10**6), st.integers(4, 12), st.booleans())
def test_star_marks_agree_with_decide_over_all_pairs(seed, n, constant):
    generator = np.random.default_rng(seed)
    spread = 0.0 if constant else 0.05
    values = generator.normal(0.5, spread, (4, n)) + generator.choice([0, 0.005, 0.1], 4)[:, None]
    answers = {
        (first, second): decide(values[first] - values[second], comparisons=6).label
        for first, second in combinations(range(4), 2)
    }
    worse = {pair[label == "better"] for pair, label in answers.items() if label != "inconclusive"}
    expected = [n >= MIN_UNITS and tracker not in worse for tracker in range(4)]
    assert star_marks(values) == expected
    assert star_marks(-values, higher=False) == expected
