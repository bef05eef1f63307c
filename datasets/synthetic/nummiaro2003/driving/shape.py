"""Shapes of cars: outlines at a few heights, wheels, and where each part is painted."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.synthetic.nummiaro2003.driving.facets import (
    Face,
    Facets,
    Ring,
    assembled,
    between,
    flat,
    upright,
)

Array = NDArray[np.float64]

SIDE, FRONT, REAR, TOP, SHADOW = range(5)
"""Pictures of a car: elevations, a plan, and the shadow below."""

REACH = 2.56
"""Side and plan show this much before and behind the middle [metres]."""

WIDE = 1.28
"""Front, rear and plan show this much on either side of the middle [metres]."""

TALL = 1.92
"""Elevations show this much above the ground [metres]."""

SIZES = {SIDE: (512, 128), FRONT: (256, 128), REAR: (256, 128), TOP: (256, 128), SHADOW: (64, 64)}
"""Width and height of the pictures [pixels]."""

BELT = 0.93
"""Height of the lower edge of the windows, without that of the sills [metres]."""

TYRE = 0.31
"""Radius of a tyre, and height of its hub [metres]."""

_CUT = 0.16, 0.24  # corners of the body, across and along [metres]
_DARK = 0.55  # reach of the shadow beyond the body [metres]


@dataclass(frozen=True)
class Shape:
    """Proportions of a car, in metres; along the car from its middle, ahead positive."""

    # length, width: of the body
    length: float
    width: float
    roof: float  # height of the roof
    bonnet: float  # height of the bonnet's front edge
    # screen, rear_screen: where the windscreen and the rear window stand and where they end at
    # the roof
    screen: tuple[float, float]
    rear_screen: tuple[float, float]
    deck: float  # where the body's upper side ends behind
    axles: tuple[float, float]  # front and rear

    @property
    def rings(self) -> tuple[Ring, ...]:
        """Outlines from the sills to the windows' lower edge."""
        end, wide = self.length / 2, self.width / 2
        return (
            Ring(0.21, end - 0.13, 0.13 - end, wide - 0.07),
            Ring(0.46, end, -end, wide - 0.01),
            Ring(self.bonnet, end - 0.08, 0.04 - end, wide),
            Ring(BELT, self.screen[0] + 0.04, self.deck, wide - 0.045),
        )

    @property
    def cabin(self) -> tuple[Ring, ...]:
        """Outlines from the windows' lower edge to the roof's middle."""
        wide = self.width / 2
        front, rear = self.screen[1], self.rear_screen[1]
        return (
            Ring(BELT, self.screen[0], self.rear_screen[0], wide - 0.075),
            Ring(self.roof - 0.05, front, rear, wide - 0.235),
            Ring(self.roof, front - 0.14, rear + 0.12, wide - 0.36),
        )

    @cached_property
    def facets(self) -> Facets:
        """Everything of the car, from front to back as seen from above the bonnet."""
        return assembled(list(self._faces()), self._projections)

    def _faces(self) -> Iterator[Face]:
        foot, eaves, top = self.cabin
        yield flat(top.height, (-top.half_width, top.half_width), (top.behind, top.ahead), TOP)
        yield from between(eaves, top, (TOP, TOP, TOP))
        yield from between(foot, eaves, (FRONT, REAR, SIDE))
        rings = self.rings
        deck = rings[-1]
        yield flat(BELT, (-deck.half_width, deck.half_width), (deck.behind, deck.ahead), TOP)
        yield from between(rings[2], rings[3], (TOP, REAR, SIDE), _CUT)
        yield from between(rings[1], rings[2], (FRONT, REAR, SIDE), _CUT)
        yield from between(rings[0], rings[1], (FRONT, REAR, SIDE), _CUT)
        yield from self._wheels()
        end, wide = self.length / 2 + _DARK, self.width / 2 + _DARK
        yield flat(0.0, (-wide, wide), (-end, end), SHADOW, soft=True)

    def _wheels(self) -> Iterator[Face]:
        outer = self.rings[0].half_width
        inner = outer - 0.2
        angles = np.pi * (0.5 + np.arange(8)) / 4
        for axle in self.axles:
            for side in (-1, 1):
                tread = [(side * inner, 0.0), (side * outer, 0.0), (side * outer, 0.4),
                         (side * inner, 0.4)]  # fmt: skip
                rim = [
                    (side * outer, TYRE * (1 + 1.06 * np.sin(a)), axle + 1.06 * TYRE * np.cos(a))
                    for a in angles
                ]
                yield Face(np.array(rim), np.array([side, 0.0, 0.0]), SIDE)
                yield upright(tread, axle + 0.2, True, FRONT)
                yield upright(tread, axle - 0.2, False, REAR)

    @property
    def _projections(self) -> Array:
        """Where every place of the car is in each picture."""

        def scaled(kind: int, factors: list[list[float]]) -> Array:
            return np.multiply(factors, np.array(SIZES[kind], np.float64)[:, None])

        up = [0, -1 / TALL, 0, 1.0]
        along, across = [0, 0, 0.5 / REACH, 0.5], [0.5 / WIDE, 0, 0, 0.5]
        mirrored = [-0.5 / WIDE, 0, 0, 0.5]
        wide, end = self.width / 2 + _DARK, self.length / 2 + _DARK
        below = [[0.5 / wide, 0, 0, 0.5], [0, 0, 0.5 / end, 0.5]]
        return np.array(
            [
                scaled(SIDE, [along, up]),
                scaled(FRONT, [across, up]),
                scaled(REAR, [mirrored, up]),
                scaled(TOP, [along, across]),
                scaled(SHADOW, below),
            ]
        )


def any_shape(random: np.random.Generator) -> Shape:
    """Saloon, hatchback or estate, with proportions of its own."""
    kind = ("saloon", "hatchback", "estate")[random.integers(3)]
    length = random.uniform(*{"saloon": (4.25, 4.6), "hatchback": (3.75, 4.1),
                              "estate": (4.3, 4.65)}[kind])  # fmt: skip
    end = length / 2
    foot = end - random.uniform(1.12, 1.26)
    slope = random.uniform(0.68, 0.82)
    if kind == "saloon":
        rear = -end + random.uniform(0.62, 0.74), -end + random.uniform(1.2, 1.34)
    elif kind == "hatchback":
        rear = -end + random.uniform(0.12, 0.16), -end + random.uniform(0.5, 0.66)
    else:
        rear = -end + random.uniform(0.1, 0.14), -end + random.uniform(0.3, 0.4)
    return Shape(
        length=length,
        width=random.uniform(1.66, 1.76),
        roof=random.uniform(1.39, 1.47),
        bonnet=random.uniform(0.7, 0.76),
        screen=(foot, foot - slope),
        rear_screen=rear,
        deck=-end + 0.07,
        axles=(end - random.uniform(0.78, 0.86), -end + random.uniform(0.76, 0.88)),
    )
