"""The plain methods against exact fractions and painted images.

`tests/trackers/test_colour_motion.py` and `test_wang2010.py` compare them with the trackers.
"""

import colorsys
from fractions import Fraction
from math import floor, sqrt

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from bench.papers.wang2010.plain import (
    PlainCamShift,
    PlainImprovedCamShift,
)
from bench.papers.wang2010.plain_maps import (
    colour_bins,
    colour_map,
    local_difference,
    make_template,
    mean_shift,
    moving,
    threshold,
)

RED, BLUE, DULL = (0, 0, 250), (250, 0, 0), (90, 100, 95)  # BGR
byte = st.integers(0, 255)


def noise(*shape, seed=0):
    return np.random.default_rng(seed).integers(0, 256, (*shape, 3), np.uint8)


def disc():
    """Return a red disc on a dull wall, and its box."""
    rows, columns = np.indices((60, 80)) + 0.5
    image = np.full((60, 80, 3), DULL, np.uint8)
    image[(columns - 30) ** 2 + (rows - 20) ** 2 <= 36] = RED
    return image, np.array([24.0, 14.0, 12.0, 12.0])


@given(st.tuples(byte, byte, byte), st.integers(1, 64), st.integers(1, 64))
@example((0, 0, 255), 32, 32)
@example((1, 0, 255), 32, 32)  # just below red: the last bin
@example((0, 0, 0), 32, 32)
@example((5, 10, 10), 32, 32)
def test_bins_equal_those_of_exact_fractions(bgr, hue_bins, saturation_bins):
    largest, spread = max(bgr), max(bgr) - min(bgr)
    blue, green, red = bgr
    hue, saturation = Fraction(0), Fraction(0)
    if spread > 0:
        saturation = Fraction(spread, largest)
        if red == largest:
            hue = Fraction(green - blue, spread) / 6 % 1
        elif green == largest:
            hue = (2 + Fraction(blue - red, spread)) / 6
        else:
            hue = (4 + Fraction(red - green, spread)) / 6
    found = colour_bins(np.array([[bgr]], np.uint8), hue_bins, saturation_bins)
    assert found[0].item() == floor(hue_bins * hue)
    assert found[1].item() == min(floor(saturation_bins * saturation), saturation_bins - 1)
    by_library = colorsys.rgb_to_hsv(red / 255, green / 255, blue / 255)
    assert by_library[:2] == pytest.approx([float(hue), float(saturation)], abs=1e-9)


def test_template_counts_the_pixels_of_the_box():
    image = np.full((30, 50, 3), RED, np.uint8)
    image[18:22, 28:32] = BLUE
    template = make_template(image, np.array([24.2, 16.9, 11.9, 6.1]))  # 12 x 6 from (24, 17)
    assert np.flatnonzero(template.hue).tolist() == [0, 32 * 4 // 6]
    assert template.hue[[0, 21]].tolist() == [1, 16 / (72 - 16)]
    assert np.flatnonzero(template.saturation).tolist() == [31]
    whole = make_template(image, np.array([-10.0, -10, 70, 50]))
    assert whole.hue[21] == 16 / (1500 - 16)


@pytest.mark.parametrize(
    ("limits", "counts"),
    [
        ((0.5, 0.0, 1.0), "red"),
        ((0.0, 0.5, 1.0), "red"),
        ((0.0, 250 / 255, 1.0), "red"),
        ((0.0, 0.0, 200 / 255), "dull"),
        ((0.0, 0.0, 250 / 255), "both"),
        ((0.0, 251 / 255, 1.0), "nothing"),
        ((0.0, 0.0, 99 / 255), "nothing"),
    ],
)
def test_pixels_beyond_the_limits_do_not_count(limits, counts):
    image, box = disc()
    red = (image == RED).all(axis=2)
    if counts == "nothing":
        with pytest.raises(ValueError, match="no pixel of the box"):
            make_template(image, box, limits=limits)
        return
    found = colour_map(image, make_template(image, box, limits=limits))
    expected = {"red": red, "dull": ~red, "both": np.ones_like(red)}[counts]
    assert np.array_equal(found > 0, expected)


def test_moving_pixels_exceed_mean_and_deviations():
    difference = np.array([[0, 0, 0, 8]])
    assert threshold(difference, 1.5) == pytest.approx(2 + 1.5 * sqrt((3 * 4 + 36) / 4))
    assert moving(difference, 1.5).tolist() == [[False, False, False, True]]
    assert not moving(difference, 2).any()
    assert not moving(np.full((3, 4), 7)).any()  # 7 is not above 7


def test_centre_rounded_off_an_edge_has_the_window_of_the_edge():
    values = np.random.default_rng(0).random((19, 25))
    exact = mean_shift(values, 12.5, 9.0, 6, 5, max_iterations=1)
    for error in (1e-12, -1e-12):
        moved = mean_shift(values, 12.5 + error, 9.0 + error, 6, 5, max_iterations=1)
        assert moved == exact
    assert mean_shift(values, 12.5 - 1e-6, 9.0, 6, 5, max_iterations=1) != exact


def test_adaptive_window_follows_bradskis_rule_within_limits():
    image, _ = disc()
    tracker = PlainCamShift(window="adaptive")
    tracker.init(image, np.array([26.0, 15, 8, 10]))
    mass = 80  # the window of the first frame is all red
    sides = [floor(2 * sqrt(mass * 0.8) + 0.5), floor(2 * sqrt(mass / 0.8) + 0.5)]
    assert tracker.update(image)[2:].tolist() == sides
    red = np.full((60, 80, 3), RED, np.uint8)
    for _ in range(8):
        box = tracker.update(red)
    assert box.tolist() == [0, 0, 80, 60]
    dot = np.full((60, 80, 3), DULL, np.uint8)
    dot[30, 40] = RED
    assert tracker.update(dot).tolist() == [39, 29, 3, 3]


def test_maps_forget_the_earlier_clip_at_initialisation():
    images = [noise(20, 24, seed=seed) for seed in range(3)]
    tracker = PlainImprovedCamShift()
    for clip in (images, images[:2]):
        tracker.init(clip[0], np.array([5.0, 5, 8, 8]))
        for image in clip[1:]:
            tracker.update(image)
    assert np.array_equal(tracker.maps.difference, local_difference(images[1], images[0]))
