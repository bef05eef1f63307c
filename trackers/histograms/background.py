"""How much of a target any place of the background looks like (the appearance condition)."""

from typing import TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from trackers.base.sharing import SharedFrame
from trackers.histograms.bins import JointBins
from trackers.histograms.counting import ellipse_histograms
from trackers.histograms.ellipses import Kernel

__all__ = ["Background", "spacing_of"]

Ints: TypeAlias = NDArray[np.int64]
Array = NDArray[np.float64]

_AT_ONCE = 128  # positions


def spacing_of(positions: int, half_axes: Array, image_size: tuple[int, int]) -> float:
    """Spacing [pixels] of a grid of about so many ellipses that are whole inside an image.

    Half axes Hx, Hy are of shape (2,) [pixels]; the image's size is width and height.
    """
    free = np.maximum(np.array(image_size) - 2 * half_axes, 1.0)
    return float(np.sqrt(free.prod() / positions))


class Background:
    """Histograms of ellipses of the target's size all over an image, each whole inside it.

    Parameters
    ----------
    frame : SharedFrame
        The image.
    half_axes : ndarray of float64, shape (2,)
        Hx and Hy [pixels].
    spacing : float
        Of the grid, at least 1 [pixels]; see `spacing_of`.
    colours, kernel : JointBins, str
        How pixels are binned and weighed; see `trackers.histograms.ellipses.ellipse_counts`.
    without : ndarray of float64, shape (2,), optional
        Centre of the target, where it is in the image [pixels]: positions nearer than
        2 Hx sideways and 2 Hy upright are not background.

    Attributes
    ----------
    positions : ndarray of float64, shape (n, 2)
        Centres; none where the target fills the image.
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
            found = ellipse_histograms(frame, ellipses, kernel, colours, np.arange(colours.n_bins))
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
        """Coefficient above which something does not look like background, μ + 2 σ.

        Nummiaro et al. 2003, equations 13 to 15; σ² is the mean square deviation over all
        positions. 0 without a position.
        """
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
