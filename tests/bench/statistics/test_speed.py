"""Slowdowns: how often they are found and made up, on times as a busy machine gives them."""

from functools import partial
from math import log, log1p

import numpy as np
import pytest
from scipy import stats

from bench.statistics.regression import Sample
from bench.statistics.speed import (
    FEWEST_SESSIONS,
    judge_pace,
    log_ratio,
    sample_of,
    sessions_for,
    sessions_lacking,
    sessions_needed,
)


def sample(change, spread=0.01, n=8):
    return Sample(log1p(change), spread, n)


@pytest.mark.parametrize(
    ("change", "spread", "n", "state"),
    [
        (0.0, 0.01, 8, "as fast"),
        (0.008, 0.001, 50, "as fast"),  # sure, and too little to mean anything
        (0.05, 0.01, 8, "slower"),
        (-0.05, 0.01, 8, "faster"),
        (1.0, 0.1, 6, "slower"),
        (0.03, 0.04, 6, "cannot tell"),
        (0.05, 0.08, 6, "cannot tell"),
        (0.5, 0.0, 6, "slower"),  # a clock that ticks slowly
    ],
)
def test_one_side_against_the_other(change, spread, n, state):
    assert judge_pace(sample(change, spread, n)).state == state


def test_beside_a_baseline_it_is_welchs_test():
    generator = np.random.default_rng(0)
    before, now = generator.normal(-3, 0.03, 12), generator.normal(-2.95, 0.01, 7)
    found = judge_pace(sample_of(now), sample_of(before))
    interval = stats.ttest_ind(now, before, equal_var=False).confidence_interval(0.95)
    assert np.log1p([found.low, found.high]) == pytest.approx([interval.low, interval.high])
    assert log1p(found.change) == pytest.approx(now.mean() - before.mean())


def test_trackers_share_the_false_alarms():
    seen = sample(0.04, 0.015, 6)
    assert [judge_pace(seen, tests=tests).state for tests in (1, 100)] == ["slower", "cannot tell"]
    assert sessions_needed(seen, tests=100) > sessions_needed(seen)


def test_sessions_are_added_until_their_spread_is_outweighed():
    assert sessions_needed(sample(0, 0.005)) == FEWEST_SESSIONS
    n = sessions_needed(sample(0, 0.05))
    assert n > 20
    assert sessions_needed(sample(0, 0.05), sample(0, 0.05, 6)) == np.inf
    assert sessions_needed(sample(0, 0.05), sample(0, 0.05, 1000)) == pytest.approx(n, rel=0.1)
    enough = sessions_for(sample(0, 0.05))
    assert sessions_needed(sample(0, 0.05), sample(0, 0.05, enough)) <= enough
    assert sessions_lacking([], sessions_needed) == FEWEST_SESSIONS
    assert sessions_lacking([0.0, 0.5] * 3, lambda _: 100.0) == 6
    assert sessions_lacking([0.0, 0.5] * 3, lambda _: np.inf) == 0


def test_bursts_on_one_side_are_not_its_time():
    times = np.full((2, 8, 4), 0.01)
    times[1] *= 1.05
    times[0, 5:] *= 3
    assert log_ratio(times) == pytest.approx(log(1.05))


def session(generator, ratio, busy, layout):
    """Times of two sides in turns, as they were recorded of one tracker on two busy cores.

    At `busy` 1 and `layout` 0.008: half of the turns are within 20 % of the lower quartile and one
    in a hundred takes twice as long; neighbours correlate by 0.3, sides by 0.2; sessions differ by
    7 % in both sides together, and by 1.1 % in their ratio.
    """
    passes, turns = 30, 16
    steps = passes * turns
    drift = np.cumsum(generator.normal(0, 0.004 * busy, steps))  # the processor's clock, say
    bursts = np.repeat(generator.random(steps // 8) < 0.2, 8) * generator.exponential(0.2 * busy)
    own = generator.exponential(0.11 * busy, (2, steps))
    jolts = (generator.random((2, steps)) < 0.01) * np.log1p(generator.pareto(2.0, (2, steps)))
    level = generator.normal(0, 0.07) + generator.normal(0, layout, (2, 1))
    logs = level + drift + bursts + own + jolts
    logs[1] += log(ratio)
    return np.exp(logs).reshape(2, passes, turns)


@pytest.mark.slow
@pytest.mark.parametrize(("busy", "layout"), [(0.3, 0.008), (1, 0.008), (2, 0.008), (1, 0.025)])
@pytest.mark.parametrize("kept", [False, True], ids=["against", "baseline"])
def test_slowdowns_of_5_percent_are_seen_and_unchanged_trackers_are_not_accused(busy, layout, kept):
    """In 95 % and in at most 1 % of cases, side by side or by a baseline's speed."""
    generator = np.random.default_rng(int(busy * 10) + kept)
    rounds, found = 500, {}

    def sampled(ratio, needed):
        logs = []
        while more := sessions_lacking(logs, needed):
            logs += [log_ratio(session(generator, ratio, busy, layout)) for _ in range(more)]
        return sample_of(logs)

    for ratio in (1.0, 1.05):
        states = []
        for _ in range(rounds):
            before = sampled(1.0, sessions_for) if kept else None
            now = sampled(ratio, partial(sessions_needed, before=before))
            states.append(judge_pace(now, before).state)
        found[ratio] = states.count("slower") / rounds
    assert found[1.05] >= 0.95
    assert found[1.0] <= 0.01
