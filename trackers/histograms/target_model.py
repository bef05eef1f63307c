"""Colour histograms of ellipses: the model that follows a target, and what looks like it.

What a coefficient means for an update of the model, and how much of the target any place of the
background looks like (the appearance condition): Nummiaro et al. 2003, equations 10 to 15.
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
    """π = f exp(-(1 - ρ) / 2σ²), of which the prefix f matters to the threshold alone.

    Nummiaro et al. 2003, equation 10, print f = 1 / √(2πσ), call σ a variance and divide by
    2σ²; equation 11 compares π with a threshold π_T. How that is read: 'density': f is
    1 / (√(2π) σ), the Gaussian of deviation σ. 'printed': as printed. 'peak': f = 1. 'variance': f
    as printed and 2σ in the place of 2σ², in the weights too. 'coefficient': ρ itself is compared.
    'always': nothing is.
    """

    sigma: float
    reading: Interpretation
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


MIN_SHARE = 0.25  # of an ellipse inside the image, for it to look like anything


@dataclass(frozen=True)
class EllipseHistograms:
    """How ellipses are looked at: bins and kernel."""

    colours: JointBins
    kernel: Kernel

    def counts(self, frame: SharedFrame, states: Array, bins: Ints) -> EllipseCounts:
        """Count bins in states (n, 7); totals are 0 where less than a quarter is inside."""
        ellipses = states[:, [0, 1, 4, 5]]
        found = count_ellipses(frame, ellipses, self.kernel, self.colours, bins)
        least = MIN_SHARE * pi * ellipses[:, 2] * ellipses[:, 3]
        return found._replace(totals=np.where(found.pixels >= least, found.totals, 0))

    def histogram(self, frame: SharedFrame, state: Array) -> Array | None:
        """Return the histogram of a state (7,); None if less than a quarter is inside."""
        found = self.counts(frame, state[np.newaxis], np.arange(self.colours.n_bins))
        if found.totals[0] == 0:
            return None
        return np.asarray(found.counts[0] / found.totals[0])


class TargetModel:
    """Histogram that particles are compared with: one for all, or one for each (`apart`).

    It begins as `first` (bins,), normalised; `alpha` is the
    weight of a new histogram in an update. `current` is the model now, of models of their own
    (`models`, (particles, bins)) the weighted mean; `bins` (m,) are those that must be counted in
    particles.
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
        return bhattacharyya_coefficients(found.counts, found.totals, models)

    def first_coefficients(self, found: EllipseCounts) -> Array:
        """The same with the first model; its bins are among `bins` for good."""
        return bhattacharyya_coefficients(
            found.counts, found.totals, self.first[np.newaxis, self.bins]
        )

    def update(
        self,
        histogram: Array | None,
        coefficient: float,
        found: EllipseCounts,
        weights: Array,
        least: float,
    ) -> float:
        """Mix in what was seen where that looks like the model (equations 11 and 12).

        `histogram` (bins,) is that of the estimate (None: too little of it is inside),
        `coefficient` its likeness; `found` and `weights` (n,) are the particles'. A coefficient
        above `least` is needed. Gives the share of the models that were updated.
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


_AT_ONCE = 128  # positions


def grid_spacing(positions: int, half_axes: Array, image_size: tuple[int, int]) -> float:
    """Return the spacing of about so many ellipses that are whole inside an image [pixels]."""
    free = np.maximum(np.array(image_size) - 2 * half_axes, 1.0)
    return float(np.sqrt(free.prod() / positions))


class Background:
    """Histograms of ellipses of the target's size all over an image, each whole inside it.

    Their half axes (2,) and the `spacing` of their grid, at least 1, are in pixels (see
    `grid_spacing`). Where the target is in the image, places nearer to its
    centre `without` (2,) than 2 Hx sideways and 2 Hy upright are not background. `positions` (n, 2)
    are the centres; there are none where the target fills the image.
    """

    def __init__(
        self,
        frame: SharedFrame,
        half_axes: Array,
        spacing: float,
        colours: JointBins,
        kernel: Kernel,
        without: Array | None = None,
    ) -> None:
        height, width = frame.image.shape[:2]
        across, down = (
            np.arange(half, size - half + 1e-9, max(spacing, 1.0))
            for half, size in zip(half_axes.tolist(), (width, height), strict=True)
        )
        places = np.stack(np.meshgrid(across, down), axis=2).reshape(-1, 2)
        if without is not None:
            places = places[(np.abs(places - without) >= 2 * half_axes).any(axis=1)]
        self.positions = places
        bins, roots, ends = [np.zeros(0, np.int64)], [np.zeros(0)], [np.zeros(1, np.int64)]
        # Whole histograms of all places at once would be large where bins are fine.
        for start in range(0, len(places), _AT_ONCE):
            some = places[start : start + _AT_ONCE]
            ellipses = np.hstack([some, np.tile(half_axes, (len(some), 1))])
            found = count_ellipses(frame, ellipses, kernel, colours, np.arange(colours.n_bins))
            rows, filled = np.nonzero(found.counts)
            bins.append(filled)
            roots.append(np.sqrt(found.counts[rows, filled] / found.totals[rows]))
            ends.append(ends[-1][-1] + np.searchsorted(rows, np.arange(1, len(some) + 1)))
        self._bins, self._roots = np.concatenate(bins), np.concatenate(roots)
        self._ends = np.concatenate(ends)

    def coefficients(self, model: Array) -> Array:
        """Bhattacharyya coefficient of every position, (n,), and a normalised histogram (bins,)."""
        return _sums(self._ends, self._bins, self._roots, np.sqrt(model))

    def threshold(self, model: Array) -> float:
        """Return μ + 2 σ of the coefficients (equations 13 to 15); 0 without a position."""
        found = self.coefficients(model)
        return float(found.mean() + 2 * found.std()) if len(found) else 0.0


@njit(cache=True)
def _sums(ends: Ints, bins: Ints, roots: Array, model_roots: Array) -> Array:
    """Products of sparse rows and a vector, each summed up from left to right."""
    found = np.zeros(len(ends) - 1)
    for i in range(len(found)):
        for k in range(ends[i], ends[i + 1]):
            found[i] += roots[k] * model_roots[bins[k]]
    return found
