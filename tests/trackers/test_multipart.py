"""Tracker `multipart`, compared with the paper's equations in plain loops."""

from fractions import Fraction
from functools import cache
from itertools import product
from math import exp, floor, hypot, sqrt

import cv2
import numpy as np
import pytest

from tests.trackers.following import boxes_of, track, two_coloured
from trackmark import trackers
from trackmark.trackers.histograms.bins import LuvBins

RANGES = {
    "full": None,  # the range of a byte
    "natural": ((-60, 120), (-80, 80)),
    "srgb-gamut": ((-83, 175), (-134, 107)),
}
SCHEMES = [LuvBins(*row) for row in product(["both", "perez"], RANGES)]


@cache
def slow_votes(luv, binning, uv_range):
    """Return the bins of a pixel from OpenCV's three bytes."""
    lightness, u, v = luv
    if uv_range == "full":
        u_bin, v_bin = u * 10 // 256, v * 10 // 256
    else:
        exact = Fraction(354 * u, 255) - 134, Fraction(262 * v, 255) - 140
        u_bin, v_bin = (
            min(max(floor(10 * (value - low) / (high - low)), 0), 9)
            for value, (low, high) in zip(exact, RANGES[uv_range], strict=True)
        )
    chromaticity, grey = u_bin * 10 + v_bin, 100 + lightness * 10 // 256
    if binning == "both":
        return [chromaticity, grey]
    coloured = hypot(u * 354 / 255 - 134, v * 262 / 255 - 140) >= 17.9
    return [chromaticity if coloured else grey]


def slow_histogram(luv, left, top, right, bottom, *binning):
    """Return the normalised histogram of a rectangle: 100 bins of u*v* and 10 of L*."""
    histogram = np.zeros(110)
    for pixel in luv[top:bottom, left:right].reshape(-1, 3).tolist():
        for vote in slow_votes(tuple(pixel), *binning):
            histogram[vote] += 1
    return histogram / histogram.sum() if histogram.any() else histogram


def slow_distance(p, q):
    return sqrt(max(0.0, 1 - sum(sqrt(a * b) for a, b in zip(p, q, strict=True))))  # equation 1


def slow_rectangle(x, y, area, aspect, shape):
    """Return the clipped rectangle, or None if too little of it is inside."""
    width = sqrt(area * aspect)
    height = area / width
    left, right = floor(x - width / 2 + 0.5), floor(x + width / 2 + 0.5)
    top, bottom = floor(y - height / 2 + 0.5), floor(y + height / 2 + 0.5)
    whole = (right - left) * (bottom - top)
    left, right = max(left, 0), min(right, shape[1])
    top, bottom = max(top, 0), min(bottom, shape[0])
    inside = max(right - left, 0) * max(bottom - top, 0)
    return (left, top, right, bottom) if inside >= max(16, whole / 4) else None


def slow_halves(left, top, right, bottom):
    middle = (top + bottom) // 2
    return [(left, top, right, middle), (left, middle, right, bottom)]


def slow_track(images, box, seed, **settings):
    """Return boxes, confidences, mean distances and part distance; resampling is multinomial."""
    x, y, width, height = box
    n = settings.get("particles", 200)
    a, b = settings.get("position_divisor", 3.0), settings.get("size_divisor", 10.0)
    sigma = settings.get("sigma", 0.1)
    bins = settings.get("binning", "both"), settings.get("uv_range", "full")
    variance = sigma if settings.get("sigma_meaning") == "variance" else sigma**2
    rng = np.random.default_rng(np.random.SeedSequence(seed))
    aspect, first_area = width / height, width * height
    mean = [x + width / 2, y + height / 2, first_area]
    luv = cv2.cvtColor(images[0], cv2.COLOR_BGR2LUV)
    rectangle = slow_rectangle(*mean, aspect, luv.shape)
    p1, p2 = (slow_histogram(luv, *half, *bins) for half in slow_halves(*rectangle))
    part_distance = slow_distance(p1, p2)
    representation = settings.get("representation", "adaptive")
    if representation == "adaptive":
        representation = "multi" if part_distance > settings.get("threshold", 0.4) else "single"
    whole = slow_histogram(luv, *rectangle, *bins)
    states = [list(mean) for _ in range(n)]
    velocities = [[0.0, 0.0] for _ in range(n)]
    boxes, confidences, mean_distances = [], [], []
    for image in images[1:]:
        luv = cv2.cvtColor(image, cv2.COLOR_BGR2LUV)
        uniforms = rng.random((n, 3))
        distances, weights = [], []
        for i, state in enumerate(states):
            area = state[2] if settings.get("noise_size") == "sample" else mean[2]
            if settings.get("noise") == "fixed":
                area = first_area
            ranges = [sqrt(area * aspect) / a, sqrt(area * aspect) / a, area / b]  # equation 6
            if settings.get("noise_range") == "total":
                ranges = [value / 2 for value in ranges]
            noise = [(2 * u - 1) * r for u, r in zip(uniforms[i], ranges, strict=True)]
            if settings.get("dynamics") == "first-order":
                velocities[i] = [v + w for v, w in zip(velocities[i], noise[:2], strict=True)]
                noise[:2] = velocities[i]
            state = [s + w for s, w in zip(state, noise, strict=True)]  # equation 5
            state[2] = min(max(state[2], first_area / 25), first_area * 25)
            states[i] = state
            rectangle = slow_rectangle(*state, aspect, luv.shape)
            if rectangle is None:
                weights.append(0.0)
                distances.append(1.0)
                continue
            if representation == "multi":  # equation 2
                actual = [slow_histogram(luv, *h, *bins) for h in slow_halves(*rectangle)]
                d = (slow_distance(p1, actual[0]) + slow_distance(p2, actual[1])) / 2
            else:
                d = slow_distance(whole, slow_histogram(luv, *rectangle, *bins))
            weights.append(exp(-(d**2) / (2 * variance)))  # equation 8
            distances.append(d)
        total = sum(weights)
        weights = [w / total if total else 1 / n for w in weights]
        mean_distances.append(sum(w * d for w, d in zip(weights, distances, strict=True)))
        confidences.append(exp(-(mean_distances[-1] ** 2) / (2 * variance)))
        mean = [sum(w * s[k] for w, s in zip(weights, states, strict=True)) for k in range(3)]
        width = sqrt(mean[2] * aspect)
        height = mean[2] / width
        boxes.append([mean[0] - width / 2, mean[1] - height / 2, width, height])
        cumulative = np.cumsum(weights)
        uniforms = rng.random(n)
        chosen = [next((j for j in range(n) if cumulative[j] > u), n - 1) for u in uniforms]
        states = [list(states[j]) for j in chosen]
        velocities = [list(velocities[j]) for j in chosen]
    return np.array(boxes), confidences, mean_distances, part_distance


def picture(centre, noise=0):
    """Return an image of a target on noisy green."""
    left, top = round(centre[0] - 6), round(centre[1] - 10)
    return two_coloured(left, top, (12, 20), (60, 80), 12, noise)


@pytest.fixture(scope="module")
def clip():
    images = [picture((30 + 3 * t, 30 - t), noise=t) for t in range(4)]
    return images, np.array([24.0, 20.0, 12.0, 20.0])


INTERPRETATIONS = [
    {"representation": "single"},
    {"representation": "multi"},
    {"threshold": 0.0},
    {"threshold": 1.0},  # single
    {"binning": "perez"},
    {"binning": "perez", "uv_range": "srgb-gamut", "representation": "multi"},
    {"uv_range": "natural"},
    {"uv_range": "srgb-gamut"},
    {"sigma_meaning": "variance"},
    {"noise_range": "total"},
    {"noise_size": "sample"},
    {"dynamics": "first-order"},
    {"noise": "fixed"},
    {"position_divisor": 1.0, "size_divisor": 2.0, "sigma": 0.3},
]


@pytest.mark.parametrize("parameters", INTERPRETATIONS, ids=str)
def test_multipart_equals_the_equations_in_plain_loops(clip, parameters):
    images, box = clip
    actual = track("multipart", images, box, 3, particles=16, **parameters)
    boxes, confidences, distances, part_distance = slow_track(
        images, box, 3, particles=16, **parameters
    )
    np.testing.assert_allclose(boxes_of(actual), boxes, rtol=0, atol=1e-9)
    assert [e.confidence for e in actual] == pytest.approx(confidences, abs=1e-9)
    assert [e.details["distance"] for e in actual] == pytest.approx(distances, abs=1e-9)
    assert actual[0].details["part_distance"] == pytest.approx(part_distance, abs=1e-12)


@pytest.mark.parametrize("representation", ["single", "multi"])
def test_particles_outside_the_image_have_equal_weights(representation):
    images = [picture((8, 10)), picture((200, 10))]
    tracker = trackers.create("multipart", 0, representation=representation, particles=50)
    tracker.init(images[0], np.array([2.0, 0.0, 12.0, 20.0]))
    tracker._states[:, 0] = -500.0
    estimate = tracker.update(images[1])
    assert not estimate.visible
    np.testing.assert_allclose(estimate.arrays["weights"], 1 / 50)
    assert estimate.details["distance"] == pytest.approx(1)
    assert np.isfinite(estimate.box).all()
    assert tracker.update(images[1]).box[0] < -300


def test_multipart_areas_stay_within_a_factor_of_25(clip):
    images, box = clip
    estimates = track(
        "multipart", [*images] * 8, box, size_divisor=0.2, representation="single", sigma=5
    )
    areas = np.concatenate([estimate.arrays["particles"][:, 2] for estimate in estimates])
    assert areas.min() == pytest.approx(240 / 25)
    assert areas.max() == pytest.approx(240 * 25)


def colours(seed, height=19, width=29):
    """Return an image of random colours; its upper half is nearly grey."""
    rng = np.random.default_rng(seed)
    image = rng.integers(0, 256, (height, width, 3), dtype=np.uint8)
    image[: height // 2] = np.clip(
        image[: height // 2, :, :1] + image[: height // 2] % 48.0, 0, 255
    )
    return image


@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
def test_luv_votes_equal_the_slow_definition(scheme):
    image = colours(0)
    luv = cv2.cvtColor(image, cv2.COLOR_BGR2LUV)
    votes = scheme.votes[scheme.codes(image)]
    assert votes.shape[2] == scheme.votes_a_pixel
    for row, column in np.ndindex(luv.shape[:2]):
        expected = slow_votes(tuple(luv[row, column].tolist()), scheme.binning, scheme.uv_range)
        assert votes[row, column].tolist() == expected, luv[row, column]
