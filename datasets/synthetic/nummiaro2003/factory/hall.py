"""The far side of a factory hall: what stands along its wall, pipes and lamps above it."""

import cv2
import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.nummiaro2003.factory.machines import cabinet, machine_tool, wiring
from datasets.synthetic.nummiaro2003.factory.paints import ACCENTS, DARK, PAINTS, STEEL
from datasets.synthetic.nummiaro2003.factory.stores import notices, shelf, tools
from datasets.synthetic.render.painting import Painting, any_of
from datasets.synthetic.render.texture import fractal

__all__ = ["hall"]

FINE = 2
"""It is painted larger by this."""

WALLS = (
    (176, 184, 186),
    (150, 178, 190),
    (168, 182, 160),
    (120, 140, 170),
    (150, 150, 148),
)

FADED = 0.22
"""Of the colours' strength."""

CABLES = (DARK,) * 6 + (STEEL,) * 4

UNITS = (cabinet, machine_tool, shelf, tools, wiring, notices)
"""What stands along the wall, each once before any comes again."""


def hall(random: np.random.Generator, width: int, height: int, scale: float) -> NDArray[np.uint8]:
    """Paint a wall with machines.

    Parameters
    ----------
    random : numpy.random.Generator
        Draws everything.
    width, height : int
        Of the picture [pixels].
    scale : float
        [pixels/metre].

    Returns
    -------
    ndarray of uint8, shape (height, width, 3)
    """
    wall = any_of(random, WALLS)
    picture = np.empty((FINE * height, FINE * width, 3), np.uint8)
    picture[:] = np.round(wall).astype(np.uint8)
    painting = Painting(picture, FINE * scale)
    wide, high = width / scale, height / scale
    painting.patch(0, 0.55 * high, wide, high, any_of(random, PAINTS) * 0.9)
    order = random.permutation(len(UNITS)).tolist()
    x, k = -random.uniform(0.0, 0.4), 0
    while x < wide:
        unit = UNITS[order[k % len(order)]]
        span = random.uniform(0.5, 0.95)
        top = random.uniform(0.22, 0.5)
        unit(painting.part(x, top), random, span, high - top + 0.1)
        x, k = x + span + random.uniform(0.02, 0.14), k + 1
    _overhead(painting, random, wide)
    smaller = np.empty((height, width, 3), np.uint8)
    cv2.resize(picture, (width, height), smaller, interpolation=cv2.INTER_AREA)
    return _used(random, smaller)


def _overhead(painting: Painting, random: np.random.Generator, width: float) -> None:
    """Pipes, a cable tray and cables that hang down, lamps."""
    painting.darken(0, 0, width, 0.10, 0.7)
    y = 0.02
    while y < 0.26:
        radius = random.uniform(0.012, 0.035)
        paint = any_of(random, (*PAINTS, STEEL))
        painting.pipe((-0.1, y), (width + 0.1, y), radius, paint)
        for x in random.uniform(0, width, 4):
            painting.patch(x, y - radius, 0.05, 2 * radius, any_of(random, ACCENTS))
        y += 2 * radius + random.uniform(0.01, 0.05)
    for _ in range(8):
        start = random.uniform(0, width), random.uniform(0.1, 0.28)
        end = start[0] + random.uniform(-0.5, 0.5), random.uniform(0.25, 0.8)
        painting.wire(
            start,
            end,
            random.uniform(0.02, 0.2),
            random.uniform(0.005, 0.012),
            any_of(random, (*CABLES, *ACCENTS)),
        )


def _used(random: np.random.Generator, picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Dirt, oil and uneven paint."""
    height, width = picture.shape[:2]
    broad, fine = fractal(random, 1024, 8, 64, 0.7), fractal(random, 1024, 128, 512, 0.8)
    gain = 1 + 0.09 * broad[:height, :width] + 0.06 * fine[:height, :width]
    grime = np.clip(fractal(random, 1024, 16, 256, 0.75)[:height, :width] - 0.7, 0, 1)[..., None]
    # What is far from the worker is a little out of focus, and no paint is as bright as new.
    soft = cv2.GaussianBlur(picture, (5, 5), 0.75).astype(np.float64)
    soft += FADED * (soft.mean(axis=2, keepdims=True) - soft)
    used = soft * gain[..., None]
    used = used + (np.array([40.0, 50.0, 58.0]) - used) * 0.6 * grime
    return np.clip(np.round(used), 0, 255).astype(np.uint8)
