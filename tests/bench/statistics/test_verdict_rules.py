"""Rules of verdicts: all kinds and reasons, claims with parts, and power."""

from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trackmark.bench.statistics.intervals import mean_interval, share_interval
from trackmark.bench.statistics.rules import CLAIM_MARGIN, MIN_SCENES
from trackmark.bench.statistics.verdict_rules import (
    Verdict,
    at_ceiling,
    at_floor,
    conjunction,
    inconclusive,
    kept_interval,
    no_worse,
    order,
    share,
)

SPREAD = np.tile([-0.03, 0.01, -0.01, 0.03], 11)
"""Differences of 44 scenes with mean 0."""


def shifted(n, mean, spread=1.0):
    return mean + spread * SPREAD[:n]


@pytest.mark.parametrize(
    ("values", "verdict", "reason"),
    [
        (shifted(20, 0.10), "holds", "interval above 0"),
        (shifted(20, -0.10), "does not hold", "interval below 0"),
        (shifted(44, 0.004), "does not hold", "interval inside ±0.02: too small to matter"),
        (
            shifted(43, 0.004),
            "inconclusive",
            "inside ±0.02; a difference on 1 scene in 20 would be missed in 11 %",
        ),
        (shifted(20, 0.03, 5), "inconclusive", "interval contains 0; 50 to 740 scenes needed"),
        (shifted(8, 0.10), "inconclusive", "only 8 of 12 scenes"),
        ([], "inconclusive", "only 0 of 12 scenes"),
    ],
)
def test_order_verdict_and_reason(values, verdict, reason):
    judged = order(values)
    assert (judged.verdict, judged.reason) == (verdict, reason)
    assert judged.n_units == len(values)


@pytest.mark.parametrize(
    ("values", "verdict", "reason"),
    [
        (shifted(44, 0.0), "holds", "not worse by more than 0.02"),
        (shifted(20, 0.03), "holds", "not worse by more than 0.02"),
        (shifted(20, -0.05), "does not hold", "worse by more than 0.02"),
        (
            shifted(43, 0.0),
            "inconclusive",
            "inside ±0.02; a difference on 1 scene in 20 would be missed in 11 %",
        ),
        (
            shifted(16, 0.012),
            "inconclusive",
            "above -0.02; a difference on 1 scene in 20 would be missed in 44 %",
        ),
        (
            shifted(20, -0.03, 3),
            "inconclusive",
            "interval contains -0.02",
        ),
        (shifted(11, 0.1), "inconclusive", "only 11 of 12 scenes"),
    ],
)
def test_no_worse_verdict_and_reason(values, verdict, reason):
    judged = no_worse(values)
    assert (judged.verdict, judged.reason) == (verdict, reason)


@pytest.mark.parametrize(
    ("good", "n", "limit", "verdict", "reason"),
    [
        (24, 24, 0.5, "holds", "interval above 0.5"),
        (2, 20, 0.5, "does not hold", "interval below 0.5"),
        (
            14,
            20,
            0.5,
            "inconclusive",
            "interval contains 0.5; 29 to 230 scenes needed",
        ),
        (
            10,
            20,
            0.5,
            "inconclusive",
            "interval contains 0.5",
        ),
        (19, 20, 0.75, "holds", "interval above 0.75"),
        (11, 11, 0.5, "inconclusive", "only 11 of 12 scenes"),
    ],
)
def test_share_verdict_and_reason(good, n, limit, verdict, reason):
    judged = share([True] * good + [False] * (n - good), limit)
    assert (judged.verdict, judged.reason) == (verdict, reason)
    assert judged.statistic == pytest.approx(good / n)


def test_kept_interval_is_that_of_a_share_or_of_a_mean():
    assert kept_interval([1.0] * 23) == pytest.approx((np.nan, np.nan), nan_ok=True)
    assert kept_interval([1.0] * 20 + [0.0] * 4) == share_interval(20, 24)
    members = np.linspace(0.9, 1.0, 24)  # of sets
    low, high = mean_interval(members)
    assert kept_interval(members, sets=True) == (low, min(high, 1.0))


@pytest.mark.parametrize(
    ("n_kept", "n", "floor", "ceiling"),
    [
        (0, 24, True, False),  # upper end 0.142
        (1, 24, False, False),  # upper end 0.211
        (24, 24, False, True),  # lower end 0.858
        (23, 24, False, False),  # lower end 0.789
        (31, 32, False, True),  # lower end 0.838
        (0, 23, False, False),  # too few scenes
        (23, 23, False, False),
    ],
)
def test_floor_and_ceiling_follow_from_exact_interval(n_kept, n, floor, ceiling):
    interval = kept_interval([1.0] * n_kept + [0.0] * (n - n_kept))
    assert (at_floor([interval]), at_ceiling([interval])) == (floor, ceiling)
    other = kept_interval([1.0] * 12 + [0.0] * 12)
    assert not at_floor([interval, other])
    assert not at_ceiling([interval, other])


decided = st.sampled_from([-0.3, -0.1, -0.04, 0.0, 0.04, 0.1, 0.3])


@given(decided, st.integers(0, 2**32 - 1))
def test_order_and_no_worse_decide_values_off_the_limit(mean, seed):
    values = np.random.default_rng(seed).normal(mean, 0.05, 400)
    assert order(values).verdict == ("holds" if mean > 0 else "does not hold")
    assert no_worse(values).verdict == ("holds" if mean > -CLAIM_MARGIN else "does not hold")


differences = st.lists(st.floats(-1, 1, width=32), min_size=MIN_SCENES, max_size=60)


@given(differences)
def test_verdict_never_contradicts_printed_interval(values):
    judged = order(values)
    low, high = judged.interval
    assert (judged.verdict == "holds") <= (low > 0)
    assert (judged.verdict == "does not hold") <= (high < 0 or max(-low, high) <= CLAIM_MARGIN)
    compared = no_worse(values)
    assert compared.interval == judged.interval
    assert (compared.verdict == "holds") <= (low > -CLAIM_MARGIN)
    assert (compared.verdict == "does not hold") == (high < -CLAIM_MARGIN)


def fixed(verdict):
    return lambda comparisons: verdict


HOLDS, FAILS = Verdict("holds", 1.0), Verdict("does not hold", 0.0, reason="interval below 0.5")
OPEN = inconclusive("not run: experiment speed")


@pytest.mark.parametrize(
    ("parts", "verdict", "reason"),
    [
        ([HOLDS, HOLDS], "holds", "all 2 parts hold"),
        ([HOLDS, OPEN], "inconclusive", "part b: not run: experiment speed"),
        ([OPEN, FAILS], "does not hold", "part b: interval below 0.5; interval at 97.5 %"),
    ],
)
def test_conjunction_verdict_and_reason(parts, verdict, reason):
    judged = conjunction(dict(zip("abc", map(fixed, parts), strict=False)))
    assert (judged.verdict, judged.reason) == (verdict, reason)


def test_part_fails_with_its_interval_corrected_for_the_parts():
    values = shifted(12, -0.0385)
    assert no_worse(values).verdict == "does not hold"
    parts = {"weak": partial(no_worse, values, CLAIM_MARGIN)}
    parts |= {name: fixed(HOLDS) for name in "abcd"}
    judged = conjunction(parts)
    assert judged.verdict == "inconclusive"
    assert judged.reason.startswith("part weak: interval contains -0.02")
    assert judged.interval == mean_interval(values, 0.99)


def test_effect_has_two_digits_of_the_interval():
    judged = Verdict("holds", 0.12345, share_interval(24, 24), 24, estimate_name="kept", unit="x")
    assert judged.effect == "kept: 0.123 [0.858, 1.000] x, 24 scenes"
    assert Verdict("holds", -1e-9, mean_interval([0.0, 1.0] * 8), 1).effect.startswith("0.00 [")
    assert inconclusive("not run").effect == ""


def test_values_that_cannot_be_judged_are_rejected():
    with pytest.raises(ValueError, match="finite"):
        order([np.nan] * 12)
