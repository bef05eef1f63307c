"""From light to grey levels: the lens, the camera's curve, the sensor's noise."""

import cv2
import numpy as np
from numpy.typing import NDArray

from datasets.interface import Image
from datasets.synthetic.render import compositing, light, noise

__all__ = ["Camera"]

LENS = 0.5
"""Standard deviation of the lens's blur [pixels]."""


class Camera:
    """One whose exposure stays as it is.

    Parameters
    ----------
    size : tuple of int
        Width and height of its images [pixels].
    deviation : float
        Standard deviation of the sensor's noise [grey levels].
    """

    def __init__(self, size: tuple[int, int], deviation: float) -> None:
        self._gains = [light.fixed_point(light.vignette(side, 0.05)) for side in size]
        self._noise = noise.noise_table(deviation)

    def image(self, seen: NDArray[np.float32], seed: int, frame: int) -> Image:
        """Image of light.

        Parameters
        ----------
        seen : ndarray of float32, shape (height, width, 3)
            Linear light, BGR; 1 is white. A grey level is its square root.
        seed, frame : int
            Of the noise.
        """
        blurred = np.asarray(cv2.GaussianBlur(seen, (0, 0), LENS))
        levels = 255 * np.sqrt(np.clip(blurred, 0, 1)) + np.float32(0.5)
        canvas: Image = levels.astype(np.uint8)
        columns, rows = self._gains
        compositing.develop(
            canvas, rows, columns, self._noise, noise.random_bytes(seed, frame, canvas.size)
        )
        return canvas
