"""Gaussian mixtures of colours: fit, projection on planes, density, and components.

The functions also accept arrays of mixtures, whose axes precede the axis of components.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from trackmark.trackers.base.arrays import Array

REGULARISATION = 3e-4  # variance added to every axis of a fitted component
FIT_STEPS = 15  # EM steps of `fit_mixture`
MIN_MASS = 1e-9  # sum of responsibilities below which a component keeps mean and covariance


class Mixture(NamedTuple):
    """Mixture of m Gaussians in d dimensions, or an array of mixtures."""

    weights: Array  # (..., m): ≥ 0, of sum 1
    means: Array  # (..., m, d)
    covariances: Array  # (..., m, d, d): positive definite


def fit_mixture(
    points: Array,
    components: int,
    generator: np.random.Generator,
    iterations: int = FIT_STEPS,
    regularisation: float = REGULARISATION,
) -> Mixture:
    """Fit a mixture by expectation maximisation (EM) from random centres.

    The centres are chosen by k-means++ (Arthur & Vassilvitskii 2007), with one uniform random
    number per centre. Each initial component consists of the points nearest to its centre.

    `points` float64 (n, d): points in 2 or 3 dimensions. If fewer than m points are distinct,
    surplus components get weight 0 and the position of another component. `components`: number m of
    components. `generator`: source of the random numbers. `iterations`: number of EM steps.
    `regularisation`: variance added to every axis of each component.

    """
    distances = np.ones(len(points))
    centres = np.empty((components, points.shape[1]))
    nearest = np.zeros(len(points), np.int64)
    for component, uniform in enumerate(generator.random(components)):
        sums = np.cumsum(distances)
        drawn = np.searchsorted(sums, uniform * sums[-1], side="right")
        centres[component] = points[min(drawn, len(points) - 1)]
        squares = np.square(points - centres[component]).sum(axis=1)
        closer = (squares < distances) | (component == 0)
        nearest[closer] = component
        distances = np.where(closer, squares, distances)
    shares = np.equal(np.arange(components)[:, np.newaxis], nearest).astype(np.float64)
    spheres = np.tile(regularisation * np.eye(points.shape[1]), (components, 1, 1))
    mixture = Mixture(np.empty(components), centres, spheres)
    across = np.ascontiguousarray(points.T)
    _maximise(across, shares, mixture, regularisation)
    _iterate(across, mixture, iterations, regularisation)
    return mixture


def refine_mixture(
    points: Array, mixture: Mixture, iterations: int, regularisation: float = REGULARISATION
) -> Mixture:
    """Refine a mixture by EM steps; a component without points keeps its mean and covariance."""
    after = Mixture(*(array.copy() for array in mixture))
    _iterate(np.ascontiguousarray(points.T), after, iterations, regularisation)
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
    """Return a mixture of colours projected on a plane (3, 2), or on planes (P, 3, 2)."""
    across = np.swapaxes(basis, -1, -2)[..., np.newaxis, :, :]
    shape = (*basis.shape[:-2], len(mixture.weights))
    return Mixture(
        np.broadcast_to(mixture.weights, shape).copy(),
        mixture.means @ basis,
        across @ mixture.covariances @ basis[..., np.newaxis, :, :],
    )


def log_density(mixture: Mixture, points: Array) -> Array:
    """Return the logarithm of a mixture's density at points (n, d), shape (n,)."""
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
    """Return a mixture's density at points (n, d), shape (n,)."""
    return np.exp(log_density(mixture, points))


def to_components(mixture: Mixture) -> Array:
    """Return the components of a mixture in two dimensions, shape (..., m, 6).

    The six numbers are the weight, the mean x and y, the larger and the smaller eigenvalue of the
    covariance, and the angle of the first eigenvector [radians, in (-π/2, π/2]].

    Examples
    --------
    >>> mixture = Mixture(np.ones(1), np.zeros((1, 2)), np.diag([1.0, 4.0])[np.newaxis])
    >>> to_components(mixture).round(4)
    array([[1.    , 0.    , 0.    , 4.    , 1.    , 1.5708]])
    """
    xx, yy = mixture.covariances[..., 0, 0], mixture.covariances[..., 1, 1]
    twice_xy = mixture.covariances[..., 0, 1] + mixture.covariances[..., 1, 0]
    middle, half = (xx + yy) / 2, np.hypot(xx - yy, twice_xy) / 2
    angle = np.arctan2(twice_xy, xx - yy) / 2
    means = mixture.means
    components = mixture.weights, means[..., 0], means[..., 1], middle + half, middle - half, angle
    return np.stack(components, axis=-1)


def from_components(components: Array) -> Mixture:
    """Return the mixture of components (..., m, 6), with eigenvalues in any order."""
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
        _iterate(across, mixture, iterations, regularisation)


@njit(cache=True)
def _iterate(points: Array, mixture: Mixture, iterations: int, regularisation: float) -> None:
    """Apply EM steps in place to points (d, n)."""
    responsibilities = np.empty((len(mixture.weights), points.shape[1]))
    for _ in range(iterations):
        _expect(points, mixture, responsibilities)
        _maximise(points, responsibilities, mixture, regularisation)


@njit(cache=True)
def _whitening(covariance: Array) -> tuple[Array, float]:
    """Return W with W' W = C⁻¹ and √|C|; a kernel of its own, because LAPACK compiles slowly."""
    root = np.linalg.cholesky(covariance)
    scale = 1.0
    for axis in range(len(root)):
        scale *= root[axis, axis]
    return np.linalg.inv(root), scale


@njit(cache=True)
def _expect(points: Array, mixture: Mixture, responsibilities: Array) -> None:
    """Fill `responsibilities` (m, n): the share of each component in each point."""
    weights, means, covariances = mixture
    d, n = points.shape
    largest, total, whitened = np.empty(n), np.empty(n), np.empty(n)
    for i in range(n):
        largest[i], total[i] = -np.inf, 0.0
    for component in range(len(weights)):
        inverse, scale = _whitening(covariances[component])
        row = responsibilities[component]
        logarithm = np.log(weights[component] / scale)
        for i in range(n):
            row[i] = logarithm
        for axis in range(d):
            for i in range(n):
                whitened[i] = 0.0
            for other in range(axis):
                factor, mean = inverse[axis, other], means[component, other]
                for i in range(n):  # the inner loop, so that the compiler can vectorise it
                    whitened[i] += factor * (points[other, i] - mean)
            factor, mean = inverse[axis, axis], means[component, axis]
            for i in range(n):
                distance = whitened[i] + factor * (points[axis, i] - mean)
                row[i] -= distance * distance / 2
        for i in range(n):
            largest[i] = max(largest[i], row[i])
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
    points: Array, responsibilities: Array, mixture: Mixture, regularisation: float
) -> None:
    """Update components by their responsibilities; one without points keeps mean and covariance."""
    weights, means, covariances = mixture
    d, n = points.shape
    for component in range(len(weights)):
        row = responsibilities[component]
        mass = 0.0
        for i in range(n):
            mass += row[i]
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
