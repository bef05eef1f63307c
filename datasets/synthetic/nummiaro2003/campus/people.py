"""Who is on a campus: one in clear colours, the others in colours unlike his."""

import numpy as np

from datasets.synthetic.multipart import wardrobe
from datasets.synthetic.multipart.casting import HAIR, SHOES, SKIN, WEAVES
from datasets.synthetic.multipart.look import Look
from datasets.synthetic.multipart.plan import Person
from datasets.synthetic.multipart.wardrobe import BGR
from datasets.synthetic.render.views import Course

__all__ = ["bystander", "target"]

UNLIKE = 40
"""Colours differ clearly whose channels differ by this much in one of them [grey levels]."""


def target(random: np.random.Generator, course: Course) -> Person:
    """Someone in a shirt and trousers that differ clearly, without a bag."""
    return _person(random, course, wardrobe.two_coloured_clothes(random), None)


def bystander(random: np.random.Generator, course: Course, other: Look) -> Person:
    """Someone dressed in clearly other colours than another person; half of them carry a bag."""
    worn = other.shirt, other.trousers
    clothes = wardrobe.other_clothes(random, worn)
    bag = wardrobe.bag(random) if random.random() < 0.5 else None
    while bag is not None and any(np.abs(np.subtract(bag, c)).max() < UNLIKE for c in worn):
        bag = wardrobe.bag(random)
    return _person(random, course, clothes, bag)


def _person(
    random: np.random.Generator, course: Course, worn: tuple[BGR, BGR], bag: BGR | None
) -> Person:
    look = Look(
        shirt=worn[0],
        trousers=worn[1],
        hair=HAIR[random.integers(len(HAIR))],
        skin=SKIN[random.integers(len(SKIN))],
        shoes=SHOES[random.integers(len(SHOES))],
        bag=bag,
        weave=WEAVES[random.integers(len(WEAVES))],
        long_hair=bool(random.random() < 0.4),
        hem=random.uniform(0.45, 0.49),
        bulk=random.uniform(0.92, 1.1),
        loose=random.uniform(0.92, 1.12),
    )
    return Person(look, int(random.integers(2**32)), random.uniform(1.62, 1.88), course)
