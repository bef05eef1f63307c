"""Trackers `mean-shift` and `mean-shift-kalman`, compared with the paper's equations."""

from math import hypot, inf, log

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tests.trackers.following import boxes_of, centres_of, track, two_coloured
from tests.trackers.references.ellipses import codes_of, histogram_of, pixels_of
from trackmark import trackers
from trackmark.trackers.base.parameters import TrackerError
from trackmark.trackers.base.sharing import SharedFrame
from trackmark.trackers.mean_shift_kalman import _deviation

GREEN = (60, 180, 40)


def slow_shift(codes, q, x, y, half, stop, most, halving):
    """Return position, coefficient and number of steps."""

    def coefficient(x, y):
        return np.sqrt(histogram_of(codes, len(q), (x, y, *half)) * q).sum()

    current, steps = coefficient(x, y), 0
    while current > 0 and steps < most:
        steps += 1
        p = histogram_of(codes, len(q), (x, y, *half))
        pixel_codes, columns, rows, _ = pixels_of(codes, (x, y, *half))
        weights = np.sqrt(q[pixel_codes] / p[pixel_codes])
        new_x, new_y = (weights @ columns) / weights.sum(), (weights @ rows) / weights.sum()
        step = hypot(new_x - x, new_y - y)
        while halving and coefficient(new_x, new_y) < current:
            if step < stop:
                return x, y, current, steps
            new_x, new_y = (x + new_x) / 2, (y + new_y) / 2
            step = hypot(new_x - x, new_y - y)
        x, y = new_x, new_y
        current = coefficient(x, y)
        if step < stop:
            break
    return x, y, current, steps


def slow_track(images, box, **parameters):
    settings = trackers.resolve("mean-shift", **parameters).parameters
    n_bins = (
        settings.bins**3 if settings.colour == "rgb" else settings.bins**2 * (settings.bins // 2)
    )
    half = np.array(box[2:]) / 2
    x, y = np.array(box[:2]) + half
    q = histogram_of(codes_of(images[0], settings.colour, settings.bins), n_bins, (x, y, *half))
    step = settings.scale_step
    factors = [1.0] if settings.scale == "fixed" else [1.0, 1 - step, 1 + step]
    estimates = []
    for image in images[1:]:
        codes = codes_of(image, settings.colour, settings.bins)
        best = None
        for factor in factors:
            rules = settings.stop_distance, settings.max_iterations, settings.step_halving
            candidate = slow_shift(codes, q, x, y, half * factor, *rules)
            if best is None or candidate[2] > best[0][2]:
                best = candidate, half * factor
        (x, y, coefficient, steps), best_half = best
        half = settings.scale_smoothing * best_half + (1 - settings.scale_smoothing) * half
        estimates.append((x - half[0], y - half[1], 2 * half[0], 2 * half[1], coefficient, steps))
    return np.array(estimates)


def picture(centre, size=(24.0, 36.0), height=80, width=120, noise=None, fine=2):
    """Return an image of concentric ellipses on green, averaged over `fine` samples per side."""
    rows, columns = (np.indices((height * fine, width * fine)) + 0.5) / fine
    across, down = (columns - centre[0]) / size[0] * 2, (rows - centre[1]) / size[1] * 2
    distance = across**2 + down**2
    image = np.full((*rows.shape, 3), GREEN, float)
    for share, colour in ((1.0, (30, 50, 210)), (0.7, (210, 80, 30)), (0.4, (40, 210, 220))):
        image[distance < share**2] = colour
    image = image.reshape(height, fine, width, fine, 3).mean(axis=(1, 3))
    if noise is not None:
        image += np.random.default_rng(noise).normal(0, 10, image.shape)
    return np.clip(image, 0, 255).astype(np.uint8)


@pytest.fixture(scope="module")
def clip():
    """Return images of a moving and growing target with noise, and the first box."""
    images = [
        picture((40 + 2.3 * t, 40 - 1.4 * t), (24 + t / 2, 36 + t / 2), noise=t, fine=4)
        for t in range(6)
    ]
    return images, np.array([28.0, 22.0, 24.0, 36.0])


INTERPRETATIONS = [
    {},
    {"preset": "as-written"},
    {"colour": "hsv"},
    {"bins": 16},
    {"bins": 5, "colour": "hsv"},
    {"scale": "fixed"},
    {"scale_step": 0.05, "scale_smoothing": 1.0},
    {"step_halving": False, "max_iterations": 2},
    {"stop_distance": 3.0},
]


@pytest.mark.parametrize("parameters", INTERPRETATIONS, ids=str)
def test_mean_shift_equals_the_equations_in_numpy(clip, parameters):
    images, box = clip
    actual = track("mean-shift", images, box, **parameters)
    expected = slow_track(images, box, **parameters)
    np.testing.assert_allclose(boxes_of(actual), expected[:, :4], rtol=0, atol=1e-9)
    confidences = [estimate.confidence for estimate in actual]
    np.testing.assert_allclose(confidences, expected[:, 4], rtol=0, atol=1e-9)
    assert [estimate.details["iterations"] for estimate in actual] == expected[:, 5].tolist()
    for estimate in actual:
        assert estimate.details["coefficient"] == estimate.confidence
        assert estimate.details["half_width"] == estimate.box[2] / 2
        assert estimate.details["half_height"] == estimate.box[3] / 2


@settings(max_examples=40)
@given(
    st.integers(0, 999),
    st.tuples(st.integers(-20, 60), st.integers(-20, 50), st.integers(3, 40), st.integers(3, 40)),
)
@example(0, (20, -15, 20, 20))  # the outer columns of the ellipse are above the image
@example(0, (-15, 20, 20, 20))
def test_mean_shift_at_the_border_equals_the_equations(seed, box):
    images = np.random.default_rng(seed).integers(0, 256, (2, 48, 56, 3), dtype=np.uint8)
    images[:, ::2] = images[:, 1::2]
    box = np.array(box) + [0.1234, 0.2345, 0.3456, 0.4567]  # no pixel on the rim
    settings = {"bins": 2, "max_iterations": 2}
    try:
        actual = track("mean-shift", list(images), box, **settings)
    except TrackerError as refusal:
        assert "outside the image" in str(refusal)  # noqa: PT017  # most boxes are accepted
        half = box[2:] / 2
        assert not len(pixels_of(images[0, ..., 0], (*(box[:2] + half), *half))[0])
        return
    expected = slow_track(images, box, **settings)
    np.testing.assert_allclose(boxes_of(actual), expected[:, :4], rtol=0, atol=1e-9)
    assert actual[0].confidence == pytest.approx(expected[0, 4], abs=1e-9)


def test_mean_shift_sides_are_at_least_three_pixels():
    full, spot = np.full((80, 120, 3), 90, np.uint8), np.full((80, 120, 3), GREEN, np.uint8)
    spot[39:41, 59:61] = 90  # a smaller ellipse has a larger share of the spot
    actual = boxes_of(
        track("mean-shift", [full, *[spot] * 30], [50, 34, 20, 12], scale_smoothing=1.0)
    )
    np.testing.assert_allclose(actual[9, 2], 20 * 0.9**10)
    np.testing.assert_allclose(actual[-1, 2:], np.array([20, 12]) * 0.9**13)  # 3.05 high


def test_mean_shift_sides_are_at_most_those_of_the_image():
    first, second = np.full((2, 80, 120, 3), GREEN, np.uint8)
    first[36:44, 56:64] = 90
    second[28:52, 48:72] = 90  # a larger ellipse has more of the ground
    actual = boxes_of(
        track("mean-shift", [first, *[second] * 30], [45, 25, 30, 30], scale_smoothing=1.0)
    )
    np.testing.assert_allclose(actual[-1, 2:], 30 * 1.1**10)  # 77.8 of 80


def test_mean_shift_finds_a_target_that_returns():
    target_image, empty = picture((60, 40)), np.full((80, 120, 3), 0, np.uint8)
    gone, back = track("mean-shift", [target_image, empty, target_image], [48, 22, 24, 36])
    assert not gone.visible
    assert gone.confidence == 0
    assert gone.details["iterations"] == 0
    assert gone.box.tolist() == [48, 22, 24, 36]
    assert back.visible
    np.testing.assert_allclose(back.box, [48, 22, 24, 36], atol=0.2)


@pytest.mark.parametrize("turns", range(4))
def test_mean_shift_can_leave_the_first_search_window(turns):
    first, second = np.zeros((2, 400, 400, 3), np.uint8)
    first[180:220, 180:220] = 255
    second[198:202, 210:380] = 255  # overlaps the first window, and leads out of it
    images = [np.ascontiguousarray(np.rot90(image, turns)) for image in (first, second)]
    settings = {"scale": "fixed", "max_iterations": 100, "stop_distance": 1e-3}
    (alone,) = track("mean-shift", images, [180, 180, 40, 40], **settings)
    assert np.abs(centres_of([alone]) - 200).max() > 25
    tracker = trackers.create("mean-shift", **settings)
    tracker.init_shared(SharedFrame(images[0], 999), np.array([180.0, 180, 40, 40]))
    together = tracker.update_shared(SharedFrame(images[1], 999))
    assert together.box.tolist() == alone.box.tolist()


def test_deviation_is_infinite_without_peak_and_0_at_a_point():
    assert _deviation(0.6, 0.5, 0.7, 9.0) == inf
    assert _deviation(0.5, 0.5, 0.5, 9.0) == inf
    assert _deviation(0.0, 0.5, 0.4, 9.0) == 0.0


def halves(left, top):
    """Return an image of a target on noisy green."""
    return two_coloured(left, top, (24, 30), (120, 200), 8, abs(left * 31 + top))


def test_box_and_gain_follow_from_the_measured_positions():
    images = [halves(20 + 4 * t, 40 + t) for t in range(8)]
    actual = track("mean-shift-kalman", images, [20, 40, 24, 30], acceleration_noise=3.0)
    transition, noise = np.array([[1, 1], [0, 1]]), 9 * np.array([[0.25, 0.5], [0.5, 1]])
    for axis, start, half in (("x", 32.0, 12.0), ("y", 55.0, 15.0)):
        state, covariance = np.array([start, 0.0]), np.diag([0.0, half**2])
        for estimate in actual:
            measured, gain = (estimate.details[f"{name}_{axis}"] for name in ("measured", "gain"))
            state = transition @ state
            covariance = transition @ covariance @ transition.T + noise
            position = covariance[0, 0]
            uncertainty = position / gain - position  # variance of the measurement
            assert uncertainty > 0
            full = covariance[:, 0] / (position + uncertainty)
            state = state + full * (measured - state[0])
            covariance = covariance - np.outer(full, covariance[0])
            centre = estimate.box[:2] + estimate.box[2:] / 2
            assert centre["xy".index(axis)] == pytest.approx(state[0], abs=1e-6)
            assert estimate.visible


def test_first_gain_follows_from_coefficient_surface():
    images = [halves(20, 40), halves(22, 41)]
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


def test_prediction_is_kept_below_the_least_coefficient():
    images = [halves(20 + 5 * t, 40) for t in range(8)] + [
        np.full((120, 200, 3), 128, np.uint8)
    ] * 3
    box = [20, 40, 24, 30]
    actual = track("mean-shift-kalman", images, box)
    seen, hidden = actual[:7], actual[7:]
    assert all(estimate.visible for estimate in seen)
    assert not any(estimate.visible for estimate in hidden)
    steps = np.diff(boxes_of([seen[-1], *hidden]), axis=0)
    np.testing.assert_allclose(steps, [steps[0]] * 3, atol=1e-9)  # constant velocity and size
    assert steps[0, 0] == pytest.approx(5, abs=1)
    assert [estimate.details["gain_x"] for estimate in hidden] == [0, 0, 0]
    for least, visible in ((seen[0].confidence, True), (seen[0].confidence + 1e-9, False)):
        (first,) = track("mean-shift-kalman", images[:2], box, least_coefficient=least)
        assert first.visible is visible


def test_search_start_is_clipped_to_the_image():
    target_image, empty = halves(20, 40), np.full((120, 200, 3), 128, np.uint8)
    tracker = trackers.create("mean-shift-kalman")
    tracker.init(target_image, np.array([20.0, 40, 24, 30]))
    tracker._motion.means[:] = [[-60, -9], [55, 0]]
    gone = tracker.update(empty)
    assert not gone.visible
    assert (gone.details["measured_x"], gone.details["measured_y"]) == (0, 55)
    np.testing.assert_allclose(gone.box, [-69 - 12, 40, 24, 30])
    back = tracker.update(halves(-6, 40))
    assert back.visible
    assert back.details["measured_x"] == pytest.approx(6, abs=3)
    assert back.box[0] > gone.box[0] + 30
