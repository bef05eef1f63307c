"""Somebody who faces the camera, from the chest up."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.render.figure.look import BGR, Cut, Look, drawn_look
from datasets.synthetic.render.figure.routine import Routine
from datasets.synthetic.render.figure.worker import Worker
from datasets.synthetic.render.sprite import Sprite

__all__ = ["FINE", "drawn_person", "portrait"]

Array = NDArray[np.float64]

FINE = 4
"""Pixels of a portrait in one of the picture, in either direction."""

DISTANCE = 1.6
"""From the camera [metres]."""

HEAD = 0.222
"""From chin to crown [metres]."""

CROWN = 0.118
"""Above the middle of the head [metres]."""

BELOW = 0.022
"""The face's middle lies so far below the head's [metres]."""

CLOTHES: tuple[BGR, ...] = (
    (84, 52, 38),  # navy
    (120, 78, 48),  # blue
    (146, 118, 86),  # light blue
    (112, 106, 96),  # grey
    (74, 92, 60),  # green
    (98, 96, 36),  # teal
    (96, 54, 78),  # violet
)
SHIRTS: tuple[BGR, ...] = ((214, 208, 200), (176, 150, 118), (150, 142, 130), (82, 74, 66))

CUTS: tuple[Cut, ...] = ("short", "short", "full", "full", "wreath")


def drawn_person(random: np.random.Generator) -> Look:
    """Somebody in an office: clean-shaven, and in no colour like skin's."""
    return replace(
        drawn_look(random),
        cut=CUTS[random.integers(len(CUTS))],
        beard=False,
        bib=False,
        clothes=CLOTHES[random.integers(len(CLOTHES))],
        shirt=SHIRTS[random.integers(len(SHIRTS))],
    )


def portrait(
    random: np.random.Generator, look: Look, lamp: Array, head: float, size: tuple[int, int]
) -> Sprite:
    """Head and shoulders, the face in the middle.

    Parameters
    ----------
    random : numpy.random.Generator
        Draws how they sit, and their hair and folds.
    look : Look
    lamp : ndarray of float64, shape (4,)
        See `Worker`.
    head : float
        Height of the head [pixels of the picture].
    size : tuple of int
        Width and height [pixels of the picture].
    """
    width, height = (FINE * length for length in size)
    focal = head * FINE / HEAD * DISTANCE
    eye = look.stature - CROWN
    camera = np.array([focal, width / 2, height / 2, eye - BELOW])
    sitter = Worker(look, _sitting(random, look, eye), camera, lamp, int(random.integers(2**32)))
    black, white = (
        np.zeros((height, width, 3), np.uint8),
        np.full((height, width, 3), 255, np.uint8),
    )
    for canvas in (black, white):
        sitter.draw(canvas, 0, 1.0, 0.0)
    # What is seen of both is not covered.
    coverage = 1 - (white.astype(np.float64) - black).mean(axis=2) / 255
    return Sprite(black / np.maximum(coverage, 1 / 255)[..., None], coverage)


def _sitting(random: np.random.Generator, look: Look, eye: float) -> Routine:
    """Two frames of the same pose: towards the camera, the arms hang."""
    ahead = np.pi / 2
    heading, turn = ahead + np.radians(random.uniform(-14, 14, 2) * [1.0, 0.6])
    nod, tilt = np.radians(random.uniform(-4, 4, 2))
    one = np.ones(2)
    hands = np.array([[[0.30, -0.55, 0.10], [-0.30, -0.55, 0.10]]] * 2)
    return Routine(
        x=0 * one, z=DISTANCE * one, crouch=0 * one, heading=heading * one, lean=0.04 * one,
        turn=turn * one, nod=nod * one, tilt=tilt * one, hands=hands, to_face=np.zeros((2, 2)),
    )  # fmt: skip
