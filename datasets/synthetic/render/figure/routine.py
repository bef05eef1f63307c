"""Random routine of a worker: operations at several machines.

Nummiaro et al. (2003) mention several operations on different machines, large out-of-plane
rotations of the head and unpredictable locations. They give no speeds. Each routine therefore draws
its speed from the range of recorded heads (see PACE).
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.random import Generator

from trackmark.datasets.interface import Array
from trackmark.datasets.synthetic.render.figure.body import TRUNK
from trackmark.datasets.synthetic.render.path import smooth_step
from trackmark.datasets.synthetic.render.views import random_wander

SIZE = 640, 480  # width and height of the images [pixels]

FRAMES = 450
FRAMES_PER_SECOND = 25.0

FOCAL = 700.0  # focal length [pixels]
COLUMNS = 105.0, 535.0  # range of image columns of the head at a machine [pixels]
DEPTHS = 1.55, 2.25  # range of distances of the head from the camera at a machine [metres]

# headings of the body: 0 is to the right, pi/2 towards the camera [radians]
FRONT, AWAY, LEFT, RIGHT = np.pi / 2, -np.pi / 2, np.pi, 0.0

# Bounds of the distance between consecutive machines in the image [pixels]. A fast worker goes
# farther, so that a walk takes at least BRIEF frames; a slow one stays nearer, for at most LONG.
NEAREST, FARTHEST = 60.0, 200.0
BRIEF, LONG = 10.0, 60.0

# Range of the highest speed of a walk [mean sides of the head's box per frame]. Each routine draws
# it log-uniformly. The bounds are the 95th percentiles of the speed of two recorded heads: a head
# at a desk (sequence `samples/face`), and a head in sport (OTB, Football1).
PACES = 0.03, 0.31
PEAK = 1.5  # highest speed of a walk relative to its mean speed, for smooth steps
HEAD_SIDE = 0.24  # mean side of a head's box [metres]

WORK = 40, 75  # minimum and maximum time at a machine [frames]

# time range at a machine if the worker stands with the back to the camera [frames]
WORK_AT_WALL = 60, 75

TURN = 120.0  # maximum speed at which the head turns to the next machine [degrees/second]

# minimum and maximum duration of a glance aside, and of the return of the head [frames]
GLANCE = 14, 24


STRAIGHTENED = 0.7  # fraction by which the lean is smaller half-way between two machines


@dataclass(frozen=True)
class Routine:
    """Pose in every frame; arrays have the shape (n,) unless stated otherwise."""

    x: Array  # position of the head, to the right of the camera [metres]
    z: Array  # position of the head, away from the camera [metres]
    crouch: Array  # distance by which the hips are lower than when standing [metres]
    heading: Array  # heading of the body: 0 is to the right, pi/2 towards the camera [radians]
    lean: Array  # angle of the trunk, from upright to forward [radians]
    turn: Array  # heading of the head in the world [radians]
    nod: Array  # angle of the head, from the horizon downwards [radians]
    tilt: Array  # angle of the head, from upright to the left [radians]
    # (n, 2, 3), left and right wrist relative to the base of the neck: left, up and forward in the
    # heading of the body [metres]
    hands: Array
    to_face: Array  # (n, 2), progress of the motion of each hand to the face, in [0, 1]


@dataclass(frozen=True)
class _Operation:
    """Pose at a machine between the frames of arrival and departure."""

    start: float
    end: float
    head: tuple[float, float]  # x, z
    facing: float
    lean: float
    crouch: float
    nod: float
    hands: Array


def sample_routine(random: Generator) -> Routine:
    """Sample consecutive operations for all frames."""
    operations = _sample_operations(random)
    headings = _continuous_headings([operation.facing for operation in operations])
    heading, turn = _headings(random, operations, headings)
    moving = _transition(operations)
    lean = _interpolate_operations(operations, [o.lean for o in operations])
    lean *= 1 - STRAIGHTENED * moving
    x, z = (
        _interpolate_operations(operations, [o.head[axis] for o in operations]) for axis in range(2)
    )
    steps = np.sqrt(np.square(np.gradient(x)) + np.square(np.gradient(z))) * FRAMES_PER_SECOND
    time = np.arange(FRAMES) / FRAMES_PER_SECOND
    bob = 0.016 * np.sin(2 * np.pi * (1.9 * time + random.uniform())) * np.minimum(steps, 1.0)
    glance, peer = _sample_glances(random, operations)
    hands = _interpolate_operations(operations, [o.hands for o in operations])
    nod = _interpolate_operations(operations, [o.nod for o in operations]) + peer
    busy = np.stack([random_wander(random, FRAMES, (0.5, 2.5), 0.018) for _ in range(6)], axis=1)
    return Routine(
        x=x + random_wander(random, FRAMES, (1.5, 5.0), 0.014),
        z=z + random_wander(random, FRAMES, (1.5, 5.0), 0.010),
        crouch=_interpolate_operations(operations, [o.crouch for o in operations]) + bob,
        heading=heading,
        lean=lean + random_wander(random, FRAMES, (1.2, 4.0), 0.02),
        turn=turn + glance + random_wander(random, FRAMES, (0.8, 4.0), 0.06),
        nod=nod + random_wander(random, FRAMES, (0.8, 4.0), 0.05),
        tilt=random_wander(random, FRAMES, (1.0, 6.0), 0.07),
        hands=hands + busy.reshape(hands.shape),
        to_face=_sample_gesture(random, operations),
    )


def _sample_operations(random: Generator) -> list[_Operation]:
    pace = float(np.exp(random.uniform(*np.log(PACES)))) * HEAD_SIDE  # [metres/frame]
    speed = float(pace / PEAK * FOCAL / np.mean(DEPTHS))  # mean speed of walks [pixels/frame]
    nearest = max(NEAREST, BRIEF * speed)
    farthest = max(min(FARTHEST, LONG * speed), 1.5 * nearest)
    # The first four operations face all four sides; in a slow routine, the video may end earlier.
    other_facings = random.permutation([AWAY, LEFT, RIGHT])
    facings = [FRONT, *other_facings.tolist()]
    operations: list[_Operation] = []
    time, column = 0.0, random.uniform(*COLUMNS)
    while time < FRAMES:
        if len(operations) < len(facings):
            facing = facings[len(operations)]
        else:
            facing = random.choice([f for f in (FRONT, AWAY, LEFT, RIGHT) if f != facing])
        z = random.uniform(*DEPTHS)
        head = (column - SIZE[0] / 2) * z / FOCAL, z
        operation = _sample_operation(random, head, facing, first=not operations)
        if operations:
            time += max(BRIEF, _walked(operations[-1], operation) * PEAK / pace)
        end = time + random.uniform(*(WORK_AT_WALL if facing == AWAY else WORK))
        operations.append(replace(operation, start=time, end=end))
        time, last = end, column
        while not nearest <= abs(column - last) <= farthest:
            column = random.uniform(*COLUMNS)
    return operations


def _walked(before: _Operation, after: _Operation) -> float:
    """Return the path of the head between two operations, parallel to the image [metres].

    The head moves sideways, and up and down as the worker straightens and bends.
    """
    z = (before.head[1] + after.head[1]) / 2
    across = z * (after.head[0] / after.head[1] - before.head[0] / before.head[1])
    lean, crouch = (before.lean + after.lean) / 2, (before.crouch + after.crouch) / 2
    half_way = crouch + _lowering((1 - STRAIGHTENED) * lean)
    vertical = sum(abs(o.crouch + _lowering(o.lean) - half_way) for o in (before, after))
    return float(np.hypot(across, vertical))


def _lowering(lean: float) -> float:
    """Return the distance by which a lean of the trunk lowers the head [metres]."""
    return float(TRUNK * (1 - np.cos(lean)))


def _sample_operation(
    random: Generator, head: tuple[float, float], facing: float, *, first: bool
) -> _Operation:
    """Sample the pose of an operation; its start and end are not known yet."""
    upright = first or facing == AWAY
    lean = np.radians(random.uniform(2, 20) if upright else random.uniform(2, 42))
    squats = not first and lean < np.radians(25) and random.random() < 0.3
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
        0.0,
        0.0,
        head,
        facing + np.radians(random.uniform(-1, 1) * (10 if facing == AWAY else 20)),
        lean,
        random.uniform(0.1, 0.3) if squats else 0.0,
        abs(nod) / 2 if first else nod,
        np.stack([work if b else hang for work, hang, b in zip(works, hangs, busy, strict=True)]),
    )


def _continuous_headings(facings: list[float]) -> list[float]:
    """Return continuous headings with each turn in the shorter direction."""
    headings = facings[:1]
    for facing in facings[1:]:
        headings.append(headings[-1] + (facing - headings[-1] + np.pi) % (2 * np.pi) - np.pi)
    return headings


def _headings(
    random: Generator, operations: list[_Operation], headings: list[float]
) -> tuple[Array, Array]:
    """Return the headings of body and head; the head turns earlier and faster."""
    time = np.arange(FRAMES, dtype=np.float64)
    body, head = np.full(FRAMES, headings[0]), np.full(FRAMES, headings[0])
    for (before, after), (old, new) in zip(pairwise(operations), pairwise(headings), strict=True):
        start, length = before.end, after.start - before.end
        quick = max(9.0, abs(new - old) / np.radians(TURN) * FRAMES_PER_SECOND * 1.5)
        ahead = start - random.uniform(2, 7)
        body += (new - old) * smooth_step(time, start, start + max(length, 1.2 * quick))
        head += (new - old) * smooth_step(time, ahead, ahead + max(0.7 * length, quick))
    # Limit of the neck's rotation.
    limit = np.radians(75)
    return body, body + limit * np.tanh((head - body) / limit)


def _sample_glances(random: Generator, operations: list[_Operation]) -> tuple[Array, Array]:
    """Sample glances aside, up and down during operations."""
    time = np.arange(FRAMES, dtype=np.float64)
    aside, down = np.zeros(FRAMES), np.zeros(FRAMES)
    for operation in operations[1:]:
        if random.random() < 0.6:
            start = random.uniform(operation.start, operation.end - 10)
            rise, hold = random.uniform(*GLANCE), random.uniform(4, 14)
            progress = smooth_step(time, start, start + rise)
            progress = progress - smooth_step(time, start + rise + hold, start + 2 * rise + hold)
            aside += random.choice([-1, 1]) * np.radians(random.uniform(25, 60)) * progress
            down += np.radians(random.uniform(-20, 15)) * progress
    return aside, down


def _sample_gesture(random: Generator, operations: list[_Operation]) -> Array:
    """Sample the motion of a hand to the visible face and back; in some scenes, no hand moves."""
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


def _interpolate_operations(
    operations: list[_Operation], values: list[float] | list[Array]
) -> Array:
    """Return a value that is constant in each operation and changes smoothly between them."""
    keys = np.asarray(values, np.float64)
    time = np.arange(FRAMES, dtype=np.float64)
    total: Array = np.zeros((FRAMES, *keys.shape[1:])) + keys[0]
    for k, (before, after) in enumerate(pairwise(operations)):
        share = smooth_step(time, before.end, after.start)
        total += share.reshape(-1, *[1] * (keys.ndim - 1)) * (keys[k + 1] - keys[k])
    return total


def _transition(operations: list[_Operation]) -> Array:
    """Return a value for every frame: 0 at a machine, 1 half-way between two machines."""
    time = np.arange(FRAMES, dtype=np.float64)
    total = np.zeros(FRAMES)
    for before, after in pairwise(operations):
        share = smooth_step(time, before.end, after.start)
        total += 4 * share * (1 - share)
    return total
