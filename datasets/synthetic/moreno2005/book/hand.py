"""The hand that holds the book: its thumb before it, the rest below; and its sleeve."""

import cv2
import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.moreno2005.book.light import AROUND, STRAIGHT
from datasets.synthetic.moreno2005.book.plan import SIZE, Pose
from datasets.synthetic.render.colours import CLOTHES, nearly
from datasets.synthetic.render.figure.look import COMPLEXIONS
from datasets.synthetic.render.finish import Finish, Thing, grain, looked_at
from datasets.synthetic.render.solids import limb

__all__ = ["Hand", "lit_hand"]

Array = NDArray[np.float64]
Floats = NDArray[np.float32]

CORNER, EXTENT, FINE = (-90, -34), (180, 190), 3
"""What holds hand and arm: left top from the held place, and size [pixels]; samples a pixel."""


class Hand:
    """Picture of a hand.

    Parameters
    ----------
    sheet : ndarray of float32, shape (h, w, 4)
        Light that comes back from it, premultiplied by the coverage.
    """

    def __init__(self, sheet: Floats) -> None:
        self._sheet = sheet

    def at(self, pose: Pose) -> Floats:
        """It where it holds the book, shape (height, width, 4)."""
        turn = pose.scale * np.array(
            [[np.cos(pose.tilt), -np.sin(pose.tilt)], [np.sin(pose.tilt), np.cos(pose.tilt)]]
        )
        shift = pose.place + turn @ (np.array(CORNER) + 0.5) - 0.5
        matrix = np.column_stack([turn, shift])
        return np.asarray(cv2.warpAffine(self._sheet, matrix, SIZE, flags=cv2.INTER_LINEAR))


def lit_hand(random: np.random.Generator, lamp: Array) -> Hand:
    """A hand, drawn at random, in the light of a lamp in a direction."""
    side = float(random.choice([-1, 1]))
    skin = np.asarray(COMPLEXIONS[random.integers(len(COMPLEXIONS))][0], np.float64)
    cloth = nearly(random, CLOTHES[int(random.integers(len(CLOTHES)))], 0.06)
    things = [
        Thing(Finish(skin, 0.0, grain(random, 0.04)), _skin(random, side)),
        Thing(Finish(cloth, 0.0, grain(random, 0.09, (1.0, 0.6, 1.0), 16)), _sleeve(side)),
    ]
    surface = looked_at(things, CORNER, EXTENT, FINE)
    light = AROUND + STRAIGHT * np.maximum(surface.normal @ lamp, 0)
    there = (surface.which >= 0)[..., None]
    sheet = np.concatenate([surface.colour * light[..., None], there], axis=2)
    return Hand(np.asarray(cv2.resize(sheet, EXTENT, interpolation=cv2.INTER_AREA), np.float32))


def _skin(random: np.random.Generator, side: float) -> list[Array]:
    """Thumb, its ball, the palm's edge, knuckles and wrist; y upwards from the held place."""
    lean = random.uniform(-3, 3)
    wrist = (side * 14, -46, -6)
    solids = [
        *_chain([(side * 12, -30, 6), (side * 6, -9, 12), (lean, 12, 13)], (9.5, 7.2, 5.2)),
        *_chain([wrist, (side * 12, -28, 4)], (10.5, 11)),
    ]
    for k in range(4):
        knuckle = (side * (-17 + 9.5 * k), -12 - 1.5 * abs(k - 1.4), -2 - 2 * k)
        solids += _chain([(side * (-2 + 5 * k), -34, -2), knuckle], (9, 6.2))
    return solids


def _sleeve(side: float) -> list[Array]:
    cuff = _chain([(side * 15, -50, -6), (side * 17, -58, -6)], (15, 15.5))
    return cuff + _chain([(side * 16, -54, -6), (side * 34, -160, -6)], (14, 22))


def _chain(points: list[tuple[float, float, float]], radii: tuple[float, ...]) -> list[Array]:
    return [
        limb(points[k], points[k + 1], (radii[k], radii[k + 1]), 4.0)
        for k in range(len(points) - 1)
    ]
