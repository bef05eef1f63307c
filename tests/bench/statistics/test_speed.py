"""Detected and false slowdowns, on times as measured on a busy machine."""

from math import log, log1p

import numpy as np
import pytest
from scipy import stats

from trackmark.bench.statistics.speed import (
    MIN_SESSIONS,
    RatioSample,
    decide_speed,
    log_ratio,
    missing_sessions,
    ratio_sample,
    sessions_needed,
)


def sample(change, spread=0.01, n=8):
    return RatioSample(log1p(change), spread, n)


@pytest.mark.parametrize(
    ("change", "spread", "n", "state"),
    [
        (0.0, 0.01, 8, "not 5 % slower"),
        (0.008, 0.001, 50, "not 5 % slower"),  # significant, but irrelevant
        (0.05, 0.01, 8, "slower"),
        (-0.05, 0.01, 8, "faster"),
        (1.0, 0.1, 6, "slower"),
        (0.03, 0.018, 6, "not 5 % slower"),  # the interval ends at 4.94 %
        (0.03, 0.019, 6, "inconclusive"),  # at 5.05 %
        (0.5, 0.0, 6, "slower"),  # coarse clock
    ],
)
def test_log_ratio_compares_two_sides(change, spread, n, state):
    assert decide_speed(sample(change, spread, n)).decision == state


def test_pace_interval_is_students():
    logs = np.random.default_rng(0).normal(0.05, 0.02, 9)
    speed_change = decide_speed(ratio_sample(logs))
    interval = stats.ttest_1samp(logs, 0.0).confidence_interval(0.95)
    assert np.log1p([speed_change.low, speed_change.high]) == pytest.approx(
        [interval.low, interval.high]
    )
    assert log1p(speed_change.change) == pytest.approx(logs.mean())


def test_trackers_share_false_alarms():
    logs = sample(0.04, 0.015, 6)
    states = [decide_speed(logs, tests).decision for tests in (1, 100)]
    assert states == ["slower", "inconclusive"]
    assert sessions_needed(logs, tests=100) > sessions_needed(logs)


def test_sessions_are_added_until_their_spread_is_outweighed():
    assert sessions_needed(sample(0, 0.005)) == MIN_SESSIONS
    assert sessions_needed(sample(0, 0.05)) > 20
    assert sessions_needed(sample(0, 5.0)) == np.inf
    assert missing_sessions([]) == MIN_SESSIONS
    assert missing_sessions([0.0, 0.2] * 3) == 6
    assert missing_sessions([0.0, 9.0] * 3) == 0


def test_log_ratio_ignores_bursts_of_load():
    times = np.full((2, 8, 4), 0.01)
    times[1] *= 1.05
    times[0, 5:] *= 3
    assert log_ratio(times) == pytest.approx(log(1.05))


def session(generator, ratio, busy, layout):
    """Simulate interleaved times of two revisions, as recorded on two busy cores.

    At `busy` 1 and `layout` 0.008: half of the turns are within 20 % of the lower quartile and one
    in a hundred takes twice as long; neighbours correlate by 0.3, sides by 0.2; sessions differ by
    7 % in both sides together, and by 1.1 % in their ratio.
    """
    passes, turns = 30, 16
    steps = passes * turns
    drift = np.cumsum(generator.normal(0, 0.004 * busy, steps))  # for example the processor's clock
    bursts = np.repeat(generator.random(steps // 8) < 0.2, 8) * generator.exponential(0.2 * busy)
    noise = generator.exponential(0.11 * busy, (2, steps))
    jolts = (generator.random((2, steps)) < 0.01) * np.log1p(generator.pareto(2.0, (2, steps)))
    level = generator.normal(0, 0.07) + generator.normal(0, layout, (2, 1))
    logs = level + drift + bursts + noise + jolts
    logs[1] += log(ratio)
    return np.exp(logs).reshape(2, passes, turns)


@pytest.mark.slow
@pytest.mark.parametrize(("busy", "layout"), [(0.3, 0.008), (1, 0.008), (2, 0.008), (1, 0.025)])
def test_slowdowns_of_5_percent_are_found_and_unchanged_pass(busy, layout):
    """Check that slowdowns are found in 95 % and false alarms occur in at most 1 % of cases."""
    generator = np.random.default_rng(int(busy * 10))
    rounds, rates = 500, {}

    def sampled(ratio):
        logs = []
        while more := missing_sessions(logs):
            logs += [log_ratio(session(generator, ratio, busy, layout)) for _ in range(more)]
        return ratio_sample(logs)

    for ratio in (1.0, 1.05):
        states = [decide_speed(sampled(ratio)).decision for _ in range(rounds)]
        rates[ratio] = states.count("slower") / rounds
    assert rates[1.05] >= 0.95
    assert rates[1.0] <= 0.01
