"""The example of section 3: its filters, what is measured of them, and equation 2."""

from itertools import product

import numpy as np
import pandas as pd
import pytest

from bench.papers import Effort
from bench.papers.moreno2005 import example
from bench.papers.moreno2005.example import (
    COLOURS,
    FILTERS,
    POSITIONS,
    SETTINGS,
    Setting,
    best_pairs,
    chain,
    course,
    differences,
    estimates,
    measure,
    trends,
)
from bench.papers.moreno2005.figures import GRIDS, iteration
from bench.papers.moreno2005.measures import (
    DEPENDENCES,
    STATES,
    distance,
    factorisation,
    joint,
)
from trackers.contours.chain import Hypotheses


def seeded(*seed):
    return np.random.default_rng(seed)


def test_the_truth_goes_back_to_the_middle_and_stays_in_bounds():
    still = Setting(1.0, (0.0, 0.0), (0.0, 0.0), (0.1, 0.1))
    seen = course(still, 50, seeded(1))
    expected = seen.start[0] * 0.95 ** np.arange(1, 51)
    np.testing.assert_allclose(seen.truth[:, 0], expected)
    np.testing.assert_allclose(
        seen.truth[:, 1] - 0.5, (seen.start[1] - 0.5) * expected / seen.start[0]
    )
    np.testing.assert_array_equal(seen.observed, seen.truth)
    wild = course(Setting(1.0, (2.0, 2.0), (0.1, 0.3), (0.1, 0.1)), 2000, seeded(2))
    for column, (low, high) in enumerate((POSITIONS, COLOURS)):
        assert (wild.truth[:, column].min(), wild.truth[:, column].max()) == (low, high)
    np.testing.assert_allclose((wild.observed - wild.truth).std(axis=0), [0.1, 0.3], rtol=0.05)


@pytest.mark.parametrize("kind", FILTERS)
def test_estimates_are_weighted_means_of_what_the_chain_found(kind):
    setting = SETTINGS["B"]
    seen = course(setting, 3, seeded(3))
    rows = estimates(kind, setting, 60, seen, seeded(4))
    cues, generator = chain(kind, setting, 60, seen.start), seeded(4)
    for row, observation in zip(rows, seen.observed, strict=True):
        *before, last = cues.step(observation, generator)
        attached = [before[-1].states[one] for one in last.attached]
        assert row[0] == pytest.approx(np.average(last.states, weights=last.weights))
        assert row[1] == pytest.approx(np.average(attached, weights=last.weights))
        own = np.average(before[0].states, weights=before[0].weights)
        assert row[2] == pytest.approx(own)
        assert row[3] == pytest.approx(1 / np.sum(last.weights**2) / 60)


def test_dependent_filters_have_the_posterior_of_a_grid():
    """One frame: p₁ ∝ prior · exp(-|c - z|/λ), and the same factor again in π₂, as printed."""
    setting = SETTINGS["G"]
    observed, start, samples = np.array([0.15, 0.65]), np.array([0.1, 0.6]), 200_000
    grid = np.linspace(-1, 2, 20_001)

    def posterior(prior_mean, spread, seen, power):
        density = np.exp(-0.5 * ((grid - prior_mean) / spread) ** 2)
        return density * np.exp(-power * np.abs(grid - seen) / setting.scale)

    def mean(density):
        return density @ grid / density.sum()

    position = mean(posterior(start[0], setting.dynamics[0], observed[0], 1))
    once, twice = (
        mean(posterior(start[1], setting.dynamics[1], observed[1], power)) for power in (1, 2)
    )
    anywhere = mean(
        ((grid >= 0) & (grid <= 1)) * np.exp(-np.abs(grid - observed[1]) / setting.scale)
    )
    for kind, attached in (("dependent", twice), ("unweighted", once), ("independent", anywhere)):
        found = chain(kind, setting, samples, start).step(observed, seeded(5))
        colours = found[-2].states[found[-1].attached]
        assert found[-1].weights @ found[-1].states == pytest.approx(position, abs=1e-3)
        assert found[-1].weights @ colours == pytest.approx(attached, abs=2e-3)
        assert found[0].weights @ found[0].states == pytest.approx(once, abs=1e-3)


@pytest.mark.slow
def test_all_is_measured_and_kept(tmp_path, monkeypatch):
    monkeypatch.setattr(example, "SETTINGS", {name: SETTINGS[name] for name in ("B", "G")})
    monkeypatch.setattr(example, "QUICK_NUMBERS", (10, 500))
    monkeypatch.setattr(example, "QUICK_REPETITIONS", 3)
    monkeypatch.setattr(example, "QUICK_ASSOCIATIONS", 2)
    found = measure(tmp_path, 1, Effort(quick=True))
    errors = found["one-dimensional-errors"]
    assert len(errors) == 2 * 2 * 3 * 4
    assert list(errors.groupby(["set", "samples"], sort=False).groups) == [
        ("B", 10),
        ("B", 500),
        ("G", 10),
        ("G", 500),
    ]
    assert errors.groupby("set")["scale"].first().to_dict() == {"B": "1", "G": "0.2"}
    seen = errors[errors["filter"] == "observation"]
    assert seen.groupby(["set", "repetition"])["error"].agg(np.ptp).max() == 0
    assert set(found["one-dimensional-association"]["association"]) == {"by-weight", "uniform"}
    again = measure(tmp_path, 1, Effort(quick=True))
    pd.testing.assert_frame_equal(again["one-dimensional-errors"], errors)
    assert len(list((tmp_path / "one-dimensional").iterdir())) == 2 * (2 + 1)


def made_errors(error):
    """Errors of 10 repetitions; `error` gives them from filter, number and repetition."""
    rows = [
        {
            "set": "A",
            "scale": "1",
            "samples": number,
            "repetition": repetition,
            "filter": kind,
            "error": error(kind, number, repetition),
            "position_error": 1.0,
            "colour_error": 1.0,
            "own_error": 1.0,
            "own_colour_error": 1.0,
            "effective": 0.5,
        }
        for kind, number, repetition in product(("observation", *FILTERS), (10, 50, 500), range(10))
    ]
    return pd.DataFrame(rows)


def test_differences_are_paired_by_repetition():
    noise = seeded(6).normal(size=10)
    shift = {"observation": 3.0, "independent": 2.0, "dependent": 1.0, "unweighted": 0.5}
    errors = made_errors(lambda kind, number, r: shift[kind] + noise[r] + 0.01 * (r % 2))
    rows = differences(errors).set_index(["pair", "quantity", "samples"])
    row = rows.loc["independent less dependent", "error", 50]
    assert row["mean"] == pytest.approx(1.0)
    assert row["standard_error"] == pytest.approx(0.0, abs=1e-9)
    assert row["lower_limit"] == pytest.approx(1.0)
    assert rows.loc["unweighted less dependent", "error", 10]["mean"] == pytest.approx(-0.5)
    assert rows.loc["observation less dependent", "error", 10]["mean"] == pytest.approx(2.0)
    assert len(rows) == 3 * 4 * 5


def test_intervals_are_students():
    errors = made_errors(
        lambda kind, number, r: float(kind == "independent") * (1 + (r - 4.5) / 10)
    )
    rows = differences(errors).set_index(["pair", "quantity", "samples"])
    row = rows.loc["independent less dependent", "error", 50]
    error = np.std((np.arange(10) - 4.5) / 10, ddof=1) / np.sqrt(10)
    assert row["standard_error"] == pytest.approx(error)
    assert row["lower_limit"] == pytest.approx(1 - 2.262157 * error)


def test_trends_compare_few_samples_with_many():
    errors = made_errors(lambda kind, number, r: 1 / number if kind == "dependent" else number)
    rows = trends(errors).set_index("filter")
    assert list(rows.index) == list(FILTERS)
    assert rows.loc["dependent", "rank_correlation"] == pytest.approx(-1)
    assert rows.loc["independent", "rank_correlation"] == pytest.approx(1)
    assert rows.loc["dependent", "mean"] == pytest.approx(0.1 - 0.002)
    assert rows.loc["independent", "lower_limit"] == pytest.approx(-490)


def test_dependence_gains_with_tuned_weights_and_nothing_gains_on_accurate_observations():
    found = {}
    for name in ("A", "G"):
        rows = pd.DataFrame(example._error_rows(name, 100, 20))
        found[name] = rows.groupby("filter")["error"].mean()
    tuned, accurate = found["G"], found["A"]
    assert tuned["dependent"] + 0.02 < tuned["independent"] < tuned["observation"]
    assert accurate["observation"] < accurate[["independent", "dependent"]].min()


def test_the_best_pairs_are_those_of_the_best_tenth():
    weights = np.arange(1.0, 21.0) / 210
    colours = Hypotheses(np.zeros(20), weights)
    # The best two positions have the best colour and the third best.
    attached = np.zeros(20, np.intp)
    attached[[3, 7]] = 19, 17
    positions = np.full(20, 0.01)
    positions[3], positions[7] = 0.5, 0.3
    best, share = best_pairs(colours, Hypotheses(np.zeros(20), positions, attached))
    assert best == pytest.approx(20 * 20 / 210)
    assert share == 0.5


def test_association_by_weight_brings_better_colours_together():
    rows = pd.DataFrame(example._association_rows("G", 1))
    by_weight, uniform = (
        rows.set_index("association").loc[["by-weight", "uniform"]].to_dict("records")
    )
    assert by_weight["top_pairs"] > uniform["top_pairs"] + 0.05
    assert by_weight["best"] > uniform["best"]


@pytest.mark.parametrize("informs", [True, False])
def test_random_models_have_the_dependences_of_equation_1(informs):
    model = joint(seeded(7), informs=informs)
    assert model.sum() == pytest.approx(1)
    # What is measured of the first feature depends on it, and p(z₂ | x₁, z₁) on x₁ only if told.
    of_first = model.sum(axis=(1, 3))
    assert np.ptp(of_first / of_first.sum(axis=1, keepdims=True), axis=0).max() > 0.05
    second = model.sum(axis=1)
    conditional = second / second.sum(axis=2, keepdims=True)
    assert (np.ptp(conditional, axis=0).max() > 0.05) == informs
    # The second feature depends on the first in both.
    features = model.sum(axis=(2, 3))
    assert np.ptp(features / features.sum(axis=1, keepdims=True), axis=0).max() > 0.05


def test_equation_2_is_a_slow_sum_over_all_states():
    model = joint(seeded(8), informs=True)
    most = 0.0
    for z1, z2 in product(range(STATES), repeat=2):
        total = 0.0
        for x1, x2 in product(range(STATES), repeat=2):
            exact = model[x1, x2, z1, z2] / model[:, :, z1, z2].sum()
            first = model[x1, :, z1, :].sum() / model[:, :, z1, :].sum()
            second = model[x1, x2, z1, z2] / model[x1, :, z1, z2].sum()
            total += abs(exact - first * second)
        most = max(most, total / 2)
    assert distance(model) == pytest.approx(most)
    assert most > 0.02


def test_equation_2_holds_only_with_what_its_proof_assumes():
    found = factorisation().set_index("dependence")["distance"]
    assert list(found.index) == list(DEPENDENCES)
    assert found.iloc[0] > 0.1
    assert found.iloc[1] < 1e-12


def test_densities_of_an_iteration_are_normalised_and_follow_what_was_seen():
    before, after = iteration()
    for moment in (before, after):
        steps = [grid[1] - grid[0] for grid in GRIDS]
        assert moment.second.sum() * steps[1] == pytest.approx(1, abs=0.02)
        assert moment.both.sum() * steps[0] * steps[1] == pytest.approx(1, abs=0.05)
        assert moment.both.shape == (len(GRIDS[1]), len(GRIDS[0]))
        # Of both, the position's margin is its density.
        margin = moment.both.sum(axis=1) * steps[0]
        np.testing.assert_allclose(margin, moment.second, atol=0.1)
        highest = np.unravel_index(moment.both.argmax(), moment.both.shape)
        estimate = list(moment.marks.values())[1]
        assert GRIDS[0][highest[1]] == pytest.approx(estimate[0], abs=0.2)
        assert GRIDS[1][highest[0]] == pytest.approx(estimate[1], abs=0.3)
    assert before.marks["true, t - 1"] != after.marks["true, t"]
