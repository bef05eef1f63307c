"""Estimates of thresholds, and difficulties of the next runs."""

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.special import expit

from trackmark.bench.statistics.psychometric import N_FIRST_RUNS, next_difficulties, threshold

EVENLY = (np.arange(N_FIRST_RUNS) + 0.5) / N_FIRST_RUNS


def curve(place, half, slope, lapse=0.0, luck=0.0):
    """Return the probability of survival, which is one half at `half`."""
    part = (0.5 - luck) / (1 - lapse - luck)
    return luck + (1 - lapse - luck) * expit((half - place) / slope + np.log(part / (1 - part)))


def adaptive(truth, generator, most=100, enough=0.05):
    """Estimate a threshold in batches of runs; return it with the number of runs."""
    places, survived = np.empty(0), np.empty(0, bool)
    wanted = EVENLY
    while True:
        places = np.concatenate([places, np.round(wanted * 40) / 40])
        survival = generator.uniform(size=len(wanted)) < curve(np.round(wanted * 40) / 40, *truth)
        survived = np.concatenate([survived, survival])
        posterior = threshold(places, survived)
        if len(places) >= most or posterior.half_width <= enough:
            return posterior, len(places)
        wanted = next_difficulties(posterior, generator)


def test_threshold_of_many_runs_has_maximum_likelihood():
    generator = np.random.default_rng(3)
    places = np.repeat(np.linspace(0, 1, 41), 60)
    survived = generator.uniform(size=len(places)) < curve(places, 0.4, 0.06, 0.05, 0.1)

    def unlikelihood(parameters):
        chance = curve(places, *parameters[:2], *np.abs(parameters[2:]))
        return -np.log(np.where(survived, chance, 1 - chance)).sum()

    best = minimize(unlikelihood, [0.5, 0.1, 0.02, 0.02], method="Nelder-Mead").x
    best[2:] = np.abs(best[2:])
    posterior = threshold(places, survived)
    assert posterior.median == pytest.approx(best[0], abs=0.01)
    assert posterior.interval.low < best[0] < posterior.interval.high
    assert posterior.half_width < 0.02
    expected = curve(np.array([0.1, 0.4, 0.8]), *best)
    np.testing.assert_allclose(posterior.survival([0.1, 0.4, 0.8]), expected, atol=0.03)


@pytest.mark.parametrize(
    ("survived", "beyond"),
    [(np.ones(N_FIRST_RUNS, bool), 1.0), (np.zeros(N_FIRST_RUNS, bool), -1.0)],
)
def test_threshold_is_outside_of_range_if_outcomes_are_equal(survived, beyond):
    posterior = threshold(EVENLY, survived)
    assert (posterior.median - 0.5) * beyond > 0.5
    assert (np.array(posterior.interval) * beyond).max() > (0.9 if beyond > 0 else -0.1)
    placed = next_difficulties(posterior, np.random.default_rng(0))
    assert set(placed) <= {0.0, 1.0} or (np.abs(placed - 0.5) > 0.4).all()


def test_next_difficulties_are_near_threshold_and_repeatable():
    survived = EVENLY < 0.3
    few = threshold(EVENLY, survived)
    assert few.interval == (few.quantile(0.025), few.quantile(0.975))
    assert few.quantile(0.025) < few.quantile(0.05) < few.quantile(0.95) < few.quantile(0.975)
    places = next_difficulties(threshold(EVENLY, survived), np.random.default_rng(5))
    assert np.quantile(np.abs(places - 0.3), 0.8) < 0.1
    again = next_difficulties(threshold(EVENLY, survived), np.random.default_rng(5))
    np.testing.assert_array_equal(places, again)


@pytest.mark.slow
def test_threshold_interval_covers():
    """Check coverage with early stopping, and an error below 5 % of the range with 100 runs."""
    generator = np.random.default_rng(1)
    covered, errors = [], []
    for slope in (0.03, 0.06, 0.1):
        for lapse, luck in ((0.0, 0.0), (0.1, 0.0), (0.05, 0.2)):
            for _ in range(60):
                half = generator.uniform(0.15, 0.85)
                posterior, runs = adaptive((half, slope, lapse, luck), generator)
                assert runs <= 100
                covered.append(posterior.interval.low <= half <= posterior.interval.high)
                errors.append(posterior.median - half)
    assert 0.925 <= np.mean(covered) <= 0.975
    assert np.mean(np.abs(errors) < 0.05) > 0.9
    assert abs(np.mean(errors)) < 0.01
