"""moreno2005 and its baseline in plain NumPy, section by section, one hypothesis at a time.

Written down from the paper's text: what is attached to what and what goes on, windows and regions
pixel by pixel; dynamics and weights are in `plain_cues`. What has a slow reference of its own
stands only there, and is taken from the trackers here: Fisher planes and cells of colour space
(`test_cues`), mixtures and posteriors (`test_mixture`, `test_posterior`), outlines, fillings and
snakes (`test_outline`, `test_snake`). By agreement, as the text is silent, the order of the random
numbers and the constants that have no parameter are the same. Contours whose place is a Kalman
filter's are not here, nor are other answers than the snake's.
"""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import binary_dilation, binary_erosion

from tests.trackers.plain_cues import (
    STEPS,
    Samples,
    SmoothColours,
    basis_on,
    drawn,
    moved_colours,
    moved_contours,
    moved_planes,
    normalised,
    shares,
    weights_of,
)
from trackmark.trackers.contour_smooth_color import ContourSmoothColor
from trackmark.trackers.contours.mixture import (
    fit_mixture,
    from_components,
    project_mixture,
    refine_mixture,
    to_components,
)
from trackmark.trackers.contours.observation import colour_cells
from trackmark.trackers.contours.outline import enclosed_area, fill_contour, outline
from trackmark.trackers.contours.plane_cue import discriminant_basis, plane_normal
from trackmark.trackers.contours.posterior import posterior
from trackmark.trackers.contours.snake import refine_by_snake as refined_snake
from trackmark.trackers.moreno2005 import Moreno2005

FIRST_STEPS, STEPS_ON_PLANES = 15, 2  # of EM: at first, and on each plane after later ones
FIRST_COLOURS = 500, 1500  # drawn of target and background
LATER_COLOURS = 300, 600
NARROWEST = 8  # pixels of the image that a window keeps
SMALLEST = 60  # pixels in a contour
LEAST_PRIOR = 0.05  # of target and background, by areas
NEVER_QUITE_ZERO = 1e-12


# A frame (section 5.2)


class Frame:
    """Colours (K, 3) of the cells of colour space that the image occupies, and each pixel's cell;
    `window`: W; `around`: what it is compared with; `prior`: P(O).
    """

    def __init__(self, image, contour, settings):
        cells = colour_cells(image, settings.colour_levels)
        self.colours, self.cells = cells.colours, cells.image
        height, width = image.shape[:2]
        margin = settings.window_margin * width / 320
        least, most = contour.min(axis=0), contour.max(axis=0)
        more = margin + settings.window_growth * (most - least) / 2
        x0, x1 = _interval(least[0] - more[0], most[0] + more[0], width)
        y0, y1 = _interval(least[1] - more[1], most[1] + more[1], height)
        self.box = x0, y0, x1, y1
        self.window = np.zeros((height, width), bool)
        self.window[y0:y1, x0:x1] = True
        self.around = ~self.window
        if settings.ring != "image":
            middle, half = np.array([x0 + x1, y0 + y1]) / 2, np.array([x1 - x0, y1 - y0]) / 2
            (left, top), (right, bottom) = (middle + s * settings.ring * half for s in (-1, 1))
            within = np.zeros((height, width), bool)
            rows, columns = _interval(top, bottom, height), _interval(left, right, width)
            within[slice(*rows), slice(*columns)] = True
            self.around &= within
        self.prior = settings.object_prior
        if self.prior == "area":
            share = enclosed_area(contour) / self.window.sum()
            self.prior = min(max(share, LEAST_PRIOR), 1 - LEAST_PRIOR)

    def difference(self, posteriors):
        """Mean in W less mean around it, of posteriors of the cells."""
        pixels = posteriors[self.cells]
        outside = pixels[self.around].mean() if self.around.any() else 0.0
        return pixels[self.window].mean() - outside


def _interval(start, end, limit):
    """Pixels from start to end that are in the image."""
    narrowest = min(NARROWEST, limit)
    first = min(max(int(np.floor(start)), 0), limit - narrowest)
    return first, min(max(int(np.ceil(end)), first + narrowest), limit)


def drawn_colours(image, region, count, random):
    """RGB in [0, 1] of pixels of a region, drawn with replacement."""
    rows, columns = np.nonzero(region)
    chosen = random.integers(0, len(rows), count)
    return image[rows[chosen], columns[chosen], ::-1] / 255


def sure(mask):
    """Target and background without the pixels next to their border, on either side."""
    target = binary_erosion(mask, np.ones((3, 3)))
    background = ~binary_dilation(mask, np.ones((5, 5)))
    return target if target.any() else mask, background


# The trackers


class Found(NamedTuple):
    """Results of a frame: the snake R, the mean of the samples, the best posterior map, …"""

    contour: np.ndarray
    mean_contour: np.ndarray
    posterior: np.ndarray
    box: np.ndarray
    mask: np.ndarray
    snake: bool
    score: float


class PlainSegmenter:
    """Common part of both trackers: first frame, contours, snake (sections 5.4 and 5.5)."""

    tracker: type

    def __init__(self, seed, **parameters):
        self.settings = self.tracker.Parameters(**parameters)
        self.seed = seed

    def init(self, image, box, mask=None):
        """Take the target from a mask in the first frame, BGR, or from an ellipse in a box."""
        settings = self.settings
        self.random = np.random.default_rng(self.seed)
        if mask is None or settings.start == "box":
            rows, columns = np.indices(image.shape[:2]) + 0.5
            x, y, width, height = box.tolist()
            across, down = (columns - x) / width - 0.5, (rows - y) / height - 0.5
            mask = across**2 + down**2 <= 0.25
        sets = self.sets(image, mask, FIRST_COLOURS)
        self.basis = discriminant_basis(*sets)
        numbers = settings.object_components, settings.background_components
        mixtures = tuple(
            fit_mixture(colours @ self.basis, number, self.random, FIRST_STEPS)
            for colours, number in zip(sets, numbers, strict=True)
        )
        self.contour = outline(mask, settings.contour_points)
        self.contours = Samples(self.contour, settings.contour_samples)
        self.anchors = 0
        self.begin(sets, mixtures)

    def update(self, image):
        """Contour in the next frame, BGR."""
        frame = Frame(image, self.contour, self.settings)
        tables, weights = self.hypotheses(frame, image)
        differences = self.weigh_contours(frame, tables, weights)
        mean = np.tensordot(self.contours.weights, self.contours.states, axes=1)
        joint = shares(self.contours.attached, self.contours.weights, len(tables))
        self.contours.carried = self.contours.weights
        self.feed_back(joint)
        posteriors = tables[int(joint.argmax())][frame.cells]
        self.contour, snake = mean, False
        if self.settings.snake:
            edge_posteriors = posteriors if self.settings.snake_edges == "supported" else None
            self.contour, snake = refined_snake(
                mean, image, edge_posteriors, self.settings.snake_stiffness
            )
        self.anchors = round(self.settings.snake_feedback * self.settings.contour_samples)
        mask = fill_contour(self.contour, *image.shape[:2])
        self.learn(image, mask)
        least, most = self.contour.min(axis=0), self.contour.max(axis=0)
        box = np.concatenate([least, most - least])
        return Found(self.contour, mean, posteriors, box, mask, snake, float(differences.max()))

    def weigh_contours(self, frame, tables, weights):
        """Section 5.4: resample, propagate, attach colours, weigh; the differences."""
        settings, cue = self.settings, self.contours
        height, width = frame.cells.shape
        states = cue.resampled(self.random)
        states[: self.anchors] = self.contour
        cue.states = moved_contours(states, settings, width, self.random)
        cue.attached = drawn(weights, self.random.random(len(states)))
        region = np.full((height, width), True)
        if settings.outside == "window":
            x0, y0, x1, y1 = frame.box
            least = np.floor(cue.states.min(axis=(0, 1))).astype(int)
            most = np.ceil(cue.states.max(axis=(0, 1))).astype(int)
            region[:] = False
            rows = slice(max(min(y0, least[1]), 0), max(y1, most[1]))
            region[rows, max(min(x0, least[0]), 0) : max(x1, most[0])] = True
        differences = np.full(len(states), -1.0)
        for j, contour in enumerate(cue.states):
            within = fill_contour(contour, height, width)
            outside = region & ~within
            if within.sum() >= SMALLEST and outside.any():
                pixels = tables[cue.attached[j]][frame.cells]
                differences[j] = pixels[within].mean() - pixels[outside].mean()
        cue.weights = weights_of(differences, settings.weights, settings.contour_temperature)
        return differences

    def table(self, frame, state, basis):
        """p(O | c) of the frame's colours on a plane, by a state of x₂."""
        of_target = self.settings.object_components
        mixtures = from_components(state[:of_target]), from_components(state[of_target:])
        return posterior(frame.colours @ basis, *mixtures, self.settings.colour_floor, frame.prior)

    def sets(self, image, mask, counts):
        """Colours drawn of what is surely target, and surely background."""
        pairs = zip(sure(mask), counts, strict=True)
        return tuple(drawn_colours(image, region, n, self.random) for region, n in pairs)

    def later_sets(self, image, mask):
        """Return colours of a segmented frame; empty if one class has no pixel."""
        has_both = all(region.any() for region in sure(mask))
        return self.sets(image, mask, LATER_COLOURS) if has_both else ()


class PlainContourSmoothColor(PlainSegmenter):
    """The baseline: the same contours, with one smooth model of the colours (section 6)."""

    tracker = ContourSmoothColor

    def begin(self, sets, mixtures):
        self.model = SmoothColours(sets, mixtures, self.settings.mixing)
        self.plane = self.basis

    def hypotheses(self, frame, image):
        self.random.random(1)  # for the one plane that the one hypothesis goes with
        return [self.table(frame, self.model.predicted(), self.plane)], np.ones(1)

    def feed_back(self, joint):
        """The one hypothesis has all the weight."""

    def learn(self, image, mask):
        """Mixtures of the last frame, on the first frame's plane or on its own."""
        sets = self.later_sets(image, mask)
        if not sets:
            return
        moved = self.settings.plane == "refitted"
        if moved:
            normal = plane_normal(discriminant_basis(*sets))
            side = 1 if normal @ plane_normal(self.basis) >= 0 else -1
            self.plane = basis_on(side * normal, self.basis)
        self.model.learn(sets, self.plane, moved)


class PlainMoreno2005(PlainSegmenter):
    """Plane, colours and contour, each given what was seen of those before."""

    tracker = Moreno2005

    def begin(self, sets, mixtures):
        settings = self.settings
        self.planes = Samples(plane_normal(self.basis), settings.plane_samples)
        state = np.concatenate([to_components(mixture) for mixture in mixtures])
        self.colours = Samples(state, settings.colour_samples)
        self.refitted = SmoothColours(sets, mixtures, 1.0)

    def hypotheses(self, frame, image):
        bases = self.weigh_planes(frame, image)
        tables = self.weigh_colours(frame, bases)
        return tables, self.association(self.colours)

    def weigh_planes(self, frame, image):
        """Section 5.2: each plane by posteriors of W, with mixtures of its own."""
        settings, random, cue = self.settings, self.random, self.planes
        beyond = frame.around if frame.around.any() else frame.window
        colours_in = drawn_colours(image, frame.window, settings.window_points, random)
        mixture_in = fit_mixture(colours_in, settings.window_components, random, STEPS)
        colours_out = drawn_colours(image, beyond, settings.outside_points, random)
        mixture_out = fit_mixture(colours_out, settings.background_components, random, STEPS)
        cue.states = moved_planes(cue.resampled(random), self.basis, settings.plane_spread, random)
        bases = [basis_on(normal, self.basis) for normal in cue.states]
        differences = []
        for phi in bases:
            of_window = refine_mixture(
                colours_in @ phi, project_mixture(mixture_in, phi), STEPS_ON_PLANES
            )
            of_outside = refine_mixture(
                colours_out @ phi, project_mixture(mixture_out, phi), STEPS_ON_PLANES
            )
            p = posterior(frame.colours @ phi, of_window, of_outside, settings.colour_floor, 0.5)
            differences.append(frame.difference(p))
        temperature = settings.plane_temperature
        cue.weights = weights_of(np.array(differences), settings.weights, temperature)
        return bases

    def weigh_colours(self, frame, bases):
        """Section 5.3: each pair of mixtures on a plane drawn by the weights of these."""
        settings, random, cue = self.settings, self.random, self.colours
        if settings.colour_model == "particles":
            cue.states = moved_colours(cue.resampled(random), settings, random)
        else:
            cue.states = np.stack([self.refitted.predicted()] * settings.colour_samples)
        cue.attached = drawn(self.association(self.planes), random.random(len(cue.states)))
        pairs = zip(cue.states, cue.attached.tolist(), strict=True)
        tables = [self.table(frame, state, bases[k]) for state, k in pairs]
        differences = np.array([frame.difference(table) for table in tables])
        cue.weights = weights_of(differences, settings.weights, settings.colour_temperature)
        return tables

    def association(self, cue):
        """Probabilities by which samples are attached to those of the next cue."""
        if self.settings.association == "by-weight":
            return cue.weights
        return np.full(len(cue.weights), 1 / len(cue.weights))

    def feed_back(self, joint):
        """Each cue's own weights (equation 4), or the marginals of equation 7's triples."""
        of_planes, of_colours = self.planes.weights, self.colours.weights
        if self.settings.feedback == "joint":
            of_colours = normalised(joint + NEVER_QUITE_ZERO)
            together = shares(self.colours.attached, joint, len(of_planes))
            of_planes = normalised(together + NEVER_QUITE_ZERO)
        self.planes.carried, self.colours.carried = of_planes, of_colours

    def learn(self, image, mask):
        """Mixtures of the last frame, on its best plane, where there are no samples of them."""
        if self.settings.colour_model == "particles":
            return
        sets = self.later_sets(image, mask)
        if sets:
            best = self.planes.states[self.planes.weights.argmax()]
            self.refitted.learn(sets, basis_on(best, self.basis), moved=True)
