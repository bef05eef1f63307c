"""Surfaces of balls seen from above."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["colour_skin", "mould"]


@njit(cache=True)
def mould(
    balls: NDArray[np.float64],
    left: float,
    top: float,
    step: float,
    height: NDArray[np.float32],
    owner: NDArray[np.int32],
) -> None:
    """Find the highest surface at samples.

    Parameters
    ----------
    balls : ndarray of float64, shape (k, 5)
        Middle (x, y), radius, height of the middle, half height as a part of the radius.
    left, top, step : float
        Sample (row i, column j) lies at ``(left + (j + 0.5) * step, top + (i + 0.5) * step)``.
    height : ndarray of float32, shape (rows, columns)
        Of what is there already; raised in place.
    owner : ndarray of int32, shape (rows, columns)
        Set where a ball is highest, to its number.
    """
    rows, columns = height.shape
    for k in range(len(balls)):
        x, y, radius, middle, flat = balls[k]
        first_row = max(int(np.floor((y - radius - top) / step - 0.5)), 0)
        last_row = min(int(np.ceil((y + radius - top) / step - 0.5)), rows - 1)
        first_column = max(int(np.floor((x - radius - left) / step - 0.5)), 0)
        last_column = min(int(np.ceil((x + radius - left) / step - 0.5)), columns - 1)
        for i in range(first_row, last_row + 1):
            down = top + (i + 0.5) * step - y
            chord = radius * radius - down * down
            for j in range(first_column, last_column + 1):
                right = left + (j + 0.5) * step - x
                rest = chord - right * right
                if rest < 0:
                    continue
                surface = middle + flat * np.sqrt(rest)
                if surface > height[i, j]:
                    height[i, j] = surface
                    owner[i, j] = k


@njit(cache=True)
def colour_skin(
    owner: NDArray[np.int32],
    left: float,
    top: float,
    step: float,
    to_rest: NDArray[np.float64],
    before: NDArray[np.float32],
    after: NDArray[np.float32],
    order: NDArray[np.float32],
    share: float,
    soft: float,
    light: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    """Give samples of a skin the colours of two looks, of each where its time has come.

    Parameters
    ----------
    owner, left, top, step
        See `mould`.
    to_rest : ndarray of float64, shape (k, 2, 3)
        From the picture to where that part of the skin is in the textures, by ball.
    before, after : ndarray of float32, shape (side, side, 3)
        The looks; they repeat, and `side` is a power of two.
    order : ndarray of float32, shape (side, side)
        When a place changes, in [0, 1].
    share : float
        How far all has come, in [0, 1].
    soft : float
        How long a place takes, as a part of the whole change.
    light : ndarray of float32, shape (rows, columns)
        That falls on the samples.
    out : ndarray of float32, shape (rows, columns, 4)
        Colour with coverage, zeros; written where there is skin.
    """
    rows, columns = owner.shape
    last = order.shape[0] - 1
    for i in range(rows):
        y = top + (i + 0.5) * step
        for j in range(columns):
            k = owner[i, j]
            if k < 0:
                continue
            x = left + (j + 0.5) * step
            u = to_rest[k, 0, 0] * x + to_rest[k, 0, 1] * y + to_rest[k, 0, 2]
            v = to_rest[k, 1, 0] * x + to_rest[k, 1, 1] * y + to_rest[k, 1, 2]
            column, row = int(np.floor(u)), int(np.floor(v))
            right, down = u - column, v - row
            a, b = column & last, (column + 1) & last
            c, d = row & last, (row + 1) & last
            changed = min(max((share * (1 + soft) - order[c, a]) / soft, 0.0), 1.0)
            for look, part in ((before, 1 - changed), (after, changed)):
                if part == 0:
                    continue
                part *= light[i, j]
                for channel in range(3):
                    upper = (1 - right) * look[c, a, channel] + right * look[c, b, channel]
                    lower = (1 - right) * look[d, a, channel] + right * look[d, b, channel]
                    out[i, j, channel] += part * ((1 - down) * upper + down * lower)
            out[i, j, 3] = 1.0
