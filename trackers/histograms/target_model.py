"""Target model of elliptic particles: likelihood, model update and background similarity.

Nummiaro et al. 2003, equations 10 to 15: condition of a model update, and the threshold above which
a particle is more similar to the target than the background is (appearance condition).
"""

from dataclasses import dataclass
from math import inf, log, pi, sqrt
from typing import Any, Literal, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from trackmark.trackers.base.arrays import Array, Ints
from trackmark.trackers.base.sharing import SharedFrame
from trackmark.trackers.histograms.bins import JointBins
from trackmark.trackers.histograms.counting import count_ellipses
from trackmark.trackers.histograms.ellipses import EllipseCounts, Kernel, bhattacharyya_coefficients

Interpretation: TypeAlias = Literal[
    "density", "printed", "peak", "variance", "coefficient", "always"
]


@dataclass(frozen=True)
class Likelihood:
    """Likelihood π = f exp(-(1 - ρ) / 2σ²), where f only affects the update threshold.

    In equation 10, Nummiaro et al. 2003 print f = 1 / √(2πσ), call σ a variance and divide by 2σ².
    Equation 11 compares π with a threshold π_T before a model update. Interpretations: `density`
    sets f = 1 / (√(2π) σ), a Gaussian of standard deviation σ. `printed` uses the printed f; `peak`
    sets f = 1. `variance` uses the printed f and 2σ instead of 2σ², also in weights. `coefficient`
    compares ρ with π_T. `always` updates without a comparison.
    """

    sigma: float
    interpretation: Interpretation
    threshold: float

    @property
    def variance(self) -> float:
        """Variance of the Gaussian: σ² or σ."""
        return self.sigma if self.interpretation == "variance" else self.sigma**2

    def log(self, coefficient: Any) -> Any:
        """Return log(π / f) for ρ in [0, 1], a number or an array."""
        return -(1.0 - coefficient) / (2.0 * self.variance)

    @property
    def least_coefficient(self) -> float:
        """Value of ρ above which π > π_T; infinite if π never exceeds π_T.

        Examples
        --------
        >>> round(Likelihood(0.1, "density", 0.9).least_coefficient, 4)
        0.9702
        """
        if self.interpretation == "always":
            return -inf
        if self.interpretation == "coefficient":
            return self.threshold
        printed = 1 / sqrt(2 * pi * self.sigma)
        peaks = {"peak": 1.0, "density": 1 / (sqrt(2 * pi) * self.sigma)}
        peak = peaks.get(self.interpretation, printed)
        if peak <= self.threshold:
            return inf
        return 1 - 2 * self.variance * log(peak / self.threshold)


MIN_SHARE = 0.25  # share of an ellipse that must be inside the image


@dataclass(frozen=True)
class EllipseHistograms:
    """Colour histograms of ellipses: bins and kernel."""

    colours: JointBins
    kernel: Kernel

    def counts(self, frame: SharedFrame, states: Array, bins: Ints) -> EllipseCounts:
        """Count bins in ellipses (n, 7); a total is 0 if less than a quarter is in the image."""
        ellipses = states[:, [0, 1, 4, 5]]
        ellipse_counts = count_ellipses(frame, ellipses, self.kernel, self.colours, bins)
        minimum = MIN_SHARE * pi * ellipses[:, 2] * ellipses[:, 3]
        return ellipse_counts._replace(
            totals=np.where(ellipse_counts.pixels >= minimum, ellipse_counts.totals, 0)
        )

    def histogram(self, frame: SharedFrame, state: Array) -> Array | None:
        """Return the histogram of a state (7,); None if less than a quarter is in the image."""
        ellipse_counts = self.counts(frame, state[np.newaxis], np.arange(self.colours.n_bins))
        if ellipse_counts.totals[0] == 0:
            return None
        return np.asarray(ellipse_counts.counts[0] / ellipse_counts.totals[0])


class TargetModel:
    """Target model histogram: one for all particles, or one for each (`apart`).

    `first` (bins,): initial model, normalised. `alpha`: weight of the new histogram in an update.

    The attribute `current` is the present model; if `apart`, the weighted mean of `models`
    (particles, bins). `bins` (m,) are the bins that must be counted in particles.
    """

    def __init__(self, first: Array, particles: int, apart: bool, alpha: float) -> None:
        self.first = self.current = first
        self._alpha = alpha
        self.models = np.tile(first, (particles, 1)) if apart else None
        self.bins = np.arange(len(first)) if apart else np.flatnonzero(first)

    def select(self, indices: NDArray[np.intp]) -> None:
        """Replace the models by those of the particles that resampling selected."""
        if self.models is not None:
            self.models = self.models[indices]

    def reset(self) -> None:
        """Set the models of all particles to the current model."""
        if self.models is not None:
            self.models[:] = self.current

    def coefficients(self, ellipse_counts: EllipseCounts) -> Array:
        """Return the Bhattacharyya coefficients (n,) between the particles and their models."""
        models = self.current[np.newaxis, self.bins] if self.models is None else self.models
        return bhattacharyya_coefficients(ellipse_counts.counts, ellipse_counts.totals, models)

    def first_coefficients(self, ellipse_counts: EllipseCounts) -> Array:
        """Return the coefficients (n,) between the particles and the first model."""
        return bhattacharyya_coefficients(
            ellipse_counts.counts, ellipse_counts.totals, self.first[np.newaxis, self.bins]
        )

    def update(
        self,
        histogram: Array | None,
        coefficient: float,
        ellipse_counts: EllipseCounts,
        weights: Array,
        minimum: float,
    ) -> float:
        """Update models whose coefficient exceeds `least` (equations 11 and 12).

        `histogram` (bins,) belongs to the estimate; it is None if the estimate is mostly outside.
        `coefficient` is its similarity to the model. `ellipse_counts` and `weights` (n,) belong to
        the particles. Returns the share of models that were updated.
        """
        alpha = self._alpha
        if self.models is not None:
            updated = (self.coefficients(ellipse_counts) > minimum) & (ellipse_counts.totals > 0)
            new_histograms = (
                ellipse_counts.counts[updated] / ellipse_counts.totals[updated, np.newaxis]
            )
            self.models[updated] = (1 - alpha) * self.models[updated] + alpha * new_histograms
            self.current = weights @ self.models
            return float(updated.mean())
        if histogram is None or not coefficient > minimum:
            return 0.0
        self.current = (1 - alpha) * self.current + alpha * histogram
        self.bins = np.flatnonzero(self.first + self.current)
        return 1.0


SURROUNDINGS = 2.0  # half size of the excluded surroundings of a target [half axes]
_BATCH = 128  # positions


def grid_spacing(positions: int, half_axes: Array, image_size: tuple[int, int]) -> float:
    """Return the grid spacing for about `positions` ellipses completely in an image [pixels]."""
    free = np.maximum(np.array(image_size) - 2 * half_axes, 1.0)
    return float(np.sqrt(free.prod() / positions))


class Background:
    """Histograms of a grid of ellipses of the target's size, completely in the image.

    The attribute `positions` (n, 2) contains their centres [pixels]; it is empty if the target
    fills the image.

    `half_axes` float64 (2,): half axes of the ellipses [pixels].
    `spacing`: spacing of the grid, at least 1 [pixels]; see `grid_spacing`.
    `target_centre` float64 (2,), or None: centre of a target in the image. Positions within 2 Hx in
      x and 2 Hy in y (`SURROUNDINGS`) are excluded.
    """

    def __init__(
        self,
        frame: SharedFrame,
        half_axes: Array,
        spacing: float,
        colours: JointBins,
        kernel: Kernel,
        target_centre: Array | None = None,
    ) -> None:
        height, width = frame.image.shape[:2]
        across, down = (
            np.arange(half, size - half + 1e-9, max(spacing, 1.0))
            for half, size in zip(half_axes.tolist(), (width, height), strict=True)
        )
        positions = np.stack(np.meshgrid(across, down), axis=2).reshape(-1, 2)
        if target_centre is not None:
            distances = np.abs(positions - target_centre)
            positions = positions[(distances >= SURROUNDINGS * half_axes).any(axis=1)]
        self.positions = positions
        bins, roots, ends = [np.zeros(0, np.int64)], [np.zeros(0)], [np.zeros(1, np.int64)]
        # In batches, because complete histograms of all positions could be large.
        for start in range(0, len(positions), _BATCH):
            some = positions[start : start + _BATCH]
            ellipses = np.hstack([some, np.tile(half_axes, (len(some), 1))])
            counted = count_ellipses(frame, ellipses, kernel, colours, np.arange(colours.n_bins))
            rows, filled = np.nonzero(counted.counts)
            bins.append(filled)
            roots.append(np.sqrt(counted.counts[rows, filled] / counted.totals[rows]))
            ends.append(ends[-1][-1] + np.searchsorted(rows, np.arange(1, len(some) + 1)))
        self._bins, self._roots = np.concatenate(bins), np.concatenate(roots)
        self._ends = np.concatenate(ends)

    def coefficients(self, model: Array) -> Array:
        """Return the coefficients (n,) between the positions and a normalised `model` (bins,)."""
        return _sparse_products(self._ends, self._bins, self._roots, np.sqrt(model))

    def threshold(self, model: Array) -> float:
        """Return μ + 2 σ of the coefficients (equations 13 to 15); 0 without a position."""
        values = self.coefficients(model)
        return float(values.mean() + 2 * values.std()) if len(values) else 0.0


@njit(cache=True)
def _sparse_products(ends: Ints, bins: Ints, roots: Array, model_roots: Array) -> Array:
    """Return products of sparse rows and a vector, each summed from left to right."""
    sums = np.zeros(len(ends) - 1)
    for i in range(len(sums)):
        for k in range(ends[i], ends[i + 1]):
            sums[i] += roots[k] * model_roots[bins[k]]
    return sums
