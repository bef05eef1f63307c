"""Lamps, shadows and triangle meshes, compared with laws of light and slow references."""

import numpy as np
import pytest

from trackmark.datasets.synthetic.render.lamp import (
    REACH,
    lamp_light,
    lamp_visibility,
    remaining_light,
)
from trackmark.datasets.synthetic.render.triangles import (
    FINE,
    Mesh,
    composite,
    grid_triangles,
    render_mesh,
)

UP = np.array([0.0, 0.0, 1.0])


def test_lamp_light_falls_with_squared_distance_and_cosine():
    point = np.array([10.0, 20.0, 0.0])
    near, far = (lamp_light(np.array([10.0, 20.0, d]), point, UP)[0] for d in (REACH, 2 * REACH))
    assert near == pytest.approx(1)
    assert far == pytest.approx(1 / 4)
    place = np.array([0, 0, REACH])
    for angle in (0.0, 0.4, 1.2):
        light, _ = lamp_light(place, np.zeros(3), np.array([np.sin(angle), 0, np.cos(angle)]))
        assert light == pytest.approx(np.cos(angle))
    assert lamp_light(place, np.zeros(3), -UP) == (0.0, 0.0)  # faces away


@pytest.mark.parametrize("side", [-1, 1])
def test_wall_shadow_has_its_geometric_length(side):
    fine, high = 2, 30.0
    depths = np.zeros((80, 400))
    depths[:, 196:204] = high  # a wall in columns 98 to 102 [pixels]
    lamp = np.array([100 + side * 150.0, 20.0, 150.0])
    seen = lamp_visibility(depths, lamp, fine)[40, :, 0]
    columns = (np.arange(400) + 0.5) / fine
    off = -side * (columns - 100)
    reach = 2 + high / (150 - high) * (150 + 2)
    assert (seen[(off > 5) & (off < reach - 10)] < 0.05).all()
    assert (seen[off > reach + 10] > 0.95).all()
    assert (seen[off < -4] == 1).all()
    edge = seen[np.abs(off - reach) < 8]
    assert ((edge > 0) & (edge < 1)).any()  # the lamp has a size


SIZE = 16, 12


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
    width, height = SIZE
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
    rendered = render_mesh(mesh, points, lights, SIZE)
    picture = np.zeros((*SIZE[::-1], 4))
    picture[rendered.window] = rendered.sheet
    owner, light = render_slowly(mesh, points, lights)
    covered = (owner >= 0).reshape(SIZE[1], FINE, SIZE[0], FINE).mean(axis=(1, 3))
    assert 0.2 < covered.mean() < 1
    assert picture[..., 3] == pytest.approx(covered)
    blocks = owner.reshape(SIZE[1], FINE, SIZE[0], FINE)
    alone = (blocks.min(axis=(1, 3)) == blocks.max(axis=(1, 3))) & (covered > 0)
    means = light.reshape(SIZE[1], FINE, SIZE[0], FINE, 3).mean(axis=(1, 3))
    assert alone.sum() > 40
    assert picture[alone, :3] == pytest.approx(means[alone], abs=0.06)
    assert picture[..., :3].mean() == pytest.approx(means.mean(), rel=0.03)


def test_grid_triangles_cover_a_rectangle_clockwise():
    places = np.stack(np.meshgrid(np.arange(5.0), np.arange(4.0)), axis=2).reshape(-1, 2)
    a, b, c = np.moveaxis(places[grid_triangles(4, 5)], 1, 0)
    (ux, uy), (vx, vy) = (b - a).T, (c - a).T
    areas = (ux * vy - uy * vx) / 2
    assert areas.min() > 0
    assert areas.sum() == 12


def test_composite_blends_by_coverage():
    random = np.random.default_rng(0)
    picture = random.random((5, 6, 3)).astype(np.float32)
    coverage = random.choice([0, 0.25, 1], (5, 6, 1)).astype(np.float32)
    colour = random.random((5, 6, 3)).astype(np.float32)
    expected = picture * (1 - coverage) + colour * coverage
    composite(picture, np.concatenate([colour * coverage, coverage], axis=2))
    assert picture == pytest.approx(expected, abs=1e-6)


def test_soft_shadow_has_requested_darkness_and_position():
    coverage = np.zeros((120, 160), np.float32)
    coverage[40:80, 40:80] = 1
    left = remaining_light(coverage, np.array([24.0, -8.0]), 4.0, 0.6)
    assert left[52, 84] == pytest.approx(0.4, abs=0.01)
    assert left[100, 20] == pytest.approx(1)
    lost = 1 - left[..., 0]
    rows, columns = np.indices(lost.shape) + 0.5
    assert (lost * columns).sum() / lost.sum() == pytest.approx(84, abs=0.2)
    assert (lost * rows).sum() / lost.sum() == pytest.approx(52, abs=0.2)
    assert lost.sum() == pytest.approx(0.6 * coverage.sum(), rel=0.01)
