"""The light of the lamps on all that is seen."""

from collections.abc import Sequence
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.synthetic.nguyen2002.lights.plan import SIZE
from trackmark.datasets.synthetic.nguyen2002.lights.setting import (
    HELD,
    PASSING,
    ROOM_FINE,
    CardPose,
    LightsSetting,
    ShadowMask,
)
from trackmark.datasets.synthetic.render.lamp import (
    AMBIENT,
    Lamp,
    crossing,
    lay_lit,
    light_on,
    softness,
    unshaded,
)

Array = NDArray[np.float64]
Floats = NDArray[np.float32]

# About how far towards the camera what stands still is, on which soft shadows fall [pixels].
AFAR = -90.0
# Of the lamp that goes off: its part of the light, and how far aside of the middle it is [pixels].
# What is left is so little, and the shadows so far aside, that colours of before say nothing.
STRONG, ASIDE = (0.88, 0.92), (210, 270)


def drawn_lamps(random: np.random.Generator) -> tuple[Lamp, Lamp]:
    """Draw the lamp that goes off, which gives most of the light, and another across from it.

    Both are nearly white: their blue differs by 6 %, their green by 2.5 %.
    """
    side = float(random.choice([-1, 1]))
    aside, across = random.uniform(*ASIDE), random.uniform(150, 210)
    first = np.array([160 - side * aside, random.uniform(-90, -20), random.uniform(230, 290)])
    second = np.array([160 + side * across, random.uniform(-60, 40), random.uniform(220, 280)])
    share = random.uniform(*STRONG)
    tint = 1 + random.choice([-1, 1]) * np.array([0.06, 0.025, 0.0])
    return Lamp(first, np.full(3, share)), Lamp(second, (1 - share) * tint)


class Lighting:
    """Pictures of a setting in linear light."""

    def __init__(self, setting: LightsSetting, lamps: Sequence[Lamp]) -> None:
        self._setting = setting
        self._lamps = lamps

    def picture(
        self,
        on: Sequence[int],
        held: CardPose,
        turn: Array,
        passing: Sequence[tuple[int, CardPose, int]],
    ) -> Floats:
        """What is seen in the light of the lamps with indices `on`, shape (height, width, 3).

        What is held faces to the right and down by `turn` (2,) [radians]; of what passes are given
        its index, where it is, and over how many pixels it is blurred.
        """
        picture = np.zeros((*SIZE[::-1], 3), np.float32)
        for k in on:
            ambient, direct = self._returned[k]
            through, passed = self._ways[k]
            seen = 1 - self._held_shades[k].at(held, through)
            for number, pose, _ in passing:
                seen *= 1 - self._far_shades[k][number].at(pose, passed)
            picture += ambient + direct * seen[..., None]
        left = np.ones((len(on), *SIZE[::-1]), np.float32)
        for seen, k in zip(left, on, strict=True):
            for number, pose, _ in passing:
                seen *= 1 - self._near_shades[k][number].at(pose, self._near_ways[k])
        self._lay(picture, on, self._setting.carried.at(held), HELD, turn, left)
        for number, pose, blur in passing:
            card = self._setting.passers[number]
            if not card.may_be_seen(pose):  # it only takes light from what is seen
                continue
            blurred = [
                np.asarray(cv2.blur(sheet, (blur, 1)), np.float32) for sheet in card.at(pose)
            ]
            self._lay(picture, on, blurred, PASSING, np.zeros(2), np.ones_like(left))
        return picture

    def _lay(
        self, picture: Floats, on: Sequence[int], sheets: Sequence[Floats], depth: float,
        turn: Array, left: Floats,
    ) -> None:  # fmt: skip
        """Lay a card at a depth over a picture, in what is `left` of the lamps' light."""
        places = np.stack([self._lamps[k].place for k in on])
        powers = np.stack([self._lamps[k].colour for k in on])
        lay_lit(picture, sheets[0], sheets[1], depth, turn, places, powers, left)

    @cached_property
    def _returned(self) -> list[tuple[Floats, Floats]]:
        """What comes back of each lamp's light, from all around and straight, to the camera."""
        room = self._setting.room
        colour = room.reduced(ROOM_FINE)[0][..., :3]
        pairs = []
        for lamp in self._lamps:
            light, shine = light_on(lamp.place, room.depth, room.normal, ROOM_FINE)
            seen = unshaded(room.depth, lamp.place, ROOM_FINE)
            back = (room.colour * light[..., None] + (room.gloss * shine)[..., None]) * seen
            direct = cv2.resize(back, SIZE, interpolation=cv2.INTER_AREA)
            ambient = (AMBIENT * lamp.colour * colour).astype(np.float32)
            pairs.append((ambient, (lamp.colour * direct).astype(np.float32)))
        return pairs

    @cached_property
    def _ways(self) -> list[tuple[Floats, Floats]]:
        """Where each lamp's light on what stands still comes by what is held, and what passes."""
        depth = cv2.resize(self._setting.room.depth, SIZE, interpolation=cv2.INTER_AREA)
        points = _points(np.asarray(depth))
        return [
            (crossing(lamp, points, HELD), crossing(lamp, points, PASSING)) for lamp in self._lamps
        ]

    @cached_property
    def _near_ways(self) -> list[Floats]:
        """Where each lamp's light on what is held comes by what passes."""
        points = _points(np.full(SIZE[::-1], HELD))
        return [crossing(lamp, points, PASSING) for lamp in self._lamps]

    @cached_property
    def _held_shades(self) -> list[ShadowMask]:
        return [self._setting.carried.shade(softness(lamp, HELD, AFAR)) for lamp in self._lamps]

    @cached_property
    def _far_shades(self) -> list[list[ShadowMask]]:
        return self._passers_shades(AFAR)

    @cached_property
    def _near_shades(self) -> list[list[ShadowMask]]:
        return self._passers_shades(HELD)

    def _passers_shades(self, depth: float) -> list[list[ShadowMask]]:
        """What each passer takes of each lamp from what is at a depth."""
        return [
            [card.shade(softness(lamp, PASSING, depth)) for card in self._setting.passers]
            for lamp in self._lamps
        ]


def _points(depth: Array) -> Floats:
    """Middles of the picture's pixels at a depth, shape (height, width, 3)."""
    rows, columns = np.indices(depth.shape) + 0.5
    return np.stack([columns, rows, depth], axis=2).astype(np.float32)
