"""A cup in a hand: what moves. The cup's foot stands at the origin."""

import numpy as np
from numpy.typing import ArrayLike

from datasets.synthetic.render.colours import CLOTHES, Array, any_but
from datasets.synthetic.render.figure.look import COMPLEXIONS
from datasets.synthetic.render.finish import Finish, Pattern, Thing, grain
from datasets.synthetic.render.solids import bowl, limb
from datasets.synthetic.render.texture import lerp
from datasets.synthetic.wang2010.cup.plan import Cup

__all__ = ["held_cup"]

WALL = 1.1
"""Of the cup [pixels]."""


def held_cup(cup: Cup, colour: Array, random: np.random.Generator) -> list[Thing]:
    """The cup, the hand that holds it, its sleeve.

    Parameters
    ----------
    cup : Cup
    colour : ndarray of float64, shape (3,)
        Of the cup: BGR in [0, 255].
    random : numpy.random.Generator
        Draws the hand and its sleeve.
    """
    skin = np.asarray(COMPLEXIONS[random.integers(len(COMPLEXIONS))][0], np.float64)
    cloth = any_but(random, CLOTHES, colour)
    slope = random.uniform(-0.34, 0.02)
    grip = random.uniform(0.46, 0.54) * cup.height
    inside = any_but(random, ((212, 222, 226),), colour) if random.random() < 0.4 else colour
    return [
        Thing(Finish(colour, 0.4, _glaze(cup, inside / colour)), _cup(cup)),
        Thing(Finish(skin, 0.04, grain(random, 0.03)), _hand(cup, grip, slope)),
        Thing(Finish(cloth, 0.0, _knitted(random, slope)), _sleeve(cup, grip, slope)),
    ]


def _cup(cup: Cup) -> list[Array]:
    body = bowl((0, WALL / 2, 0), cup.height - WALL, (cup.foot, cup.rim), WALL)
    angles = np.linspace(-1.5, 1.5, 10)
    height = 0.52 * cup.height + 0.31 * cup.height * np.sin(angles)
    wall = cup.foot + (cup.rim - cup.foot) * height / cup.height
    out = wall + (cup.handle - 1.1) * np.cos(angles) ** 0.7
    turn = 0.3  # towards the camera
    arc = np.stack([-cup.hand * out * np.cos(turn), height, out * np.sin(turn)], axis=1)
    return [body, *_chain(arc, np.full(10, 1.1), 0.0)]


def _hand(cup: Cup, grip: float, slope: float) -> list[Array]:
    """Thumb before the cup, fingers behind it, knuckles and palm beside it."""
    beside = cup.rim
    wrist = np.array([beside + 14.5, grip + 14.5 * slope, 2.5])
    knuckles = [np.array([beside + 3.4 - 0.3 * k * k, grip + 5.2 - 3.1 * k, 0.4]) for k in range(4)]
    solids = []
    for k, knuckle in enumerate(knuckles):
        radius = (1.75, 1.8, 1.7, 1.5)[k]
        root = wrist + np.array([-1.0, 2.4 - 1.6 * k, -0.6])
        around = np.array([0.55 * beside, knuckle[1] - 0.3, -beside - 1.6])
        tip = np.array([-0.55 * beside, knuckle[1] - 0.9, -beside - 0.9])
        solids += _chain([root, knuckle, around, tip], (2.6, radius, radius, radius - 0.3), 1.2)
    ball = np.array([beside + 6.0, grip + 0.2 + 4.0 * slope, 3.6])
    joint = np.array([0.80 * beside, grip + 1.6, 0.72 * beside + 1.6])
    tip = np.array([0.10 * beside, grip + 2.6, beside + 1.2])
    solids += _chain([wrist, ball, joint, tip], (3.2, 2.7, 1.9, 1.45), 1.6)
    arm = wrist + np.array([9.0, 9.0 * slope, 1.0])
    solids += _chain([wrist, arm], (3.8, 4.6), 2.0)
    return [_sided(solid, cup.hand) for solid in solids]


def _sleeve(cup: Cup, grip: float, slope: float) -> list[Array]:
    start = np.array([cup.rim + 20.5, grip + 20.5 * slope, 3.0])
    way = np.array([1.0, slope, 0.10])
    cuff = _chain([start, start + 2.6 * way], (5.4, 5.5), 0.0)
    arm = _chain([start + 1.5 * way, start + 30 * way, start + 110 * way], (5.0, 6.6, 9.5), 1.0)
    return [_sided(solid, cup.hand) for solid in (*cuff, *arm)]


def _chain(points: ArrayLike, radii: ArrayLike, blend: float) -> list[Array]:
    joints, wide = np.asarray(points, np.float64), np.asarray(radii, np.float64).tolist()
    return [
        limb(joints[k], joints[k + 1], (wide[k], wide[k + 1]), blend)
        for k in range(len(joints) - 1)
    ]


def _sided(solid: Array, side: int) -> Array:
    """The same limb on the other side of the cup, if `side` is -1."""
    solid[[3, 6]] *= side
    return solid


def _glaze(cup: Cup, inner: Array) -> Pattern:
    def gain(places: Array) -> Array:
        x, y, z = places.T
        radius = cup.foot + (cup.rim - cup.foot) * y / cup.height
        within = np.clip(radius - np.sqrt(x * x + z * z) - 0.1, 0, 0.2) * 5 * (y > 1.2)
        return lerp(np.ones((len(places), 3)), inner, within)

    return gain


def _knitted(random: np.random.Generator, slope: float) -> Pattern:
    uneven = grain(random, 0.08, (0.6, 1.0, 1.0), 16)

    def gain(places: Array) -> Array:
        along = places[:, 0] + slope * places[:, 1]
        return np.asarray(uneven(places) * (1 + 0.03 * np.sin(2.4 * along))[:, None])

    return gain
