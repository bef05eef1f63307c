"""`nummiaro2003/person`: a person walks in front of a car park, recorded by a fixed camera.

The paper uses a person "in front of a parking place" from PETS2001. All other properties are our
choice.
"""

from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.random import Generator

from trackmark.datasets.synthetic.multipart.plan import Person
from trackmark.datasets.synthetic.nummiaro2003.campus.scene import (
    DOORSTEP,
    OPENING,
    THRESHOLD,
    CarPark,
    VisitPlan,
    VisitScene,
    entrance,
    parked_cars,
    sample_bystander,
    sample_target,
)
from trackmark.datasets.synthetic.parameters import SceneParameters
from trackmark.datasets.synthetic.render.prop import Prop
from trackmark.datasets.synthetic.render.views import (
    SIZE,
    Viewpoint,
    Views,
    straight_path,
    walk_through_points,
)
from trackmark.datasets.synthetic.scene import part_generator

WALK = 250  # length of the sequence [frames]
COMING_IN = 100  # maximum time until the whole target is visible [frames]
# depth ranges of the near and the far ends of the target's path [metres]
DEPTHS = (8.0, 8.5), (12.2, 12.7)
PAVEMENT = 15.75, 16.3  # depths of passers-by, between the cars and the porch [metres]
ELBOW_ROOM = 0.5  # minimum distance between people [metres]


def scene(parameters: SceneParameters) -> VisitScene:
    """Return the scene, which gives the ground truth and renders frames on request."""
    return VisitScene(_plan(parameters.scene), "even")


@lru_cache(maxsize=4)
def _plan(seed: int) -> VisitPlan:
    camera, door = _camera(seed), _door(seed)
    cars = parked_cars(_generator(seed, "cars"), camera, door)
    things = [*cars, *entrance(_generator(seed, "porch"), camera, door)]
    first = _target(seed, things)
    street = int(_generator(seed, "street").integers(2**32))
    people = [first, *_passers_by(seed, first)]
    return VisitPlan(street, Views.standing(camera, WALK), people, slice(0, None), things, CarPark)


def _target(seed: int, things: list[Prop]) -> Person:
    """Return the target. Its path starts when all of it is visible and outside the dark porch."""
    camera, frames = _camera(seed), COMING_IN + WALK
    random = _generator(seed, "target way")
    start, points = _sample_path_points(random, camera, _door(seed))
    path = walk_through_points(frames, start, points, random.uniform(1.15, 1.3), random.uniform())
    first = sample_target(_generator(seed, "target"), path)
    plan = VisitPlan(0, Views.standing(camera, frames), [first], slice(0, None), things, CarPark)
    seen = [plan.seen(f)[2].sum() / plan.coverage(0, f)[2].sum() for f in range(COMING_IN)]
    outside = path.z[:COMING_IN] < DOORSTEP - THRESHOLD
    whole = int(np.argmax((np.array(seen) >= 0.995) & outside))
    return replace(first, path=path[whole : whole + WALK])


def _sample_path_points(
    random: Generator, camera: Viewpoint, door: float
) -> tuple[tuple[float, float], Iterator[tuple[float, float]]]:
    """Return the start, outside the image or behind the porch wall, and the waypoints."""
    side, far = float(random.choice([-1, 1])), bool(random.integers(2))
    through_the_door = random.random() < 1 / 3

    def points() -> Iterator[tuple[float, float]]:
        towards, farther = -side, not far
        if through_the_door:
            yield door, DOORSTEP + 0.65
            yield door, DEPTHS[1][1]
            towards, farther = -np.sign(door), False
        while True:
            z = random.uniform(*DEPTHS[farther])
            yield towards * random.uniform(0.35, 0.62) * _half_width(camera, z), z
            towards, farther = -towards, not farther

    if through_the_door:
        return (door + side * (OPENING[0] / 2 + 0.5), DOORSTEP + 0.65), points()
    z = random.uniform(*DEPTHS[far])
    return (side * (_half_width(camera, z) + 0.8), z), points()


def _passers_by(seed: int, first: Person) -> list[Person]:
    """Return people who walk between the cars and the porch and never occlude the target."""
    path = first.path
    passers: list[Person] = []
    for i in range(4):
        random = _generator(seed, f"person {i}")
        place = random.uniform(-6, 6), random.uniform(*PAVEMENT)
        velocity = random.choice([-1, 1]) * random.uniform(0.9, 1.5), 0.0
        frame = int(random.integers(len(path.x)))
        passer_path = straight_path(len(path.x), frame, place, velocity, random.uniform())
        before = (passer_path.z < path.z) & (
            np.abs(passer_path.x / passer_path.z - path.x / path.z) < 0.8 / 16
        )
        near = [
            np.hypot(passer_path.x - other.x, passer_path.z - other.z) < ELBOW_ROOM
            for other in (path, *(passer.path for passer in passers))
        ]
        if not (before.any() or np.any(near)):
            passers.append(sample_bystander(random, passer_path, first.look))
    return passers


def _generator(seed: int, part: str) -> Generator:
    return part_generator(seed, f"nummiaro2003/person {part}")


def _camera(seed: int) -> Viewpoint:
    """Return a camera at the height of a first-floor window."""
    random = _generator(seed, "camera")
    return Viewpoint(
        focal=620.0,
        eye=random.uniform(4.7, 5.2),
        horizon=random.uniform(56, 70),
        centre=SIZE[0] / 2,
    )


def _door(seed: int) -> float:
    """Return the lateral position of the door's centre [metres to the right]."""
    return float(_generator(seed, "door").uniform(-4.5, 4.5))


def _half_width(camera: Viewpoint, z: float) -> float:
    return SIZE[0] / 2 / float(camera.scale(z))
