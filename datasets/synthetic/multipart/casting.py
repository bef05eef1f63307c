"""People of a scene with their clothes, and the plan of `stress/twin`."""

from functools import lru_cache
from typing import Literal, TypeAlias

import numpy as np

from trackmark.datasets.synthetic.multipart import routes, wardrobe
from trackmark.datasets.synthetic.multipart.designs import TWIN_FRAMES
from trackmark.datasets.synthetic.multipart.look import WalkerLook
from trackmark.datasets.synthetic.multipart.plan import Person, WalkPlan, body_boxes
from trackmark.datasets.synthetic.render.colours import BGR
from trackmark.datasets.synthetic.render.views import WalkingPath, sample_fixed_views, straight_path
from trackmark.datasets.synthetic.scene import part_generator

Weaves: TypeAlias = tuple[Literal["plain", "stripes", "knit"], ...]

HAIR: tuple[BGR, ...] = ((28, 30, 34), (38, 46, 62), (52, 78, 110), (108, 112, 116), (70, 128, 168))
SKIN: tuple[BGR, ...] = ((150, 176, 214), (124, 152, 198), (92, 122, 170), (56, 78, 118))
SHOES: tuple[BGR, ...] = ((36, 36, 40), (44, 58, 82), (150, 154, 160))
WEAVES: Weaves = ("plain", "plain", "knit", "stripes")


@lru_cache(maxsize=4)
def twin_plan(scene: int, distance: float, same: bool) -> WalkPlan:
    """Return the plan of `stress/twin`: target and second person in equal or other clothes."""

    def generator(part: str) -> np.random.Generator:
        return part_generator(scene, f"stress/twin {part}")

    random = generator("target way")
    views = sample_fixed_views(generator("camera"), TWIN_FRAMES)
    velocity = random.choice([-1, 1]) * random.uniform(0.5, 0.6), random.uniform(-0.1, 0.1)
    place = random.uniform(-0.3, 0.3), random.uniform(7.6, 8.4)
    target = straight_path(TWIN_FRAMES, TWIN_FRAMES // 2, place, velocity, random.uniform())
    random = generator("clothes")
    worn = wardrobe.sample_street_clothes(random)
    unlike = wardrobe.sample_other_clothes(random, worn)
    first = sample_person(generator("target"), target, worn)
    width = body_boxes(*WalkPlan(0, views, [first]).places[0].T)[:, 2]
    course = routes.sample_path_beside_target(generator("twin way"), views, target, width, distance)
    # The generators are equal, so that variants differ only in the second person's clothes.
    second = sample_person(generator("twin"), course, worn if same else unlike)
    return WalkPlan(sample_seed(generator("street")), views, [first, second])


def sample_person(
    random: np.random.Generator,
    course: WalkingPath,
    worn: tuple[BGR, BGR],
    bag: BGR | None = None,
    weaves: Weaves = WEAVES,
) -> Person:
    """Sample a person in given clothes; all other properties are random."""
    look = WalkerLook(
        shirt=worn[0],
        trousers=worn[1],
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
    return Person(look, sample_seed(random), random.uniform(1.62, 1.88), course)


def sample_seed(random: np.random.Generator) -> int:
    """Sample a seed of 32 bits."""
    return int(random.integers(2**32))
