"""The one pinhole camera of scenes in a street.

World: x to the right, height up from the ground, depth z away from the camera; metres.
"""

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

__all__ = ["FRAMES_PER_SECOND", "SIZE", "Camera"]

SIZE = 640, 480
"""Width and height of its images [pixels]."""

FRAMES_PER_SECOND = 25.0

Number = TypeVar("Number", float, NDArray[np.float64])


@dataclass(frozen=True)
class Camera:
    """Camera at one instant.

    Attributes
    ----------
    focal : float
        Focal length [pixels].
    eye : float
        Height above the ground [metres].
    horizon : float
        Row of the horizon without shift [pixels].
    centre : float
        Column of the optical axis without shift [pixels].
    x : float
        Lateral place [metres].
    shift_x, shift_y : float
        Shift of the whole picture by turning and shaking, to the right and down [pixels].
    """

    focal: float
    eye: float
    horizon: float
    centre: float
    x: float = 0.0
    shift_x: float = 0.0
    shift_y: float = 0.0

    def scale(self, z: Number) -> Number:
        """Pixels per metre at a depth [metres]."""
        return self.focal / z

    def column(self, x: Number, z: Number) -> Number:
        """Image column of a place at a depth, both in metres."""
        return self.centre + self.shift_x + (x - self.x) * self.scale(z)

    def row(self, height: Number, z: Number) -> Number:
        """Image row of a height above the ground at a depth, both in metres."""
        return self.horizon + self.shift_y + (self.eye - height) * self.scale(z)
