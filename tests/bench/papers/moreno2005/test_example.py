"""Section 3: the trajectory, and both filters against a grid."""

import numpy as np
import pytest

from trackmark.bench.papers.moreno2005 import example
from trackmark.bench.papers.moreno2005.example import Setting
from trackmark.bench.papers.moreno2005.figures import GRIDS, iteration


def test_filters_have_the_posterior_of_a_grid():
    """Check a frame: p₁ ∝ prior · exp(-|c - z|/λ), and the same factor again in π₂, as printed."""
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
        cues = example.chain(kind, setting, 200_000, start)
        hypotheses = cues.step(observed, np.random.default_rng(5))
        attached = hypotheses[-2].states[hypotheses[-1].attached]
        assert hypotheses[-1].weights @ hypotheses[-1].states == pytest.approx(position, abs=1e-3)
        assert hypotheses[-1].weights @ attached == pytest.approx(colour, abs=2e-3)


def test_gains_are_shares_of_the_observations_error(monkeypatch):
    monkeypatch.setattr(example, "NUMBERS", (50, 100))
    first, second = example.errors(0, 50), example.errors(0, 100)
    assert first["observation"] == second["observation"]
    independent = (first["independent"] + second["independent"]) / 2
    dependent = (first["dependent"] + second["dependent"]) / 2
    expected = (independent - dependent) / first["observation"]
    assert example.gain_of_dependence("0") == pytest.approx(expected)
    larger = max(independent, dependent)
    assert example.gain_of_filtering("0") == pytest.approx(1 - larger / first["observation"])


def test_densities_of_an_iteration_are_normalised():
    before, after = iteration()
    steps = [grid[1] - grid[0] for grid in GRIDS]
    for moment in (before, after):
        assert moment.second.sum() * steps[1] == pytest.approx(1, abs=0.02)
        assert moment.both.sum() * steps[0] * steps[1] == pytest.approx(1, abs=0.05)
        margin = moment.both.sum(axis=1) * steps[0]
        np.testing.assert_allclose(margin, moment.second, atol=0.1)
    assert before.marks["true, t - 1"] != after.marks["true, t"]
