"""Solids, and things made of them.

Lengths are in pixels of the picture: x to the right, y up, z towards the camera. A row of
numbers is a solid; a thing is a list of solids, which can run together smoothly.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["BOWL", "BOX", "HALF_SPACE", "LIMB", "bowl", "box", "half_space", "limb", "packed"]

Array = NDArray[np.float64]

HALF_SPACE, LIMB, BOX, BOWL = range(4)
"""Kinds of solids: the first of their numbers."""


def half_space(normal: Sequence[float], reach: float) -> Array:
    """All that lies behind a plane, `reach` beyond the origin."""
    return _solid(HALF_SPACE, 0.0, *normal, reach)


def limb(start: ArrayLike, end: ArrayLike, radii: tuple[float, float], blend: float = 0.0) -> Array:
    """Ball at either end and all between them; `blend` is how far it runs into its thing."""
    a, b = np.asarray(start, np.float64), np.asarray(end, np.float64)
    return _solid(LIMB, blend, *a, *b, *radii)


def box(
    middle: ArrayLike,
    half: ArrayLike,
    rounding: float,
    turn: float = 0.0,
    lean: float = 0.0,
    folds: tuple[float, float] = (0.0, 0.0),
) -> Array:
    """Box with round edges.

    Parameters
    ----------
    middle, half : array of float64, shape (3,)
        Its middle, and half its width, height and depth [pixels].
    rounding : float
        Radius of the edges [pixels].
    turn, lean : float
        About the upright axis, then backwards [radians].
    folds : tuple of float
        Depth of upright folds in it [pixels], and how fast they follow one another
        [radians/pixel].
    """
    centre, size = np.asarray(middle, np.float64), np.asarray(half, np.float64) - rounding
    turned = np.cos(turn), np.sin(turn), np.cos(lean), np.sin(lean)
    return _solid(BOX, 0.0, *centre, *size, rounding, *turned, *folds)


def bowl(
    foot: ArrayLike, height: float, radii: tuple[float, float], wall: float, closed: bool = False
) -> Array:
    """Round vessel, its radii below and above to the middle of the wall; a lid closes it."""
    base = np.asarray(foot, np.float64)
    return _solid(BOWL, 0.0, *base, height, *radii, wall / 2, float(closed))


def _solid(kind: int, blend: float, *numbers: float) -> Array:
    row = np.zeros(16)
    row[[0, 2]] = kind, blend
    row[3 : 3 + len(numbers)] = numbers
    return row


def packed(things: Sequence[Sequence[Array]]) -> tuple[Array, Array]:
    """Things in two arrays, as rays meet them.

    Returns
    -------
    solids : ndarray of float64, shape (s, 16)
        Those of the first thing, then those of the next, ….
    balls : ndarray of float64, shape (t, 6)
        Middle and radius of a ball that holds the thing [pixels], its first solid, and the one
        after its last.
    """
    counts = np.array([len(thing) for thing in things])
    ends = np.cumsum(counts)
    balls = np.column_stack([np.stack([_ball(thing) for thing in things]), ends - counts, ends])
    return np.array([solid for thing in things for solid in thing]), balls


def _ball(thing: Sequence[Array]) -> Array:
    """Middle and radius of a ball that holds a thing, shape (4,) [pixels]."""
    lows, highs = zip(*(_bounds(solid) for solid in thing), strict=True)
    low, high = np.min(lows, axis=0), np.max(highs, axis=0)
    return np.append((low + high) / 2, np.sqrt(np.sum((high - low) ** 2)) / 2)


def _bounds(solid: Array) -> tuple[Array, Array]:
    """Corners of an upright box that holds a solid, its blends and folds [pixels]."""
    middle = solid[3:6]
    if solid[0] == HALF_SPACE:
        return np.full(3, -1e4), np.full(3, 1e4)
    if solid[0] == LIMB:
        reach = max(solid[9:11]) + solid[2]
        return np.minimum(middle, solid[6:9]) - reach, np.maximum(middle, solid[6:9]) + reach
    if solid[0] == BOX:
        reach = np.sqrt(np.sum(solid[6:9] ** 2)) + solid[9] + 2 * solid[14]
        return middle - reach, middle + reach
    reach = max(solid[7:9]) + solid[9]
    low, high = middle - reach, middle + reach
    low[1], high[1] = middle[1] - solid[9], middle[1] + solid[6] + solid[9]
    return low, high
