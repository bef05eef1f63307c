"""The template's filters: one for each pixel, with the same covariances (equations 5 to 15)."""

import numpy as np
from numpy.typing import NDArray

from bench.papers.nguyen2002.plain.settings import Settings

__all__ = ["Appearance", "raise_eigenvalues"]

Array = NDArray[np.float64]


def raise_eigenvalues(matrix: Array, least: float) -> Array:
    """The matrix made symmetric, with its eigenvalues raised to the least allowed."""
    values, vectors = np.linalg.eigh((matrix + matrix.T) / 2)
    return np.asarray(vectors @ np.diag(np.maximum(values, least)) @ vectors.T)


class Appearance:
    """Template g and all that is known of its noise.

    Parameters
    ----------
    settings : Settings
    features : ndarray of float64, shape (height, width, d)
        What is seen first.

    Attributes
    ----------
    g : ndarray of float64, shape (height, width, d)
    n_o : ndarray of int64, shape (height, width)
        Frames in succession for which a pixel has been an outlier.
    r_bar, c_f, c_w, c_g : ndarray of float64, shape (d, d)
    r : list of ndarray
        R of all frames since the second one that was seen; empty before it.
    """

    def __init__(self, settings: Settings, features: Array) -> None:
        self._settings = settings
        self.g = features.copy()
        self.n_o = np.zeros(features.shape[:2], int)
        spread = settings.first_spread**2 * self.g.reshape(-1, settings.d).var(axis=0)
        self.r_bar = np.diag(np.maximum(spread, settings.floor))
        self.c_f = self.c_w = self.c_g = np.zeros((settings.d, settings.d))
        self.r: list[Array] = []

    def outliers(self, features: Array, covariance: Array) -> NDArray[np.bool_]:
        """Which pixels' residuals are too large."""
        r = features - self.g
        q = np.einsum("ijk,km,ijm->ij", r, np.linalg.inv(covariance), r)
        return np.asarray(~(q < self._settings.limit))

    def residual_covariance(self, features: Array, covariance: Array) -> Array:
        """R of equation 13, over the pixels that are inliers by another covariance."""
        kept = np.full(self.n_o.shape, True)
        if self._settings.gate:
            kept = ~self.outliers(features, covariance)
        if not kept.any():
            return covariance
        r = (features - self.g)[kept]
        return self._shaped(r.T @ r / len(r) * self._settings.consistency_factor)

    def begin(self, features: Array) -> None:
        """Learn R(1) from what is seen second (equation 15)."""
        settings = self._settings
        r1 = self.r_bar
        for _ in range(6):
            r1 = self.residual_covariance(features, r1)
        if settings.misregistration:
            down, across = np.gradient(self.g, axis=(0, 1))
            both = np.einsum("ijk,ijm->km", down, down) + np.einsum("ijk,ijm->km", across, across)
            r1 = self._shaped(r1 + settings.step**2 / 6 * both / self.n_o.size)
        self.r, self.r_bar = [r1], r1
        self.c_f, self.c_g, self.c_w = 0.5 * r1, 0.5 * r1, np.zeros_like(r1)

    def begin_as_known(self, before: "Appearance") -> None:
        """Take R(1) and the measurement noise of an earlier template."""
        r1 = before.r[0]
        self.r, self.r_bar = [r1], r1
        self.c_f, self.c_g, self.c_w = 0.5 * r1, 0.5 * r1, np.zeros_like(r1)

    def share(self, features: Array) -> float:
        """Share of outliers (equation 16)."""
        return float(self.outliers(features, self.r_bar).mean())

    def update(self, features: Array) -> None:
        """Equations 7 to 14, for any view after the one of `begin`."""
        outliers = self.outliers(features, self.r_bar)
        self.r.append(self.residual_covariance(features, self.r_bar))
        last = self.r[-self._settings.average :]
        self.r_bar = np.asarray(sum(last) / len(last))
        if self._settings.adaptive_noise:
            self.c_w = raise_eigenvalues(self.r_bar - self.c_f - self.c_g, 0.0)
        self._filter(features, outliers)

    def update_first(self, features: Array) -> None:
        """Equations 7 to 11 for the view of `begin`: R is known, and C_w is 0."""
        self._filter(features, self.outliers(features, self.r_bar))

    def _filter(self, features: Array, outliers: NDArray[np.bool_]) -> None:
        if not self._settings.gate:
            outliers = np.full(outliers.shape, False)
        predicted = self.c_g + self.c_w
        gain = predicted @ np.linalg.inv(predicted + self.c_f)
        self.c_g = raise_eigenvalues(predicted - gain @ predicted, 0.0)
        for pixel in np.ndindex(outliers.shape):
            if not outliers[pixel]:
                self.g[pixel] += gain @ (features[pixel] - self.g[pixel])
                self.n_o[pixel] = 0
                continue
            self.n_o[pixel] += 1
            if self._settings.too_long(int(self.n_o[pixel])):
                self.g[pixel] = features[pixel]
                self.n_o[pixel] = 0

    def _shaped(self, covariance: Array) -> Array:
        if self._settings.covariance == "diagonal":
            covariance = np.diag(np.diag(covariance))
        return raise_eigenvalues(covariance, self._settings.floor)
