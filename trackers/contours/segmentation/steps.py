"""Steps from frame to frame of a segmented sequence: of plane, contour and colours."""

from collections.abc import Iterable, Sequence
from itertools import pairwise
from math import log
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from trackers.base.interface import Image, Mask
from trackers.base.parameters import TrackerError
from trackers.contours.contour.outline import outline
from trackers.contours.fisher.discriminant import discriminant_basis, oriented, plane_normal
from trackers.contours.fisher.mixture import Mixture, components_of, fitted, refined
from trackers.contours.segmentation.observation import colours_of
from trackers.contours.segmentation.segmenter import REFERENCE_WIDTH, surely

__all__ = ["Segmented", "Steps", "affine_map", "steps_of"]

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

    Attributes
    ----------
    normals : ndarray of float64, shape (n, 2, 3)
        The plane's, before and after.
    maps : ndarray of float64, shape (n, 2, 2)
        H of the contour, see `affine_map`.
    shifts : ndarray of float64, shape (n, 2)
        And p, in pixels of an image 320 wide.
    components : ndarray of float64, shape (n, 2, components, 6)
        Of both mixtures on the first frame's plane, the target's first, before and after; see
        `trackers.contours.fisher.mixture.components_of`.
    """

    normals: Array
    maps: Array
    shifts: Array
    components: Array


class _Seen(NamedTuple):
    """What a frame shows."""

    normal: Array
    contour: Array  # with FINER times as many points
    mixtures: tuple[Mixture, ...]


def steps_of(frames: Iterable[Segmented], generator: np.random.Generator) -> Steps:
    """Measure the steps of a segmented sequence.

    Parameters
    ----------
    frames : iterable of (image, mask)
        In order; images BGR uint8 of one size. Steps from and to frames without a mask, or with
        hardly a pixel in or outside it, are left out.
    generator : numpy.random.Generator
        Draws where the first mixtures begin.

    Raises
    ------
    TrackerError
        Where no two frames on end have masks.
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
    """H and p of r = m + H (r' - m) + p by least squares, m being the mean of the points of r'.

    Which point has become which is not known: of all at which r may begin, the point is taken that
    leaves the least error, with 50 |H - I|² added.

    Parameters
    ----------
    before : ndarray of float64, shape (points, 2)
        r', in pixels.
    after : ndarray of float64, shape (k · points, 2)
        r, with as many points or a multiple, of which every k-th is taken.

    Returns
    -------
    H : ndarray of float64, shape (2, 2)
    p : ndarray of float64, shape (2,)
        In pixels.
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
