"""Cars: geometry, paint, rendering at a position, and paints that differ from the target's."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.synthetic.nummiaro2003.driving.laying import lay_facets, sprite_of
from trackmark.datasets.synthetic.nummiaro2003.driving.paintwork import BGR, paint_car_pictures
from trackmark.datasets.synthetic.nummiaro2003.driving.shape import (
    CarShape,
    FacetPose,
    Facets,
    Lens,
    Pictures,
    blank_pictures,
    sample_car_shape,
)
from trackmark.datasets.synthetic.nummiaro2003.driving.view import (
    NEAREST_DRAWN,
    PerspectiveView,
    Window,
    facet_extents,
    facet_pose,
)
from trackmark.datasets.synthetic.render.prop import Coverage
from trackmark.datasets.synthetic.render.sprite import blend_sprite

Array = NDArray[np.float64]

_BLANK = blank_pictures(5)
_UNSHADED = blank_pictures()
_SPARE = 16  # pixels beyond the canvas, needed for motion blur


class Car:
    """Car with a shape and a paint (BGR); `seed` determines its random details."""

    def __init__(self, shape: CarShape, paint: BGR, seed: int) -> None:
        self.shape = shape
        self.paint = paint
        self._seed = seed

    @cached_property
    def facets(self) -> Facets:
        """All facets, including the shadow."""
        return self.shape.facets

    @cached_property
    def body(self) -> Facets:
        """All facets except the shadow."""
        corners, counts, normals, kinds, places, soft = self.facets
        hard = ~soft
        return Facets(
            corners[hard], counts[hard], normals[hard], kinds[hard], places[hard], soft[hard]
        )

    @cached_property
    def pictures(self) -> Pictures:
        """Textures of the facets."""
        return paint_car_pictures(np.random.default_rng(self._seed), self.shape, self.paint)


@dataclass(frozen=True)
class CarAt:
    """Car at a position on the ground; implements `Drawable`."""

    car: Car
    x: float  # centre on the ground, to the right [metres]
    z: float  # centre on the ground, ahead [metres]
    heading: float  # [radians]
    # image displacement during the exposure, right and down [pixels]
    motion: tuple[float, float] = (0.0, 0.0)
    # fractions of `motion` at which the car is drawn; their number is a power of two
    moments: tuple[float, ...] = (0.0,)

    reach = 3.0  # see `Drawable.reach`

    def box(self, view: PerspectiveView) -> Array:
        """Return the extents [x, y, width, height] of the whole car in the image [pixels]."""
        left, right, top, bottom, _ = self._extents(self.car.body, view)
        return np.array([left, top, right - left, bottom - top])

    def window(self, view: PerspectiveView) -> Window | None:
        low_x, high_x, low_y, high_y, nearest = self._extents(self.car.facets, view)
        if nearest < NEAREST_DRAWN / 2:
            return None
        x, y = (math.ceil(abs(shift) / 2) + 1 for shift in self.motion)
        return (
            math.floor(low_x) - x,
            math.floor(low_y) - y,
            math.ceil(high_x) + x,
            math.ceil(high_y) + y,
        )

    def draw(self, canvas: NDArray[np.uint8], view: PerspectiveView) -> None:
        """Draw the car with its shadow; see `Drawable.draw`."""
        laid = self._laid(self.car.facets, view, canvas.shape[1::-1], self.car.pictures)
        if laid is None:
            return
        sprite, left, top = laid
        right, down = (np.multiply(self.moments, shift) for shift in self.motion)
        lefts = np.round((left + right) * 64).astype(np.int64)
        tops = np.round((top + down) * 64).astype(np.int64)
        blend_sprite(canvas, sprite, lefts, tops, 65536)

    def coverage(self, view: PerspectiveView, size: tuple[int, int]) -> Coverage:
        """Return the silhouette in an image of `size` (width, height), without the shadow."""
        laid = self._laid(self.car.body, view, size, _BLANK)
        if laid is None:
            return 0, 0, np.zeros((0, 0), np.uint8)
        sprite, left, top = laid
        return left, top, sprite[1:-1, 1:-1, 3].copy()

    def _extents(
        self, facets: Facets, view: PerspectiveView
    ) -> tuple[float, float, float, float, float]:
        pose = self._pose(facets, view)
        left, right, top, bottom, nearest = facet_extents(
            facets, pose, Lens(view.focal, *view.centre)
        )
        return left, right, top, bottom, nearest

    def _pose(self, facets: Facets, view: PerspectiveView) -> FacetPose:
        return facet_pose(view, facets, (self.x, 0.0, self.z), self.heading)

    def _laid(
        self, facets: Facets, view: PerspectiveView, size: tuple[int, ...], pictures: Pictures
    ) -> tuple[NDArray[np.uint8], int, int] | None:
        """Render the part of the car in or near the image; return sprite, left and top [pixels]."""
        window = self.window(view)
        if window is None:
            return None
        left, top = max(window[0], -_SPARE), max(window[1], -_SPARE)
        width = min(window[2], size[0] + _SPARE) - left
        height = min(window[3], size[1] + _SPARE) - top
        if width <= 0 or height <= 0:
            return None
        colour, occupied = (
            np.zeros((height, width, 3), np.uint8),
            np.zeros((height, width), np.uint16),
        )
        shadow = np.zeros((height, width), np.uint8)
        lens = Lens(view.focal, view.centre[0] - left, view.centre[1] - top)
        order = np.arange(len(facets.counts))
        pose = self._pose(facets, view)
        lay_facets(colour, occupied, shadow, facets, pictures, _UNSHADED, lens, pose, order)
        return sprite_of(colour, occupied, shadow), left, top


PAINTS: tuple[BGR, ...] = (
    (38, 34, 150),  # red
    (46, 36, 92),  # dark red
    (148, 92, 42),  # blue
    (88, 54, 36),  # dark blue
    (66, 96, 44),  # green
    (60, 150, 190),  # yellow
    (196, 202, 204),  # white
    (164, 166, 166),  # silver
    (94, 94, 94),  # grey
    (44, 42, 42),  # black
    (128, 156, 172),  # beige
)

# paints of targets: all except the colour of the road
TARGETS = tuple(paint for paint in PAINTS if paint != (94, 94, 94))
CLEAR = 60.0  # two paints differ clearly if one channel differs by this much [grey levels]


def sample_paint(random: np.random.Generator, choice: tuple[BGR, ...] = PAINTS) -> BGR:
    """Sample one of the paints and vary it slightly."""
    colour = np.array(choice[random.integers(len(choice))])
    blue, green, red = (colour * random.uniform(0.92, 1.08) + random.uniform(-4, 4, 3)).tolist()
    return blue, green, red


def contrasting_paints(target: BGR) -> tuple[BGR, ...]:
    """Return the paints that differ clearly from the target's paint."""
    return tuple(p for p in PAINTS if np.abs(np.subtract(p, target)).max() >= CLEAR)


def sample_car(random: np.random.Generator, choice: tuple[BGR, ...] = PAINTS) -> Car:
    """Sample a car of random shape, in one of the paints `choice`."""
    return Car(sample_car_shape(random), sample_paint(random, choice), int(random.integers(2**32)))
