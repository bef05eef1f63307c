"""Who takes part in a scene: people in their clothes, and the ways that they go."""

from functools import lru_cache
from typing import Literal, TypeAlias

import numpy as np

from trackmark.datasets.synthetic.multipart import routes
from trackmark.datasets.synthetic.multipart.designs import TWIN_FRAMES
from trackmark.datasets.synthetic.multipart.look import Look
from trackmark.datasets.synthetic.multipart.plan import Person, Plan, body_boxes
from trackmark.datasets.synthetic.render.colours import BGR, varied
from trackmark.datasets.synthetic.render.views import Course, fixed, straight
from trackmark.datasets.synthetic.scene import part_generator

Weaves: TypeAlias = tuple[Literal["plain", "stripes", "knit"], ...]

HAIR: tuple[BGR, ...] = ((28, 30, 34), (38, 46, 62), (52, 78, 110), (108, 112, 116), (70, 128, 168))
SKIN: tuple[BGR, ...] = ((150, 176, 214), (124, 152, 198), (92, 122, 170), (56, 78, 118))
SHOES: tuple[BGR, ...] = ((36, 36, 40), (44, 58, 82), (150, 154, 160))
WEAVES: Weaves = ("plain", "plain", "knit", "stripes")


@lru_cache(maxsize=4)
def twin_plan(scene: int, distance: float, same: bool) -> Plan:
    """A target, and a second person in the same clothes or in others."""

    def generator(part: str) -> np.random.Generator:
        return part_generator(scene, f"stress/twin {part}")

    random = generator("target way")
    views = fixed(generator("camera"), TWIN_FRAMES)
    velocity = random.choice([-1, 1]) * random.uniform(0.5, 0.6), random.uniform(-0.1, 0.1)
    place = random.uniform(-0.3, 0.3), random.uniform(7.6, 8.4)
    target = straight(TWIN_FRAMES, TWIN_FRAMES // 2, place, velocity, random.uniform())
    random = generator("clothes")
    worn = two_coloured_clothes(random)
    unlike = other_clothes(random, worn)
    first = dressed(generator("target"), target, worn)
    width = body_boxes(*Plan(0, views, [first]).places[0].T)[:, 2]
    course = routes.beside_the_target(generator("twin way"), views, target, width, distance)
    # The same generator: whoever wears other clothes is the same person in all else.
    second = dressed(generator("twin"), course, worn if same else unlike)
    return Plan(seed(generator("street")), views, [first, second])


def dressed(
    random: np.random.Generator,
    course: Course,
    worn: tuple[BGR, BGR],
    jacket: bool = False,
    carries: BGR | bool | None = None,
    weaves: Weaves = WEAVES,
) -> Person:
    """Someone in an upper garment and trousers; the rest of him is drawn at random.

    `carries` is the colour of his bag, or whether he has one, of any colour.
    """
    look = Look(
        shirt=shirt_below(random, worn[0]) if jacket else worn[0],
        trousers=worn[1],
        hair=HAIR[random.integers(len(HAIR))],
        skin=SKIN[random.integers(len(SKIN))],
        shoes=SHOES[random.integers(len(SHOES))],
        jacket=worn[0] if jacket else None,
        bag=bag(random) if carries is True else carries or None,
        weave=weaves[random.integers(len(weaves))],
        long_hair=bool(random.random() < 0.4),
        hem=random.uniform(0.45, 0.49),
        bulk=random.uniform(0.92, 1.1),
        loose=random.uniform(0.92, 1.12),
    )
    return Person(look, seed(random), random.uniform(1.62, 1.88), course)


def seed(random: np.random.Generator) -> int:
    """Draw a seed of 32 bits."""
    return int(random.integers(2**32))


SHIRTS = (
    (212, 216, 220),  # white
    (150, 152, 154),  # grey
    (62, 60, 60),  # charcoal
    (86, 58, 44),  # navy
    (150, 104, 66),  # blue
    (196, 168, 132),  # light blue
    (52, 48, 158),  # red
    (54, 40, 96),  # burgundy
    (64, 104, 88),  # olive
    (70, 84, 50),  # bottle green
    (70, 152, 196),  # mustard
    (142, 172, 194),  # beige
    (66, 88, 118),  # brown
    (168, 152, 206),  # pink
    (108, 80, 100),  # plum
    (118, 106, 62),  # petrol
)
TROUSERS = (
    (120, 88, 62),  # jeans
    (82, 58, 44),  # dark jeans
    (46, 44, 44),  # black
    (112, 112, 114),  # grey
    (128, 158, 180),  # chinos
    (58, 78, 102),  # brown
    (66, 88, 84),  # olive
    (182, 190, 196),  # off-white
)
BOTH = (
    (50, 48, 48),  # black
    (76, 70, 66),  # charcoal
    (124, 124, 126),  # grey
    (86, 60, 46),  # navy
    (124, 92, 64),  # denim
    (66, 96, 88),  # olive
    (116, 150, 172),  # khaki
    (62, 82, 110),  # brown
    (58, 44, 98),  # burgundy
)
"""Colours that people wear from top to bottom (suits, overalls, tracksuits), and of bags."""

TONE = np.array([0.114, 0.587, 0.299])
"""Weights of blue, green and red in the tone (Rec. 601)."""

CLEAR_TONE = 55.0
"""Tones that differ by this much differ clearly [grey levels]."""

CLEAR_COLOUR = 28.0
"""Colours that differ by this much beside the tone differ clearly [grey levels]."""


def two_coloured_clothes(random: np.random.Generator) -> tuple[BGR, BGR]:
    """Shirt and trousers at random that differ clearly, in colour and in tone."""
    pairs = [
        (shirt, trousers) for shirt in SHIRTS for trousers in TROUSERS if _clear(shirt, trousers)
    ]
    shirt, trousers = pairs[random.integers(len(pairs))]
    return dyed(random, shirt, spread=0.04), dyed(random, trousers, spread=0.04)


def shirt_below(random: np.random.Generator, jacket: BGR) -> BGR:
    """Shirt of clearly another tone than the open jacket over it."""
    others = tuple(
        shirt for shirt in SHIRTS if abs(np.subtract(shirt, jacket) @ TONE) >= CLEAR_TONE
    )
    return dyed(random, _one(random, others), spread=0.04)


def bag(random: np.random.Generator) -> BGR:
    """Bag in a colour that hides the dirt."""
    return dyed(random, _one(random, BOTH))


def other_clothes(random: np.random.Generator, first: tuple[BGR, BGR]) -> tuple[BGR, BGR]:
    """Shirt and trousers of clearly other colours than another person's shirt and trousers."""

    def unlike(colour: BGR) -> float:
        return -min(float(np.abs(np.subtract(colour, worn)).max()) for worn in first)

    shirt, trousers = (
        _one(random, tuple(sorted(colours, key=unlike)[: len(colours) // 4]))
        for colours in (SHIRTS, TROUSERS)
    )
    return dyed(random, shirt), dyed(random, trousers)


def _clear(shirt: BGR, trousers: BGR) -> bool:
    difference = np.subtract(shirt, trousers, dtype=np.float64)
    tone = float(difference @ TONE)
    colour = np.abs(difference - tone).max()
    return bool(abs(tone) >= CLEAR_TONE and colour >= CLEAR_COLOUR)


def _one(random: np.random.Generator, colours: tuple[BGR, ...]) -> BGR:
    return colours[random.integers(len(colours))]


def dyed(random: np.random.Generator, colour: BGR, spread: float = 0.08) -> BGR:
    """Colour as another garment has it, in whole grey levels."""
    blue, green, red = np.round(varied(random, colour, spread)).astype(int).tolist()
    return blue, green, red
