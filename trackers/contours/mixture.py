"""Mixtures of Gaussians of colours: fitted to points, projected on planes, taken apart.

Arrays of mixtures share the functions of one: further axes, say of planes or of samples, stand
before the components'.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from trackmark.trackers.base.arrays import Array

REGULARISATION = 3e-4  # variance added to every axis of a fitted component
MIN_MASS = 1e-9  # points that a component has at least; fewer are nothing to place it by


class Mixture(NamedTuple):
    """A mixture of m Gaussians in d dimensions, or an array of such."""

    weights: Array  # (..., m): 0 or more, of sum one
    means: Array  # (..., m, d)
    covariances: Array  # (..., m, d, d): positive definite


def fit_mixture(
    points: Array,
    components: int,
    generator: np.random.Generator,
    iterations: int = 15,
    regularisation: float = REGULARISATION,
) -> Mixture:
    """The mixture of m `components` that expectation maximisation comes to from random centres.

    The centres are those of k-means++ (Arthur & Vassilvitskii 2007), by one uniform number of the
    generator each, and the first components have the points that are nearest to each. Points are of
    shape (n, d), d being 2 or 3; where they have fewer different places than m, components are left
    over: of weight 0, at a place of another, with the variance `regularisation`, which every
    component has besides that of its points.
    """
    distances = np.ones(len(points))
    centres = np.empty((components, points.shape[1]))
    nearest = np.zeros(len(points), np.int64)
    for component, uniform in enumerate(generator.random(components)):
        sums = np.cumsum(distances)
        chosen = np.searchsorted(sums, uniform * sums[-1], side="right")
        centres[component] = points[min(chosen, len(points) - 1)]
        squares = np.square(points - centres[component]).sum(axis=1)
        closer = (squares < distances) | (component == 0)
        nearest[closer] = component
        distances = np.where(closer, squares, distances)
    shares = np.equal(np.arange(components)[:, np.newaxis], nearest).astype(np.float64)
    spheres = np.tile(regularisation * np.eye(points.shape[1]), (components, 1, 1))
    mixture = Mixture(np.empty(components), centres, spheres)
    axes, across = tuple(range(points.shape[1])), np.ascontiguousarray(points.T)
    _maximise(across, axes, shares, mixture, regularisation)
    _iterate(across, axes, mixture, iterations, regularisation)
    return mixture


def refine_mixture(
    points: Array, mixture: Mixture, iterations: int, regularisation: float = REGULARISATION
) -> Mixture:
    """Refine a mixture by steps of `fit_mixture`; a component without points keeps its place."""
    after = Mixture(*(array.copy() for array in mixture))
    axes = tuple(range(points.shape[1]))
    _iterate(np.ascontiguousarray(points.T), axes, after, iterations, regularisation)
    return after


def refine_on_planes(
    points: Array,
    mixture: Mixture,
    bases: Array,
    iterations: int = 2,
    regularisation: float = REGULARISATION,
) -> Mixture:
    """Project a mixture of colours (n, 3) on planes of bases (P, 3, 2), and refine it on each."""
    after = project_mixture(mixture, bases)
    _iterate_on_planes(points, bases, after, iterations, regularisation)
    return after


def project_mixture(mixture: Mixture, basis: Array) -> Mixture:
    """A mixture of colours as seen on a plane of basis (3, 2), or on as many as bases (P, 3, 2)."""
    across = np.swapaxes(basis, -1, -2)[..., np.newaxis, :, :]
    shape = (*basis.shape[:-2], len(mixture.weights))
    return Mixture(
        np.broadcast_to(mixture.weights, shape).copy(),
        mixture.means @ basis,
        across @ mixture.covariances @ basis[..., np.newaxis, :, :],
    )


def log_density(mixture: Mixture, points: Array) -> Array:
    """Logarithm of a mixture's density at points (n, d), shape (n,)."""
    roots = np.linalg.cholesky(mixture.covariances)
    differences = points[:, np.newaxis] - mixture.means
    whitened = np.einsum("mab,nmb->nma", np.linalg.inv(roots), differences)
    scales = np.diagonal(roots, axis1=-2, axis2=-1).prod(axis=-1)
    factors = mixture.weights / (scales * (2 * np.pi) ** (points.shape[1] / 2))
    with np.errstate(divide="ignore"):  # a component of weight 0
        logarithms = np.log(factors)
    return np.asarray(
        np.logaddexp.reduce(logarithms - np.square(whitened).sum(axis=-1) / 2, axis=1), np.float64
    )


def density(mixture: Mixture, points: Array) -> Array:
    """A mixture's density at points (n, d), shape (n,)."""
    return np.exp(log_density(mixture, points))


def to_components(mixture: Mixture) -> Array:
    """Components of a mixture in two dimensions, each as six numbers, shape (..., m, 6).

    Weight, mean x and y, the larger and the smaller eigenvalue of the covariance, and the angle of
    the first one's direction [radians, in (-π/2, π/2]].

    Examples
    --------
    >>> one = Mixture(np.ones(1), np.zeros((1, 2)), np.diag([1.0, 4.0])[np.newaxis])
    >>> components_of(one).round(4)
    array([[1.    , 0.    , 0.    , 4.    , 1.    , 1.5708]])
    """
    xx, yy = mixture.covariances[..., 0, 0], mixture.covariances[..., 1, 1]
    twice_xy = mixture.covariances[..., 0, 1] + mixture.covariances[..., 1, 0]
    middle, half = (xx + yy) / 2, np.hypot(xx - yy, twice_xy) / 2
    angle = np.arctan2(twice_xy, xx - yy) / 2
    means = mixture.means
    numbers = mixture.weights, means[..., 0], means[..., 1], middle + half, middle - half, angle
    return np.stack(numbers, axis=-1)


def from_components(components: Array) -> Mixture:
    """The mixture of components (..., m, 6), in whatever order their eigenvalues are."""
    weights, first, second = components[..., 0], components[..., 3], components[..., 4]
    middle, half = (first + second) / 2, (first - second) / 2
    along = half * np.cos(2 * components[..., 5])
    across = half * np.sin(2 * components[..., 5])
    covariances = np.stack([middle + along, across, across, middle - along], axis=-1)
    return Mixture(
        weights.copy(), components[..., 1:3].copy(), covariances.reshape(*weights.shape, 2, 2)
    )


@njit(cache=True)
def _iterate_on_planes(
    points: Array, bases: Array, mixtures: Mixture, iterations: int, regularisation: float
) -> None:
    across = np.empty((2, len(points)))
    for plane in range(len(bases)):
        basis = bases[plane]
        for axis in range(2):
            for i in range(len(points)):
                across[axis, i] = (
                    points[i, 0] * basis[0, axis]
                    + points[i, 1] * basis[1, axis]
                    + points[i, 2] * basis[2, axis]
                )
        weights, means, covariances = mixtures
        mixture = Mixture(weights[plane], means[plane], covariances[plane])
        _iterate(across, (0, 1), mixture, iterations, regularisation)


@njit(cache=True)
def _iterate(
    points: Array, axes: tuple[int, ...], mixture: Mixture, iterations: int, regularisation: float
) -> None:
    """Take steps of expectation maximisation in place on points (d, n); `axes` has d items."""
    responsibilities = np.empty((len(mixture.weights), points.shape[1]))
    for _ in range(iterations):
        _expect(points, axes, mixture, responsibilities)
        _maximise(points, axes, responsibilities, mixture, regularisation)


@njit(cache=True)
def _expect(
    points: Array, axes: tuple[int, ...], mixture: Mixture, responsibilities: Array
) -> None:
    """Share (m, n) that each component has in each point."""
    weights, means, covariances = mixture
    d = len(axes)
    n = points.shape[1]
    largest = np.full(n, -np.inf)
    for component in range(len(weights)):
        root = np.linalg.cholesky(covariances[component])
        inverse = np.linalg.inv(root)
        scale = 1.0
        for axis in range(d):
            scale *= root[axis, axis]
        row = responsibilities[component]
        row[:] = np.log(weights[component] / scale)
        for axis in range(d):
            for i in range(n):
                whitened = 0.0
                for other in range(axis + 1):
                    whitened += inverse[axis, other] * (points[other, i] - means[component, other])
                row[i] -= whitened * whitened / 2
        for i in range(n):
            largest[i] = max(largest[i], row[i])
    total = np.zeros(n)
    for component in range(len(weights)):
        row = responsibilities[component]
        for i in range(n):
            row[i] = np.exp(row[i] - largest[i])
            total[i] += row[i]
    for component in range(len(weights)):
        row = responsibilities[component]
        for i in range(n):
            row[i] /= total[i]


@njit(cache=True)
def _maximise(
    points: Array,
    axes: tuple[int, ...],
    responsibilities: Array,
    mixture: Mixture,
    regularisation: float,
) -> None:
    """Components of the points that they are responsible for; one without any keeps its place."""
    weights, means, covariances = mixture
    d = len(axes)
    n = points.shape[1]
    for component in range(len(weights)):
        row = responsibilities[component]
        mass = row.sum()
        weights[component] = mass / n
        if mass < MIN_MASS:
            continue
        mean, covariance = means[component], covariances[component]
        for axis in range(d):
            total = 0.0
            for i in range(n):
                total += row[i] * points[axis, i]
            mean[axis] = total / mass
        for axis in range(d):
            for other in range(axis + 1):
                total = 0.0
                for i in range(n):
                    total += (
                        row[i] * (points[axis, i] - mean[axis]) * (points[other, i] - mean[other])
                    )
                covariance[axis, other] = covariance[other, axis] = total / mass
            covariance[axis, axis] += regularisation
