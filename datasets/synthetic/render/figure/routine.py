"""Routine of the worker: operations at several machines, drawn at random within bounds.

The paper's words: several operations on different machines, large out-of-plane rotations of the
head, unpredictable locations. His speeds are everyday ones: the paper does not give any.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.synthetic.render.path import smooth_step
from trackmark.datasets.synthetic.render.views import random_wander

Array = NDArray[np.float64]

SIZE = 640, 480
"""Width and height of the images [pixels]."""

FRAMES = 450
FRAMES_PER_SECOND = 25.0

FOCAL = 700.0
"""Focal length [pixels]."""

COLUMNS = 105.0, 535.0
"""Where the head is seen, while he stands at a machine [pixels]."""

DEPTHS = 1.55, 2.25
"""How far it is then from the camera [metres]."""

FRONT, AWAY, LEFT, RIGHT = np.pi / 2, -np.pi / 2, np.pi, 0.0
"""Headings: 0 is to the right, pi/2 towards the camera [radians]."""

UNLIKE = 60.0
"""Two machines in turn are this far apart in the picture, at least [pixels]."""


WORK = 40, 75
"""Time that he stays at a machine, least and most [frames]."""

WORK_AT_WALL = 60, 75
"""The same at a machine that stands at the wall: he faces away from the camera [frames]."""

WAY = 30.0
"""Least time from one machine to the next [frames]."""

SPEED = 0.35
"""Mean speed on the way, a step or two [metres/second]."""

FARTHEST = 200.0
"""The next machine is no farther away in the picture [pixels]."""

TURN = 120.0
"""Speed of the head that turns to the next machine, at its quickest [degrees/second]."""

GLANCE = 14, 24
"""Time of a look aside, there or back, least and most [frames]."""

# He faces to all four sides: the fourth operation begins by frame 431, after three times 75 frames
# at a machine and three ways of at most 0.96 m.


@dataclass(frozen=True)
class Routine:
    """Pose in every frame; arrays have the shape (n,) unless said otherwise."""

    # x, z: of the head, to the right of the camera and away from it [metres]
    x: Array
    z: Array
    crouch: Array  # how much lower the hips are than in standing [metres]
    heading: Array  # of the body: 0 is to the right, pi/2 towards the camera [radians]
    lean: Array  # of the trunk, forward [radians]
    # turn, nod, tilt: of the head: heading in the world, down from the horizon, to the left
    # [radians]
    turn: Array
    nod: Array
    tilt: Array
    # (n, 2, 3), of the left and the right wrist: to the left of the root of the neck, above it,
    # and before it, in the heading of the body [metres]
    hands: Array
    to_face: Array  # (n, 2), how far each hand goes to the face instead, in [0, 1]


@dataclass(frozen=True)
class _Operation:
    """What is done at a machine, from when he is there [frames] until he leaves."""

    start: float
    end: float
    head: tuple[float, float]  # x, z
    facing: float
    lean: float
    crouch: float
    nod: float
    hands: Array


def drawn_routine(random: np.random.Generator) -> Routine:
    """Operations one after the other until the frames are over."""
    operations = _operations(random)
    headings = _unwound([operation.facing for operation in operations])
    heading, turn = _headings(random, operations, headings)
    # On the way to the next machine he straightens up.
    moving = _moving(operations)
    lean = _keyed(operations, [o.lean for o in operations]) * (1 - 0.7 * moving)
    x, z = (_keyed(operations, [o.head[axis] for o in operations]) for axis in range(2))
    steps = np.sqrt(np.square(np.gradient(x)) + np.square(np.gradient(z))) * FRAMES_PER_SECOND
    time = np.arange(FRAMES) / FRAMES_PER_SECOND
    bob = 0.016 * np.sin(2 * np.pi * (1.9 * time + random.uniform())) * np.minimum(steps, 1.0)
    glance, peer = _glances(random, operations)
    hands = _keyed(operations, [o.hands for o in operations])
    nod = _keyed(operations, [o.nod for o in operations]) + peer
    busy = np.stack([random_wander(random, FRAMES, (0.5, 2.5), 0.018) for _ in range(6)], axis=1)
    return Routine(
        x=x + random_wander(random, FRAMES, (1.5, 5.0), 0.014),
        z=z + random_wander(random, FRAMES, (1.5, 5.0), 0.010),
        crouch=_keyed(operations, [o.crouch for o in operations]) + bob,
        heading=heading,
        lean=lean + random_wander(random, FRAMES, (1.2, 4.0), 0.02),
        turn=turn + glance + random_wander(random, FRAMES, (0.8, 4.0), 0.06),
        nod=nod + random_wander(random, FRAMES, (0.8, 4.0), 0.05),
        tilt=random_wander(random, FRAMES, (1.0, 6.0), 0.07),
        hands=hands + busy.reshape(hands.shape),
        to_face=_gesture(random, operations),
    )


def _operations(random: np.random.Generator) -> list[_Operation]:
    # He is seen from every side: the first few hold all four facings, and are always reached.
    others = random.permutation([AWAY, LEFT, RIGHT])
    facings = [FRONT, *others.tolist()]
    operations: list[_Operation] = []
    time, column = 0.0, random.uniform(*COLUMNS)
    while time < FRAMES:
        if len(operations) < len(facings):
            facing = facings[len(operations)]
        else:
            facing = random.choice([f for f in (FRONT, AWAY, LEFT, RIGHT) if f != facing])
        z = random.uniform(*DEPTHS)
        head = (column - SIZE[0] / 2) * z / FOCAL, z
        if operations:
            before = operations[-1].head
            way = np.hypot(head[0] - before[0], head[1] - before[1])
            time += max(WAY, way / SPEED * FRAMES_PER_SECOND)
        end = time + random.uniform(*(WORK_AT_WALL if facing == AWAY else WORK))
        operations.append(_operation(random, time, end, head, facing))
        time, last = end, column
        while not UNLIKE <= abs(column - last) <= FARTHEST:
            column = random.uniform(*COLUMNS)
    return operations


def _operation(
    random: np.random.Generator, start: float, end: float, head: tuple[float, float], facing: float
) -> _Operation:
    upright = not start or facing == AWAY
    lean = np.radians(random.uniform(2, 20) if upright else random.uniform(2, 42))
    squats = start > 0 and lean < np.radians(25) and random.random() < 0.3
    deepest = 20 if facing == AWAY else 34
    up = random.random() < 0.2
    nod = np.radians(random.uniform(-20, -5) if up else random.uniform(4, deepest))
    reach = random.uniform(0.30, 0.46)
    height = random.uniform(-0.45, 0.25 if facing == AWAY else -0.22)
    works = [
        np.array([side * random.uniform(0.08, 0.2), height + random.uniform(-0.08, 0.08), reach])
        for side in (1, -1)
    ]
    hangs = [np.array([side * 0.25, -0.62, 0.10]) for side in (1, -1)]
    busy = random.random(2) < 0.75
    return _Operation(
        start,
        end,
        head,
        facing + np.radians(random.uniform(-1, 1) * (10 if facing == AWAY else 20)),
        lean,
        random.uniform(0.1, 0.3) if squats else 0.0,
        nod if start else abs(nod) / 2,
        np.stack([work if b else hang for work, hang, b in zip(works, hangs, busy, strict=True)]),
    )


def _unwound(facings: list[float]) -> list[float]:
    """Return the headings in turn; he turns the shorter way."""
    headings = facings[:1]
    for facing in facings[1:]:
        headings.append(headings[-1] + (facing - headings[-1] + np.pi) % (2 * np.pi) - np.pi)
    return headings


def _headings(
    random: np.random.Generator, operations: list[_Operation], headings: list[float]
) -> tuple[Array, Array]:
    """Headings of the body and of the head, which turns first and faster."""
    time = np.arange(FRAMES, dtype=np.float64)
    body, head = np.full(FRAMES, headings[0]), np.full(FRAMES, headings[0])
    for (before, after), (old, new) in zip(pairwise(operations), pairwise(headings), strict=True):
        start, length = before.end, after.start - before.end
        quick = max(9.0, abs(new - old) / np.radians(TURN) * FRAMES_PER_SECOND * 1.5)
        ahead = start - random.uniform(2, 7)
        body += (new - old) * smooth_step(time, start, start + max(length, 1.2 * quick))
        head += (new - old) * smooth_step(time, ahead, ahead + max(0.7 * length, quick))
    # A neck turns by so much and no further.
    limit = np.radians(75)
    return body, body + limit * np.tanh((head - body) / limit)


def _glances(random: np.random.Generator, operations: list[_Operation]) -> tuple[Array, Array]:
    """Looks aside and up or down while he works."""
    time = np.arange(FRAMES, dtype=np.float64)
    aside, down = np.zeros(FRAMES), np.zeros(FRAMES)
    for operation in operations[1:]:
        if random.random() < 0.6:
            start = random.uniform(operation.start, operation.end - 10)
            rise, hold = random.uniform(*GLANCE), random.uniform(4, 14)
            there = smooth_step(time, start, start + rise)
            there = there - smooth_step(time, start + rise + hold, start + 2 * rise + hold)
            aside += random.choice([-1, 1]) * np.radians(random.uniform(25, 60)) * there
            down += np.radians(random.uniform(-20, 15)) * there
    return aside, down


def _gesture(random: np.random.Generator, operations: list[_Operation]) -> Array:
    """A hand goes to the face once in some scenes, when he does not look away."""
    time = np.arange(FRAMES, dtype=np.float64)
    hands = np.zeros((FRAMES, 2))
    turned = [o for o in operations[1:] if np.sin(o.facing) > -0.5 and o.end < FRAMES]
    if turned and random.random() < 0.6:
        operation = turned[random.integers(len(turned))]
        start = random.uniform(operation.start, operation.end - 16)
        up = smooth_step(time, start, start + 8)
        down = smooth_step(time, start + 14, start + 24)
        hands[:, random.integers(2)] = up - down
    return hands


def _keyed(operations: list[_Operation], values: list[float] | list[Array]) -> Array:
    """A value that is held in each operation, and changes smoothly on the way to the next."""
    keys = np.asarray(values, np.float64)
    time = np.arange(FRAMES, dtype=np.float64)
    total: Array = np.zeros((FRAMES, *keys.shape[1:])) + keys[0]
    for k, (before, after) in enumerate(pairwise(operations)):
        share = smooth_step(time, before.end, after.start)
        total += share.reshape(-1, *[1] * (keys.ndim - 1)) * (keys[k + 1] - keys[k])
    return total


def _moving(operations: list[_Operation]) -> Array:
    """How far he is between two machines: 0 at one, 1 half-way."""
    time = np.arange(FRAMES, dtype=np.float64)
    total = np.zeros(FRAMES)
    for before, after in pairwise(operations):
        share = smooth_step(time, before.end, after.start)
        total += 4 * share * (1 - share)
    return total
