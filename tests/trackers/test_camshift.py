"""Hue kernels and tracker `camshift`, compared with slow definitions."""

from fractions import Fraction
from math import floor, sqrt

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from tests.trackers.following import BLUE, GREEN, RED, track, two_coloured
from trackmark.trackers.base.parameters import TrackerError
from trackmark.trackers.base.sharing import SharedFrame
from trackmark.trackers.maps.back_projection import (
    HueBins,
    adapted_window,
    hue_bin,
    lazy_hue_bins,
    mean_shift,
)

byte = st.integers(0, 255)
colour = st.tuples(byte, byte, byte)
bins = st.integers(1, 254)


def exact_hue(blue, green, red):
    """Return the hue of MATLAB's `rgb2hsv` in [0, 1) as a fraction; grey is 0."""
    largest, smallest = max(blue, green, red), min(blue, green, red)
    if largest == smallest:
        return Fraction(0)
    spread = largest - smallest
    if red == largest:
        hue = Fraction(green - blue, spread)
    elif green == largest:
        hue = 2 + Fraction(blue - red, spread)
    else:
        hue = 4 + Fraction(red - green, spread)
    return hue / 6 % 1


@given(colour, bins)
@example((0, 0, 255), 32)
@example((1, 0, 255), 32)  # just below red: the last bin
@example((255, 255, 0), 12)
def test_hue_bin_equals_the_exact_fraction(bgr, n_bins):
    pixel = tuple(np.uint8(value) for value in bgr)  # the type of pixels
    assert hue_bin(*pixel, n_bins) == floor(n_bins * exact_hue(*bgr))


def picture(seed, height=17, width=23):
    return np.random.default_rng(seed).integers(0, 256, (height, width, 3), dtype=np.uint8)


def slow_bins(image, n_bins, minimum_saturation, minimum_value, maximum_value=1.0):
    bin_numbers = np.empty(image.shape[:2], int)
    for row, column in np.ndindex(bin_numbers.shape):
        bgr = [int(value) for value in image[row, column]]
        largest, spread = max(bgr), max(bgr) - min(bgr)
        saturation = spread / largest if largest else 0.0
        in_range = minimum_value <= largest / 255 <= maximum_value
        masked = saturation < minimum_saturation or not in_range
        bin_numbers[row, column] = n_bins if masked else floor(n_bins * exact_hue(*bgr))
    return bin_numbers


def slow_moments(weight_of_pixel, left, top, width, height):
    total = np.zeros(3)
    for row, column in np.ndindex(weight_of_pixel.shape):
        if left <= column < left + width and top <= row < top + height:
            total += weight_of_pixel[row, column] * np.array([1, column, row])
    return total


window = st.tuples(st.integers(-8, 25), st.integers(-8, 20), st.integers(1, 30), st.integers(1, 30))


def hues_of(image, n_bins=32, *limits) -> HueBins:
    return SharedFrame(image).compute(lazy_hue_bins, n_bins, *(limits or (0.0, 0.0, 1.0)))


def slow_mean_shift(projection, centre, size, stop_distance, max_iterations):
    """Return position, number of steps and weight; pixel centres are at integers.

    Fractions are exact if an edge of the window lies exactly between two pixels.
    """

    def sums(x, y):
        left = floor(x - Fraction(size[0] - 2, 2))
        top = floor(y - Fraction(size[1] - 2, 2))
        return slow_moments(projection, left, top, *size)

    x, y = (Fraction(value + 0.5) - Fraction(1, 2) for value in centre)
    n = 0
    while True:
        m00, m10, m01 = (int(value) for value in sums(x, y))
        n += 1
        if m00 == 0:
            break
        step = np.hypot(float(Fraction(m10, m00) - x), float(Fraction(m01, m00) - y))
        x, y = Fraction(m10, m00), Fraction(m01, m00)
        if step < stop_distance or n == max_iterations:
            break
    return float(x), float(y), n, sums(x, y)[0]


# Centres on a grid of 2^-10 pixels: adding half a pixel must not round them.
@given(
    st.integers(0, 999),
    st.tuples(*(st.integers(-5 << 10, most << 10).map(lambda n: n / 1024) for most in (28, 22))),
    st.tuples(st.integers(1, 14), st.integers(1, 14)),
    st.sampled_from([0.0, 0.1, 0.5, 2.0]),
    st.integers(1, 10),
)
@example(0, (500.0, 400.0), (5, 5), 2.0, 10)  # outside: no step
@example(320, (23.0, 0.0), (4, 12), 0.0, 2)  # an edge lies exactly between two pixels
def test_mean_shift_equals_the_definition_in_fractions(
    seed, centre, size, stop_distance, max_iterations
):
    image = picture(seed)
    weights = np.append(np.random.default_rng(seed).integers(0, 900, 32), 0)
    projection = weights[slow_bins(image, 32, 0, 0)]
    expected = slow_mean_shift(projection, centre, size, stop_distance, max_iterations)
    x, y, n_iterations, total = mean_shift(
        hues_of(image),
        weights,
        centre[0] + 0.5,
        centre[1] + 0.5,
        *size,
        stop_distance,
        max_iterations,
    )
    assert (x - 0.5, y - 0.5) == pytest.approx(expected[:2], abs=1e-9)
    assert n_iterations == expected[2]
    assert total == expected[3]


def scene(centre):
    """Return an image of a target, and its box."""
    left, top = round(centre[0] - 12), round(centre[1] - 18)
    return two_coloured(left, top, (24, 36), (120, 160)), np.array([left, top, 24, 36], float)


def test_camshift_centre_is_the_back_projection_centroid():
    template = np.full((40, 40, 3), GREEN, np.uint8)
    template[10:14, 10:16] = RED  # 24 pixels
    template[14:16, 10:16] = BLUE  # 12 pixels: they weigh half
    moved = np.full((40, 40, 3), GREEN, np.uint8)
    moved[11, 12] = RED
    moved[13, 15] = BLUE
    (estimate,) = track("camshift", [template, moved], [10, 10, 6, 6], stop_distance=99)
    centre = estimate.box[:2] + estimate.box[2:] / 2
    expected = (np.array([12.5, 11.5]) + 0.5 * np.array([15.5, 13.5])) / 1.5
    assert centre == pytest.approx(expected, abs=1e-9)
    assert estimate.details["iterations"] == 1
    assert estimate.details["mean_back_projection"] == pytest.approx(1.5 / 36, abs=1e-9)
    assert estimate.confidence == estimate.details["mean_back_projection"]


def test_adaptive_window_follows_bradskis_rule():
    image, box = scene((60, 60))
    (estimate,) = track("camshift", [image, image], box, window="adaptive")
    mass = 24 * 36  # both colours fill half the template: every pixel weighs 1
    ratio = 24 / 36
    expected = [2 * sqrt(mass * ratio), 2 * sqrt(mass / ratio)]  # 48 x 72
    assert estimate.box[2:] == pytest.approx(expected, abs=0.5)
    assert estimate.box[:2] + estimate.box[2:] / 2 == pytest.approx([60, 60], abs=1e-9)
    assert estimate.confidence == 1.0
    assert adapted_window(100.0, 1.1, (500, 500)) == (21, 19)  # 2 √110 = 20.98, 2 √90.9 = 19.07


def test_adaptive_window_size_is_limited():
    full = np.full((50, 40, 3), RED, np.uint8)
    estimates = track("camshift", [full] * 8, [10, 10, 20, 20], window="adaptive")
    assert estimates[-1].box.tolist() == [0, 0, 40, 50]
    dot = np.full((50, 40, 3), GREEN, np.uint8)
    dot[20, 20] = RED
    (estimate,) = track("camshift", [full, dot], [15, 15, 10, 10], window="adaptive")
    assert estimate.box.tolist() == [19, 19, 3, 3]


def test_window_without_weight_stays_until_target_returns():
    target_image, box = scene((60, 60))
    empty = np.full_like(target_image, GREEN)
    gone, back = track("camshift", [target_image, empty, target_image], box, window="adaptive")
    assert not gone.visible
    assert gone.confidence == 0
    assert gone.box.tolist() == box.tolist()
    assert back.visible
    assert back.box[:2] + back.box[2:] / 2 == pytest.approx([60, 60], abs=0.5)


def test_camshift_limits_hide_pale_dark_and_bright_pixels():
    image, box = scene((60, 60))
    clean, _ = scene((64, 60))
    pale = (180, 186, 200)  # red's hue, saturation 0.1
    dark = (2, 8, 20)  # red's hue, value 0.08
    bright = (25, 91, 253)  # red's hue, value 0.99
    masks = {"minimum_saturation": (0.2, pale), "minimum_value": (0.2, dark)}
    for mask, (limit, patch) in (masks | {"maximum_value": (0.9, bright)}).items():
        distracted = clean.copy()
        distracted[60:70, 42:52] = patch
        (plain,) = track("camshift", [image, distracted], box)
        (masked,) = track("camshift", [image, distracted], box, **{mask: limit})
        (expected,) = track("camshift", [image, clean], box)
        assert masked.box.tolist() == expected.box.tolist()
        assert plain.box[0] < masked.box[0] - 0.1


def test_camshift_rejects_a_target_without_usable_pixels():
    image, box = scene((60, 60))
    with pytest.raises(TrackerError, match="minimum_saturation"):
        track("camshift", [image], box, minimum_saturation=0.95)
    with pytest.raises(TrackerError, match=r"\[200.0, 10.0, 20.0, 20.0\] is in the image"):
        track("camshift", [image], [200, 10, 20, 20])
