"""Where a clip plays: the far, the ground, and what stands about; a moving camera sees it."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from datasets.interface import Image
from datasets.synthetic.render.layers import draw_rows, instants
from datasets.synthetic.render.prop import Prop
from datasets.synthetic.render.street.ground import Band, Shade, ground_rows
from datasets.synthetic.render.views import Camera

__all__ = ["Backdrop", "Place", "Scenery", "Standing"]

Array = NDArray[np.float64]

Backdrop = Callable[[np.random.Generator, int, int, float, float], Image]
"""Paints what is far: random numbers, height, width, [pixels/metre], row of its foot."""


@dataclass(frozen=True)
class Standing:
    """Things of a kind that stand about.

    Attributes
    ----------
    make : function
        Makes one at a place [metres], given [pixels/metre] there.
    spacing : float
        Mean distance of neighbours [metres].
    depth : tuple of float
        Least and largest [metres].
    """

    make: Callable[[np.random.Generator, float, float, float], Prop]
    spacing: float
    depth: tuple[float, float]


@dataclass(frozen=True)
class Scenery:
    """What a place is made of.

    Attributes
    ----------
    backdrop : Backdrop
    end : float
        Where the ground ends and the backdrop begins [metres].
    ground : function
        Bands of the ground, given random numbers and `end`.
    standing : tuple of Standing
    """

    backdrop: Backdrop
    end: float
    ground: Callable[[np.random.Generator, float], list[Band]]
    standing: tuple[Standing, ...]


class Place:
    """A place, painted as far as a camera gets along it.

    Parameters
    ----------
    random : numpy.random.Generator
        Draws all of it.
    scenery : Scenery
    still : Camera
        At the left end of its way.
    size : tuple of int
        Width and height of the pictures [pixels].
    way : float
        How far the camera gets [metres].
    shake : float
        How far it nods up and down [pixels].
    """

    def __init__(
        self,
        random: np.random.Generator,
        scenery: Scenery,
        still: Camera,
        size: tuple[int, int],
        way: float,
        shake: float,
    ) -> None:
        self._scenery = scenery
        self._still = still
        self._size = size
        self._way = way
        self._shake = int(np.ceil(shake)) + 1
        end = float(still.scale(scenery.end))
        base = float(still.row(0.0, scenery.end)) + self._shake
        height, width = int(np.ceil(base)) + 3, int(self._widths(np.array([end]))[0])
        self._far = scenery.backdrop(random, height, width, end, base)
        self._ground = ground_rows(
            random,
            scenery.ground(random, scenery.end),
            _Even(),
            still,
            self._scales,
            still.x,
            self._widths(self._scales),
            self._margin,
        )
        things = [thing for kind in scenery.standing for thing in self._stood(random, kind)]
        self._things = sorted(things, key=lambda thing: -thing.z)

    def draw(self, canvas: Image, camera: Camera, travel: float) -> None:
        """Fill a picture.

        Parameters
        ----------
        canvas : ndarray of uint8, shape (height, width, 3)
            Changed in place.
        camera : Camera
            At mid-exposure.
        travel : float
            Of the camera during the exposure [metres].
        """
        boundary = int(np.floor(camera.row(0.0, self._scenery.end) + 0.5))
        end = np.full(len(self._far), self._still.scale(self._scenery.end))
        top = round((camera.shift_y - self._shake) * 64)
        draw_rows(canvas, self._far, top, self._lefts(camera, end, travel), 0, boundary)
        first = round((self._first + camera.shift_y) * 64)
        lefts = self._lefts(camera, self._scales, travel)
        draw_rows(canvas, self._ground, first, lefts, boundary, len(canvas))
        for thing in self._things:
            thing.draw(canvas, camera, travel=travel)

    def _stood(self, random: np.random.Generator, kind: Standing) -> list[Prop]:
        things = []
        half = self._size[0] / 2 / float(self._still.scale(kind.depth[1])) + 2
        x = self._still.x - half + random.uniform(0, kind.spacing)
        while x < self._still.x + self._way + half:
            z = random.uniform(*kind.depth)
            things.append(kind.make(random, x, z, float(self._still.scale(z))))
            x += random.uniform(0.6, 1.4) * kind.spacing
        return things

    @property
    def _margin(self) -> float:
        """Column of a panorama at which the picture's middle is at the way's left end."""
        return self._still.centre + 24

    def _widths(self, scales: Array) -> NDArray[np.int64]:
        return np.asarray(np.ceil(self._way * scales + self._size[0] + 50), np.int64)

    def _lefts(self, camera: Camera, scales: Array, travel: float) -> NDArray[np.int64]:
        """Column of a panorama at the picture's left border, by instant and row [1/64 pixel]."""
        moments = instants(travel * float(scales.max()))[:, None]
        lefts = (camera.x - self._still.x + moments * travel) * scales
        places = np.round((lefts + self._margin - camera.centre) * 64).astype(np.int64)
        return np.clip(places, 0, (self._widths(scales) - self._size[0] - 2) * 64)

    @property
    def _first(self) -> float:
        """Row of the picture at which the ground's rows begin, without shake."""
        return float(np.floor(self._still.row(0.0, self._scenery.end))) - 2

    @cached_property
    def _scales(self) -> Array:
        """Of every row of the ground [pixels/metre]."""
        rows = np.arange(self._first, self._size[1] + self._shake + 2) + 0.5
        return np.asarray((rows - self._still.horizon) / self._still.eye)


class _Even(Shade):
    """Even light, without the crowns that give shade in any other: they take long to draw."""

    def __init__(self) -> None:
        self.light = "even"
