"""Clothes and other properties of people, and the plan of `stress/twin`.

Houses and roads are grey and brown, and targets wear saturated clothes. The clothes of all other
people do not depend on those of the target. Exceptions are the person in the target's clothes who
crosses in `multipart/7`, the variant `others=exchanged`, and `stress/twin`.
"""

from dataclasses import replace
from functools import lru_cache
from typing import Literal, TypeAlias

import cv2
import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from trackmark.datasets.synthetic.multipart import routes
from trackmark.datasets.synthetic.multipart.designs import TWIN_FRAMES
from trackmark.datasets.synthetic.multipart.plan import Person, WalkPlan, body_boxes
from trackmark.datasets.synthetic.multipart.walker import WalkerLook
from trackmark.datasets.synthetic.render.colours import BGR, vary_colour
from trackmark.datasets.synthetic.render.views import WalkingPath, sample_fixed_views, straight_path
from trackmark.datasets.synthetic.scene import part_generator

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
SATURATED: tuple[BGR, ...] = (
    (40, 36, 200),  # red
    (60, 30, 170),  # crimson
    (190, 90, 30),  # blue
    (170, 60, 40),  # royal blue
    (40, 200, 230),  # yellow
    (30, 110, 230),  # orange
    (150, 50, 110),  # purple
    (140, 50, 200),  # magenta
)

DIFFERENT_HALVES = 90.0, 25.0
"""Minimum differences of shirt and trousers in chromaticity and in L* [CIE L*u*v*].
"""

# colours of one-coloured clothes (suits, overalls, tracksuits) and of bags
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

TONE = np.array([0.114, 0.587, 0.299])  # weights of blue, green and red in the tone (Rec. 601)

# two tones differ clearly if their difference is at least this large [grey levels]
CLEAR_TONE = 55.0

# two colours differ clearly if they differ by this much apart from the tone [grey levels]
CLEAR_COLOUR = 28.0


def sample_plain_clothes(random: Generator) -> tuple[BGR, BGR]:
    """Sample shirt and trousers of nearly the same saturated colour."""
    cloth = vary_dye(random, SATURATED[random.integers(len(SATURATED))], 0.04)
    return cloth, vary_dye(random, cloth, 0.03)


def sample_two_coloured_clothes(random: Generator) -> tuple[BGR, BGR]:
    """Sample shirt and trousers of two clearly different saturated colours."""
    pairs = [
        (shirt, trousers)
        for shirt in SATURATED
        for trousers in SATURATED
        if _differ(shirt, trousers)
    ]
    shirt, trousers = pairs[random.integers(len(pairs))]
    return vary_dye(random, shirt, 0.04), vary_dye(random, trousers, 0.04)


def sample_wardrobe_clothes(random: Generator) -> tuple[BGR, BGR]:
    """Sample shirt and trousers of a passer-by from the whole wardrobe."""
    shirt, trousers = SHIRTS[random.integers(len(SHIRTS))], TROUSERS[random.integers(len(TROUSERS))]
    return vary_dye(random, shirt), vary_dye(random, trousers)


def exchange_colours(look: WalkerLook) -> WalkerLook:
    """Return clothes of equal cut with the colours of upper garment and trousers exchanged."""
    upper = look.jacket or look.shirt
    return replace(look, shirt=look.trousers, trousers=upper, jacket=None, bag=None)


def _differ(first: BGR, second: BGR) -> bool:
    chroma, lightness = DIFFERENT_HALVES
    differs_in_lightness = abs(float(_luv(first)[0] - _luv(second)[0])) >= lightness
    return differs_in_lightness and chroma_distance(first, second) >= chroma


def chroma_distance(first: BGR, second: BGR) -> float:
    """Return the distance between two colours in CIE u* and v*."""
    difference = _luv(first)[1:] - _luv(second)[1:]
    return float(np.hypot(*difference))


def _luv(colour: BGR) -> NDArray[np.float32]:
    pixel = np.array([[colour]], np.float32) / 255
    return np.asarray(cv2.cvtColor(pixel, cv2.COLOR_BGR2Luv)[0, 0], np.float32)


def scale_brightness(colour: BGR, gain: float) -> BGR:
    """Return a darker or lighter colour of equal chromaticity."""
    blue, green, red = np.clip(np.round(np.multiply(colour, gain)), 0, 255).astype(int).tolist()
    return blue, green, red


def sample_street_clothes(random: Generator) -> tuple[BGR, BGR]:
    """Sample shirt and trousers that differ clearly in colour and in tone."""
    pairs = [
        (shirt, trousers) for shirt in SHIRTS for trousers in TROUSERS if _clear(shirt, trousers)
    ]
    shirt, trousers = pairs[random.integers(len(pairs))]
    return vary_dye(random, shirt, spread=0.04), vary_dye(random, trousers, spread=0.04)


def sample_bag(random: Generator) -> BGR:
    """Sample the colour of a bag."""
    return vary_dye(random, _choose(random, BOTH))


def sample_other_clothes(random: Generator, first: tuple[BGR, BGR]) -> tuple[BGR, BGR]:
    """Sample shirt and trousers in colours that differ clearly from another person's clothes."""

    def unlike(colour: BGR) -> float:
        return -min(float(np.abs(np.subtract(colour, worn)).max()) for worn in first)

    shirt, trousers = (
        _choose(random, tuple(sorted(colours, key=unlike)[: len(colours) // 4]))
        for colours in (SHIRTS, TROUSERS)
    )
    return vary_dye(random, shirt), vary_dye(random, trousers)


def _clear(shirt: BGR, trousers: BGR) -> bool:
    difference = np.subtract(shirt, trousers, dtype=np.float64)
    tone = float(difference @ TONE)
    colour = np.abs(difference - tone).max()
    return bool(abs(tone) >= CLEAR_TONE and colour >= CLEAR_COLOUR)


def _choose(random: Generator, colours: tuple[BGR, ...]) -> BGR:
    return colours[random.integers(len(colours))]


def vary_dye(random: Generator, colour: BGR, spread: float = 0.08) -> BGR:
    """Return a random variation of a colour, in whole grey levels."""
    blue, green, red = np.round(vary_colour(random, colour, spread)).astype(int).tolist()
    return blue, green, red


Weaves: TypeAlias = tuple[Literal["plain", "stripes", "knit"], ...]

HAIR: tuple[BGR, ...] = ((28, 30, 34), (38, 46, 62), (52, 78, 110), (108, 112, 116), (70, 128, 168))
SKIN: tuple[BGR, ...] = ((150, 176, 214), (124, 152, 198), (92, 122, 170), (56, 78, 118))
SHOES: tuple[BGR, ...] = ((36, 36, 40), (44, 58, 82), (150, 154, 160))
WEAVES: Weaves = ("plain", "plain", "knit", "stripes")


@lru_cache(maxsize=4)
def twin_plan(scene: int, distance: float, same: bool) -> WalkPlan:
    """Return the plan of `stress/twin`: target and second person in equal or other clothes."""

    def generator(part: str) -> Generator:
        return part_generator(scene, f"stress/twin {part}")

    random = generator("target way")
    views = sample_fixed_views(generator("camera"), TWIN_FRAMES)
    velocity = random.choice([-1, 1]) * random.uniform(0.5, 0.6), random.uniform(-0.1, 0.1)
    place = random.uniform(-0.3, 0.3), random.uniform(7.6, 8.4)
    target = straight_path(TWIN_FRAMES, TWIN_FRAMES // 2, place, velocity, random.uniform())
    random = generator("clothes")
    clothes = sample_street_clothes(random)
    unlike = sample_other_clothes(random, clothes)
    first = sample_person(generator("target"), target, clothes)
    width = body_boxes(*WalkPlan(0, views, [first]).places[0].T)[:, 2]
    path = routes.sample_path_beside_target(generator("twin way"), views, target, width, distance)
    # The generators are equal, so that variants differ only in the second person's clothes.
    second = sample_person(generator("twin"), path, clothes if same else unlike)
    return WalkPlan(sample_seed(generator("street")), views, [first, second])


def sample_person(
    random: Generator,
    path: WalkingPath,
    clothes: tuple[BGR, BGR],
    bag: BGR | None = None,
    weaves: Weaves = WEAVES,
) -> Person:
    """Sample a person in given clothes; all other properties are random."""
    look = WalkerLook(
        shirt=clothes[0],
        trousers=clothes[1],
        hair=HAIR[random.integers(len(HAIR))],
        skin=SKIN[random.integers(len(SKIN))],
        shoes=SHOES[random.integers(len(SHOES))],
        bag=bag,
        weave=weaves[random.integers(len(weaves))],
        long_hair=bool(random.random() < 0.4),
        hem=random.uniform(0.45, 0.49),
        bulk=random.uniform(0.92, 1.1),
        loose=random.uniform(0.92, 1.12),
    )
    return Person(look, sample_seed(random), random.uniform(1.62, 1.88), path)


def sample_seed(random: Generator) -> int:
    """Sample a seed of 32 bits."""
    return int(random.integers(2**32))
