"""Decision rules: reference values, agreement of decision and interval, and all reasons."""

from itertools import combinations
from math import inf

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from trackmark.bench.statistics.intervals import Interval
from trackmark.bench.statistics.rules import (
    CLAIM_MARGIN,
    MARGIN,
    MIN_UNITS,
    decide,
    in_words,
    p_value,
    star_marks,
    units_for_small,
    units_needed,
)

EIGHT = [0.12, 0.08, 0.15, -0.02, 0.2, 0.05, 0.11, 0.09]
differences = st.lists(st.floats(-1, 1, width=32), min_size=MIN_UNITS, max_size=100)


@given(differences, st.integers(1, 15))
def test_answer_never_contradicts_printed_interval(values, comparisons):
    answer = decide(values, comparisons=comparisons)
    low, high = answer.interval
    excludes_zero = low > 0 or high < 0
    assert (answer.label in ("better", "worse")) <= excludes_zero
    assert (answer.label == "equivalent") == (max(-low, high) <= MARGIN and len(values) >= 89)
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
        ([0.001, -0.001] * 45, 1, "equivalent", ""),
        (
            [0.001, -0.001] * 15,
            1,
            "inconclusive",
            "inside ±0.01; a difference on 1 sequence in 20 would be missed in 21 %",
        ),
        ([0.1] * 6, 1, "better", ""),
        ([0.1, 0.1 + 1e-7] * 3, 1, "better", ""),
        (
            [0.1, 0.1 + 1e-7] * 3,
            6,
            "inconclusive",
            "the same difference on all 6 sequences, too few for 6 comparisons",
        ),
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


@pytest.mark.parametrize(
    ("margin", "limit", "n"),
    [
        (MARGIN, 1.0, 89),
        (CLAIM_MARGIN, 1.0, 44),
        (0.005, 1.0, 179),
        (0.3, 1.0, MIN_UNITS),
        (0.0, 1.0, inf),
        (0.5, inf, 44),  # pixels
        (1.5, 20.0, 44),  # numbers of clips
    ],
)
def test_small_difference_needs_units_by_its_margin(margin, limit, n):
    assert units_for_small(margin, limit) == n
    if n < inf:
        values = np.tile([margin / 10, -margin / 10], 100)
        assert decide(values[:n], margin, limit=limit).label == "equivalent"
        assert decide(values[: n - 1], margin, limit=limit).label == "inconclusive"


def test_units_needed_are_a_range_or_unknown():
    interval, likely = (-0.180, 0.010), (-0.123, -0.065)
    # 8 (1.4 (0.094 + 0.010) / 0.123)² and, for 0.065, 40.1.
    needed = units_needed(-0.094, Interval(*interval), Interval(*likely), 8, 0.01)
    assert needed == pytest.approx((11.2, 40.1), abs=0.1)
    assert in_words(needed, "sequences") == "11 to 40 sequences needed"
    likely = Interval(-0.03, 0.034)
    assert units_needed(0.002, Interval(-0.1, 0.104), likely, 8, 0.01) is None
    # To be inside the margin: 30 (0.012 / (0.01 - 0.003))², but 89 at least.
    likely = Interval(0.001, 0.003)
    needed = units_needed(0.002, Interval(-0.010, 0.014), likely, 30, 0.01, 40)
    assert needed == pytest.approx((53.3, 88.2), abs=0.1)


def test_decide_gives_a_range_of_units_or_no_estimate():
    clear = [0.1, 0.3, -0.1, 0.25, 0.2, -0.05, 0.1, 0.15]
    decision = decide(clear, comparisons=6)
    assert decision.reason == "interval contains 0; 32 to 110 sequences needed"
    assert decision.needed == pytest.approx((32.1, 113.8), abs=0.1)
    unclear = [0.1, -0.3, 0.2, 0.25, -0.2, -0.05, 0.1, -0.05]
    reason = decide(unclear).reason
    assert reason == "interval contains 0; no estimate of the sequences needed"


def test_p_value_of_equal_differences_is_a_sign_test():
    assert p_value([0.1] * 6) == 2**-5
    assert p_value([0.1, 0.1 + 1e-7] * 3) == 2**-5
    assert p_value([-0.1] * 6, comparisons=3) == 3 * 2**-5
    assert p_value([0.0] * 6) == p_value([1e-7] * 6) == 1.0


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
