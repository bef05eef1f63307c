"""The chain of dependent cues against exact sums over small, discrete models."""

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


class Listed:
    """A cue with fixed states whose weights are looked up, for the attached state's row."""

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


def two(states=200_000, seed=0, **options):
    first = Listed([0, 1, 2], [0.2, 0.5, 0.3])
    second = Listed(
        np.random.default_rng(7).integers(0, 2, states), [[0.9, 0.1], [0.4, 0.6], [0.2, 0.3]]
    )
    chain = Chain([first, second], **options)
    return chain, chain.step(None, np.random.default_rng(seed))


def test_complete_density_has_exact_probabilities():
    _, (first, second) = two()
    indices = complete_combinations((first, second))
    measured = np.zeros((3, 2))
    np.add.at(measured, (first.states[indices[0]], second.states), second.weights)
    exact = np.array([0.2, 0.5, 0.3])[:, np.newaxis] * [[0.9, 0.1], [0.4, 0.6], [0.2, 0.3]]
    np.testing.assert_allclose(measured, exact / exact.sum(), atol=0.006)


def test_unattached_hypothesis_keeps_a_small_weight():
    first, second = Listed([0, 1], [1.0, 0.0]), Listed([0, 1, 1], [[1.0, 1.0], [1.0, 1.0]])
    Chain([first, second], feedback="joint").step(None, np.random.default_rng(0))
    _, weights = first.received
    assert 0 < weights[1] < 1e-11
    assert weights.sum() == pytest.approx(1.0)


def test_hypotheses_attached_to_nothing_are_an_error():
    alone = Hypotheses(np.arange(3), np.full(3, 1 / 3))
    with pytest.raises(ValueError, match="not attached to hypotheses"):
        complete_combinations([alone, alone])


@pytest.mark.parametrize("options", [{"association": "best"}, {"feedback": "both"}])
def test_an_unknown_way_is_refused(options):
    with pytest.raises(ValueError, match="is none of"):
        Chain([], **options)


@pytest.mark.parametrize("weights", [[0.2, -0.5, 0.3], [0.2, 0.5]])
def test_invalid_cue_weights_are_rejected(weights):
    wrong = Listed([0, 1, 2], [0.2, 0.5, 0.3])
    wrong.weigh = lambda *arguments: Weighed(np.array(weights))
    with pytest.raises(ValueError, match="Listed returned weights of shape"):
        Chain([wrong]).step(None, np.random.default_rng(0))


@given(st.lists(st.floats(0, 1e300), min_size=1, max_size=8))
def test_proportional_weights_sum_to_one_and_keep_their_order(values):
    weights = normalise_weights(np.array(values))
    assert weights.sum() == pytest.approx(1.0)
    assert (np.diff(weights[np.argsort(values)]) >= 0).all()


@pytest.mark.parametrize("values", [[0.0, 0.0], [np.nan, 1.0], [np.inf, 1.0]])
def test_weights_that_say_nothing_become_equal(values):
    np.testing.assert_array_equal(normalise_weights(np.array(values)), [0.5, 0.5])
