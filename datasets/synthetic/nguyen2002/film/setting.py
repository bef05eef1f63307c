"""Settings of the clips: backdrop, ground and static objects, rendered for a moving camera."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.interface import Image
from trackmark.datasets.synthetic.nguyen2002.film import props, scenery
from trackmark.datasets.synthetic.render.prop import Prop
from trackmark.datasets.synthetic.render.sprite import draw_rows, instants
from trackmark.datasets.synthetic.render.street.facades import backdrop
from trackmark.datasets.synthetic.render.street.furniture import (
    bush,
    car,
    litter_bin,
    post,
    sign,
    tree,
)
from trackmark.datasets.synthetic.render.street.ground import Band, TreeShade, ground_rows
from trackmark.datasets.synthetic.render.views import Viewpoint

Array = NDArray[np.float64]

Backdrop = Callable[[np.random.Generator, int, int, float, float], Image]
"""Function that paints a backdrop; see `scenery` for its parameters."""


@dataclass(frozen=True)
class StaticObjects:
    """Kind of static objects and their distribution in space."""

    # returns an object at a position [metres] with the scale at its depth [pixels/metre]
    make: Callable[[np.random.Generator, float, float, float], Prop]
    spacing: float  # mean distance between adjacent objects [metres]
    depth: tuple[float, float]  # minimum and maximum [metres]


@dataclass(frozen=True)
class FilmSetting:
    """Kind of setting, with the targets and occluders that can appear in it."""

    backdrop: Backdrop
    end: float  # depth at which the backdrop meets the ground [metres]
    # returns the bands of the ground for a generator and `end`
    ground: Callable[[np.random.Generator, float], list[Band]]
    standing: tuple[StaticObjects, ...]
    targets: tuple[str, ...]  # names in `targets.KINDS`: round targets, other targets
    # names in `occluders.OCCLUDERS`, of those that occlude the whole target
    occluders: tuple[str, ...]


class Place:
    """Random surroundings of one setting, painted for the path of a camera.

    `still` is the camera at the left end of its path. `size` is the width and height of the images
    [pixels], `path` the length of the path [metres], and `shake` the maximum vertical shift of the
    image [pixels].
    """

    def __init__(
        self, random: np.random.Generator, setting: FilmSetting, still: Viewpoint,
        size: tuple[int, int], path: float, shake: float,
    ) -> None:  # fmt: skip
        self._setting = setting
        self._still = still
        self._size = size
        self._way = path
        self._shake = int(np.ceil(shake)) + 1
        end = float(still.scale(setting.end))
        base = float(still.row(0.0, setting.end)) + self._shake
        height, width = int(np.ceil(base)) + 3, int(self._widths(np.array([end]))[0])
        self._far = setting.backdrop(random, height, width, end, base)
        self._ground = ground_rows(
            random, setting.ground(random, setting.end), TreeShade(random, "even"), still,
            self._scales, still.x, self._widths(self._scales), self._margin,
        )  # fmt: skip
        things = [thing for kind in setting.standing for thing in self._stood(random, kind)]
        self._things = sorted(things, key=lambda thing: -thing.z)

    def draw(self, canvas: Image, camera: Viewpoint, travel: float) -> None:
        """Render an image for a camera that moves by `travel` [metres] during the exposure."""
        boundary = int(np.floor(camera.row(0.0, self._setting.end) + 0.5))
        end = np.full(len(self._far), self._still.scale(self._setting.end))
        top = round((camera.shift_y - self._shake) * 64)
        draw_rows(canvas, self._far, top, self._lefts(camera, end, travel), 0, boundary)
        first = round((self._first + camera.shift_y) * 64)
        lefts = self._lefts(camera, self._scales, travel)
        draw_rows(canvas, self._ground, first, lefts, boundary, len(canvas))
        for thing in self._things:
            thing.draw(canvas, camera, travel=travel)

    def _stood(self, random: np.random.Generator, kind: StaticObjects) -> list[Prop]:
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
        """Column of a panorama that is at the image centre if the camera is at its left end."""
        return self._still.centre + 24

    def _widths(self, scales: Array) -> NDArray[np.int64]:
        return np.asarray(np.ceil(self._way * scales + self._size[0] + 50), np.int64)

    def _lefts(self, camera: Viewpoint, scales: Array, travel: float) -> NDArray[np.int64]:
        """Return the panorama column at the left image border [1/64 pixel], shape (times, rows)."""
        moments = instants(travel * float(scales.max()))[:, None]
        lefts = (camera.x - self._still.x + moments * travel) * scales
        places = np.round((lefts + self._margin - camera.centre) * 64).astype(np.int64)
        return np.clip(places, 0, (self._widths(scales) - self._size[0] - 2) * 64)

    @property
    def _first(self) -> float:
        """Image row at which the ground begins, without shake."""
        return float(np.floor(self._still.row(0.0, self._setting.end))) - 2

    @cached_property
    def _scales(self) -> Array:
        """Scale of every row of the ground [pixels/metre]."""
        rows = np.arange(self._first, self._size[1] + self._shake + 2) + 0.5
        return np.asarray((rows - self._still.horizon) / self._still.eye)


BEHIND = 19.0, 30.0  # depth range of static objects behind a target [metres]

SETTINGS = {
    "street": FilmSetting(
        backdrop, 33.0, scenery.road, (
            StaticObjects(tree, 9.0, BEHIND), StaticObjects(car, 11.0, (22.0, 27.0)),
            StaticObjects(post, 14.0, BEHIND), StaticObjects(sign, 12.0, BEHIND),
            StaticObjects(litter_bin, 15.0, BEHIND)),
        ("van", "board", "helmet", "sign", "spare wheel"),
        ("pillar", "lorry", "bus", "passer-by", "trunk", "wall end"),
    ),
    "quay": FilmSetting(
        scenery.harbour, 36.0, scenery.quay, (
            StaticObjects(props.goods, 6.0, BEHIND), StaticObjects(props.bollard, 6.0, BEHIND),
            StaticObjects(post, 16.0, BEHIND)),
        ("crate", "drum", "van", "barrel", "fender", "sign"),
        ("container", "load", "lorry", "pillar", "passer-by"),
    ),
    "basin": FilmSetting(
        scenery.roadstead, 60.0, scenery.water, (
            StaticObjects(props.boat, 9.0, (22.0, 45.0)),
            StaticObjects(props.bollard, 7.0, BEHIND)),
        ("boat", "buoy"),
        ("ship", "pillar", "wall end", "load"),
    ),
    "station": FilmSetting(
        scenery.station, 31.0, scenery.platform, (
            StaticObjects(props.column, 6.5, (19.0, 24.0)),
            StaticObjects(props.trolley, 7.0, (18.0, 24.0))),
        ("case", "crate", "board", "clock", "barrel"),
        ("pillar", "passer-by", "wall end", "lorry"),
    ),
    "market": FilmSetting(
        backdrop, 34.0, scenery.market_place, (
            StaticObjects(props.stall, 4.5, (21.0, 30.0)), StaticObjects(props.goods, 8.0, BEHIND),
            StaticObjects(tree, 18.0, BEHIND)),
        ("crate", "drum", "lantern", "barrel", "sign"),
        ("passer-by", "pillar", "trunk", "wall end", "lorry"),
    ),
    "desert": FilmSetting(
        scenery.desert, 120.0, scenery.sand, (
            StaticObjects(bush, 5.0, (18.0, 60.0)), StaticObjects(props.rock, 6.0, (18.0, 60.0)),
            StaticObjects(post, 16.0, (24.0, 25.0))),
        ("van", "drum", "board", "helmet", "spare wheel", "sign"),
        ("lorry", "trunk", "wall end", "container"),
    ),
}  # fmt: skip
"""Settings by name."""
