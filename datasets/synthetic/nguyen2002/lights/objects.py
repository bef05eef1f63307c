"""Moving objects: a printed object, the hand that holds it, and the occluders.

The origin of each object is its centre. Occluders are taller than the image.
"""

import numpy as np
from numpy.random import Generator

from trackmark.datasets.interface import Array, Image
from trackmark.datasets.synthetic.render.colours import (
    ACCENTS,
    CLOTHES,
    COUNTERS,
    NEUTRALS,
    sample_similar,
)
from trackmark.datasets.synthetic.render.figure.look import sample_skin
from trackmark.datasets.synthetic.render.finish import (
    Finish,
    Pattern,
    SceneObject,
    grain,
    picture_on,
    staggered,
)
from trackmark.datasets.synthetic.render.prints import KINDS, print_picture
from trackmark.datasets.synthetic.render.solids import box, chain, limb, mirror_limbs
from trackmark.datasets.synthetic.render.texture import fractal

HALF_WIDTH, HALF_HEIGHT = 108, 130  # half size of a window that contains any occluder [pixels]
LENGTH = 175.0  # half height of an occluder, whose ends are outside the image [pixels]
PRINT_FINE = 6  # resolution of the print [dots/pixel]
SATURATION = 0.5  # saturation of the faded print relative to fresh ink
DEPTHS = {"book": 5.0, "tea": 11.0, "toy": 13.0}  # half the thickness by kind of object [pixels]


def held_objects(random: Generator) -> list[SceneObject]:
    """Return a printed object that leans back slightly, the hand that holds it, and a sleeve."""
    kind = KINDS[int(random.integers(len(KINDS)))]
    wide = random.uniform(28, 31)
    half = np.array([wide, wide * random.uniform(1.28, 1.36), DEPTHS[kind]])
    lean = random.uniform(0.06, 0.2)
    width, height = (round(2 * PRINT_FINE * side) for side in half[:2])
    face = picture_on(
        _faded(print_picture(random, kind, width, height)), (0.0, 0.0), half[:2], lean
    )
    skin, cloth = sample_skin(random), sample_similar(random, CLOTHES, 0.06)
    side, slope = float(random.choice([-1, 1])), random.uniform(-0.1, 0.4)
    solid = box(np.zeros(3), half, 0.8, lean=-lean)
    return [
        SceneObject(Finish(np.full(3, 255.0), 0.05, face), [solid]),
        SceneObject(Finish(skin, 0.03, grain(random, 0.035)), _hand(half, side, slope)),
        SceneObject(Finish(cloth, 0.0, _knitted(random)), _sleeve(half[1], side, slope)),
    ]


def _faded(picture: Image) -> Image:
    grey = picture.mean(axis=2, keepdims=True)
    return np.asarray(grey + SATURATION * (picture - grey), np.uint8)


def _hand(half: Array, side: float, slope: float) -> list[Array]:
    """Return the thumb in front of an object, the fingers behind it, and the palm below it."""
    _, high, deep = half
    low = -high
    wrist = np.array([8.0 + 26 * slope, low - 40, 4.0])
    solids = []
    for k in range(4):
        x = -13.0 + 8.4 * k
        knuckle = np.array([x + 1, low - 11 + 1.5 * abs(k - 1.3), -0.5 * deep - 3])
        behind = np.array([x, low + 16, -deep - 6])
        root = wrist + np.array([-8 + 5.5 * k, 7.0, -2.0])
        solids += chain([root, knuckle, behind], (8.5, 5.4, 3.6), 5.0)
    ball = np.array([-9.0 + 8 * slope, low - 19, deep + 2])
    joint = np.array([-12.0, low - 3, deep + 5.5])
    tip = np.array([-7.0, low + 12.5, deep + 4.2])
    solids += chain([wrist, ball, joint, tip], (9.0, 7.4, 4.6, 3.4), 4.0)
    arm = wrist + np.array([22 * slope, -24.0, 0.0])
    solids += chain([wrist, arm], (10.5, 12.5), 5.0)
    return mirror_limbs(solids, side)


def _sleeve(high: float, side: float, slope: float) -> list[Array]:
    start = np.array([8.0 + 40 * slope, -high - 56, 4.0])
    direction = np.array([0.9 * slope, -1.0, 0.0])
    cuff = chain([start, start + 7 * direction], (15.5, 16.0), 0.0)
    arm = chain(
        [start + 4 * direction, start + 60 * direction, start + 200 * direction],
        (14.5, 17.5, 25),
        2.0,
    )
    return mirror_limbs([*cuff, *arm], side)


def _knitted(random: Generator) -> Pattern:
    uneven = grain(random, 0.09, (1.0, 0.6, 1.0), 16)

    def gain(places: Array) -> Array:
        return np.asarray(uneven(places) * (1 + 0.06 * np.sin(1.3 * places[:, 1]))[:, None])

    return gain


def occluder_objects(kind: str, random: Generator) -> list[SceneObject]:
    """Return an occluder of a kind: `board`, `door`, `cloth` or `back`."""
    makers = {"board": _board, "door": _door, "cloth": _cloth, "back": _back}
    return makers[kind](random)


def _sample_colour(random: Generator, colours: tuple[tuple[int, int, int], ...]) -> Array:
    return sample_similar(random, colours, 0.08)


def _board(random: Generator) -> list[SceneObject]:
    half = random.uniform(56, 62)
    wood = _sample_colour(random, COUNTERS[:3])
    things = [
        SceneObject(
            Finish(wood * random.uniform(0.86, 1.1), 0.03, _wooden(random)),
            [box((x, 0, 0), (half / 3 - 0.4, LENGTH, 4), 1.0)],
        )
        for x in (-2 * half / 3, 0, 2 * half / 3)
    ]
    things.append(SceneObject(Finish(wood * 0.4), [box((0, 0, -3), (half - 2, LENGTH, 1.5), 0.5)]))
    battens = [box((0, y, 7), (half - 6, 11, 4), 1.0) for y in (random.uniform(40, 80), -70.0)]
    nails = [
        limb((x, y, 10.5), (x, y, 11), (1.6, 1.6))
        for y in (battens[0][4], battens[1][4])
        for x in (-2 * half / 3, 0.0, 2 * half / 3)
    ]
    return [
        *things,
        SceneObject(Finish(wood * 0.8, 0.03, _wooden(random, along=0)), battens),
        SceneObject(Finish((150, 152, 154), 0.4), nails),
    ]


def _wooden(random: Generator, along: int = 1) -> Pattern:
    warp = fractal(random, 256, 2, 16)
    fine = fractal(random, 256, 16, 128, 0.8)
    shift, pace = random.uniform(0, 256), random.uniform(0.35, 0.55)

    def gain(places: Array) -> Array:
        length, across = places[:, along], places[:, 1 - along]
        row = np.round(0.35 * length + shift).astype(np.int64) % 256
        column = np.round(2 * across).astype(np.int64) % 256
        rings = np.sin(pace * across * (1 + 0.15 * np.sin(0.01 * length)) + 5 * warp[row, column])
        return np.asarray(1 + 0.13 * rings + 0.08 * fine[row // 2, column])[:, None]

    return gain


def _door(random: Generator) -> list[SceneObject]:
    half = random.uniform(58, 66)
    colour = _sample_colour(random, (*ACCENTS[:5], *NEUTRALS[2:]))
    paint, panel = grain(random, 0.03), grain(random, 0.03)
    stile = 13.0
    rails = [box((side * (half - stile), 0, 2), (stile, LENGTH, 6), 1.4) for side in (-1, 1)]
    rails += [
        box((0, y, 2), (half - stile, 11, 6), 1.4) for y in (-115, random.uniform(-20, 20), 115)
    ]
    fields = [box((0, 0, 0), (half - 4, LENGTH, 3), 1.0)]
    raised = [box((0, y, 1), (half - 2.6 * stile, 38, 4.5), 3.0) for y in (-62, 66)]
    x = float(random.choice([-1, 1])) * (half - stile)
    knob = [limb((x, 20, 8), (x, 20, 17), (3, 5.5), 2.0)]
    return [
        SceneObject(Finish(colour, 0.10, paint), rails),
        SceneObject(Finish(colour * 0.86, 0.08, panel), [*fields, *raised]),
        SceneObject(Finish((120, 160, 178), 0.5), knob),
    ]


def _cloth(random: Generator) -> list[SceneObject]:
    half = random.uniform(60, 68)
    folds = random.uniform(3.0, 4.2), random.uniform(0.17, 0.24)
    ground, ink = _sample_colour(random, (*CLOTHES, *NEUTRALS)), _sample_colour(random, ACCENTS[:5])
    pattern = _dotted(random, ink / ground)
    return [
        SceneObject(
            Finish(ground, 0.0, pattern), [box((0, 0, 0), (half, LENGTH, 5), 2, folds=folds)]
        )
    ]


def _dotted(random: Generator, ink: Array) -> Pattern:
    """Return a pattern of flowers or dots; every other row is shifted by half the spacing."""
    pitch, petals = random.uniform(17, 24), int(random.choice([0, 5, 6]))
    weave = grain(random, 0.05, coarsest=32)
    second = 0.5 + 0.5 * ink[::-1]

    def gain(places: Array) -> Array:
        x, y = staggered(places, pitch)
        radius = np.sqrt(x * x + y * y)
        edge = 0.30 + 0.08 * np.cos(petals * np.arctan2(y, x)) * (petals > 0)
        colour = np.where((radius < edge)[:, None], ink, 1.0)
        colour = np.where((radius < 0.11)[:, None], second, colour)
        return np.asarray(colour * weave(places))

    return gain


def _back(random: Generator) -> list[SceneObject]:
    shirt, trousers = (
        _sample_colour(random, (*CLOTHES, *ACCENTS[:5])),
        _sample_colour(random, CLOTHES[:2]),
    )
    checks = _checked(random) if random.random() < 0.6 else grain(random, 0.06)
    wide = random.uniform(52, 58)
    hem = random.uniform(-96, -84)
    thick = 0.6 * wide, 0.56 * wide
    torso = [
        limb((side * 0.42 * wide, 150, 0), (side * 0.36 * wide, hem, 4), thick, 12)
        for side in (-1, 1)
    ]
    spine = [limb((0, 150, 22), (0, hem + 6, 26), (13, 12), 14.0)]
    arms = [
        limb((side * (wide + 6), 120, 0), (side * (wide + 19), hand, 4), (20, 15), 6)
        for side, hand in ((side, random.uniform(-30, 0)) for side in (-1, 1))
    ]
    arms += [limb(arm[6:9], arm[6:9] + np.array([0.0, -95.0, 22.0]), (15, 11), 6) for arm in arms]
    hips = [
        limb((side * 0.4 * wide, hem - 6, 2), (side * 0.44 * wide, -200, 2), (0.56 * wide,) * 2, 8)
        for side in (-1, 1)
    ]
    return [
        SceneObject(Finish(shirt, 0.0, checks), [*torso, *spine, *arms]),
        SceneObject(Finish(trousers, 0.0, grain(random, 0.06, coarsest=32)), hips),
    ]


def _checked(random: Generator) -> Pattern:
    pitch, share = random.uniform(13, 20), random.uniform(0.3, 0.5)
    bar_gain, line_gain = random.uniform(0.55, 0.9, 3), random.uniform(0.6, 1.2, 3)
    weave = grain(random, 0.05, coarsest=32)

    def gain(places: Array) -> Array:
        bars = [places[:, axis] / pitch - np.floor(places[:, axis] / pitch) for axis in (0, 1)]
        colour = np.where((bars[0] < share)[:, None], bar_gain, 1.0)
        colour = colour * np.where((bars[1] < share)[:, None], bar_gain, 1.0)
        thin = (np.abs(bars[0] - 0.75) < 0.05) | (np.abs(bars[1] - 0.75) < 0.05)
        return np.asarray(np.where(thin[:, None], line_gain * colour, colour) * weave(places))

    return gain
