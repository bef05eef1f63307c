"""Rendering: sprites, camera, paths, triangle meshes and streets."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from trackmark.datasets.synthetic.render.sprite import Sprite
from trackmark.datasets.synthetic.render.triangles import FINE, Mesh, render_mesh


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


MESH_SIZE = 16, 12


def triangles(random, count=12, closed=False):
    """Return large triangles that cross the image borders and one another."""
    corners = random.uniform((-5, -5, -9), (21, 17, 9), (3 * count, 3))
    column, row = np.meshgrid(np.linspace(0.1, 1, 130), np.linspace(0.1, 1, 110))
    texture = np.stack([column, row, 1.1 - column], axis=2).astype(np.float32)
    texels = random.uniform(0, 1, (3 * count, 2)) * (130, 110)
    mesh = Mesh(np.arange(3 * count).reshape(count, 3), texels, texture, closed)
    return mesh, corners, random.uniform(0.2, 2, (3 * count, 3))


def render_slowly(mesh, points, lights):
    """Return the nearest triangle and its light per sample, from a linear solver."""
    width, height = MESH_SIZE
    owner = np.full((height * FINE, width * FINE), -1)
    light = np.zeros((*owner.shape, 3))
    for row in range(owner.shape[0]):
        for column in range(owner.shape[1]):
            place = np.array([(column + 0.5) / FINE, (row + 0.5) / FINE, 1])
            nearest = -np.inf
            for t, corners in enumerate(mesh.triangles):
                a = points[corners]
                edges = a[1:, :2] - a[0, :2]
                if mesh.closed and edges[0, 0] * edges[1, 1] < edges[0, 1] * edges[1, 0]:
                    continue
                shares = np.linalg.solve(np.vstack([a[:, :2].T, np.ones(3)]), place)
                if shares.min() >= 0 and shares @ a[:, 2] > nearest:
                    nearest, owner[row, column] = shares @ a[:, 2], t
                    u, v = (shares @ mesh.texels[corners]).astype(int)
                    light[row, column] = mesh.texture[v, u] * (shares @ lights[corners])
    return owner, light


@pytest.mark.parametrize("closed", [False, True])
def test_render_mesh_shows_the_nearest_triangle(closed):
    mesh, points, lights = triangles(np.random.default_rng(4), closed=closed)
    rendered = render_mesh(mesh, points, lights, MESH_SIZE)
    picture = np.zeros((*MESH_SIZE[::-1], 4))
    picture[rendered.window] = rendered.sheet
    owner, light = render_slowly(mesh, points, lights)
    covered = (owner >= 0).reshape(MESH_SIZE[1], FINE, MESH_SIZE[0], FINE).mean(axis=(1, 3))
    assert 0.2 < covered.mean() < 1
    assert picture[..., 3] == pytest.approx(covered)
    blocks = owner.reshape(MESH_SIZE[1], FINE, MESH_SIZE[0], FINE)
    alone = (blocks.min(axis=(1, 3)) == blocks.max(axis=(1, 3))) & (covered > 0)
    means = light.reshape(MESH_SIZE[1], FINE, MESH_SIZE[0], FINE, 3).mean(axis=(1, 3))
    assert alone.sum() > 40
    assert picture[alone, :3] == pytest.approx(means[alone], abs=0.06)
    assert picture[..., :3].mean() == pytest.approx(means.mean(), rel=0.03)
