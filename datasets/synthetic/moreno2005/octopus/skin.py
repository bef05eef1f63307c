"""The skin of the octopus: its looks, how it goes from one to another, what is seen of it."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.moreno2005.octopus.body import EYE, EYES, Body, Posture
from datasets.synthetic.moreno2005.octopus.looks import SIDE
from datasets.synthetic.moreno2005.octopus.moulding import colour_skin, mould
from datasets.synthetic.moreno2005.octopus.relief import lit
from datasets.synthetic.render.texture import fractal

__all__ = ["FINE", "Skin"]

Array = NDArray[np.float64]
Floats = NDArray[np.float32]

FINE = 2
"""Samples per pixel and axis."""

ROUNDED = 2.2
"""Standard deviation of the blur that joins its parts [samples]."""

SOFT = 0.35
"""How long a place takes to change, as a part of the whole change."""

IRIS, PUPIL = (0.20, 0.52, 0.62), (0.03, 0.03, 0.03)
"""Colours of the eyes, BGR in [0, 1]."""


class Skin:
    """Looks of a body.

    Parameters
    ----------
    random : numpy.random.Generator
        Draws in which order places change.
    body : Body
    looks : sequence of ndarray of float64, shape (SIDE, SIDE, 3)
        BGR in [0, 1].
    """

    def __init__(self, random: np.random.Generator, body: Body, looks: Sequence[Array]) -> None:
        rest = body.at_rest().balls
        self._rest = rest[:, :2]
        height, owner = np.zeros((SIDE, SIDE), np.float32), np.full((SIDE, SIDE), -1, np.int32)
        mould(rest, -SIDE / 2, -SIDE / 2, 1.0, height, owner)
        worn = owner >= 0
        # Of the colour that it stands for, whatever part of a texture lies on the body.
        fitted = (look * (look.mean(axis=(0, 1)) / look[worn].mean(axis=0)) for look in looks)
        eyes = body.scale * EYES, body.scale * EYE
        self._looks = np.stack([_with_eyes(look, *eyes) for look in fitted]).astype(np.float32)
        order = fractal(random, SIDE, 16, 64, 0.6)
        ranks = order.ravel().argsort().argsort() / order.size
        self._order: Floats = ranks.reshape(order.shape).astype(np.float32)

    def seen(
        self,
        posture: Posture,
        corner: tuple[int, int],
        size: tuple[int, int],
        before: int,
        after: int,
        share: float,
    ) -> Floats:
        """What is seen of it in a window of the picture, in `FINE` samples a pixel.

        Parameters
        ----------
        posture : Posture
            Of the body.
        corner, size : tuple of int
            Left top corner, width and height of the window [pixels].
        before, after : int
            Indices of the looks from which to which it changes.
        share : float
            How far the change has come, in [0, 1].

        Returns
        -------
        ndarray of float32, shape (rows, columns, 4)
            BGR in [0, 1] and coverage, zeros where there is none of it.
        """
        shape = size[1] * FINE, size[0] * FINE
        height, owner = np.zeros(shape, np.float32), np.full(shape, -1, np.int32)
        colour = np.zeros((*shape, 4), np.float32)
        left, top, step = float(corner[0]), float(corner[1]), 1 / FINE
        mould(posture.balls, left, top, step, height, owner)
        light = lit(height * FINE, ROUNDED)
        colour_skin(
            owner,
            left,
            top,
            step,
            self._to_rest(posture),
            self._looks[before],
            self._looks[after],
            self._order,
            share,
            SOFT,
            light,
            colour,
        )
        return colour

    def _to_rest(self, posture: Posture) -> Array:
        """From the picture to places in the looks, by ball; shape (k, 2, 3)."""
        cosine, sine = np.cos(posture.turns), np.sin(posture.turns)
        turn = np.stack(
            [np.stack([cosine, sine], axis=1), np.stack([-sine, cosine], axis=1)], axis=1
        )
        turned = np.einsum("kij,kj->ki", turn, posture.balls[:, :2])
        shift = self._rest - turned + (SIDE / 2 - 0.5)
        return np.concatenate([turn, shift[..., None]], axis=2)


def _with_eyes(look: Array, places: Array, radius: float) -> Array:
    """A look with irises and slit pupils painted on it."""
    result = look.copy()
    rows, columns = np.indices(look.shape[:2]) + 0.5 - SIDE / 2
    for x, y in places:
        right, down = columns - x, rows - y
        result[right * right + down * down <= radius * radius] = IRIS
        result[(np.abs(right) < 0.7 * radius) & (np.abs(down) < 0.25 * radius)] = PUPIL
    return result
