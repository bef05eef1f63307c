"""Equation 2 on a discrete model of two features, where all sums can be done (MO-5).

By equation 1 the second measurement depends on the first feature, z₂ = z₂(x₁, z₁). By Bayes' rule
p(x₁, x₂ | z₁, z₂) = p(x₂ | x₁, z₁, z₂) p(x₁ | z₁, z₂); the proof goes on with p(x₁ | z₁) in the
place of the latter. Nothing in equation 1 says so: what is measured of x₂ tells of x₁.
"""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

__all__ = ["DEPENDENCES", "distance", "factorisation", "joint"]

DEPENDENCES = ("equation 1 alone", "and p(x₁ | z₁, z₂) = p(x₁ | z₁)")
"""What is assumed: as the paper writes, and what its proof needs besides."""

STATES = 4  # of every feature and measurement
MODELS = 100

Array = NDArray[np.float64]


def factorisation() -> pd.DataFrame:
    """Distances of random models, the greatest of each dependence; see the package."""
    rows = []
    for dependence in DEPENDENCES:
        generator = np.random.default_rng(0)
        distances = [
            distance(joint(generator, informs=dependence == DEPENDENCES[0])) for _ in range(MODELS)
        ]
        rows.append({"dependence": dependence, "distance": max(distances)})
    return pd.DataFrame(rows)


def joint(generator: np.random.Generator, *, informs: bool) -> Array:
    """A random p(x₁, x₂, z₁, z₂) with the dependences of equation 1.

    Parameters
    ----------
    generator : Generator
        Draws all tables.
    informs : bool
        Whether z₂ tells of x₁. Where not, x₂ depends on x₁, and z₂ on both, so that p(z₂ | x₁, z₁)
        is the same for all x₁.

    Returns
    -------
    ndarray of float64, shape (4, 4, 4, 4)
        Sums to 1.
    """
    first = generator.dirichlet(np.ones(STATES))
    measured = generator.dirichlet(np.ones(STATES), STATES)  # z₁ given x₁
    if informs:
        second = generator.dirichlet(np.ones(STATES), (STATES, STATES))  # x₂ given x₁, z₁
        seen = generator.dirichlet(np.ones(STATES), (STATES,) * 3)  # z₂ given x₁, x₂, z₁
        both = second[..., np.newaxis] * seen.transpose(0, 2, 1, 3)
    else:
        total = generator.dirichlet(np.ones(STATES), STATES)  # z₂ given z₁
        shares = generator.dirichlet(np.ones(STATES), (STATES,) * 3)  # x₂ given x₁, z₁, z₂
        both = (total[np.newaxis, ..., np.newaxis] * shares).transpose(0, 1, 3, 2)
    # `both` is p(x₂, z₂ | x₁, z₁), axes x₁, z₁, x₂, z₂.
    whole = (first[:, np.newaxis] * measured)[..., np.newaxis, np.newaxis] * both
    return np.ascontiguousarray(whole.transpose(0, 2, 1, 3))


def distance(model: Array) -> float:
    """Greatest total variation, over measurements, of posterior and product of equation 2.

    Parameters
    ----------
    model : ndarray of float64, shape (n, n, n, n)
        p(x₁, x₂, z₁, z₂).
    """
    posterior = model / model.sum(axis=(0, 1))
    of_first = model.sum(axis=(1, 3))
    first = of_first / of_first.sum(axis=0)  # p(x₁ | z₁)
    second = model / model.sum(axis=1, keepdims=True)  # p(x₂ | x₁, z₁, z₂)
    product = first[:, np.newaxis, :, np.newaxis] * second
    return float(0.5 * np.abs(posterior - product).sum(axis=(0, 1)).max())
