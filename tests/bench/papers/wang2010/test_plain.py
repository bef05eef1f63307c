"""The plain methods against loops, fractions and scenes whose outcome can be told."""

import colorsys
from fractions import Fraction
from math import exp, floor, hypot, sqrt

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from bench.papers.wang2010.plain import (
    PlainCamShift,
    PlainImprovedCamShift,
    PlainParticleFilter,
)
from bench.papers.wang2010.plain_maps import (
    colour_bins,
    colour_map,
    grey,
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


def disc(centre, radius=6, shape=(60, 80), colour=RED):
    """A disc on a dull wall, and its box."""
    rows, columns = np.indices(shape) + 0.5
    image = np.full((*shape, 3), DULL, np.uint8)
    x, y = centre
    image[(columns - x) ** 2 + (rows - y) ** 2 <= radius**2] = colour
    return image, np.array([x - radius, y - radius, 2.0 * radius, 2.0 * radius])


def centre(box):
    return box[:2] + box[2:] / 2


@given(st.tuples(byte, byte, byte), st.integers(1, 64), st.integers(1, 64))
@example((0, 0, 255), 32, 32)
@example((1, 0, 255), 32, 32)  # just below red: the last bin
@example((0, 0, 0), 32, 32)
@example((5, 10, 10), 32, 32)
def test_bins_are_those_of_exact_hue_and_saturation(bgr, hue_bins, saturation_bins):
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


def test_the_template_counts_the_pixels_of_the_box():
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
def test_pixels_beyond_the_limits_count_neither_in_the_template_nor_in_the_map(limits, counts):
    image, box = disc((30, 20))
    red = (image == RED).all(axis=2)
    if counts == "nothing":
        with pytest.raises(ValueError, match="no pixel of the box"):
            make_template(image, box, limits=limits)
        return
    found = colour_map(image, make_template(image, box, limits=limits))
    expected = {"red": red, "dull": ~red, "both": np.ones_like(red)}[counts]
    assert np.array_equal(found > 0, expected)


@pytest.mark.parametrize("corner", [0.0, -20.0])
def test_a_box_in_which_no_pixel_counts_is_refused(corner):
    image, _ = disc((30, 20))
    with pytest.raises(ValueError, match="no pixel of the box"):
        make_template(image, np.array([corner, 0, 5, 5]), limits=(0.5, 0.0, 1.0))


@pytest.mark.parametrize("window", [1, 3, 5, 7])
def test_local_differences_are_sums_over_windows(window):
    image, previous = noise(8, 11), noise(8, 11, seed=1)
    changed = np.abs(grey(image) - grey(previous))
    assert changed[2, 3] == abs(image[2, 3].astype(int).sum() - previous[2, 3].astype(int).sum())
    half = window // 2
    found = local_difference(image, previous, window)
    for row, column in np.ndindex(found.shape):
        near = changed[
            max(row - half, 0) : row + half + 1, max(column - half, 0) : column + half + 1
        ]
        assert found[row, column] == near.sum()


def test_what_moves_is_strictly_above_mean_and_deviations():
    difference = np.array([[0, 0, 0, 8]])
    assert threshold(difference, 1.5) == pytest.approx(2 + 1.5 * sqrt((3 * 4 + 36) / 4))
    assert moving(difference, 1.5).tolist() == [[False, False, False, True]]
    assert not moving(difference, 2).any()
    assert not moving(np.full((3, 4), 7)).any()  # 7 is not above 7


def slow_mean_shift(values, x, y, width, height, stop_distance, most):
    """As the specification writes it, in coordinates where pixel centres are whole."""
    x, y, n, step = x - 0.5, y - 0.5, 0, None
    while True:
        left, top = floor(x - (width - 1) / 2 + 0.5), floor(y - (height - 1) / 2 + 0.5)
        pixels = [
            (column, row, values[row, column])
            for row in range(max(top, 0), min(top + height, values.shape[0]))
            for column in range(max(left, 0), min(left + width, values.shape[1]))
        ]
        total = sum(value for _, _, value in pixels)
        if n == most or (step is not None and step < stop_distance):
            return x + 0.5, y + 0.5, n, total
        n += 1
        if total <= 1e-9:
            return x + 0.5, y + 0.5, n, total
        new_x = sum(column * value for column, _, value in pixels) / total
        new_y = sum(row * value for _, row, value in pixels) / total
        step = hypot(new_x - x, new_y - y)
        x, y = new_x, new_y


@given(
    st.integers(0, 9),
    st.integers(32, 1568).map(lambda sixtyfourths: sixtyfourths / 64),
    st.integers(32, 1184).map(lambda sixtyfourths: sixtyfourths / 64),
    st.integers(1, 9),
    st.integers(1, 9),
    st.sampled_from([0.0, 0.5, 2.0]),
    st.integers(1, 10),
)
def test_mean_shift_is_that_of_a_loop_over_pixels(seed, x, y, width, height, stop_distance, most):
    random = np.random.default_rng(seed)
    # Whole numbers, whose sums know no order: a centroid may lie on the edge between two windows.
    values = random.integers(0, 5, (19, 25)) * (random.random((19, 25)) < 0.2).astype(float)
    found = mean_shift(values, x, y, width, height, stop_distance, most)
    expected = slow_mean_shift(values, x, y, width, height, stop_distance, most)
    assert found == pytest.approx(expected, abs=1e-9)


def test_a_centre_that_rounding_has_moved_off_an_edge_has_the_window_of_the_edge():
    values = np.random.default_rng(0).random((19, 25))
    exact = mean_shift(values, 12.5, 9.0, 6, 5, max_iterations=1)
    for error in (1e-12, -1e-12):
        moved = mean_shift(values, 12.5 + error, 9.0 + error, 6, 5, max_iterations=1)
        assert moved == exact
    assert mean_shift(values, 12.5 - 1e-6, 9.0, 6, 5, max_iterations=1) != exact


def test_an_adaptive_window_follows_bradskis_rule_within_three_pixels_and_the_image():
    image, _ = disc((30, 20))
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


def test_motion_takes_the_improved_window_along_where_colour_alone_would_stay():
    """A disc crosses a larger resting one of its colour: both colours are the same to the hue."""
    random, images = np.random.default_rng(0), []
    still = (disc((40, 30), 9)[0] == RED).all(axis=2)
    for k in range(18):
        image, box = disc((16 + 2 * k, 30), 7)
        speckles = random.integers(0, 60, image.shape[:2], np.uint8)
        moved = (image == RED).all(axis=2)
        image[still] = RED
        image[moved, 2] = 190 + speckles[moved]
        images.append(image)
    box = np.array([11.0, 25, 10, 10])
    ends = {}
    for name, one in (
        ("improved", PlainImprovedCamShift(beta=1.0, stop_distance=0.5)),
        ("colour", PlainImprovedCamShift(beta=0.0, stop_distance=0.5)),
        ("traditional", PlainCamShift(stop_distance=0.5)),
    ):
        one.init(images[0], box)
        for image in images[1:]:
            ends[name] = centre(one.update(image))
    assert ends["improved"] == pytest.approx([48, 30], abs=4)  # two differences lag behind
    assert ends["colour"] == pytest.approx([38, 30], abs=4)
    assert ends["traditional"] == pytest.approx([38, 30], abs=4)


def test_the_second_frame_has_one_difference_and_later_ones_the_mean_of_two():
    images = [noise(20, 24, seed=seed) for seed in range(3)]
    tracker = PlainImprovedCamShift()
    tracker.init(images[0], np.array([5.0, 5, 8, 8]))
    tracker.update(images[1])
    first = local_difference(images[1], images[0])
    assert np.array_equal(tracker.maps.difference, first)
    tracker.update(images[2])
    second = local_difference(images[2], images[1])
    assert np.array_equal(tracker.maps.difference, (first + second) / 2)
    assert np.array_equal(tracker.maps.moving, moving((first + second) / 2))
    tracker.init(images[0], np.array([5.0, 5, 8, 8]))
    tracker.update(images[1])
    assert np.array_equal(tracker.maps.difference, first)
    alone = PlainImprovedCamShift(differences="one", motion_threshold=60, difference_window=3)
    alone.init(images[1], np.array([5.0, 5, 8, 8]))
    alone.update(images[2])
    second = local_difference(images[2], images[1], 3)
    assert np.array_equal(alone.maps.moving, second / 27 > 60)  # 9 pixels of 3 channels
    assert 0 < alone.maps.moving.mean() < 1


def start(make, images, box, **parameters):
    tracker = make(7, **parameters)
    tracker.init(images[0], box)
    return tracker


@pytest.fixture
def moved():
    images = [disc((30 + 2 * k, 20 + k))[0] for k in range(5)]
    return images, disc((30, 20))[1]


def test_the_first_two_frames_of_a_filter_are_those_of_the_equations(moved):
    images, box = moved
    tracker = start(PlainParticleFilter, images, box, particles=16, sigma=0.3)
    random = np.random.default_rng(7)
    first = np.array([30, 20]) + 2 * random.uniform(-1, 1, (16, 2))
    predicted = first + 2 * random.uniform(-1, 1, (16, 2))
    box_found = tracker.update(images[1])
    assert tracker.predicted == pytest.approx(predicted)

    joint = tracker.maps.joint
    weights = []
    for x, y in predicted:
        left, top = floor(x - 6 + 0.5), floor(y - 6 + 0.5)
        m = joint[top : top + 12, left : left + 12].sum() / 144
        weights.append(exp(-(1 - m) / (2 * 0.3**2)))
    weights = np.array(weights) / sum(weights)
    assert tracker.weights == pytest.approx(weights)
    assert centre(box_found) == pytest.approx((weights[:, np.newaxis] * predicted).sum(axis=0))

    position, total, chosen = random.random(), 0.0, []
    for index, weight in enumerate(weights):
        total += weight
        while len(chosen) < 16 and (len(chosen) + position) / 16 < total:
            chosen.append(index)
    tracker.update(images[2])
    steps = predicted[chosen] - first[chosen]
    expected = predicted[chosen] + steps + 2 * random.uniform(-1, 1, (16, 2))
    assert tracker.predicted == pytest.approx(expected)


def test_predictions_stay_on_the_image():
    image, box = disc((3, 3))
    tracker = start(PlainParticleFilter, [image], box, radius=40)
    tracker.update(image)
    assert tracker.predicted.min(axis=0).tolist() == [0.5, 0.5]
    assert (tracker.predicted <= [79.5, 59.5]).all()
