"""Snake (active contour; Kass, Witkin & Terzopoulos 1988) that moves a contour to image edges."""

from functools import lru_cache
from math import ceil, floor

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from trackmark.trackers.base.arrays import Array
from trackmark.trackers.base.interface import Image
from trackmark.trackers.contours.outline import bounding_box, crosses_itself, enclosed_area

ELASTICITY, RIGIDITY = 0.08, 0.6  # α and β of points `SPACING` apart
SPACING = 4.4  # mean distance of 32 points on ellipses with half axes of 11 to 34 [pixels]
STEP = 1.0  # γ; smaller values give larger steps
ATTRACTION = 3.0  # κ
ITERATIONS = 40
MARGIN = 14  # margin around a contour in which edges are computed [pixels]
MIN_AREA_RATIO, MAX_AREA_RATIO = 0.5, 2.0  # limits of area / initial area of an accepted snake


def refine_by_snake(
    contour: Array, image: Image, posterior: NDArray[np.float32] | None
) -> tuple[Array, bool]:
    """Return the snake's contour and True, or the input contour and False if it is rejected.

    The weights of the snake apply to derivatives along the contour, as defined by Kass et al. So
    the snake does not depend on the distance of the points. It shrinks a closed contour until edges
    stop it: a contour that starts at the true one loses 3 to 5 % of its area. The snake's contour
    is accepted if it does not cross itself and its area is 0.5 to 2 times the area of the input
    contour.

    `contour` float64 (points, 2): initial contour [pixels].
    `image` uint8 (height, width, 3): BGR image.
    `posterior` float32 (height, width), or None: posterior of the target in [0, 1]; only edges of
      both image and posterior attract the snake. With None, all edges of the image do.
    """
    left, top, width, height = bounding_box(contour).tolist()
    x, y = max(floor(left) - MARGIN, 0), max(floor(top) - MARGIN, 0)
    near = np.s_[y : max(ceil(top + height) + MARGIN, 0), x : max(ceil(left + width) + MARGIN, 0)]
    if min(image[near].shape[:2]) < 2:  # a gradient takes two pixels
        return contour, False
    edges = edge_map(image[near], None if posterior is None else posterior[near])
    sides = np.linalg.norm(np.diff(contour, axis=0, append=contour[:1]), axis=1)
    ratio = SPACING / max(float(sides.mean()), 1.0)
    snake = fit_snake(contour, edges, (x, y), ELASTICITY * ratio**2, RIGIDITY * ratio**4)
    area = enclosed_area(contour)
    if not MIN_AREA_RATIO * area <= enclosed_area(snake) <= MAX_AREA_RATIO * area or crosses_itself(
        snake
    ):
        return contour, False
    return snake, True


def edge_map(image: Image, posterior: NDArray[np.float32] | None) -> Array:
    """Return the edge strength of each pixel, scaled to a maximum of 1 (0 without edges).

    With a `posterior` (height, width), edge strength is the product of the gradient magnitudes of
    image and posterior.
    """
    slopes = _gradient(image.astype(np.float32), 1.2)
    if posterior is not None:
        slopes *= _gradient(posterior.astype(np.float32), 2.0)
    edges = cv2.GaussianBlur(slopes, (0, 0), 1.5).astype(np.float64)
    strongest = edges.max()
    return edges / strongest if strongest > 0 else edges


def _gradient(values: NDArray[np.float32], sigma: float) -> NDArray[np.float32]:
    """Return the gradient magnitude of smoothed values, over all channels."""
    smooth = cv2.GaussianBlur(values, (0, 0), sigma)
    across, down = (cv2.Sobel(smooth, -1, *order, scale=1 / 8) for order in ((1, 0), (0, 1)))
    squared = across * across + down * down
    return np.sqrt(squared if squared.ndim == 2 else np.einsum("ijk->ij", squared))


def fit_snake(
    contour: Array,
    edges: Array,
    origin: tuple[int, int],
    elasticity: float = ELASTICITY,
    rigidity: float = RIGIDITY,
    step: float = STEP,
    attraction: float = ATTRACTION,
    iterations: int = ITERATIONS,
) -> Array:
    """Return a closed contour (points, 2) after snake steps p ← (A + γ I)⁻¹ (γ p + f(p)).

    `contour` float64 (points, 2): initial contour [pixels].
    `edges` float64 (rows, columns): edge strength in a window, at least two pixels per side.
    `origin`: first column and row of the window.
    `elasticity`, `rigidity`: weights α and β of first and second differences in A.
    `step`: γ; smaller values give larger steps.
    `attraction`: κ; f is κ times the edges' gradient, interpolated linearly, at most one pixel.
    `iterations`: number of steps.
    """
    down, across = np.gradient(edges)
    force = attraction * np.stack([across, down])
    smoothing = _smoothing(len(contour), elasticity, rigidity, step)
    corner = np.array(origin) + 0.5
    snake: Array = _iterate(contour - corner, force, smoothing, step, iterations)
    return snake + corner


@lru_cache(maxsize=8)
def _smoothing(points: int, elasticity: float, rigidity: float, step: float) -> Array:
    """Return (A + γ I)⁻¹ by its eigenvalues, because A is circulant."""
    differences = 2 - 2 * np.cos(2 * np.pi * np.arange(points // 2 + 1) / points)
    eigenvalues = elasticity * differences + rigidity * differences**2 + step
    column = np.fft.irfft(1 / eigenvalues, points)
    i = np.arange(points)
    inverse: Array = column[(i[:, None] - i) % points]
    inverse.flags.writeable = False
    return inverse


@njit(cache=True)
def _iterate(start: Array, force: Array, smoothing: Array, step: float, iterations: int) -> Array:
    """Return the points after snake steps."""
    _, rows, columns = force.shape
    n = len(start)
    points = start.copy()
    pulled = np.empty_like(points)
    for _ in range(iterations):
        for i in range(n):
            x = min(max(points[i, 0], 0.0), columns - 1.0)
            y = min(max(points[i, 1], 0.0), rows - 1.0)
            column, row = min(int(x), columns - 2), min(int(y), rows - 2)
            across = _interpolate(force[0], row, column, y - row, x - column)
            down = _interpolate(force[1], row, column, y - row, x - column)
            length = max(np.hypot(across, down), 1.0)
            pulled[i, 0] = step * points[i, 0] + across / length
            pulled[i, 1] = step * points[i, 1] + down / length
        for i in range(n):
            x, y = 0.0, 0.0
            for j in range(n):
                x += smoothing[i, j] * pulled[j, 0]
                y += smoothing[i, j] * pulled[j, 1]
            points[i, 0], points[i, 1] = x, y
    return points


@njit(cache=True)
def _interpolate(values: Array, row: int, column: int, below: float, right: float) -> float:
    """Interpolate linearly between four pixels."""
    upper = (1 - right) * values[row, column] + right * values[row, column + 1]
    lower = (1 - right) * values[row + 1, column] + right * values[row + 1, column + 1]
    between: float = (1 - below) * upper + below * lower
    return between
