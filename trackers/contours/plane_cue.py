"""Cue of the colour plane in which target and background differ most (section 4.1).

In the first frame, the plane's axes are found by nonparametric discriminant analysis of two classes
(Fukunaga & Mantock 1983).
"""

from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from trackmark.trackers.base.arrays import Array
from trackmark.trackers.contours.chain import Attached, Earlier, ParticleCue, Weighed
from trackmark.trackers.contours.mixture import refine_on_planes
from trackmark.trackers.contours.observation import Observation, weights_from_scores
from trackmark.trackers.contours.posterior import region_scores

REGULARISATION = 1e-4  # variance added to the within-class scatter, which may be singular
NEIGHBOURS = 3  # nearest neighbours in `discriminant_basis`
MIN_DISTANCE = 1e-6  # of colours in whitened space; avoids weights of 0 / 0 for equal colours


def discriminant_basis(
    target: Array, background: Array, neighbours: int = NEIGHBOURS, exponent: float = 1.0
) -> Array:
    """Return the axes of the plane that separates target and background colours best.

    Colours are first transformed such that the within-class scatter is white. Every colour is then
    compared with the mean of its nearest neighbours in the other class. The axes are the first
    eigenvectors of the scatter of these differences. Colours near the boundary of the classes have
    the largest weights.

    `target`, `background` float64 (n, 3) and (m, 3): colours of the two classes.
    `neighbours`: number of nearest neighbours.
    `exponent`: exponent of the distances in the weights, ≥ 0.

    Returns float64 (3, 2) with orthonormal columns. On both axes, the target's mean is not below
      the mean of the background.

    Raises ValueError if a class has `neighbours` colours or fewer.

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
            f"few. Each class needs more than {neighbours} colours."
        )
    within = sum(_scatter(colours - colours.mean(axis=0)) for colours in (target, background)) / 2
    values, vectors = np.linalg.eigh(within + REGULARISATION * np.eye(3))
    whitening = vectors / np.sqrt(values)
    classes = target @ whitening, background @ whitening
    trees = [cKDTree(colours) for colours in classes]
    between = np.zeros((3, 3))
    for own_class, other_class in ((0, 1), (1, 0)):
        colours = classes[own_class]
        distance_own = trees[own_class].query(colours, [neighbours + 1])[0][
            :, 0
        ]  # the nearest colour is the colour itself
        distances, nearest = trees[other_class].query(colours, np.arange(1, neighbours + 1))
        powers = np.maximum([distance_own, distances[:, -1]], MIN_DISTANCE) ** exponent
        weights = powers.min(axis=0) / powers.sum(axis=0)
        differences = colours - classes[other_class][nearest].mean(axis=1)
        between += _scatter(np.sqrt(weights)[:, np.newaxis] * differences) / 2
    axes = whitening @ np.linalg.eigh(between)[1][:, :0:-1]
    basis = np.linalg.qr(axes)[0]
    apart = (target.mean(axis=0) - background.mean(axis=0)) @ basis
    return np.asarray(np.where(apart < 0, -basis, basis), np.float64)


def _scatter(differences: Array) -> Array:
    """Return the mean of the products d dᵀ."""
    return np.asarray(np.einsum("ni,nj->ij", differences, differences) / len(differences))


def plane_normal(basis: Array) -> Array:
    """Return the unit normal (3,) of an orthonormal basis (3, 2): first axis × second axis."""
    return np.cross(basis[:, 0], basis[:, 1])


def orient_normals(normals: Array, reference: Array) -> Array:
    """Return normals (n, 3), negated if they point away from a reference normal (3,)."""
    return np.where((normals @ reference < 0)[:, np.newaxis], -normals, normals)


def plane_basis(normals: Array, reference_basis: Array) -> Array:
    """Return bases (n, 3, 2) of planes: the reference basis (3, 2), rotated as little as possible.

    With the smallest rotation, coordinates vary continuously with the normal. Normals (n, 3) have
    length 1 and are oriented by `orient_normals`.

    Examples
    --------
    >>> plane_basis(np.array([[0.0, 1.0, 0.0]]), np.eye(3)[:, :2])[0].tolist()
    [[1.0, 0.0], [0.0, 0.0], [0.0, -1.0]]
    """
    reference = plane_normal(reference_basis)
    axis = np.cross(reference, normals)[:, np.newaxis]
    cosine = (normals @ reference)[:, np.newaxis, np.newaxis]
    axes = reference_basis.T  # (2, 3), turned by R = I + [v]ₓ + [v]ₓ² / (1 + cos)
    once = np.cross(axis, axes)
    turned = axes + once + np.cross(axis, once) / (1 + cosine)
    return np.swapaxes(turned, 1, 2)


STEPS_ON_PLANES = 2  # EM steps on a plane, after projection


class PlaneCue(ParticleCue):
    """Particle filter of plane normals, a random walk (section 4.1, equation 5).

    s = H s' + p, normalised to length 1. H is the identity plus noise, p is noise; `plane_spread`
    is the standard deviation of all elements. A plane's score measures how well it separates the
    colours in the window from those outside (section 5.2). The evidence for later cues is the
    frame's colours on each plane, (planes, cells, 2), in the basis that `plane_basis` returns.

    `basis` (3, 2) is the basis of the first frame's plane. The `parameters` are those of
    `moreno2005`.
    """

    def __init__(self, basis: Array, parameters: Any) -> None:
        super().__init__(plane_normal(basis), parameters.plane_samples)
        self.basis = basis
        self.parameters = parameters

    def propagated(self, states: Array, generator: np.random.Generator) -> Array:
        """See `ParticleCue.propagated`."""
        spread = self.parameters.plane_spread
        turned = np.eye(3) + generator.normal(0.0, spread, (len(states), 3, 3))
        moved = np.einsum("nij,nj->ni", turned, states)
        moved += generator.normal(0.0, spread, states.shape)
        moved /= np.linalg.norm(moved, axis=1, keepdims=True)
        return orient_normals(moved, plane_normal(self.basis))

    def weigh(
        self, observation: Observation, states: Array, attached: Attached, earlier: Earlier
    ) -> Weighed:
        """See `Cue.weigh`."""
        assert observation.inside is not None
        assert observation.outside is not None
        bases = plane_basis(states, self.basis)
        colours: Array = observation.cells.colours @ bases
        inside, outside = (
            refine_on_planes(side.points, side.mixture, bases, STEPS_ON_PLANES)
            for side in (observation.inside, observation.outside)
        )
        scores = region_scores(colours, inside, outside, observation.contrast, 0.5)
        weights = weights_from_scores(
            scores, self.parameters.weights, self.parameters.plane_temperature
        )
        return Weighed(weights, colours)


class GivenPlane:
    """Cue with one fixed plane; its `normal` (3,) may be set before each frame."""

    def __init__(self, basis: Array) -> None:
        self.basis = basis
        self.normal = plane_normal(basis)

    def sample(self, generator: np.random.Generator) -> Array:
        """See `Cue.sample`."""
        return self.normal[np.newaxis]

    def weigh(
        self, observation: Observation, states: Array, attached: Attached, earlier: Earlier
    ) -> Weighed:
        """See `Cue.weigh`."""
        return Weighed(np.ones(1), observation.cells.colours @ plane_basis(states, self.basis))

    def receive(self, states: Array, weights: Array) -> None:
        """Do nothing: the plane is not estimated."""
