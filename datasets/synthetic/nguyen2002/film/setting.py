"""Settings of the clips: backdrop, ground and static objects, rendered for a moving camera.

Functions of backdrops take a generator, height and width [pixels], scale [pixels/metre] and the row
at which the backdrop meets the ground; backdrops of streets are in `facades`. A ground consists of
bands. The texture of a band contains a smaller texture four times, twice in each direction.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from trackmark.datasets.interface import Array, Image
from trackmark.datasets.synthetic.nguyen2002.film import objects
from trackmark.datasets.synthetic.nguyen2002.film.objects import LIGHTS, PAINTS
from trackmark.datasets.synthetic.render.colours import sample_colour, vary_colour
from trackmark.datasets.synthetic.render.painting import Painting
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
from trackmark.datasets.synthetic.render.street.ground import SIDE, Band, TreeShade, ground_rows
from trackmark.datasets.synthetic.render.texture import fractal, grass, paving, pebbles, ramp
from trackmark.datasets.synthetic.render.views import Viewpoint

FINE = 2  # supersampling per axis
HALLS = ((150, 160, 170), (110, 134, 160), (164, 176, 180), (130, 150, 140))
ROCKS = np.array([[84, 118, 168], [96, 136, 186], [112, 146, 178]], np.float64)


def harbour(random: Generator, height: int, width: int, scale: float, base: float) -> Image:
    """Paint sheds, stacked containers and cranes."""
    picture = _sky(random, height, width)
    p, across = Painting(picture, FINE * scale), width / scale
    foot = base / scale
    for x in np.arange(random.uniform(0, 6), across, random.uniform(9, 14)):
        _crane(random, p, float(x), foot)
    x = -random.uniform(0, 4)
    while x < across:
        if random.random() < 0.4:
            x += _shed(random, p, x, foot)
        else:
            x += _stack(random, p, x, foot)
    return _reduced(random, picture, height, width, 0.10)


def roadstead(random: Generator, height: int, width: int, scale: float, base: float) -> Image:
    """Paint hills and a town beyond the water, and ships at anchor."""
    picture = _sky(random, height, width)
    p, across, foot = Painting(picture, FINE * scale), width / scale, base / scale
    _hills(random, picture, FINE * base, 0.45, np.array([132.0, 138.0, 118.0]))
    for x in np.arange(0, across, 1.2):
        if random.random() < 0.7:
            wall, tall = sample_colour(random, HALLS + LIGHTS), random.uniform(0.5, 2.4)
            p.patch(x, foot - tall, 1.3, tall, wall)
            p.area([(x, foot - tall), (x + 0.65, foot - tall - 0.5), (x + 1.3, foot - tall)],
                   (84, 96, 150))  # fmt: skip
            for floor_y in np.arange(0.2, tall, 0.5):
                for side in (0.25, 0.8):
                    p.patch(x + side, foot - floor_y - 0.2, 0.2, 0.25, wall * 0.45)
    for x in np.arange(random.uniform(0, 6), across, 11):
        paint, long = sample_colour(random, PAINTS), random.uniform(5, 8)
        p.area([(x, foot - 1), (x + long, foot - 1.2), (x + long - 0.8, foot), (x + 0.6, foot)],
               paint)  # fmt: skip
        p.patch(x + 0.6, foot - 0.16, long - 1.3, 0.16, paint * 0.5)
        p.plate(x + 0.7, foot - 2.4, 1.6, 1.3, LIGHTS[0], 0.05)
        for k in range(4):
            p.patch(x + 0.85 + 0.36 * k, foot - 2.2, 0.22, 0.3, (70, 62, 56))
        p.line([(x + 3.6, foot - 1), (x + 3.6, foot - 4)], 0.08, (70, 80, 90))
    return _reduced(random, picture, height, width, 0.16)


def station(random: Generator, height: int, width: int, scale: float, base: float) -> Image:
    """Paint a hall with tall windows, posters and a waiting train."""
    wall = sample_colour(random, HALLS)
    picture = np.empty((FINE * height, FINE * width, 3), np.uint8)
    picture[:] = wall
    p, across, foot = Painting(picture, FINE * scale), width / scale, base / scale
    bay = random.uniform(3.2, 4.4)
    glow = vary_colour(random, (214, 218, 214))
    for x in np.arange(-random.uniform(0, 2), across, bay):
        p.hole(x + 0.6, -1.0, bay - 1.3, foot - 2.2, glow)
        for mullion_x in np.arange(x + 0.6, x + bay - 0.7, 0.5):
            p.patch(mullion_x, -1, 0.06, foot - 2.2, (92, 96, 92))
        for y in np.arange(0.1, foot - 3.4, 0.7):
            p.patch(x + 0.6, y, bay - 1.3, 0.05, (92, 96, 92))
        p.plate(x + 0.05, -1, 0.4, foot + 1, wall * 0.86, 0.05)
        if random.random() < 0.7:
            p.plate(x + 0.9, foot - 2.9, 1.1, 0.8, sample_colour(random, PAINTS), 0.04)
            p.label(random, x + 1.0, foot - 2.8, 0.9, 0.3)
    body, second = sample_colour(random, PAINTS), sample_colour(random, LIGHTS)
    x = -random.uniform(0, 5)
    while x < across:  # carriages
        long = 9.0
        p.plate(x, foot - 2.6, long, 2.3, body, 0.05)
        p.patch(x, foot - 1.3, long, 0.3, second)
        p.patch(x, foot - 2.6, long, 0.25, body * 0.6)
        for k in range(6):
            p.hole(x + 0.5 + 1.4 * k, foot - 2.2, 1.0, 0.75, vary_colour(random, (90, 84, 74), 0.3))
            p.darken(x + 0.3 + 1.4 * k, foot - 1.4, 0.03, 1.1, 0.6)
        p.patch(x, foot - 0.3, long, 0.3, (44, 44, 46))
        x += long + 0.25
    return _reduced(random, picture, height, width, 0.04)


def desert(random: Generator, height: int, width: int, scale: float, base: float) -> Image:
    """Paint rows of table mountains in dust."""
    picture = _sky(random, height, width)
    for k in range(3):
        rise = (0.62 - 0.16 * k) * random.uniform(0.8, 1.1)
        colour = vary_colour(random, ROCKS[k]) * (0.85 + 0.12 * (2 - k))
        _hills(random, picture, FINE * base, rise, colour, mesas=k < 2)
    return _reduced(random, picture, height, width, 0.10)


def _sky(random: Generator, height: int, width: int) -> Image:
    rows, columns = FINE * height, FINE * width
    high = vary_colour(random, (206, 176, 146), 0.12)
    low = vary_colour(random, (222, 222, 218), 0.06)
    down = np.linspace(0, 1, rows)[:, None, None]
    clouds = fractal(random, 256, 4, 64, 0.6)
    across, up = np.arange(columns) // 3 % 256, np.arange(rows) * 2 // 3 % 256
    cover = np.clip(clouds[np.ix_(up, across)] * 0.6 + 0.25, 0, 1)[..., None]
    sky = (high + (low - high) * down) * (1 - cover) + 232 * cover
    return np.ascontiguousarray(np.clip(sky, 0, 255).astype(np.uint8))


def _hills(
    random: Generator, picture: Image, foot: float, rise: float, colour: Array, mesas: bool = False
) -> None:
    """Paint a ridge with strata and gullies; `rise` is its height relative to the sky's height."""
    width = picture.shape[1]
    lines = fractal(random, 512, 4, 64, 0.5)
    crest = lines[7][np.arange(width) // 3 % 512]
    if mesas:
        crest = np.clip(3.2 * crest, -0.8, 0.7) + 0.12 * crest
    top = foot * (1 - rise * (0.55 + 0.42 * crest))
    rows = np.arange(picture.shape[0])[:, None]
    inside = (rows > top) & (rows <= foot + 4)
    strata = lines[:, 100][(rows * 2) % 512] * 0.10
    gullies = lines[np.ix_(np.arange(picture.shape[0]) // 4 % 512, np.arange(width) * 2 % 512)]
    tone = 1 + strata + 0.16 * gullies
    shaded = np.clip(colour * tone[..., None], 0, 255).astype(np.uint8)
    picture[inside] = shaded[inside]


def _crane(random: Generator, p: Painting, x: float, foot: float) -> None:
    paint = sample_colour(random, ((60, 70, 180), (70, 150, 200), (150, 120, 80)))
    tall = random.uniform(6.5, 9)
    for leg in (x, x + 2.2):
        p.line([(leg, foot), (leg + 0.2, foot - tall)], 0.2, paint)
    for step in np.arange(1.5, tall - 1, 1.5):
        p.line([(x, foot - step), (x + 2.3, foot - step - 1.2)], 0.09, paint * 0.8)
    p.line([(x - 3.5, foot - tall + 1), (x + 4, foot - tall - 0.4)], 0.26, paint)
    p.line([(x - 3, foot - tall + 1), (x - 3, foot - 3)], 0.05, (80, 80, 80))


def _shed(random: Generator, p: Painting, x: float, foot: float) -> float:
    """Paint a warehouse with gates; return its width [metres]."""
    wide, tall, wall = random.uniform(5, 9), random.uniform(2.8, 3.8), sample_colour(random, HALLS)
    p.plate(x, foot - tall, wide, tall, wall, 0.08)
    p.area([(x - 0.2, foot - tall), (x + wide / 2, foot - tall - 1.2),
            (x + wide + 0.2, foot - tall)], wall * 0.6)  # fmt: skip
    for gate_x in np.arange(x + 0.5, x + wide - 1.8, 2.4):
        p.hole(gate_x, foot - 2.1, 1.6, 2.1, sample_colour(random, PAINTS))
        for y in np.arange(foot - 2.0, foot, 0.25):
            p.darken(gate_x, y, 1.6, 0.06, 0.8)
    p.label(random, x + 0.3 * wide, foot - tall + 0.2, 0.4 * wide, 0.4)
    return float(wide)


def _stack(random: Generator, p: Painting, x: float, foot: float) -> float:
    """Paint stacked containers; return their width [metres]."""
    wide, tall = 4.2, 1.45
    for level in range(int(random.integers(1, 4))):
        paint, top = sample_colour(random, PAINTS), foot - (level + 1) * tall
        p.plate(x, top, wide, tall, paint, 0.05)
        for rib_x in np.arange(x + 0.1, x + wide, 0.28):
            p.darken(rib_x, top + 0.08, 0.12, tall - 0.16, 0.78)
        p.patch(x + 0.5, top + 0.3, random.uniform(0.8, 2.4), 0.35, sample_colour(random, LIGHTS))
    return wide + float(random.uniform(0.1, 0.8))


def _reduced(random: Generator, picture: Image, height: int, width: int, haze: float) -> Image:
    """Downsample a picture; add weathering and haze."""
    grain = fractal(random, 256, 8, 128, 0.8)
    rows, columns = picture.shape[:2]
    weathered = (
        picture
        * (1 + 0.05 * grain[np.ix_(np.arange(rows) % 256, np.arange(columns) % 256)])[..., None]
    )
    small = cv2.resize(weathered, (width, height), interpolation=cv2.INTER_AREA)
    air = np.array([200.0, 196.0, 190.0])
    return np.round(np.clip(small * (1 - haze) + air * haze, 0, 255)).astype(np.uint8)


HALF = SIDE // 2


def road(random: Generator, end: float) -> list[Band]:
    """Return pavement or lawn, a road with a line, and pavement in front of houses."""
    stones = _faded(paving(random, HALF), 0.7) * random.uniform(0.9, 1.15)
    near = stones if random.random() < 0.7 else grass(random, HALF)
    kerb = _grainy(random, (168.0, 168.0, 168.0), 0.05)
    tar = _tar(random)
    start, middle = random.uniform(11.0, 13.0), random.uniform(18.0, 21.0)
    side = float(random.uniform(2.2, 3.2))
    return [
        _band(0.0, near, side),
        _band(start - 0.25, kerb, 4.0),
        _band(start, tar, 3.0),
        _band(middle, _dashed(tar), 6.0),
        _band(middle + 0.3, tar, 3.0),
        _band(end - 5.0, kerb, 4.0),
        _band(end - 4.6, stones, side),
    ]


def quay(random: Generator, end: float) -> list[Band]:
    """Return concrete with joints and stains, and rails."""
    stains = 1 - 0.1 * fractal(random, HALF, 2, 16)
    concrete = _grainy(random, (146.0, 154.0, 160.0), 0.08) * stains[..., None]
    concrete *= random.uniform(0.8, 1.05)
    rail = _grainy(random, (86.0, 98.0, 112.0), 0.08)
    concrete[:, :3] *= 0.6
    concrete[:3] *= 0.7
    bands = [_band(0.0, concrete, 4.0)]
    for place in (0.45 * end, 0.62 * end):
        bands += [_band(place, rail, 2.0), _band(place + 0.25, concrete, 4.0)]
    return bands


def water(random: Generator, end: float) -> list[Band]:
    """Return waves, darker in their troughs; `end` has no effect."""
    waves = np.repeat(fractal(random, HALF, 16, 128, 0.7), 2, axis=1)
    waves = np.tile(waves, (2, 1)) + 0.4 * np.tile(fractal(random, HALF, 2, 16), (2, 2))
    deep = np.array([random.uniform(84, 110), random.uniform(84, 96), random.uniform(50, 66)])
    colours = np.stack([deep * 0.6, deep, deep * 1.5 + 20, np.array([208.0, 206.0, 196.0])])
    return [Band(0.0, ramp(waves * 0.8 - 0.15, colours), 3.2)]


def platform(random: Generator, end: float) -> list[Band]:
    """Return flagstones, a yellow line and the track bed."""
    flags = _faded(paving(random, HALF), 0.5) * random.uniform(0.9, 1.15)
    line = flags * 0.4 + np.array([40.0, 130.0, 150.0])
    bed = pebbles(random, HALF) * 0.6
    edge = 0.72 * end
    return [
        _band(0.0, flags, 3.2),
        _band(edge - 1.6, line, 3.2),
        _band(edge - 1.0, flags, 3.2),
        _band(edge, bed * 0.5, 2.4),
        _band(edge + 1.2, bed, 2.4),
    ]


def market_place(random: Generator, end: float) -> list[Band]:
    """Return setts or rounded stones up to the houses; `end` has no effect."""
    kind = paving if random.random() < 0.6 else pebbles
    stones = kind(random, HALF) * random.uniform(0.85, 1.1)
    return [_band(0.0, stones, float(random.uniform(2.2, 3.4)))]


def sand(random: Generator, end: float) -> list[Band]:
    """Return sand with stones up to the horizon, and a road along it."""
    earths = np.array([[70, 104, 142], [104, 146, 184], [134, 174, 206], [160, 194, 216]])
    grain = fractal(random, HALF, 8, 128, 0.75)
    ground = ramp(grain * 0.8, earths * random.uniform(0.85, 1.05))
    tar = _tar(random)
    return [
        _band(0.0, ground, 4.0),
        _band(11.0, tar, 3.0),
        _band(15.0, _dashed(tar), 6.0),
        _band(15.4, tar, 3.0),
        _band(23.0, ground, 4.0),
    ]


def _band(start: float, texture: Array, side: float) -> Band:
    """Return a band with a texture that covers `side` x `side` metres."""
    return Band(start, np.tile(texture, (2, 2, 1)), 2 * side)


def _grainy(random: Generator, colour: tuple[float, float, float], strength: float) -> Array:
    grain = fractal(random, HALF, 16, 128, 0.9)
    return np.asarray(colour) * (1 + strength * grain)[..., None]


def _faded(texture: Array, contrast: float) -> Array:
    middle = texture.mean(axis=(0, 1))
    return np.asarray(middle + contrast * (texture - middle))


def _tar(random: Generator) -> Array:
    tone = random.uniform(0.85, 1.2)
    return _grainy(random, (94.0 * tone, 95.0 * tone, 97.0 * tone), 0.1)


def _dashed(tar: Array) -> Array:
    """Return a texture of tar with a dash of a painted line."""
    line = tar.copy()
    line[:, : HALF // 2] = line[:, : HALF // 2] * 0.3 + 150
    return line


Backdrop = Callable[[Generator, int, int, float, float], Image]


@dataclass(frozen=True)
class StaticObjects:
    """Kind of static objects and their distribution in space."""

    # returns an object at a position [metres] with the scale at its depth [pixels/metre]
    make: Callable[[Generator, float, float, float], Prop]
    spacing: float  # mean distance between adjacent objects [metres]
    depth: tuple[float, float]  # minimum and maximum [metres]


@dataclass(frozen=True)
class FilmSetting:
    """Kind of setting, with the targets and occluders that can appear in it."""

    backdrop: Backdrop
    end: float  # depth at which the backdrop meets the ground [metres]
    # returns the bands of the ground for a generator and `end`
    ground: Callable[[Generator, float], list[Band]]
    standing: tuple[StaticObjects, ...]
    targets: tuple[str, ...]  # names in `targets.KINDS`: round targets, other targets
    # names in `objects.OCCLUDERS`, of those that occlude the whole target
    occluders: tuple[str, ...]


class Surroundings:
    """Random surroundings of one setting, painted for the path of a camera.

    `still` is the camera at the left end of its path. `size` is the width and height of the images
    [pixels], `path` the length of the path [metres], and `shake` the maximum vertical shift of the
    image [pixels].
    """

    def __init__(
        self, random: Generator, setting: FilmSetting, still: Viewpoint,
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
        things = [
            thing for kind in setting.standing for thing in self._sample_objects(random, kind)
        ]
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

    def _sample_objects(self, random: Generator, kind: StaticObjects) -> list[Prop]:
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
        """Panorama column at the image centre if the camera is at the left end of its path."""
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

# settings by name
SETTINGS = {
    "street": FilmSetting(
        backdrop, 33.0, road, (
            StaticObjects(tree, 9.0, BEHIND), StaticObjects(car, 11.0, (22.0, 27.0)),
            StaticObjects(post, 14.0, BEHIND), StaticObjects(sign, 12.0, BEHIND),
            StaticObjects(litter_bin, 15.0, BEHIND)),
        ("van", "board", "helmet", "sign", "spare wheel"),
        ("pillar", "lorry", "bus", "passer-by", "trunk", "wall end"),
    ),
    "quay": FilmSetting(
        harbour, 36.0, quay, (
            StaticObjects(objects.goods, 6.0, BEHIND), StaticObjects(objects.bollard, 6.0, BEHIND),
            StaticObjects(post, 16.0, BEHIND)),
        ("crate", "drum", "van", "barrel", "fender", "sign"),
        ("container", "load", "lorry", "pillar", "passer-by"),
    ),
    "basin": FilmSetting(
        roadstead, 60.0, water, (
            StaticObjects(objects.boat, 9.0, (22.0, 45.0)),
            StaticObjects(objects.bollard, 7.0, BEHIND)),
        ("boat", "buoy"),
        ("ship", "pillar", "wall end", "load"),
    ),
    "station": FilmSetting(
        station, 31.0, platform, (
            StaticObjects(objects.column, 6.5, (19.0, 24.0)),
            StaticObjects(objects.trolley, 7.0, (18.0, 24.0))),
        ("case", "crate", "board", "clock", "barrel"),
        ("pillar", "passer-by", "wall end", "lorry"),
    ),
    "market": FilmSetting(
        backdrop, 34.0, market_place, (
            StaticObjects(objects.stall, 4.5, (21.0, 30.0)),
            StaticObjects(objects.goods, 8.0, BEHIND), StaticObjects(tree, 18.0, BEHIND)),
        ("crate", "drum", "lantern", "barrel", "sign"),
        ("passer-by", "pillar", "trunk", "wall end", "lorry"),
    ),
    "desert": FilmSetting(
        desert, 120.0, sand, (
            StaticObjects(bush, 5.0, (18.0, 60.0)), StaticObjects(objects.rock, 6.0, (18.0, 60.0)),
            StaticObjects(post, 16.0, (24.0, 25.0))),
        ("van", "drum", "board", "helmet", "spare wheel", "sign"),
        ("lorry", "trunk", "wall end", "container"),
    ),
}  # fmt: skip
