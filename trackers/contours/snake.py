"""A snake (Kass, Witkin & Terzopoulos 1988) that draws a contour to the edges around it."""

from functools import lru_cache
from math import ceil, floor
from typing import Literal, TypeAlias

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from trackmark.trackers.base.arrays import Array
from trackmark.trackers.base.interface import Image
from trackmark.trackers.contours.outline import bounding_box, crosses_itself, enclosed_area

Stiffness: TypeAlias = Literal["constant", "by-spacing", "of-change"]

ELASTICITY, RIGIDITY = 0.08, 0.6
SPACING = 4.4  # pixels between 32 points of an ellipse with half axes of 11 to 34, their mean
MARGIN = 14  # pixels around a contour in which edges are sought
LEAST, MOST = 0.5, 2.0  # times the area before, for a snake that is to be believed


def refine_by_snake(
    contour: Array,
    image: Image,
    posterior: NDArray[np.float32] | None,
    stiffness: Stiffness = "constant",
) -> tuple[Array, bool]:
    """The contour that a snake finds from a contour on, if it is to be believed; else what came in.

    Edges that the `posterior` of the target, (height, width) in [0, 1], does not show are none;
    without it, all are. The stiffness is `constant`: weights are of the differences between points,
    whatever their distance, so that the larger a contour, the more it shrinks and the rounder it
    gets; or `by-spacing`: of derivatives along the contour, the same where points are `SPACING`
    apart. Either draws a closed contour in, until edges hold it: from the true one, it ends at some
    3 to 5 % less area. `of-change`: the same derivatives, of how far points have gone from where
    they were; what is stiff is the change, and nothing draws the contour in.

    Says besides whether it is the snake: it does not cross itself and encloses between half and
    twice as much as before.
    """
    left, top, width, height = bounding_box(contour).tolist()
    x, y = max(floor(left) - MARGIN, 0), max(floor(top) - MARGIN, 0)
    near = np.s_[y : max(ceil(top + height) + MARGIN, 0), x : max(ceil(left + width) + MARGIN, 0)]
    if min(image[near].shape[:2]) < 2:  # a gradient takes two pixels
        return contour, False
    edges = edge_map(image[near], None if posterior is None else posterior[near])
    elasticity, rigidity = ELASTICITY, RIGIDITY
    if stiffness != "constant":
        sides = np.linalg.norm(np.diff(contour, axis=0, append=contour[:1]), axis=1)
        ratio = SPACING / max(float(sides.mean()), 1.0)
        elasticity, rigidity = elasticity * ratio**2, rigidity * ratio**4
    at_rest = stiffness == "of-change"
    snake = fit_snake(contour, edges, (x, y), elasticity, rigidity, at_rest=at_rest)
    area = enclosed_area(contour)
    if not LEAST * area <= enclosed_area(snake) <= MOST * area or crosses_itself(snake):
        return contour, False
    return snake, True


def edge_map(image: Image, posterior: NDArray[np.float32] | None) -> Array:
    """How strong the edges at each pixel are, in [0, 1]; the strongest is 1 where there is one.

    Edges of the map `posterior`, of the image's height and width, must support those of the image:
    the gradients' magnitudes are multiplied.
    """
    slopes = _gradient(image.astype(np.float32), 1.2)
    if posterior is not None:
        slopes *= _gradient(posterior.astype(np.float32), 2.0)
    edges = cv2.GaussianBlur(slopes, (0, 0), 1.5).astype(np.float64)
    strongest = edges.max()
    return edges / strongest if strongest > 0 else edges


def _gradient(values: NDArray[np.float32], sigma: float) -> NDArray[np.float32]:
    """Magnitude of the gradient of smoothed values, over all channels."""
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
    step: float = 1.0,
    attraction: float = 3.0,
    iterations: int = 40,
    at_rest: bool = False,
) -> Array:
    """A closed snake after some steps, p ← (A + γ I)⁻¹ (γ p + f(p)), from a contour (points, 2) on.

    `edges` are those of a window of the image, at least two pixels either way, whose first column
    and row are `origin`. A holds the weights α and β of the first and the second differences
    (`elasticity`, `rigidity`); γ is `step`: the smaller, the larger the steps. f is κ
    (`attraction`) times the gradient of the edges, interpolated linearly, and one pixel at most.
    Where the contour is `at_rest`, A holds those of the differences from it.
    """
    down, across = np.gradient(edges)
    force = attraction * np.stack([across, down])
    smoothing = _smoothing(len(contour), elasticity, rigidity, step)
    corner = np.array(origin) + 0.5
    start = contour - corner
    kept = start - step * (smoothing @ start) if at_rest else np.zeros_like(start)
    snake: Array = _iterated(start, force, smoothing, kept, step, iterations)
    return snake + corner


@lru_cache(maxsize=8)
def _smoothing(points: int, elasticity: float, rigidity: float, step: float) -> Array:
    """(A + γ I)⁻¹, from the eigenvalues: A is circulant."""
    differences = 2 - 2 * np.cos(2 * np.pi * np.arange(points // 2 + 1) / points)
    eigenvalues = elasticity * differences + rigidity * differences**2 + step
    column = np.fft.irfft(1 / eigenvalues, points)
    i = np.arange(points)
    inverse: Array = column[(i[:, None] - i) % points]
    inverse.flags.writeable = False
    return inverse


@njit(cache=True)
def _iterated(
    start: Array, force: Array, smoothing: Array, kept: Array, step: float, iterations: int
) -> Array:
    """`kept` (points, 2) is what is added after every smoothing."""
    _, rows, columns = force.shape
    n = len(start)
    points = start.copy()
    pulled = np.empty_like(points)
    for _ in range(iterations):
        for i in range(n):
            x = min(max(points[i, 0], 0.0), columns - 1.0)
            y = min(max(points[i, 1], 0.0), rows - 1.0)
            column, row = min(int(x), columns - 2), min(int(y), rows - 2)
            across = _between(force[0], row, column, y - row, x - column)
            down = _between(force[1], row, column, y - row, x - column)
            length = max(np.hypot(across, down), 1.0)
            pulled[i, 0] = step * points[i, 0] + across / length
            pulled[i, 1] = step * points[i, 1] + down / length
        for i in range(n):
            x, y = kept[i]
            for j in range(n):
                x += smoothing[i, j] * pulled[j, 0]
                y += smoothing[i, j] * pulled[j, 1]
            points[i] = x, y
    return points


@njit(cache=True)
def _between(values: Array, row: int, column: int, below: float, right: float) -> float:
    """Linear interpolation among four pixels."""
    upper = (1 - right) * values[row, column] + right * values[row, column + 1]
    lower = (1 - right) * values[row + 1, column] + right * values[row + 1, column + 1]
    between: float = (1 - below) * upper + below * lower
    return between
