"""The Kalman filters of constant velocity against textbook matrices and OpenCV's."""

from math import inf

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import solve_discrete_are

from trackers.base.kalman import ConstantVelocity, Smoother

F, H = np.array([[1.0, 1.0], [0.0, 1.0]]), np.array([[1.0, 0.0]])
Q = np.array([[0.25, 0.5], [0.5, 1.0]])


def test_it_is_the_textbooks_filter():
    random = np.random.default_rng(0)
    smoother = Smoother(3.0, 0.5, 0.7, 0.4, 2.0)
    x, p = np.array([[3.0], [0.5]]), np.diag([0.16, 4.0])
    for value in 3 + np.cumsum(random.normal(0.5, 1, 30)):
        x, p = F @ x, F @ p @ F.T + 0.49 * Q
        assert smoother.predicted() == pytest.approx(x[0, 0], abs=1e-12)
        gain = p @ H.T @ np.linalg.inv(H @ p @ H.T + 0.16)
        x, p = x + gain @ (value - H @ x), (np.eye(2) - gain @ H) @ p
        smoother.measure(value)
        assert smoother.value == pytest.approx(x[0, 0], abs=1e-12)
        assert smoother.velocity == pytest.approx(x[1, 0], abs=1e-12)


def test_in_the_end_its_gain_is_that_of_riccatis_equation():
    p = solve_discrete_are(F.T, H.T, 0.49 * Q, np.array([[0.16]]))
    place, velocity = (p @ H.T / (p[0, 0] + 0.16)).ravel()
    smoother = Smoother(0.0, 0.0, 0.7, 0.4, 2.0)
    for _ in range(60):
        smoother.measure(0.0)
    smoother.measure(1.0)
    assert smoother.value == pytest.approx(place)
    assert smoother.velocity == pytest.approx(velocity)


def textbook(position, velocity_deviation, noise, measurements, deviations):
    """States (x, y, vx, vy) of one filter of both axes, in the full matrices, Joseph's form."""
    transition = np.eye(4) + np.eye(4, k=2)
    by_acceleration = np.array([[0.5, 0], [0, 0.5], [1, 0], [0, 1]])
    process = noise**2 * by_acceleration @ by_acceleration.T
    observed = np.eye(2, 4)
    state = np.array([*position, 0, 0])
    covariance = np.diag([0, 0, *np.square(velocity_deviation)])
    for measured, deviation in zip(measurements, deviations, strict=True):
        state = transition @ state
        covariance = transition @ covariance @ transition.T + process
        uncertainty = np.diag(np.square(deviation))
        innovation = observed @ covariance @ observed.T + uncertainty
        gain = covariance @ observed.T @ np.linalg.inv(innovation)
        state = state + gain @ (measured - observed @ state)
        rest = np.eye(4) - gain @ observed
        covariance = rest @ covariance @ rest.T + gain @ uncertainty @ gain.T
        yield state, covariance, gain


def opencv(position, velocity_deviation, noise, measurements, deviations):
    """The same filter as OpenCV has it."""
    kalman = cv2.KalmanFilter(4, 2, 0, cv2.CV_64F)
    kalman.transitionMatrix = np.eye(4) + np.eye(4, k=2)
    kalman.measurementMatrix = np.eye(2, 4)
    by_acceleration = np.array([[0.5, 0], [0, 0.5], [1, 0], [0, 1]])
    kalman.processNoiseCov = noise**2 * by_acceleration @ by_acceleration.T
    kalman.statePost = np.array([[*position, 0, 0]]).T
    kalman.errorCovPost = np.diag([0, 0, *np.square(velocity_deviation)])
    for measured, deviation in zip(measurements, deviations, strict=True):
        kalman.predict()
        kalman.measurementNoiseCov = np.diag(np.square(deviation))
        yield kalman.correct(measured[:, np.newaxis]).ravel(), kalman.errorCovPost, kalman.gain


sizes = st.floats(0.1, 100)


@settings(max_examples=30)
@given(
    st.tuples(st.floats(-500, 500), st.floats(-500, 500)),
    st.tuples(sizes, sizes),
    st.floats(0.01, 50),
    st.lists(st.tuples(*[st.floats(-500, 500)] * 2, sizes, sizes), min_size=1, max_size=12),
)
def test_the_filter_is_the_textbooks_and_opencvs(position, velocity_deviation, noise, given):
    measurements, deviations = np.array(given)[:, :2], np.array(given)[:, 2:]
    ours = ConstantVelocity(np.array(position), np.array(velocity_deviation), noise)
    question = position, velocity_deviation, noise, measurements, deviations
    for k, (theirs, open_cvs) in enumerate(
        zip(textbook(*question), opencv(*question), strict=True)
    ):
        ours.predict()
        gains = ours.correct(measurements[k], deviations[k])
        for state, covariance, gain in (theirs, open_cvs):
            np.testing.assert_allclose(ours.means.T.ravel(), state, rtol=1e-6, atol=1e-6)
            for axis in (0, 1):
                expected = covariance[axis::2, axis::2]
                np.testing.assert_allclose(ours.covariances[axis], expected, rtol=1e-6, atol=1e-6)
                assert gains[axis] == pytest.approx(gain[axis, axis], rel=1e-6)
        assert ours.position.tolist() == ours.means[:, 0].tolist()


def test_a_measurement_that_says_nothing_changes_nothing():
    ours = ConstantVelocity(np.array([3.0, 4.0]), np.array([2.0, 5.0]), 1.0)
    ours.predict()
    means, covariances = ours.means.copy(), ours.covariances.copy()
    gains = ours.correct(np.array([99.0, -99.0]), np.array([inf, inf]))
    assert gains.tolist() == [0, 0]
    np.testing.assert_array_equal(ours.means, means)
    np.testing.assert_array_equal(ours.covariances, covariances)


def test_an_exact_measurement_is_taken_as_it_is():
    ours = ConstantVelocity(np.array([3.0, 4.0]), np.array([2.0, 5.0]), 1.0)
    for k in range(1, 5):
        ours.predict()
        gains = ours.correct(np.array([3.0 + k, 4.0 - 2 * k]), np.zeros(2))
        assert gains.tolist() == [1, 1]
        np.testing.assert_allclose(ours.position, [3 + k, 4 - 2 * k], atol=1e-12)
    ours.predict()
    # With an exact position before, the velocity is (gain of 2) the two last places' but noise.
    np.testing.assert_allclose(ours.position, [8, -6], atol=0.1)
