"""Dynamic models of elliptic particles, and their placement while the target is lost.

A state is x, y, vx, vy, Hx, Hy, a': centre, velocity, half axes, and change of scale per frame
(Nummiaro et al. 2003, section 4). a' is in pixels of Hx if scale changes are linear, otherwise a
ratio.
"""

from collections import deque
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

import numpy as np

from trackmark.trackers.base.arrays import Array
from trackmark.trackers.base.parameters import TrackerError

Dynamics: TypeAlias = Literal["first-order", "second-order", "random-walk"]
Axes: TypeAlias = Literal["together", "apart"]
ScaleChange: TypeAlias = Literal["linear", "multiplicative"]

MIN_HALF_AXIS = 3.0  # pixels

X, V, H, A = slice(0, 2), slice(2, 4), slice(4, 6), 6
"""Indices of centre, velocity, half axes and change of scale in a state."""


def states_at_rest(centres: Array, half_axes: Array) -> Array:
    """Return states without velocity, (n, 7), from centres (n, 2) and half axes [pixels]."""
    states = np.zeros((len(centres), 7))
    states[:, X], states[:, H] = centres, half_axes
    return states


def ellipse_in(box: Array) -> Array:
    """Return the state (7,) of the ellipse inscribed in a box (4,) [pixels], at rest."""
    half_axes = np.maximum(box[2:] / 2, MIN_HALF_AXIS)
    return np.asarray(states_at_rest((box[:2] + box[2:] / 2)[np.newaxis], half_axes)[0])


def box_around(state: Array) -> Array:
    """Return the bounding box (4,) of the ellipse of a state (7,) [pixels]."""
    return np.asarray(np.concatenate([state[X] - state[H], 2 * state[H]]))


def propagate(
    parameters: Any,
    states: Array,
    rates: Array,
    half_width: float,
    aspect: float,
    image_size: tuple[int, int],
    random: np.random.Generator,
) -> tuple[Array, Array]:
    """Return the states (n, 7) and rates (n, 3) of particles in the next frame.

    The `parameters` are those of `nummiaro2003`. `dynamics` names the quantities that are constant
    except for noise. `first-order`: velocity and change of scale. `second-order`: their rates of
    change, with noise of the same size. `random-walk`: position and size. `axes=together` draws one
    size noise for both half axes, so that their ratio is constant; `apart` draws one for each.
    `scale_change=linear` adds changes to half axes, with noise in units of the last estimate's Hx.
    A step is then a linear map plus noise of the same distribution for all particles.
    `multiplicative` multiplies half axes by factors, with noise in units of each particle's Hx.

    Rates are the changes of vx, vy and a' per frame (second-order dynamics). `half_width`: Hx
    of the last estimate [pixels]. `aspect`: Hy / Hx of the target. Half axes are clipped to [3
    pixels, `image_size`]. Every model draws ten random numbers per particle.
    """
    linear = parameters.scale_change == "linear"
    unit = half_width if linear else states[:, H][:, :1]  # unit of lengths
    ratio_unit = half_width if linear else 1.0  # unit of changes of scale
    noise = random.standard_normal((len(states), 10))
    moved, new_rates = states.copy(), rates
    if parameters.dynamics != "random-walk":
        moved[:, X] += states[:, V]
        moved[:, V] += parameters.velocity_noise * unit * noise[:, 2:4]
        moved[:, A] *= parameters.scale_persistence
        moved[:, A] += parameters.scale_noise * ratio_unit * noise[:, 6]
    if parameters.dynamics == "second-order":
        moved[:, V] += rates[:, :2]
        moved[:, A] += rates[:, 2]
        new_rates = rates.copy()
        new_rates[:, :2] += parameters.velocity_noise * unit * noise[:, 7:9]
        new_rates[:, 2] += parameters.scale_noise * ratio_unit * noise[:, 9]
    moved[:, X] += parameters.position_noise * unit * noise[:, :2]
    changes = np.stack([noise[:, 4], noise[:, 4 if parameters.axes == "together" else 5]], axis=1)
    if linear:
        grown = states[:, A, np.newaxis] + parameters.size_noise * half_width * changes
        moved[:, H] += grown * [1.0, aspect]
    else:
        moved[:, H] *= (1.0 + states[:, A, np.newaxis]) * (1.0 + parameters.size_noise * changes)
    width, height = image_size
    if parameters.axes == "together":
        minimum = max(MIN_HALF_AXIS, MIN_HALF_AXIS / aspect)
        maximum = max(min(width, height / aspect), minimum)
        moved[:, 4] = np.clip(moved[:, 4], minimum, maximum)
        moved[:, 5] = moved[:, 4] * aspect
    else:
        np.clip(moved[:, H], MIN_HALF_AXIS, [width, height], out=moved[:, H])
    return moved, new_rates


Placement: TypeAlias = Literal["last", "predicted", "borders", "image"]

NEAR_SHARE = 0.5  # share of particles near the last position, with `last`
NEAR_SPREAD = 3.0, 1.0  # standard deviations of these particles in x and y [Hx]
N_REMEMBERED = 20  # positions that determine the mean velocity
MAX_SPEED = 0.4  # limit of the mean velocity per axis [Hx/frame]
SIZE_SPREAD = 0.08  # standard deviation of the logarithm of the size, with `predicted`
PREDICTED_SHARE = 0.7  # share of particles near the predicted position, with `predicted`
PREDICTED_SPREAD = 1.0, 0.5  # standard deviations of these particles in x and y [Hx]
SPREAD_GROWTH, MAX_SPREAD = 0.05, 3.0  # growth in x per lost frame, and limit [Hx]


@dataclass
class LocationMemory:
    """Last positions of a target, and the boxes in which it can enter.

    `entry_boxes` (k, 4) are boxes for the centre of an entering target, such as doors. By default,
    these are the left and the right border, at the last y position of the target. Raises
    TrackerError if entries are not boxes.
    """

    half_axes: Array  # (2,): last Hx and Hy [pixels]
    image_size: tuple[int, int]  # width and height [pixels]
    entry_boxes: Array | None = None
    _last_seen: Array | None = None
    _reliable: deque[tuple[int, Array]] = field(default_factory=lambda: deque(maxlen=N_REMEMBERED))

    def __post_init__(self) -> None:
        if self.entry_boxes is None:
            return
        self.entry_boxes = np.array(self.entry_boxes, float)
        if (
            self.entry_boxes.ndim != 2
            or self.entry_boxes.shape[1] != 4
            or len(self.entry_boxes) == 0
        ):
            shape = self.entry_boxes.shape
            raise TrackerError(
                f"the array of regions has shape {shape}. Expected: boxes, shape (k, 4) with k > 0."
            )
        if not np.isfinite(self.entry_boxes).all() or (self.entry_boxes[:, 2:] < 0).any():
            raise TrackerError(
                f"invalid regions {self.entry_boxes.tolist()}. Expected: finite boxes without a "
                "negative size."
            )

    def record_probable(self, centre: Array, half_axes: Array) -> None:
        """Store a probable position, at which most particles are similar to the target."""
        self._last_seen, self.half_axes = centre.copy(), half_axes.copy()

    def record_certain(self, frame: int, centre: Array) -> None:
        """Store a certain position, at which the estimate is very similar to the target."""
        self._reliable.append((frame, centre.copy()))

    def particles(
        self, placement: Placement, n: int, frame: int, random: np.random.Generator
    ) -> Array:
        """Draw `n` particles at rest, (n, 7), to search for the target in a frame.

        `borders` draws them in the entry boxes, `image` in the whole image. `last` draws half in
        the entry boxes and half around the last probable position, with deviations of 3 Hx in x and
        Hx in y. `predicted` draws 30 % in the entry boxes and 70 % around the prediction by the
        mean velocity. Before the first stored position, all particles are in the entry boxes. With
        `image`, this applies only if `entry_boxes` were given.
        """
        sizes: Array = self.half_axes
        share, centre, deviation = 0.0, np.zeros(2), np.zeros(2)
        if placement == "last" and self._last_seen is not None:
            share, centre, deviation = NEAR_SHARE, self._last_seen, sizes[0] * np.array(NEAR_SPREAD)
        elif placement == "predicted" and self._reliable:
            share = PREDICTED_SHARE
            centre, deviation = self._prediction(frame)
            spread = random.standard_normal((n, 1))
            sizes = np.maximum(sizes * np.exp(SIZE_SPREAD * spread), 1.0)
        n_near = round(share * n)
        around = centre + deviation * random.standard_normal((n_near, 2))
        has_not_entered = (
            self.entry_boxes is not None and self._last_seen is None
        )  # the target has not entered yet
        boxes = (
            self._image_box()
            if placement == "image" and not has_not_entered
            else self._entry_boxes()
        )
        entry_boxes = boxes[random.integers(len(boxes), size=n - n_near)]
        inside = entry_boxes[:, :2] + random.random((n - n_near, 2)) * entry_boxes[:, 2:]
        return states_at_rest(np.concatenate([around, inside]), sizes)

    def _prediction(self, frame: int) -> tuple[Array, Array]:
        (start, origin), (end, position) = self._reliable[0], self._reliable[-1]
        velocity = (position - origin) / max(end - start, 1)
        fastest = MAX_SPEED * self.half_axes[0]
        lost = frame - end
        centre = position + lost * np.clip(velocity, -fastest, fastest)
        across, upwards = PREDICTED_SPREAD
        spread = np.array([min(MAX_SPREAD, across + SPREAD_GROWTH * lost), upwards])
        return centre, self.half_axes[0] * spread

    def _image_box(self) -> Array:
        """Return the box (1, 4) of centres of ellipses that are completely in the image."""
        size = np.array(self.image_size, float)
        low = np.minimum(self.half_axes, size / 2)
        return np.concatenate([low, size - 2 * low])[np.newaxis]

    def _entry_boxes(self) -> Array:
        if self.entry_boxes is not None:
            return self.entry_boxes
        half_width, half_height = self.half_axes
        width, height = self.image_size
        middle = height / 2 if self._last_seen is None else self._last_seen[1]
        upright = [middle - half_height / 2, half_width, half_height]
        return np.array([[x - half_width / 2, *upright] for x in (half_width, width - half_width)])
