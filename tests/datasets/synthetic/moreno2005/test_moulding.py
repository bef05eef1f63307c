"""Surfaces of balls, and looks on them, compared with slow definitions."""

import numpy as np
import pytest

from trackmark.datasets.synthetic.moreno2005.octopus import colour_skin, mould

SIDE = 16


def drawn_balls(seed, count=7):
    random = np.random.default_rng(seed)
    rest = random.uniform((0, 0, 2, 0, 0.3), (20, 14, 6, 3, 1), (count, 5))
    rest[0, :2] = -3, 20  # partly outside
    return rest


@pytest.mark.parametrize("step", [1.0, 0.5])
def test_mould_finds_the_highest_ball_at_every_sample(step):
    balls = drawn_balls(1)
    left, top, shape = 2.0, 1.0, (int(11 / step), int(15 / step))
    height, owner = np.zeros(shape, np.float32), np.full(shape, -1, np.int32)
    mould(balls, left, top, step, height, owner)
    for i in range(shape[0]):
        for j in range(shape[1]):
            sample = np.array([left + (j + 0.5) * step, top + (i + 0.5) * step])
            best, which = 0.0, -1
            for k, (x, y, radius, middle, flat) in enumerate(balls):
                square = radius**2 - ((sample - (x, y)) ** 2).sum()
                if square >= 0 and middle + flat * square**0.5 > best:
                    best, which = middle + flat * square**0.5, k
            assert height[i, j] == pytest.approx(best, abs=1e-5)
            assert owner[i, j] == which
    assert len(np.unique(owner)) > 3


def bilinear(texture, u, v):
    column, row = int(np.floor(u)), int(np.floor(v))
    right, down = u - column, v - row
    return sum(
        weight * texture[(row + y) % SIDE, (column + x) % SIDE].astype(float)
        for x, y, weight in (
            (0, 0, (1 - right) * (1 - down)),
            (1, 0, right * (1 - down)),
            (0, 1, (1 - right) * down),
            (1, 1, right * down),
        )
    )


@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_colour_skin_agrees_with_slow_reference(share):
    random = np.random.default_rng(2)
    before, after = random.random((2, SIDE, SIDE, 3)).astype(np.float32)
    order = random.random((SIDE, SIDE)).astype(np.float32)
    light = random.uniform(0.5, 1.5, (9, 12)).astype(np.float32)
    owner = random.integers(-1, 3, (9, 12)).astype(np.int32)
    to_rest = random.normal(size=(3, 2, 3))
    out = np.zeros((9, 12, 4), np.float32)
    soft = 0.3
    colour_skin(owner, 4.0, 2.0, 0.5, to_rest, before, after, order, share, soft, light, out)
    for i in range(9):
        for j in range(12):
            if owner[i, j] < 0:
                assert not out[i, j].any()
                continue
            place = np.array([4 + (j + 0.5) * 0.5, 2 + (i + 0.5) * 0.5, 1.0])
            u, v = to_rest[owner[i, j]] @ place
            start = order[int(np.floor(v)) % SIDE, int(np.floor(u)) % SIDE]
            changed = np.clip((share * (1 + soft) - start) / soft, 0, 1)
            expected = (1 - changed) * bilinear(before, u, v) + changed * bilinear(after, u, v)
            assert out[i, j, :3] == pytest.approx(light[i, j] * expected, abs=1e-5)
            assert out[i, j, 3] == 1
