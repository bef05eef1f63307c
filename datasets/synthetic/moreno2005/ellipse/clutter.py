"""What is behind the ellipse: a smooth texture, shapes of all colours over it, the patches."""

from collections.abc import Mapping, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from datasets.interface import Image
from datasets.synthetic.moreno2005.ellipse.patches import Patch
from datasets.synthetic.moreno2005.ellipse.plan import COLOURS, SIZE
from datasets.synthetic.moreno2005.ellipse.shapes import FINE, Shape, drawn_shape
from datasets.synthetic.moreno2005.knobs import Clutter
from datasets.synthetic.render.texture import fractal, ramp
from datasets.synthetic.scene import part_generator

__all__ = ["painted"]

Array = NDArray[np.float64]

SHAPES: Mapping[Clutter, int] = {"moderate": 90, "dense": 140}

RADIUS = 6.0, 30.0
"""Of shapes; the smaller, the more of them [pixels]."""

MOTTLE = 0.06
"""Standard deviation of a shape's texture, of its colour."""

SLANT = 0.14
"""How much lighter a shape is at most at one end than at the other, of its colour."""

SHADOW = 0.45
"""What a shape takes at most of the light around it."""

THICK = 2.2
"""About how far its shadow reaches [pixels]."""

TILE = 1024
"""Side of the textures [samples]; more than the picture has."""


def painted(seed: int, patches: Sequence[Patch], clutter: Clutter) -> Image:
    """Picture of all that stands still, BGR, with the patches on top."""
    random = part_generator(seed, "moreno2005/ellipse clutter")
    rows, columns = SIZE[1] * FINE, SIZE[0] * FINE
    smooth = fractal(random, TILE, 4, 256, 0.6)[:rows, :columns]
    colours = random.uniform(*COLOURS, 3) + random.uniform(-0.3, 0.3, (4, 3))
    canvas = ramp(smooth, np.clip(colours, 0.05, 0.95))
    mottle = MOTTLE * fractal(random, TILE, 32, 512, 0.8)
    for _ in range(SHAPES[clutter]):
        middle = random.uniform((0, 0), SIZE)
        radius = RADIUS[0] + (RADIUS[1] - RADIUS[0]) * random.random() ** 2
        shape = drawn_shape(random, middle, radius)
        _lay(random, canvas, mottle, shape, random.uniform(*COLOURS, 3))
    for patch in patches:
        _lay(random, canvas, mottle, patch.shape, patch.colour)
    reduced = cv2.resize(np.clip(canvas, 0, 1), SIZE, interpolation=cv2.INTER_AREA)
    return np.ascontiguousarray(np.round(255 * np.asarray(reduced)[..., ::-1]).astype(np.uint8))


def _lay(
    random: np.random.Generator, canvas: Array, mottle: Array, shape: Shape, colour: Array
) -> None:
    """Lay a shape over a canvas of samples, with its shadow; the canvas is changed in place."""
    covered = shape.samples()
    rows, columns = _window(shape)
    reach = 2 * round(THICK * FINE) + 1
    soft = cv2.blur(covered[rows, columns].astype(np.float64), (reach, reach))
    canvas[rows, columns] *= 1 - SHADOW * np.asarray(soft)[..., None]
    y, x = np.nonzero(covered)
    direction, slant = random.uniform(0, 2 * np.pi), SLANT * random.random()
    along = (x * np.cos(direction) + y * np.sin(direction)) / (FINE * 2 * RADIUS[1])
    lighter = slant * (along - along.mean()) if len(along) else along
    shift = random.integers(TILE, size=2)
    texture = mottle[(y + shift[0]) % TILE, (x + shift[1]) % TILE]
    canvas[y, x] = colour * (1 + lighter + texture)[:, None]


def _window(shape: Shape) -> tuple[slice, slice]:
    """Rows and columns of samples that a shape's shadow may reach."""
    margin = THICK + 2
    low = np.maximum(np.floor((shape.outline.min(axis=0) - margin) * FINE), 0).astype(int)
    high = np.maximum(np.ceil((shape.outline.max(axis=0) + margin) * FINE), 0).astype(int)
    return slice(int(low[1]), int(high[1])), slice(int(low[0]), int(high[0]))
