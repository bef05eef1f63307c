"""Random appearance of a worker."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.random import Generator

from trackmark.datasets.interface import Array
from trackmark.datasets.synthetic.render.colours import BGR

Cut: TypeAlias = Literal["short", "full", "wreath"]

DARK_HAIR: tuple[BGR, ...] = ((26, 28, 32), (36, 44, 60), (104, 108, 112))
ANY_HAIR: tuple[BGR, ...] = (*DARK_HAIR, (48, 70, 98), (72, 122, 158))
# skin colours with their possible hair colours
COMPLEXIONS: tuple[tuple[BGR, tuple[BGR, ...]], ...] = (
    ((150, 174, 216), ANY_HAIR),
    ((134, 160, 206), ANY_HAIR),
    ((104, 134, 182), DARK_HAIR),
    ((66, 90, 132), DARK_HAIR),
)

CLOTHES: tuple[BGR, ...] = (
    (120, 74, 44),  # work blue
    (84, 52, 38),  # navy
    (150, 120, 84),  # light blue
    (104, 102, 98),  # grey
    (70, 88, 62),  # green
    (196, 198, 196),  # white
    (44, 46, 140),  # red
    (36, 92, 206),  # orange
)
SHIRTS: tuple[BGR, ...] = (
    (206, 208, 208),
    (150, 146, 140),
    (70, 66, 64),
    (176, 150, 118),
    (60, 58, 130),
    (112, 146, 170),
)
CUTS: tuple[Cut, ...] = ("short", "short", "full", "wreath")


@dataclass(frozen=True)
class FigureLook:
    """Appearance of head and working clothes. Colours are BGR in [0, 255]."""

    hair: BGR
    skin: BGR
    cut: Cut  # haircut; a wreath leaves the crown bald
    beard: bool  # True if there is a beard
    glasses: bool  # True if there are glasses
    clothes: BGR  # the jacket, or bib and brace
    shirt: BGR  # the shirt below the clothes
    bib: bool  # True if the shirt's sleeves are visible
    bulk: float  # breadth of the body relative to the average
    stature: float  # [metres]


def sample_skin(random: Generator) -> Array:
    """Sample a skin colour, BGR in [0, 255]."""
    return np.asarray(COMPLEXIONS[random.integers(len(COMPLEXIONS))][0], np.float64)


def sample_figure_look(random: Generator) -> FigureLook:
    """Sample the appearance of a person; all traits are independent."""
    skin, hairs = COMPLEXIONS[random.integers(len(COMPLEXIONS))]
    return FigureLook(
        hair=hairs[random.integers(len(hairs))],
        skin=skin,
        cut=CUTS[random.integers(len(CUTS))],
        beard=bool(random.random() < 0.25),
        glasses=bool(random.random() < 0.35),
        clothes=CLOTHES[random.integers(len(CLOTHES))],
        shirt=SHIRTS[random.integers(len(SHIRTS))],
        bib=bool(random.random() < 0.5),
        bulk=float(random.uniform(0.94, 1.1)),
        stature=float(random.uniform(1.68, 1.84)),
    )
