"""Planes of colour space: the Fisher plane of two sets of colours, and x₁ (section 4.1)."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

__all__ = ["basis_on", "fisher_basis", "normal_of", "propagated"]

Array = NDArray[np.float64]

K = 3  # nearest neighbours
REGULARISATION = 1e-4
LEAST_DISTANCE = 1e-6  # of equal colours, else their weight is 0 / 0


def fisher_basis(target: Array, background: Array) -> Array:
    """Φ (3, 2) by the nonparametric discriminant analysis of Fukunaga & Mantock.

    Both classes are equally probable; the target's mean is not below the background's on an axis.
    """
    s_w = np.eye(3) * REGULARISATION
    for colours in (target, background):
        s_w += np.cov(colours.T, bias=True) / 2
    values, u = np.linalg.eigh(s_w)
    whitening = u @ np.diag(values**-0.5)
    x_o, x_b = target @ whitening, background @ whitening
    s_b = (_between(x_o, x_b) + _between(x_b, x_o)) / 2
    vectors = np.linalg.eigh(s_b)[1]  # by ascending eigenvalues
    phi = np.linalg.qr(whitening @ vectors[:, [2, 1]])[0]
    signs = np.where((target.mean(axis=0) - background.mean(axis=0)) @ phi < 0, -1, 1)
    return np.asarray(phi * signs)


def _between(own: Array, other: Array) -> Array:
    """Mean of w (x - M) (x - M)ᵀ over one class, M being the mean of neighbours in the other."""
    in_own = np.partition(cdist(own, own), K, axis=1)[:, K]  # the nearest is the colour itself
    distances = cdist(own, other)
    nearest = np.argpartition(distances, K - 1, axis=1)[:, :K]
    in_other = np.take_along_axis(distances, nearest, axis=1).max(axis=1)
    in_own, in_other = np.maximum(in_own, LEAST_DISTANCE), np.maximum(in_other, LEAST_DISTANCE)
    w = np.minimum(in_own, in_other) / (in_own + in_other)
    differences = own - other[nearest].mean(axis=1)
    return np.asarray((w * differences.T) @ differences / len(own))


def normal_of(basis: Array) -> Array:
    """The normal n = φ₁ × φ₂."""
    return np.cross(basis[:, 0], basis[:, 1])


def basis_on(normal: Array, reference: Array) -> Array:
    """Φ of a plane by its normal: the reference, turned by R = I + [v] + [v]² / (1 + c)."""
    x, y, z = np.cross(normal_of(reference), normal)
    v = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    c = normal_of(reference) @ normal
    return np.asarray((np.eye(3) + v + v @ v / (1 + c)) @ reference)


def propagated(
    normals: Array, reference: Array, spread: float, random: np.random.Generator
) -> Array:
    """Equation 5 of normals: s = H s' + p, of length one, on the reference normal's side."""
    h = np.eye(3) + random.normal(0, spread, (len(normals), 3, 3))
    p = random.normal(0, spread, normals.shape)
    moved = []
    for j, normal in enumerate(normals):
        s = h[j] @ normal + p[j]
        s /= np.linalg.norm(s)
        moved.append(-s if s @ normal_of(reference) < 0 else s)
    return np.array(moved)
