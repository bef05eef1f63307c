"""Colour histograms of ellipses, the model that follows them, and what a coefficient means."""

from dataclasses import dataclass
from math import inf, log, pi, sqrt
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from trackers.base.sharing import SharedFrame
from trackers.histograms.bins import JointBins
from trackers.histograms.counting import ellipse_histograms
from trackers.histograms.ellipses import EllipseCounts, Kernel, coefficients

__all__ = ["Ellipses", "Likelihood", "Reading", "TargetModel"]

Reading: TypeAlias = Literal["density", "printed", "peak", "variance", "coefficient", "always"]


@dataclass(frozen=True)
class Likelihood:
    """π = f exp(-(1 - ρ) / 2σ²), of which the prefix f matters to the threshold alone.

    Nummiaro et al. 2003, equation 10, print f = 1 / √(2πσ), call σ a variance and divide by
    2σ²; equation 11 compares π with a threshold π_T. How that is read: 'density': f is
    1 / (√(2π) σ), the Gaussian of deviation σ. 'printed': as printed. 'peak': f = 1. 'variance': f
    as printed and 2σ in the place of 2σ², in the weights too. 'coefficient': ρ itself is compared.
    'always': nothing is.
    """

    sigma: float
    reading: Reading
    threshold: float

    @property
    def variance(self) -> float:
        """What stands in the place of σ²."""
        return self.sigma if self.reading == "variance" else self.sigma**2

    def log(self, coefficient: Any) -> Any:
        """Logarithm of π without its prefix, for ρ in [0, 1]: a number or an array."""
        return -(1.0 - coefficient) / (2.0 * self.variance)

    @property
    def least_coefficient(self) -> float:
        """The ρ above which π > π_T; infinite where no ρ is enough.

        Examples
        --------
        >>> round(Likelihood(0.1, "density", 0.9).least_coefficient, 4)
        0.9702
        """
        if self.reading == "always":
            return -inf
        if self.reading == "coefficient":
            return self.threshold
        printed = 1 / sqrt(2 * pi * self.sigma)
        peaks = {"peak": 1.0, "density": 1 / (sqrt(2 * pi) * self.sigma)}
        peak = peaks.get(self.reading, printed)
        if peak <= self.threshold:
            return inf
        return 1 - 2 * self.variance * log(peak / self.threshold)


Array = NDArray[np.float64]

LEAST_SHARE = 0.25  # of an ellipse inside the image, for it to look like anything


@dataclass(frozen=True)
class Ellipses:
    """How ellipses are looked at: bins and kernel."""

    colours: JointBins
    kernel: Kernel

    def counts(self, frame: SharedFrame, states: Array, bins: NDArray[np.int64]) -> EllipseCounts:
        """Count bins in states (n, 7); totals are 0 where less than a quarter is inside."""
        ellipses = states[:, [0, 1, 4, 5]]
        found = ellipse_histograms(frame, ellipses, self.kernel, self.colours, bins)
        least = LEAST_SHARE * pi * ellipses[:, 2] * ellipses[:, 3]
        return found._replace(totals=np.where(found.pixels >= least, found.totals, 0))

    def histogram(self, frame: SharedFrame, state: Array) -> Array | None:
        """Normalised histogram of a state (7,); None where less than a quarter is inside.

        Nummiaro et al. 2003, equations 3 and 4.
        """
        found = self.counts(frame, state[np.newaxis], np.arange(self.colours.n_bins))
        if found.totals[0] == 0:
            return None
        return np.asarray(found.counts[0] / found.totals[0])


class TargetModel:
    """Histogram that particles are compared with: one for all, or one for each.

    Parameters
    ----------
    first : ndarray of float64, shape (bins,)
        Normalised.
    particles, apart : int, bool
        Their number, and whether each has a model of its own.
    alpha : float
        Weight of a new histogram in an update.

    Attributes
    ----------
    first, current : ndarray of float64, shape (bins,)
        At the beginning and now; of models of their own the weighted mean.
    models : ndarray of float64, shape (particles, bins), or None
        Those of each particle, where they are apart.
    bins : ndarray of int64, shape (m,)
        The bins that must be counted in particles.
    """

    def __init__(self, first: Array, particles: int, apart: bool, alpha: float) -> None:
        self.first = self.current = first
        self._alpha = alpha
        self.models = np.tile(first, (particles, 1)) if apart else None
        self.bins = np.arange(len(first)) if apart else np.flatnonzero(first)

    def select(self, chosen: NDArray[np.intp]) -> None:
        """Let models go on with the particles that are chosen."""
        if self.models is not None:
            self.models = self.models[chosen]

    def forget(self) -> None:
        """Give all particles the current model."""
        if self.models is not None:
            self.models[:] = self.current

    def coefficients(self, found: EllipseCounts) -> Array:
        """Bhattacharyya coefficient of each particle, whose `bins` were counted, shape (n,)."""
        models = self.current[np.newaxis, self.bins] if self.models is None else self.models
        return coefficients(found.counts, found.totals, models)

    def first_coefficients(self, found: EllipseCounts) -> Array:
        """The same with the first model; its bins are among `bins` for good."""
        return coefficients(found.counts, found.totals, self.first[np.newaxis, self.bins])

    def update(
        self,
        histogram: Array | None,
        coefficient: float,
        found: EllipseCounts,
        weights: Array,
        least: float,
    ) -> float:
        """Mix in what was seen where that looks like the model (equations 11 and 12).

        Parameters
        ----------
        histogram : ndarray of float64, shape (bins,), or None
            That of the estimate; None where too little of it is in the image.
        coefficient : float
            That of this histogram and the current model.
        found, weights : EllipseCounts, ndarray of float64, shape (n,)
            Those of the particles.
        least : float
            Coefficient above which a histogram is mixed in.

        Returns
        -------
        float
            Share of the models that were updated, in [0, 1].
        """
        alpha = self._alpha
        if self.models is not None:
            chosen = (self.coefficients(found) > least) & (found.totals > 0)
            own = found.counts[chosen] / found.totals[chosen, np.newaxis]
            self.models[chosen] = (1 - alpha) * self.models[chosen] + alpha * own
            self.current = weights @ self.models
            return float(chosen.mean())
        if histogram is None or not coefficient > least:
            return 0.0
        self.current = (1 - alpha) * self.current + alpha * histogram
        self.bins = np.flatnonzero(self.first + self.current)
        return 1.0
