"""Where people come into the picture."""

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.render.views import SIZE, Camera

__all__ = ["MIDDLE", "sides"]

MIDDLE = 0.82
"""Height of a person's middle between shoulders and ankles [metres]."""

WIDTH = 0.45
"""Of a person [metres]."""


def sides(camera: Camera, depths: tuple[float, float]) -> NDArray[np.float64]:
    """Stretches of the left and the right border, as wide as a person, shape (2, 4) [pixels].

    Parameters
    ----------
    camera : Camera
        It stands still.
    depths : tuple of float
        Nearest and farthest at which people cross the borders [metres].
    """
    bottom, top = (float(camera.row(MIDDLE, z)) for z in depths)
    width = WIDTH * float(camera.scale(sum(depths) / 2))
    return np.array(
        [[left, top, width, bottom - top] for left in (0.0, SIZE[0] - width)], np.float64
    )
