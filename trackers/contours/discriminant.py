"""The plane of colours on which target and background differ most, and bases of planes.

Axes are those of the nonparametric discriminant analysis of two classes (Fukunaga & Mantock 1983).
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

__all__ = ["basis_of", "discriminant_basis", "oriented", "plane_normal"]

Array = NDArray[np.float64]

REGULARISATION = 1e-4  # added to each channel's scatter within classes, which may be singular
LEAST_DISTANCE = 1e-6  # of colours in whitened space: equal ones, many of them, would weigh 0 / 0


def discriminant_basis(
    target: Array, background: Array, neighbours: int = 3, exponent: float = 1.0
) -> Array:
    """Axes of the plane that sets the colours of a target apart from those of its background.

    In the space in which the scatter within classes is white, every colour is compared with the
    mean of its nearest neighbours in the other class. The scatter of these differences, which
    weigh most near the boundary of the classes, has the axes as its first eigenvectors.

    Parameters
    ----------
    target, background : ndarray of float64, shape (n, 3) and (m, 3)
        Colours of the two classes, which are equally probable a priori. Raises ValueError where
        one doesn't have more than `neighbours`.
    neighbours : int
        k, at least 1.
    exponent : float
        That of the distances in the weights; 0 or more.

    Returns
    -------
    ndarray of float64, shape (3, 2)
        Orthonormal columns, the first along the first eigenvector; the mean of the target isn't
        below that of the background on either.

    Examples
    --------
    >>> axis = np.linspace(0, 1, 5)
    >>> square = np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3)
    >>> discriminant_basis(square + [2, 0, 0], square)[:, 0].round(2) + 0.0
    array([1., 0., 0.])
    """
    if min(len(target), len(background)) <= neighbours:
        raise ValueError(
            f"{len(target)} colours of the target and {len(background)} of the background are too "
            f"few for {neighbours} neighbours; each class needs more than that."
        )
    within = sum(_scatter(colours - colours.mean(axis=0)) for colours in (target, background)) / 2
    values, vectors = np.linalg.eigh(within + REGULARISATION * np.eye(3))
    whitening = vectors / np.sqrt(values)
    classes = target @ whitening, background @ whitening
    trees = [cKDTree(colours) for colours in classes]
    between = np.zeros((3, 3))
    for own, other in ((0, 1), (1, 0)):
        colours = classes[own]
        distance_own = trees[own].query(colours, [neighbours + 1])[0][:, 0]  # the first is itself
        distances, nearest = trees[other].query(colours, np.arange(1, neighbours + 1))
        powers = np.maximum([distance_own, distances[:, -1]], LEAST_DISTANCE) ** exponent
        weights = powers.min(axis=0) / powers.sum(axis=0)
        differences = colours - classes[other][nearest].mean(axis=1)
        between += _scatter(np.sqrt(weights)[:, np.newaxis] * differences) / 2
    axes = whitening @ np.linalg.eigh(between)[1][:, :0:-1]
    basis = np.linalg.qr(axes)[0]
    apart = (target.mean(axis=0) - background.mean(axis=0)) @ basis
    return np.asarray(np.where(apart < 0, -basis, basis), np.float64)


def _scatter(differences: Array) -> Array:
    """Mean of the products d dᵀ."""
    return np.asarray(np.einsum("ni,nj->ij", differences, differences) / len(differences))


def plane_normal(basis: Array) -> Array:
    """Unit normal (3,) of the plane of an orthonormal basis (3, 2): first axis × second."""
    return np.cross(basis[:, 0], basis[:, 1])


def oriented(normals: Array, reference: Array) -> Array:
    """Normals (n, 3), turned round where they point away from a reference normal (3,)."""
    return np.where((normals @ reference < 0)[:, np.newaxis], -normals, normals)


def basis_of(normals: Array, reference_basis: Array) -> Array:
    """Bases (n, 3, 2) of planes: a reference basis (3, 2), turned by the least rotation.

    So coordinates on a plane are reproducible, and vary continuously with its normal. Normals
    (n, 3) are of length one, on the reference normal's side (see `oriented`).

    Examples
    --------
    >>> basis_of(np.array([[0.0, 1.0, 0.0]]), np.eye(3)[:, :2])[0]
    array([[ 1.,  0.],
           [ 0.,  0.],
           [ 0., -1.]])
    """
    reference = plane_normal(reference_basis)
    axis = np.cross(reference, normals)[:, np.newaxis]
    cosine = (normals @ reference)[:, np.newaxis, np.newaxis]
    axes = reference_basis.T  # (2, 3), turned by R = I + [v]ₓ + [v]ₓ² / (1 + cos)
    once = np.cross(axis, axes)
    turned = axes + once + np.cross(axis, once) / (1 + cosine)
    return np.swapaxes(turned, 1, 2)
