"""The cues of moreno2005 in plain NumPy: weighted samples of each, and how they move.

By the paper's sections, one hypothesis at a time; see `plain_moreno2005`.
"""

import numpy as np
from scipy.optimize import linear_sum_assignment

from trackmark.trackers.contours.mixture import Mixture, refine_mixture, to_components
from trackmark.trackers.contours.plane_cue import plane_basis, plane_normal

EIGENVALUES = 2e-4, 0.15  # least and most
STEPS = 6  # of EM


# Weighted samples of a cue, {s, π} (section 2)


class Samples:
    """`states` and `weights` of the last frame, `carried`: π with which they go on, and `attached`:
    sample of the cue before with which each was weighed.
    """

    def __init__(self, start, count):
        self.states = np.stack([start] * count)
        self.weights = self.carried = np.full(count, 1 / count)
        self.attached = np.zeros(0, np.intp)

    def resampled(self, random):
        """States drawn by weight, in equal steps from one random number."""
        n = len(self.states)
        return self.states[drawn(self.carried, (np.arange(n) + random.random(n)[0]) / n)]


def drawn(weights, positions):
    """Sample at each position, in [0, 1), of the summed weights."""
    cumulative = np.cumsum(weights)
    actual = np.searchsorted(cumulative, positions * cumulative[-1], side="right")
    return np.minimum(actual, len(weights) - 1)


def weights_of(differences, kind, temperature):
    """π of differences d of mean posteriors (sections 5.2 to 5.4)."""
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


# Planes of colour space, x₁ (section 4.1)


def basis_on(normal, reference):
    return plane_basis(normal[np.newaxis], reference)[0]


def moved_planes(normals, reference, spread, random):
    """Equation 5 of normals: s = H s' + p, of length one, on the reference normal's side."""
    h = np.eye(3) + random.normal(0, spread, (len(normals), 3, 3))
    p = random.normal(0, spread, normals.shape)
    moved = []
    for j, normal in enumerate(normals):
        s = h[j] @ normal + p[j]
        s /= np.linalg.norm(s)
        moved.append(-s if s @ plane_normal(reference) < 0 else s)
    return np.array(moved)


# Mixtures of Gaussians, x₂ (section 4.2)


def moved_colours(states, settings, random):
    """The dynamic model of all components' six numbers, the target's first.

    Every number is perturbed on its own, and where dynamics are `shared` all centroids go through
    one random linear map besides, mostly a gain.
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
        """Components of both mixtures, the target's first, shape (m, 6)."""
        both = zip(self.older, self.newer, strict=True)
        return np.concatenate([to_components(self._blended(*pair)) for pair in both])

    def learn(self, sets, basis, moved):
        """Fit again to the last frame, on a plane; `moved`: whether the plane has changed."""
        older = self.newer
        if moved:
            older = self._fitted(self.sets, basis, older)
        self.sets, self.older, self.newer = sets, older, self._fitted(sets, basis, older)

    def _fitted(self, sets, basis, start):
        pairs = zip(sets, start, strict=True)
        return tuple(refine_mixture(colours @ basis, mixture, STEPS) for colours, mixture in pairs)

    def _blended(self, older, newer):
        """Component by component, those whose centroids are near."""
        costs = ((newer.means[:, np.newaxis] - older.means) ** 2).sum(axis=2)
        partners = linear_sum_assignment(costs)[1]
        parts = zip(older, newer, strict=True)
        return Mixture(*((1 - self.a) * g2[partners] + self.a * g1 for g2, g1 in parts))


# Contours, x₃ (section 4.3)


def moved_contours(contours, settings, width, random):
    """Equation 5 of contours: s = m + H (s' - m) + p, with m the mean of the points of s'."""
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
