"""Parameters of the one-dimensional example, of which the paper gives one: λ = 1; its truth."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["FRAMES", "NUMBERS", "SETTINGS", "Course", "Setting", "course"]

FRAMES = 100
NUMBERS = (5, 10, 20, *range(50, 501, 50))
"""Numbers of samples: the ticks of Fig. 2, and fewer."""

DECAY = 0.95  # σ_pos and σ_col: what is left of a deviation from the middle, a frame
POSITIONS, COLOURS = (-1.0, 1.0), (0.0, 1.0)
_MIDDLES = np.array([0.0, 0.5])
_STARTS = np.array([[-0.5, 0.25], [0.5, 0.75]])


@dataclass(frozen=True)
class Setting:
    """A set of parameters; pairs are of position and colour.

    Attributes
    ----------
    scale : float
        λ: the distance over which a weight falls to 1/e.
    noise : tuple of float
        Deviation of the truth's steps.
    observed : tuple of float
        Deviation of what is observed from the truth.
    dynamics : tuple of float
        Deviation of the filters' random walk.
    """

    scale: float
    noise: tuple[float, float]
    observed: tuple[float, float]
    dynamics: tuple[float, float]


def _literal(observed: float) -> Setting:
    return Setting(1.0, (0.1, 0.05), (observed, observed), (0.1, 0.05))


SETTINGS: Mapping[str, Setting] = {
    "A": _literal(0.1),
    "B": _literal(0.3),
    "C": _literal(0.5),
    "G": Setting(0.2, (0.05, 0.05), (0.2, 0.2), (0.05, 0.05)),
}
"""Sets by name: the printed weights with accurate, middling and poor observations; a tuned one."""


class Course(NamedTuple):
    """What happens to the point.

    Attributes
    ----------
    start : ndarray of float64, shape (2,)
        Position and colour before the first frame.
    truth, observed : ndarray of float64, shape (n, 2)
    """

    start: NDArray[np.float64]
    truth: NDArray[np.float64]
    observed: NDArray[np.float64]


def course(setting: Setting, frames: int, generator: np.random.Generator) -> Course:
    """Draw a course: both features go back to the middle and are thrown out again, in bounds."""
    start = generator.uniform(*_STARTS)
    truth = np.empty((frames, 2))
    state = start
    for frame, steps in enumerate(generator.normal(0.0, setting.noise, (frames, 2))):
        # (x - μ) σ + N(μ_noise, σ_noise) with μ_noise = μ
        state = (state - _MIDDLES) * DECAY + _MIDDLES + steps
        state = np.clip(state, *np.transpose([POSITIONS, COLOURS]))
        truth[frame] = state
    return Course(start, truth, truth + generator.normal(0.0, setting.observed, (frames, 2)))
