"""Where people walk: the target by his design, the others so that they hide him as designed."""

from collections.abc import Callable, Iterator
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.synthetic.multipart.designs import Design
from trackmark.datasets.synthetic.render.views import (
    FRAMES_PER_SECOND,
    SIZE,
    Views,
    WalkingPath,
    straight_path,
    walk_through_points,
)

Array = NDArray[np.float64]
T = TypeVar("T")

DIAGONAL = 1.0, 1.0
"""First way of a target, aside and in depth: it is first seen at an angle [metres]."""

ELBOW_ROOM = 0.5
"""Nobody walks nearer to another [metres]."""

HALF_WIDTH = 0.36
"""Of a person in mid-step, when it is asked whether one hides another [metres]."""

HIDDEN = 22, 42
"""Time for which something before the target overlaps him [frames]."""

KERBSIDE = 9.9
"""Where the near pavement is free of what stands at the kerb [metres]."""

OPPOSITE = 15.8, 17.2
"""The pavement on the other side [metres]."""

BESIDE = 1.4
"""Distance up to which someone who overtakes the target is in view and disturbed by nobody [m]."""

COMPANY = 2.2
"""Distance up to which someone who overtakes the target follows its way [metres]."""

CROSSING_REACH, CROSSING_TIME = 1.9, 30
"""Who crosses is nearer to the target than this [metres] only around the crossing [frames]."""

UNDISTURBED = 25
"""Nobody overlaps the target for this long at either end [frames]."""

ATTEMPTS = 200


def along_the_street(random: np.random.Generator, design: Design) -> WalkingPath:
    """Way of a target that a camera follows: along the street, nearer and farther, and back."""
    legs = max(1, round(design.length / FRAMES_PER_SECOND * design.speed / 4.5))
    backs = {round(legs * (k + 1) / (design.turns + 1)) for k in range(design.turns)}

    middle = sum(design.depths) / 2

    def points() -> Iterator[tuple[float, float]]:
        x, direction, leg = 0.0, float(random.choice([-1, 1])), 0
        near = bool(random.integers(2))
        yield direction * DIAGONAL[0], middle + (DIAGONAL[1] if near else -DIAGONAL[1])
        while True:
            direction = -direction if leg in backs else direction
            x += direction * random.uniform(3.0, 6.5)
            near = not near if random.random() < 0.8 else near
            yield x, _depth(random, design.depths, near)
            leg += 1

    return walk_through_points(
        design.length, (0.0, middle), points(), design.speed, _legs_together(random)
    )


def in_view(random: np.random.Generator, design: Design, views: Views) -> WalkingPath:
    """Way of a target before a fixed camera: from side to side, nearer and farther."""
    still = views.still

    def points() -> Iterator[tuple[float, float]]:
        side, near = float(random.choice([-1, 1])), bool(random.integers(2))
        first = True
        while True:
            z = _depth(random, design.depths, near)
            half = SIZE[0] / 2 / float(still.scale(z))
            x = side * random.uniform(0.55, 0.85) * half
            yield x, z
            if first:
                yield x - side * DIAGONAL[0], z + (DIAGONAL[1] if near else -DIAGONAL[1])
            side, near, first = -side, not near, False

    ways = points()
    return walk_through_points(
        design.length, next(ways), ways, design.speed, _legs_together(random)
    )


def before_the_target(
    random: np.random.Generator,
    views: Views,
    target: WalkingPath,
    others: list[WalkingPath],
    when: float,
) -> WalkingPath:
    """Way of someone who passes between the camera and the target about a frame."""
    frames = len(target.x)

    def candidate() -> WalkingPath:
        at = round(when + random.uniform(-0.05, 0.05) * frames)
        z = max(target.z[at] - random.uniform(0.8, 1.6), 4.4)
        x = _abreast(views, at, target, z)
        velocity = random.choice([-1, 1]) * random.uniform(0.6, 1.4), random.uniform(-0.15, 0.15)
        return straight_path(frames, at, (x, z), velocity, random.uniform())

    def trouble(course: WalkingPath) -> int:
        overlaps = _overlaps(views, course, target)
        together = sum(int((overlaps & _overlaps(views, other, target)).sum()) for other in others)
        return together + _hidden_badly(overlaps) + _crowded(course, [target, *others])

    return _least(candidate, trouble)


def post(
    random: np.random.Generator, views: Views, target: WalkingPath, others: list[WalkingPath]
) -> WalkingPath:
    """Place of something that stands where the target passes behind it."""
    frames = len(target.x)

    def candidate() -> WalkingPath:
        at = int(random.integers(UNDISTURBED, frames - UNDISTURBED))
        z = target.z[at] - random.uniform(0.6, 1.2)
        return straight_path(frames, at, (_abreast(views, at, target, z), z), (0.0, 0.0), 0.0)

    def trouble(place: WalkingPath) -> int:
        overlaps = _overlaps(views, place, target)
        # He passes behind it, and never before it.
        before = overlaps & (target.z < place.z + ELBOW_ROOM)
        crowded = _crowded(place, [target, *others])
        return int(before.sum()) + _hidden_badly(overlaps) + crowded

    return _least(candidate, trouble)


def behind_the_target(
    random: np.random.Generator,
    views: Views,
    target: WalkingPath,
    others: list[WalkingPath],
    nearest: float,
) -> WalkingPath:
    """Way of someone who is in view at some time, no nearer than `nearest` [metres]."""
    frames = len(target.x)

    def candidate() -> WalkingPath:
        at = int(random.integers(frames))
        lanes = ((nearest, KERBSIDE), OPPOSITE)
        z = random.uniform(*lanes[int(random.random() < 0.35)])
        x = views[at].x + random.uniform(-0.45, 0.45) * SIZE[0] / float(views.still.scale(z))
        velocity = random.choice([-1, 1]) * random.uniform(0.7, 1.5), random.uniform(-0.06, 0.06)
        return straight_path(frames, at, (x, z), velocity, random.uniform())

    return _least(candidate, lambda course: _crowded(course, [target, *others]))


def overtaking(
    random: np.random.Generator,
    views: Views,
    target: WalkingPath,
    others: list[WalkingPath],
    when: float,
    pace: float,
) -> WalkingPath:
    """Way of someone who overtakes the target, or falls behind it, farther from the camera.

    `pace` is the speed relative to the target [metres/second], `when` the frame of the meeting.
    """
    frames = len(target.x)

    def candidate() -> WalkingPath:
        at = when + random.uniform(-0.1, 0.1) * frames
        speed = random.choice([-1, 1]) * pace * random.uniform(0.92, 1.08)
        ahead = speed * (np.arange(frames) - at) / FRAMES_PER_SECOND
        together = np.flatnonzero(np.abs(ahead) <= COMPANY)
        x, z = target.x + ahead, target.z + random.uniform(0.55, 0.75)
        return WalkingPath.through(_straight_on(x, together), _held(z, together), random.uniform())

    def trouble(course: WalkingPath) -> int:
        beside = np.abs(course.x - target.x) < BESIDE
        column = views.still.column(course.x - views.x, course.z) + views.shift_x
        hidden = np.abs(column - SIZE[0] / 2) > SIZE[0] / 2 - 25
        for other in others:
            hidden |= _overlaps(views, other, target)
        before = _overlaps(views, course, target) & (course.z < target.z)
        meets_again = len(target.x) * int(np.count_nonzero(np.diff(beside)) > 2)
        disturbed = int((hidden & beside).sum() + before.sum()) + meets_again
        return disturbed + _crowded(course, [target, *others])

    return _least(candidate, trouble)


def crossing(
    random: np.random.Generator,
    views: Views,
    target: WalkingPath,
    others: list[WalkingPath],
    parts: tuple[float, float],
) -> WalkingPath:
    """Way of someone who passes before the target at a part of it, and is near for a short time."""
    frames = len(target.x)

    def candidate() -> tuple[int, WalkingPath]:
        at = round(random.uniform(*parts) * frames)
        z = target.z[at] - random.uniform(0.55, 0.7)
        velocity = random.choice([-1, 1]) * random.uniform(1.1, 1.8), random.uniform(-0.1, 0.1)
        place = _abreast(views, at, target, z), z
        return at, straight_path(frames, at, place, velocity, random.uniform())

    def trouble(candidate: tuple[int, WalkingPath]) -> int:
        at, course = candidate
        near = np.abs(course.x - target.x) < CROSSING_REACH
        near[at - CROSSING_TIME : at + CROSSING_TIME] = False
        return int(near.sum()) + _crowded(course, [target, *others])

    return _least(candidate, trouble)[1]


def _straight_on(x: Array, frames: NDArray[np.int64]) -> Array:
    """Places that go on at the last velocity before and after some frames."""
    first, last = int(frames[0]), int(frames[-1])
    since, until = np.arange(len(x)) - last, np.arange(len(x)) - first
    after = x[last] + since * (x[last] - x[last - 1])
    before = x[first] + until * (x[first + 1] - x[first])
    return np.where(since > 0, after, np.where(until < 0, before, x))


def _held(z: Array, frames: NDArray[np.int64]) -> Array:
    """Depths that keep the first and the last value outside some frames."""
    return np.asarray(z[np.clip(np.arange(len(z)), frames[0], frames[-1])])


def _legs_together(random: np.random.Generator) -> float:
    """Phase of the gait in which one leg passes the other [cycles]."""
    return float(random.choice([0.0, 0.5]) + random.uniform(-0.05, 0.05))


def _depth(random: np.random.Generator, depths: tuple[float, float], near: bool) -> float:
    low, high = depths
    margin = 0.15 * (high - low)
    return random.uniform(low, low + margin) if near else random.uniform(high - margin, high)


def _abreast(views: Views, frame: int, target: WalkingPath, z: float) -> float:
    """Lateral place [metres] at depth z that is seen in the target's column."""
    camera = views[frame]
    ratio = z / float(target.z[frame])
    return camera.x + (float(target.x[frame]) - camera.x) * ratio


def _overlaps(views: Views, course: WalkingPath, target: WalkingPath) -> NDArray[np.bool_]:
    """Where the two bodies share columns of the image."""
    x = (course.x - views.x) / course.z - (target.x - views.x) / target.z
    return np.asarray(np.abs(x) < HALF_WIDTH * (1 / course.z + 1 / target.z))


def _hidden_badly(overlaps: NDArray[np.bool_]) -> int:
    """Frames by which the target is hidden too long or too shortly, too early or too late."""
    edges = np.flatnonzero(np.diff(overlaps, prepend=False, append=False))
    times = edges[1::2] - edges[::2]
    off = np.maximum(HIDDEN[0] - times, times - HIDDEN[1])
    return int(
        np.maximum(off, 0).sum() + overlaps[:UNDISTURBED].sum() + overlaps[-UNDISTURBED:].sum()
    )


def _crowded(course: WalkingPath, others: list[WalkingPath]) -> int:
    """Frames in which two are nearer than they would walk."""
    near = np.zeros(len(course.x), np.bool_)
    for other in others:
        x, z = course.x - other.x, course.z - other.z
        near |= x * x + z * z < ELBOW_ROOM * ELBOW_ROOM
    return int(near.sum())


def _least(candidate: Callable[[], T], trouble: Callable[[T], int]) -> T:
    """First candidate without trouble; where there is none, that of the least."""
    best = candidate()
    least = trouble(best)
    for _ in range(ATTEMPTS):
        if least == 0:
            break
        other = candidate()
        amount = trouble(other)
        if amount < least:
            best, least = other, amount
    return best


def beside_the_target(
    random: np.random.Generator, views: Views, target: WalkingPath, width: Array, distance: float
) -> WalkingPath:
    """Way of someone who comes as near as `distance`, in mid-sequence, and goes again.

    `distance` is the least one of the two bodies' axes, sideways, in widths of the target's box,
    shape (n,) [pixels].
    """
    frames = len(target.x)
    since = np.arange(frames) - frames // 2
    way = 0.09 * since
    beyond = random.choice([-1, 1]) * width * (distance + np.sqrt(1 + way * way) - 1)
    z = target.z - random.uniform(0.6, 0.8)
    x = target.x * z / target.z + beyond / views.still.scale(z)
    return WalkingPath.through(x, z, random.uniform())
