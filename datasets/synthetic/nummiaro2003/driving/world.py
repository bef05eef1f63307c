"""Surroundings of the driving scenes: ground, houses, static objects, distant panorama."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from trackmark.datasets.interface import Array
from trackmark.datasets.synthetic.nummiaro2003.driving.car import CarAt, lay_behind, lay_facets
from trackmark.datasets.synthetic.nummiaro2003.driving.view import (
    OVERCAST,
    STAINS_SIDE,
    Cutout,
    Drawable,
    Face,
    Facets,
    Lens,
    Light,
    PerspectiveView,
    Pictures,
    Ring,
    UprightCutout,
    assemble_facets,
    blank_pictures,
    facet_pose,
    level_face,
    pack_pictures,
    paint_cutout,
    side_faces,
)
from trackmark.datasets.synthetic.render.sprite import draw_rows
from trackmark.datasets.synthetic.render.street.facades import backdrop
from trackmark.datasets.synthetic.render.street.furniture import bush, post, sign, tree
from trackmark.datasets.synthetic.render.texture import fractal, grass, noise, paving
from trackmark.datasets.synthetic.scene import part_generator

Box = tuple[float, float, float, float]  # left, top, right and bottom [metres]
LOOKS = 6  # number of wall and roof styles in a scene
STOREY = 2.9  # height of a storey [metres]
_WALLS = (
    (72, 84, 150),  # brick
    (62, 70, 122),  # dark brick
    (164, 190, 206),  # cream
    (190, 196, 200),  # light grey
    (130, 164, 190),  # ochre
    (150, 156, 158),  # concrete
    (104, 126, 146),  # sandstone
)
_ROOFS = ((62, 70, 100), (74, 70, 68), (88, 88, 92))

_BAYS = 4  # windows side by side in a wall texture, which has two storeys
_WALL = 512, 256  # size of a wall texture [pixels]


@dataclass(frozen=True)
class House:
    """Axis-parallel house."""

    x: float  # centre, to the right [metres]
    z: float  # centre, ahead [metres]
    width: float  # along x [metres]
    depth: float  # along z [metres]
    storeys: int  # number of storeys, including the ground floor
    roof: float  # height of the roof; 0 is flat [metres]
    look: int  # index of the style of walls and roof, in [0, LOOKS)

    def faces(self) -> list[Face]:
        """Return the walls and the roof."""
        half, end, high = self.width / 2, self.depth / 2, self.storeys * STOREY
        foot, first, eaves = (Ring(h, end, -end, half) for h in (0.0, STOREY, high))
        inset = min(half, end) - 0.4 if self.roof else 0.3
        brim = Ring(high, end + 0.35, -end - 0.35, half + 0.35)
        edge = brim if self.roof else eaves
        top = Ring(high + max(self.roof, 0.5), end - inset, inset - end, half - inset)
        floor, floor_side, wall, wall_side, roof = (5 * self.look + k for k in range(5))
        faces = [
            level_face(
                top.height, (-top.half_width, top.half_width), (top.behind, top.ahead), roof
            ),
            *side_faces(edge, top, (roof, roof, roof)),
            *side_faces(first, eaves, (wall, wall, wall_side)),
            *side_faces(foot, first, (floor, floor, floor_side)),
        ]
        place = np.array([self.x, 0.0, self.z])
        return [replace(face, corners=face.corners + place) for face in faces]


class Houses:
    """Houses that are drawn together: `facets` in world coordinates and their textures."""

    def __init__(self, random: Generator, houses: Sequence[House]) -> None:
        faces = [house.faces() for house in houses]
        self._owners = np.repeat(
            np.arange(len(houses)), [len(house_faces) for house_faces in faces]
        )
        self._places = np.array([(house.x, 0.0, house.z) for house in houses])
        self._reach = np.array([house.width + house.depth for house in houses]) / 2
        pictures, projections = [], []
        for _ in range(LOOKS):
            bay = random.uniform(2.6, 3.6)
            pictures += _look(random, bay)
            projections += _projections(bay)
        self.facets = assemble_facets(
            [face for house_faces in faces for face in house_faces], np.array(projections)
        )
        self.pictures = pack_pictures(pictures)

    def order(self, view: PerspectiveView) -> NDArray[np.int64]:
        """Return the indices of the facets of visible houses; the nearest house comes first."""
        right, _, ahead = view.seen_from(self._places).T
        seen = (ahead > -self._reach) & (np.abs(right) - self._reach < 0.8 * (ahead + self._reach))
        rank = np.argsort(np.argsort(right * right + ahead * ahead, kind="stable"))
        facets = np.flatnonzero(seen[self._owners])
        return facets[np.argsort(rank[self._owners[facets]], kind="stable")]


def sample_house(
    random: Generator, x: float, z: float, width: float, depth: float, large: bool = False
) -> House:
    """Sample a house; if `large`, it is an office with a flat roof. All lengths are in metres."""
    return House(
        x,
        z,
        width,
        depth,
        storeys=int(random.integers(3, 5)) if large else int(random.integers(2, 4)),
        roof=0.0 if large or random.random() < 0.15 else random.uniform(2.0, 3.2),
        look=int(random.integers(LOOKS)),
    )


def _projections(bay: float) -> list[list[list[float]]]:
    per_metre, up = _WALL[0] / (_BAYS * bay), -_WALL[1] / (2 * STOREY)
    across, along, rise = [per_metre, 0, 0, 0], [0, 0, per_metre, 0], [0, up, 0, 2.0 * _WALL[1]]
    return [[across, rise], [along, rise], [across, rise], [along, rise],
            [[48.0, 0, 0, 0], [0, 60.0, 48.0, 0]]]  # fmt: skip


def _look(random: Generator, bay: float) -> list[Array]:
    """Return the textures of a style: ground floor (x and z walls), upper floors, roof."""
    colour = np.array(_WALLS[random.integers(len(_WALLS))]) * random.uniform(0.86, 1.06)
    grain = fractal(random, 512, 16, 256, 0.8)[: _WALL[1]]
    upper = _wall(random, colour, grain, bay, ground=False)
    lower = _wall(random, colour * 0.94, grain, bay, ground=True)
    tiles = np.array(_ROOFS[random.integers(len(_ROOFS))]) * np.ones((256, 256, 1))
    rows = np.arange(256)
    courses = 1 - 0.22 * (rows % 16 < 2)[:, None] - 0.08 * ((rows % 24) < 2)[None, :]
    tiles = tiles * (courses * (1 + 0.1 * noise(random, 256, 64)))[..., None]
    return [lower, lower, upper, upper, tiles]


def _wall(random: Generator, colour: Array, grain: Array, bay: float, ground: bool) -> Array:
    """Return a wall texture of two storeys with windows; a `ground` floor also has doors."""
    wall = _WallSheet(colour, grain, bay)
    wide, tall = random.uniform(1.0, 1.5), random.uniform(1.25, 1.6)
    trim = colour * 0.5 + 116 if random.random() < 0.6 else colour * 0.6
    for storey in range(2):
        for number in range(_BAYS):
            middle, sill = (number + 0.5) * bay, storey * STOREY + 0.9
            if ground and number == 1:
                door = (middle - 0.5, 2.3, middle + 0.5, storey * STOREY)
                wall.framed(door, trim, colour * 0.35)
                continue
            glass = np.array([100.0, 90.0, 80.0]) * random.uniform(0.55, 1.1)
            left, right, top = middle - wide / 2, middle + wide / 2, sill + tall
            wall.framed((left, top, right, sill), trim, glass)
            shine = sill + tall * random.uniform(0.4, 0.8)
            wall.fill((left, top, right, shine), glass * 1.4 + 14)
            if random.random() < 0.5:
                cloth = np.full(3, 178.0 * random.uniform(0.7, 1.0))
                drawn = wide * random.uniform(0.15, 0.35)
                wall.fill((left, top, left + drawn, sill), cloth)
                wall.fill((right - drawn, top, right, sill), cloth)
            wall.fill((middle - 0.03, top, middle + 0.03, sill), trim)
            wall.fill((left - 0.1, sill, right + 0.1, sill - 0.1), trim)
    return wall.picture.astype(np.float64)


class _WallSheet:
    """Texture of a wall, painted in metres from the lower left corner."""

    def __init__(self, colour: Array, grain: Array, bay: float) -> None:
        width, height = _WALL
        picture = np.ascontiguousarray(np.broadcast_to(colour, (height, width, 3)))
        picture = picture * (1 + 0.07 * grain[..., None])
        if colour[2] > 1.25 * colour[0]:  # brick has courses
            picture[::7] *= 0.86
        self.picture = np.clip(picture, 0, 255).astype(np.uint8)
        self._across, self._up = width / (_BAYS * bay), height / (2 * STOREY)

    def fill(self, box: Box, colour: Array) -> None:
        height = len(self.picture)
        first = round(box[0] * self._across), round(height - box[1] * self._up)
        last = round(box[2] * self._across) - 1, round(height - box[3] * self._up) - 1
        cv2.rectangle(self.picture, first, last, colour.tolist(), -1)

    def framed(self, box: Box, trim: Array, colour: Array) -> None:
        left, top, right, bottom = box
        self.fill((left - 0.07, top + 0.07, right + 0.07, bottom), trim)
        self.fill(box, colour)


_DISTANCE = 150.0  # distance of the town [metres]
_BELOW = 6  # rows of the panorama below the horizon


class Panorama:
    """Backdrop without parallax: sky, a town, and trees in front of the town.

    `yaws` are the minimum and maximum viewing directions [radians], `focal` is the focal length,
    and `width` and `height` are the size of the images [pixels].
    """

    def __init__(
        self, random: Generator, focal: float, yaws: tuple[float, float], width: int, height: int
    ) -> None:
        self._start = yaws[0]
        self._focal = focal
        around = int(np.ceil((yaws[1] - yaws[0]) * focal)) + width + 4
        self._base = height
        picture = backdrop(random, height + _BELOW, around, focal / _DISTANCE, float(height))
        self._picture = _with_trees(random, picture, height, focal / 90.0)

    def draw(self, canvas: NDArray[np.uint8], view: PerspectiveView) -> int:
        """Fill all rows down to _BELOW rows below the horizon; return the number of rows."""
        last = int(np.clip(np.ceil(view.horizon) + _BELOW, 0, len(canvas)))
        left = np.round((view.yaw - self._start) * self._focal * 64)
        lefts = np.full((1, len(self._picture)), left, np.int64)
        top = round((view.horizon - self._base) * 64)
        draw_rows(canvas, self._picture, top, lefts, 0, last)
        return last


def _with_trees(
    random: Generator, picture: NDArray[np.uint8], base: int, metre: float
) -> NDArray[np.uint8]:
    """Return a picture with trees along the row `base`; `metre` is the scale [pixels/metre]."""
    columns = np.arange(picture.shape[1])
    outline = fractal(random, 256, 4, 128, 0.7)
    leaves = fractal(random, 256, 32, 128, 0.9)
    tops = base - metre * (4.2 + 2.6 * outline[7, columns % 256] + 1.2 * outline[99, columns // 3
                                                                            % 256])  # fmt: skip
    rows = np.arange(len(picture))[:, None]
    cover = np.clip(rows - tops, 0, 1)
    tone = 1 + 0.3 * leaves[rows % 256, columns % 256] - 0.2 * np.clip((rows - tops) / 30, 0, 1)
    green = np.array([72.0, 104.0, 88.0]) * tone[..., None]
    return np.asarray(picture + (green - picture) * cover[..., None]).astype(np.uint8)


# materials of the ground, with the scales of their textures [pixels/metre]
GROUND = {"asphalt": 96.0, "paving": 128.0, "grass": 64.0, "kerb": 64.0, "paint": 64.0}
_SIZE = 512


@dataclass(frozen=True)
class Strip:
    """Axis-parallel rectangle of ground."""

    kind: str  # material, one of GROUND
    x: tuple[float, float]  # minimum and maximum [metres]
    z: tuple[float, float]  # minimum and maximum [metres]


def strip_facets(strips: Sequence[Strip]) -> Facets:
    """Return the facets of strips; if strips overlap, the first one is visible."""
    kinds = list(GROUND)
    projections = np.zeros((len(GROUND), 2, 4))
    projections[:, 0, 0] = projections[:, 1, 2] = list(GROUND.values())
    faces = [level_face(0.0, strip.x, strip.z, kinds.index(strip.kind)) for strip in strips]
    return assemble_facets(faces, projections)


def broken_line(
    start: float, end: float, across: float, along_x: bool, line: float = 3.0, gap: float = 6.0
) -> list[Strip]:
    """Return a broken line along x or z, at `across` on the other axis; lengths in metres."""
    width = (across - 0.06, across + 0.06)
    return [
        Strip("paint", (s, s + line), width) if along_x else Strip("paint", width, (s, s + line))
        for s in np.arange(start, end, line + gap).tolist()
    ]


def paint_ground_materials(random: Generator) -> Pictures:
    """Return the textures of the ground materials, in the order of GROUND."""
    grain = fractal(random, _SIZE, 32, _SIZE // 2, 0.95)
    blots = fractal(random, _SIZE, 4, 16)
    tone = 1 + 0.11 * grain + 0.035 * blots
    asphalt = np.array([104.0, 104.0, 106.0]) * random.uniform(0.88, 1.12) * tone[..., None]
    wear = 1 - 0.3 * np.clip(fractal(random, _SIZE, 16, 256, 0.8) - 0.7, 0, 1)
    stone = 1 + 0.06 * grain
    kerb = 150.0 * stone[..., None] * np.ones(3)
    kerb[:, :: _SIZE // 8] *= 0.7
    kerb[:: _SIZE // 8] *= 0.7
    slabs = paving(random, _SIZE)
    slabs = slabs.mean() * 1.05 + 0.6 * (slabs - slabs.mean())
    lawn = grass(random, _SIZE)
    return pack_pictures([asphalt, slabs, lawn, kerb, 214.0 * (wear * (1 + 0.04 * grain))[..., None]
                   * np.ones(3)])  # fmt: skip


KINDS = {"tree": tree, "bush": bush, "post": post, "sign": sign}  # static objects by kind
_UNSHADED = blank_pictures()

VARIETIES = 3  # number of images per kind


@dataclass(frozen=True)
class StreetObject:
    """Static object of a kind in KINDS at (x, z) [metres]; `size` is relative to the kind."""

    kind: str
    x: float
    z: float
    size: float = 1.0


@dataclass(frozen=True)
class Layout:
    """Layout of the surroundings."""

    seed: int  # seed of textures and images
    strips: Sequence[Strip]  # the ground; if strips overlap, the first one is visible
    houses: Sequence[House]
    plants: Sequence[StreetObject]
    parked: Sequence[CarAt]
    light: Light = OVERCAST


class World:
    """Surroundings in the light of their layout; textures are painted on first use.

    `focal` is the camera's focal length [pixels]. `yaws` are its minimum and maximum viewing
    directions [radians].
    """

    def __init__(self, layout: Layout, focal: float, yaws: tuple[float, float]) -> None:
        self._layout = layout
        self._focal = focal
        self._yaws = yaws
        self._ground = strip_facets(layout.strips)
        self._whole_ground = np.arange(len(layout.strips))

    def draw(self, canvas: NDArray[np.uint8], view: PerspectiveView) -> None:
        """Render ground, houses and panorama into an image."""
        height, width = canvas.shape[:2]
        canvas[:] = 0
        occupied = np.zeros((height, width), np.uint16)
        shadow = np.zeros((1, 1), np.uint8)
        lens = Lens(view.focal, *view.centre)
        for facets, pictures, shade, order in (
            (self._houses.facets, self._houses.pictures, _UNSHADED, self._houses.order(view)),
            (self._ground, self._surfaces, self._stains, self._whole_ground),
        ):
            pose = facet_pose(view, facets, light=self._layout.light)
            lay_facets(canvas, occupied, shadow, facets, pictures, shade, lens, pose, order)
        behind = np.empty_like(canvas)
        lay_behind(canvas, occupied, behind[: self._panorama.draw(behind, view)])

    @cached_property
    def _stains(self) -> Pictures:
        """Texture of stains on the ground; its value is light times 128."""
        random = part_generator(self._layout.seed, "stains")
        stains = 1 + 0.05 * fractal(random, STAINS_SIDE, 2, 64, 0.75)
        return pack_pictures([np.repeat((128 * stains)[..., None], 3, axis=2)])

    @cached_property
    def resting(self) -> list[Drawable]:
        """All static objects, including parked cars."""
        random = part_generator(self._layout.seed, "plants")
        kinds: dict[str, list[Cutout]] = {
            kind: [paint_cutout(make, random) for _ in range(VARIETIES)]
            for kind, make in KINDS.items()
        }
        plants = [
            UprightCutout(
                kinds[plant.kind][random.integers(VARIETIES)], plant.x, plant.z, plant.size
            )
            for plant in self._layout.plants
        ]
        return [*plants, *self._layout.parked]

    @cached_property
    def _houses(self) -> Houses:
        return Houses(part_generator(self._layout.seed, "houses"), self._layout.houses)

    @cached_property
    def _surfaces(self) -> Pictures:
        return paint_ground_materials(part_generator(self._layout.seed, "ground"))

    @cached_property
    def _panorama(self) -> Panorama:
        random = part_generator(self._layout.seed, "panorama")
        return Panorama(random, self._focal, self._yaws, 640, 300)
