"""Textures that are periodic in both directions.

They use only sums, products and square roots of random numbers, so that all platforms give the same
bytes. Sizes are powers of two; textures of the ground have at least 256 pixels.
"""

import numpy as np
from numba import njit
from numpy.random import Generator
from numpy.typing import NDArray

from trackmark.datasets.interface import Array


def noise(generator: Generator, size: int, cells: int) -> Array:
    """Return smooth periodic noise, about in [-1, 1], shape (size, size).

    A lattice of `cells` x `cells` random values is interpolated by cubic B-splines.
    """
    lattice = generator.uniform(-1.7, 1.7, (cells, cells))
    place = np.arange(size) * (cells / size)
    cell = place.astype(np.int64)
    u = place - cell
    v = 1 - u
    weights = (
        v * v * v / 6,
        (3 * u * u * u - 6 * u * u + 4) / 6,
        (3 * v * v * v - 6 * v * v + 4) / 6,
        u * u * u / 6,
    )
    near = (cell[:, None] + np.arange(4)) % cells
    interpolated: Array = _interpolated(lattice, near, np.stack(weights, axis=1))
    return interpolated


@njit(cache=True)
def _interpolated(lattice: Array, near: NDArray[np.int64], weights: Array) -> Array:
    """Return the interpolation of a lattice, shape (n, n), to the shape (size, size).

    `near`, shape (size, 4), are the lattice rows or columns to which the `weights` apply.
    """
    size, cells = len(near), len(lattice)
    result = np.zeros((size, size))
    for row in range(size):
        line = np.zeros(cells)
        for k in range(4):
            for column in range(cells):
                line[column] += weights[row, k] * lattice[near[row, k], column]
        for column in range(size):
            for k in range(4):
                result[row, column] += weights[column, k] * line[near[column, k]]
    return result


def fractal(
    generator: Generator, size: int, coarsest: int, finest: int, fall: float = 0.55
) -> Array:
    """Return a sum of octaves of noise from `coarsest` to `finest` cells, about in [-1, 1].

    The number of cells doubles and the amplitude changes by the factor `fall` from octave to
    octave.
    """
    total = np.zeros((size, size))
    weight, amplitude, cells = 0.0, 1.0, coarsest
    while cells <= finest:
        total += amplitude * noise(generator, size, cells)
        weight += amplitude * amplitude
        amplitude *= fall
        cells *= 2
    total /= np.sqrt(weight)
    return total


def lerp(a: Array, b: Array, share: Array) -> Array:
    """Return a mixture of the colours `a` and `b` with a share (h, w) of `b`."""
    return a + (b - a) * np.clip(share, 0, 1)[..., None]


def ramp(values: Array, colours: Array) -> Array:
    """Map values in [-1, 1] to colours (k, 3), evenly spaced and linearly interpolated."""
    place = np.clip((values + 1) / 2, 0, 1) * (len(colours) - 1)
    index = np.minimum(place.astype(np.int64), len(colours) - 2)
    return lerp(colours[index], colours[index + 1], place - index)


def relief(height: Array, strength: float) -> Array:
    """Return the gain, about 1, of a height map that is lit from the upper left."""
    slope = height - np.roll(height, (1, 1), axis=(0, 1))
    return np.asarray(np.clip(1 - strength * slope, 0.35, 1.6))


def creases(generator: Generator, size: int) -> tuple[Array, Array]:
    """Return broad folds of cloth, about in [-1, 1], and the vertical slope of steep folds."""
    broad = fractal(generator, size, 4, 16, 0.6)
    steep = fractal(generator, size, 8, 32, 0.7)
    return broad, steep - np.roll(steep, 2, axis=0)


def grass(generator: Generator, size: int) -> Array:
    """Return short grass, in some parts worn down to the earth."""
    lean = generator.uniform(-0.7, 0.7)
    bend_x, bend_y = noise(generator, size, 32) + lean, 0.6 * noise(generator, size, 32) + 1.1
    length = np.sqrt(bend_x * bend_x + bend_y * bend_y) + 1e-3
    blades = generator.uniform(-1, 1, (size, size))
    rows, columns = np.indices((size, size))
    reach = max(2, size // 170)
    streaks = np.zeros((size, size))
    for k in range(-reach, reach + 1):
        y = np.round(rows + k * bend_y / length).astype(np.int64) % size
        x = np.round(columns + k * bend_x / length).astype(np.int64) % size
        streaks += blades[y, x]
    streaks /= np.sqrt((2 * reach + 1) / 3)
    tone = 0.34 * streaks + 0.36 * fractal(generator, size, 16, size // 2, 0.8)
    greens = np.array([[26, 40, 34], [40, 78, 66], [58, 108, 98], [98, 146, 148]], np.float64)
    earths = np.array([[42, 58, 76], [72, 98, 122], [112, 138, 160]], np.float64)
    grain = fractal(generator, size, 32, size // 2, 0.8)
    wear = fractal(generator, size, 4, 64) * 1.6 - 0.75 + 0.5 * streaks * 0.5
    return lerp(ramp(tone, greens), ramp(grain * 0.7, earths), wear)


def pebbles(generator: Generator, size: int) -> Array:
    """Return closely packed rounded stones in many tones."""
    cells = 32
    cell = size / cells
    shift = generator.uniform(-0.38, 0.38, (cells, cells, 2)) + 0.5
    bulk = generator.uniform(0.0, 0.22, (cells, cells))
    warp = 0.12 * cell
    rows, columns = np.indices((size, size)).astype(np.float64)
    rows = rows + warp * fractal(generator, size, 64, size // 4)
    columns = columns + warp * fractal(generator, size, 64, size // 4)
    home_y = np.floor(rows / cell).astype(np.int64)
    home_x = np.floor(columns / cell).astype(np.int64)
    nearest, second = np.full((size, size), 9.0), np.full((size, size), 9.0)
    owner = np.zeros((size, size), np.int64)
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            y, x = (home_y + dy) % cells, (home_x + dx) % cells
            v = rows / cell - (home_y + dy + shift[y, x, 1])
            u = columns / cell - (home_x + dx + shift[y, x, 0])
            distance = np.sqrt(u * u + v * v) - bulk[y, x]
            closer = distance < nearest
            second = np.where(closer, nearest, np.minimum(second, distance))
            owner = np.where(closer, y * cells + x, owner)
            nearest = np.where(closer, distance, nearest)
    round_off = np.clip(1.5 - 2.2 * np.clip(nearest + 0.05, 0, 1), 0, 1)
    dome = np.minimum(np.clip((second - nearest) * 2.6, 0, 1), round_off)
    dome = dome * (2 - dome)
    tones = np.array([[76, 84, 92], [104, 116, 128], [122, 136, 150], [162, 172, 180]], np.float64)
    stones = ramp(generator.uniform(-1, 1, cells * cells), tones)[owner]
    stones += 5 * generator.uniform(-1, 1, (cells * cells, 3))[owner]
    grain = 1 + 0.1 * fractal(generator, size, 64, size // 2, 0.9)
    light = relief(dome * (size / 128), 0.55) * grain * (0.42 + 0.58 * dome)
    stones *= light[..., None]
    return stones


def paving(generator: Generator, size: int) -> Array:
    """Return worn paving stones in running bond, with dirt and moss in the joints."""
    courses, setts = 16, 10
    rows, columns = np.indices((size, size)).astype(np.float64)
    rows = rows / size * courses + 0.05 * fractal(generator, size, 16, size // 8)
    columns = columns / size * setts + 0.035 * fractal(generator, size, 16, size // 8)
    course = np.floor(rows).astype(np.int64) % courses
    columns = columns + 0.5 * (course % 2)
    sett = np.floor(columns).astype(np.int64) % setts
    v = np.abs(rows - np.floor(rows) - 0.5) * 2
    u = np.abs(columns - np.floor(columns) - 0.5) * 2
    edge = np.minimum((1 - v), (1 - u) * (courses / setts)) * 5
    top = np.clip(edge - 0.25, 0, 1)
    top = top * top * (3 - 2 * top)
    tones = np.array([[86, 96, 112], [106, 120, 142], [132, 146, 166], [150, 158, 170]], np.float64)
    tone = generator.uniform(-0.8, 0.8, courses * setts)[course * setts + sett]
    tone = tone + 0.35 * fractal(generator, size, 32, size // 2, 0.8)
    dirt = fractal(generator, size, 4, size // 4, 0.7)
    stone = ramp(tone - 0.3 * dirt, tones)
    joints = lerp(np.array([52.0, 60.0, 66.0]), np.array([46.0, 72.0, 66.0]), dirt * 2)
    pits = 0.35 * fractal(generator, size, size // 8, size // 2, 0.9)
    light = relief((top + 0.2 * pits) * (size / 128), 0.35)
    return lerp(joints, stone, top) * light[..., None]
