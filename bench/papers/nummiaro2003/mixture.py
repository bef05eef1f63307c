"""Whether an object with one of a target's colours is taken for it: a histogram, a mixture (NU-27).

Pixels of the target in a later frame are told apart by the nearer of its two main colours; the
distractor consists of those of the more frequent one alone. Both models see pixels with equal
weights.
"""

from math import log, pi

import numpy as np
import pandas as pd
from scipy.cluster.vq import kmeans2
from scipy.special import logsumexp

from bench.papers.nummiaro2003.ellipses import Array, clear_frames, clutter, ellipses_in, shown
from datasets import Sequence
from trackers.base.interface import Image
from trackers.histograms.bins import JointBins

__all__ = ["Histogram", "Mixture", "one_of_two_colours"]

SIGMA = 0.1
COMPONENTS = 4
ITERATIONS = 20
FLOOR = 4.0  # added to variances: noise and rounding of the camera [grey levels²]


class Histogram:
    """Bins of the text, likelihood of Equation 10.

    Parameters
    ----------
    pixels : ndarray of uint8, shape (n, 3)
        BGR.
    """

    def __init__(self, pixels: Image) -> None:
        self._model = _histogram(pixels)

    def score(self, pixels: Image) -> float:
        """Logarithm of the likelihood, up to a constant."""
        coefficient = float(np.sqrt(self._model * _histogram(pixels)).sum())
        return -(1 - coefficient) / (2 * SIGMA**2)


class Mixture:
    """Gaussian mixture in RGB, fitted by expectation and maximisation from k-means.

    Parameters
    ----------
    pixels : ndarray of uint8, shape (n, 3)
        BGR.
    """

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


def one_of_two_colours(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """How far a model sets the distractor off from the target.

    `mixture`: `model` (`histogram`, `mixture`), `target`, `distractor` (log likelihoods, of the
    mixture a pixel's mean), `separation`: their difference as a share of that between target and
    mean clutter; 0 if the distractor matches as well as the target, 1 if no better than clutter.
    """
    first = sequence.first_frame
    pixels = _pixels(sequence[first], ellipses_in(sequence.boxes[first]))
    models: dict[str, Histogram | Mixture] = {
        "histogram": Histogram(pixels),
        "mixture": Mixture(pixels),
    }
    colours, labels = kmeans2(pixels.astype(np.float64), 2, minit="++", rng=0)
    frequent = np.bincount(labels, minlength=2).argmax()
    rows = []
    for frame, image, ellipse in shown(sequence, clear_frames(sequence, 2 if quick else 10)):
        both = _pixels(image, ellipse)
        offsets = both.astype(np.float64)[:, np.newaxis] - colours
        one_colour = both[(offsets**2).sum(axis=2).argmin(axis=1) == frequent]
        others = [_pixels(image, other) for other in clutter(ellipse, image, 1)]
        for name, model in models.items():
            target, distractor = model.score(both), model.score(one_colour)
            beside = float(np.mean([model.score(other) for other in others]))
            rows.append(
                {
                    "model": name,
                    "frame": frame,
                    "target": target,
                    "distractor": distractor,
                    "separation": (target - distractor) / (target - beside),
                }
            )
    return {"mixture": pd.DataFrame(rows)}


def _pixels(image: Image, ellipse: Array) -> Image:
    """Pixels of an ellipse, shape (n, 3)."""
    rows, columns = np.ogrid[: image.shape[0], : image.shape[1]]
    across = (columns + 0.5 - ellipse[0]) / ellipse[2]
    down = (rows + 0.5 - ellipse[1]) / ellipse[3]
    return np.asarray(image[across**2 + down**2 <= 1])


def _histogram(pixels: Image) -> Array:
    colours = JointBins()
    counts = np.bincount(colours.codes(pixels[np.newaxis])[0], minlength=colours.n_bins)
    return np.asarray(counts / len(pixels))
