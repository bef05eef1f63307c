"""Pixel kernels against slow references in floating point."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from trackmark.datasets.synthetic.render import camera, sprite
from trackmark.datasets.synthetic.render.sprite import Sprite, box_blur, superellipse


def bilinear(image, x, y):
    """Value at continuous coordinates (pixel middles at halves), zero outside."""
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
    reach = data.draw(st.sampled_from([0, 5, 40]))  # past the canvas on every side
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
def test_a_sprite_covers_its_scaled_area_at_every_size(scale):
    canvas = np.zeros((100, 100, 3), np.uint8)
    sprite = Sprite(np.full((64, 48, 3), 255.0), np.ones((64, 48)))
    sprite.draw(canvas, np.array([[50.3, 47.8]]), scale)
    assert canvas[:, :, 0].sum() / 255 == pytest.approx(64 * 48 * scale * scale, rel=0.02)


@settings(deadline=None)  # the first call compiles
@given(x=st.integers(0, 64 * 20), y=st.integers(0, 64 * 10))
def test_a_window_is_the_texture_interpolated(x, y):
    texture = np.random.default_rng(0).integers(0, 256, (20, 32, 3), dtype=np.uint8)
    picture = sprite.cut_window(texture, x, y, 8, 10)
    u, v = x % 64 / 64, y % 64 / 64
    cut = texture[y // 64 : y // 64 + 9, x // 64 : x // 64 + 11].astype(float)
    rows = cut[:-1] * (1 - v) + cut[1:] * v
    expected = rows[:, :-1] * (1 - u) + rows[:, 1:] * u
    assert np.abs(picture - expected).max() <= 0.5


def test_light_multiplies_and_noise_adds():
    canvas = np.full((30, 40, 3), 200, np.uint8)
    rows = camera.fixed_point(np.linspace(0.5, 1, 30))
    columns = camera.fixed_point(np.linspace(1, 0.3, 40))
    table = camera.noise_table(5.0)
    random = camera.random_bytes(3, 4, canvas.size)
    expected = 200 * np.outer(rows, columns)[:, :, None] / 1024**2
    expected = expected + table[random].reshape(canvas.shape) / camera.LEVEL_STEPS
    camera._develop(canvas, rows, columns, table, random)
    assert np.abs(canvas - expected).max() <= 0.5 + 1 / 16


def test_superellipses_have_their_areas():
    area = superellipse(60, 90, 25, 40, 2)[2].sum()
    assert area == pytest.approx(np.pi * 25 * 40, rel=1e-3)
    area = superellipse(60, 90, 25, 40, 4)[2].sum()
    assert area == pytest.approx(3.7081493546 * 25 * 40, rel=1e-3)  # 4 Γ(5/4)² / Γ(3/2)


def test_blurring_keeps_the_sum_and_spreads_as_three_boxes_do():
    point = np.zeros((41, 41))
    point[20, 20] = 1
    spread = box_blur(point, 3)
    assert spread.sum() == pytest.approx(1)
    box = np.ones(7) / 7
    triple = np.convolve(np.convolve(box, box), box)
    np.testing.assert_allclose(spread[11:30, 20], triple * triple[9], atol=1e-12)
