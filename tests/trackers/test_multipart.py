"""The tracker against the paper's equations written out slowly, and its own promises."""

from math import exp, floor, hypot, sqrt

import cv2
import numpy as np
import pytest

import trackers

RED, BLUE, GREEN = (20, 72, 200), (200, 56, 30), (60, 180, 40)


# The whole tracker again, in plain loops from the paper's equations.


def channel_bin(byte, low, high, byte_low, byte_high):
    value = byte_low + byte * (byte_high - byte_low) / 255
    return min(max(floor(10 * (value - low) / (high - low) + 1e-12), 0), 9)


RANGES = {
    "natural": ((-60, 120), (-80, 80)),
    "srgb-gamut": ((-83, 175), (-134, 107)),
}


def slow_histogram(luv, left, top, right, bottom, binning, uv_range):
    """Normalised: 10 bins of L* and 100 of u*v* of one rectangle."""
    histogram = np.zeros(110)
    for row in range(top, bottom):
        for column in range(left, right):
            lightness, u, v = (int(value) for value in luv[row, column])
            if uv_range == "full":
                u_bin, v_bin = u * 10 // 256, v * 10 // 256
            else:
                (u_low, u_high), (v_low, v_high) = RANGES[uv_range]
                u_bin = channel_bin(u, u_low, u_high, -134, 220)
                v_bin = channel_bin(v, v_low, v_high, -140, 122)
            chroma = hypot(u * 354 / 255 - 134, v * 262 / 255 - 140)
            if binning == "both" or chroma < 17.9:
                histogram[lightness * 10 // 256] += 1
            if binning == "both" or chroma >= 17.9:
                histogram[10 + u_bin * 10 + v_bin] += 1
    return histogram / histogram.sum() if histogram.any() else histogram


def slow_distance(p, q):
    return sqrt(max(0.0, 1 - sum(sqrt(a * b) for a, b in zip(p, q, strict=True))))  # equation 1


def slow_rectangle(x, y, area, aspect, shape):
    """Clipped rectangle, or None where too little of it is inside."""
    width = sqrt(area * aspect)
    height = area / width
    left, right = floor(x - width / 2 + 0.5), floor(x + width / 2 + 0.5)
    top, bottom = floor(y - height / 2 + 0.5), floor(y + height / 2 + 0.5)
    whole = (right - left) * (bottom - top)
    left, right, top, bottom = (
        max(left, 0),
        min(right, shape[1]),
        max(top, 0),
        min(bottom, shape[0]),
    )
    inside = max(right - left, 0) * max(bottom - top, 0)
    return (left, top, right, bottom) if inside >= max(16, whole / 4) else None


def slow_halves(left, top, right, bottom):
    middle = (top + bottom) // 2
    return [(left, top, right, middle), (left, middle, right, bottom)]


def slow_track(images, box, seed, **settings):
    """Boxes and part distance; multinomial resampling."""
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
    boxes = []
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
                continue
            if representation == "multi":  # equation 2
                found = [slow_histogram(luv, *h, *bins) for h in slow_halves(*rectangle)]
                d = (slow_distance(p1, found[0]) + slow_distance(p2, found[1])) / 2
            else:
                d = slow_distance(whole, slow_histogram(luv, *rectangle, *bins))
            weights.append(exp(-(d**2) / (2 * variance)))  # equation 8
            distances.append(d)
        total = sum(weights)
        weights = [w / total if total else 1 / n for w in weights]
        mean = [sum(w * s[k] for w, s in zip(weights, states, strict=True)) for k in range(3)]
        width = sqrt(mean[2] * aspect)
        height = mean[2] / width
        boxes.append([mean[0] - width / 2, mean[1] - height / 2, width, height])
        cumulative = np.cumsum(weights)
        uniforms = rng.random(n)
        chosen = [next((j for j in range(n) if cumulative[j] > u), n - 1) for u in uniforms]
        states = [list(states[j]) for j in chosen]
        velocities = [list(velocities[j]) for j in chosen]
    return np.array(boxes), part_distance


def picture(centre, size=(12, 20), height=60, width=80, noise=0):
    """A target red over blue on noisy green."""
    rng = np.random.default_rng(noise)
    image = np.full((height, width, 3), GREEN, float)
    left, top = round(centre[0] - size[0] / 2), round(centre[1] - size[1] / 2)
    rows, columns = slice(max(top, 0), top + size[1]), slice(max(left, 0), left + size[0])
    image[rows, columns] = BLUE
    image[rows.start : top + size[1] // 2, columns] = RED
    return np.clip(image + rng.normal(0, 12, image.shape), 0, 255).astype(np.uint8)


@pytest.fixture(scope="module")
def clip():
    images = [picture((30 + 3 * t, 30 - t), noise=t) for t in range(5)]
    return images, np.array([24.0, 20.0, 12.0, 20.0])


def track(images, box, seed=0, **parameters):
    tracker = trackers.create("multipart", seed, **parameters)
    tracker.init(images[0], np.asarray(box, float))
    return [tracker.update(image) for image in images[1:]]


def boxes(estimates):
    return np.array([estimate.box for estimate in estimates])


READINGS = [
    {"representation": "single"},
    {"representation": "multi"},
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


@pytest.mark.parametrize("reading", READINGS, ids=str)
def test_the_boxes_are_those_of_the_equations_in_plain_loops(clip, reading):
    images, box = clip
    found = track(images, box, 3, particles=24, **reading)
    expected, part_distance = slow_track(images, box, 3, particles=24, **reading)
    np.testing.assert_allclose(boxes(found), expected, rtol=0, atol=1e-9)
    assert found[0].details["part_distance"] == pytest.approx(part_distance, abs=1e-12)
