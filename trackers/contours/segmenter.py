"""Base class of trackers that segment by colour and contour (Moreno-Noguer et al. 2005)."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from math import inf
from typing import Annotated, Literal, NamedTuple, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from trackmark.trackers.base.arrays import Array
from trackmark.trackers.base.interface import Box, Estimate, Image, Mask, Randomness
from trackmark.trackers.base.parameters import (
    HARNESS,
    OPTION,
    Parameters,
    TrackerError,
    choice,
    chosen,
    fraction,
    integer,
    nonnegative,
    positive,
    printed,
)
from trackmark.trackers.base.particles import effective_sample_size
from trackmark.trackers.base.sharing import SharedFrame, SharingTracker
from trackmark.trackers.contours.chain import Chain, Hypotheses, complete_combinations
from trackmark.trackers.contours.colour_cue import ColourFit
from trackmark.trackers.contours.contour_cue import MIN_AREA, REFERENCE_WIDTH, ContourCue
from trackmark.trackers.contours.mixture import (
    FIT_STEPS,
    REGULARISATION,
    fit_mixture,
    to_components,
)
from trackmark.trackers.contours.observation import (
    ColourCells,
    Observation,
    Weights,
    colour_cells,
    draw_colours,
    observe,
    window_around,
)
from trackmark.trackers.contours.outline import (
    Outside,
    bounding_box,
    enclosed_area,
    fill_contour,
    inscribed_ellipse,
    outline,
)
from trackmark.trackers.contours.plane_cue import NEIGHBOURS, discriminant_basis
from trackmark.trackers.contours.snake import (
    ATTRACTION,
    ELASTICITY,
    ITERATIONS,
    MAX_AREA_RATIO,
    MIN_AREA_RATIO,
    RIGIDITY,
    SPACING,
    STEP,
    refine_by_snake,
)

Posterior: TypeAlias = NDArray[np.float32]

TARGET_POINTS, BACKGROUND_POINTS = 500, 1500  # sample sizes for the first plane and mixtures
REFIT_POINTS = 300, 600  # sample sizes of target and background in later frames
RECOMMENDED: Mapping[str, str] = {"weights": "exponential", "outside": "window"}
"""Values of the preset `recommended` that both trackers share."""

LEARNT = (
    "not printed; learnt by least squares, as section 4.3 says, on two scenes that no claim uses"
)
"""Reason of a spread; `SegmenterParameters` describes how the spreads were learnt."""

MIN_PRIOR = 0.05  # minimum prior of target and background, if computed from areas


class SegmenterParameters(Parameters):
    """Parameters of a `Segmenter`.

    The paper prints no standard deviations. It says that dynamics are "learned off-line from a
    training hand-segmented sequence using a least squares technique" (section 4.3). The default
    spreads were learnt in this way, on `moreno2005/ellipse:scene=100` and `:scene=101`, which no
    claim uses. They are root mean squares of the steps, because a random walk has no drift. `H` and
    `p` of `r = m + H (r' - m) + p` were fitted to the outlines `r'` and `r` of consecutive masks,
    with the penalty `50 |H - I|²`. Outlines have 32 points; `m` is the mean of `r'`. For the start
    point of `r`, 256 positions were tried, and the best was used. Shifts are in pixels of an image
    320 wide.
    """

    contour_samples: int = integer(
        500,
        "N₃: number of particles of the contour [count]",
        origin=chosen(
            "N₃ is not printed; with (N₁, N₂, N₃) = (20, 150, 300), 2 of 10 earlier videos were "
            "lost"
        ),
    )
    contour_points: int = integer(
        32,
        "N_r: points of a contour [count]",
        8,
        origin=chosen(
            "N_r is not printed; one point per 4.4 pixels on the ellipses of the paper's Fig. 7"
        ),
    )
    object_components: int = integer(
        2,
        "M_O: number of Gaussians of the target's colours [count]",
        maximum=20,
        origin=chosen("M_O is not printed; a target of few colours"),
    )
    background_components: int = integer(
        5,
        "M_B: number of Gaussians of the background's colours [count]",
        maximum=20,
        origin=chosen("M_B is not printed; the background has more colours than the target"),
    )
    stretch_x_spread: float = nonnegative(
        0.0323, "σ of the element of H₃ by which x depends on x [ratio]", origin=chosen(LEARNT)
    )
    shear_x_spread: float = nonnegative(
        0.05738, "σ of the element of H₃ by which x depends on y [ratio]", origin=chosen(LEARNT)
    )
    shear_y_spread: float = nonnegative(
        0.05397, "σ of the element of H₃ by which y depends on x [ratio]", origin=chosen(LEARNT)
    )
    stretch_y_spread: float = nonnegative(
        0.03318, "σ of the element of H₃ by which y depends on y [ratio]", origin=chosen(LEARNT)
    )
    shift_x_spread: float = nonnegative(
        3.465, "σ of the x component of p₃, in an image 320 wide [pixels]", origin=chosen(LEARNT)
    )
    shift_y_spread: float = nonnegative(
        3.72, "σ of the y component of p₃, in an image 320 wide [pixels]", origin=chosen(LEARNT)
    )
    weights: Weights = choice(
        "literal",
        "literal: weights are differences of mean posteriors; exponential: exponentials of "
        "these differences",
        origin=chosen(
            "sections 5.2 to 5.4 print two mean posteriors, with an operator between them that "
            "cannot be read; not scaled by a temperature, which the text does not print"
        ),
    )
    contour_temperature: float = positive(
        0.02,
        "τ₃: divisor of the differences of contours in exponential weights [difference]",
        origin=chosen(
            "not in the text; smaller than τ₁ and τ₂, because the window is only a proxy of the "
            "target"
        ),
    )
    object_prior: Annotated[float, Field(gt=0, lt=1)] | Literal["area"] = choice(
        0.5,
        "P(O): prior probability of the target: a number, or the share of the window that the "
        "contour encloses [fraction]",
        origin=chosen("P(O) of eq. 6 is not printed; equal classes"),
    )
    window_margin: float = nonnegative(
        4.0,
        "W extends so far beyond the contour, in an image 320 wide [pixels]",
        origin=chosen(
            "section 5.2: a tolerance big enough for unexpected movements, without a number"
        ),
    )
    window_growth: float = nonnegative(
        0.15,
        "W also extends by this multiple of half the contour's width and height [ratio]",
        origin=chosen(
            "section 5.2: a tolerance big enough for unexpected movements, without a number"
        ),
    )
    ring: Annotated[float, Field(gt=1)] | Literal["image"] = choice(
        "image",
        "surroundings with which W is compared: the rest of the image, or of a rectangle so many "
        "times as wide and high as W [ratio]",
        origin=printed("section 5.2: image pixels in and out of W"),
    )
    outside: Outside = choice(
        "image",
        "region with which a contour's inside is compared: the rest of the image, or of the "
        "bounding box of W and all contours",
        origin=printed("section 5.4: image pixels inside and outside the contour"),
    )
    snake: bool = choice(
        True,
        "whether a snake refines the mean contour",
        origin=printed("section 5.5: the average contour initialises a snake"),
    )
    snake_edges: Literal["supported", "all"] = choice(
        "supported",
        "edges that attract the snake: edges of both image and posterior, or all edges of "
        "the image",
        origin=printed("section 5.5, Fig. 6: the posterior of the best colours eliminates edges"),
    )
    snake_feedback: float = fraction(
        0.0, "share of the contours that start from the snake [fraction]", origin=OPTION
    )
    colour_levels: int = integer(
        20,
        "L: number of levels per channel; the colour grid has L³ cells [count]",
        2,
        64,
        origin=chosen(
            "the text evaluates each pixel; a grid of 20³ cells evaluates all of them faster"
        ),
    )
    start: Literal["mask", "box"] = choice(
        "mask",
        "initial target: the mask, if one is given, or the ellipse in the init box",
        origin=HARNESS,
    )
    output: Literal["snake", "mean", "posterior"] = choice(
        "snake",
        "region whose mask and box are returned: the refined contour, the mean contour, or the "
        "pixels whose posterior exceeds one half",
        origin=printed("section 5.5: the contour R after the snake"),
    )


class ChainStart(NamedTuple):
    """Data of the first frame from which the cues are created."""

    basis: Array  # (3, 2): basis of the Fisher plane
    fit: ColourFit  # colours of target and background, and mixtures of them on that plane
    contour: Array  # (points, 2) [pixels]
    width: int  # of the image [pixels]

    @property
    def components(self) -> Array:
        """Components of both mixtures, the target's first, shape (components, 6)."""
        both = [to_components(self.fit.target), to_components(self.fit.background)]
        return np.concatenate(both)


class Segmenter(SharingTracker):
    """Base class: chain of plane, colour and contour cues, followed by a snake."""

    randomness = Randomness.GENERATOR
    choices = {
        "operator between the mean posteriors inside and outside a region": (
            "difference",
            "the printed operator cannot be read; a ratio has no bound if the mean outside is 0",
        ),
        "weight of a negative difference, with `weights=literal`": (
            0.0,
            "not printed; no weight of a particle is negative",
        ),
        "fixed point of the affine deformation": (
            "mean of the contour's points",
            "differs from the text: section 4.3 prints image coordinates; a change of size would "
            "then displace a target far from the image corner",
        ),
        "minimum number of pixels inside a contour": (
            MIN_AREA,
            "the mean of few pixels is noise",
        ),
        "image width to which distances refer [pixels]": (
            REFERENCE_WIDTH,
            "distances then scale with the image",
        ),
        "numbers of colours of the first plane and mixtures, target and background": (
            (TARGET_POINTS, BACKGROUND_POINTS),
            "not printed; the background has more colours",
        ),
        "nearest neighbours of the discriminant analysis": (
            NEIGHBOURS,
            "the paper's [3] leaves the number open",
        ),
        "expectation maximisation of the first frame": (
            f"{FIT_STEPS} steps from centres of k-means++",
            "not printed; the centres are random, but far apart",
        ),
        "variance added to each Gaussian": (
            REGULARISATION,
            "a Gaussian of equal colours would be singular; about 4 grey levels",
        ),
        "α and β of the snake, for points at the spacing of the ellipses": (
            (ELASTICITY, RIGIDITY),
            "the paper's [7] leaves the weights open; chosen on the ellipses",
        ),
        "spacing of the points to which α and β refer [pixels]": (
            SPACING,
            "α and β multiply derivatives along the contour, as defined by the paper's [7]",
        ),
        "γ and κ of the snake, and its number of steps": (
            (STEP, ATTRACTION, ITERATIONS),
            "the paper's [7] leaves them open; a step is at most one pixel",
        ),
        "area of an accepted snake, relative to the mean contour": (
            (MIN_AREA_RATIO, MAX_AREA_RATIO),
            "a snake that collapses or crosses itself is no contour",
        ),
        "posterior whose edges attract the snake": (
            "that of the mixtures whose contours have the largest weight",
            "section 5.5 names the best colour hypothesis",
        ),
        "resampling": (
            "systematic",
            "section 2 names resampling with replacement, without a scheme",
        ),
    }

    @abstractmethod
    def chain_from(self, start: ChainStart) -> Chain:
        """Return the chain of plane, colour and contour cues in the first frame."""

    def contour_cue(
        self, start: ChainStart, cue_class: type[ContourCue] = ContourCue
    ) -> ContourCue:
        """Return the contour cue in the first frame."""
        self.contours = cue_class(start.contour, self.parameters, start.width)
        return self.contours

    def prepare_observation(self, observation: Observation, image: Image) -> Observation:
        """Return the observation with additional data for the cues."""
        return observation

    def learn(self, image: Image, inside: Mask, hypotheses: Sequence[Hypotheses]) -> None:
        """Update the cues from a segmented frame."""

    def colour_sets(self, image: Image, inside: Mask) -> tuple[Array, Array] | None:
        """Return colours (n, 3) of segmented target and background; None if either has no pixel."""
        target, background = certain_pixels(inside)
        if not target.any() or not background.any():
            return None
        of_target, of_background = REFIT_POINTS
        return (
            draw_colours(image, target, of_target, self.generator),
            draw_colours(image, background, of_background, self.generator),
        )

    def init_shared(self, frame: SharedFrame, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`; raise TrackerError for an invalid, empty or full mask."""
        parameters = self.parameters
        self.generator = np.random.default_rng(self.seed)
        height, width = frame.image.shape[:2]
        subject = "mask"
        if mask is None or parameters.start == "box":
            subject = f"box {np.round(box, 1).tolist()}"
            mask = np.zeros((height, width), bool)
            if (box[2:] > 0).all():
                mask = inscribed_ellipse(box, height, width)
        if mask.shape != (height, width) or mask.dtype != np.bool_:
            raise TrackerError(
                f"the mask is {mask.dtype} of shape {mask.shape}. Expected: bool of the image's "
                f"shape ({height}, {width})."
            )
        target, background = certain_pixels(mask)
        if not target.any() or not background.any():
            raise TrackerError(
                f"{subject}: the target covers no pixel of the image ({width}x{height}), or all "
                "of them. Use another box or mask."
            )
        target_colours = draw_colours(frame.image, target, TARGET_POINTS, self.generator)
        background_colours = draw_colours(
            frame.image, background, BACKGROUND_POINTS, self.generator
        )
        basis = discriminant_basis(target_colours, background_colours)
        fit = ColourFit(
            target_colours,
            background_colours,
            fit_mixture(target_colours @ basis, parameters.object_components, self.generator),
            fit_mixture(
                background_colours @ basis, parameters.background_components, self.generator
            ),
        )
        self.contour = outline(mask, parameters.contour_points)
        self.chain = self.chain_from(ChainStart(basis, fit, self.contour, width))

    def update_shared(self, frame: SharedFrame) -> Estimate:
        """See `SharingTracker.update_shared`."""
        parameters, image = self.parameters, frame.image
        cells = frame.compute(colour_cells, parameters.colour_levels)
        hypotheses = self.chain.step(self._observation(cells, image), self.generator)
        contours = hypotheses[-1]
        mean: Array = np.einsum("n,npd->pd", contours.weights, contours.states)
        posterior = best_posterior(hypotheses)[cells.image]
        self.contour, accepted = mean, False
        if parameters.snake:
            edges = posterior if parameters.snake_edges == "supported" else None
            self.contour, accepted = refine_by_snake(mean, image, edges)
        anchors = round(parameters.snake_feedback * parameters.contour_samples)
        self.contours.anchors = np.repeat(self.contour[np.newaxis], anchors, axis=0)
        inside = fill_contour(self.contour, *image.shape[:2])
        self.learn(image, inside, hypotheses)
        box, mask = self._select_output(mean, inside, posterior)
        score = float(contours.evidence.max())
        details = {"score": score, "snake": float(accepted)}
        for name, cue in zip(("planes", "colours", "contours"), hypotheses, strict=True):
            weights = cue.weights
            details[f"effective_{name}"] = effective_sample_size(weights) / len(weights)
        return Estimate(
            box,
            confidence=max(score, 0.0),
            mask=mask,
            details=details,
            arrays={"contour": self.contour, "mean_contour": mean, "posterior": posterior},
        )

    def _observation(self, cells: ColourCells, image: Image) -> Observation:
        parameters = self.parameters
        height, width = image.shape[:2]
        margin = parameters.window_margin * width / REFERENCE_WIDTH
        window = window_around(self.contour, margin, parameters.window_growth, width, height)
        x0, y0, x1, y1 = window
        prior = parameters.object_prior
        if prior == "area":
            share = enclosed_area(self.contour) / ((x1 - x0) * (y1 - y0))
            prior = min(max(share, MIN_PRIOR), 1 - MIN_PRIOR)
        ring = inf if parameters.ring == "image" else parameters.ring
        return self.prepare_observation(observe(cells, window, prior, ring), image)

    def _select_output(self, mean: Array, inside: Mask, posterior: Posterior) -> tuple[Box, Mask]:
        """Return box and mask of the requested output."""
        if self.parameters.output == "snake":
            return bounding_box(self.contour), inside
        if self.parameters.output == "mean":
            return bounding_box(mean), fill_contour(mean, *inside.shape)
        mask = posterior > 0.5
        rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
        if not len(rows):  # no pixel exceeds one half: use the contour
            return bounding_box(self.contour), mask
        x, y, right, bottom = columns[0], rows[0], columns[-1] + 1, rows[-1] + 1
        return np.array([x, y, right - x, bottom - y], np.float64), mask


def certain_pixels(mask: Mask) -> tuple[Mask, Mask]:
    """Return masks of the target without its border (if thick) and of pixels 2 px outside it."""
    pixels = mask.astype(np.uint8)
    target = cv2.erode(pixels, np.ones((3, 3), np.uint8), borderValue=0) > 0
    background = cv2.dilate(pixels, np.ones((5, 5), np.uint8), borderValue=0) == 0
    return target if target.any() else mask, background


def best_posterior(hypotheses: Sequence[Hypotheses]) -> Posterior:
    """Return the posterior (cells,) of the mixtures whose attached contours weigh most in sum."""
    colours, contours = hypotheses[-2:]
    supported = complete_combinations(hypotheses)[-2]
    support = np.zeros(len(colours.weights))
    np.add.at(support, supported, contours.weights)
    best: Posterior = colours.evidence[support.argmax()]
    return best
