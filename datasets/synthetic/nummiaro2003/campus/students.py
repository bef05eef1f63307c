"""`nummiaro2003/students`: one of several students walks behind a tree, and past others.

The paper says: students before a university, 222 frames. In frame 101 the target is completely
hidden by a tree; then other students hide him twice, for a short time; in the end he leaves the
picture. All the rest is ours. The first 20 frames show the place without him: frame k of the
paper is frame 20 + k here.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from trackmark.datasets.synthetic.knobs import SceneKnobs
from trackmark.datasets.synthetic.multipart import routes
from trackmark.datasets.synthetic.multipart.plan import Person
from trackmark.datasets.synthetic.nummiaro2003.campus.scene import VisitPlan, VisitScene, bystander
from trackmark.datasets.synthetic.nummiaro2003.campus.scene import target as target_person
from trackmark.datasets.synthetic.nummiaro2003.campus.setting import old_tree
from trackmark.datasets.synthetic.render.path import smooth_step
from trackmark.datasets.synthetic.render.views import (
    SIZE,
    Views,
    WalkingPath,
    sample_fixed_views,
    straight_path,
)
from trackmark.datasets.synthetic.scene import part_generator

LENGTH = 242
# Frames: the first with the target, that in which the tree hides him most, the first without.
COMES, HIDDEN, GONE = 20, 121, 232
# Time for which less than 0.3 of him is seen: he is lost for a short time only [frames].
BEHIND_THE_TREE = 8, 11
# He gains so much on a steady pace at the tree [pixels], within this time of it [frames].
HURRY, HURRIED = 45.0, 25
PASSED = 181, 202  # frames in which others pass before him, give or take two
CLEAR = 0.65  # others pass the target at this distance, in depth, at least [metres]
OTHERS_BEHIND = 5


def scene(knobs: SceneKnobs) -> VisitScene:
    """Return renderer and ground truth; nothing is drawn yet."""
    return VisitScene(_plan(knobs.scene), "even")


@lru_cache(maxsize=4)
def _plan(seed: int) -> VisitPlan:
    views = _views(seed)
    target = _across(_generator(seed, "target way"), views)
    first = target_person(_generator(seed, "target"), target)

    random = _generator(seed, "tree")
    place = _abreast(target, HIDDEN, random.uniform(0.68, 0.73))
    width = _width(views, first, int(random.integers(*BEHIND_THE_TREE, endpoint=True)))
    worn = first.look.shirt, first.look.trousers
    tree = old_tree(random, place, float(views.still.scale(place[1])), width, worn)

    random = _generator(seed, "ways before")
    pace = random.uniform(1.4, 1.7)
    others = [_passing(random, target, when, pace) for when in PASSED]
    for i in range(OTHERS_BEHIND):
        random = _generator(seed, f"way behind {i}")
        nearest = float(target.z.max()) + CLEAR
        others.append(routes.behind_the_target(random, views, target, others, nearest))
    there = [first]
    for i, course in enumerate(others):
        person = bystander(_generator(seed, f"person {i}"), course, first.look)
        if i < len(PASSED):  # he is not seen over their heads
            person = replace(person, stature=max(person.stature, first.stature))
        there.append(person)
    street = int(_generator(seed, "street").integers(2**32))
    return VisitPlan(street, views, there, slice(COMES, GONE), tree)


def _generator(seed: int, part: str) -> np.random.Generator:
    return part_generator(seed, f"nummiaro2003/students {part}")


def _views(seed: int) -> Views:
    return sample_fixed_views(_generator(seed, "camera"), LENGTH)


def _across(random: np.random.Generator, views: Views) -> WalkingPath:
    """Way through the picture, from one side until he is gone at the other."""
    time = (np.arange(LENGTH) - COMES) / (GONE - COMES)
    start, swing = random.uniform(45, 80), random.uniform(-8, 8)
    middle, drift = random.uniform(8.2, 8.5), random.uniform(-0.45, 0.45)
    z = middle + drift * (2 * time - 1)
    beyond = SIZE[0] + 0.12 * 1.75 * views.still.scale(z[GONE])
    # He is now faster, now slower, by some percent, and hurries past the tree.
    hurry = HURRY * smooth_step(np.arange(float(LENGTH)), HIDDEN - HURRIED, HIDDEN + HURRIED)
    column = start + (beyond - HURRY - start) * time + swing * np.sin(2 * np.pi * time) + hurry
    side = random.choice([-1, 1])
    x = side * (column - views.still.centre) / views.still.scale(z)
    # His legs are together behind the tree: a narrow one hides all of him.
    together = random.choice([0.0, 0.5]) + random.uniform(0.03, 0.13)
    return WalkingPath.through(x, z, together - float(WalkingPath.through(x, z, 0.0).phase[HIDDEN]))


def _passing(
    random: np.random.Generator, target: WalkingPath, when: int, pace: float
) -> WalkingPath:
    """Way of someone who comes towards the target and passes close before him, quickly."""
    at = when + int(random.integers(-2, 2, endpoint=True))
    place = _abreast(target, at, 1 - random.uniform(0.6, 0.75) / float(target.z[at]))
    way = float(np.sign(target.x[at + 1] - target.x[at]))
    return straight_path(LENGTH, at, place, (-way * pace, 0.0), random.uniform())


def _abreast(target: WalkingPath, frame: int, ratio: float) -> tuple[float, float]:
    """Place (x, z) [metres] in the target's column, at a ratio of his depth."""
    return float(target.x[frame]) * ratio, float(target.z[frame]) * ratio


def _width(views: Views, target: Person, frames: int) -> float:
    """Width [pixels] of a tree that leaves less than 0.3 of him to be seen, for so long."""
    plan = VisitPlan(0, views, [target], slice(COMES, GONE))
    middle = plan.places[0, HIDDEN, 0]
    needed = []
    for frame in range(HIDDEN - 2 * frames, HIDDEN + 2 * frames):
        left, _, alpha = plan.coverage(0, frame)
        columns = alpha.sum(axis=0, dtype=np.float64)
        away = np.abs(left + np.arange(len(columns)) + 0.5 - middle)
        nearest = np.argsort(away)
        hidden = np.cumsum(columns[nearest]) / columns.sum()
        needed.append(2 * float(away[nearest][np.searchsorted(hidden, 0.7)]))
    return sorted(needed)[frames - 1] + 1
