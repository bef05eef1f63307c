"""The paper's methods in plain NumPy, without optimisation.

These reference implementations follow the equations of the text, independently of the trackers'
code; both must give equal boxes. Two conventions are shared because the text does not define them:
the order of the random numbers, and the rounding of window edges (`plain_maps.ROUNDING`).
"""

from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.papers.wang2010.plain_maps import (
    JointMaps,
    hue_map,
    make_template,
    mean_shift,
    whole_size,
    window_sum,
)
from trackmark.trackers.base.interface import Box, Image

Array = NDArray[np.float64]

SMALLEST_WINDOW = 3  # minimum side of an adaptive window [px]


class _CamShift:
    """Mean shift of one window on a map, optionally with Bradski's adaptation of its size."""

    def __init__(self, window: str, stop_distance: float, max_iterations: int) -> None:
        self._adaptive = window == "adaptive"
        self._stop_distance, self._max_iterations = stop_distance, max_iterations
        self.iterations = 0

    def _start(self, box: Box) -> None:
        x, y, width, height = box.tolist()
        self._x, self._y = x + width / 2, y + height / 2
        self._size: tuple[float, float] = width, height
        self._window = whole_size(width), whole_size(height)
        self._ratio = width / height

    def _shift(self, values: Array) -> Box:
        self._x, self._y, self.iterations, total = mean_shift(
            values, self._x, self._y, *self._window, self._stop_distance, self._max_iterations
        )
        if self._adaptive and total > 0:
            rows, columns = values.shape
            width = whole_size(2 * sqrt(total * self._ratio))
            height = whole_size(2 * sqrt(total / self._ratio))
            self._window = (
                min(max(width, SMALLEST_WINDOW), columns),
                min(max(height, SMALLEST_WINDOW), rows),
            )
            self._size = self._window
        size = np.array(self._size)
        return np.concatenate([(self._x, self._y) - size / 2, size])


class PlainCamShift(_CamShift):
    """Traditional CamShift on the map of the hue; the seed is not used."""

    def __init__(
        self,
        seed: np.random.SeedSequence | int | None = None,
        window: str = "fixed",
        hue_bins: int = 32,
        stop_distance: float = 2.0,
        max_iterations: int = 11,
        minimum_saturation: float = 0.0,
        minimum_value: float = 0.0,
        maximum_value: float = 1.0,
    ) -> None:
        super().__init__(window, stop_distance, max_iterations)
        limits = minimum_saturation, minimum_value, maximum_value
        self._histograms = hue_bins, 1, limits

    def init(self, image: Image, box: Box) -> None:
        """Take the template from a box of the first frame."""
        self._start(box)
        self._template = make_template(image, box, *self._histograms)

    def update(self, image: Image) -> Box:
        """Return the box in the next frame."""
        return self._shift(hue_map(image, self._template))


class PlainImprovedCamShift(_CamShift):
    """Improved CamShift on the joint map of colour and motion; `maps`: of the last frame."""

    def __init__(
        self,
        seed: np.random.SeedSequence | int | None = None,
        window: str = "fixed",
        stop_distance: float = 2.0,
        max_iterations: int = 11,
        **maps: Any,
    ) -> None:
        super().__init__(window, stop_distance, max_iterations)
        self.maps = JointMaps(**maps)

    def init(self, image: Image, box: Box) -> None:
        """Take the template from a box of the first frame."""
        self._start(box)
        self.maps.init(image, box)

    def update(self, image: Image) -> Box:
        """Return the box in the next frame."""
        self.maps.update(image)
        return self._shift(self.maps.joint)


class PlainParticleFilter:
    """Traditional particle filter, with transition and observation of the proposed one.

    `particles`: N. `radius`: r of the transition [px], "rule" for √N / 2. `sigma`: σ of the
    likelihood. `resampling`: "systematic" or "multinomial". `velocity`: "particle" (each particle
    repeats its own last step) or "mean" (all repeat the mean step). `estimate`: "mean" (by weight),
    "resampled" (mean after resampling) or "best" (the particle of the largest weight).

    Attributes of the last frame: `maps`; `predicted` and `particles`, positions after transition
    and drift [px], shape (N, 2); `similarity`, M / M0 in [0, 1], and `weights`, which sum to 1,
    shape (N,); `iterations`, the mean number of mean-shift steps.
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

    def init(self, image: Image, box: Box) -> None:
        """Initialise the template with a box of the first frame, and draw particles around it."""
        self.maps.init(image, box)
        self._random = np.random.default_rng(self._seed)
        self._size = box[2:].copy()
        self._window = whole_size(box[2]), whole_size(box[3])
        self._s = box[:2] + self._size / 2 + self._radius * self._draw()  # s of the frame before
        self._s_before = self._s.copy()  # and of the one before that

    def update(self, image: Image) -> Box:
        """Return the box in the next frame."""
        self.maps.update(image)
        self.predicted = self._predict(image.shape)
        self.particles, m, self.iterations = self._drift(self.predicted)
        # equations 9 to 11
        self.similarity = m / np.prod(self._window)
        likelihoods = np.exp(-(1 - self.similarity) / (2 * self._sigma**2))
        self.weights = likelihoods / likelihoods.sum()

        indices = self._resample()
        self._s, self._s_before = (
            self.particles[indices],
            self._s[indices],
        )  # pairs of particle and velocity
        if self._estimate == "best":
            centre = self.particles[self.weights.argmax()]
        elif self._estimate == "resampled":
            centre = self._s.mean(axis=0)
        else:
            centre = self.weights @ self.particles  # equation 12
        return np.concatenate([centre - self._size / 2, self._size])

    def _predict(self, shape: tuple[int, ...]) -> Array:
        """Draw particles from the transition (equation 8)."""
        steps = self._s - self._s_before
        if self._velocity == "mean":
            steps = steps.mean(axis=0)
        predicted = self._s + steps + self._radius * self._draw()
        rows, columns = shape[:2]
        return np.clip(predicted, 0.5, [columns - 0.5, rows - 0.5])

    def _drift(self, predicted: Array) -> tuple[Array, Array, float]:
        """Return particles, their M, and the mean number of mean-shift steps, which is 0 here."""
        sums = [window_sum(self.maps.joint, x, y, *self._window) for x, y in predicted.tolist()]
        return predicted, np.array(sums), 0.0

    def _resample(self) -> NDArray[np.intp]:
        if self._resampling == "systematic":
            positions = (np.arange(self._n) + self._random.random(1)) / self._n
        else:
            positions = self._random.random(self._n)
        cumulative = np.cumsum(self.weights)
        indices = np.searchsorted(cumulative, positions * cumulative[-1], side="right")
        return np.asarray(np.minimum(indices, self._n - 1))

    def _draw(self) -> Array:
        """Draw u, uniform on [-1, 1] for each coordinate of each particle."""
        return self._random.uniform(-1, 1, (self._n, 2))


class PlainWang2010(PlainParticleFilter):
    """Proposed filter: mean shift on the joint map moves every particle."""

    def __init__(
        self,
        seed: np.random.SeedSequence | int,
        particles: int = 60,
        stop_distance: float = 2.0,
        max_iterations: int = 11,
        **parameters: Any,
    ) -> None:
        super().__init__(seed, particles, **parameters)
        self._limits = stop_distance, max_iterations

    def _drift(self, predicted: Array) -> tuple[Array, Array, float]:
        shifted = (
            mean_shift(self.maps.joint, x, y, *self._window, *self._limits)
            for x, y in predicted.tolist()
        )
        moved = np.array(list(shifted))
        return moved[:, :2], moved[:, 3], float(moved[:, 2].mean())
