"""Which floor is where."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["FLOORS", "Zones", "drawn_zones"]

Array = NDArray[np.float64]

FLOORS = 3
"""Kinds of floor in a scene: that on which the octopus starts, that where it goes, another."""

SOFT = 4.0
"""About how far one floor reaches into another [pixels]."""

WAVES = ((9.0, 75.0), (4.0, 31.0), (2.0, 14.0))
"""Of the borders, in either direction: size and length [pixels]."""

ASIDE, APART = 105.0, 80.0
"""Least distance of further zones from the way, and from one another [pixels]."""

TRIALS = 60
"""Places that are tried for them."""


@dataclass(frozen=True)
class Zones:
    """Zones around points, with wavy borders.

    Attributes
    ----------
    points : ndarray of float64, shape (k, 2)
        [pixels].
    floors : ndarray of int64, shape (k,)
        Index of each zone's floor.
    phases : ndarray of float64, shape (2, 3)
        Of the waves.
    """

    points: Array
    floors: NDArray[np.int64]
    phases: Array

    def shares(self, places: Array) -> Array:
        """How much of each floor is at places of shape (..., 2); shape (..., FLOORS)."""
        bent = places.copy()
        for (size, length), phases in zip(WAVES, self.phases.T, strict=True):
            bent += size * np.sin(2 * np.pi * places[..., ::-1] / length + phases)
        distance = np.linalg.norm(bent[..., None, :] - self.points, axis=-1)
        nearest = np.stack(
            [distance[..., self.floors == floor].min(axis=-1) for floor in range(FLOORS)], axis=-1
        )
        weights = np.exp((nearest.min(axis=-1, keepdims=True) - nearest) / SOFT)
        return np.asarray(weights / weights.sum(axis=-1, keepdims=True))


def drawn_zones(random: np.random.Generator, way: Array, size: tuple[int, int]) -> Zones:
    """Zones in a picture: two that share a way, shape (n, 2), and others beside it."""
    points = [way[len(way) // 8], way[-len(way) // 8]]
    for place in random.uniform((-50, -50), np.array(size) + 50, (TRIALS, 2)):
        far = np.linalg.norm(way - place, axis=1).min() > ASIDE
        if far and np.linalg.norm(points - place, axis=1).min() > APART:
            points.append(place)
    further = random.permutation(np.arange(len(points) - 2) + 2) % FLOORS
    floors = np.concatenate([[0, 1], further])
    # What is nowhere else is far away.
    points.append(np.full(2, 1e4))
    phases = random.uniform(0, 2 * np.pi, (2, len(WAVES)))
    return Zones(np.array(points), np.append(floors, FLOORS - 1), phases)
