"""Particle filter of the paper's Fig. 1 in plain NumPy, without optimisation.

This reference implementation follows the equations of the text, independently of the tracker's
code. Only the order of the random numbers and the integer weights of pixels are shared, so that
both give equal estimates. Re-initialisation of a lost target is not implemented.
"""

from math import ceil, exp, floor, nan, pi, sqrt

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ALPHA = 0.1
# standard deviations as a share of Hx
POSITION_NOISE, VELOCITY_NOISE, SIZE_NOISE, SCALE_NOISE = 0.12, 0.05, 0.01, 0.003
BACKGROUND_POSITIONS = 1000  # approximate number
LEAST_HALF_AXIS = 3.0  # pixels
LEAST_SHARE = 0.25  # minimum share of an ellipse inside the image
WHOLE = 65536  # integer weight of the heaviest pixel


class PlainFilter:
    """Filter with RGB histograms, constant velocity and constant change of scale.

    `mean`: E[S], shape (7,): x, y, vx, vy, Hx, Hy, a' [pixels and frames]. `positive`: number of
    samples that meet the appearance condition (equation 15). `threshold`: μ + 2σ of this condition
    for the current target model. The model is updated if the likelihood of the mean state
    (`update_reading` "printed") or its ρ ("coefficient") is above `update_threshold`. In each frame
    a' is multiplied by `scale_persistence`.
    """

    def __init__(
        self,
        seed: np.random.SeedSequence,
        particles: int = 100,
        bins: int = 8,
        sigma: float = 0.1,
        update_threshold: float = 0.9,
        update_reading: str = "printed",
        scale_persistence: float = 1.0,
    ) -> None:
        self._random = np.random.default_rng(seed)
        self._n, self._bins, self._sigma = particles, bins, sigma
        self._update_threshold, self._update_reading = update_threshold, update_reading
        self._persistence = scale_persistence
        self.mean = np.full(7, nan)
        self.positive, self.threshold = 0, nan

    def init(self, image: NDArray[np.uint8], box: Array) -> None:
        """Initialise the target model with the ellipse in a box of the first frame."""
        x, y, width, height = box.tolist()
        self.mean = np.array([x + width / 2, y + height / 2, 0, 0, width / 2, height / 2, 0])
        self._states = np.tile(self.mean, (self._n, 1))
        self._weights = np.full(self._n, 1 / self._n)
        # sₜ = A sₜ₋₁ + wₜ₋₁: the centre moves by the velocity, both half axes by a'.
        aspect = height / width
        self._a = np.eye(7)
        self._a[[0, 1, 4, 5, 6], [2, 3, 6, 6, 6]] = 1, 1, 1, aspect, self._persistence
        self._aspect, self._image_size = aspect, image.shape[1::-1]
        codes = self.codes(image)
        self._model = self._histogram(codes, self.mean)
        background = np.array(
            [self._histogram(codes, place) for place in self._background_states()]
        )
        self._background_roots = np.sqrt(background)
        self._find_threshold()

    def update(self, image: NDArray[np.uint8]) -> None:
        """Run one iteration of Fig. 1, the appearance condition and the model update."""
        cumulative = np.cumsum(self._weights)
        cumulative /= cumulative[-1]
        indices = np.searchsorted(cumulative, self._random.random(self._n))
        self._states = self._states[indices] @ self._a.T + self._noise()
        width, height = self._image_size
        min_half_axis = max(LEAST_HALF_AXIS, LEAST_HALF_AXIS / self._aspect)
        self._states[:, 4] = np.clip(
            self._states[:, 4], min_half_axis, min(width, height / self._aspect)
        )
        self._states[:, 5] = self._states[:, 4] * self._aspect

        codes = self.codes(image)
        coefficients, self._weights = self.weigh(codes)
        self.mean = self._weights @ self._states
        self.positive = int((coefficients > self.threshold).sum())

        histogram = self._histogram(codes, self.mean)
        match = self._coefficient(histogram)
        if self._update_reading == "printed":
            match = exp(-(1 - match) / (2 * self._sigma**2)) / sqrt(2 * pi * self._sigma)
        if match > self._update_threshold:
            self._model = (1 - ALPHA) * self._model + ALPHA * histogram
            self._find_threshold()

    def weigh(self, codes: NDArray[np.uint16]) -> tuple[Array, Array]:
        """Compute coefficients and weights of the samples (step 3 of Fig. 1)."""
        histograms = [self._histogram(codes, state) for state in self._states]
        coefficients = np.array([self._coefficient(histogram) for histogram in histograms])
        likelihoods = np.exp(-(1 - coefficients) / (2 * self._sigma**2))
        return coefficients, likelihoods / likelihoods.sum()

    def codes(self, image: NDArray[np.uint8]) -> NDArray[np.uint16]:
        """Return the bin of each pixel."""
        blue, green, red = np.moveaxis(image.astype(np.uint16) * self._bins // 256, 2, 0)
        return np.asarray((red * self._bins + green) * self._bins + blue)

    def _histogram(self, codes: NDArray[np.uint16], state: Array) -> Array:
        """Compute the histogram (equations 2 to 4); zeros if the ellipse is mostly outside."""
        x, y, _, _, half_x, half_y, _ = state.tolist()
        height, width = codes.shape
        left, right = max(ceil(x - half_x - 0.5), 0), min(floor(x + half_x + 0.5), width)
        top, bottom = max(ceil(y - half_y - 0.5), 0), min(floor(y + half_y + 0.5), height)
        across = (np.arange(left, right) + 0.5 - x)[np.newaxis]
        down = (np.arange(top, bottom) + 0.5 - y)[:, np.newaxis]
        inside = (across / half_x) ** 2 + (down / half_y) ** 2 <= 1
        if inside.sum() < LEAST_SHARE * pi * half_x * half_y:
            return np.zeros(self._bins**3)
        fall = WHOLE / (half_x**2 + half_y**2)
        weights = WHOLE - np.floor(fall * across**2) - np.floor(fall * down**2)
        bins = codes[top:bottom, left:right][inside]
        counts = np.bincount(bins, weights[inside], minlength=self._bins**3)
        return np.asarray(counts / counts.sum())

    def _coefficient(self, histogram: Array) -> float:
        """Compute the Bhattacharyya coefficient (equation 6)."""
        return float(np.sqrt(histogram * self._model).sum())

    def _noise(self) -> Array:
        """Draw the noise of each state, scaled by Hx of the last estimate."""
        drawn = self._random.standard_normal((self._n, 10))
        size = SIZE_NOISE * drawn[:, 4]
        parts = [POSITION_NOISE * drawn[:, 0:2], VELOCITY_NOISE * drawn[:, 2:4]]
        parts += [np.column_stack([size, size * self._aspect, SCALE_NOISE * drawn[:, 6]])]
        return float(self.mean[4]) * np.hstack(parts)

    def _background_states(self) -> list[Array]:
        """Return states at rest on the background, outside the target."""
        x, y, _, _, half_x, half_y, _ = self.mean.tolist()
        width, height = self._image_size
        free = max(width - 2 * half_x, 1.0) * max(height - 2 * half_y, 1.0)
        step = max(sqrt(free / BACKGROUND_POSITIONS), 1.0)
        return [
            np.array([column, row, 0, 0, half_x, half_y, 0])
            for row in np.arange(half_y, height - half_y + 1e-9, step)
            for column in np.arange(half_x, width - half_x + 1e-9, step)
            if abs(column - x) >= 2 * half_x or abs(row - y) >= 2 * half_y
        ]

    def _find_threshold(self) -> None:
        """Compute the threshold from coefficients of the background (equations 13 to 15)."""
        coefficients = self._background_roots @ np.sqrt(self._model)
        self.threshold = coefficients.mean() + 2 * sqrt(
            ((coefficients - coefficients.mean()) ** 2).mean()
        )
