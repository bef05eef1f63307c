"""The Kalman filters of constant velocity against textbook matrices and Riccati's equation."""

from math import inf

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import solve_discrete_are

from trackmark.trackers.base.kalman import ConstantVelocity, ScalarSmoother

F, H = np.array([[1.0, 1.0], [0.0, 1.0]]), np.array([[1.0, 0.0]])
Q = np.array([[0.25, 0.5], [0.5, 1.0]])


def textbook(state, covariance, noise, measurements, deviations):
    """State, covariance and gain of one axis after each measurement, in Joseph's form."""
    x, p = np.array(state, float)[:, np.newaxis], np.array(covariance, float)
    for measured, deviation in zip(measurements, deviations, strict=True):
        x, p = F @ x, F @ p @ F.T + noise**2 * Q
        gain = p @ H.T @ np.linalg.inv(H @ p @ H.T + deviation**2)
        x, rest = x + gain @ (measured - H @ x), np.eye(2) - gain @ H
        p = rest @ p @ rest.T + deviation**2 * gain @ gain.T
        yield x.ravel(), p, float(gain[0, 0])


def test_the_smoother_is_the_textbooks_filter():
    values = 3 + np.cumsum(np.random.default_rng(0).normal(0.5, 1, 30))
    smoother = ScalarSmoother(3.0, 0.5, 0.7, 0.4, 2.0)
    expected = textbook([3.0, 0.5], np.diag([0.16, 4.0]), 0.7, values, np.full(30, 0.4))
    for value, (state, _, _) in zip(values, expected, strict=True):
        assert smoother.predicted() == smoother.value + smoother.velocity
        smoother.measure(value)
        assert [smoother.value, smoother.velocity] == pytest.approx(state, abs=1e-12)


def test_in_the_end_its_gain_is_that_of_riccatis_equation():
    p = solve_discrete_are(F.T, H.T, 0.49 * Q, np.array([[0.16]]))
    place, velocity = (p @ H.T / (p[0, 0] + 0.16)).ravel()
    smoother = ScalarSmoother(0.0, 0.0, 0.7, 0.4, 2.0)
    for _ in range(60):
        smoother.measure(0.0)
    smoother.measure(1.0)
    assert smoother.value == pytest.approx(place)
    assert smoother.velocity == pytest.approx(velocity)


sizes = st.floats(0.1, 100)


@settings(max_examples=30)
@given(
    st.tuples(st.floats(-500, 500), st.floats(-500, 500)),
    st.tuples(sizes, sizes),
    st.floats(0.01, 50),
    st.lists(st.tuples(*[st.floats(-500, 500)] * 2, sizes, sizes), min_size=1, max_size=12),
)
def test_each_axis_is_the_textbooks_filter(position, velocity_deviation, noise, rows):
    measurements, deviations = np.array(rows)[:, :2], np.array(rows)[:, 2:]
    ours = ConstantVelocity(np.array(position), np.array(velocity_deviation), noise)
    axes = [
        textbook([x, 0], np.diag([0, speed**2]), noise, measured, deviation)
        for x, speed, measured, deviation in zip(
            position, velocity_deviation, measurements.T, deviations.T, strict=True
        )
    ]
    for k, both in enumerate(zip(*axes, strict=True)):
        ours.predict()
        gains = ours.correct(measurements[k], deviations[k])
        for axis, (state, covariance, gain) in enumerate(both):
            np.testing.assert_allclose(ours.means[axis], state, rtol=1e-6, atol=1e-6)
            np.testing.assert_allclose(ours.covariances[axis], covariance, rtol=1e-6, atol=1e-6)
            assert gains[axis] == pytest.approx(gain, rel=1e-6)
        assert ours.position.tolist() == ours.means[:, 0].tolist()


def test_correct_with_infinite_and_zero_variance():
    ours = ConstantVelocity(np.array([3.0, 4.0]), np.array([2.0, 5.0]), 1.0)
    ours.predict()
    means, covariances = ours.means.copy(), ours.covariances.copy()
    assert ours.correct(np.array([99.0, -99.0]), np.array([inf, inf])).tolist() == [0, 0]
    np.testing.assert_array_equal(ours.means, means)
    np.testing.assert_array_equal(ours.covariances, covariances)
    assert ours.correct(np.array([5.0, 1.0]), np.zeros(2)).tolist() == [1, 1]
    np.testing.assert_allclose(ours.position, [5, 1], atol=1e-12)
