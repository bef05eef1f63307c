"""The filter against textbook matrices and OpenCV's; the tracker's promises."""

from math import exp, inf, log

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.trackers.following import boxes_of, track
from tests.trackers.slow_ellipses import codes_of, histogram_of
from trackmark import trackers
from trackmark.trackers.mean_shift_kalman import _deviation

GREEN, RED, BLUE = (60, 180, 40), (30, 50, 210), (210, 80, 30)


@given(st.floats(0.01, 1), st.floats(0.5, 50), st.floats(0.1, 8), st.floats(-1, 1))
def test_deviation_of_gaussian_through_three_points(scale, deviation, deviations_aside, shift):
    distance = deviation * deviations_aside

    def gaussian(position):
        return scale * exp(-((position - shift * distance) ** 2) / (2 * deviation**2))

    points = [gaussian(position) for position in (-distance, 0, distance)]
    assert _deviation(*points, distance) == pytest.approx(deviation, rel=1e-6)


def test_no_peak_says_nothing_and_a_peak_of_one_point_all():
    assert _deviation(0.6, 0.5, 0.7, 9.0) == inf
    assert _deviation(0.5, 0.5, 0.5, 9.0) == inf
    assert _deviation(0.0, 0.5, 0.4, 9.0) == 0.0


def picture(left, top, hidden=None, height=120, width=200):
    """A target red over blue on noisy green; `hidden` columns are covered in grey."""
    image = np.full((height, width, 3), GREEN, float)
    image[max(top, 0) : max(top + 30, 0), max(left, 0) : max(left + 24, 0)] = RED
    image[max(top + 15, 0) : max(top + 30, 0), max(left, 0) : max(left + 24, 0)] = BLUE
    if hidden is not None:
        image[:, slice(*hidden)] = 128
    image += np.random.default_rng(abs(left * 31 + top)).normal(0, 8, image.shape)
    return np.clip(image, 0, 255).astype(np.uint8)


def test_box_and_gain_are_the_filters_of_the_measured_places():
    images = [picture(20 + 4 * t, 40 + t) for t in range(8)]
    actual = track("mean-shift-kalman", images, [20, 40, 24, 30], acceleration_noise=3.0)
    transition, noise = np.array([[1, 1], [0, 1]]), 9 * np.array([[0.25, 0.5], [0.5, 1]])
    for axis, start, half in (("x", 32.0, 12.0), ("y", 55.0, 15.0)):
        state, covariance = np.array([start, 0.0]), np.diag([0.0, half**2])
        for estimate in actual:
            measured, gain = (estimate.details[f"{name}_{axis}"] for name in ("measured", "gain"))
            state = transition @ state
            covariance = transition @ covariance @ transition.T + noise
            position = covariance[0, 0]
            uncertainty = position / gain - position  # what this gain says of the measurement
            assert uncertainty > 0
            full = covariance[:, 0] / (position + uncertainty)
            state = state + full * (measured - state[0])
            covariance = covariance - np.outer(full, covariance[0])
            centre = estimate.box[:2] + estimate.box[2:] / 2
            assert centre["xy".index(axis)] == pytest.approx(state[0], abs=1e-6)
            assert estimate.visible


def test_first_gain_follows_from_coefficient_surface():
    images = [picture(20, 40), picture(22, 41)]
    settings = {"scale": "fixed", "acceleration_noise": 3.0}
    (estimate,) = track("mean-shift-kalman", images, [20, 40, 24, 30], **settings)
    x, y = estimate.details["measured_x"], estimate.details["measured_y"]
    peak = estimate.confidence

    def coefficient(x, y):
        q = histogram_of(codes_of(images[0]), 512, (32.0, 55.0, 12.0, 15.0))
        p = histogram_of(codes_of(images[1]), 512, (x, y, 12.0, 15.0))
        return np.sqrt(p * q).sum()

    for axis, half in (("x", 12.0), ("y", 15.0)):
        aside = np.array([half, 0]) if axis == "x" else np.array([0, half])
        before, after = coefficient(*(np.array([x, y]) - aside)), coefficient(*([x, y] + aside))
        variance = half**2 / -log(before * after / peak**2)
        position = half**2 + 9 / 4
        expected = position / (position + variance)
        assert estimate.details[f"gain_{axis}"] == pytest.approx(expected, rel=1e-3)


def test_it_bridges_an_occlusion_that_mean_shift_alone_does_not():
    lefts = [20 + 5 * t for t in range(26)]
    images = [picture(left, 40, hidden=(75, 100)) for left in lefts]
    start = [20, 40, 24, 30]
    actual = boxes_of(track("mean-shift-kalman", images, start))
    assert np.abs(actual[-3:, 0] - lefts[-3:]).max() < 8
    alone = boxes_of(track("mean-shift", images, start))
    assert np.abs(alone[-3:, 0] - lefts[-3:]).min() > 30


def test_below_the_least_coefficient_the_prediction_stands():
    images = [picture(20 + 5 * t, 40) for t in range(8)] + [
        np.full((120, 200, 3), 128, np.uint8)
    ] * 3
    actual = track("mean-shift-kalman", images, [20, 40, 24, 30])
    seen, hidden = actual[:7], actual[7:]
    assert all(estimate.visible for estimate in seen)
    assert not any(estimate.visible for estimate in hidden)
    steps = np.diff(boxes_of([seen[-1], *hidden]), axis=0)
    np.testing.assert_allclose(steps, [steps[0]] * 3, atol=1e-9)  # its velocity, and its size
    assert steps[0, 0] == pytest.approx(5, abs=1)
    assert [estimate.details["gain_x"] for estimate in hidden] == [0, 0, 0]


def test_a_place_is_believed_from_the_least_coefficient_on():
    images = [picture(20, 40), picture(22, 41)]
    (estimate,) = track("mean-shift-kalman", images, [20, 40, 24, 30])
    for least, visible in (
        (estimate.confidence, True),
        (min(estimate.confidence + 1e-9, 1), False),
    ):
        (again,) = track("mean-shift-kalman", images, [20, 40, 24, 30], least_coefficient=least)
        assert again.visible is visible


def test_search_start_is_clipped_to_the_image():
    target_image, empty = picture(20, 40), np.full((120, 200, 3), 128, np.uint8)
    tracker = trackers.create("mean-shift-kalman")
    tracker.init(target_image, np.array([20.0, 40, 24, 30]))
    tracker._motion.means[:] = [[-60, -9], [55, 0]]
    gone = tracker.update(empty)
    assert not gone.visible
    assert (gone.details["measured_x"], gone.details["measured_y"]) == (0, 55)
    np.testing.assert_allclose(gone.box, [-69 - 12, 40, 24, 30])
    back = tracker.update(picture(-8, 40))
    assert back.visible
    assert back.details["measured_x"] == pytest.approx(4, abs=3)
    assert back.box[0] > gone.box[0] + 30
