"""`nummiaro2003/students`: a student walks behind a tree and is passed by other students.

The paper shows students in front of a university in 222 frames. In frame 101 a tree occludes the
target completely. Other students then occlude it twice for a short time; in the end the target
leaves the image. All other properties are our choice. The first 20 frames do not contain the
target, so that frame k of the paper is frame 20 + k here.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.random import Generator

from trackmark.datasets.synthetic.multipart import routes
from trackmark.datasets.synthetic.multipart.plan import Person
from trackmark.datasets.synthetic.nummiaro2003.campus.scene import (
    VisitPlan,
    VisitScene,
    old_tree,
    sample_bystander,
    sample_target,
)
from trackmark.datasets.synthetic.parameters import SceneParameters
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
# first frame with the target, frame of maximum occlusion by the tree, first frame after the target
COMES, HIDDEN, GONE = 20, 121, 232
BEHIND_THE_TREE = 8, 11  # range of the time with a visibility below 0.3 [frames]
# distance that the target gains at the tree by walking faster [pixels], and half the time that it
# takes [frames]
HURRY, HURRIED = 45.0, 25
PASSED = 181, 202  # frames in which others pass in front of the target, plus or minus two
CLEAR = 0.65  # minimum difference in depth between the target and people behind it [metres]
OTHERS_BEHIND = 5  # number of people behind the target


def scene(parameters: SceneParameters) -> VisitScene:
    """Return the scene, which gives the ground truth and renders frames on request."""
    return VisitScene(_plan(parameters.scene), "even")


@lru_cache(maxsize=4)
def _plan(seed: int) -> VisitPlan:
    views = _views(seed)
    target_path = _sample_target_path(_generator(seed, "target way"), views)
    first = sample_target(_generator(seed, "target"), target_path)

    random = _generator(seed, "tree")
    place = _aligned_place(target_path, HIDDEN, random.uniform(0.68, 0.73))
    width = _tree_width(views, first, int(random.integers(*BEHIND_THE_TREE, endpoint=True)))
    target_clothes = first.look.shirt, first.look.trousers
    tree = old_tree(random, place, float(views.still.scale(place[1])), width, target_clothes)

    random = _generator(seed, "ways before")
    pace = random.uniform(1.4, 1.7)
    others = [_sample_passing_path(random, target_path, when, pace) for when in PASSED]
    for i in range(OTHERS_BEHIND):
        random = _generator(seed, f"way behind {i}")
        nearest = float(target_path.z.max()) + CLEAR
        others.append(routes.sample_path_behind_target(random, views, target_path, others, nearest))
    people = [first]
    for i, path in enumerate(others):
        person = sample_bystander(_generator(seed, f"person {i}"), path, first.look)
        if i < len(PASSED):  # tall enough to hide the target's head
            person = replace(person, stature=max(person.stature, first.stature))
        people.append(person)
    street = int(_generator(seed, "street").integers(2**32))
    return VisitPlan(street, views, people, slice(COMES, GONE), tree)


def _generator(seed: int, part: str) -> Generator:
    return part_generator(seed, f"nummiaro2003/students {part}")


def _views(seed: int) -> Views:
    return sample_fixed_views(_generator(seed, "camera"), LENGTH)


def _sample_target_path(random: Generator, views: Views) -> WalkingPath:
    """Sample a path that crosses the image from one side and leaves it at the other side."""
    time = (np.arange(LENGTH) - COMES) / (GONE - COMES)
    start, swing = random.uniform(45, 80), random.uniform(-8, 8)
    middle, drift = random.uniform(8.2, 8.5), random.uniform(-0.45, 0.45)
    z = middle + drift * (2 * time - 1)
    beyond = SIZE[0] + 0.12 * 1.75 * views.still.scale(z[GONE])
    # The speed varies by a few per cent and rises at the tree.
    hurry = HURRY * smooth_step(np.arange(float(LENGTH)), HIDDEN - HURRIED, HIDDEN + HURRIED)
    column = start + (beyond - HURRY - start) * time + swing * np.sin(2 * np.pi * time) + hurry
    side = random.choice([-1, 1])
    x = side * (column - views.still.centre) / views.still.scale(z)
    # Behind the tree the legs are together, so that a narrow tree occludes the whole target.
    together = random.choice([0.0, 0.5]) + random.uniform(0.03, 0.13)
    return WalkingPath.through(x, z, together - float(WalkingPath.through(x, z, 0.0).phase[HIDDEN]))


def _sample_passing_path(
    random: Generator, target: WalkingPath, meeting_frame: int, pace: float
) -> WalkingPath:
    """Sample the path of a person who meets the target and passes close in front of it."""
    frame = meeting_frame + int(random.integers(-2, 2, endpoint=True))
    place = _aligned_place(target, frame, 1 - random.uniform(0.6, 0.75) / float(target.z[frame]))
    direction = float(np.sign(target.x[frame + 1] - target.x[frame]))
    return straight_path(LENGTH, frame, place, (-direction * pace, 0.0), random.uniform())


def _aligned_place(target: WalkingPath, frame: int, ratio: float) -> tuple[float, float]:
    """Return a position (x, z) [metres] in the target's image column, at `ratio` of its depth."""
    return float(target.x[frame]) * ratio, float(target.z[frame]) * ratio


def _tree_width(views: Views, target: Person, frames: int) -> float:
    """Return the tree width [pixels] for which the visibility is below 0.3 in `frames` frames."""
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
