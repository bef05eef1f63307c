"""Section 3: the course, both filters against a grid, and the factorisation of equation 2."""

import numpy as np
import pytest

from bench.papers.moreno2005.example import (
    COLOURS,
    POSITIONS,
    Setting,
    chain,
    course,
    errors,
    gain_of_dependence,
    gain_of_filtering,
)
from bench.papers.moreno2005.figures import GRIDS, iteration

STATES = 4


def test_truth_returns_to_the_middle_and_stays_in_bounds():
    still = Setting(1.0, (0.0, 0.0), (0.0, 0.0), (0.1, 0.1))
    seen = course(still, 50, np.random.default_rng(1))
    expected = seen.start[0] * 0.95 ** np.arange(1, 51)
    np.testing.assert_allclose(seen.truth[:, 0], expected)
    np.testing.assert_array_equal(seen.observed, seen.truth)
    wild = course(Setting(1.0, (2.0, 2.0), (0.1, 0.3), (0.1, 0.1)), 2000, np.random.default_rng(2))
    for column, (low, high) in enumerate((POSITIONS, COLOURS)):
        assert (wild.truth[:, column].min(), wild.truth[:, column].max()) == (low, high)
    np.testing.assert_allclose((wild.observed - wild.truth).std(axis=0), [0.1, 0.3], rtol=0.05)


def test_filters_have_the_posterior_of_a_grid():
    """One frame: p₁ ∝ prior · exp(-|c - z|/λ), and the same factor again in π₂, as printed."""
    setting = Setting(0.2, (0.05, 0.05), (0.2, 0.2), (0.05, 0.05))
    observed, start = np.array([0.15, 0.65]), np.array([0.1, 0.6])
    grid = np.linspace(-1, 2, 20_001)

    def mean(prior, seen, power):
        weight = prior * np.exp(-power * np.abs(grid - seen) / setting.scale)
        return weight @ grid / weight.sum()

    def around(centre):
        return np.exp(-0.5 * ((grid - centre) / 0.05) ** 2)

    position = mean(around(start[0]), observed[0], 1)
    twice = mean(around(start[1]), observed[1], 2)
    anywhere = mean((grid >= 0) & (grid <= 1), observed[1], 1)
    for kind, colour in (("dependent", twice), ("independent", anywhere)):
        cues = chain(kind, setting, 200_000, start)
        found = cues.step(observed, np.random.default_rng(5))
        attached = found[-2].states[found[-1].attached]
        assert found[-1].weights @ found[-1].states == pytest.approx(position, abs=1e-3)
        assert found[-1].weights @ attached == pytest.approx(colour, abs=2e-3)


def test_gains_are_shares_of_the_observations_error(monkeypatch):
    monkeypatch.setattr("bench.papers.moreno2005.example.NUMBERS", (50, 100))
    first, second = errors(0, 50), errors(0, 100)
    assert first["observation"] == second["observation"]
    independent = (first["independent"] + second["independent"]) / 2
    dependent = (first["dependent"] + second["dependent"]) / 2
    expected = (independent - dependent) / first["observation"]
    assert gain_of_dependence("0") == pytest.approx(expected)
    larger = max(independent, dependent)
    assert gain_of_filtering("0") == pytest.approx(1 - larger / first["observation"])


def test_densities_of_an_iteration_are_normalised():
    before, after = iteration()
    steps = [grid[1] - grid[0] for grid in GRIDS]
    for moment in (before, after):
        assert moment.second.sum() * steps[1] == pytest.approx(1, abs=0.02)
        assert moment.both.sum() * steps[0] * steps[1] == pytest.approx(1, abs=0.05)
        margin = moment.both.sum(axis=1) * steps[0]
        np.testing.assert_allclose(margin, moment.second, atol=0.1)
    assert before.marks["true, t - 1"] != after.marks["true, t"]


def joint(generator, *, informs):
    """Return a random p(x₁, x₂, z₁, z₂) with the dependences of equation 1.

    `informs`: z₂ tells of x₁; otherwise p(z₂ | x₁, z₁) is the same for all x₁.
    """
    first = generator.dirichlet(np.ones(STATES))
    measured = generator.dirichlet(np.ones(STATES), STATES)  # z₁ given x₁
    if informs:
        second = generator.dirichlet(np.ones(STATES), (STATES, STATES))  # x₂ given x₁, z₁
        seen = generator.dirichlet(np.ones(STATES), (STATES,) * 3)  # z₂ given x₁, x₂, z₁
        both = second[..., np.newaxis] * seen.transpose(0, 2, 1, 3)
    else:
        total = generator.dirichlet(np.ones(STATES), STATES)  # z₂ given z₁
        shares = generator.dirichlet(np.ones(STATES), (STATES,) * 3)  # x₂ given x₁, z₁, z₂
        both = (total[np.newaxis, ..., np.newaxis] * shares).transpose(0, 1, 3, 2)
    # `both` is p(x₂, z₂ | x₁, z₁), axes x₁, z₁, x₂, z₂.
    whole = (first[:, np.newaxis] * measured)[..., np.newaxis, np.newaxis] * both
    return whole.transpose(0, 2, 1, 3)


@pytest.mark.parametrize("informs", [True, False])
def test_equation_2_needs_that_the_second_measurement_tells_nothing_of_x1(informs):
    """Its proof replaces p(x₁ | z₁, z₂) by p(x₁ | z₁)."""
    model = joint(np.random.default_rng(0), informs=informs)
    posterior = model / model.sum(axis=(0, 1))
    of_first = model.sum(axis=(1, 3))
    first = (of_first / of_first.sum(axis=0))[:, np.newaxis, :, np.newaxis]
    product = first * model / model.sum(axis=1, keepdims=True)
    distance = 0.5 * np.abs(posterior - product).sum(axis=(0, 1)).max()
    assert (distance > 0.02) if informs else (distance < 1e-12)
