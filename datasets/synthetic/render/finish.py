"""What surfaces look like: their colours, patterns and gloss, under the light on them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from datasets.synthetic.render.texture import fractal, lerp

__all__ = ["Finish", "Pattern", "Thing", "grain", "painted", "plain", "tiles"]

Array = NDArray[np.float64]
Pattern: TypeAlias = Callable[[Array], Array]

GAMMA = 2.2
"""Of the camera: light is its grey level to this power."""


def plain(places: Array) -> Array:
    """No pattern: gain 1 at every place."""
    return np.ones((len(places), 1))


@dataclass(frozen=True)
class Finish:
    """Of a surface.

    Attributes
    ----------
    colour : array of float64, shape (3,)
        BGR in [0, 255], as it is seen in full light.
    gloss : float
        How much of the lamp it reflects.
    pattern : callable
        From places, shape (k, 3) [pixels], to the gain of the colour there, (k, 1) or (k, 3).
    """

    colour: ArrayLike
    gloss: float = 0.0
    pattern: Pattern = plain


@dataclass(frozen=True)
class Thing:
    """What is seen as one: solids (see `solids`) with a finish."""

    finish: Finish
    solids: list[Array] = field(default_factory=list)


def painted(
    finishes: Sequence[Finish], which: NDArray[np.int64], places: Array, lights: Array
) -> NDArray[np.uint8]:
    """Picture of things.

    Parameters
    ----------
    finishes : sequence of Finish
        Of each thing.
    which, places, lights : ndarray
        See `rays.what_is_seen`.

    Returns
    -------
    ndarray of uint8, shape (h, w, 4)
        BGR, and 255 where there is a thing; zeros elsewhere.
    """
    picture = np.zeros((*which.shape, 4), np.uint8)
    for k, finish in enumerate(finishes):
        there = which == k
        bright, shine = np.split(lights[there], 2, axis=1)
        surface = np.asarray(finish.colour, np.float64) * finish.pattern(places[there])
        light = np.clip(surface / 255, 0, 1) ** GAMMA * bright + finish.gloss * shine
        picture[there, :3] = np.round(255 * np.clip(light, 0, 1) ** (1 / GAMMA))
        picture[there, 3] = 255
    return picture


def grain(
    random: np.random.Generator,
    strength: float,
    stretch: tuple[float, float, float] = (1.0, 1.0, 1.0),
    coarsest: int = 8,
) -> Pattern:
    """Uneven tone; it runs along the axes whose `stretch` is small."""
    texture = fractal(random, 256, coarsest, 128, 0.75)
    weights = np.array(stretch) * 2.0

    def gain(places: Array) -> Array:
        along = places * weights
        row = np.round(along[:, 1] + along[:, 2]).astype(np.int64) % 256
        column = np.round(along[:, 0]).astype(np.int64) % 256
        return np.asarray(1 + strength * texture[row, column])[:, None]

    return gain


def tiles(random: np.random.Generator, width: float, height: float, joint: ArrayLike) -> Pattern:
    """Tiles on a wall, no two quite alike; `joint` is the joints' gain, shape (3,)."""
    tones = random.normal(1, 0.025, (64, 64))
    shift = random.uniform(0, 64, 2)
    bond = 0.5 * random.integers(2)

    def gain(places: Array) -> Array:
        row = places[:, 1] / height + shift[1]
        column = places[:, 0] / width + shift[0] + bond * (np.floor(row) % 2)
        tone = tones[np.floor(row).astype(np.int64) % 64, np.floor(column).astype(np.int64) % 64]
        within = [np.abs(u - np.floor(u) - 0.5) * s for u, s in ((column, width), (row, height))]
        rim = np.minimum(width / 2 - within[0], height / 2 - within[1])
        flat = np.repeat(tone[:, None], 3, axis=1)
        return lerp(np.asarray(joint, np.float64), flat, np.clip(rim / 0.35 - 0.6, 0, 1))

    return gain
