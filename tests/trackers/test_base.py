"""Base modules of trackers: parameters, shared frames, particles and Kalman filters."""

from math import ceil, floor, inf
from time import thread_time
from typing import Literal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import Field

from trackmark.trackers.base.interface import check_box
from trackmark.trackers.base.kalman import ConstantVelocity, ScalarSmoother
from trackmark.trackers.base.parameters import Parameters, TrackerError
from trackmark.trackers.base.particles import (
    SCHEMES,
    effective_sample_size,
    mean_state,
    normalise_log_weights,
)
from trackmark.trackers.base.sharing import SharedFrame


class Example(Parameters):
    count: int = Field(32, ge=1, le=254, description="how many [count]")
    radius: float = Field(2.0, ge=0, description="how far [pixels]")
    adapt: bool = Field(default=True, description="whether it adapts")
    window: Literal["fixed", "adaptive"] = Field("fixed", description="which window")


@pytest.mark.parametrize("box", [[1, 2, 0, 4], [1, 2, 3], "a box"])
def test_box_that_is_not_valid_is_named(box):
    with pytest.raises(TrackerError) as caught:
        check_box(box)
    assert str(caught.value).startswith(f"{box} is not a valid box. Expected: four finite numbers")


@pytest.mark.parametrize(
    ("name", "text", "value"),
    [
        ("count", "16", 16),
        ("radius", "3", 3.0),
        ("radius", "1e-3", 0.001),
        ("adapt", "false", False),
        ("adapt", "True", True),
        ("window", "adaptive", "adaptive"),
    ],
)
def test_parameter_text_becomes_the_declared_type(name, text, value):
    actual = getattr(Example.checked("example", {name: text}), name)
    assert actual == value
    assert type(actual) is type(value)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("count", "0", "example: parameter count=0: .*greater than or equal to 1"),
        ("count", 255, "example: parameter count=255: .*less than or equal to 254"),
        ("count", "2.5", "example: parameter count=2.5: .*integer"),
        ("count", "many", "example: parameter count=many: .*integer"),
        ("radius", "nan", "example: parameter radius=nan: .*finite"),
        ("radius", float("inf"), "example: parameter radius=inf: .*finite"),
        ("adapt", "perhaps", "example: parameter adapt=perhaps: .*boolean"),
        ("window", "fixd", "example: parameter window=fixd: .*'fixed' or 'adaptive'"),
    ],
)
def test_invalid_parameter_error_names_owner_and_bounds(name, value, message):
    with pytest.raises(TrackerError, match=message) as caught:
        Example.checked("example", {name: value})
    assert "\n" not in str(caught.value)


def test_unknown_parameter_error_has_the_closest_or_all_names():
    with pytest.raises(TrackerError) as caught:
        Example.checked("example", {"cuont": 3})
    assert str(caught.value) == ("unknown parameter of example 'cuont'. Did you mean 'count'?")
    with pytest.raises(TrackerError, match="Known: adapt, count, radius, window"):
        Example.checked("example", {"xyz": 3})
    with pytest.raises(TrackerError, match="Known: none"):
        Parameters.checked("static", {"speed": 1})


IMAGE = np.arange(60, dtype=np.uint8).reshape(4, 5, 3)


def counting(calls):
    def scaled(image, factor, offset=0, none=None):
        calls.append((factor, offset))
        return image.astype(int) * factor + offset

    return scaled


def test_shared_results_are_cached_by_function_and_arguments():
    calls = []
    scaled = counting(calls)
    frame = SharedFrame(IMAGE)
    first = frame.compute(scaled, 3)
    assert frame.compute(scaled, 3) is first
    assert calls == [(3, 0)]
    np.testing.assert_array_equal(first, IMAGE.astype(int) * 3)
    assert frame.compute(scaled, 2).max() == 118
    assert frame.compute(scaled, 2, offset=1, none=None).max() == 119
    assert frame.compute(scaled, 2, none=None, offset=1).max() == 119
    assert frame.compute(counting(calls), 2).max() == 118
    assert SharedFrame(IMAGE).compute(scaled, 3).max() == 177
    assert calls == [(3, 0), (2, 0), (2, 1), (2, 0), (3, 0)]


def test_cached_result_is_charged_with_its_time():
    def compute(image):
        end = thread_time() + 0.01
        while thread_time() < end:
            pass

    frame = SharedFrame(IMAGE, 2)
    frame.compute(compute)
    assert frame.saved_seconds == 0
    frame.compute(compute)
    assert frame.saved_seconds >= 0.01


def test_shared_image_is_read_only():
    image = IMAGE.copy()
    frame = SharedFrame(image)
    with pytest.raises(ValueError, match="read-only"):
        frame.image[0, 0, 0] = 1
    assert np.shares_memory(frame.image, image)
    assert image.flags.writeable


@pytest.mark.parametrize(
    "image", [IMAGE[..., 0], IMAGE[..., :1], IMAGE / 255, IMAGE.repeat(2, axis=2), IMAGE > 0]
)
def test_shared_frame_rejects_other_arrays_than_images(image):
    words = r"^the image is [^\n]* Expected: BGR, uint8, of shape \(height, width, 3\)[^\n]*$"
    with pytest.raises(TrackerError, match=words):
        SharedFrame(image)


OTHERS = ["systematic", "stratified", "residual"]


def test_normalise_log_weights_handles_underflow():
    assert np.exp(-5000.0) == 0.0
    weights = normalise_log_weights(np.array([-5000.0, -5001.0, -np.inf]))
    np.testing.assert_allclose(weights, [1 / (1 + np.exp(-1)), 1 / (1 + np.e), 0], rtol=1e-12)
    assert normalise_log_weights(np.full(4, -np.inf)).tolist() == [0.25] * 4


@given(st.integers(1, 50), st.integers(0, 50))
def test_effective_sample_size_and_mean_of_equal_weights(k, others):
    weights = np.concatenate([np.full(k, 1 / k), np.zeros(others)])
    assert effective_sample_size(weights) == pytest.approx(k)
    states = np.random.default_rng(k).normal(size=(k + others, 3))
    np.testing.assert_allclose(mean_state(weights, states), states[:k].mean(axis=0), atol=1e-12)


def copies(name, weights, uniforms):
    chosen = SCHEMES[name](weights, uniforms)
    assert len(chosen) == len(weights)
    return np.bincount(chosen, minlength=len(weights))


weighted = st.lists(st.floats(0, 1), min_size=1, max_size=25).filter(any).map(np.array)


@pytest.mark.parametrize("name", SCHEMES)
@given(weighted, st.integers(0, 999))
def test_number_of_copies_is_close_to_its_expected_value(name, weights, seed):
    weights = weights / weights.sum()
    uniforms = np.random.default_rng(seed).random(len(weights))
    actual = copies(name, weights, uniforms)
    assert actual.sum() == len(weights)
    assert not actual[weights == 0].any()
    expected = len(weights) * weights
    for n, share in zip(actual, expected, strict=True):
        if name == "systematic":
            assert floor(share - 1e-9) <= n <= ceil(share + 1e-9)
        if name == "stratified":
            assert floor(share - 1e-9) - 1 <= n <= ceil(share + 1e-9) + 1
        if name == "residual":
            assert n >= floor(share - 1e-9)


@pytest.mark.parametrize("name", SCHEMES)
@pytest.mark.parametrize("extreme", [0.0, np.nextafter(1.0, 0.0)])
def test_resampling_never_selects_weight_zero(name, extreme):
    weights = np.array([0.0, 0.3, 0.0, 0.7, 0.0])
    chosen = SCHEMES[name](weights, np.full(5, extreme))
    assert set(chosen.tolist()) <= {1, 3}


@pytest.mark.parametrize("n", [49, 200])  # 49 · (1/49) is less than 1 in floating point
@pytest.mark.parametrize("name", OTHERS)
def test_resampling_equal_weights_keeps_every_particle(name, n):
    uniforms = np.random.default_rng(0).random(n)
    assert SCHEMES[name](np.full(n, 1 / n), uniforms).tolist() == list(range(n))


F, H = np.array([[1.0, 1.0], [0.0, 1.0]]), np.array([[1.0, 0.0]])
Q = np.array([[0.25, 0.5], [0.5, 1.0]])


def textbook(state, covariance, noise, measurements, deviations):
    """Yield state, covariance and gain of one axis per measurement, in Joseph's form."""
    x, p = np.array(state, float)[:, np.newaxis], np.array(covariance, float)
    for measured, deviation in zip(measurements, deviations, strict=True):
        x, p = F @ x, F @ p @ F.T + noise**2 * Q
        gain = p @ H.T @ np.linalg.inv(H @ p @ H.T + deviation**2)
        x, rest = x + gain @ (measured - H @ x), np.eye(2) - gain @ H
        p = rest @ p @ rest.T + deviation**2 * gain @ gain.T
        yield x.ravel(), p, float(gain[0, 0])


def test_scalar_smoother_equals_the_textbook_filter():
    values = 3 + np.cumsum(np.random.default_rng(0).normal(0.5, 1, 30))
    smoother = ScalarSmoother(3.0, 0.5, 0.7, 0.4, 2.0)
    expected = textbook([3.0, 0.5], np.diag([0.16, 4.0]), 0.7, values, np.full(30, 0.4))
    for value, (state, _, _) in zip(values, expected, strict=True):
        assert smoother.predicted() == smoother.value + smoother.velocity
        smoother.measure(value)
        assert [smoother.value, smoother.velocity] == pytest.approx(state, abs=1e-12)


sizes = st.floats(0.1, 100)


@settings(max_examples=30)
@given(
    st.tuples(st.floats(-500, 500), st.floats(-500, 500)),
    st.tuples(sizes, sizes),
    st.floats(0.01, 50),
    st.lists(st.tuples(*[st.floats(-500, 500)] * 2, sizes, sizes), min_size=1, max_size=12),
)
def test_constant_velocity_equals_the_textbook_filter_by_axis(
    position, velocity_deviation, noise, rows
):
    measurements, deviations = np.array(rows)[:, :2], np.array(rows)[:, 2:]
    tracked = ConstantVelocity(np.array(position), np.array(velocity_deviation), noise)
    axes = [
        textbook([x, 0], np.diag([0, speed**2]), noise, measured, deviation)
        for x, speed, measured, deviation in zip(
            position, velocity_deviation, measurements.T, deviations.T, strict=True
        )
    ]
    for k, both in enumerate(zip(*axes, strict=True)):
        tracked.predict()
        gains = tracked.correct(measurements[k], deviations[k])
        for axis, (state, covariance, gain) in enumerate(both):
            np.testing.assert_allclose(tracked.means[axis], state, rtol=1e-6, atol=1e-6)
            np.testing.assert_allclose(tracked.covariances[axis], covariance, rtol=1e-6, atol=1e-6)
            assert gains[axis] == pytest.approx(gain, rel=1e-6)
        assert tracked.position.tolist() == tracked.means[:, 0].tolist()


def test_correct_with_infinite_and_zero_variance():
    tracked = ConstantVelocity(np.array([3.0, 4.0]), np.array([2.0, 5.0]), 1.0)
    tracked.predict()
    means, covariances = tracked.means.copy(), tracked.covariances.copy()
    assert tracked.correct(np.array([99.0, -99.0]), np.array([inf, inf])).tolist() == [0, 0]
    np.testing.assert_array_equal(tracked.means, means)
    np.testing.assert_array_equal(tracked.covariances, covariances)
    assert tracked.correct(np.array([5.0, 1.0]), np.zeros(2)).tolist() == [1, 1]
    np.testing.assert_allclose(tracked.position, [5, 1], atol=1e-12)
