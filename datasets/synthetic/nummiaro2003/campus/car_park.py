"""A parking place before houses, seen from somewhat above."""

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from datasets.synthetic.nummiaro2003.campus.porch import porch
from datasets.synthetic.render.path import smooth_step
from datasets.synthetic.render.prop import Prop
from datasets.synthetic.render.street.car import car
from datasets.synthetic.render.street.ground import Band, ground_rows
from datasets.synthetic.render.street.street import HOUSES, Street
from datasets.synthetic.render.texture import fractal, grass, paving
from datasets.synthetic.render.views import Camera
from datasets.synthetic.scene import part_generator

__all__ = ["BAYS", "DOORSTEP", "THRESHOLD", "CarPark", "entrance", "parked_cars"]

BAYS = 13.1, 15.4
"""Where the cars stand [metres from the camera]."""

DOORSTEP = HOUSES - 1.2
"""Front of the porch [metres from the camera]."""

THRESHOLD = 0.4
"""Depth before and behind the porch's front over which it gets dark [metres]."""

LAWN = 7.9
"""Near edge of the asphalt [metres from the camera]."""

KEPT_FREE = 1.3
"""To both sides of the entrance's middle [metres]."""

REACH = 16.0
"""Nothing farther than this from the entrance is ever seen [metres]."""

INSIDE = 0.55
"""Light that the porch takes."""

SIDE = 512


class CarPark(Street):
    """Asphalt with bays before a pavement and houses.

    What stands there is `parked_cars` and `entrance`.
    """

    @cached_property
    def props(self) -> list[Prop]:
        """Nothing: all that stands here may hide someone."""
        return []

    def gains(self, x: float, z: float, heights: ArrayLike) -> NDArray[np.float64]:
        """See `Street.gains`; it is darker inside the porch."""
        inside = smooth_step(np.array(z), DOORSTEP - THRESHOLD, DOORSTEP + THRESHOLD)
        return super().gains(x, z, heights) * (1 - INSIDE * float(inside))

    @cached_property
    def _ground(self) -> tuple[NDArray[np.uint8], float]:
        random = part_generator(self._seed, "ground")
        rows = ground_rows(
            random,
            _bands(random),
            self._shade,
            self._still,
            self._scales,
            self._reach.x[0],
            self._widths(self._scales),
            self._margin,
        )
        return rows, self._first_row


def parked_cars(random: np.random.Generator, camera: Camera, door: float) -> list[Prop]:
    """Cars one behind the other, with a gap before the door at a lateral place [metres]."""
    z = sum(BAYS) / 2
    cars = []
    for side in (-1, 1):
        x = KEPT_FREE + random.uniform(2.5, 2.9)
        while x < REACH:
            one = car(random, door + side * x, z, float(camera.scale(z)))
            if random.random() < 0.85:
                cars.append(one)
            x += random.uniform(5.1, 5.8)
    return cars


def entrance(random: np.random.Generator, camera: Camera, door: float) -> list[Prop]:
    """Porch of a house, its door's middle at a lateral place [metres]."""
    front, back = DOORSTEP, HOUSES - 0.01
    return porch(
        random, door, (front, float(camera.scale(front))), (back, float(camera.scale(back)))
    )


def _bands(random: np.random.Generator) -> list[Band]:
    tone = 1 + 0.10 * fractal(random, SIDE, 32, 256, 0.9) + 0.07 * fractal(random, SIDE, 2, 16)
    asphalt = np.array([96.0, 96.0, 98.0]) * random.uniform(0.85, 1.2) * tone[..., None]
    paint = asphalt * 0.3 + 150
    kerbstone = 168 * (1 + 0.05 * fractal(random, SIDE, 8, 256))[..., None] * np.ones(3)
    kerbstone[:, :: SIDE // 4] *= 0.75
    stones = paving(random, SIDE)
    worn = stones.mean(axis=(0, 1))
    near, far = BAYS
    return [
        Band(0.0, grass(random, SIDE), 3.0),
        Band(LAWN - 0.15, kerbstone, 4.0),
        Band(LAWN, asphalt, 3.0),
        Band(near - 0.12, paint, 3.0),
        Band(near, asphalt, 3.0),
        Band(far, kerbstone, 4.0),
        Band(far + 0.15, (worn + 0.6 * (stones - worn)) * 1.1, 2.6),
    ]
