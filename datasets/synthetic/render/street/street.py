"""Street with houses, sky, ground, static objects, and their light."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.interface import Array
from trackmark.datasets.synthetic.render.path import random_positions
from trackmark.datasets.synthetic.render.prop import Prop
from trackmark.datasets.synthetic.render.sprite import draw_rows, instants
from trackmark.datasets.synthetic.render.street import ground
from trackmark.datasets.synthetic.render.street.facades import backdrop
from trackmark.datasets.synthetic.render.street.furniture import (
    bush,
    car,
    litter_bin,
    post,
    sign,
    tree,
)
from trackmark.datasets.synthetic.render.views import Viewpoint
from trackmark.datasets.synthetic.scene import part_generator

KERB = 10.6  # depth at which the road begins [metres]
HOUSES = 18.0  # depth of the houses [metres]


@dataclass(frozen=True)
class Reach:
    """Minimum and maximum of a camera's motion in a whole sequence."""

    x: tuple[float, float] = (0.0, 0.0)  # lateral position [metres]
    shift_x: tuple[float, float] = (0.0, 0.0)  # horizontal shift of the image [pixels]
    shift_y: tuple[float, float] = (0.0, 0.0)  # vertical shift of the image [pixels]


class Street:
    """Street that runs from left to right, seen from the near pavement, and painted on first use.

    `still` contains the constant properties of the camera, `reach` the range of its motion, and
    `size` the width and height of the images [pixels].
    """

    def __init__(
        self,
        seed: int,
        size: tuple[int, int],
        still: Viewpoint,
        reach: Reach,
        light: ground.Light = "even",
    ) -> None:
        self._seed = seed
        self._size = size
        self._still = still
        self._reach = reach
        self._light: ground.Light = light

    def draw(
        self,
        canvas: NDArray[np.uint8],
        camera: Viewpoint,
        motion: tuple[float, float] = (0.0, 0.0),
        travel: float = 0.0,
    ) -> None:
        """Render houses, sky and ground into an image in place.

        The viewpoint is that at the middle of the exposure. During the exposure, the image shifts
        by `motion` [pixels], of which only the horizontal part causes blur, and the camera moves by
        `travel` [metres].
        """
        boundary = int(np.floor(camera.row(0.0, HOUSES) + 0.5))
        edge = min(max(boundary, 0), len(canvas))
        picture, top = self._backdrop
        far = np.array([camera.scale(HOUSES)])
        lefts = np.repeat(self._lefts(camera, far, motion[0], travel), len(picture), axis=1)
        draw_rows(canvas, picture, round((top + camera.shift_y) * 64), lefts, 0, edge)
        rows, first = self._ground
        lefts = self._lefts(camera, self._scales, motion[0], travel)
        draw_rows(canvas, rows, round((first + camera.shift_y) * 64), lefts, edge, len(canvas))

    @cached_property
    def props(self) -> list[Prop]:
        """Static objects: trees, parked cars, bins, signs, lamp posts, bushes."""
        random = part_generator(self._seed, "street furniture")
        low, high = self._span(KERB)
        things: list[Prop] = []
        for x in random_positions(random, low + random.uniform(0, 6), high, (4.5, 9.5)):
            # Trees stand in a row in front of the kerb.
            z = KERB - 0.5
            kind = tree if random.random() < 0.75 else post
            things.append(kind(random, x, z, self._scale_at(z)))
        along = random_positions(random, low + random.uniform(0, 8), high, (5.2, 7.5))
        parked = KERB + 0.9, self._scale_at(KERB + 0.9)
        things += [car(random, x, *parked) for x in along if random.random() < 0.6]
        for kind, spacing in ((litter_bin, 22.0), (sign, 16.0), (bush, 14.0)):
            x = low + random.uniform(0, spacing)
            while x < high:
                z = KERB - random.uniform(0.2, 0.8)
                things.append(kind(random, x, z, self._scale_at(z)))
                x += random.uniform(0.5, 1.5) * spacing
        return things

    def post(self, x: float, z: float, thickness: float) -> Prop:
        """Return a tall pillar that occludes people behind it; all parameters are in metres."""
        return post(part_generator(self._seed, f"post {x} {z}"), x, z, self._scale_at(z), thickness)

    def gains(self, x: ArrayLike, z: ArrayLike, heights: ArrayLike) -> Array:
        """Return the light at heights above the ground at (x, z); all parameters are in metres."""
        return self._shade.on_upright(x, z, heights)

    @cached_property
    def _shade(self) -> ground.TreeShade:
        return ground.TreeShade(part_generator(self._seed, "shade"), self._light)

    @cached_property
    def _backdrop(self) -> tuple[NDArray[np.uint8], float]:
        """Image of houses and sky, and its first image row."""
        scale = self._scale_at(HOUSES)
        top = -np.ceil(self._reach.shift_y[1]) - 1
        base = float(self._still.row(0.0, HOUSES)) - top
        width = int(self._widths(np.array([scale]))[0])
        height = int(np.ceil(base)) + 3
        random = part_generator(self._seed, "houses")
        return backdrop(random, height, width, scale, base), float(top)

    @cached_property
    def _ground(self) -> tuple[NDArray[np.uint8], float]:
        """Image of the ground, and its first image row."""
        random = part_generator(self._seed, "ground")
        rows = ground.ground_rows(
            random,
            self._bands(random),
            self._shade,
            self._still,
            self._scales,
            self._reach.x[0],
            self._widths(self._scales),
            self._margin,
        )
        return rows, self._first_row

    def _bands(self, random: Generator) -> list[ground.Band]:
        return ground.street_bands(random, KERB, HOUSES)

    @property
    def _first_row(self) -> float:
        return float(np.floor(self._still.row(0.0, HOUSES))) - 2

    @cached_property
    def _scales(self) -> Array:
        """Scale of every row of the ground, without shift [pixels/metre]."""
        last = self._size[1] - self._reach.shift_y[0] + 2
        rows = np.arange(self._first_row, last) + 0.5
        return np.asarray((rows - self._still.horizon) / self._still.eye)

    @property
    def _margin(self) -> float:
        """Panorama column of the minimum lateral position of the camera, equal in all rows."""
        return self._still.centre + self._reach.shift_x[1] + 16

    def _widths(self, scales: Array) -> NDArray[np.int64]:
        travel = (self._reach.x[1] - self._reach.x[0]) * scales
        turn = self._reach.shift_x[1] - self._reach.shift_x[0]
        return np.asarray(np.ceil(travel + turn + self._size[0] + 34), np.int64)

    def _lefts(
        self, camera: Viewpoint, scales: Array, motion: float, travel: float
    ) -> NDArray[np.int64]:
        """Return the panorama column at the left image border [1/64 pixel], shape (times, rows)."""
        nearest = float(scales.max())
        moments = instants(abs(motion) + abs(travel) * nearest)[:, None]
        places = (camera.x - self._reach.x[0] + moments * travel) * scales
        lefts = places + self._margin - camera.centre - camera.shift_x - moments * motion
        limit = (self._widths(scales) - self._size[0] - 2) * 64
        return np.clip(np.round(lefts * 64).astype(np.int64), 0, limit)

    def _scale_at(self, z: float) -> float:
        return float(self._still.scale(z))

    def _span(self, z: float) -> tuple[float, float]:
        """Return the visible lateral range at a depth, with a margin [metres]."""
        half = (self._size[0] / 2 + max(abs(v) for v in self._reach.shift_x)) / self._scale_at(
            z
        ) + 3
        return self._reach.x[0] - half, self._reach.x[1] + half
