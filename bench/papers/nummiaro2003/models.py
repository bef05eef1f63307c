"""What a target looks like: histograms and mixtures of ellipses, and where else to look for it."""

from collections.abc import Iterable, Iterator
from math import log, pi
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.cluster.vq import kmeans2
from scipy.special import logsumexp

from bench.papers.scenes import spaced
from datasets import Sequence
from trackers.base.interface import Image
from trackers.base.sharing import SharedFrame
from trackers.histograms.bins import JointBins
from trackers.histograms.ellipses import Kernel, coefficients
from trackers.histograms.target_model import Ellipses

__all__ = ["Array", "Histogram", "Mixture", "Model", "clear_frames", "clutter", "ellipses_in"]
__all__ += ["first_model", "grid", "shown"]

Array: TypeAlias = NDArray[np.float64]

CLEAR = 0.95  # visible fraction from which a target counts as not hidden
WIDTHS = 3  # of the target, around which clutter lies

SIGMA = 0.1  # of the likelihood
COMPONENTS, ITERATIONS = 4, 20  # of the mixture, and of its fit
FLOOR = 4.0  # added to variances: noise and rounding of the camera [grey levels²]


class Model:
    """Normalised histogram of an ellipse as the tracker has it, and coefficients with it.

    An image is BGR, an ellipse its centre x and y, Hx and Hy in pixels; kernels are the tracker's.
    """

    def __init__(
        self,
        image: Image,
        ellipse: Array,
        colours: JointBins | None = None,
        kernel: Kernel = "isotropic",
    ) -> None:
        self._ellipses = Ellipses(colours or JointBins(), kernel)
        every = np.arange(self._ellipses.colours.n_bins)
        counted = self._ellipses.counts(SharedFrame(image), _at_rest(ellipse[np.newaxis]), every)
        self.histogram: Array = counted.counts[0] / counted.totals[0]
        self._bins = np.flatnonzero(counted.counts[0])

    def coefficients(self, image: Image, ellipses: Array) -> Array:
        """ρ of ellipses (n, 4); 0 with less than a quarter inside the image."""
        counted = self._ellipses.counts(SharedFrame(image), _at_rest(ellipses), self._bins)
        return coefficients(counted.counts, counted.totals, self.histogram[np.newaxis, self._bins])

    def coefficient(self, image: Image, ellipse: Array) -> float:
        """ρ of one ellipse."""
        return float(self.coefficients(image, ellipse[np.newaxis])[0])


def first_model(
    sequence: Sequence, colours: JointBins | None = None, kernel: Kernel = "isotropic"
) -> Model:
    """Model of the true ellipse in the first frame."""
    first = sequence.first_frame
    return Model(sequence[first], ellipses_in(sequence.boxes[first]), colours, kernel)


def ellipses_in(boxes: Array) -> Array:
    """Ellipses in boxes: centre x and y, Hx and Hy, shape (n, 4) as the boxes or (4,) as one."""
    half_axes = boxes[..., 2:] / 2
    return np.concatenate([boxes[..., :2] + half_axes, half_axes], axis=-1)


def grid(ellipse: Array, reach: tuple[float, float], step: float) -> Array:
    """The ellipse moved over a grid, at most by `reach` to each side, shape (n, 4) [pixels]."""
    across, down = (step * np.arange(-int(most / step), int(most / step) + 1) for most in reach)
    offsets = np.stack(np.meshgrid(across, down), axis=2).reshape(-1, 2)
    moved = np.tile(ellipse, (len(offsets), 1))
    moved[:, :2] += offsets
    return moved


def clutter(ellipse: Array, image: Image, steps_a_width: int = 4) -> Array:
    """Ellipses (n, 4) of the true one's size, within three widths, that a score would call a miss.

    Their centres are inside the image and outside the true box.
    """
    width = 2 * float(ellipse[2])
    around = grid(ellipse, (WIDTHS * width, WIDTHS * width), width / steps_a_width)
    hit = (np.abs(around[:, :2] - ellipse[:2]) <= ellipse[2:]).all(axis=1)
    size = np.array(image.shape[1::-1])
    inside = ((around[:, :2] >= 0) & (around[:, :2] <= size)).all(axis=1)
    return around[inside & ~hit]


def clear_frames(sequence: Sequence, most: int, least: float = CLEAR) -> list[int]:
    """At most so many frames after the first, evenly spaced, that show so much of the target."""
    shows = sequence.present & (sequence.visibility >= least)
    shows[: sequence.first_frame + 1] = False
    return spaced(np.flatnonzero(shows), most)


def shown(sequence: Sequence, frames: Iterable[int]) -> Iterator[tuple[int, Image, Array]]:
    """Frames in order, with their images and true ellipses."""
    for frame in sorted(frames):
        yield frame, sequence[frame], ellipses_in(sequence.boxes[frame])


def _at_rest(ellipses: Array) -> Array:
    """Ellipses (n, 4) as states of the tracker that do not move, shape (n, 7)."""
    states = np.zeros((len(ellipses), 7))
    states[:, [0, 1, 4, 5]] = ellipses
    return states


class Histogram:
    """Histogram of BGR pixels (n, 3), all of one weight: the text's bins, and Equation 10."""

    def __init__(self, pixels: Image) -> None:
        self._model = _histogram(pixels)

    def score(self, pixels: Image) -> float:
        """Logarithm of the likelihood, up to a constant."""
        coefficient = float(np.sqrt(self._model * _histogram(pixels)).sum())
        return -(1 - coefficient) / (2 * SIGMA**2)


class Mixture:
    """Gaussians of pixels (n, 3), fitted by expectation and maximisation from k-means."""

    def __init__(self, pixels: Image) -> None:
        values = pixels.astype(np.float64)
        self._means, labels = kmeans2(values, COMPONENTS, minit="++", rng=0)
        shares = (labels[:, np.newaxis] == np.arange(COMPONENTS)).astype(np.float64)
        for _ in range(ITERATIONS):
            self._fit(values, shares)
            logs = self._logs(values)
            shares = np.exp(logs - logsumexp(logs, axis=1, keepdims=True))

    def score(self, pixels: Image) -> float:
        """Mean logarithm of the pixels' densities."""
        return float(logsumexp(self._logs(pixels.astype(np.float64)), axis=1).mean())

    def _fit(self, values: Array, shares: Array) -> None:
        totals = shares.sum(axis=0) + 1e-9
        self._weights = totals / totals.sum()
        self._means = shares.T @ values / totals[:, np.newaxis]
        offsets = values - self._means[:, np.newaxis]
        self._covariances = np.einsum("nk,kni,knj->kij", shares, offsets, offsets)
        self._covariances /= totals[:, np.newaxis, np.newaxis]
        self._covariances += FLOOR * np.eye(3)

    def _logs(self, values: Array) -> Array:
        """Logarithm of weight and density, shape (n, components)."""
        offsets = values - self._means[:, np.newaxis]
        inverse = np.linalg.inv(self._covariances)
        squares = np.einsum("kni,kij,knj->nk", offsets, inverse, offsets)
        spread = np.linalg.slogdet(self._covariances)[1] + 3 * log(2 * pi)
        return np.asarray(np.log(self._weights) - (squares + spread) / 2)


def _histogram(pixels: Image) -> Array:
    colours = JointBins()
    counts = np.bincount(colours.codes(pixels[np.newaxis])[0], minlength=colours.n_bins)
    return np.asarray(counts / len(pixels))
