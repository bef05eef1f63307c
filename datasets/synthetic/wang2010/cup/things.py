"""Things of the kitchen: wall and counter, a few things, those of the cup's colour, the held cup.

The cup's foot stands at the origin.
"""

import numpy as np

from trackmark.datasets.synthetic.render.colours import (
    ACCENTS,
    CLOTHES,
    COUNTERS,
    NEUTRALS,
    STEELS,
    Array,
    any_but,
    nearly,
)
from trackmark.datasets.synthetic.render.figure.look import drawn_skin
from trackmark.datasets.synthetic.render.finish import Finish, Pattern, Thing, grain, plain, tiles
from trackmark.datasets.synthetic.render.solids import bowl, box, chain, half_space, limb, mirrored
from trackmark.datasets.synthetic.wang2010.cup.plan import SIZE, WALL, Cup, Plan

BOX_DEPTH = 20.0
"""How far before the cup's way the box stands [pixels]."""


def bare_room(random: np.random.Generator, cup: Array, tiled: bool) -> list[Thing]:
    """Wall and counter."""
    wood = any_but(random, COUNTERS, cup)
    wall = any_but(random, NEUTRALS, cup)
    pattern = grain(random, 0.018)
    if tiled:
        size = random.uniform(10, 15)
        pattern = tiles(random, size * random.choice([1.0, 1.8]), size, np.full(3, 0.88))
    ground = grain(random, 0.09, (0.12, 1.0, 1.4), 16)
    return [
        Thing(Finish(wall, 0.02, pattern), [half_space((0, 0, 1), WALL)]),
        Thing(Finish(wood, 0.03, ground), [half_space((0, 1, 0), 0)]),
    ]


def similar_things(plan: Plan, random: np.random.Generator, cup: Array) -> list[Thing]:
    """A cutting board at the wall, or a cloth on its rail, of nearly the cup's colour.

    The first thing is of that colour.
    """
    left, right = (border - SIZE[0] / 2 for border in plan.behind)
    middle, half = (left + right) / 2, (right - left) / 2
    colour = nearly(random, cup)
    top = _height(plan, random.uniform(13, 19), WALL + 3)
    if random.random() < 0.5:
        board = box((middle, top / 2, WALL + 3.2), (half, top / 2, 1.1), 1.0, lean=0.08)
        return [Thing(Finish(colour, 0.06, grain(random, 0.02)), [board])]
    hem = random.uniform(1.5, 4.0)
    folds = random.uniform(0.35, 0.7), random.uniform(0.45, 0.7)
    size = half, (top - hem) / 2, 1.0
    cloth = box((middle, (top + hem) / 2, WALL + 3.4), size, 0.9, folds=folds)
    ends = [np.array([middle + side * (half + 2.5), top - 0.8, WALL + 3.4]) for side in (-1, 1)]
    bolts = [limb(end, (end[0], end[1], WALL), (0.7, 0.7)) for end in ends]
    return [
        Thing(Finish(colour, 0.0, grain(random, 0.04, coarsest=32)), [cloth]),
        Thing(
            Finish(any_but(random, STEELS, cup), 0.5), [limb(ends[0], ends[1], (0.7, 0.7)), *bolts]
        ),
    ]


def carton(plan: Plan, random: np.random.Generator, cup: Array) -> Thing:
    """A box with a lid on the counter, before the cup's way, of nearly the cup's colour."""
    place, half = plan.before
    turn = random.uniform(-0.4, 0.4)
    deep = random.uniform(5.0, 7.0)
    wide = (half - deep * abs(np.sin(turn))) / np.cos(turn)
    upper = plan.low - plan.hidden  # where the rear edge of its top is to be seen
    height = _height(plan, upper, BOX_DEPTH - deep)
    lid, x = random.uniform(0.16, 0.3) * height, place - SIZE[0] / 2
    body = box((x, height / 2, BOX_DEPTH), (wide - 0.6, height / 2, deep - 0.6), 0.5, turn=turn)
    cover = box((x, height - lid / 2, BOX_DEPTH), (wide, lid / 2, deep), 0.5, turn=turn)
    return Thing(Finish(nearly(random, cup), 0.05, grain(random, 0.02)), [body, cover])


def _height(plan: Plan, row: float, z: float) -> float:
    """Height above the counter at which a point is seen in a row of the picture [pixels]."""
    view = plan.view
    below = row - plan.horizon + float(view.row(0.0, WALL))
    return float((z * np.sin(view.pitch) - below) / np.cos(view.pitch))


def stores(plan: Plan, random: np.random.Generator, cup: Array) -> list[Thing]:
    """Jars, bottles, bowls on either side of the similar thing, none of the cup's colour."""
    left, right = (border - SIZE[0] / 2 for border in plan.behind)
    kinds = [_jar, _bottle, _fruit, _holder]
    order = random.permutation(len(kinds)).tolist()
    things: list[Thing] = []
    for start, end in ((-SIZE[0] / 2 - 4, left - 2), (right + 2, SIZE[0] / 2 + 4)):
        x = start + random.uniform(0, 5)
        while order and x + 8 < end:
            wide = random.uniform(4.5, 7.0)
            z = WALL + wide + random.uniform(2, 7)
            if x + 2 * wide > end:
                break
            things += kinds[order.pop()](random, cup, x + wide, z, wide)
            x += 2 * wide + random.uniform(1.5, 9)
    return things


def _jar(random: np.random.Generator, cup: Array, x: float, z: float, wide: float) -> list[Thing]:
    high = random.uniform(14, 20)
    glaze, lid = any_but(random, ACCENTS, cup), any_but(random, (*NEUTRALS, *COUNTERS), cup)
    body = bowl((x, 0.5, z), high, (wide * 0.92, wide), 1.0, closed=True)
    cap = bowl((x, high + 0.6, z), 2.0, (wide * 1.02, wide * 1.02), 1.2, closed=True)
    return [
        Thing(Finish(glaze, 0.3, _label(random, x, z, high, wide)), [body]),
        Thing(Finish(lid, 0.05), [cap]),
    ]


def _label(random: np.random.Generator, x: float, z: float, high: float, wide: float) -> Pattern:
    low, up = 0.3 * high, random.uniform(0.5, 0.7) * high
    half = random.uniform(0.5, 0.8) * wide

    def gain(places: Array) -> Array:
        on = (places[:, 1] > low) & (places[:, 1] < up) & (np.abs(places[:, 0] - x) < half)
        ink = 0.6 + 0.4 * (np.sin(places[:, 1] * 3.0) < 0.4)
        return np.where(on, 1.35 * ink, 1.0)[:, None]

    return gain if random.random() < 0.6 else plain


def _bottle(
    random: np.random.Generator, cup: Array, x: float, z: float, wide: float
) -> list[Thing]:
    slim, high = 0.62 * wide, random.uniform(19, 25)
    glass = any_but(random, ((40, 66, 52), (34, 60, 96), (52, 50, 48), (60, 150, 176)), cup)
    body = bowl((x, 0.4, z), high, (slim, slim), 0.8, closed=True)
    neck = limb((x, high + 0.3, z), (x, high + 7, z), (slim * 0.72, slim * 0.34))
    cap = limb((x, high + 7.5, z), (x, high + 9.5, z), (slim * 0.42, slim * 0.42))
    paper = any_but(random, NEUTRALS, cup)
    label = bowl((x, 0.35 * high, z), 0.35 * high, (slim + 0.1, slim + 0.1), 0.8, closed=True)
    return [
        Thing(Finish(glass, 0.5), [body, neck]),
        Thing(Finish(any_but(random, ACCENTS, cup), 0.1), [cap]),
        Thing(Finish(paper, 0.02, grain(random, 0.06, (1, 2, 0.2), 32)), [label]),
    ]


def _fruit(random: np.random.Generator, cup: Array, x: float, z: float, wide: float) -> list[Thing]:
    dish = bowl((x, 0.6, z), 5.5, (0.5 * wide, 1.05 * wide), 0.9)
    kind = any_but(random, ((40, 110, 214), (48, 190, 222), (40, 46, 176), (70, 160, 140)), cup)
    places = ((-0.5, 5.4, 0.1), (0.45, 5.3, 0.2), (0.0, 5.2, -0.5), (0.0, 8.2, 0.0))
    fruits = []
    for u, y, w in places:
        at = np.array([x + u * wide, y, z + w * wide])
        fruits.append(limb(at, at + np.array([0.3, 0.2, 0.0]), (0.42 * wide, 0.42 * wide)))
    return [
        Thing(Finish(any_but(random, NEUTRALS, cup), 0.2), [dish]),
        Thing(Finish(kind, 0.12, grain(random, 0.05)), fruits),
    ]


def _holder(
    random: np.random.Generator, cup: Array, x: float, z: float, wide: float
) -> list[Thing]:
    high = random.uniform(10, 13)
    pot = bowl((x, 0.5, z), high, (0.72 * wide, 0.8 * wide), 1.0)
    spoons, spatulas = [], []
    for k in range(4):
        lean = random.uniform(-0.22, 0.22)
        foot = np.array([x + (k - 1.5) * 0.3 * wide, 2.0, z + random.uniform(-0.2, 0.3) * wide])
        tip = foot + random.uniform(18, 23) * np.array([lean, 1.0, -0.05])
        stick = limb(foot, tip, (0.6, 0.6))
        if k % 2:
            spoons += [stick, limb(tip, tip + np.array([lean, 2.5, 0.0]), (1.7, 1.2), 0.6)]
        else:
            spatulas += [stick, box(tip, (1.5, 2.6, 0.5), 0.4)]
    wood, dark = any_but(random, COUNTERS[:3], cup), any_but(random, ACCENTS[5:], cup)
    return [
        Thing(Finish(any_but(random, ACCENTS, cup), 0.25), [pot]),
        Thing(Finish(wood, 0.02), spoons),
        Thing(Finish(dark, 0.05), spatulas),
    ]


THICK = 1.1
"""Of the cup [pixels]."""


def held_cup(cup: Cup, colour: Array, random: np.random.Generator) -> list[Thing]:
    """The cup, the hand that holds it, its sleeve; `colour` is the cup's, BGR in [0, 255]."""
    skin = drawn_skin(random)
    cloth = any_but(random, CLOTHES, colour)
    slope = random.uniform(-0.34, 0.02)
    grip = random.uniform(0.46, 0.54) * cup.height
    return [
        Thing(Finish(colour, 0.08), _cup(cup)),
        Thing(Finish(skin, 0.04, grain(random, 0.03)), _hand(cup, grip, slope)),
        Thing(Finish(cloth, 0.0, _knitted(random, slope)), _sleeve(cup, grip, slope)),
    ]


def _cup(cup: Cup) -> list[Array]:
    body = bowl((0, THICK / 2, 0), cup.height - THICK, (cup.foot, cup.rim), THICK)
    angles = np.linspace(-1.5, 1.5, 10)
    height = 0.52 * cup.height + 0.31 * cup.height * np.sin(angles)
    wall = cup.foot + (cup.rim - cup.foot) * height / cup.height
    out = wall + (cup.handle - 1.1) * np.cos(angles) ** 0.7
    turn = 0.3  # towards the camera
    arc = np.stack([-cup.hand * out * np.cos(turn), height, out * np.sin(turn)], axis=1)
    return [body, *chain(arc, np.full(10, 1.1), 0.0)]


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
        solids += chain([root, knuckle, around, tip], (2.6, radius, radius, radius - 0.3), 1.2)
    ball = np.array([beside + 6.0, grip + 0.2 + 4.0 * slope, 3.6])
    joint = np.array([0.80 * beside, grip + 1.6, 0.72 * beside + 1.6])
    tip = np.array([0.10 * beside, grip + 2.6, beside + 1.2])
    solids += chain([wrist, ball, joint, tip], (3.2, 2.7, 1.9, 1.45), 1.6)
    arm = wrist + np.array([9.0, 9.0 * slope, 1.0])
    solids += chain([wrist, arm], (3.8, 4.6), 2.0)
    return mirrored(solids, cup.hand)


def _sleeve(cup: Cup, grip: float, slope: float) -> list[Array]:
    start = np.array([cup.rim + 20.5, grip + 20.5 * slope, 3.0])
    way = np.array([1.0, slope, 0.10])
    cuff = chain([start, start + 2.6 * way], (5.4, 5.5), 0.0)
    arm = chain([start + 1.5 * way, start + 30 * way, start + 110 * way], (5.0, 6.6, 9.5), 1.0)
    return mirrored([*cuff, *arm], cup.hand)


def _knitted(random: np.random.Generator, slope: float) -> Pattern:
    uneven = grain(random, 0.08, (0.6, 1.0, 1.0), 16)

    def gain(places: Array) -> Array:
        along = places[:, 0] + slope * places[:, 1]
        return np.asarray(uneven(places) * (1 + 0.03 * np.sin(2.4 * along))[:, None])

    return gain
