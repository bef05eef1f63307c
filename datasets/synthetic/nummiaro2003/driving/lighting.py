"""Light on facets: an overcast sky, and the shade of trees that stays where it is."""

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.nummiaro2003.driving.facets import packed
from datasets.synthetic.nummiaro2003.driving.posing import SHADE_SIDE
from datasets.synthetic.render.street.ground import PERIOD, Light, Shade
from datasets.synthetic.render.texture import fractal

__all__ = ["Lighting"]

Array = NDArray[np.float64]

_UNIT = 128  # no shade


class Lighting:
    """Light in a scene.

    Parameters
    ----------
    random : numpy.random.Generator
        Draws shade and stains.
    light : {'even', 'dappled'}
        Of the sky.

    Attributes
    ----------
    ground, things : Pictures
        Shade on the ground, where stains and worn places are part of it, and on all else.
    """

    def __init__(self, random: np.random.Generator, light: Light) -> None:
        places = (np.arange(SHADE_SIDE) + 0.5) * (PERIOD / SHADE_SIDE)
        self._shade = Shade(random, light)
        gains = self._shade.at(places[None, :], places[:, None])
        stains = 1 + 0.05 * fractal(random, SHADE_SIDE, 2, 64, 0.75)
        self.ground, self.things = (
            packed([np.repeat((_UNIT * g)[..., None], 3, axis=2)]) for g in (gains * stains, gains)
        )

    def on(self, x: float, z: float, height: float) -> float:
        """Light at a height above a place; all in metres."""
        return float(self._shade.on_upright(x, z, height))
