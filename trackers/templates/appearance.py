"""Robust adaptive Kalman filter per template pixel, and the features of pixels.

Nguyen & Smeulders 2002, sections 2.2, 2.3 and 3. All pixels share the same covariances. The
features of a pixel are its intensity, its colour or colour ratios that do not depend on the light.
"""

from collections import deque
from math import atan, ceil, floor
from typing import Any, Literal, NamedTuple, TypeAlias

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.linalg.lapack import dgetrf, dgetri, dsyevd
from scipy.special import chdtri

from trackmark.trackers.base.arrays import Array
from trackmark.trackers.base.interface import Image

N_PASSES = 6  # iterations of: inliers by the covariance, then covariance of the inliers


class TemplateComparison(NamedTuple):
    """Residuals of a frame at the pose of the template."""

    features: Array  # (height, width, d): f
    outliers: NDArray[np.bool_]  # (height, width)
    share: float  # share of outliers, in [0, 1]
    covariance: Array  # (d, d): R of the inliers (equation 13), raised to the floor


def raise_eigenvalues(matrix: Array, minimum: float) -> Array:
    """Return a symmetric matrix with eigenvalues below `minimum` replaced by it."""
    symmetric = (matrix + matrix.T) / 2
    values, vectors, _ = dsyevd(symmetric, lower=1)  # np.linalg is slower for small matrices
    if values[0] >= minimum:
        return symmetric
    raised: Array = np.dot(vectors * np.maximum(values, minimum), np.ascontiguousarray(vectors.T))
    return raised


class TemplateFilter:
    """Template of filtered pixels, with the covariances that all filters share.

    The noise is estimated from the second view: the features at the pose in the next frame.

    `parameters`: those of `nguyen2002`.
    `features` float64 (height, width, d): first view of the target.

    `limit`: squared Mahalanobis distance from which a pixel is an outlier.
    `patience`: number of consecutive outlier frames after which a pixel takes its new value.

    `template` float64 (height, width, d): filtered features g.
    `residual` float64 (d, d): covariance of residuals, averaged over K frames (equation 12); an
      initial guess before `start`.
    `state`, `measurement` float64 (d, d): noise covariances C_w and C_f.
    """

    def __init__(self, parameters: Any, features: Array) -> None:
        self._parameters = parameters
        self.limit = float(chdtri(features.shape[2], 1 - parameters.delta))
        # Rounded, because 0.3 / 0.05 < 6 in floating point.
        maximum = round(parameters.gamma / parameters.minimal_speed, 9)
        exceeds = parameters.outlier_rule == "exceeds"
        self.patience: int = np.iinfo(np.int64).max
        if parameters.rebootstrap:
            self.patience = floor(maximum) + 1 if exceeds else ceil(maximum)
        self._floor = FLOORS[parameters.features]
        self._components = tuple(range(features.shape[2]))
        self.reset(features)
        zero = np.zeros((features.shape[2],) * 2)
        self.state, self.measurement, self._estimate = zero, zero, zero

    def reset(self, features: Array) -> None:
        """Replace the template by a first view; the noise is unknown until `start`."""
        self.template = features.copy()
        self._outlying = np.zeros(features.shape[:2], np.int64)
        variances = self._parameters.first_spread**2 * features.var(axis=(0, 1))
        self.residual = np.diag(np.maximum(variances, self._floor))
        self._history: deque[Array] = deque(maxlen=self._parameters.average)
        self.noise_known = False

    def reset_keeping_noise(self, features: Array) -> None:
        """Replace the template by a first view, with the noise of the first `start`."""
        first = 2 * self.measurement  # R(1), by equation 15
        self.reset(features)
        self._estimate, self.state = self.measurement, np.zeros_like(self.measurement)
        self._history.append(first)
        self.residual, self.noise_known = first, True

    def start(self, features: Array) -> None:
        """Estimate the noise from the second view (equation 15).

        R(1) is the covariance of all pixels, because outliers can only be found once R is known.
        With `first_covariance=inliers`, R(1) is the covariance of the inliers, computed repeatedly:
        inliers are selected first by the initial guess, then by the previous result.
        """
        covariance, trimmed = self.residual, self._parameters.first_covariance == "inliers"
        for _ in range(N_PASSES if trimmed else 1):
            comparison = self._compare_by(
                features, covariance, excludes_outliers=self._parameters.gate and trimmed
            )
            covariance = comparison.covariance
        self._history.append(covariance)
        self.residual, self.measurement = covariance, covariance / 2
        self._estimate, self.state = covariance / 2, np.zeros_like(covariance)
        self.noise_known = True

    def compare(self, features: Array) -> TemplateComparison:
        """Return the residuals of a view (height, width, d)."""
        return self._compare_by(features, self.residual, excludes_outliers=self._parameters.gate)

    def update(self, comparison: TemplateComparison, *, is_first: bool) -> None:
        """Update the template by a view (equations 8 to 14); `is_first`: the view of `start`."""
        parameters = self._parameters
        if not is_first:
            self._history.append(comparison.covariance)
            self.residual = np.asarray(sum(self._history) / len(self._history), np.float64)
        self.state, gain, self._estimate = _step(
            self.residual, self.measurement, self._estimate, self.state, parameters.adaptive_noise
        )
        _filter_pixels(
            self.template,
            self._components,
            comparison.features,
            comparison.outliers & parameters.gate,
            self._outlying,
            gain,
            self.patience,
        )

    def _compare_by(
        self, features: Array, covariance: Array, *, excludes_outliers: bool
    ) -> TemplateComparison:
        inverse = np.asarray(np.linalg.inv(covariance), np.float64)
        outliers = np.empty(features.shape[:2], np.bool_)
        products, inliers = _compare(
            features,
            self.template,
            self._components,
            inverse,
            self.limit,
            excludes_outliers,
            outliers,
        )
        share = float(np.count_nonzero(outliers) / outliers.size)
        mean = products / inliers if inliers else covariance
        return TemplateComparison(features, outliers, share, self._constrain(mean))

    def _constrain(self, covariance: Array) -> Array:
        if self._parameters.covariance == "diagonal":
            covariance = np.diag(np.diag(covariance))
        return raise_eigenvalues(covariance, self._floor)


def _step(
    residual: Array, measurement: Array, estimate: Array, state: Array, adaptive: bool
) -> tuple[Array, Array, Array]:
    """Return C_w, K and C_g of a frame (equations 8 to 10 and 14)."""
    if adaptive:
        state = raise_eigenvalues(residual - measurement - estimate, 0.0)
    predicted = estimate + state
    factors, pivots, _ = dgetrf(predicted + measurement)
    gain = predicted @ dgetri(factors, pivots)[0]
    return state, gain, raise_eigenvalues(predicted - gain @ predicted, 0.0)


@njit(cache=True)
def _compare(
    features: Array,
    template: Array,
    components: tuple[int, ...],
    inverse: Array,
    limit: float,
    excludes_outliers: bool,
    outliers: NDArray[np.bool_],
) -> tuple[Array, int]:
    """Fill `outliers`; return Σ r r' and the number of its pixels.

    These are the inliers if `excludes_outliers`, otherwise all pixels.
    """
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
            if outliers[i, j] and excludes_outliers:
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
    """Update g by equation 11: g + K r for inliers, f after `patience` outlier frames, or g."""
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
"""Minimum variance of a component of residuals: that of rounding to whole grey levels."""

_RATIOS = np.arange(256.0)[:, np.newaxis] / np.maximum(np.arange(256.0), 1.0)
_ANGLES = np.vectorize(atan)(_RATIOS)


def compute_features(image: Image, features: Features) -> Array:
    """Return the features of every pixel of a BGR image, float64 of shape (rows, columns, d).

    `intensity` is R + G + B; `rgb` is (R, G, B). `invariants` are the ratios c1 = R / max(G, B), c2
    = G / max(B, R) and c3 = B / max(R, G) (equation 18); a maximum of 0 counts as one grey level.
    `arctan` are their arc tangents, as defined by Gevers & Smeulders.
    """
    if features == "rgb":
        return cv2.cvtColor(image, cv2.COLOR_BGR2RGB).astype(np.float64)
    if features == "intensity":
        blue, green, red = (image[..., channel, np.newaxis] for channel in range(3))
        return np.add(np.add(blue, green, dtype=np.uint16), red).astype(np.float64)
    return _ratios(image, _RATIOS if features == "invariants" else _ANGLES)


@njit(cache=True)
def _ratios(image: Image, table: Array) -> Array:
    rows, columns, _ = image.shape
    features = np.empty((rows, columns, 3))
    for row in range(rows):
        for column in range(columns):
            blue, green, red = image[row, column, 0], image[row, column, 1], image[row, column, 2]
            features[row, column, 0] = table[red, max(green, blue)]
            features[row, column, 1] = table[green, max(blue, red)]
            features[row, column, 2] = table[blue, max(red, green)]
    return features
