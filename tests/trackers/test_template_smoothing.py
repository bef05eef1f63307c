"""The Kalman filter of constant velocity."""

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from trackers.base.kalman import Smoother

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


def test_what_goes_on_as_it_went_is_where_it_is_expected():
    smoother = Smoother(10.0, 1.5, 0.5, 0.5, 2.0)
    for frame in range(1, 9):
        assert smoother.predicted() == pytest.approx(10 + 1.5 * frame)
        assert smoother.predicted() == smoother.predicted()
        smoother.measure(10 + 1.5 * frame)
