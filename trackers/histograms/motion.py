"""How elliptic particles move: at constant velocity and constant change of scale, with noise.

A state is x, y, vx, vy, Hx, Hy, a': centre and velocity, half axes, and change of scale a frame
(Nummiaro et al. 2003, section 4). In the linear form a' is in pixels of Hx, in the
multiplicative one it is a ratio.
"""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["Axes", "Dynamics", "Motion", "ScaleChange", "at_rest", "box_around", "ellipse_in"]

Array: TypeAlias = NDArray[np.float64]
Dynamics: TypeAlias = Literal["first-order", "second-order", "random-walk"]
Axes: TypeAlias = Literal["together", "apart"]
ScaleChange: TypeAlias = Literal["linear", "multiplicative"]

LEAST_HALF_AXIS = 3.0  # pixels

X, V, H, A = slice(0, 2), slice(2, 4), slice(4, 6), 6
"""Where a state holds its centre, velocity, half axes and change of scale."""


def at_rest(centres: Array, half_axes: Array) -> Array:
    """States at rest, shape (n, 7), of centres (n, 2) and half axes (2,) or (n, 2) [pixels]."""
    states = np.zeros((len(centres), 7))
    states[:, X], states[:, H] = centres, half_axes
    return states


def ellipse_in(box: Array) -> Array:
    """State at rest of the ellipse in a box `[x, y, width, height]` [pixels], shape (7,)."""
    half_axes = np.maximum(box[2:] / 2, LEAST_HALF_AXIS)
    return np.asarray(at_rest((box[:2] + box[2:] / 2)[np.newaxis], half_axes)[0])


def box_around(state: Array) -> Array:
    """Box `[x, y, width, height]` around the ellipse of a state (7,) [pixels]."""
    return np.asarray(np.concatenate([state[X] - state[H], 2 * state[H]]))


@dataclass(frozen=True)
class Motion:
    """A model of motion; its noises are Gaussian, given by deviations in lengths of Hx.

    Attributes
    ----------
    dynamics : {'first-order', 'second-order', 'random-walk'}
        Velocity and change of scale are constant but for the noise; or their rates of change
        are, which then take noises of the same size; or there is neither.
    axes : {'together', 'apart'}
        One noise of scale for both half axes, whose ratio then stays; or one for each.
    scale_change : {'linear', 'multiplicative'}
        Half axes grow by sums, and all noise is in lengths of the last estimate's Hx, so that
        a step is a linear map and noise that is the same for all; or by factors, and noise is
        in lengths of each particle's own Hx.
    scale_persistence : float
        What is left of a' after a frame; 1 is undamped [ratio].
    position_noise, velocity_noise, size_noise, scale_noise : float
        Deviations of the noise of centre, velocity, half axes and a' [Hx].
    """

    dynamics: Dynamics
    axes: Axes
    scale_change: ScaleChange
    scale_persistence: float
    position_noise: float
    velocity_noise: float
    size_noise: float
    scale_noise: float

    def step(
        self,
        states: Array,
        rates: Array,
        half_width: float,
        aspect: float,
        image_size: tuple[int, int],
        random: np.random.Generator,
    ) -> tuple[Array, Array]:
        """Move particles by a frame: new states and rates.

        Parameters
        ----------
        states : ndarray of float64, shape (n, 7)
        rates : ndarray of float64, shape (n, 3)
            How vx, vy and a' change a frame; used by second-order dynamics alone.
        half_width, aspect : float
            Hx of the last estimate [pixels], and Hy / Hx of the target.
        image_size : tuple of int
            Width and height of the image: half axes stay within 3 pixels and these.
        random : numpy.random.Generator
            Ten numbers are drawn a particle, whatever the model.
        """
        linear = self.scale_change == "linear"
        unit = half_width if linear else states[:, H][:, :1]  # of lengths
        ratio_unit = half_width if linear else 1.0  # of changes of scale
        noise = random.standard_normal((len(states), 10))
        moved, new_rates = states.copy(), rates
        if self.dynamics != "random-walk":
            moved[:, X] += states[:, V]
            moved[:, V] += self.velocity_noise * unit * noise[:, 2:4]
            moved[:, A] *= self.scale_persistence
            moved[:, A] += self.scale_noise * ratio_unit * noise[:, 6]
        if self.dynamics == "second-order":
            moved[:, V] += rates[:, :2]
            moved[:, A] += rates[:, 2]
            new_rates = rates.copy()
            new_rates[:, :2] += self.velocity_noise * unit * noise[:, 7:9]
            new_rates[:, 2] += self.scale_noise * ratio_unit * noise[:, 9]
        moved[:, X] += self.position_noise * unit * noise[:, :2]
        changes = np.stack([noise[:, 4], noise[:, 4 if self.axes == "together" else 5]], axis=1)
        if linear:
            grown = states[:, A, np.newaxis] + self.size_noise * half_width * changes
            moved[:, H] += grown * [1.0, aspect]
        else:
            moved[:, H] *= (1.0 + states[:, A, np.newaxis]) * (1.0 + self.size_noise * changes)
        self._keep_in_bounds(moved, aspect, image_size)
        return moved, new_rates

    def _keep_in_bounds(self, states: Array, aspect: float, image_size: tuple[int, int]) -> None:
        width, height = image_size
        if self.axes == "together":
            least = max(LEAST_HALF_AXIS, LEAST_HALF_AXIS / aspect)
            most = max(min(width, height / aspect), least)
            states[:, 4] = np.clip(states[:, 4], least, most)
            states[:, 5] = states[:, 4] * aspect
        else:
            np.clip(states[:, H], LEAST_HALF_AXIS, [width, height], out=states[:, H])
