"""Parts of a person as spans of rows, painted and blurred in integers.

A part is a band along a mostly upright centre line, round like a sleeve: in every row of the
picture it is a span. Moving sideways during the exposure turns the span's edges into ramps,
which is the exact average over the exposure. The texture that is wrapped around a part says
what is seen of it from any side. All arithmetic on pixels is on integers.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["AROUND", "COLUMNS", "ROWS", "cover_part", "paint_part"]

COLUMNS = 5
"""Of a part's nodes, from the top: row, centre, half width, blur, and row of the texture."""

ROWS = 128
"""Rows of a texture, from a part's upper end to its lower one."""

AROUND = 256
"""Columns of a texture, once around the part; column 0 is its front."""

_ANGLES = np.round(np.arcsin(np.arange(-256, 257) / 256) / (2 * np.pi) * AROUND).astype(np.int64)
_FACING = np.sqrt(1 - (np.arange(-256, 257) / 257) ** 2)
_SHADES = np.round(256 * (0.60 + 0.44 * _FACING - 0.10 * np.arange(-256, 257) / 256)).astype(
    np.int64
)


@njit(cache=True)
def _row_span(nodes: NDArray[np.int64], y: int) -> tuple[int, int, int, int, int]:
    """Centre, half width and blur [1/64 pixel], texture row, coverage [1/256] of a row."""
    top, bottom = nodes[0, 0], nodes[-1, 0]
    inside = min((y + 1) << 6, bottom) - max(y << 6, top)
    if inside <= 0:
        return 0, 0, 64, 0, 0
    middle = min(max((y << 6) + 32, top), bottom - 1)
    k = 0
    while k + 2 < len(nodes) and nodes[k + 1, 0] <= middle:
        k += 1
    length = max(nodes[k + 1, 0] - nodes[k, 0], 1)
    share = ((middle - nodes[k, 0]) << 10) // length
    centre = nodes[k, 1] + (((nodes[k + 1, 1] - nodes[k, 1]) * share) >> 10)
    half = nodes[k, 2] + (((nodes[k + 1, 2] - nodes[k, 2]) * share) >> 10)
    blur = nodes[k, 3] + (((nodes[k + 1, 3] - nodes[k, 3]) * share) >> 10)
    row = nodes[k, 4] + (((nodes[k + 1, 4] - nodes[k, 4]) * share) >> 10)
    return centre, max(half, 8), max(blur, 64), row, inside * 4


@njit(cache=True)
def _covered(x: int, centre: int, half: int, ramp: int) -> int:
    """Part of a pixel column that a span covers, [1/256]; its edges are `ramp` wide."""
    distance = half - abs((x << 6) + 32 - centre)
    value = ((2 * distance + ramp) << 7) // ramp
    # A span narrower than its ramp never covers all of a pixel.
    return min(max(value, 0), 256, (half << 9) // ramp)


@njit(cache=True)
def paint_part(
    canvas: NDArray[np.uint8],
    nodes: NDArray[np.int64],
    texture: NDArray[np.uint8],
    front: int,
    gains: NDArray[np.int64],
) -> None:
    """Paint a part over a canvas.

    Parameters
    ----------
    canvas : ndarray of uint8, shape (height, width, 3)
        Changed in place.
    nodes : ndarray of int64, shape (k, COLUMNS)
        See `COLUMNS`; in 1/64 pixel, texture rows in 1/64 too; rows increase.
    texture : ndarray of uint8, shape (ROWS, AROUND, 3)
        What is wrapped around.
    front : int
        Texture column that faces the camera.
    gains : ndarray of int64, shape (height,)
        Light of every row, times 256.
    """
    height, width = canvas.shape[:2]
    for y in range(max(nodes[0, 0] >> 6, 0), min((nodes[-1, 0] >> 6) + 1, height)):
        centre, half, ramp, row, inside = _row_span(nodes, y)
        if inside == 0:
            continue
        reach = half + (ramp >> 1)
        first, last = max((centre - reach) >> 6, 0), min(((centre + reach) >> 6) + 1, width)
        line = texture[min(max(row >> 6, 0), ROWS - 1)]
        for x in range(first, last):
            cover = (_covered(x, centre, half, ramp) * inside) >> 8
            if cover == 0:
                continue
            u = min(max((((x << 6) + 32 - centre) << 8) // half, -256), 256) + 256
            around = (_ANGLES[u] + front) & (AROUND - 1)
            light = _SHADES[u] * gains[y]
            for c in range(3):
                value = min((line[around, c] * light) >> 16, 255)
                canvas[y, x, c] += ((value - canvas[y, x, c]) * cover + 128) >> 8


@njit(cache=True)
def cover_part(coverage: NDArray[np.uint8], nodes: NDArray[np.int64], left: int, top: int) -> None:
    """Add a part's coverage at mid-exposure to a silhouette whose corner is (left, top)."""
    height, width = coverage.shape
    for row in range(height):
        centre, half, _, _, inside = _row_span(nodes, row + top)
        if inside == 0:
            continue
        first = max(((centre - half - 32) >> 6) - left, 0)
        last = min(((centre + half + 32) >> 6) + 1 - left, width)
        for x in range(first, last):
            cover = (_covered(x + left, centre, half, 64) * inside) >> 8
            if cover > 0:
                kept = (255 - np.int64(coverage[row, x])) * (256 - cover)
                coverage[row, x] = 255 - (kept >> 8)
