"""What both trackers do alike: the beginning, contours, the snake (sections 5.4 and 5.5)."""

from abc import ABC, abstractmethod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.papers.moreno2005.plain.contours import inside, outline, propagated
from bench.papers.moreno2005.plain.frame import Frame, drawn_colours, sure
from bench.papers.moreno2005.plain.mixtures import Mixture, fitted, mixture_of, posterior
from bench.papers.moreno2005.plain.planes import fisher_basis
from bench.papers.moreno2005.plain.samples import Samples, drawn, shares, weights_of
from bench.papers.moreno2005.plain.snake import refined

__all__ = ["Found", "PlainSegmenter"]

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
Mask = NDArray[np.bool_]

FIRST_COLOURS = 500, 1500  # of target and background
LATER_COLOURS = 300, 600
STEPS = 15  # of EM
SMALLEST = 60  # pixels in a contour


class Found(NamedTuple):
    """What is said of a frame.

    Attributes
    ----------
    contour, mean_contour : ndarray of float64, shape (points, 2)
        The snake R, and the mean of the samples [pixels].
    posterior : ndarray of float64, shape (rows, columns)
        By the best colour hypothesis.
    box : ndarray of float64, shape (4,)
        Of the contour [pixels].
    mask : ndarray of bool, shape (rows, columns)
        Pixels inside the contour.
    snake : bool
        Whether the contour is the snake.
    score : float
        Largest difference of mean posteriors of a contour.
    """

    contour: Array
    mean_contour: Array
    posterior: Array
    box: Array
    mask: Mask
    snake: bool
    score: float


class PlainSegmenter(ABC):
    """A contour of particles that are weighed by hypotheses of colours.

    Parameters
    ----------
    seed : SeedSequence or int
        Of the random numbers.
    settings : Parameters
        The tracker's.

    Attributes
    ----------
    basis : ndarray of float64, shape (3, 2)
        Φ of the first frame.
    contours : Samples
        x₃.
    contour : ndarray of float64, shape (points, 2)
        R of the last frame [pixels].
    """

    def __init__(self, seed: np.random.SeedSequence | int, settings: Any) -> None:
        if settings.dynamics.values or settings.output != "snake":
            raise ValueError("only parameters that are given one by one and output=snake are here")
        self._seed, self._settings = seed, settings

    def init(self, image: Image, box: Array, mask: Mask | None = None) -> None:
        """Take the target from a mask in the first frame, BGR, or from an ellipse in a box."""
        settings = self._settings
        self._random = np.random.default_rng(self._seed)
        if mask is None or settings.start == "box":
            rows, columns = np.indices(image.shape[:2]) + 0.5
            x, y, width, height = box.tolist()
            across, down = (columns - x) / width - 0.5, (rows - y) / height - 0.5
            mask = np.asarray(across**2 + down**2 <= 0.25)
        sets = self._sets(image, mask, FIRST_COLOURS)
        self.basis = fisher_basis(*sets)
        mixtures = tuple(
            fitted(colours @ self.basis, number, self._random, STEPS)
            for colours, number in zip(
                sets, (settings.object_components, settings.background_components), strict=True
            )
        )
        self.contour = outline(mask, settings.contour_points)
        self.contours = Samples(self.contour, settings.contour_samples)
        self._anchors = 0
        self._begin(sets, mixtures)

    def update(self, image: Image) -> Found:
        """Contour in the next frame, BGR."""
        frame = Frame(image, self.contour, self._settings)
        tables, weights = self._hypotheses(frame, image)
        differences = self._weigh_contours(frame, tables, weights)
        mean = np.tensordot(self.contours.weights, self.contours.states, axes=1)
        joint = shares(self.contours.attached, self.contours.weights, len(tables))
        self.contours.carried = self.contours.weights
        self._feed_back(joint)
        posteriors = tables[int(joint.argmax())][frame.cells]
        self.contour, snake = mean, False
        if self._settings.snake:
            self.contour, snake = refined(mean, image, posteriors, self._settings)
        self._anchors = round(self._settings.snake_feedback * self._settings.contour_samples)
        mask = inside(self.contour, *image.shape[:2])
        self._learn(image, mask)
        least, most = self.contour.min(axis=0), self.contour.max(axis=0)
        box = np.concatenate([least, most - least])
        return Found(self.contour, mean, posteriors, box, mask, snake, float(differences.max()))

    @abstractmethod
    def _begin(self, sets: tuple[Array, ...], mixtures: tuple[Mixture, ...]) -> None:
        """Start from colours of target and background, and mixtures of them on the plane."""

    @abstractmethod
    def _hypotheses(self, frame: Frame, image: Image) -> tuple[list[Array], Array]:
        """Posteriors of the frame's colours, one array a hypothesis, and weights of these."""

    @abstractmethod
    def _feed_back(self, joint: Array) -> None:
        """Take in the weights of the colours' hypotheses in the complete density."""

    @abstractmethod
    def _learn(self, image: Image, mask: Mask) -> None:
        """Take in how a frame was segmented."""

    def _weigh_contours(self, frame: Frame, tables: list[Array], weights: Array) -> Array:
        """Section 5.4: resample, propagate, attach colours, weigh; the differences."""
        settings, cue = self._settings, self.contours
        height, width = frame.cells.shape
        affine = [
            [settings.stretch_x_spread, settings.shear_x_spread],
            [settings.shear_y_spread, settings.stretch_y_spread],
        ]
        shift = np.array([settings.shift_x_spread, settings.shift_y_spread]) * width / 320
        states = cue.resampled(self._random)
        states[: self._anchors] = self.contour
        cue.states = propagated(states, np.array(affine), shift, self._random)
        cue.attached = drawn(weights, self._random.random(len(states)))
        region = np.full((height, width), True)
        if settings.outside == "window":
            x0, y0, x1, y1 = frame.box
            least = np.floor(cue.states.min(axis=(0, 1))).astype(int)
            most = np.ceil(cue.states.max(axis=(0, 1))).astype(int)
            region[:] = False
            region[
                max(min(y0, least[1]), 0) : max(y1, most[1]),
                max(min(x0, least[0]), 0) : max(x1, most[0]),
            ] = True
        differences = np.full(len(states), -1.0)
        for j, contour in enumerate(cue.states):
            within = inside(contour, height, width)
            outside = region & ~within
            if within.sum() >= SMALLEST and outside.any():
                pixels = tables[cue.attached[j]][frame.cells]
                differences[j] = pixels[within].mean() - pixels[outside].mean()
        cue.weights = weights_of(differences, settings.weights, settings.contour_temperature)
        return differences

    def _table(self, frame: Frame, state: Array, basis: Array) -> Array:
        """p(O | c) of the frame's colours on a plane, by a state of x₂."""
        of_target = self._settings.object_components
        mixtures = mixture_of(state[:of_target]), mixture_of(state[of_target:])
        return posterior(frame.colours @ basis, *mixtures, self._settings.colour_floor, frame.prior)

    def _sets(self, image: Image, mask: Mask, counts: tuple[int, int]) -> tuple[Array, ...]:
        """Colours drawn of what is surely target, and surely background."""
        pairs = zip(sure(mask), counts, strict=True)
        return tuple(drawn_colours(image, region, n, self._random) for region, n in pairs)

    def _later_sets(self, image: Image, mask: Mask) -> tuple[Array, ...]:
        """Of a frame as it was segmented; empty where one of the two has no pixel."""
        if not all(region.any() for region in sure(mask)):
            return ()
        return self._sets(image, mask, LATER_COLOURS)
