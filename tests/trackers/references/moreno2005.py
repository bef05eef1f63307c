"""Trackers `moreno2005` and `contour-smooth-color` in plain NumPy, one hypothesis at a time.

They follow the paper's sections. Functions with a slow reference of their own are imported from the
trackers: discriminant planes and colour cells (`test_cues`), mixtures and posteriors
(`test_colours`), outlines, fillings and snakes (`test_contours`).
The text does not specify the order of random numbers and some constants, which equal the trackers'.
The Kalman contour cue and other outputs than the snake's are not included.
"""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import binary_dilation, binary_erosion
from scipy.optimize import linear_sum_assignment

from trackmark.trackers.contour_smooth_color import ContourSmoothColor
from trackmark.trackers.contours.mixture import (
    Mixture,
    fit_mixture,
    from_components,
    project_mixture,
    refine_mixture,
    to_components,
)
from trackmark.trackers.contours.observation import colour_cells
from trackmark.trackers.contours.outline import enclosed_area, fill_contour, outline
from trackmark.trackers.contours.plane_cue import discriminant_basis, plane_basis, plane_normal
from trackmark.trackers.contours.posterior import posterior
from trackmark.trackers.contours.snake import refine_by_snake as refined_snake
from trackmark.trackers.moreno2005 import Moreno2005

EIGENVALUES = 2e-4, 0.15  # least and most
STEPS = 6  # of EM


class Samples:
    """Weighted samples of a cue (section 2).

    `carried` are the weights for the next frame. `attached` is the sample of the previous cue that
    each sample was weighed with.
    """

    def __init__(self, start, count):
        self.states = np.stack([start] * count)
        self.weights = self.carried = np.full(count, 1 / count)
        self.attached = np.zeros(0, np.intp)

    def resampled(self, random):
        """Return states by systematic resampling."""
        n = len(self.states)
        return self.states[select_samples(self.carried, (np.arange(n) + random.random(n)[0]) / n)]


def select_samples(weights, positions):
    """Return the sample at each position, in [0, 1), of the cumulative weights."""
    cumulative = np.cumsum(weights)
    actual = np.searchsorted(cumulative, positions * cumulative[-1], side="right")
    return np.minimum(actual, len(weights) - 1)


def weights_of(differences, kind, temperature):
    """Return weights of differences of mean posteriors (sections 5.2 to 5.4)."""
    if kind == "literal":
        return normalised(np.maximum(differences, 0))
    return normalised(np.exp((differences - differences.max()) / temperature))


def normalised(weights):
    """Return weights that sum to 1; all equal if none is above 0."""
    total = weights.sum()
    return weights / total if total > 0 else np.full(len(weights), 1 / len(weights))


def shares(attached, weights, count):
    """Return the sum of the weights of the samples that are attached to each sample."""
    return np.array([weights[attached == sample].sum() for sample in range(count)])


def basis_on(normal, reference):
    return plane_basis(normal[np.newaxis], reference)[0]


def moved_planes(normals, reference, spread, random):
    """Return unit normals moved by equation 5 (section 4.1), on the reference normal's side."""
    h = np.eye(3) + random.normal(0, spread, (len(normals), 3, 3))
    p = random.normal(0, spread, normals.shape)
    moved = []
    for j, normal in enumerate(normals):
        s = h[j] @ normal + p[j]
        s /= np.linalg.norm(s)
        moved.append(-s if s @ plane_normal(reference) < 0 else s)
    return np.array(moved)


def moved_colours(states, settings, random):
    """Return moved components of six numbers (section 4.2), the target's first.

    Each number has its own noise. `shared` dynamics also apply one random linear map to all means.
    """
    n, m, _ = states.shape
    of_target = settings.object_components
    moved = states.copy()
    if settings.colour_dynamics == "shared":
        g = random.normal(0, settings.gain_spread, n)
        jumps = random.random(n) < settings.jump_probability
        g += np.where(jumps, random.normal(0, settings.jump_spread, n), 0)
        e = random.normal(0, settings.gain_spread / 2, (n, 2, 2))
        tau = random.normal(0, settings.class_spread, (n, 2, 2))  # of target and background
        for j in range(n):
            a = np.exp(g[j]) * np.eye(2) + e[j]
            for k in range(m):
                moved[j, k, 1:3] = a @ states[j, k, 1:3] + tau[j, 0 if k < of_target else 1]
            moved[j, :, 3:5] *= np.exp(g[j])
    moved[:, :, 1:3] += random.normal(0, settings.mean_spread, (n, m, 2))
    moved[:, :, 3:5] *= np.exp(random.normal(0, settings.eigenvalue_spread, (n, m, 2)))
    moved[:, :, 0] *= np.exp(random.normal(0, settings.prior_spread, (n, m)))
    moved[:, :, 5] += random.normal(0, settings.angle_spread, (n, m))
    moved[:, :, 3:5] = np.clip(moved[:, :, 3:5], *EIGENVALUES)
    for state in moved:
        state[:of_target, 0] /= state[:of_target, 0].sum()
        state[of_target:, 0] /= state[of_target:, 0].sum()
    return moved


class SmoothColours:
    """G(t) = (1 - a) G(t-2) + a G(t-1), each fitted to a frame as it was segmented (section 6)."""

    def __init__(self, sets, mixtures, mixing):
        self.sets, self.older, self.newer = sets, mixtures, mixtures
        self.a = mixing

    def predicted(self):
        """Return the components of both mixtures, the target's first, shape (m, 6)."""
        both = zip(self.older, self.newer, strict=True)
        return np.concatenate([to_components(self._blended(*pair)) for pair in both])

    def learn(self, sets, basis, moved):
        """Fit mixtures to the last frame on a plane; `moved`: whether the plane has changed."""
        older = self.newer
        if moved:
            older = self._fitted(self.sets, basis, older)
        self.sets, self.older, self.newer = sets, older, self._fitted(sets, basis, older)

    def _fitted(self, sets, basis, start):
        pairs = zip(sets, start, strict=True)
        return tuple(refine_mixture(colours @ basis, mixture, STEPS) for colours, mixture in pairs)

    def _blended(self, older, newer):
        """Blend pairs of components with near means."""
        costs = ((newer.means[:, np.newaxis] - older.means) ** 2).sum(axis=2)
        partners = linear_sum_assignment(costs)[1]
        parts = zip(older, newer, strict=True)
        return Mixture(*((1 - self.a) * g2[partners] + self.a * g1 for g2, g1 in parts))


def moved_contours(contours, settings, width, random):
    """Return contours moved by equation 5 (section 4.3): s = m + H (s' - m) + p, m = mean of s'."""
    affine = [
        [settings.stretch_x_spread, settings.shear_x_spread],
        [settings.shear_y_spread, settings.stretch_y_spread],
    ]
    shift = np.array([settings.shift_x_spread, settings.shift_y_spread]) * width / 320
    h = np.eye(2) + random.normal(size=(len(contours), 2, 2)) * np.array(affine)
    p = random.normal(size=(len(contours), 2)) * shift
    moved = []
    for j, contour in enumerate(contours):
        m = contour.mean(axis=0)
        moved.append(m + (contour - m) @ h[j].T + p[j])
    return np.array(moved)


FIRST_STEPS, STEPS_ON_PLANES = 15, 2  # of EM: at first, and on each plane after later ones
FIRST_COLOURS = 500, 1500  # drawn pixels of target and background
LATER_COLOURS = 300, 600
NARROWEST = 8  # pixels of the image that a window keeps
SMALLEST = 60  # pixels in a contour
LEAST_PRIOR = 0.05  # of target and background, by areas
NEVER_QUITE_ZERO = 1e-12


class Frame:
    """Colours (K, 3) of the image's colour cells, cell of each pixel, and regions (section 5.2).

    `window`: W; `around`: pixels that W is compared with; `prior`: P(O).
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
        """Return the mean posterior in W minus that around W."""
        pixels = posteriors[self.cells]
        outside = pixels[self.around].mean() if self.around.any() else 0.0
        return pixels[self.window].mean() - outside


def _interval(start, end, limit):
    """Return the pixels from start to end, clipped to the image."""
    narrowest = min(NARROWEST, limit)
    first = min(max(int(np.floor(start)), 0), limit - narrowest)
    return first, min(max(int(np.ceil(end)), first + narrowest), limit)


def drawn_colours(image, region, count, random):
    """Return RGB in [0, 1] of pixels of a region, drawn with replacement."""
    rows, columns = np.nonzero(region)
    chosen = random.integers(0, len(rows), count)
    return image[rows[chosen], columns[chosen], ::-1] / 255


def certain_regions(mask):
    """Return target and background without the pixels next to their border."""
    target = binary_erosion(mask, np.ones((3, 3)))
    background = ~binary_dilation(mask, np.ones((5, 5)))
    return target if target.any() else mask, background


class FrameResult(NamedTuple):
    """Results of a frame: the snake, the mean of the samples, the best posterior map, …"""

    contour: np.ndarray
    mean_contour: np.ndarray
    posterior: np.ndarray
    box: np.ndarray
    mask: np.ndarray
    snake: bool
    score: float


class PlainSegmenter:
    """Base class of both trackers: first frame, contours, snake (sections 5.4 and 5.5)."""

    tracker: type

    def __init__(self, seed, **parameters):
        self.settings = self.tracker.Parameters(**parameters)
        self.seed = seed

    def init(self, image, box, mask=None):
        """Initialise from a mask in the first frame, or from an ellipse in a box."""
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
        """Return the results of the next frame."""
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
            self.contour, snake = refined_snake(mean, image, edge_posteriors)
        self.anchors = round(self.settings.snake_feedback * self.settings.contour_samples)
        mask = fill_contour(self.contour, *image.shape[:2])
        self.learn(image, mask)
        least, most = self.contour.min(axis=0), self.contour.max(axis=0)
        box = np.concatenate([least, most - least])
        return FrameResult(
            self.contour, mean, posteriors, box, mask, snake, float(differences.max())
        )

    def weigh_contours(self, frame, tables, weights):
        """Resample, propagate, attach and weigh (section 5.4), and return the differences."""
        settings, cue = self.settings, self.contours
        height, width = frame.cells.shape
        states = cue.resampled(self.random)
        states[: self.anchors] = self.contour
        cue.states = moved_contours(states, settings, width, self.random)
        cue.attached = select_samples(weights, self.random.random(len(states)))
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
        """Return p(O | c) of the frame's colours on a plane for a state of the mixtures."""
        of_target = self.settings.object_components
        mixtures = from_components(state[:of_target]), from_components(state[of_target:])
        return posterior(frame.colours @ basis, *mixtures, frame.prior)

    def sets(self, image, mask, counts):
        """Return colours of certain target pixels, and of certain background pixels."""
        pairs = zip(certain_regions(mask), counts, strict=True)
        return tuple(drawn_colours(image, region, n, self.random) for region, n in pairs)

    def later_sets(self, image, mask):
        """Return colours of a segmented frame; empty if one class has no pixel."""
        has_both = all(region.any() for region in certain_regions(mask))
        return self.sets(image, mask, LATER_COLOURS) if has_both else ()


class PlainContourSmoothColor(PlainSegmenter):
    """Baseline: the same contours with one smooth colour model (section 6)."""

    tracker = ContourSmoothColor

    def begin(self, sets, mixtures):
        self.model = SmoothColours(sets, mixtures, self.settings.mixing)
        self.plane = self.basis

    def hypotheses(self, frame, image):
        self.random.random(1)  # for the single plane
        return [self.table(frame, self.model.predicted(), self.plane)], np.ones(1)

    def feed_back(self, joint):
        """Do nothing: the single hypothesis has all the weight."""

    def learn(self, image, mask):
        """Fit mixtures to the last frame, on the plane of the first frame or of the last one."""
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
    """Tracker with dependent cues for plane, colours and contour."""

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
        """Weigh each plane by posteriors of W, with its own mixtures (section 5.2)."""
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
            p = posterior(frame.colours @ phi, of_window, of_outside, 0.5)
            differences.append(frame.difference(p))
        temperature = settings.plane_temperature
        cue.weights = weights_of(np.array(differences), settings.weights, temperature)
        return bases

    def weigh_colours(self, frame, bases):
        """Weigh each pair of mixtures on a plane that is drawn by weight (section 5.3)."""
        settings, random, cue = self.settings, self.random, self.colours
        if settings.colour_model == "particles":
            cue.states = moved_colours(cue.resampled(random), settings, random)
        else:
            cue.states = np.stack([self.refitted.predicted()] * settings.colour_samples)
        cue.attached = select_samples(self.association(self.planes), random.random(len(cue.states)))
        pairs = zip(cue.states, cue.attached.tolist(), strict=True)
        tables = [self.table(frame, state, bases[k]) for state, k in pairs]
        differences = np.array([frame.difference(table) for table in tables])
        cue.weights = weights_of(differences, settings.weights, settings.colour_temperature)
        return tables

    def association(self, cue):
        """Return the probabilities of samples to be attached to those of the next cue."""
        if self.settings.association == "by-weight":
            return cue.weights
        return np.full(len(cue.weights), 1 / len(cue.weights))

    def feed_back(self, joint):
        """Carry each cue's own weights (equation 4), or the marginals of equation 7's triples."""
        of_planes, of_colours = self.planes.weights, self.colours.weights
        if self.settings.feedback == "joint":
            of_colours = normalised(joint + NEVER_QUITE_ZERO)
            together = shares(self.colours.attached, joint, len(of_planes))
            of_planes = normalised(together + NEVER_QUITE_ZERO)
        self.planes.carried, self.colours.carried = of_planes, of_colours

    def learn(self, image, mask):
        """Fit mixtures to the last frame on its best plane, unless they are particles."""
        if self.settings.colour_model == "particles":
            return
        sets = self.later_sets(image, mask)
        if sets:
            best = self.planes.states[self.planes.weights.argmax()]
            self.refitted.learn(sets, basis_on(best, self.basis), moved=True)
