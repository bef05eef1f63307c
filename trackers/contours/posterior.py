"""Posterior probability of the target given a colour, by mixtures of both classes on a plane.

p(O | c) = P(O) p(c | O) / (P(O) p(c | O) + P(B) p(c | B)), equation 6 of Moreno-Noguer et al.
(2005). Tables of posteriors have single precision; sums over them have double precision.
"""

from math import factorial, log
from typing import TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.special import expit

from trackmark.trackers.base.arrays import Array, Ints
from trackmark.trackers.contours.mixture import Mixture, from_components, log_density

Array32: TypeAlias = NDArray[np.float32]

BLOCK = 1024  # number of colours per block: intermediate results fit the L1 cache
LOWEST = np.float32(-125.0)  # minimum exponent of a term

FACTOR_0, FACTOR_1, FACTOR_2, FACTOR_3, FACTOR_4, FACTOR_5 = (
    np.float32(log(2) ** k / factorial(k)) for k in range(6)
)
"""Coefficients of the Taylor series of 2ᶠ; its error is below 3e-6 for |f| ≤ ½."""


def posterior(points: Array, target: Mixture, background: Mixture, prior: float = 0.5) -> Array:
    """Return the target's posterior (n,) at points (n, 2) of a plane; `prior` is P(O)."""
    odds = log_density(target, points) - log_density(background, points)
    return np.asarray(expit(odds + np.log(prior / (1 - prior))), np.float64)


def posterior_tables(
    projected: Array,
    planes: Ints,
    target: Array,
    background: Array,
    prior: float,
    contrast: Array,
) -> tuple[Array32, Array]:
    """Return the posterior of every colour for many pairs of mixtures, and scores of the pairs.

    `projected` float64 (P, K, 2): K colours on each of P planes.
    `planes` int64 (N,): plane of each pair.
    `target`, `background` float64 (N, m, 6): components of each pair; see `to_components`.
    `contrast` float64 (K,): share of a colour in one region minus its share in the other.

    `tables` float32 (N, K): posteriors. If no eigenvalue is below 2e-4, they differ from
      `posterior` by at most 1e-4.
    `scores` float64 (N,): Σ table · contrast.
    """
    forms = _forms(from_components(target), from_components(background), prior)
    return _tables(_plane_coordinates(projected), planes, forms, target.shape[1], contrast)


def region_scores(
    projected: Array, inside: Mixture, outside: Mixture, contrast: Array, prior: float
) -> Array:
    """Return the scores (P,) of mixtures of two regions on P planes, as `posterior_tables` does."""
    forms = _forms(inside, outside, prior)
    planes = np.arange(len(projected))
    return _tables(_plane_coordinates(projected), planes, forms, inside.weights.shape[1], contrast)[
        1
    ]


def _plane_coordinates(projected: Array) -> Array32:
    """Return the coordinates of K colours on each of P planes, shape (P, 2, K)."""
    return np.ascontiguousarray(np.swapaxes(projected, 1, 2), np.float32)


def _forms(target: Mixture, background: Mixture, prior: float) -> Array32:
    """Return a, b, c, d, e and k of each mixture component, shape (N, m, 6).

    The density at (x, y), times its prior, is 2^(k - (ax + by + c)² - (dy + e)²).
    """
    weights, means, covariances = (
        np.concatenate(arrays, axis=1) for arrays in zip(target, background, strict=True)
    )
    x, y = means[..., 0], means[..., 1]
    xx, xy, yy = covariances[..., 0, 0], covariances[..., 0, 1], covariances[..., 1, 1]
    determinant = xx * yy - xy * xy
    priors = np.where(np.arange(weights.shape[1]) < target.weights.shape[1], prior, 1 - prior)
    # Half the squared Mahalanobis distance is dy² / 2yy + yy (dx - dy xy / yy)² / 2 determinant.
    a = np.sqrt(yy / (2 * log(2) * determinant))
    b = -a * xy / yy
    d = 1 / np.sqrt(2 * log(2) * yy)
    with np.errstate(divide="ignore"):  # a weight of 0
        k = np.log2(priors * weights / (2 * np.pi * np.sqrt(determinant)))
    return np.stack([a, b, -a * x - b * y, d, -d * y, k], axis=-1).astype(np.float32)


@njit(cache=True)
def _tables(
    colours: Array32, planes: Ints, forms: Array32, n_target: int, contrast: Array
) -> tuple[Array32, Array]:
    n_components = forms.shape[1]
    n_colours = colours.shape[2]
    tables = np.empty((len(planes), n_colours), np.float32)
    scores = np.zeros(len(planes))
    terms = np.empty((n_components, BLOCK), np.float32)
    largest = np.empty(BLOCK, np.float32)
    background = np.empty(BLOCK, np.float32)
    for begin in range(0, n_colours, BLOCK):
        end = min(begin + BLOCK, n_colours)
        some = end - begin
        for j in range(len(planes)):
            x, y = colours[planes[j], 0, begin:end], colours[planes[j], 1, begin:end]
            largest[:] = -np.inf
            for m in range(n_components):
                a, b, c, d, e, k = forms[j, m]
                _exponents(x, y, (a, b, c, d, e, k), terms[m, :some], largest[:some])
            table = tables[j, begin:end]
            table[:] = 0.0
            background[:] = 0.0
            for m in range(n_target):
                _add_powers(terms[m, :some], largest[:some], table)
            for m in range(n_target, n_components):
                _add_powers(terms[m, :some], largest[:some], background[:some])
            scores[j] += _normalise(table, background[:some], contrast[begin:end])
    return tables, scores


@njit(cache=True, fastmath={"contract"})
def _exponents(
    x: Array32, y: Array32, form: tuple[np.float32, ...], exponents: Array32, largest: Array32
) -> None:
    """Fill the base-2 logarithms of a component at colours, and update the largest so far."""
    a, b, c, d, e, k = form
    for i in range(len(x)):
        u = a * x[i] + b * y[i] + c
        v = d * y[i] + e
        exponent = k - u * u - v * v
        exponents[i] = exponent
        largest[i] = max(largest[i], exponent)


@njit(cache=True, fastmath={"contract"})
def _add_powers(exponents: Array32, largest: Array32, totals: Array32) -> None:
    """Add 2^(exponent - largest), written such that the compiler generates vector code."""
    for i in range(len(exponents)):
        exponent = max(exponents[i] - largest[i], LOWEST)
        rounded = np.rint(exponent)
        f = exponent - rounded
        power = FACTOR_4 + f * FACTOR_5
        power = FACTOR_3 + f * power
        power = FACTOR_2 + f * power
        power = FACTOR_1 + f * power
        power = FACTOR_0 + f * power
        bits = np.float32(power).view(np.int32) + (np.int32(rounded) << np.int32(23))
        totals[i] += np.int32(bits).view(np.float32)


@njit(cache=True, fastmath={"contract", "reassoc"})
def _normalise(table: Array32, background: Array32, contrast: Array) -> float:
    """Normalise the target's terms in `table` to posteriors; return Σ posterior · contrast."""
    score = 0.0
    for i in range(len(table)):
        table[i] /= table[i] + background[i]
        score += table[i] * contrast[i]
    return score
