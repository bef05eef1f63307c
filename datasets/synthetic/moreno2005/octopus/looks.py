"""Floors and skins: what they are made of, in textures that repeat."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.synthetic.render.texture import fractal, grass, lerp, pebbles, ramp, relief

Array = NDArray[np.float64]

SIDE = 512  # of textures [pixels]
IMITATION = 0.5  # share of a floor's look that a skin takes on


@dataclass(frozen=True)
class Kind:
    """Something that a floor or a skin looks like."""

    colour: tuple[float, float, float]  # mean, RGB in [0, 1]
    # texture of shape (SIDE, SIDE, 3), BGR, of any mean
    paint: Callable[[np.random.Generator], Array]


def painted(random: np.random.Generator, kind: Kind, colour: Array) -> Array:
    """Texture of a kind whose mean is a colour, RGB in [0, 1]; BGR, shape (SIDE, SIDE, 3)."""
    texture = kind.paint(random)
    return np.asarray(np.clip(texture * (colour[::-1] / texture.mean(axis=(0, 1))), 0, 1.2))


def imitated(texture: Array, own: Array) -> Array:
    """Return a skin's imitation of a floor's texture; a part of the skin's look stays its own."""
    return np.asarray(IMITATION * texture + (1 - IMITATION) * own)


def _sand(random: np.random.Generator) -> Array:
    """Ripples, grains, and bits of shell."""
    rows, columns = np.indices((SIDE, SIDE)) * (2 * np.pi / SIDE)
    bend = 5 * fractal(random, SIDE, 4, 16)
    ripples = np.sin(random.choice([-1, 1]) * 13 * columns + 31 * rows + bend)
    grain = fractal(random, SIDE, 64, 256, 1.0)
    shells = random.random((SIDE, SIDE))
    tone = 1 + 0.07 * ripples + 0.07 * grain + 0.06 * fractal(random, SIDE, 4, 32)
    tone += 0.25 * (shells > 0.995) - 0.35 * (shells < 0.006)
    return np.asarray(np.array([0.74, 0.88, 1.0]) * tone[..., None])


def _stones(random: np.random.Generator) -> Array:
    """Gravel, overgrown in places."""
    large = pebbles(random, SIDE) / 130
    halves = large.reshape(SIDE // 2, 2, SIDE // 2, 2, 3).mean(axis=(1, 3))
    stones = np.tile(halves, (2, 2, 1))
    overgrown = fractal(random, SIDE, 8, 64) - 0.3
    return lerp(stones, stones * np.array([0.75, 1.0, 0.95]), 2 * overgrown)


def _turf(random: np.random.Generator) -> Array:
    """Short algae, thick and thin."""
    blades = grass(random, SIDE) / 90
    dark = 1 + 0.35 * fractal(random, SIDE, 8, 64)
    return np.asarray(blades.mean(axis=2, keepdims=True) * np.clip(dark, 0.3, 2)[..., None]
                      * np.array([0.8, 1.0, 0.9]))  # fmt: skip


def _reef(random: np.random.Generator) -> Array:
    """Rough rock with crusts of other colours."""
    height = fractal(random, SIDE, 16, 256, 0.7)
    tones = np.array([[0.35, 0.38, 0.45], [0.7, 0.75, 0.9], [1.0, 1.05, 1.25]])
    rock = ramp(height, tones) * relief(9 * height, 0.35)[..., None]
    crust = fractal(random, SIDE, 32, 128) * 3 - 1.6
    return lerp(rock, rock * np.array([1.15, 0.82, 1.25]), crust)


def _spotted(random: np.random.Generator) -> Array:
    """Skin at ease: pale spots and dark lines between them."""
    cells = fractal(random, SIDE, 32, 64, 0.5)
    tone = 1 + 0.22 * np.clip(2 * cells, -1, 1) + 0.05 * fractal(random, SIDE, 128, 256, 1.0)
    pale = np.clip(4 * fractal(random, SIDE, 32, 32) - 3.4, 0, 1)
    return lerp(np.ones(3) * tone[..., None], np.array([1.2, 1.4, 1.4]), pale)


FLOOR_KINDS: Mapping[str, Kind] = {
    "sand": Kind((0.70, 0.63, 0.50), _sand),
    "stones": Kind((0.50, 0.46, 0.42), _stones),
    "turf": Kind((0.32, 0.38, 0.19), _turf),
    "reef": Kind((0.47, 0.29, 0.30), _reef),
}

SKINS: Mapping[str, Kind] = {
    "rust": Kind((0.62, 0.27, 0.17), _spotted),
    "ochre": Kind((0.74, 0.47, 0.16), _spotted),
    "violet": Kind((0.42, 0.22, 0.42), _spotted),
    "salmon": Kind((0.78, 0.50, 0.42), _spotted),
}
