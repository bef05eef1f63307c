"""A robust Kalman filter for every pixel of a template, and what it holds of a pixel.

Nguyen & Smeulders 2002, sections 2.2, 2.3 and 3. All filters have one set of covariances. A pixel
is intensity, colour, or what is left of colour in any light.
"""

from collections import deque
from math import atan
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from trackmark.trackers.base.arrays import Array
from trackmark.trackers.base.interface import Image

PASSES = 6  # how often a trimmed first covariance is made of the pixels that it calls inliers


class Noise(NamedTuple):
    """How residuals are taken to be distributed, and what follows from them."""

    limit: float  # squared Mahalanobis distance from which on a pixel is an outlier
    floor: float  # least eigenvalue of any covariance of residuals
    factor: float  # what a covariance of inliers is multiplied by
    first_spread: float  # deviation of the very first residuals, in those of the template itself
    trimmed: bool  # whether the first covariance is of inliers; else of all pixels
    grid_step: float  # of the search, for which the first covariance makes up; 0: none [pixels]
    average: int  # K, frames that the covariance is averaged over
    full: bool  # whether components are correlated
    adaptive: bool  # whether the state's noise follows the residuals (equation 14), or stays 0
    gate: bool  # whether outliers are kept out
    patience: int  # frames in succession after which an outlier is taken as it is


class Seen(NamedTuple):
    """A template's pixels in a frame, compared with the template."""

    features: Array  # (height, width, d): f
    outliers: NDArray[np.bool_]  # (height, width)
    share: float  # of outliers, in [0, 1]
    covariance: Array  # (d, d): R of the inliers (equation 13), raised to the floor


@njit(cache=True)
def raised(matrix: Array, floor: float) -> Array:
    """The symmetric matrix with no eigenvalue below a floor, otherwise the same."""
    symmetric = (matrix + matrix.T) / 2
    values, vectors = np.linalg.eigh(symmetric)
    if values[0] >= floor:
        return symmetric
    held: Array = np.dot(vectors * np.maximum(values, floor), np.ascontiguousarray(vectors.T))
    return held


class Appearance:
    """Template g of all pixels, (height, width, d), and the covariances (d, d) of its filters.

    It begins with a first view, `features` (height, width, d); the second view (`start`) says how
    noisy views are. `residual` is the covariance that residuals are measured by: the mean of the
    last ones (equation 12), before the second view a guess. `state` and `measurement` are C_w and
    C_f.
    """

    def __init__(self, noise: Noise, features: Array) -> None:
        self._noise = noise
        self._components = tuple(range(features.shape[2]))
        self.take(features)
        zero = np.zeros((features.shape[2],) * 2)
        self.state, self.measurement, self._estimate = zero, zero, zero

    def take(self, features: Array) -> None:
        """Begin anew with a first view."""
        self.template = features.copy()
        self._outlying = np.zeros(features.shape[:2], np.int64)
        variances = self._noise.first_spread**2 * features.var(axis=(0, 1))
        self.residual = np.diag(np.maximum(variances, self._noise.floor))
        self._history: deque[Array] = deque(maxlen=self._noise.average)
        self.started = False

    def take_keeping_noise(self, features: Array) -> None:
        """Begin anew with a first view, residuals being as after the very first one."""
        first = 2 * self.measurement  # R(1), by equation 15
        self.take(features)
        self._estimate, self.state = self.measurement, np.zeros_like(self.measurement)
        self._history.append(first)
        self.residual, self.started = first, True

    def start(self, features: Array) -> None:
        """Learn from the second view how noisy views are (equation 15).

        There is no R yet, so that no pixel is an outlier: R(1) is the covariance of all. Trimmed,
        it is that of the inliers, which are told by the guess first, then by what came of it.
        """
        covariance, trimmed = self.residual, self._noise.trimmed
        for _ in range(PASSES if trimmed else 1):
            seen = self._compared(features, covariance, gate=self._noise.gate and trimmed)
            covariance = seen.covariance
        if self._noise.grid_step > 0:
            down, across = np.gradient(self.template, axis=(0, 1))
            slopes = np.concatenate([down, across]).reshape(-1, features.shape[2])
            spread = slopes.T @ slopes / self._outlying.size
            covariance = self._shaped(covariance + self._noise.grid_step**2 / 6 * spread)
        self._history.append(covariance)
        self.residual, self.measurement = covariance, covariance / 2
        self._estimate, self.state = covariance / 2, np.zeros_like(covariance)
        self.started = True

    def seen(self, features: Array) -> Seen:
        """Compare a view with the template."""
        return self._compared(features, self.residual, gate=self._noise.gate)

    def update(self, seen: Seen, *, first: bool) -> None:
        """Filter a view into the template (equations 8 to 14); `first` is that of `start`."""
        noise = self._noise
        if not first:
            self._history.append(seen.covariance)
            self.residual = np.asarray(sum(self._history) / len(self._history), np.float64)
        self.state, gain, self._estimate = _step(
            self.residual, self.measurement, self._estimate, self.state, noise.adaptive
        )
        _filter_pixels(
            self.template,
            self._components,
            seen.features,
            seen.outliers & noise.gate,
            self._outlying,
            gain,
            noise.patience,
        )

    def _compared(self, features: Array, covariance: Array, *, gate: bool) -> Seen:
        inverse = np.asarray(np.linalg.inv(covariance), np.float64)
        outliers = np.empty(features.shape[:2], np.bool_)
        products, inliers = _compare(
            features, self.template, self._components, inverse, self._noise.limit, gate, outliers
        )
        share = float(np.count_nonzero(outliers) / outliers.size)
        factor = self._noise.factor if gate else 1.0
        mean = products / inliers * factor if inliers else covariance
        return Seen(features, outliers, share, self._shaped(mean))

    def _shaped(self, covariance: Array) -> Array:
        if not self._noise.full:
            covariance = np.diag(np.diag(covariance))
        return raised(covariance, self._noise.floor)


@njit(cache=True)
def _step(
    residual: Array, measurement: Array, estimate: Array, state: Array, adaptive: bool
) -> tuple[Array, Array, Array]:
    """C_w, K and C_g of a frame (equations 8 to 10 and 14)."""
    if adaptive:
        state = raised(residual - measurement - estimate, 0.0)
    predicted = estimate + state
    gain = np.dot(predicted, np.linalg.inv(predicted + measurement))
    return state, gain, raised(predicted - np.dot(gain, predicted), 0.0)


@njit(cache=True)
def _compare(
    features: Array,
    template: Array,
    components: tuple[int, ...],
    inverse: Array,
    limit: float,
    gate: bool,
    outliers: NDArray[np.bool_],
) -> tuple[Array, int]:
    """Fill `outliers`; return the sum of r r' over the others, or all without `gate`, and n."""
    height, width, _ = template.shape
    d = len(components)
    products = np.zeros((d, d))
    residual = np.empty(d)
    inliers = 0
    for i in range(height):
        for j in range(width):
            distance = 0.0
            for k in range(d):
                residual[k] = features[i, j, k] - template[i, j, k]
            for k in range(d):
                for m in range(d):
                    distance += residual[k] * inverse[k, m] * residual[m]
            outliers[i, j] = not distance < limit
            if outliers[i, j] and gate:
                continue
            inliers += 1
            for k in range(d):
                for m in range(d):
                    products[k, m] += residual[k] * residual[m]
    return products, inliers


@njit(cache=True)
def _filter_pixels(
    template: Array,
    components: tuple[int, ...],
    features: Array,
    outliers: NDArray[np.bool_],
    outlying: NDArray[np.int64],
    gain: Array,
    patience: int,
) -> None:
    """Equation 11: g + K r for inliers, f for what has been an outlier for too long, else g."""
    height, width, _ = template.shape
    d = len(components)
    residual = np.empty(d)
    for i in range(height):
        for j in range(width):
            if not outliers[i, j]:
                outlying[i, j] = 0
                for k in range(d):
                    residual[k] = features[i, j, k] - template[i, j, k]
                for k in range(d):
                    for m in range(d):
                        template[i, j, k] += gain[k, m] * residual[m]
                continue
            outlying[i, j] += 1
            if outlying[i, j] >= patience:
                outlying[i, j] = 0
                for k in range(d):
                    template[i, j, k] = features[i, j, k]


Features: TypeAlias = Literal["invariants", "arctan", "rgb", "intensity"]

FLOORS: dict[Features, float] = {"intensity": 3.0, "rgb": 1.0, "invariants": 1e-4, "arctan": 1e-4}
"""Least variance of any component of a residual: that of rounding to whole grey levels."""

_RATIOS = np.arange(256.0)[:, np.newaxis] / np.maximum(np.arange(256.0), 1.0)
_ANGLES = np.vectorize(atan)(_RATIOS)


def dimension(kind: Features) -> int:
    """Number d of components."""
    return 1 if kind == "intensity" else 3


def features_of(image: Image, kind: Features) -> Array:
    """Features of every pixel of a BGR image, float64 of shape (rows, columns, d).

    `intensity` is R + G + B; `rgb` is (R, G, B); `invariants` are the ratios c1 = R / max(G, B),
    c2 = G / max(B, R) and c3 = B / max(R, G) (equation 18), a largest of 0 counting as one grey
    level; `arctan` are their arc tangents, as Gevers & Smeulders define them.
    """
    if kind == "intensity":
        return _intensities(image)
    if kind == "rgb":
        return _colours(image)
    return _ratios(image, _RATIOS if kind == "invariants" else _ANGLES)


@njit(cache=True)
def _intensities(image: Image) -> Array:
    rows, columns, _ = image.shape
    found = np.empty((rows, columns, 1))
    for row in range(rows):
        for column in range(columns):
            blue, green, red = image[row, column, 0], image[row, column, 1], image[row, column, 2]
            found[row, column, 0] = float(blue) + float(green) + float(red)
    return found


@njit(cache=True)
def _colours(image: Image) -> Array:
    rows, columns, _ = image.shape
    found = np.empty((rows, columns, 3))
    for row in range(rows):
        for column in range(columns):
            for channel in range(3):
                found[row, column, channel] = image[row, column, 2 - channel]
    return found


@njit(cache=True)
def _ratios(image: Image, table: Array) -> Array:
    rows, columns, _ = image.shape
    found = np.empty((rows, columns, 3))
    for row in range(rows):
        for column in range(columns):
            blue, green, red = image[row, column, 0], image[row, column, 1], image[row, column, 2]
            found[row, column, 0] = table[red, max(green, blue)]
            found[row, column, 1] = table[green, max(blue, red)]
            found[row, column, 2] = table[blue, max(red, green)]
    return found
