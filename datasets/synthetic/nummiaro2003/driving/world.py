"""Where cars drive: ground, houses, what stands about, and light on all of it."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.nummiaro2003.driving.billboard import Cutout, Standing, cut_out
from datasets.synthetic.nummiaro2003.driving.car import CarAt
from datasets.synthetic.nummiaro2003.driving.facets import Lens, Pictures, blank
from datasets.synthetic.nummiaro2003.driving.ground import Strip, laid, surfaces
from datasets.synthetic.nummiaro2003.driving.house import House, Houses
from datasets.synthetic.nummiaro2003.driving.laying import lay_facets, lay_picture
from datasets.synthetic.nummiaro2003.driving.lighting import Lighting
from datasets.synthetic.nummiaro2003.driving.panorama import Panorama
from datasets.synthetic.nummiaro2003.driving.posing import posed
from datasets.synthetic.nummiaro2003.driving.thing import Thing
from datasets.synthetic.nummiaro2003.driving.view import View
from datasets.synthetic.render.street.furniture import bush, post, sign, tree
from datasets.synthetic.render.street.ground import Light
from datasets.synthetic.scene import part_generator

__all__ = ["Layout", "Plant", "World"]

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
    """What a place is like.

    Attributes
    ----------
    seed : int
        Of all that is drawn at random when it is painted.
    strips : sequence of Strip
        The ground; where two overlap, the one that comes first is seen.
    houses : sequence of House
    plants : sequence of Plant
    parked : sequence of CarAt
    """

    seed: int
    strips: Sequence[Strip]
    houses: Sequence[House]
    plants: Sequence[Plant]
    parked: Sequence[CarAt]


class World:
    """A place in a light; nothing is painted before it is asked for.

    Parameters
    ----------
    layout : Layout
    light : {'even', 'dappled'}
    focal : float
        Of the camera [pixels].
    yaws : tuple of float
        Lowest and highest direction of sight [radians].
    """

    def __init__(
        self, layout: Layout, light: Light, focal: float, yaws: tuple[float, float]
    ) -> None:
        self._layout = layout
        self._light: Light = light
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
            (self._ground, self._surfaces, self.lighting.ground, self._whole_ground),
        ):
            pose = posed(view, facets)
            lay_facets(canvas, taken, shadow, facets, pictures, shade, lens, pose, order)
        behind = np.empty_like(canvas)
        lay_picture(canvas, taken, behind, self._panorama.draw(behind, view))

    @cached_property
    def lighting(self) -> Lighting:
        """Light on ground and cars."""
        return Lighting(part_generator(self._layout.seed, "shade"), self._light)

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
