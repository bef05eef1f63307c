"""Mixtures of Gaussians: fitted, taken apart, and the posterior of the target by two of them."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, logsumexp

__all__ = ["Mixture", "components_of", "fitted", "mixture_of", "posterior", "refined", "seen_on"]

Array = NDArray[np.float64]

REGULARISATION = 3e-4  # of every fitted variance
LEAST_MASS = 1e-9  # points; a component with fewer stays where it is


class Mixture(NamedTuple):
    """p (m,), μ (m, d) and Σ (m, d, d) of m Gaussians."""

    p: Array
    mu: Array
    sigma: Array


def fitted(points: Array, m: int, random: np.random.Generator, steps: int) -> Mixture:
    """From centres of k-means++, so many steps of EM."""
    d = points.shape[1]
    chances, centres = np.ones(len(points)), []
    for uniform in random.random(m):
        cumulative = np.cumsum(chances)
        chosen = np.searchsorted(cumulative, uniform * cumulative[-1], side="right")
        centres.append(points[min(chosen, len(points) - 1)])
        chances = _squared_distances(points, np.array(centres)).min(axis=1)
    mu = np.array(centres)
    nearest = _squared_distances(points, mu).argmin(axis=1)
    start = Mixture(np.zeros(m), mu, np.stack([REGULARISATION * np.eye(d)] * m))
    first = _maximised(points, np.eye(m)[nearest], start)
    return refined(points, first, steps)


def _squared_distances(points: Array, centres: Array) -> Array:
    return np.asarray(((points[:, np.newaxis] - centres) ** 2).sum(axis=2))


def refined(points: Array, mixture: Mixture, steps: int) -> Mixture:
    """So many steps of EM from a mixture on."""
    for _ in range(steps):
        logarithms = _log_terms(points, mixture)
        shares = np.exp(logarithms - logsumexp(logarithms, axis=1, keepdims=True))
        mixture = _maximised(points, shares, mixture)
    return mixture


def _maximised(points: Array, shares: Array, before: Mixture) -> Mixture:
    """Components of the points (n, d) by their shares (n, m) in them."""
    mu, sigma = before.mu.copy(), before.sigma.copy()
    for k, share in enumerate(shares.T):
        if share.sum() < LEAST_MASS:
            continue
        mu[k] = share @ points / share.sum()
        x = points - mu[k]
        sigma[k] = (share * x.T) @ x / share.sum() + REGULARISATION * np.eye(points.shape[1])
    return Mixture(shares.sum(axis=0) / len(points), mu, sigma)


def _log_terms(points: Array, mixture: Mixture) -> Array:
    """Logarithms of p N(c; μ, Σ) of each point and component, shape (n, m)."""
    x = points[:, np.newaxis] - mixture.mu
    squared = np.einsum("nmi,mij,nmj->nm", x, np.linalg.inv(mixture.sigma), x)
    with np.errstate(divide="ignore"):  # a component of weight 0
        factors = np.log(mixture.p / np.sqrt(np.linalg.det(2 * np.pi * mixture.sigma)))
    return np.asarray(factors - squared / 2)


def seen_on(mixture: Mixture, basis: Array) -> Mixture:
    """A mixture of colours, projected on a plane."""
    return Mixture(mixture.p, mixture.mu @ basis, basis.T @ mixture.sigma @ basis)


def posterior(c: Array, target: Mixture, background: Mixture, floor: float, prior: float) -> Array:
    """p(O | c) of points (n, 2) on a plane (section 4.2)."""
    of_target = logsumexp(_log_terms(c, target), axis=1)
    of_background = logsumexp(_log_terms(c, background), axis=1)
    with np.errstate(divide="ignore"):
        of_background = np.logaddexp(of_background, np.log(floor))
    return np.asarray(expit(np.log(prior / (1 - prior)) + of_target - of_background))


def components_of(mixture: Mixture) -> Array:
    """Six numbers of each: p, μx, μy, λ₁ ≥ λ₂, and θ of the first direction, shape (m, 6)."""
    rows = []
    for p, mu, sigma in zip(*mixture, strict=True):
        least, most = np.linalg.eigvalsh(sigma)
        theta = np.arctan2(2 * sigma[0, 1], sigma[0, 0] - sigma[1, 1]) / 2
        rows.append([p, *mu, most, least, theta])
    return np.array(rows)


def mixture_of(components: Array) -> Mixture:
    """Σ = Rot(θ) diag(λ₁, λ₂) Rot(θ)ᵀ of components (m, 6)."""
    sigma = []
    for first, second, theta in components[:, 3:]:
        cos, sin = np.cos(theta), np.sin(theta)
        turn = np.array([[cos, -sin], [sin, cos]])
        sigma.append(turn @ np.diag([first, second]) @ turn.T)
    return Mixture(components[:, 0], components[:, 1:3], np.array(sigma))
