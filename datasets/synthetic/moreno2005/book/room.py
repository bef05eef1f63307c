"""Desk and shelf behind the book, in the light of the lamp."""

import cv2
import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.moreno2005.book.light import AROUND, STRAIGHT
from datasets.synthetic.moreno2005.book.plan import SIZE
from datasets.synthetic.render.desk import WALL, room
from datasets.synthetic.render.finish import PITCH, looked_at
from datasets.synthetic.render.lamp import REACH, light_on, unshaded

__all__ = ["lit_room"]

Array = NDArray[np.float64]
Floats = NDArray[np.float32]

FINE = 2
"""Samples a pixel, in either direction."""

HORIZON = 178
"""Row in which the wall meets the desk [pixels]."""

FAR = 620.0
"""How far the lamp is from the middle of the picture [pixels]."""


def lit_room(random: np.random.Generator, lamp: Array) -> Floats:
    """A room, drawn at random, in the light from a direction: shape (height, width, 3)."""
    corner = -SIZE[0] / 2, WALL * float(np.sin(PITCH)) - HORIZON
    surface = looked_at(room(random), corner, SIZE, FINE)
    place = np.array([SIZE[0] / 2, SIZE[1] / 2, 0.0]) + FAR * lamp
    straight, _ = light_on(place, surface.depth, surface.normal, FINE)
    straight *= STRAIGHT * (FAR / REACH) ** 2
    light = AROUND + straight[..., None] * unshaded(surface.depth, place, FINE)
    returned = np.asarray(surface.colour * light, np.float32)
    return np.asarray(cv2.resize(returned, SIZE, interpolation=cv2.INTER_AREA))
