"""`nummiaro2003/person`: someone walks before a parking place, seen by a fixed camera.

The paper says: a person "in front of a parking place", of PETS2001; and that samples can be
placed where people come in, "like doors and image borders". All the rest is ours.
"""

from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.multipart.plan import Person
from datasets.synthetic.nummiaro2003.campus.scene import VisitPlan, VisitScene, bystander
from datasets.synthetic.nummiaro2003.campus.scene import target as target_person
from datasets.synthetic.nummiaro2003.campus.setting import (
    DOORSTEP,
    MIDDLE,
    OPENING,
    THRESHOLD,
    CarPark,
    entrance,
    parked_cars,
    sides,
)
from datasets.synthetic.nummiaro2003.knobs import PersonKnobs
from datasets.synthetic.render.prop import Prop
from datasets.synthetic.render.views import SIZE, Viewpoint, Views, straight, walk
from datasets.synthetic.scene import part_generator

__all__ = ["entries", "scene"]

EMPTY, WALK = 60, 250
"""Frames without the target, and frames of his walk."""

COMING_IN = 60
"""At most, from the first sight of him to the whole [frames]."""

DEPTHS = (8.0, 8.5), (12.2, 12.7)
"""Near and far ends of his ways before the cars [metres]."""

PAVEMENT = 15.75, 16.3
"""Where others pass, between the cars and the porch [metres]."""

ELBOW_ROOM = 0.5
"""Nobody walks nearer to another [metres]."""


def scene(knobs: PersonKnobs) -> VisitScene:
    """Renderer and truth; nothing is drawn yet."""
    return VisitScene(_plan(knobs.scene, knobs.start == "empty"), knobs.light)


def entries(knobs: PersonKnobs) -> NDArray[np.float64]:
    """The door, the left border and the right one."""
    camera, z = _camera(knobs.scene), DOORSTEP
    edges = _door(knobs.scene) + np.array([-0.5, 0.5]) * OPENING[0]
    left, right = camera.column(edges, np.full(2, z))
    bottom, top = camera.row(MIDDLE + np.array([-0.3, 0.3]), np.full(2, z))
    door = np.array([left, top, right - left, bottom - top])
    return np.vstack([door, sides(camera, (DEPTHS[0][0], DEPTHS[1][1]))])


@lru_cache(maxsize=4)
def _plan(seed: int, empty: bool) -> VisitPlan:
    camera, door = _camera(seed), _door(seed)
    cars = parked_cars(_generator(seed, "cars"), camera, door)
    things = [*cars, *entrance(_generator(seed, "porch"), camera, door)]
    first, seen_whole = _coming(seed, things)
    people_there = [first, *_passers_by(seed, first)]
    frames = slice(0, EMPTY + WALK) if empty else slice(seen_whole, seen_whole + WALK)
    there = [replace(who, course=who.course[frames]) for who in people_there]
    street = int(_generator(seed, "street").integers(2**32))
    visit = slice(EMPTY if empty else 0, None)
    views = Views.standing(camera, frames.stop - frames.start)
    return VisitPlan(street, views, there, visit, things, CarPark)


def _coming(seed: int, things: list[Prop]) -> tuple[Person, int]:
    """The target who is first seen after `EMPTY` frames, and when wholly, in the light."""
    camera, frames = _camera(seed), EMPTY + COMING_IN + WALK
    random = _generator(seed, "target way")
    start, points = _way(random, camera, _door(seed))
    course = walk(frames, start, points, random.uniform(1.15, 1.3), random.uniform())
    first = target_person(_generator(seed, "target"), course)
    plan = VisitPlan(0, Views.standing(camera, frames), [first], slice(0, None), things, CarPark)
    seen = np.array([plan.seen(f)[2].sum() / plan.coverage(0, f)[2].sum() for f in range(100)])
    comes = int(np.argmax(seen >= 0.1))
    outside = course.z[: len(seen)] < DOORSTEP - THRESHOLD
    whole = int(np.argmax((seen >= 0.995) & outside))
    waiting = np.arange(frames) - (EMPTY - comes)
    return replace(first, course=course[np.maximum(waiting, 0)]), EMPTY + whole - comes


def _way(
    random: np.random.Generator, camera: Viewpoint, door: float
) -> tuple[tuple[float, float], Iterator[tuple[float, float]]]:
    """Start, out of sight behind a wall or a border, and the points that he turns to."""
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
            yield towards * random.uniform(0.35, 0.62) * _half(camera, z), z
            towards, farther = -towards, not farther

    if through_the_door:
        return (door + side * (OPENING[0] / 2 + 0.5), DOORSTEP + 0.65), points()
    z = random.uniform(*DEPTHS[far])
    return (side * (_half(camera, z) + 0.8), z), points()


def _passers_by(seed: int, first: Person) -> list[Person]:
    """Some who pass between the cars and the porch, and never hide the target."""
    course = first.course
    kept: list[Person] = []
    for i in range(4):
        random = _generator(seed, f"person {i}")
        place = random.uniform(-6, 6), random.uniform(*PAVEMENT)
        velocity = random.choice([-1, 1]) * random.uniform(0.9, 1.5), 0.0
        at = int(random.integers(len(course.x)))
        way = straight(len(course.x), at, place, velocity, random.uniform())
        before = (way.z < course.z) & (np.abs(way.x / way.z - course.x / course.z) < 0.8 / 16)
        near = [
            np.hypot(way.x - other.x, way.z - other.z) < ELBOW_ROOM
            for other in (course, *(who.course for who in kept))
        ]
        if not (before.any() or np.any(near)):
            kept.append(bystander(random, way, first.look))
    return kept


def _generator(seed: int, part: str) -> np.random.Generator:
    return part_generator(seed, f"nummiaro2003/person {part}")


def _camera(seed: int) -> Viewpoint:
    """Somewhat above the street, as on a first floor."""
    random = _generator(seed, "camera")
    return Viewpoint(
        focal=620.0,
        eye=random.uniform(4.7, 5.2),
        horizon=random.uniform(56, 70),
        centre=SIZE[0] / 2,
    )


def _door(seed: int) -> float:
    """Middle of the door [metres to the right]."""
    return float(_generator(seed, "door").uniform(-4.5, 4.5))


def _half(camera: Viewpoint, z: float) -> float:
    """Half the width of what is seen at a depth [metres]."""
    return SIZE[0] / 2 / float(camera.scale(z))
