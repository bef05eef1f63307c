"""Chain of dependent cues, compared with exact sums over small, discrete models."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trackmark.trackers.contours.chain import (
    Chain,
    Hypotheses,
    Weighed,
    complete_combinations,
    normalise_weights,
)


class TableCue:
    """Cue with fixed states and a table of weights; a second cue has a row per attached state."""

    def __init__(self, states, table):
        self.states, self.table, self.received = np.asarray(states), np.asarray(table), None

    def sample(self, generator):
        return self.states

    def weigh(self, observation, states, attached, earlier):
        if attached is None:
            return Weighed(self.table[states], evidence="first")
        assert earlier[-1].evidence == "first"
        return Weighed(self.table[earlier[-1].states[attached], states])

    def receive(self, states, weights):
        self.received = (states, weights)


def test_complete_density_has_exact_probabilities():
    table = [[0.9, 0.1], [0.4, 0.6], [0.2, 0.3]]
    states = np.random.default_rng(7).integers(0, 2, 200_000)
    chain = Chain([TableCue([0, 1, 2], [0.2, 0.5, 0.3]), TableCue(states, table)])
    first, second = chain.step(None, np.random.default_rng(0))
    indices = complete_combinations((first, second))
    measured = np.zeros((3, 2))
    np.add.at(measured, (first.states[indices[0]], second.states), second.weights)
    exact = np.array([0.2, 0.5, 0.3])[:, np.newaxis] * table
    np.testing.assert_allclose(measured, exact / exact.sum(), atol=0.006)


def test_unattached_hypothesis_keeps_a_small_weight():
    first, second = TableCue([0, 1], [1.0, 0.0]), TableCue([0, 1, 1], [[1.0, 1.0], [1.0, 1.0]])
    Chain([first, second], feedback="joint").step(None, np.random.default_rng(0))
    _, weights = first.received
    assert 0 < weights[1] < 1e-11
    assert weights.sum() == pytest.approx(1.0)


def test_combinations_of_unattached_hypotheses_are_rejected():
    alone = Hypotheses(np.arange(3), np.full(3, 1 / 3))
    with pytest.raises(ValueError, match="not attached to hypotheses"):
        complete_combinations([alone, alone])


@pytest.mark.parametrize("options", [{"association": "best"}, {"feedback": "both"}])
def test_unknown_chain_option_is_rejected(options):
    with pytest.raises(ValueError, match="is none of"):
        Chain([], **options)


@pytest.mark.parametrize("weights", [[0.2, -0.5, 0.3], [0.2, 0.5]])
def test_invalid_cue_weights_are_rejected(weights):
    wrong = TableCue([0, 1, 2], [0.2, 0.5, 0.3])
    wrong.weigh = lambda *arguments: Weighed(np.array(weights))
    with pytest.raises(ValueError, match="TableCue returned weights of shape"):
        Chain([wrong]).step(None, np.random.default_rng(0))


@given(st.lists(st.floats(0, 1e300), min_size=1, max_size=8))
def test_normalised_weights_sum_to_one_and_keep_their_order(values):
    weights = normalise_weights(np.array(values))
    assert weights.sum() == pytest.approx(1.0)
    assert (np.diff(weights[np.argsort(values)]) >= 0).all()


@pytest.mark.parametrize("values", [[0.0, 0.0], [np.nan, 1.0], [np.inf, 1.0]])
def test_invalid_or_zero_weights_become_equal(values):
    np.testing.assert_array_equal(normalise_weights(np.array(values)), [0.5, 0.5])
