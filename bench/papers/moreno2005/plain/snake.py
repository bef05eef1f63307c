"""The snake that refines the mean contour (section 5.5, Fig. 6; Kass, Witkin & Terzopoulos)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates, sobel

from bench.papers.moreno2005.plain.contours import area, crosses_itself

__all__ = ["refined"]

Array = NDArray[np.float64]

ALPHA, BETA, GAMMA, KAPPA = 0.08, 0.6, 1.0, 3.0
ITERATIONS = 40
MARGIN = 14  # pixels around the contour
SPACING = 4.4  # pixels between points, to which α and β refer where they are by spacing


def refined(
    contour: Array, image: NDArray[np.uint8], posteriors: Array, settings: Any
) -> tuple[Array, bool]:
    """The snake, or the contour where that is not to be believed, and whether it is the snake."""
    height, width = image.shape[:2]
    left, top = np.maximum(np.floor(contour.min(axis=0)).astype(int) - MARGIN, 0)
    right, bottom = np.clip(np.ceil(contour.max(axis=0)).astype(int) + MARGIN, 0, [width, height])
    if min(right - left, bottom - top) < 2:
        return contour, False
    near = np.s_[top:bottom, left:right]
    f = _gradient(image[near].astype(float), 1.2)
    if settings.snake_edges == "supported":
        f *= _gradient(posteriors[near][..., np.newaxis], 2.0)
    f = gaussian_filter(f, 1.5, mode="mirror")
    if f.max() > 0:
        f /= f.max()

    alpha, beta = ALPHA, BETA
    if settings.snake_stiffness == "by-spacing":
        sides = np.linalg.norm(np.roll(contour, -1, axis=0) - contour, axis=1)
        ratio = SPACING / max(sides.mean(), 1)
        alpha, beta = alpha * ratio**2, beta * ratio**4
    snake = _iterated(contour - [left + 0.5, top + 0.5], f, alpha, beta) + [left + 0.5, top + 0.5]
    if crosses_itself(snake) or not 0.5 <= area(snake) / area(contour) <= 2:
        return contour, False
    return snake, True


def _gradient(values: Array, sigma: float) -> Array:
    """|∇ (G * values)| over all channels."""
    total = np.zeros(values.shape[:2])
    for channel in np.moveaxis(values, 2, 0):
        smooth = gaussian_filter(channel, sigma, mode="mirror")
        for axis in (0, 1):
            total += (sobel(smooth, axis, mode="mirror") / 8) ** 2
    return np.sqrt(total)


def _iterated(p: Array, f: Array, alpha: float, beta: float) -> Array:
    """Steps p ← (A + γ I)⁻¹ (γ p + f(p)), f being κ ∇F and one pixel at most."""
    i = np.eye(len(p))
    s = np.roll(i, 1, axis=1)
    a = alpha * (2 * i - s - s.T)
    a += beta * (s @ s - 4 * s + 6 * i - 4 * s.T + s.T @ s.T)
    down, across = np.gradient(f)
    for _ in range(ITERATIONS):
        pull = KAPPA * np.stack(
            [map_coordinates(g, p[:, ::-1].T, order=1, mode="nearest") for g in (across, down)],
            axis=1,
        )
        pull /= np.maximum(np.linalg.norm(pull, axis=1, keepdims=True), 1)
        p = np.asarray(np.linalg.solve(a + GAMMA * i, GAMMA * p + pull), np.float64)
    return p
