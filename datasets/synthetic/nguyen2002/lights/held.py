"""A printed thing in a hand that comes from below. The middle of the thing is the origin."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from datasets.interface import Image
from datasets.synthetic.render.colours import CLOTHES, nearly
from datasets.synthetic.render.figure.look import COMPLEXIONS
from datasets.synthetic.render.finish import Finish, Pattern, Thing, grain
from datasets.synthetic.render.prints import KINDS, printed
from datasets.synthetic.render.solids import box, limb

__all__ = ["Printed", "drawn_printed", "held"]

Array = NDArray[np.float64]

FINE = 6
"""Dots of the print in a pixel, in either direction."""

DEPTHS = {"book": 5.0, "tea": 11.0, "toy": 13.0}
"""Half the thickness of things of a kind [pixels]."""


@dataclass(frozen=True)
class Printed:
    """A box with a print.

    Attributes
    ----------
    kind : {"book", "tea", "toy"}
    half : ndarray of float64, shape (3,)
        Half its width, height and depth [pixels].
    lean : float
        How far it leans backwards [radians]; it faces the camera, or nearly.
    """

    kind: str
    half: Array
    lean: float


def drawn_printed(random: np.random.Generator) -> Printed:
    """A thing to hold, drawn at random."""
    kind = KINDS[int(random.integers(len(KINDS)))]
    wide = random.uniform(28, 31)
    half = np.array([wide, wide * random.uniform(1.28, 1.36), DEPTHS[kind]])
    return Printed(kind, half, random.uniform(0.06, 0.2))


def held(thing: Printed, random: np.random.Generator) -> list[Thing]:
    """The thing, the hand that holds it, its sleeve."""
    width, height = (round(2 * FINE * side) for side in thing.half[:2])
    print_ = printed(random, thing.kind, width, height)
    solid = box(np.zeros(3), thing.half, 0.8, lean=-thing.lean)
    skin = np.asarray(COMPLEXIONS[random.integers(len(COMPLEXIONS))][0], np.float64)
    cloth = nearly(random, CLOTHES[int(random.integers(len(CLOTHES)))], 0.06)
    side, slope = float(random.choice([-1, 1])), random.uniform(-0.1, 0.4)
    return [
        Thing(Finish(np.full(3, 255.0), 0.05, _all_over(thing, print_)), [solid]),
        Thing(Finish(skin, 0.03, grain(random, 0.035)), _hand(thing, side, slope)),
        Thing(Finish(cloth, 0.0, _knitted(random)), _sleeve(thing, side, slope)),
    ]


def _all_over(thing: Printed, picture: Image) -> Pattern:
    """The print on the front; its border's colours run on round the edges."""

    def gain(places: Array) -> Array:
        along = places[:, 1] / np.cos(thing.lean)
        u = (places[:, 0] / thing.half[0] + 1) / 2 * picture.shape[1]
        v = (1 - along / thing.half[1]) / 2 * picture.shape[0]
        column = np.clip(u.astype(np.int64), 0, picture.shape[1] - 1)
        row = np.clip(v.astype(np.int64), 0, picture.shape[0] - 1)
        return np.asarray(picture[row, column] / 255.0)

    return gain


def _hand(thing: Printed, side: float, slope: float) -> list[Array]:
    """Thumb before the thing, fingers behind it, the palm below."""
    _, high, deep = thing.half
    low = -high
    wrist = np.array([8.0 + 26 * slope, low - 40, 4.0])
    solids = []
    for k in range(4):
        x = -13.0 + 8.4 * k
        knuckle = np.array([x + 1, low - 11 + 1.5 * abs(k - 1.3), -0.5 * deep - 3])
        behind = np.array([x, low + 16, -deep - 6])
        root = wrist + np.array([-8 + 5.5 * k, 7.0, -2.0])
        solids += _chain([root, knuckle, behind], (8.5, 5.4, 3.6), 5.0)
    ball = np.array([-9.0 + 8 * slope, low - 19, deep + 2])
    joint = np.array([-12.0, low - 3, deep + 5.5])
    tip = np.array([-7.0, low + 12.5, deep + 4.2])
    solids += _chain([wrist, ball, joint, tip], (9.0, 7.4, 4.6, 3.4), 4.0)
    arm = wrist + np.array([22 * slope, -24.0, 0.0])
    solids += _chain([wrist, arm], (10.5, 12.5), 5.0)
    return [_sided(solid, side) for solid in solids]


def _sleeve(thing: Printed, side: float, slope: float) -> list[Array]:
    start = np.array([8.0 + 40 * slope, -thing.half[1] - 56, 4.0])
    way = np.array([0.9 * slope, -1.0, 0.0])
    cuff = _chain([start, start + 7 * way], (15.5, 16.0), 0.0)
    arm = _chain([start + 4 * way, start + 60 * way, start + 200 * way], (14.5, 17.5, 25), 2.0)
    return [_sided(solid, side) for solid in (*cuff, *arm)]


def _chain(points: ArrayLike, radii: ArrayLike, blend: float) -> list[Array]:
    joints, wide = np.asarray(points, np.float64), np.asarray(radii, np.float64).tolist()
    return [
        limb(joints[k], joints[k + 1], (wide[k], wide[k + 1]), blend)
        for k in range(len(joints) - 1)
    ]


def _sided(solid: Array, side: float) -> Array:
    """The same limb of the other hand, if `side` is -1."""
    solid[[3, 6]] *= side
    return solid


def _knitted(random: np.random.Generator) -> Pattern:
    uneven = grain(random, 0.09, (1.0, 0.6, 1.0), 16)

    def gain(places: Array) -> Array:
        return np.asarray(uneven(places) * (1 + 0.06 * np.sin(1.3 * places[:, 1]))[:, None])

    return gain
