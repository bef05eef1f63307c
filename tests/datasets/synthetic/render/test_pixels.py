"""Pixel kernels, textures, paths and camera, compared with slow references."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from trackmark.datasets.synthetic.render import sprite, texture
from trackmark.datasets.synthetic.render.camera import Camera, develop_light, random_bytes
from trackmark.datasets.synthetic.render.path import Loop, random_loop
from trackmark.datasets.synthetic.render.sprite import Sprite, box_blur


def bilinear(image, x, y):
    """Return the value at continuous coordinates (pixel centres at halves); 0 outside."""
    height, width = image.shape[:2]
    i, j = int(np.floor(x - 0.5)), int(np.floor(y - 0.5))
    u, v = x - 0.5 - i, y - 0.5 - j
    total = 0.0
    for row, column, weight in (
        (j, i, (1 - u) * (1 - v)),
        (j, i + 1, u * (1 - v)),
        (j + 1, i, (1 - u) * v),
        (j + 1, i + 1, u * v),
    ):
        if 0 <= row < height and 0 <= column < width:
            total = total + weight * image[row, column].astype(float)
    return total


@settings(max_examples=30, deadline=None)
@given(data=st.data())
def test_sprite_draw_agrees_with_slow_reference(data):
    random = np.random.default_rng(data.draw(st.integers(0, 10**6)))
    height, width = data.draw(st.tuples(st.integers(1, 12), st.integers(1, 12)))
    scale = data.draw(st.sampled_from([1.0, 0.75, 0.93, 1.7]))
    count = data.draw(st.sampled_from([1, 2, 8]))
    sprite = Sprite(
        random.uniform(0, 255, (height, width, 3)), random.uniform(0, 1, (height, width))
    )
    canvas = random.integers(0, 256, (14, 17, 3), dtype=np.uint8)
    reach = data.draw(st.sampled_from([0, 5, 40]))  # beyond the canvas
    centres = np.round(random.uniform(-reach, 16 + reach, (count, 2)) * 64) / 64
    expected = canvas.astype(float)
    image = sprite.levels[0][1:-1, 1:-1]
    for row in range(14):
        for column in range(17):
            value = sum(
                bilinear(
                    image,
                    (column + 0.5 - x) / scale + width / 2,
                    (row + 0.5 - y) / scale + height / 2,
                )
                for x, y in centres
            ) * np.ones(4)
            value /= count
            expected[row, column] *= 1 - value[3] / 255
            expected[row, column] += value[:3]
    sprite.draw(canvas, centres, scale)
    assert np.abs(canvas - expected).max() < 3.5  # corners are rounded to 1/64 pixel


@pytest.mark.parametrize("scale", [1.0, 0.6, 0.31, 0.12])
def test_sprite_covers_its_scaled_area(scale):
    canvas = np.zeros((100, 100, 3), np.uint8)
    sprite = Sprite(np.full((64, 48, 3), 255.0), np.ones((64, 48)))
    sprite.draw(canvas, np.array([[50.3, 47.8]]), scale)
    assert canvas[:, :, 0].sum() / 255 == pytest.approx(64 * 48 * scale * scale, rel=0.02)


@settings(deadline=None)  # the first call compiles
@given(x=st.integers(0, 64 * 20), y=st.integers(0, 64 * 10))
def test_cut_window_interpolates_the_texture(x, y):
    texture = np.random.default_rng(0).integers(0, 256, (20, 32, 3), dtype=np.uint8)
    picture = sprite.cut_window(texture, x, y, 8, 10)
    u, v = x % 64 / 64, y % 64 / 64
    cut = texture[y // 64 : y // 64 + 9, x // 64 : x // 64 + 11].astype(float)
    rows = cut[:-1] * (1 - v) + cut[1:] * v
    expected = rows[:, :-1] * (1 - u) + rows[:, 1:] * u
    assert np.abs(picture - expected).max() <= 0.5


def test_box_blur_equals_three_boxes():
    point = np.zeros((41, 41))
    point[20, 20] = 1
    spread = box_blur(point, 3)
    assert spread.sum() == pytest.approx(1)
    box = np.ones(7) / 7
    triple = np.convolve(np.convolve(box, box), box)
    np.testing.assert_allclose(spread[11:30, 20], triple * triple[9], atol=1e-12)


SIZE = 160, 120


def grey(level=128):
    return np.full((*SIZE[::-1], 3), level, np.uint8)


def test_camera_vignette_reaches_the_requested_fall():
    image = Camera(SIZE, noise=0.0, fall=(0.2, 0.4)).exposed(grey(), 1, 2)[..., 0] / 128
    middle = image[60, 80], image[0, 80], image[-1, 80], image[60, 0], image[60, -1]
    assert middle == pytest.approx([1, 0.8, 0.8, 0.6, 0.6], abs=0.015)


@pytest.mark.parametrize("noise", [1.0, 4.0])
def test_camera_noise_differs_by_frame_and_seed(noise):
    camera = Camera(SIZE, noise, fall=(0.0, 0.0))
    images = [camera.exposed(grey(), *key).astype(float) for key in ((1, 2), (1, 3), (2, 2))]
    for image in images:
        assert image.std() == pytest.approx(np.hypot(noise, 1 / np.sqrt(12)), rel=0.05)
    correlations = np.corrcoef([image.ravel() for image in images])
    assert np.abs(correlations - np.eye(3)).max() < 0.02


def test_camera_gain_is_scalar_or_per_column():
    camera = Camera(SIZE, noise=0.0, fall=(0.0, 0.0))
    assert (camera.exposed(grey(), 1, 2) == 128).all()
    assert (camera.exposed(grey(), 1, 2, 0.5) == 64).all()
    each = camera.exposed(grey(), 1, 2, np.repeat([0.5, 1.5], 80))
    assert (each[:, :80] == 64).all()
    assert (each[:, 80:] == 192).all()


def test_grey_level_is_the_square_root_of_the_light():
    light = np.repeat(np.array([0.0, 0.09, 0.36, 4.0], np.float32), 40).reshape(1, 160, 1)
    image = develop_light(np.broadcast_to(light, (120, 160, 3)).astype(np.float32))[60]
    assert image[[20, 60, 100, 140], 1] == pytest.approx([0, 76.5, 153, 255], abs=0.6)


@pytest.mark.parametrize("first", [0, 5, 32, 230_400, 230_411])
def test_random_bytes_start_at_any_offset(first):
    assert (random_bytes(7, 9, 6, first) == random_bytes(7, 9, first + 6)[first:]).all()


@given(seed=st.integers(0, 1000), speed=st.floats(0.05, 8))
def test_random_loop_stays_in_its_rectangle_at_its_speed(seed, speed):
    loop = random_loop(np.random.default_rng(seed), [20, 30], [300, 200], speed)
    places = loop.positions(np.arange(2000))
    assert (places >= [20, 30]).all()
    assert (places <= [300, 200]).all()
    way = np.hypot(*np.diff(places, axis=0).T)
    assert (way <= speed * (1 + 1e-9)).all()
    assert way.mean() > 0.9 * speed


def test_loop_is_closed():
    square = np.array([[0.0, 0.0], [60.0, 0.0], [60.0, 60.0], [0.0, 60.0]])
    loop = Loop(square, 1.0)
    round_trip = loop._travelled[-1]
    np.testing.assert_allclose(loop.positions(round_trip + 5.0), loop.positions(5.0), atol=1e-9)
    # a uniform cubic B-spline passes (a + 4 b + c) / 6 at its knots
    np.testing.assert_allclose(loop.positions(0.0), (square[0] + 4 * square[1] + square[2]) / 6)


@pytest.mark.parametrize("make", [texture.grass, texture.paving, texture.pebbles])
def test_ground_has_contrast_and_repeats_without_a_seam(make):
    image = make(np.random.default_rng(3), 256)
    for axis in (0, 1):
        around = np.concatenate([image, np.take(image, [0], axis)], axis)
        steps = np.abs(np.diff(around, axis=axis)).mean(axis=(1 - axis, 2))
        assert steps[-1] <= steps[:-1].max()
    assert image.std(axis=(0, 1)).min() > 10
    assert ((image < 0) | (image > 255)).mean() < 0.01


def test_noise_is_periodic_and_smooth():
    values = texture.noise(np.random.default_rng(0), 256, 8)
    assert np.abs(values - np.roll(values, 1, axis=0)).max() < 0.15
    assert 0.2 < values.std() < 1


def test_ramp_interpolates_its_colours():
    colours = np.array([[0.0, 10, 20], [100, 110, 120], [200, 190, 180]])
    np.testing.assert_allclose(
        texture.ramp(np.array([[-1.0, 0, 1, -2, 2]]), colours)[0], colours[[0, 1, 2, 0, 2]]
    )
