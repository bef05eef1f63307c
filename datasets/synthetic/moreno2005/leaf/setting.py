"""Parts of a scene: light, foliage and the leaf."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.synthetic.moreno2005.leaf.blade import Blade, Shape, drawn_blade, placed
from trackmark.datasets.synthetic.moreno2005.leaf.plan import JUMP, SIZE, drawn_shapes, drawn_sway
from trackmark.datasets.synthetic.render.colours import any_of, varied
from trackmark.datasets.synthetic.render.lamp import light_left
from trackmark.datasets.synthetic.render.path import smooth_step
from trackmark.datasets.synthetic.render.texture import fractal
from trackmark.datasets.synthetic.render.triangles import Seen, lay, seen
from trackmark.datasets.synthetic.scene import part_generator

Array = NDArray[np.float64]
Floats = NDArray[np.float32]


@dataclass(frozen=True)
class Light:
    """Light of the sky from all around and of the sun on what faces it, BGR; shapes (3,)."""

    sky: Array
    sun: Array


SUNSHINE = Light(np.array([0.56, 0.64, 0.66]), np.array([0.60, 1.40, 1.90]))
CLOUD = Light(np.array([0.40, 0.31, 0.22]), np.array([0.024, 0.056, 0.076]))
THROUGH = 0.35  # part of the sun's light that comes through a leaf
SIDE = 512  # of the pattern of sun and shade, which repeats [pixels]
# Colours of the leaf: yellower than the foliage, or turning brown; BGR.
COLOURS = ((52, 156, 148), (56, 138, 164), (58, 168, 124))
LONG = 76, 90  # its length [pixels]
OPEN = 0.45  # least part of the sun that the leaf gets: little is above it

GREENS = (
    (44, 104, 62), (40, 88, 48), (56, 128, 84), (46, 118, 96), (38, 78, 50), (66, 138, 108),
    (62, 110, 66), (34, 96, 74),
)  # fmt: skip
"""Of the foliage, BGR."""

FAR, NEAR = 190, 60  # leaves that are still, and those before them that sway
MARGIN = 8  # what a layer of foliage reaches beyond the picture on every side [pixels]
WIDE = SIZE[0] + 2 * MARGIN, SIZE[1] + 2 * MARGIN  # size of a layer [pixels]

KINDS, ALIKE = 50, 0.15
"""Leaves that grow in a layer, again and again, and the part of them whose colour is near the
target's."""

GROUND = np.array([0.006, 0.010, 0.008])  # what is behind all leaves
OFF, SOFTNESS = 9.0, 3.5  # how far from a leaf its shadow lies, and how soft it is [pixels]
# Part of the light from all around, and of the sun's, that a leaf takes from those below.
SHADED = 0.35, 0.8


def fallen(normals: Array, sun: Array, in_sun: Array) -> tuple[Array, Array]:
    """Return the light on leaves from all around and from the sun, in parts of a `Light`.

    `normals`: of the vertices, shape (v, 3). `sun`: direction to the sun, shape (3,). `in_sun`:
    part of the sun that each vertex sees, shape (v,).
    """
    facing = normals @ sun * np.sign(normals[:, 2])  # of the side that is seen
    lit = np.where(facing > 0, facing, -THROUGH * facing)
    return 0.75 + 0.25 * np.abs(normals[:, 2]), in_sun * lit


@dataclass(frozen=True)
class Layer:
    """Leaves, in light of 1 from all around and in light of 1 of the sun.

    Both sheets have the size `WIDE`: light that comes back, premultiplied by the coverage, which
    is the last of their four channels.
    """

    around: Floats
    straight: Floats

    def lit(self, light: Light) -> Floats:
        """Return the surface in a light, premultiplied, shape (height, width, 4)."""
        sky, sun = np.append(light.sky, 1), np.append(light.sun, 0)
        return np.asarray(self.around * sky + self.straight * sun, np.float32)


class Setting:
    """All parts of a scene that are drawn from its seed."""

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self.sun = self._drawn_sun()

        self.lights = (SUNSHINE, CLOUD)

    @cached_property
    def shapes(self) -> tuple[Shape, ...]:
        """The leaf in every frame."""
        return drawn_shapes(self._random("wind"))

    @cached_property
    def sway(self) -> Array:
        """See `plan.drawn_sway`."""
        return drawn_sway(self._random("sway"))

    def points(self, frame: int) -> tuple[Array, Array]:
        """The leaf's vertices in a frame, and its directions there; see `blade.placed`."""
        return placed(self._blade, self.shapes[frame])

    def light(self, frame: int) -> Light:
        """Return the light in a frame; it changes at the jump."""
        return self.lights[int(frame >= JUMP)]

    def seen(self, frame: int) -> Seen:
        """Return the leaf as seen in a frame."""
        points, normals = self.points(frame)
        in_sun = OPEN + (1 - OPEN) * self._seen_sun(points)
        around, straight = fallen(normals, self.sun, in_sun)
        light = self.light(frame)
        lights = around[:, None] * light.sky + straight[:, None] * light.sun
        return seen(self._blade.mesh, points, lights, SIZE)

    @cached_property
    def layers(self) -> tuple[Layer, Layer]:
        """Foliage that is still, and that which sways before it."""
        return self._layer("still foliage", FAR, 1.0), self._layer("foliage that sways", NEAR, 0.4)

    def _layer(self, part: str, count: int, depth: float) -> Layer:
        """So many leaves over one another, the deeper (up to 1: no gaps are left) the darker."""
        random = self._random(part)
        around, straight = (np.zeros((*WIDE[::-1], 4), np.float32) for _ in range(2))
        if depth == 1:
            around[..., :3], around[..., 3], straight[..., 3] = GROUND, 1, 1
        blades = [_foliage(random, self._colour) for _ in range(KINDS)]
        for number in range(count):
            higher = 1 - depth * (1 - number / count)
            blade = blades[int(random.integers(KINDS))]
            points, normals = placed(blade, _shape(random))
            in_sun = self._seen_sun(points - [MARGIN, MARGIN, 0]) * (0.1 + 0.9 * higher)
            sky, direct = fallen(normals, self.sun, in_sun)
            leaves = [
                seen(blade.mesh, points, np.repeat(light[:, None], 3, axis=1), WIDE)
                for light in (sky * (0.25 + 0.75 * higher), direct)
            ]
            coverage = leaves[0].coverage(WIDE)
            for sheet, leaf, darkness in zip((around, straight), leaves, SHADED, strict=True):
                sheet[..., :3] *= light_left(coverage, -OFF * self.sun[:2], SOFTNESS, darkness)
                lay(sheet[leaf.window], leaf.sheet)
        return Layer(around, straight)

    def _seen_sun(self, points: Array) -> Array:
        """Part of the sun, in [0, 1], that what is above the picture lets through to points."""
        columns, rows = np.round(points[:, :2].T).astype(np.int64) % SIDE
        return np.asarray(self._dapples[rows, columns])

    def _drawn_sun(self) -> Array:
        """Direction to the sun: above, aside, on the camera's side; shape (3,)."""
        random = self._random("sun")
        sun = np.array([random.choice([-1, 1]) * random.uniform(0.3, 0.6), -0.6, 0.65])
        return np.asarray(sun / np.sqrt((sun * sun).sum()))

    @cached_property
    def _colour(self) -> Array:
        return any_of(self._random("colour"), COLOURS)

    @cached_property
    def _blade(self) -> Blade:
        random = self._random("leaf")
        return drawn_blade(random, random.uniform(*LONG), self._colour)

    @cached_property
    def _dapples(self) -> Array:
        return smooth_step(fractal(self._random("dapples"), SIDE, 8, 32, 0.6), -0.55, 0.45)

    def _random(self, part: str) -> np.random.Generator:
        return part_generator(self._seed, f"moreno2005/leaf {part}")


def _foliage(random: np.random.Generator, target: Array) -> Blade:
    """A leaf of the foliage; some have nearly the colour of the `target`, BGR."""
    colour = any_of(random, GREENS)
    if random.random() < ALIKE:
        share = random.uniform(0.5, 0.9)
        colour = (1 - share) * colour + share * varied(random, target)
    return drawn_blade(random, random.uniform(40, 76), colour)


def _shape(random: np.random.Generator) -> Shape:
    return Shape(
        random.uniform(-10, 10, 2) + random.uniform(0, 1, 2) * WIDE,
        random.uniform(-np.pi, np.pi),
        random.uniform(-0.8, 0.8),
        random.uniform(-0.8, 0.8),
        random.uniform(-0.3, 1.0),
        random.uniform(0.1, 0.5),
    )
