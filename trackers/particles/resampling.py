"""Resampling: which particles go on, in how many copies.

Each scheme takes normalised weights and as many numbers uniform on [0, 1), of which it uses
what it needs, and gives the indices of the particles that go on. A particle of weight π is
expected to go on in n π copies under every scheme; they differ in how far from that they stray.
"""

from collections.abc import Callable, Mapping
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["SCHEMES", "multinomial", "residual", "stratified", "systematic"]

Array: TypeAlias = NDArray[np.float64]
Indices: TypeAlias = NDArray[np.intp]

_BELOW_ONE = float(np.nextafter(1.0, 0.0))


def multinomial(weights: Array, uniforms: Array) -> Indices:
    """Independent draws with replacement, by binary search in the cumulative weights.

    The scheme of Condensation (Isard & Blake 1998).
    """
    return _found(weights, uniforms)


def stratified(weights: Array, uniforms: Array) -> Indices:
    """One draw from each of n equal strata of the cumulative weights (Kitagawa 1996)."""
    return _found(weights, (np.arange(len(uniforms)) + uniforms) / len(uniforms))


def systematic(weights: Array, uniforms: Array) -> Indices:
    """Equally spaced draws, all shifted by the one first number (Kitagawa 1996)."""
    return _found(weights, (np.arange(len(uniforms)) + uniforms[0]) / len(uniforms))


def residual(weights: Array, uniforms: Array) -> Indices:
    """⌊n π⌋ copies of each, the rest drawn from what is left over (Liu & Chen 1998)."""
    expected = len(weights) * weights
    copies = np.floor(expected + 1e-9).astype(np.intp)  # 49 · (1/49) is less than 1
    sure = np.repeat(np.arange(len(weights)), copies)
    left = np.maximum(expected - copies, 0.0)
    return np.concatenate([sure, _found(left, uniforms[len(sure) :])])


SCHEMES: Mapping[str, Callable[[Array, Array], Indices]] = {
    "multinomial": multinomial,
    "systematic": systematic,
    "stratified": stratified,
    "residual": residual,
}
"""The schemes by name."""


def _found(weights: Array, positions: Array) -> Indices:
    """Particle at each position in [0, 1] of the cumulative weights, never one of weight 0."""
    cumulative = weights.cumsum()
    sought = np.minimum(positions, _BELOW_ONE) * cumulative[-1]
    found: Indices = cumulative.searchsorted(sought, side="right")
    return found
