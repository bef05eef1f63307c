"""Things that stand in the street, each painted once at the size in which it is seen."""

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.render.layers import instants
from datasets.synthetic.render.pinhole import Camera
from datasets.synthetic.render.sprite import Sprite

__all__ = ["Prop"]


class Prop:
    """A thing that stands at a place.

    Parameters
    ----------
    x, z : float
        Where its middle stands [metres].
    colour : ndarray of float64, shape (h, w, 3)
        BGR in [0, 255], at the size in which it is seen at its depth.
    coverage : ndarray of float64, shape (h, w)
        In [0, 1].
    foot : float
        Row of the picture at which it stands [pixels from its upper end].
    """

    def __init__(
        self,
        x: float,
        z: float,
        colour: NDArray[np.float64],
        coverage: NDArray[np.float64],
        foot: float,
    ) -> None:
        self.x, self.z = x, z
        self._sprite = Sprite(colour, coverage)
        self._alpha = np.round(coverage * 255).astype(np.uint8)
        self._rise = foot - coverage.shape[0] / 2

    def middle(self, camera: Camera) -> tuple[float, float]:
        """Where the picture's middle is seen [pixels]."""
        return (
            float(camera.column(self.x, self.z)),
            float(camera.row(0.0, self.z)) - self._rise,
        )

    def draw(
        self, canvas: NDArray[np.uint8], camera: Camera, motion: float = 0.0, travel: float = 0.0
    ) -> None:
        """Draw it, blurred by the camera's motion.

        Parameters
        ----------
        canvas : ndarray of uint8, shape (height, width, 3)
            Changed in place.
        camera : Camera
            At mid-exposure.
        motion : float
            Sideways shift of the whole picture during the exposure [pixels].
        travel : float
            Of the camera during the exposure [metres].
        """
        x, y = self.middle(camera)
        reach = self._sprite.width / 2 + abs(motion) + abs(travel) * float(camera.scale(self.z))
        if not -reach < x < canvas.shape[1] + reach:
            return
        displacement = motion - travel * float(camera.scale(self.z))
        moments = instants(displacement)
        centres = np.stack([x + moments * displacement, np.full(len(moments), y)], axis=1)
        self._sprite.draw(canvas, centres, 1.0)

    def coverage(self, camera: Camera) -> tuple[int, int, NDArray[np.uint8]]:
        """Silhouette to the nearest pixel: left, top [pixels], covered part in [0, 255]."""
        x, y = self.middle(camera)
        height, width = self._alpha.shape
        return round(x - width / 2), round(y - height / 2), self._alpha
