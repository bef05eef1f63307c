"""Ground between camera and houses, made of bands along the street, and the shade of trees."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numba import njit
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.interface import Array
from trackmark.datasets.synthetic.render.texture import fractal, grass, paving, pebbles
from trackmark.datasets.synthetic.render.views import Viewpoint

Light: TypeAlias = Literal["even", "dappled"]

PERIOD = 16.0  # period of the shade pattern [metres]
DEPTH = 0.45  # fraction of light that full shade removes

# offset of a shadow from the object that casts it, relative to the object's height
SLANT_X, SLANT_Z = 0.45, 0.3

_SIZE = 512


class TreeShade:
    """Light on and above the ground: dappled below trees, or 1 everywhere (`random` is unused)."""

    def __init__(self, random: Generator, light: Light) -> None:
        self.light = light
        if light == "even":
            return
        # Tree crowns and gaps are about 3 m wide, so that every view contains both.
        crowns = fractal(random, _SIZE, 8, 32)
        crowns -= np.median(crowns)
        leaves = fractal(random, _SIZE, 32, 128, 0.8)
        cover = np.clip((crowns + 0.30 * leaves - 0.22) * 3.2 + 0.5, 0, 1)
        holes = np.clip((leaves - 0.75) * 4, 0, 1)
        self._gain = 1 - DEPTH * cover * (1 - 0.7 * holes)

    def on_ground(self, x: ArrayLike, z: ArrayLike) -> Array:
        """Return the light on the ground at positions (x, z) [metres], in [1 - DEPTH, 1]."""
        across, deep = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(z, np.float64))
        if self.light == "even":
            return np.ones(across.shape)
        rows = np.floor(deep * (_SIZE / PERIOD)).astype(np.int64) % _SIZE
        place = across * (_SIZE / PERIOD)
        left = np.floor(place).astype(np.int64)
        share = place - left
        line = self._gain
        left_gain, right_gain = line[rows, left % _SIZE], line[rows, (left + 1) % _SIZE]
        return np.asarray(left_gain * (1 - share) + right_gain * share)

    def on_upright(self, x: ArrayLike, z: ArrayLike, heights: ArrayLike) -> Array:
        """Return the light at heights above (x, z) [metres], which is that where its ray lands."""
        up = np.asarray(heights, np.float64)
        return self.on_ground(np.asarray(x) + SLANT_X * up, np.asarray(z) + SLANT_Z * up)


SIDE = 512  # side of a texture [pixels]

_LINES = 4  # maximum number of texture lines that are averaged in an image row

REACH = 40.0  # period of large spots and stains [metres]


@dataclass(frozen=True)
class Band:
    """Strip of ground along the street."""

    # nearer edge [metres from the camera]; the farther edge is the start of the next band
    start: float
    texture: Array  # (SIDE, SIDE, 3), periodic
    side: float  # length that a side of the texture covers [metres]


def street_bands(random: Generator, kerb: float, end: float) -> list[Band]:
    """Return pavement up to `kerb`, a road, and pavement up to the houses at `end` [metres]."""
    stones = paving(random, SIDE)
    mean_stone = stones.mean(axis=(0, 1))
    stones = (mean_stone + 0.7 * (stones - mean_stone)) * random.uniform(1.0, 1.2)
    kinds = (lambda: stones, lambda: pebbles(random, SIDE) * 0.5 + 62, lambda: _slabs(random))
    near = kinds[random.integers(3)]()
    side = float(random.uniform(2.2, 3.2))
    road, kerb_stones = asphalt(random, (92.0, 92.0, 94.0), 0.06), kerbstones(random)
    bands = [Band(0.0, near, side)]
    if random.random() < 0.5:
        bands.append(Band(kerb - random.uniform(0.9, 1.4), grass(random, SIDE), 3.0))
    line = road.copy()
    line[:, : SIDE // 2] = line[:, : SIDE // 2] * 0.3 + 150
    middle = (kerb + end - 2.6) / 2
    return [
        *bands,
        Band(kerb - 0.2, kerb_stones, 4.0),
        Band(kerb, road, 3.0),
        Band(middle - 0.12, line, 6.0),
        Band(middle + 0.12, road, 3.0),
        Band(end - 2.6, kerb_stones, 4.0),
        Band(end - 2.4, stones, side),
    ]


def asphalt(random: Generator, grey: tuple[float, float, float], blots: float) -> Array:
    """Return grainy asphalt with the mean colour `grey` (BGR) and blots of strength `blots`."""
    tone = 1 + 0.10 * fractal(random, SIDE, 32, 256, 0.9) + blots * fractal(random, SIDE, 2, 16)
    return np.array(grey) * random.uniform(0.85, 1.2) * tone[..., None]


def kerbstones(random: Generator) -> Array:
    """Return a row of stones along a kerb."""
    stones = np.full((SIDE, SIDE, 3), 168.0) * (1 + 0.05 * fractal(random, SIDE, 8, 256))[..., None]
    stones[:, :: SIDE // 4] *= 0.75
    return stones


def _slabs(random: Generator) -> Array:
    rows, columns = np.indices((SIDE, SIDE))
    cell = SIDE // 6
    joint = (rows % cell < 4) | ((columns + (rows // cell % 2) * (cell // 2)) % cell < 4)
    tones = random.uniform(0.93, 1.07, (8, 16))[rows // cell, columns // cell]
    slab = np.array([148.0, 156.0, 162.0]) * tones[..., None]
    slab = slab * (1 + 0.06 * fractal(random, SIDE, 16, 256, 0.9))[..., None]
    return np.where(joint[..., None], slab * 0.66, slab)


def ground_rows(
    random: Generator,
    bands: list[Band],
    shade: TreeShade,
    camera: Viewpoint,
    scales: Array,
    x_low: float,
    widths: NDArray[np.int64],
    margin: float,
) -> NDArray[np.uint8]:
    """Return the ground as image rows, shape (rows, max(widths), 3).

    `bands` are sorted from the nearest to the farthest. Every row has a scale [pixels/metre] and a
    width [pixels], beyond which the array is 0. `x_low` is the lateral position [metres] at
    `margin` pixels from the left end of a row.
    """
    spots = fractal(random, 256, 8, 64, 0.7)
    starts = np.array([band.start for band in bands])
    pyramids = [_pyramid(band.texture) for band in bands]
    rows = np.zeros((len(scales), int(widths.max()), 3), np.uint8)
    for row, scale in enumerate(scales):
        x = x_low + (np.arange(widths[row]) + 0.5 - margin) / scale
        # An image row covers a range of depths; the texture lines in this range are averaged.
        offsets = (np.arange(_LINES) + 0.5) / _LINES - 0.5
        depths = camera.focal / np.maximum(scale + offsets / camera.eye, 1.0)
        colour = np.zeros((len(x), 3))
        for z in depths:
            band = max(int(np.searchsorted(starts, z, "right")) - 1, 0)
            _add_line(colour, *_line(pyramids[band], bands[band].side, float(z), float(scale)), x)
        z = float(depths.mean())
        stain = np.zeros((len(x), 1))
        _add_line(stain, spots[int(z * (256 / REACH)) % 256, :, None], 256 / REACH, x)
        gain = (1 + 0.09 * stain[:, 0]) * shade.on_ground(x, z) / _LINES
        _light_row(rows[row], colour, gain)
    return rows


@njit(cache=True)
def _light_row(row: NDArray[np.uint8], colour: Array, gain: Array) -> None:
    """Write colours (n, 3) times gains (n,) to the start of a row, in whole grey levels."""
    for i in range(len(colour)):
        for c in range(3):
            row[i, c] = np.uint8(min(max(np.rint(colour[i, c] * gain[i]), 0.0), 255.0))


def _pyramid(texture: Array) -> list[Array]:
    levels = [texture]
    while levels[-1].shape[0] > 8:
        above = levels[-1]
        half = above[0::2] + above[1::2]
        levels.append((half[:, 0::2] + half[:, 1::2]) / 4)
    return levels


def _line(pyramid: list[Array], side: float, z: float, scale: float) -> tuple[Array, float]:
    """Return a texture line along the street at a depth, shape (n, 3), and its points/metre."""
    density = SIDE / side
    level = int(np.clip(np.round(np.log2(max(density / scale, 1.0))), 0, len(pyramid) - 1))
    texture = pyramid[level]
    density = len(texture) / side
    return texture[int(np.floor(z * density)) % len(texture)], density


@njit(cache=True)
def _add_line(sums: Array, line: Array, density: float, places: Array) -> None:
    """Add a periodic line (n, channels), interpolated at positions, to `sums`."""
    n = len(line)
    for i in range(len(places)):
        place = places[i] * density
        floor = np.floor(place)
        share = place - floor
        left = np.int64(floor) % n
        right = left + 1 if left + 1 < n else 0
        for c in range(line.shape[1]):
            sums[i, c] += line[left, c] * (1 - share) + line[right, c] * share
