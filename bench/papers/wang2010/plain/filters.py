"""The particle filters: the proposed one, whose particles drift, and the traditional one."""

from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.papers.wang2010.plain.observation import JointMaps
from bench.papers.wang2010.plain.windows import mean_shift, whole_size, window_sum

__all__ = ["PlainParticleFilter", "PlainWang2010"]

Array = NDArray[np.float64]


class PlainParticleFilter:
    """The traditional particle filter, with the same transition and observation.

    Parameters
    ----------
    seed : SeedSequence or int
        Of the random numbers.
    particles : int
        N.
    radius : "rule" or float
        r of the transition [pixels]; by the rule √N / 2.
    sigma : float
        Scale of the observation function.
    resampling : {"systematic", "multinomial"}
        How particles are drawn.
    velocity : {"particle", "mean"}
        Each goes on at its own last step, or all at the mean of them.
    estimate : {"mean", "resampled", "best"}
        Weighted mean, mean after resampling, or the particle of the largest weight.
    **maps
        See `JointMaps`.

    Attributes
    ----------
    maps : JointMaps
        Of the last frame.
    predicted, particles : ndarray of float64, shape (N, 2)
        Where the transition and the drift put the particles [pixels].
    similarity, weights : ndarray of float64, shape (N,)
        Of `particles`: M / M0 in [0, 1], and weights that sum to one.
    iterations : float
        Mean shift steps, mean over the particles.
    """

    def __init__(
        self,
        seed: np.random.SeedSequence | int,
        particles: int = 400,
        radius: str | float = "rule",
        sigma: float = 1.0,
        resampling: str = "systematic",
        velocity: str = "particle",
        estimate: str = "mean",
        **maps: Any,
    ) -> None:
        self._seed, self._n, self._sigma = seed, particles, sigma
        self._radius = sqrt(particles) / 2 if radius == "rule" else float(radius)
        self._resampling, self._velocity, self._estimate = resampling, velocity, estimate
        self.maps = JointMaps(**maps)

    def init(self, image: NDArray[np.uint8], box: Array) -> None:
        """Take the template from a box of the first frame, and scatter particles around it."""
        self.maps.init(image, box)
        self._random = np.random.default_rng(self._seed)
        self._size = box[2:].copy()
        self._window = whole_size(box[2]), whole_size(box[3])
        self._s = box[:2] + self._size / 2 + self._radius * self._draw()  # s of the frame before
        self._s_before = self._s.copy()  # and of the one before that

    def update(self, image: NDArray[np.uint8]) -> Array:
        """Box in the next frame."""
        self.maps.update(image)
        self.predicted = self._predict(image.shape)
        self.particles, m, self.iterations = self._drift(self.predicted)
        # Equations 9 to 11.
        self.similarity = m / np.prod(self._window)
        likelihoods = np.exp(-(1 - self.similarity) / (2 * self._sigma**2))
        self.weights = likelihoods / likelihoods.sum()

        chosen = self._resample()
        self._s, self._s_before = self.particles[chosen], self._s[chosen]  # in pairs
        if self._estimate == "best":
            centre = self.particles[self.weights.argmax()]
        elif self._estimate == "resampled":
            centre = self._s.mean(axis=0)
        else:
            centre = self.weights @ self.particles  # equation 12
        return np.concatenate([centre - self._size / 2, self._size])

    def _predict(self, shape: tuple[int, ...]) -> Array:
        """Equation 8."""
        steps = self._s - self._s_before
        if self._velocity == "mean":
            steps = steps.mean(axis=0)
        predicted = self._s + steps + self._radius * self._draw()
        rows, columns = shape[:2]
        return np.clip(predicted, 0.5, [columns - 0.5, rows - 0.5])

    def _drift(self, predicted: Array) -> tuple[Array, Array, float]:
        """Particles, M of each, and their mean number of steps: without any drift here."""
        sums = [window_sum(self.maps.joint, x, y, *self._window) for x, y in predicted.tolist()]
        return predicted, np.array(sums), 0.0

    def _resample(self) -> NDArray[np.intp]:
        if self._resampling == "systematic":
            positions = (np.arange(self._n) + self._random.random(1)) / self._n
        else:
            positions = self._random.random(self._n)
        cumulative = np.cumsum(self.weights)
        found = np.searchsorted(cumulative, positions * cumulative[-1], side="right")
        return np.asarray(np.minimum(found, self._n - 1))

    def _draw(self) -> Array:
        """u: uniform on [-1, 1], independent for each coordinate of each particle."""
        return self._random.uniform(-1, 1, (self._n, 2))


class PlainWang2010(PlainParticleFilter):
    """The proposed filter: mean shift on the joint map moves every particle.

    Parameters
    ----------
    seed, particles
        As `PlainParticleFilter`.
    stop_distance : float
        ε of the mean shift [pixels].
    max_iterations : int
        n0, most steps of it.
    **others
        As `PlainParticleFilter`.
    """

    def __init__(
        self,
        seed: np.random.SeedSequence | int,
        particles: int = 60,
        stop_distance: float = 2.0,
        max_iterations: int = 10,
        **others: Any,
    ) -> None:
        super().__init__(seed, particles, **others)
        self._stop_distance, self._max_iterations = stop_distance, max_iterations

    def _drift(self, predicted: Array) -> tuple[Array, Array, float]:
        found = np.array(
            [
                mean_shift(
                    self.maps.joint, x, y, *self._window, self._stop_distance, self._max_iterations
                )
                for x, y in predicted.tolist()
            ]
        )
        return found[:, :2], found[:, 3], float(found[:, 2].mean())
