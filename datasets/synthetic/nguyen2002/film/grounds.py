"""What the ground of a clip is made of, in bands.

Textures are of half the side that bands have, laid twice in either direction.
"""

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.render.street.ground import SIDE, Band
from datasets.synthetic.render.texture import fractal, grass, paving, pebbles, ramp

__all__ = ["market_place", "platform", "quay", "road", "sand", "water"]

Array = NDArray[np.float64]

HALF = SIDE // 2


def road(random: np.random.Generator, end: float) -> list[Band]:
    """Pavement or lawn, a road with a line, and pavement before houses."""
    stones = _faded(paving(random, HALF), 0.7) * random.uniform(0.9, 1.15)
    near = stones if random.random() < 0.7 else grass(random, HALF)
    kerb = _grainy(random, (168.0, 168.0, 168.0), 0.05)
    tar = _tar(random)
    start, middle = random.uniform(11.0, 13.0), random.uniform(18.0, 21.0)
    side = float(random.uniform(2.2, 3.2))
    return [
        _band(0.0, near, side),
        _band(start - 0.25, kerb, 4.0),
        _band(start, tar, 3.0),
        _band(middle, _dashed(tar), 6.0),
        _band(middle + 0.3, tar, 3.0),
        _band(end - 5.0, kerb, 4.0),
        _band(end - 4.6, stones, side),
    ]


def quay(random: np.random.Generator, end: float) -> list[Band]:
    """Concrete with joints and stains, and rails."""
    stains = 1 - 0.1 * fractal(random, HALF, 2, 16)
    concrete = _grainy(random, (146.0, 154.0, 160.0), 0.08) * stains[..., None]
    concrete *= random.uniform(0.8, 1.05)
    rail = _grainy(random, (86.0, 98.0, 112.0), 0.08)
    concrete[:, :3] *= 0.6
    concrete[:3] *= 0.7
    bands = [_band(0.0, concrete, 4.0)]
    for place in (0.45 * end, 0.62 * end):
        bands += [_band(place, rail, 2.0), _band(place + 0.25, concrete, 4.0)]
    return bands


def water(random: np.random.Generator, end: float) -> list[Band]:
    """Waves, darker in their troughs; `end` is beyond what they depend on."""
    waves = np.repeat(fractal(random, HALF, 16, 128, 0.7), 2, axis=1)
    waves = np.tile(waves, (2, 1)) + 0.4 * np.tile(fractal(random, HALF, 2, 16), (2, 2))
    deep = np.array([random.uniform(84, 110), random.uniform(84, 96), random.uniform(50, 66)])
    colours = np.stack([deep * 0.6, deep, deep * 1.5 + 20, np.array([208.0, 206.0, 196.0])])
    return [Band(0.0, ramp(waves * 0.8 - 0.15, colours), 3.2)]


def platform(random: np.random.Generator, end: float) -> list[Band]:
    """Flags, a yellow line, the track bed."""
    flags = _faded(paving(random, HALF), 0.5) * random.uniform(0.9, 1.15)
    line = flags * 0.4 + np.array([40.0, 130.0, 150.0])
    bed = pebbles(random, HALF) * 0.6
    edge = 0.72 * end
    return [
        _band(0.0, flags, 3.2),
        _band(edge - 1.6, line, 3.2),
        _band(edge - 1.0, flags, 3.2),
        _band(edge, bed * 0.5, 2.4),
        _band(edge + 1.2, bed, 2.4),
    ]


def market_place(random: np.random.Generator, end: float) -> list[Band]:
    """Setts or rounded stones, up to the houses wherever these are."""
    kind = paving if random.random() < 0.6 else pebbles
    stones = kind(random, HALF) * random.uniform(0.85, 1.1)
    return [_band(0.0, stones, float(random.uniform(2.2, 3.4)))]


def sand(random: np.random.Generator, end: float) -> list[Band]:
    """Sand with stones as far as one sees, and a road along it."""
    earths = np.array([[70, 104, 142], [104, 146, 184], [134, 174, 206], [160, 194, 216]])
    grain = fractal(random, HALF, 8, 128, 0.75)
    ground = ramp(grain * 0.8, earths * random.uniform(0.85, 1.05))
    tar = _tar(random)
    return [
        _band(0.0, ground, 4.0),
        _band(11.0, tar, 3.0),
        _band(15.0, _dashed(tar), 6.0),
        _band(15.4, tar, 3.0),
        _band(23.0, ground, 4.0),
    ]


def _band(start: float, texture: Array, side: float) -> Band:
    """Band of a texture whose side covers so much [metres]."""
    return Band(start, np.tile(texture, (2, 2, 1)), 2 * side)


def _grainy(
    random: np.random.Generator, colour: tuple[float, float, float], strength: float
) -> Array:
    grain = fractal(random, HALF, 16, 128, 0.9)
    return np.asarray(colour) * (1 + strength * grain)[..., None]


def _faded(texture: Array, contrast: float) -> Array:
    middle = texture.mean(axis=(0, 1))
    return np.asarray(middle + contrast * (texture - middle))


def _tar(random: np.random.Generator) -> Array:
    tone = random.uniform(0.85, 1.2)
    return _grainy(random, (94.0 * tone, 95.0 * tone, 97.0 * tone), 0.1)


def _dashed(tar: Array) -> Array:
    """Tar with a stretch of a painted line."""
    line = tar.copy()
    line[:, : HALF // 2] = line[:, : HALF // 2] * 0.3 + 150
    return line
