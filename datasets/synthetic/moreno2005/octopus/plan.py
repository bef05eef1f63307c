"""Where the octopus crawls, over which floors, and when it takes on their looks."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.moreno2005.octopus.body import Body, Posture, drawn_body
from datasets.synthetic.moreno2005.octopus.looks import FLOOR_KINDS, SKINS, imitated
from datasets.synthetic.moreno2005.octopus.zones import FLOORS, Zones, drawn_zones
from datasets.synthetic.render.path import quantised, smooth_step
from datasets.synthetic.scene import part_generator

__all__ = ["FRAMES", "OWN", "SIZE", "Plan", "drawn_plan", "surroundings"]

Array = NDArray[np.float64]

FRAMES = 100
SIZE = 320, 240

ENDS = ((74.0, 92.0), (228.0, 246.0))
"""Columns between which the head starts and arrives, or the other way round [pixels]."""

LEVELS = 92.0, 148.0
"""Rows between which it does so [pixels]."""

BULGE = 14.0
"""How far its way bends out at most [pixels]."""

TINT = 0.08
"""By what part of it a channel of a colour differs from its kind's at most."""

FIRST_CHANGE = 8.0, 16.0
"""When the octopus begins to take on the look of the floor on which it starts [frames]."""

DELAY = 3.0, 8.0
"""From when it is mostly on another floor until it begins to take on that one's look [frames]."""

LASTING = 12.0, 20.0
"""How long it takes to do so [frames]."""

AROUND = 2.0
"""How far the floor around the octopus is from its box [pixels]."""

OWN = FLOORS
"""Index of the look with which it comes; those before are those of the floors."""

CLOSE = 0.12
"""Greatest distance of a camouflaged octopus's mean colour from the floors', RGB of [0, 1]."""

CONTRAST = 0.25
"""Least distance of the colour with which it comes from that of the first floor, likewise."""


@dataclass(frozen=True)
class Plan:
    """The course of events.

    Attributes
    ----------
    body : Body
    place : ndarray of float64, shape (FRAMES, 2)
        Of the head [pixels].
    heading : ndarray of float64, shape (FRAMES,)
        Of the body, from x towards y [radians].
    zones : Zones
    kinds : tuple of str
        Of the floors, and of the skin that is its own.
    colours : ndarray of float64, shape (FLOORS + 1, 3)
        Mean of each, RGB in [0, 1].
    changes : ndarray of float64, shape (2, 2)
        Start and end of the change to the first floor's look, and to the second's [frames].
    """

    body: Body
    place: Array
    heading: Array
    zones: Zones
    kinds: tuple[str, ...]
    colours: Array
    changes: Array

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
        around = surroundings(self.zones, self.boxes)
        return np.asarray((around * distances).sum(axis=1) <= CLOSE)


def surroundings(zones: Zones, boxes: Array) -> Array:
    """How much of each floor is around boxes of shape (n, 4); shape (n, FLOORS)."""
    angles = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    middle, half = boxes[:, :2] + boxes[:, 2:] / 2, boxes[:, 2:] / 2 + AROUND
    return np.asarray(zones.shares(middle[:, None] + half[:, None] * directions).mean(axis=1))


def drawn_plan(seed: int) -> Plan:
    """A course of events, drawn at random."""
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
    zones = drawn_zones(floors, place, SIZE)
    still = Plan(body, place, heading, zones, (*kinds, own), colours, np.zeros((2, 2)))
    there = float(np.argmax(surroundings(zones, still.boxes)[:, 1] > 0.5))
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
