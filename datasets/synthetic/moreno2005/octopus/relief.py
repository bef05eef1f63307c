"""Surfaces of balls seen from above, the light and shade on them, and looks that they wear."""

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float32]

# Where the light comes from: to the right, down, towards the camera.
SUN = np.array([-0.42, -0.5, 0.757], np.float32)
AMBIENT = 0.55  # light from all around, of what falls on level ground


def lit(height: Floats, soft: float) -> Floats:
    """Light on a surface, 1 on level ground, shape (rows, columns) as its height [samples].

    `soft` is the standard deviation of the blur that rounds edges [samples].
    """
    smooth = cv2.GaussianBlur(height, (0, 0), soft)
    right = cv2.Sobel(smooth, cv2.CV_32F, 1, 0, ksize=3, scale=0.125)
    down = cv2.Sobel(smooth, cv2.CV_32F, 0, 1, ksize=3, scale=0.125)
    straight = (SUN[2] - SUN[0] * right - SUN[1] * down) / np.sqrt(1 + right * right + down * down)
    return np.asarray(AMBIENT + (1 - AMBIENT) / SUN[2] * np.maximum(straight, 0), np.float32)


def shade(
    canvas: Floats, cover: Floats, shift: tuple[int, int], soft: float, darkness: float
) -> None:
    """Darken a canvas, in place, where something that covers a part of it takes the light.

    The shadow lies to the right and below by `shift`, which is not 0; `soft` is the standard
    deviation of its edge [samples], `darkness` what is taken in full shade.
    """
    right, down = shift
    thrown = np.zeros_like(cover)
    thrown[down:, right:] = cover[:-down, :-right]
    kept = 1 - np.float32(darkness) * np.asarray(cv2.GaussianBlur(thrown, (0, 0), soft), np.float32)
    canvas *= kept[..., None]


def moulded(
    balls: NDArray[np.float64],
    corner: tuple[float, float],
    step: float,
    shape: tuple[int, ...],
    ground: float = 0.0,
) -> tuple[Floats, NDArray[np.int32]]:
    """Heights of balls that rise from the ground, and which is seen where (-1: none).

    `corner` is the left top one of the samples, which are `step` apart; see `mould`.
    """
    height, owner = np.full(shape, ground, np.float32), np.full(shape, -1, np.int32)
    mould(balls, *corner, step, height, owner)
    return height, owner


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
