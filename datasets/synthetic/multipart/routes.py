"""Walking paths of the target and of the people around it, as the designs require."""

from collections.abc import Callable, Iterator
from typing import TypeVar

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from trackmark.datasets.interface import Array
from trackmark.datasets.synthetic.multipart.designs import Design
from trackmark.datasets.synthetic.render.views import (
    FRAMES_PER_SECOND,
    SIZE,
    Views,
    WalkingPath,
    straight_path,
    walk_through_points,
)

T = TypeVar("T")

DIAGONAL = 1.0, 1.0  # first stretch of a target's path, sideways and in depth [metres]
ELBOW_ROOM = 0.5  # minimum distance between two people [metres]

# half width of a person in mid-step, which decides whether two people overlap [metres]
HALF_WIDTH = 0.36

HIDDEN = 22, 42  # minimum and maximum duration of an overlap with the target [frames]
KERBSIDE = 9.9  # maximum depth of the part of the near pavement without objects [metres]
OPPOSITE = 15.8, 17.2  # depth range of the pavement on the far side of the road [metres]
BESIDE = 1.4  # an overtaking person within this distance of the target must be visible [metres]
COMPANY = 2.2  # an overtaking person within this distance of the target follows its path [metres]

CROSSING_REACH, CROSSING_TIME = 1.9, 30
"""Minimum distance of a crossing person from the target [metres], except during this time before
and after the crossing [frames].
"""

UNDISTURBED = 25  # time at the start and at the end in which no person overlaps the target [frames]

ATTEMPTS = 200


def sample_followed_path(random: Generator, design: Design) -> WalkingPath:
    """Sample a target's path for a following camera: along the street and back."""
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
            yield x, _sample_depth(random, design.depths, near)
            leg += 1

    return walk_through_points(
        design.length, (0.0, middle), points(), design.speed, _sample_legs_together(random)
    )


def sample_path_in_view(random: Generator, design: Design, views: Views) -> WalkingPath:
    """Sample a target's path for a fixed camera: from side to side, in varying depth."""
    still = views.still

    def points() -> Iterator[tuple[float, float]]:
        side, near = float(random.choice([-1, 1])), bool(random.integers(2))
        first = True
        while True:
            z = _sample_depth(random, design.depths, near)
            half = SIZE[0] / 2 / float(still.scale(z))
            x = side * random.uniform(0.55, 0.85) * half
            yield x, z
            if first:
                yield x - side * DIAGONAL[0], z + (DIAGONAL[1] if near else -DIAGONAL[1])
            side, near, first = -side, not near, False

    ways = points()
    return walk_through_points(
        design.length, next(ways), ways, design.speed, _sample_legs_together(random)
    )


def sample_path_before_target(
    random: Generator,
    views: Views,
    target: WalkingPath,
    others: list[WalkingPath],
    meeting_frame: float,
) -> WalkingPath:
    """Sample the path of a person who passes between camera and target around a frame."""
    frames = len(target.x)

    def candidate() -> WalkingPath:
        frame = round(meeting_frame + random.uniform(-0.05, 0.05) * frames)
        z = max(target.z[frame] - random.uniform(0.8, 1.6), 4.4)
        x = _aligned_x(views, frame, target, z)
        velocity = random.choice([-1, 1]) * random.uniform(0.6, 1.4), random.uniform(-0.15, 0.15)
        return straight_path(frames, frame, (x, z), velocity, random.uniform())

    def cost(path: WalkingPath) -> int:
        overlaps = _overlap_frames(views, path, target)
        together = sum(
            int((overlaps & _overlap_frames(views, other, target)).sum()) for other in others
        )
        return together + _bad_occlusion_frames(overlaps) + _crowded_frames(path, [target, *others])

    return _best_candidate(candidate, cost)


def sample_post_place(
    random: Generator, views: Views, target: WalkingPath, others: list[WalkingPath]
) -> WalkingPath:
    """Sample the position of a static object that occludes the target when it passes."""
    frames = len(target.x)

    def candidate() -> WalkingPath:
        frame = int(random.integers(UNDISTURBED, frames - UNDISTURBED))
        z = target.z[frame] - random.uniform(0.6, 1.2)
        return straight_path(
            frames, frame, (_aligned_x(views, frame, target, z), z), (0.0, 0.0), 0.0
        )

    def cost(place: WalkingPath) -> int:
        overlaps = _overlap_frames(views, place, target)
        # The target passes behind the object and never in front of it.
        before = overlaps & (target.z < place.z + ELBOW_ROOM)
        crowded = _crowded_frames(place, [target, *others])
        return int(before.sum()) + _bad_occlusion_frames(overlaps) + crowded

    return _best_candidate(candidate, cost)


def sample_path_behind_target(
    random: Generator, views: Views, target: WalkingPath, others: list[WalkingPath], nearest: float
) -> WalkingPath:
    """Sample the path of a visible person whose depth is at least `nearest` [metres]."""
    frames = len(target.x)

    def candidate() -> WalkingPath:
        frame = int(random.integers(frames))
        lanes = ((nearest, KERBSIDE), OPPOSITE)
        z = random.uniform(*lanes[int(random.random() < 0.35)])
        x = views[frame].x + random.uniform(-0.45, 0.45) * SIZE[0] / float(views.still.scale(z))
        velocity = random.choice([-1, 1]) * random.uniform(0.7, 1.5), random.uniform(-0.06, 0.06)
        return straight_path(frames, frame, (x, z), velocity, random.uniform())

    return _best_candidate(candidate, lambda path: _crowded_frames(path, [target, *others]))


def sample_overtaking_path(
    random: Generator,
    views: Views,
    target: WalkingPath,
    others: list[WalkingPath],
    meeting_frame: float,
    pace: float,
) -> WalkingPath:
    """Sample the path of a person who walks behind the target, and overtakes it or falls back.

    `pace` is the speed relative to the target [metres/second]. In `meeting_frame`, both are in one
    image column.
    """
    frames = len(target.x)

    def candidate() -> WalkingPath:
        frame = meeting_frame + random.uniform(-0.1, 0.1) * frames
        speed = random.choice([-1, 1]) * pace * random.uniform(0.92, 1.08)
        ahead = speed * (np.arange(frames) - frame) / FRAMES_PER_SECOND
        together = np.flatnonzero(np.abs(ahead) <= COMPANY)
        x, z = target.x + ahead, target.z + random.uniform(0.55, 0.75)
        return WalkingPath.through(
            _extrapolate(x, together), _hold_depth(z, together), random.uniform()
        )

    def cost(path: WalkingPath) -> int:
        close = np.abs(path.x - target.x) < BESIDE
        column = views.still.column(path.x - views.x, path.z) + views.shift_x
        hidden = np.abs(column - SIZE[0] / 2) > SIZE[0] / 2 - 25
        for other in others:
            hidden |= _overlap_frames(views, other, target)
        before = _overlap_frames(views, path, target) & (path.z < target.z)
        meets_again = len(target.x) * int(np.count_nonzero(np.diff(close)) > 2)
        disturbed = int((hidden & close).sum() + before.sum()) + meets_again
        return disturbed + _crowded_frames(path, [target, *others])

    return _best_candidate(candidate, cost)


def sample_crossing_path(
    random: Generator,
    views: Views,
    target: WalkingPath,
    others: list[WalkingPath],
    parts: tuple[float, float],
) -> WalkingPath:
    """Sample a path that crosses in front of the target.

    `parts` is the range of the time of the crossing, relative to the length of the sequence.
    """
    frames = len(target.x)

    def candidate() -> tuple[int, WalkingPath]:
        frame = round(random.uniform(*parts) * frames)
        z = target.z[frame] - random.uniform(0.55, 0.7)
        velocity = random.choice([-1, 1]) * random.uniform(1.1, 1.8), random.uniform(-0.1, 0.1)
        place = _aligned_x(views, frame, target, z), z
        return frame, straight_path(frames, frame, place, velocity, random.uniform())

    def cost(candidate: tuple[int, WalkingPath]) -> int:
        frame, path = candidate
        near = np.abs(path.x - target.x) < CROSSING_REACH
        near[frame - CROSSING_TIME : frame + CROSSING_TIME] = False
        return int(near.sum()) + _crowded_frames(path, [target, *others])

    return _best_candidate(candidate, cost)[1]


def _extrapolate(x: Array, frames: NDArray[np.int64]) -> Array:
    """Extrapolate positions with constant velocity before and after the given frames."""
    first, last = int(frames[0]), int(frames[-1])
    since, until = np.arange(len(x)) - last, np.arange(len(x)) - first
    after = x[last] + since * (x[last] - x[last - 1])
    before = x[first] + until * (x[first + 1] - x[first])
    return np.where(since > 0, after, np.where(until < 0, before, x))


def _hold_depth(z: Array, frames: NDArray[np.int64]) -> Array:
    """Return depths that are constant before and after the given frames."""
    return np.asarray(z[np.clip(np.arange(len(z)), frames[0], frames[-1])])


def _sample_legs_together(random: Generator) -> float:
    """Return a gait phase in which one leg passes the other [cycles]."""
    return float(random.choice([0.0, 0.5]) + random.uniform(-0.05, 0.05))


def _sample_depth(random: Generator, depths: tuple[float, float], near: bool) -> float:
    low, high = depths
    margin = 0.15 * (high - low)
    return random.uniform(low, low + margin) if near else random.uniform(high - margin, high)


def _aligned_x(views: Views, frame: int, target: WalkingPath, z: float) -> float:
    """Return the lateral position [metres] at depth z that is in the target's image column."""
    camera = views[frame]
    ratio = z / float(target.z[frame])
    return camera.x + (float(target.x[frame]) - camera.x) * ratio


def _overlap_frames(views: Views, path: WalkingPath, target: WalkingPath) -> NDArray[np.bool_]:
    """Return for every frame whether two bodies overlap in image columns."""
    x = (path.x - views.x) / path.z - (target.x - views.x) / target.z
    return np.asarray(np.abs(x) < HALF_WIDTH * (1 / path.z + 1 / target.z))


def _bad_occlusion_frames(overlaps: NDArray[np.bool_]) -> int:
    """Count the frames by which occlusions are too long, too short, too early or too late."""
    edges = np.flatnonzero(np.diff(overlaps, prepend=False, append=False))
    times = edges[1::2] - edges[::2]
    off = np.maximum(HIDDEN[0] - times, times - HIDDEN[1])
    return int(
        np.maximum(off, 0).sum() + overlaps[:UNDISTURBED].sum() + overlaps[-UNDISTURBED:].sum()
    )


def _crowded_frames(path: WalkingPath, others: list[WalkingPath]) -> int:
    """Count the frames in which two people are too close."""
    near = np.zeros(len(path.x), np.bool_)
    for other in others:
        x, z = path.x - other.x, path.z - other.z
        near |= x * x + z * z < ELBOW_ROOM * ELBOW_ROOM
    return int(near.sum())


def _best_candidate(candidate: Callable[[], T], cost: Callable[[T], int]) -> T:
    """Return the first candidate with the cost 0, or else the candidate with the lowest cost."""
    best = candidate()
    lowest_cost = cost(best)
    for _ in range(ATTEMPTS):
        if lowest_cost == 0:
            break
        other = candidate()
        other_cost = cost(other)
        if other_cost < lowest_cost:
            best, lowest_cost = other, other_cost
    return best


def sample_path_beside_target(
    random: Generator, views: Views, target: WalkingPath, width: Array, distance: float
) -> WalkingPath:
    """Sample the path of a person who approaches the target until mid-sequence, and leaves again.

    `distance` is the minimum horizontal distance in the image between the axes of the two bodies,
    in widths of the target's box.
    """
    frames = len(target.x)
    since = np.arange(frames) - frames // 2
    way = 0.09 * since
    beyond = random.choice([-1, 1]) * width * (distance + np.sqrt(1 + way * way) - 1)
    z = target.z - random.uniform(0.6, 0.8)
    x = target.x * z / target.z + beyond / views.still.scale(z)
    return WalkingPath.through(x, z, random.uniform())
