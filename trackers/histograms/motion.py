"""How elliptic particles move, and where they are placed to wait for a target.

A state is x, y, vx, vy, Hx, Hy, a': centre and velocity, half axes, and change of scale a frame
(Nummiaro et al. 2003, section 4). In the linear form a' is in pixels of Hx, in the multiplicative
one it is a ratio.
"""

from collections import deque
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import numpy as np

from trackmark.trackers.base.arrays import Array
from trackmark.trackers.base.parameters import TrackerError

Dynamics: TypeAlias = Literal["first-order", "second-order", "random-walk"]
Axes: TypeAlias = Literal["together", "apart"]
ScaleChange: TypeAlias = Literal["linear", "multiplicative"]

MIN_HALF_AXIS = 3.0  # pixels

X, V, H, A = slice(0, 2), slice(2, 4), slice(4, 6), 6
"""Where a state holds its centre, velocity, half axes and change of scale."""


def states_at_rest(centres: Array, half_axes: Array) -> Array:
    """States at rest, shape (n, 7), of centres (n, 2) and half axes (2,) or (n, 2) [pixels]."""
    states = np.zeros((len(centres), 7))
    states[:, X], states[:, H] = centres, half_axes
    return states


def ellipse_in(box: Array) -> Array:
    """State at rest of the ellipse in a box `[x, y, width, height]` [pixels], shape (7,)."""
    half_axes = np.maximum(box[2:] / 2, MIN_HALF_AXIS)
    return np.asarray(states_at_rest((box[:2] + box[2:] / 2)[np.newaxis], half_axes)[0])


def box_around(state: Array) -> Array:
    """Box `[x, y, width, height]` around the ellipse of a state (7,) [pixels]."""
    return np.asarray(np.concatenate([state[X] - state[H], 2 * state[H]]))


@dataclass(frozen=True)
class MotionModel:
    """A model of motion; its noises are Gaussian, given by deviations in lengths of Hx.

    `first-order`: velocity and change of scale are constant but for the noise. `second-order`:
    their rates of change are, which then take noises of the same size. `random-walk`: there is
    neither. Half axes have one noise of scale `together`, and their ratio then stays, or one each
    (`apart`). They grow by sums (`linear`), and all noise is in lengths of the last estimate's Hx,
    so that a step is a linear map and noise that is the same for all; or by factors
    (`multiplicative`), and noise is in lengths of each particle's own Hx.
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
        """Move particles (n, 7) by a frame: new states and rates.

        Rates (n, 3) are how vx, vy and a' change a frame; second-order dynamics alone use them.
        `half_width` is Hx of the last estimate [pixels], `aspect` Hy / Hx of the target; half axes
        stay within 3 pixels and `image_size`, width and height. Ten numbers are drawn a particle,
        whatever the model.
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
            least = max(MIN_HALF_AXIS, MIN_HALF_AXIS / aspect)
            most = max(min(width, height / aspect), least)
            states[:, 4] = np.clip(states[:, 4], least, most)
            states[:, 5] = states[:, 4] * aspect
        else:
            np.clip(states[:, H], MIN_HALF_AXIS, [width, height], out=states[:, H])


Placement: TypeAlias = Literal["last", "predicted", "borders", "image"]

REMEMBERED = 20  # frames over which the way of the target is averaged
MAX_SPEED = 0.4  # speed that is believed [Hx/frame]
SIZE_SPREAD = 0.08  # of the logarithm of the size, with `predicted`


@dataclass
class LocationMemory:
    """What is known of where a target was, and where it may come in.

    Entries (k, 4) are boxes in which a target that enters has its centre: doors, borders. Without
    any it is the left and the right border, at the height at which the target was last. Raises
    TrackerError for entries that are no boxes.
    """

    half_axes: Array  # (2,): Hx and Hy when last seen [pixels]
    image_size: tuple[int, int]  # width and height [pixels]
    entries: Array | None = None
    _seen: Array | None = None
    _reliable: deque[tuple[int, Array]] = field(default_factory=lambda: deque(maxlen=REMEMBERED))

    def __post_init__(self) -> None:
        if self.entries is None:
            return
        self.entries = np.array(self.entries, float)
        if self.entries.ndim != 2 or self.entries.shape[1] != 4 or len(self.entries) == 0:
            shape = self.entries.shape
            raise TrackerError(f"regions must be boxes, shape (k, 4) with k > 0, not {shape}.")
        if not np.isfinite(self.entries).all() or (self.entries[:, 2:] < 0).any():
            raise TrackerError(f"regions must have finite sizes: {self.entries.tolist()}.")

    def seen(self, centre: Array, half_axes: Array) -> None:
        """Note where the target is thought to be, most particles looking like it."""
        self._seen, self.half_axes = centre.copy(), half_axes.copy()

    def certain(self, frame: int, centre: Array) -> None:
        """Note where the target surely was in a frame."""
        self._reliable.append((frame, centre.copy()))

    def particles(
        self, placement: Placement, n: int, frame: int, random: np.random.Generator
    ) -> Array:
        """So many particles at rest, shape (n, 7), as it is `frame` now.

        'borders': where it may enter. 'image': anywhere. 'last': half of them where it may
        enter, half around where it was last seen, by 3 Hx sideways and Hx upright. 'predicted':
        three tenths where it may enter, the others around where it would be now, had it gone on
        as before. Where it has never been seen, all where it may enter; 'image' does so where
        `entries` are given.
        """
        sizes: Array = self.half_axes
        share, centre, deviation = 0.0, np.zeros(2), np.zeros(2)
        if placement == "last" and self._seen is not None:
            share, centre, deviation = 0.5, self._seen, sizes[0] * np.array([3.0, 1.0])
        elif placement == "predicted" and self._reliable:
            share = 0.7
            centre, deviation = self._prediction(frame)
            spread = random.standard_normal((n, 1))
            sizes = np.maximum(sizes * np.exp(SIZE_SPREAD * spread), 1.0)
        near = round(share * n)
        around = centre + deviation * random.standard_normal((near, 2))
        known = self.entries is not None and self._seen is None  # it has yet to come in
        anywhere = self._anywhere() if placement == "image" and not known else self._entries()
        chosen = anywhere[random.integers(len(anywhere), size=n - near)]
        inside = chosen[:, :2] + random.random((n - near, 2)) * chosen[:, 2:]
        return states_at_rest(np.concatenate([around, inside]), sizes)

    def _prediction(self, frame: int) -> tuple[Array, Array]:
        (start, origin), (end, place) = self._reliable[0], self._reliable[-1]
        velocity = (place - origin) / max(end - start, 1)
        fastest = MAX_SPEED * self.half_axes[0]
        lost = frame - end
        centre = place + lost * np.clip(velocity, -fastest, fastest)
        spread = np.array([min(3.0, 1.0 + 0.05 * lost), 0.5])
        return centre, self.half_axes[0] * spread

    def _anywhere(self) -> Array:
        """The box of centres of ellipses that are whole inside the image."""
        size = np.array(self.image_size, float)
        low = np.minimum(self.half_axes, size / 2)
        return np.concatenate([low, size - 2 * low])[np.newaxis]

    def _entries(self) -> Array:
        if self.entries is not None:
            return self.entries
        half_width, half_height = self.half_axes
        width, height = self.image_size
        middle = height / 2 if self._seen is None else self._seen[1]
        upright = [middle - half_height / 2, half_width, half_height]
        return np.array([[x - half_width / 2, *upright] for x in (half_width, width - half_width)])
