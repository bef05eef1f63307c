"""Places where cars drive: ground, houses, what stands about and what is far off."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.synthetic.nummiaro2003.driving.car import CarAt
from trackmark.datasets.synthetic.nummiaro2003.driving.facets import (
    Facets,
    Lens,
    Pictures,
    assembled,
    blank,
    flat,
    packed,
)
from trackmark.datasets.synthetic.nummiaro2003.driving.house import House, Houses
from trackmark.datasets.synthetic.nummiaro2003.driving.laying import lay_behind, lay_facets
from trackmark.datasets.synthetic.nummiaro2003.driving.things import (
    Cutout,
    Standing,
    Thing,
    cut_out,
)
from trackmark.datasets.synthetic.nummiaro2003.driving.view import STAINS_SIDE, View, posed
from trackmark.datasets.synthetic.render.sprite import draw_rows
from trackmark.datasets.synthetic.render.street.facades import backdrop
from trackmark.datasets.synthetic.render.street.furniture import bush, post, sign, tree
from trackmark.datasets.synthetic.render.texture import fractal, grass, paving
from trackmark.datasets.synthetic.scene import part_generator

Array = NDArray[np.float64]

_DISTANCE = 150.0  # of the town [metres]
_BELOW = 6  # rows that reach under the horizon


class Panorama:
    """What is too far to move when the camera does: sky, a town, trees before it.

    `yaws` are the lowest and the highest direction of sight [radians], `width` and `height` those
    of the images, `focal` the focal length [pixels].
    """

    def __init__(
        self,
        random: np.random.Generator,
        focal: float,
        yaws: tuple[float, float],
        width: int,
        height: int,
    ) -> None:
        self._start = yaws[0]
        self._focal = focal
        around = int(np.ceil((yaws[1] - yaws[0]) * focal)) + width + 4
        self._base = height
        picture = backdrop(random, height + _BELOW, around, focal / _DISTANCE, float(height))
        self._picture = _with_trees(random, picture, height, focal / 90.0)

    def draw(self, canvas: NDArray[np.uint8], view: View) -> int:
        """Fill all rows down to the horizon and a few below it; how many these are."""
        last = int(np.clip(np.ceil(view.horizon) + _BELOW, 0, len(canvas)))
        left = np.round((view.yaw - self._start) * self._focal * 64)
        lefts = np.full((1, len(self._picture)), left, np.int64)
        top = round((view.horizon - self._base) * 64)
        draw_rows(canvas, self._picture, top, lefts, 0, last)
        return last


def _with_trees(
    random: np.random.Generator, picture: NDArray[np.uint8], base: int, metre: float
) -> NDArray[np.uint8]:
    """A picture with trees along its base; `metre` is in pixels."""
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


GROUND = {"asphalt": 96.0, "paving": 128.0, "grass": 64.0, "kerb": 64.0, "paint": 64.0}
"""What the ground is made of, and how many pixels its picture has a metre."""

_SIZE = 512


@dataclass(frozen=True)
class Strip:
    """A rectangle along the axes."""

    kind: str  # what it is made of, one of GROUND
    # x, z: from and to [metres]
    x: tuple[float, float]
    z: tuple[float, float]


def laid(strips: Sequence[Strip]) -> Facets:
    """Facets of strips; where two overlap, the one that comes first is seen."""
    kinds = list(GROUND)
    projections = np.zeros((len(GROUND), 2, 4))
    projections[:, 0, 0] = projections[:, 1, 2] = list(GROUND.values())
    faces = [flat(0.0, strip.x, strip.z, kinds.index(strip.kind)) for strip in strips]
    return assembled(faces, projections)


def dashes(
    start: float, end: float, across: float, along_x: bool, line: float = 3.0, gap: float = 6.0
) -> list[Strip]:
    """Broken line along an axis; all in metres."""
    width = (across - 0.06, across + 0.06)
    return [
        Strip("paint", (s, s + line), width) if along_x else Strip("paint", width, (s, s + line))
        for s in np.arange(start, end, line + gap).tolist()
    ]


def surfaces(random: np.random.Generator) -> Pictures:
    """Pictures of all that the ground is made of, in the order of GROUND."""
    grain = fractal(random, _SIZE, 32, _SIZE // 2, 0.95)
    blots = fractal(random, _SIZE, 4, 16)
    tone = 1 + 0.11 * grain + 0.035 * blots
    asphalt = np.array([104.0, 104.0, 106.0]) * random.uniform(0.88, 1.12) * tone[..., None]
    worn = 1 - 0.3 * np.clip(fractal(random, _SIZE, 16, 256, 0.8) - 0.7, 0, 1)
    stone = 1 + 0.06 * grain
    kerb = 150.0 * stone[..., None] * np.ones(3)
    kerb[:, :: _SIZE // 8] *= 0.7
    kerb[:: _SIZE // 8] *= 0.7
    slabs = paving(random, _SIZE)
    slabs = slabs.mean() * 1.05 + 0.6 * (slabs - slabs.mean())
    lawn = grass(random, _SIZE)
    return packed([asphalt, slabs, lawn, kerb, 214.0 * (worn * (1 + 0.04 * grain))[..., None]
                   * np.ones(3)])  # fmt: skip


KINDS = {"tree": tree, "bush": bush, "post": post, "sign": sign}
"""What can stand about."""

_UNSHADED = blank()

VARIETIES = 3
"""Of each kind."""


@dataclass(frozen=True)
class Plant:
    """A thing that stands about: one of KINDS, where [metres], and how large against its kind."""

    kind: str
    x: float
    z: float
    size: float = 1.0


@dataclass(frozen=True)
class Layout:
    """What a place is like."""

    seed: int  # of all that is drawn at random when it is painted
    strips: Sequence[Strip]  # the ground; where two overlap, the one that comes first is seen
    houses: Sequence[House]
    plants: Sequence[Plant]
    parked: Sequence[CarAt]


class World:
    """A place under an overcast sky; nothing is painted before it is asked for.

    `focal` is the camera's [pixels], `yaws` its lowest and highest direction of sight [radians].
    """

    def __init__(self, layout: Layout, focal: float, yaws: tuple[float, float]) -> None:
        self._layout = layout
        self._focal = focal
        self._yaws = yaws
        self._ground = laid(layout.strips)
        self._whole_ground = np.arange(len(layout.strips))

    def draw(self, canvas: NDArray[np.uint8], view: View) -> None:
        """Fill a picture with ground, houses and what is far off."""
        height, width = canvas.shape[:2]
        canvas[:] = 0
        taken = np.zeros((height, width), np.uint16)
        shadow = np.zeros((1, 1), np.uint8)
        lens = Lens(view.focal, *view.centre)
        for facets, pictures, shade, order in (
            (self._houses.facets, self._houses.pictures, _UNSHADED, self._houses.order(view)),
            (self._ground, self._surfaces, self._stains, self._whole_ground),
        ):
            pose = posed(view, facets)
            lay_facets(canvas, taken, shadow, facets, pictures, shade, lens, pose, order)
        behind = np.empty_like(canvas)
        lay_behind(canvas, taken, behind[: self._panorama.draw(behind, view)])

    @cached_property
    def _stains(self) -> Pictures:
        """Stains and worn places of the ground, as light on it over 128."""
        random = part_generator(self._layout.seed, "stains")
        stains = 1 + 0.05 * fractal(random, STAINS_SIDE, 2, 64, 0.75)
        return packed([np.repeat((128 * stains)[..., None], 3, axis=2)])

    @cached_property
    def resting(self) -> list[Thing]:
        """What stands about and parks."""
        random = part_generator(self._layout.seed, "plants")
        kinds: dict[str, list[Cutout]] = {
            kind: [cut_out(make, random) for _ in range(VARIETIES)] for kind, make in KINDS.items()
        }
        plants = [
            Standing(kinds[plant.kind][random.integers(VARIETIES)], plant.x, plant.z, plant.size)
            for plant in self._layout.plants
        ]
        return [*plants, *self._layout.parked]

    @cached_property
    def _houses(self) -> Houses:
        return Houses(part_generator(self._layout.seed, "houses"), self._layout.houses)

    @cached_property
    def _surfaces(self) -> Pictures:
        return surfaces(part_generator(self._layout.seed, "ground"))

    @cached_property
    def _panorama(self) -> Panorama:
        random = part_generator(self._layout.seed, "panorama")
        return Panorama(random, self._focal, self._yaws, 640, 300)
