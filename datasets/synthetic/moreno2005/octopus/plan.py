"""Where the octopus crawls, over which floors, and when it takes on their looks."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.synthetic.moreno2005.octopus.body import Body, Posture, drawn_body
from trackmark.datasets.synthetic.moreno2005.octopus.looks import FLOOR_KINDS, SKINS, imitated
from trackmark.datasets.synthetic.render.path import quantised, smooth_step
from trackmark.datasets.synthetic.scene import part_generator

Array = NDArray[np.float64]

FRAMES = 100
SIZE = 320, 240
# Columns between which the head starts and arrives, or the other way round [pixels].
ENDS = ((74.0, 92.0), (228.0, 246.0))
LEVELS = 92.0, 148.0  # rows between which it does so [pixels]
BULGE = 14.0  # how far its way bends out at most [pixels]
TINT = 0.08  # by what part of it a channel of a colour differs from its kind's at most
# When the octopus begins to take on the look of the floor on which it starts [frames].
FIRST_CHANGE = 8.0, 16.0
# From when it is mostly on another floor until it begins to take on that one's look [frames].
DELAY = 3.0, 8.0
LASTING = 12.0, 20.0  # how long it takes to do so [frames]
AROUND = 2.0  # how far the floor around the octopus is from its box [pixels]
# Greatest distance of a camouflaged octopus's mean colour from the floors', RGB of [0, 1].
CLOSE = 0.2
# Least distance of the colour with which it comes from that of the first floor, likewise.
CONTRAST = 0.25

# Kinds of floor in a scene: that on which the octopus starts, that where it goes, another.
FLOORS = 3
OWN = FLOORS  # index of the look with which it comes; those before are those of the floors
SOFT = 4.0  # about how far one floor reaches into another [pixels]
# Of the borders, in either direction: size and length [pixels].
WAVES = ((9.0, 75.0), (4.0, 31.0), (2.0, 14.0))
# Least distance of further zones from the way, and from one another [pixels].
ASIDE, APART = 105.0, 80.0
TRIALS = 60  # places that are tried for them


@dataclass(frozen=True)
class Zones:
    """Zones around points, with wavy borders."""

    points: Array  # (k, 2): [pixels]
    floors: NDArray[np.int64]  # (k,): index of each zone's floor
    phases: Array  # (2, 3): of the waves

    def shares(self, places: Array) -> Array:
        """How much of each floor is at places of shape (..., 2); shape (..., FLOORS)."""
        bent = places.copy()
        for (size, length), phases in zip(WAVES, self.phases.T, strict=True):
            bent += size * np.sin(2 * np.pi * places[..., ::-1] / length + phases)
        distance = np.linalg.norm(bent[..., None, :] - self.points, axis=-1)
        nearest = np.stack(
            [distance[..., self.floors == floor].min(axis=-1) for floor in range(FLOORS)], axis=-1
        )
        weights = np.exp((nearest.min(axis=-1, keepdims=True) - nearest) / SOFT)
        return np.asarray(weights / weights.sum(axis=-1, keepdims=True))


def _drawn_zones(random: np.random.Generator, way: Array) -> Zones:
    """Zones in the picture: two that share a way, shape (n, 2), and others beside it."""
    points = [way[len(way) // 8], way[-len(way) // 8]]
    for place in random.uniform((-50, -50), np.array(SIZE) + 50, (TRIALS, 2)):
        far = np.linalg.norm(way - place, axis=1).min() > ASIDE
        if far and np.linalg.norm(points - place, axis=1).min() > APART:
            points.append(place)
    further = random.permutation(np.arange(len(points) - 2) + 2) % FLOORS
    floors = np.concatenate([[0, 1], further])
    # What is nowhere else is far away.
    points.append(np.full(2, 1e4))
    phases = random.uniform(0, 2 * np.pi, (2, len(WAVES)))
    return Zones(np.array(points), np.append(floors, FLOORS - 1), phases)


@dataclass(frozen=True)
class Plan:
    """The course of events."""

    body: Body
    place: Array  # (FRAMES, 2): of the head [pixels]
    heading: Array  # (FRAMES,): of the body, from x towards y [radians]
    zones: Zones
    kinds: tuple[str, ...]  # of the floors, and of the skin that is its own
    colours: Array  # (FLOORS + 1, 3): mean of each, RGB in [0, 1]
    changes: Array  # (2, 2): start and end of that to either floor's look [frames]

    def posture(self, frame: int) -> Posture:
        """How the octopus lies there."""
        return self.body.at(frame, self.place[frame], float(self.heading[frame]))

    @cached_property
    def boxes(self) -> Array:
        """Extents of the whole octopus, shape (FRAMES, 4): x, y, width, height [pixels]."""
        return np.stack([self.posture(frame).box for frame in range(FRAMES)])

    def look(self, frame: int) -> tuple[int, int, float]:
        """The looks from which to which it changes, and how far it has come, in [0, 1]."""
        first, second = (
            float(smooth_step(np.array(float(frame)), *change)) for change in self.changes
        )
        return (0, 1, second) if second > 0 else (OWN, 0, first)

    @cached_property
    def camouflaged(self) -> NDArray[np.bool_]:
        """Frames in which its colour is close to those of the floors around it."""
        own = self.colours[OWN]
        looks = np.vstack([imitated(self.colours[:OWN], own), own])
        skin = np.empty((FRAMES, 3))
        for frame in range(FRAMES):
            before, after, share = self.look(frame)
            skin[frame] = (1 - share) * looks[before] + share * looks[after]
        distances = np.linalg.norm(skin[:, None] - self.colours[:OWN], axis=2)
        around = _surroundings(self.zones, self.boxes)
        return np.asarray((around * distances).sum(axis=1) <= CLOSE)


def _surroundings(zones: Zones, boxes: Array) -> Array:
    """How much of each floor is around boxes of shape (n, 4); shape (n, FLOORS)."""
    angles = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    middle, half = boxes[:, :2] + boxes[:, 2:] / 2, boxes[:, 2:] / 2 + AROUND
    return np.asarray(zones.shares(middle[:, None] + half[:, None] * directions).mean(axis=1))


def drawn_plan(seed: int) -> Plan:
    """Draw a course of events."""
    random, floors = (
        part_generator(seed, f"moreno2005/octopus {part}") for part in ("way", "floors")
    )
    place = quantised(_way(random))
    travel = np.arctan2(*(place[-1] - place[0])[::-1])
    swing, period, phase = random.uniform((0.1, 50, 0), (0.3, 90, 2 * np.pi))
    times = np.arange(FRAMES)
    heading = (
        travel + random.uniform(-0.7, 0.7) + swing * np.sin(2 * np.pi * times / period + phase)
    )
    body = drawn_body(part_generator(seed, "moreno2005/octopus body"))
    kinds = floors.permutation(list(FLOOR_KINDS))[:FLOORS].tolist()
    first = np.array(FLOOR_KINDS[kinds[0]].colour)
    seen = [kind for kind, skin in SKINS.items() if np.linalg.norm(skin.colour - first) > CONTRAST]
    own = str(floors.choice(seen))
    means = [*(FLOOR_KINDS[kind].colour for kind in kinds), SKINS[own].colour]
    colours = np.array(means) * floors.uniform(1 - TINT, 1 + TINT, (FLOORS + 1, 3))
    zones = _drawn_zones(floors, place)
    still = Plan(body, place, heading, zones, (*kinds, own), colours, np.zeros((2, 2)))
    there = float(np.argmax(_surroundings(zones, still.boxes)[:, 1] > 0.5))
    start = random.uniform(*FIRST_CHANGE)
    end = start + random.uniform(*LASTING)
    again = max(there, end) + random.uniform(*DELAY)
    changes = np.array([[start, end], [again, again + random.uniform(*LASTING)]])
    return replace(still, changes=changes)


def _way(random: np.random.Generator) -> Array:
    """Way of the head, faster and slower, shape (FRAMES, 2) [pixels]."""
    columns = [random.uniform(*end) for end in ENDS]
    if random.random() < 0.5:
        columns.reverse()
    start, end = np.stack([columns, random.uniform(*LEVELS, 2)], axis=1)
    times = np.arange(FRAMES)
    period, phase = random.uniform(18, 28), random.uniform(0, 2 * np.pi)
    surge = random.uniform(0.3, 0.6) * period / (2 * np.pi * FRAMES)
    share = times / (FRAMES - 1) + surge * np.sin(2 * np.pi * times / period + phase)
    across = (end - start)[::-1] * (-1, 1) / np.linalg.norm(end - start)
    bulge = 4 * random.uniform(-BULGE, BULGE) * share * (1 - share)
    return np.asarray(start + (end - start) * share[:, None] + bulge[:, None] * across)
