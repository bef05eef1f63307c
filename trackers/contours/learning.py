"""Dynamics estimated off-line from hand-segmented sequences (Moreno-Noguer et al. 2005, section 4).

The paper says no more than that it is done by least squares. Here each step from a frame to the
next tells how far a random walk went: the plane's normal, the affine map of the contour, each
component of the colours. Random walks have no drift, so deviations are those from zero.
"""

from collections.abc import Iterable, Sequence
from itertools import pairwise
from math import log, sqrt
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from trackers.base.interface import Image, Mask
from trackers.base.parameters import TrackerError
from trackers.contours.colour_cue import ANGLE, EIGENVALUES, MEAN, WEIGHT, MixtureScale
from trackers.contours.mixture import Mixture, components_of, fitted, refined
from trackers.contours.observation import colours_of
from trackers.contours.outline import outline
from trackers.contours.plane_cue import discriminant_basis, oriented, plane_normal
from trackers.contours.segmenter import REFERENCE_WIDTH, surely

__all__ = ["Segmented", "Steps", "affine_map", "learnt", "steps_of"]

Array: TypeAlias = NDArray[np.float64]
Segmented: TypeAlias = tuple[Image, Mask | None]
"""A frame, and the target's pixels in it; None where they are not known."""

CONTOUR_POINTS = 32
FINER = 8  # times as many places at which a contour may begin
STIFFNESS = 50.0  # square pixels; it settles where a round contour begins
COMPONENTS = 2, 5  # of target and background
LEAST_PIXELS = 10  # of target and background
PLANE_COLOURS = 500, 1500
MIXTURE_COLOURS = 5000
FIRST_ITERATIONS, ITERATIONS = 15, 6  # of expectation maximisation
LEAST_JUMP = 0.15  # of the logarithm of the light, which iterations don't follow by themselves


class Steps(NamedTuple):
    """What went on from one frame to the next, n times.

    Components are those of both mixtures on the first frame's plane, the target's first; see
    `trackers.contours.mixture.components_of`.
    """

    normals: Array  # (n, 2, 3): the plane's, before and after
    maps: Array  # (n, 2, 2): H of the contour, see `affine_map`
    shifts: Array  # (n, 2): and p, in pixels of an image 320 wide
    components: Array  # (n, 2, components, 6): before and after


class _Seen(NamedTuple):
    """What a frame shows."""

    normal: Array
    contour: Array  # with FINER times as many points
    mixtures: tuple[Mixture, ...]


def steps_of(frames: Iterable[Segmented], generator: np.random.Generator) -> Steps:
    """Measure the steps of a segmented sequence: frames in order, BGR images of one size.

    Steps from and to frames without a mask, or with hardly a pixel in or outside it, are left out.
    Raises TrackerError where no two frames on end have masks.
    """
    seen: list[_Seen | None] = []
    basis: Array | None = None
    mixtures: tuple[Mixture, ...] = ()
    width = REFERENCE_WIDTH
    for image, mask in frames:
        regions = () if mask is None else surely(mask)
        if mask is None or min(map(np.count_nonzero, regions)) < LEAST_PIXELS:
            seen.append(None)
            continue
        width = image.shape[1]
        colours = [colours_of(image[region]) for region in regions]
        target_colours, background_colours = map(_some, colours, PLANE_COLOURS)
        own = discriminant_basis(target_colours, background_colours)
        basis = own if basis is None else basis
        points = [_some(some, MIXTURE_COLOURS) @ basis for some in colours]
        mixtures = _mixtures(points, mixtures, generator)
        contour = outline(mask, CONTOUR_POINTS * FINER)
        seen.append(_Seen(plane_normal(own), contour, mixtures))
    pairs = [(a, b) for a, b in pairwise(seen) if a is not None and b is not None]
    if not pairs:
        raise TrackerError("no two frames on end have masks, so there is no step to learn from.")
    contours = [affine_map(before.contour[::FINER], after.contour) for before, after in pairs]
    components = [
        [np.concatenate([components_of(mixture) for mixture in part.mixtures]) for part in pair]
        for pair in pairs
    ]
    return Steps(
        np.array([[a.normal, *oriented(b.normal[np.newaxis], a.normal)] for a, b in pairs]),
        np.array([affine for affine, _ in contours]),
        np.array([shift for _, shift in contours]) * (REFERENCE_WIDTH / width),
        np.array(components),
    )


def _some(colours: Array, count: int) -> Array:
    """At most so many colours, evenly from all over the region."""
    chosen = np.linspace(0, len(colours) - 1, min(count, len(colours))).astype(np.intp)
    return colours[chosen]


def _mixtures(
    points: Sequence[Array], before: tuple[Mixture, ...], generator: np.random.Generator
) -> tuple[Mixture, ...]:
    """Mixtures of target and background, from those of the frame before on; none at first."""
    if not before:
        return tuple(
            fitted(some, count, generator, FIRST_ITERATIONS)
            for some, count in zip(points, COMPONENTS, strict=True)
        )
    starts = _in_the_light(points, before)
    return tuple(
        _in_order(start, refined(some, start, ITERATIONS))
        for some, start in zip(points, starts, strict=True)
    )


def _in_the_light(points: Sequence[Array], before: tuple[Mixture, ...]) -> tuple[Mixture, ...]:
    """Mixtures as they would be in the light of new colours, where it has jumped.

    From those of another light, expectation maximisation would end with components of others.
    """
    middles = [mixture.weights @ mixture.means for mixture in before]
    along = sum(some.mean(axis=0) @ middle for some, middle in zip(points, middles, strict=True))
    gain = float(along / sum(middle @ middle for middle in middles))
    if abs(log(gain)) < LEAST_JUMP:
        return before
    return tuple(
        Mixture(mixture.weights, gain * mixture.means, gain**2 * mixture.covariances)
        for mixture in before
    )


def _in_order(before: Mixture, after: Mixture) -> Mixture:
    """The components in the order of those nearest to them before."""
    distances = np.square(before.means[:, np.newaxis] - after.means).sum(axis=2)
    _, partners = linear_sum_assignment(distances)
    return Mixture(*(part[partners] for part in after))


def affine_map(before: Array, after: Array) -> tuple[Array, Array]:
    """H (2, 2) and p (2,) [pixels] of r = m + H (r' - m) + p by least squares.

    m is the mean of the points of r', `before` (points, 2). Of r, `after` (k · points, 2), every
    k-th point is taken. Which point has become which is not known: of all at which r may begin, the
    point is taken that leaves the least error, with 50 |H - I|² added.
    """
    points, finer = len(before), len(after) // len(before)
    centre = before.mean(axis=0)
    r = before - centre
    starts = np.arange(len(after))[:, np.newaxis]
    candidates = after[(starts + finer * np.arange(points)) % len(after)]
    shifts = candidates.mean(axis=1)
    moved = candidates - shifts[:, np.newaxis]
    stiff = STIFFNESS * np.eye(2)
    maps = (np.swapaxes(moved, 1, 2) @ r + stiff) @ np.linalg.inv(r.T @ r + stiff)
    errors = np.square(moved - r @ np.swapaxes(maps, 1, 2)).sum(axis=(1, 2))
    errors += STIFFNESS * np.square(maps - np.eye(2)).sum(axis=(1, 2))
    best = errors.argmin()
    return maps[best], shifts[best] - centre


CLASSES = slice(0, COMPONENTS[0]), slice(COMPONENTS[0], None)  # target and background
LEAST_WEIGHT = 0.01  # of a component that is looked at: of fewer pixels there is little to see
LEAST_LENGTH = 2.0  # ratio of eigenvalues from which on a component has a direction
NORMAL = 1.4826  # a normal deviation over the median of absolute values
TAIL = 3.0  # deviations of the gain beyond which it has jumped


def learnt(steps: Sequence[Steps], colour_dynamics: MixtureScale) -> dict[str, float]:
    """Values of the trackers' parameters that fit the steps of one or more sequences.

    They are in the order of `trackers.contours.dynamics.LEARNT`. Of colours, medians of absolute
    values are taken, as a component that is lost or found again says nothing of how colours go on.
    With `shared`, what centroids do besides is told apart from a gain that all of them share, and
    from what those of a class share; with `diagonal` they go on by themselves, without a gain.
    """
    normals, maps, shifts, components = (
        np.concatenate(parts) for parts in zip(*steps, strict=True)
    )
    turned = np.square(normals[:, 1] - normals[:, 0]).sum(axis=1).mean()
    affine = np.sqrt(np.square(maps - np.eye(2)).mean(axis=0)).ravel().tolist()
    shift = np.sqrt(np.square(shifts).mean(axis=0)).tolist()
    names = ("stretch_x_spread", "shear_x_spread", "shear_y_spread", "stretch_y_spread")
    return {
        # H and p have this deviation both, and turn the normal about two axes.
        "plane_spread": sqrt(turned / 4),
        **dict(zip(names, affine, strict=True)),
        "shift_x_spread": shift[0],
        "shift_y_spread": shift[1],
        **(_shared(components) if colour_dynamics == "shared" else _diagonal(components)),
    }


def _shared(components: Array) -> dict[str, float]:
    """Values of colours that share a gain; components before and after as in `Steps`."""
    before, after = components[:, 0], components[:, 1]
    weights = before[..., WEIGHT]
    along = (weights * (before[..., MEAN] * after[..., MEAN]).sum(axis=2)).sum(axis=1)
    gains = np.log(along / (weights * np.square(before[..., MEAN]).sum(axis=2)).sum(axis=1))
    gain = _deviation([[gains]])
    jumps = gains[np.abs(gains) > TAIL * gain]
    scaled = np.exp(gains)[:, np.newaxis, np.newaxis] * before[..., MEAN]
    moves = _by_class(after[..., MEAN] - scaled, components)
    mean = _deviation([_apart(own) for own in moves])
    together = _deviation([[of_step.mean(axis=0) for of_step in own] for own in moves])
    # The mean of k centroids has a k-th of their variance besides what they share.
    share = np.mean([1 / len(of_step) for own in moves for of_step in own])
    return {
        "mean_spread": mean,
        "class_spread": sqrt(max(together**2 - mean**2 * float(share), 0.0)),
        "gain_spread": gain,
        "jump_probability": len(jumps) / len(gains),
        "jump_spread": sqrt(float(np.square(jumps).mean())) if len(jumps) else 0.0,
        **_shapes(components, gains),
    }


def _diagonal(components: Array) -> dict[str, float]:
    """Values of colours that go on by themselves."""
    moves = _by_class(components[:, 1, :, MEAN] - components[:, 0, :, MEAN], components)
    return {"mean_spread": _deviation(moves), **_shapes(components, np.zeros(len(components)))}


def _shapes(components: Array, gains: Array) -> dict[str, float]:
    """Values of weights, eigenvalues and angles."""
    before, after = components[:, 0], components[:, 1]
    logarithms = np.log(np.maximum(components[..., WEIGHT], LEAST_WEIGHT))
    priors = _by_class(logarithms[:, 1] - logarithms[:, 0], components)
    growth = np.log(after[..., EIGENVALUES] / before[..., EIGENVALUES])
    growth -= gains[:, np.newaxis, np.newaxis]
    turns = (after[..., ANGLE] - before[..., ANGLE] + np.pi / 2) % np.pi - np.pi / 2
    first, second = np.moveaxis(components[..., EIGENVALUES], -1, 0)
    long = np.all(first > LEAST_LENGTH * second, axis=1)
    return {
        # Weights sum to one: what all those of a class did in common isn't seen.
        "prior_spread": _deviation([_apart(own) for own in priors]),
        "eigenvalue_spread": _deviation(_by_class(growth, components)),
        "angle_spread": _deviation(_by_class(turns, components, long)),
    }


def _by_class(
    values: Array, components: Array, kept: NDArray[np.bool_] | None = None
) -> list[list[Array]]:
    """Values (n, components, ...) of target and background, an array a step.

    Of components that are large enough, and `kept` (n, components) if given.
    """
    there = np.all(components[..., WEIGHT] > LEAST_WEIGHT, axis=1)
    if kept is not None:
        there &= kept
    return [
        [
            of_step[own][has[own]]
            for of_step, has in zip(values, there, strict=True)
            if has[own].any()
        ]
        for own in CLASSES
    ]


def _apart(steps: list[Array]) -> list[Array]:
    """What values do by themselves, with their own deviation; nothing of single ones."""
    return [
        (values - values.mean(axis=0)) / sqrt(1 - 1 / len(values))
        for values in steps
        if len(values) > 1
    ]


def _deviation(classes: Sequence[Sequence[Array]]) -> float:
    """Normal deviation from zero, by the median in each class; 0 of nothing.

    Variances of the classes are averaged: a background that stands still has more components, and
    a median over all would say that nothing moves.
    """
    together = [np.concatenate([some.ravel() for some in own]) for own in classes if own]
    deviations = [NORMAL * np.median(np.abs(values)) for values in together]
    return sqrt(np.mean(np.square(deviations))) if deviations else 0.0
