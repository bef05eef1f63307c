"""What stays still: a wall of speckled plaster, and the table before it.

The wall's grey is a cool one: trackers by hue alone follow the paper's ball until frame 11, so
that it cannot be the colour of its wall.
"""

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.synthetic.render.texture import fractal, noise
from trackmark.datasets.synthetic.wang2010.table_tennis.player import LIGHT

Array = NDArray[np.float64]

FINE = 3
"""Painted pixels per pixel of the picture."""

SIDE = 512
"""Of the textures [painted pixels]."""

TABLES = ((92, 74, 34), (66, 84, 30), (110, 66, 40))


def wall(random: np.random.Generator, width: int, height: int) -> NDArray[np.uint8]:
    """Paint it, shape (height, width, 3): tone, speckles, joints and table are drawn at random."""
    shape = height * FINE, width * FINE
    cut = slice(shape[0]), slice(shape[1])
    y, x = ((axis[cut] + 0.5) / FINE for axis in np.indices((SIDE, SIDE)))
    tint = np.array([random.uniform(1.02, 1.09), 1.0, random.uniform(0.93, 0.99)])
    tone = random.uniform(112, 140) * (1 + 0.05 * fractal(random, SIDE, 2, 16)[cut])
    tone = tone * (1 + 0.10 * fractal(random, SIDE, 64, 256, 0.95)[cut])
    picture = tone[..., None] * tint
    for share, gains in ((0.62, (0.62, 0.62, 0.64)), (0.66, (1.34, 1.33, 1.32)),
                         (0.8, (0.72, 0.82, 0.96)), (0.8, (1.10, 0.94, 0.80))):  # fmt: skip
        cells = int(random.choice([128, 256]))
        speckle = np.clip((noise(random, SIDE, cells)[cut] - share) * 5, 0, 1)[..., None]
        picture *= 1 + speckle * (np.array(gains) - 1)
    picture *= _joints(random, x, y)[..., None]
    _put_table(random, picture, y, height)
    blocks = picture.reshape(height, FINE, width, FINE, 3).mean(axis=(1, 3))
    return np.asarray(np.clip(np.round(LIGHT * blocks), 0, 255), np.uint8)


def _joints(random: np.random.Generator, x: Array, y: Array) -> Array:
    """Gain of light in the joints of the wall's panels, and along their lit edges."""
    gain = np.ones(x.shape)
    first, spacing = random.uniform(5, 50), random.uniform(46, 90)
    upright = [(first + spacing * k, x) for k in range(int(random.integers(4)))]
    for place, across in [(random.uniform(14, 50), y), *upright]:
        gain *= 1 - 0.42 * np.clip(1.1 - np.abs(across - place), 0, 1)
        gain *= 1 + 0.16 * np.clip(1 - np.abs(across - place - 1.6), 0, 1)
    return gain


def _put_table(random: np.random.Generator, picture: Array, y: Array, height: int) -> None:
    """The table's end, out of focus at the lower border: its top, its white line, its edge."""
    top = height - random.uniform(5, 9)
    paint = np.array(TABLES[int(random.integers(len(TABLES)))], np.float64)
    picture *= (1 - 0.3 * np.clip(1 - (top - y) / 6, 0, 1) * (y < top))[..., None]
    for begins, colour in ((top, paint * 1.3), (top + 1.8, (196, 198, 196)), (top + 3.4, paint)):
        share = np.clip((y - begins) / 1.2 + 0.5, 0, 1)[..., None]
        picture += share * (np.asarray(colour) - picture)
