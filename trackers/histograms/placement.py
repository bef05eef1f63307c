"""Where particles are placed to wait for a target, or to find it again."""

from collections import deque
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from trackers.base.parameters import TrackerError
from trackers.histograms.motion import at_rest

__all__ = ["Placement", "Whereabouts"]

Array: TypeAlias = NDArray[np.float64]
Placement: TypeAlias = Literal["last", "predicted", "borders", "image"]

REMEMBERED = 20  # frames over which the way of the target is averaged
FASTEST = 0.4  # speed that is believed [Hx/frame]
SIZE_SPREAD = 0.08  # of the logarithm of the size, with `predicted`


@dataclass
class Whereabouts:
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
        return at_rest(np.concatenate([around, inside]), sizes)

    def _prediction(self, frame: int) -> tuple[Array, Array]:
        (start, origin), (end, place) = self._reliable[0], self._reliable[-1]
        velocity = (place - origin) / max(end - start, 1)
        fastest = FASTEST * self.half_axes[0]
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
