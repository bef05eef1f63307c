"""Who takes part in a scene: people in their clothes, and the ways that they go."""

from functools import lru_cache
from typing import Literal, TypeAlias

import numpy as np

from datasets.synthetic.multipart import routes, wardrobe
from datasets.synthetic.multipart.designs import DESIGNS, TWIN_FRAMES
from datasets.synthetic.multipart.look import Look
from datasets.synthetic.multipart.plan import Person, Plan, Post
from datasets.synthetic.multipart.scene import body_boxes
from datasets.synthetic.multipart.wardrobe import BGR
from datasets.synthetic.render.views import Course, fixed, following, straight
from datasets.synthetic.scene import part_generator

__all__ = ["dressed", "multipart_plan", "twin_plan"]

FIRST, LAST = 0.16, 0.88
"""Parts of a sequence between which people pass before the target."""

Weaves: TypeAlias = tuple[Literal["plain", "stripes", "knit"], ...]

HAIR: tuple[BGR, ...] = ((28, 30, 34), (38, 46, 62), (52, 78, 110), (108, 112, 116), (70, 128, 168))
SKIN: tuple[BGR, ...] = ((150, 176, 214), (124, 152, 198), (92, 122, 170), (56, 78, 118))
SHOES: tuple[BGR, ...] = ((36, 36, 40), (44, 58, 82), (150, 154, 160))
WEAVES: Weaves = ("plain", "plain", "knit", "stripes")
PLAIN_WEAVES: Weaves = ("plain", "knit")

CLEAR = 0.6
"""Others walk behind the target by this at least [metres]."""


@lru_cache(maxsize=4)
def multipart_plan(number: str, seed: int) -> Plan:
    """People and camera of one of the eight sequences, in a scene."""
    design = DESIGNS[number]

    def generator(part: str) -> np.random.Generator:
        return part_generator(seed, f"multipart/{number} {part}")

    if design.follows:
        target = routes.along_the_street(generator("target way"), design)
        views = following(generator("camera"), target)
    else:
        views = fixed(generator("camera"), design.length)
        target = routes.in_view(generator("target way"), design, views)

    others: list[Course] = []
    posts = []
    for i in range(design.posts):
        random = generator(f"post {i}")
        others.append(routes.pillar(random, views, target, others))
        posts.append(
            Post(float(others[-1].x[0]), float(others[-1].z[0]), random.uniform(0.35, 0.5))
        )
    for i in range(design.before):
        random = generator(f"way before {i}")
        share = (i + random.uniform(0.25, 0.75)) / design.before
        when = (FIRST + (LAST - FIRST) * share) * design.length
        others.append(routes.before_the_target(random, views, target, others, when))
    for i in range(design.behind):
        random = generator(f"way behind {i}")
        nearest = design.depths[1] + CLEAR
        others.append(routes.behind_the_target(random, views, target, others, nearest))

    random = generator("target clothes")
    worn = (
        wardrobe.two_coloured_clothes(random)
        if design.two_coloured
        else wardrobe.plain_clothes(random)
    )
    weaves = WEAVES if design.two_coloured else PLAIN_WEAVES
    people = [dressed(generator("target"), target, worn, design.jacket, design.bag, weaves)]
    for i, course in enumerate(others[design.posts :]):
        random = generator(f"person {i}")
        worn, jacket, bag = wardrobe.clothes(random), random.random() < 0.3, random.random() < 0.25
        people.append(dressed(random, course, worn, jacket, bag))
    return Plan(_seed(generator("street")), views, people, posts)


@lru_cache(maxsize=4)
def twin_plan(seed: int, distance: float, same: bool) -> Plan:
    """A target, and a second person in the same clothes or in others."""

    def generator(part: str) -> np.random.Generator:
        return part_generator(seed, f"stress/twin {part}")

    random = generator("target way")
    views = fixed(generator("camera"), TWIN_FRAMES)
    velocity = random.choice([-1, 1]) * random.uniform(0.5, 0.6), random.uniform(-0.1, 0.1)
    place = random.uniform(-0.3, 0.3), random.uniform(7.6, 8.4)
    target = straight(TWIN_FRAMES, TWIN_FRAMES // 2, place, velocity, random.uniform())
    random = generator("clothes")
    worn = wardrobe.two_coloured_clothes(random)
    unlike = wardrobe.other_clothes(random, worn)
    first = dressed(generator("target"), target, worn)
    width = body_boxes(*Plan(0, views, [first]).places[0].T)[:, 2]
    course = routes.beside_the_target(generator("twin way"), views, target, width, distance)
    # The same generator: whoever wears other clothes is the same person in all else.
    second = dressed(generator("twin"), course, worn if same else unlike)
    return Plan(_seed(generator("street")), views, [first, second])


def dressed(
    random: np.random.Generator,
    course: Course,
    worn: tuple[BGR, BGR],
    jacket: bool = False,
    bag: BGR | bool | None = None,
    weaves: Weaves = WEAVES,
) -> Person:
    """Someone in an upper garment and trousers; the rest of him is drawn at random.

    `bag` is a colour, or whether he has one of any colour.
    """
    look = Look(
        shirt=wardrobe.shirt_below(random, worn[0]) if jacket else worn[0],
        trousers=worn[1],
        hair=HAIR[random.integers(len(HAIR))],
        skin=SKIN[random.integers(len(SKIN))],
        shoes=SHOES[random.integers(len(SHOES))],
        jacket=worn[0] if jacket else None,
        bag=wardrobe.bag(random) if bag is True else bag or None,
        weave=weaves[random.integers(len(weaves))],
        long_hair=bool(random.random() < 0.4),
        hem=random.uniform(0.45, 0.49),
        bulk=random.uniform(0.92, 1.1),
        loose=random.uniform(0.92, 1.12),
    )
    return Person(look, _seed(random), random.uniform(1.62, 1.88), course)


def _seed(random: np.random.Generator) -> int:
    return int(random.integers(2**32))
