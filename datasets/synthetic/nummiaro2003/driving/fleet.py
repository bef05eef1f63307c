"""Cars in their paints, the target's unlike all others'."""

import numpy as np

from datasets.synthetic.nummiaro2003.driving.car import Car
from datasets.synthetic.nummiaro2003.driving.paintwork import BGR
from datasets.synthetic.nummiaro2003.driving.shape import any_shape

__all__ = ["PAINTS", "TARGETS", "any_car", "paint", "unlike"]

PAINTS: tuple[BGR, ...] = (
    (38, 34, 150),  # red
    (46, 36, 92),  # dark red
    (148, 92, 42),  # blue
    (88, 54, 36),  # dark blue
    (66, 96, 44),  # green
    (60, 150, 190),  # yellow
    (196, 202, 204),  # white
    (164, 166, 166),  # silver
    (94, 94, 94),  # grey
    (44, 42, 42),  # black
    (128, 156, 172),  # beige
)

TARGETS = tuple(paint for paint in PAINTS if paint != (94, 94, 94))
"""Paints of targets: not that of the road."""

CLEAR = 60.0
"""Paints that differ by this much in some channel differ clearly [grey levels]."""


def paint(random: np.random.Generator, choice: tuple[BGR, ...] = PAINTS) -> BGR:
    """One of some paints; no two are quite alike."""
    colour = np.array(choice[random.integers(len(choice))])
    blue, green, red = (colour * random.uniform(0.92, 1.08) + random.uniform(-4, 4, 3)).tolist()
    return blue, green, red


def unlike(target: BGR) -> tuple[BGR, ...]:
    """Paints that differ clearly from a target's."""
    return tuple(p for p in PAINTS if np.abs(np.subtract(p, target)).max() >= CLEAR)


def any_car(random: np.random.Generator, choice: tuple[BGR, ...] = PAINTS) -> Car:
    """Car of any shape, in one of some paints."""
    return Car(any_shape(random), paint(random, choice), int(random.integers(2**32)))
