"""Loops: closed, smooth, at constant speed, within bounds."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from trackmark.datasets.synthetic.render.path import Loop, random_loop


@given(seed=st.integers(0, 1000), speed=st.floats(0.05, 8))
def test_a_random_loop_stays_in_its_rectangle_at_its_speed(seed, speed):
    loop = random_loop(np.random.default_rng(seed), [20, 30], [300, 200], speed)
    places = loop.positions(np.arange(2000))
    assert (places >= [20, 30]).all()
    assert (places <= [300, 200]).all()
    way = np.hypot(*np.diff(places, axis=0).T)
    assert (way <= speed * (1 + 1e-9)).all()
    assert way.mean() > 0.9 * speed


def test_a_loop_closes_and_does_not_jump():
    square = np.array([[0.0, 0.0], [60.0, 0.0], [60.0, 60.0], [0.0, 60.0]])
    loop = Loop(square, 1.0)
    round_trip = loop._travelled[-1]
    np.testing.assert_allclose(loop.positions(round_trip + 5.0), loop.positions(5.0), atol=1e-9)
    # a uniform cubic B-spline passes (a + 4 b + c) / 6 at its knots
    np.testing.assert_allclose(loop.positions(0.0), (square[0] + 4 * square[1] + square[2]) / 6)
