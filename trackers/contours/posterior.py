"""How probable it is that a colour is the target's, by mixtures of both classes on a plane.

p(O | c) = P(O) p(c | O) / (P(O) p(c | O) + P(B) (p(c | B) + ε)), where the floor ε is a density
that makes background of a colour that neither mixture explains. Tables of many colours under many
mixtures are of single precision; sums over them are of double.
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

BLOCK = 1024  # colours taken together: what is known of them stays in the fastest memory
LOWEST = np.float32(-125.0)  # power of two below which a term counts as no more than it

FACTOR_0, FACTOR_1, FACTOR_2, FACTOR_3, FACTOR_4, FACTOR_5 = (
    np.float32(log(2) ** k / factorial(k)) for k in range(6)
)
"""Of the series of 2ᶠ, which for |f| ≤ ½ is within 3e-6 of it."""


def posterior(
    points: Array, target: Mixture, background: Mixture, floor: float = 0.05, prior: float = 0.5
) -> Array:
    """Return the target's posterior (n,) at points (n, 2) of a plane; `prior` is P(O)."""
    with np.errstate(divide="ignore"):
        floored = np.logaddexp(log_density(background, points), np.log(floor))
    odds = log_density(target, points) - floored + np.log(prior / (1 - prior))
    return np.asarray(expit(odds), np.float64)


def posterior_tables(
    projected: Array,
    planes: Ints,
    target: Array,
    background: Array,
    floor: float,
    prior: float,
    contrast: Array,
) -> tuple[Array32, Array]:
    """Posterior of every colour under many pairs of mixtures, and how it sets two regions apart.

    `projected` (P, K, 2) are K colours on each of P planes, `planes` (N,) the plane of each of N
    pairs, `target` and `background` (N, m, 6) their components (see `components_of`). `contrast`
    (K,) is what each colour counts in the score: its share of one region less that of the other.

    Gives float32 tables (N, K), where no eigenvalue is below 2e-4 within 2e-5 of `posterior`,
    without a floor within 1e-4; and scores (N,), Σ table · contrast of each.
    """
    forms = _forms(from_components(target), from_components(background), floor, prior)
    return _tables(_across(projected), planes, forms, target.shape[1], contrast)


def region_scores(
    projected: Array, inside: Mixture, outside: Mixture, contrast: Array, floor: float, prior: float
) -> Array:
    """Score how mixtures of two regions on each of P planes tell them apart, as in the tables."""
    forms = _forms(inside, outside, floor, prior)
    planes = np.arange(len(projected))
    return _tables(_across(projected), planes, forms, inside.weights.shape[1], contrast)[1]


def _across(projected: Array) -> Array32:
    """Coordinates (P, 2, K) of colours on planes."""
    return np.ascontiguousarray(np.swapaxes(projected, 1, 2), np.float32)


def _forms(target: Mixture, background: Mixture, floor: float, prior: float) -> Array32:
    """Return a to e and k of 2^(k - (ax + by + c)² - (dy + e)²), (N, m, 6), the floor last."""
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
    forms = np.zeros((len(weights), weights.shape[1] + 1, 6), np.float32)
    with np.errstate(divide="ignore"):  # a weight or a floor of 0
        k = np.log2(priors * weights / (2 * np.pi * np.sqrt(determinant)))
        forms[:, -1, 5] = np.log2((1 - prior) * floor)
    forms[:, :-1] = np.stack([a, b, -a * x - b * y, d, -d * y, k], axis=-1)
    return forms


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
    others = np.empty(BLOCK, np.float32)
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
            others[:] = 0.0
            for m in range(n_target):
                _add_powers(terms[m, :some], largest[:some], table)
            for m in range(n_target, n_components):
                _add_powers(terms[m, :some], largest[:some], others[:some])
            scores[j] += _share(table, others[:some], contrast[begin:end])
    return tables, scores


@njit(cache=True, fastmath={"contract"})
def _exponents(
    x: Array32, y: Array32, form: tuple[np.float32, ...], exponents: Array32, largest: Array32
) -> None:
    """Logarithms to base 2 of a component at colours, and the largest of all so far."""
    a, b, c, d, e, k = form
    for i in range(len(x)):
        u = a * x[i] + b * y[i] + c
        v = d * y[i] + e
        exponent = k - u * u - v * v
        exponents[i] = exponent
        largest[i] = max(largest[i], exponent)


@njit(cache=True, fastmath={"contract"})
def _add_powers(exponents: Array32, largest: Array32, totals: Array32) -> None:
    """Add 2^(exponent - largest): in this form the compiler makes vector code of it."""
    for i in range(len(exponents)):
        exponent = max(exponents[i] - largest[i], LOWEST)
        whole = np.rint(exponent)
        f = exponent - whole
        power = FACTOR_4 + f * FACTOR_5
        power = FACTOR_3 + f * power
        power = FACTOR_2 + f * power
        power = FACTOR_1 + f * power
        power = FACTOR_0 + f * power
        bits = np.float32(power).view(np.int32) + (np.int32(whole) << np.int32(23))
        totals[i] += np.int32(bits).view(np.float32)


@njit(cache=True, fastmath={"contract", "reassoc"})
def _share(table: Array32, others: Array32, contrast: Array) -> float:
    """Make sums of the target's terms their share in all; Σ share · contrast."""
    score = 0.0
    for i in range(len(table)):
        table[i] /= table[i] + others[i]
        score += table[i] * contrast[i]
    return score
