"""`moreno2005/octopus`: a soft body crawls over the sea floor and imitates it.

The paper: "a real video sequence of an octopus changing its appearance while camouflaging", its
"appearance [...] quite similar to the background" at times. All other properties are our choice:
body and motion, zones of the floor, times of the changes, stones and algae, the water's moving
light, the sensor's noise. The skin takes on a part of the floor's look only, so that the colours
of each frame still separate most of the body from the floor. The arms are short, webbed and move
little, as the paper's contours change by affine maps from frame to frame.

The sea floor, stones that lie on it, algae that grow there; and the water above.

The water gathers and scatters the light, and tints what is seen.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from trackmark.datasets.interface import Image, Mask
from trackmark.datasets.synthetic.knobs import SceneKnobs
from trackmark.datasets.synthetic.moreno2005.octopus.body import (
    FLOOR_KINDS,
    SIDE,
    SKINS,
    Body,
    Posture,
    Skin,
    drawn_body,
    imitated,
    lit,
    moulded,
    painted,
    shade,
)
from trackmark.datasets.synthetic.render.camera import Camera
from trackmark.datasets.synthetic.render.path import quantised, smooth_step
from trackmark.datasets.synthetic.render.texture import fractal
from trackmark.datasets.synthetic.scene import Scene, Truth, part_generator

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


Floats = NDArray[np.float32]

FINE = 2  # samples per pixel and axis
STONES, TUFTS = 34, 26  # how many lie and grow there
STONE = 2.5, 11.0  # radius of a stone; the smaller, the more of them [pixels]
BLADES = 10, 26  # of a tuft of algae
BLADE = 7.0, 17.0  # length of one [pixels]
# Their colours, RGB in [0, 1].
ALGAE = np.array([[0.30, 0.42, 0.14], [0.44, 0.30, 0.12], [0.50, 0.14, 0.20], [0.62, 0.58, 0.26]])
REPEAT = 256  # after which the pattern repeats [pixels]
DRIFT = 0.35, 0.75  # of the two layers of waves that make the pattern [pixels/frame]
DARKEST, BRIGHTER = 0.94, 0.8  # light between the bright lines, and what these add
THROUGH = np.array([0.93, 1.0, 0.80], np.float32)  # what comes through the water, BGR
HAZE = np.array([0.34, 0.31, 0.16], np.float32)  # what it adds where it is all that is seen, BGR
THICK = 0.14  # part of what is seen that is the water's own


def painted_floor(seed: int, zones: Zones, textures: Sequence[Array]) -> Floats:
    """Picture of the floor in even light, BGR in [0, 1], shape (height, width, 3).

    The textures are those of the floors, shape (SIDE, SIDE, 3).
    """
    random = part_generator(seed, "moreno2005/octopus things")
    rows, columns = (np.indices(SIZE[::-1]) + 0.5).astype(np.float64)
    uneven = 9 * fractal(random, SIDE, 32, 128)[: SIZE[1], : SIZE[0], None]
    shares = zones.shares(np.stack([columns, rows], axis=2) + uneven)
    ground = np.zeros((*SIZE[::-1], 3))
    for floor, texture in enumerate(textures):
        ground += shares[..., floor : floor + 1] * texture[: SIZE[1], : SIZE[0]]
    large = cv2.resize(ground, None, fx=FINE, fy=FINE, interpolation=cv2.INTER_CUBIC)
    canvas = np.asarray(large, np.float32)
    grain = fractal(random, SIDE, 64, 256, 0.8)
    places = random.uniform((0, 0), SIZE, (STONES + TUFTS, 2))
    for number, place in enumerate(places):
        if number < STONES:
            _lay_stone(random, canvas, grain, place)
        else:
            _plant_tuft(random, canvas, place)
    reduced = cv2.resize(canvas, SIZE, interpolation=cv2.INTER_AREA)
    return np.asarray(np.clip(reduced, 0, 1), np.float32)


def _lay_stone(random: np.random.Generator, canvas: Floats, grain: Array, place: Array) -> None:
    """Some balls together, flat and rough; the canvas is changed in place."""
    radius = STONE[0] + (STONE[1] - STONE[0]) * random.random() ** 2
    count = int(random.integers(3, 7))
    middles = place + random.uniform(-0.7, 0.7, (count, 2)) * radius
    radii = radius * random.uniform(0.5, 1.0, (count, 1))
    balls = np.hstack([middles, radii, np.zeros((count, 1)), np.full((count, 1), 0.6)])
    window, corner = _window(canvas, place, 3 * radius)
    height, owner = moulded(balls, corner, 1 / FINE, window.shape[:2])
    covered = owner >= 0
    fall = 1 + round(0.25 * radius * FINE), 1 + round(0.35 * radius * FINE)
    shade(window, covered.astype(np.float32), fall, 0.25 * radius * FINE + 0.5, 0.5)
    column, row = random.integers(SIDE // 2, size=2)
    rough = grain[row:, column:][: window.shape[0], : window.shape[1], None]
    tone = random.uniform(0.22, 0.62) * random.uniform(0.85, 1.1, 3)
    colour = tone * (1 + 0.16 * rough) * lit(height * FINE, 1.5)[..., None]
    window[covered] = colour[covered]


def _plant_tuft(random: np.random.Generator, canvas: Floats, place: Array) -> None:
    """Bent blades from one place; the canvas is changed in place."""
    window, corner = _window(canvas, place, 1.5 * BLADE[1])
    colour = ALGAE[random.integers(len(ALGAE)), ::-1] * random.uniform(0.8, 1.15)
    lean = random.uniform(0, 2 * np.pi)
    blades = []
    for _ in range(int(random.integers(*BLADES))):
        along = np.linspace(0, 1, 8)[:, None]
        direction = lean + random.normal(0, 0.9) + random.normal(0, 0.8) * along
        steps = np.hstack([np.cos(direction), np.sin(direction)]) * random.uniform(*BLADE) / 8
        points = place - corner + random.normal(0, 2.0, 2) + np.cumsum(steps, axis=0)
        blades.append(np.round(points * FINE * 16).astype(np.int32))
    shadow = np.zeros(window.shape[:2], np.float32)
    for blade in blades:
        cv2.polylines(shadow, [blade], False, 1.0, 3, cv2.LINE_8, 4)
    shade(window, shadow, (3, 4), 2.0, 0.4)
    drawn = window.copy()  # OpenCV draws on arrays of their own only
    for blade in blades:
        tone = (colour * random.uniform(0.6, 1.35)).tolist()
        cv2.polylines(drawn, [blade], False, tone, int(random.integers(1, 4)), cv2.LINE_8, 4)
    window[:] = drawn


def _window(canvas: Floats, place: Array, reach: float) -> tuple[Floats, tuple[float, float]]:
    """Part of a canvas around a place, and its left top corner; all lengths in pixels."""
    left, top = np.maximum(np.floor((place - reach) * FINE), 0).astype(int).tolist()
    right, bottom = np.ceil((place + reach) * FINE).astype(int).tolist()
    return canvas[top:bottom, left:right], (left / FINE, top / FINE)


class Water:
    """Slow caustics and haze."""

    def __init__(self, random: np.random.Generator) -> None:
        self._random = random

    def over(self, picture: Floats, frame: int) -> Image:
        """A picture in even light, BGR in [0, 1], as it is seen through the water."""
        canvas = np.empty(picture.shape, np.uint8)
        first, second = (self._layer(layer, frame) for layer in range(2))
        _look_through(picture, first, second, THROUGH * (1 - THICK), HAZE * THICK, canvas)
        return canvas

    def _layer(self, layer: int, frame: int) -> Floats:
        texture, drift = self._layers[layer]
        x, y = np.mod(drift * frame, REPEAT) + 1
        centre = (x + (SIZE[0] - 1) / 2, y + (SIZE[1] - 1) / 2)
        return np.asarray(cv2.getRectSubPix(texture, SIZE, centre), np.float32)

    @cached_property
    def _layers(self) -> list[tuple[Floats, Array]]:
        """Textures of lines with a margin, and the drift of each [pixels/frame]."""
        layers = []
        turn = self._random.uniform(0, 2 * np.pi)
        for layer in range(2):
            waves = fractal(self._random, REPEAT, 8, 16, 0.5)
            lines = np.clip(1 - 1.15 * np.abs(waves), 0, 1)
            wide = np.tile(lines, (3, 3))[: SIZE[1] + REPEAT + 3, : SIZE[0] + REPEAT + 3]
            angle = turn + layer * np.pi * self._random.uniform(0.6, 1.4)
            pace = self._random.uniform(*DRIFT)
            drift = pace * np.array([np.cos(angle), np.sin(angle)])
            layers.append((wide.astype(np.float32), drift))
        return layers


@njit(cache=True)
def _look_through(
    picture: Floats, first: Floats, second: Floats, through: Floats, haze: Floats, out: Image
) -> None:
    """Light a picture where both layers have a bright line, tint it, and count grey levels."""
    rows, columns = first.shape
    for i in range(rows):
        for j in range(columns):
            line = min(first[i, j], second[i, j])
            gain = np.float32(DARKEST) + np.float32(BRIGHTER) * line * line * line
            for k in range(3):
                value = picture[i, j, k] * gain * through[k] + haze[k]
                out[i, j, k] = int(min(max(value, np.float32(0)), np.float32(1)) * 255 + 0.5)


CAMERA = Camera(SIZE, noise=3.0, fall=(0.06, 0.09))
MARGIN = 14  # around the octopus, for its shadow [pixels]
SHADOW = (4, 5), 3.0, 0.45  # of the octopus: where it falls, softness [pixels], and what it takes


def scene(knobs: SceneKnobs) -> "OctopusScene":
    """Renderer and truth; nothing is drawn yet."""
    return OctopusScene(knobs.scene)


class OctopusScene(Scene):
    """An octopus on the sea floor; all that is drawn at random has its seed."""

    length, size = FRAMES, SIZE

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self.plan = _plan(seed)

    def truth(self) -> Truth:
        """See `Scene.truth`.

        The attribute is `camouflaged`: the mean colour of the octopus's present look is within
        0.2 (in RGB of [0, 1], in even light) of those of the floors around it; distances from
        several floors are averaged, each by its part of the surroundings.
        """
        plan = self.plan
        return Truth(plan.boxes, np.ones(FRAMES), {"camouflaged": plan.camouflaged})

    def render(self, frame: int) -> Image:
        picture = self._floor.copy()
        self._lay_octopus(picture, frame)
        canvas = self._water.over(picture, frame)
        return CAMERA.exposed(canvas, self._seed, frame)

    def mask(self, frame: int) -> Mask:
        balls = self.plan.posture(frame).balls
        return np.asarray(moulded(balls, (0.0, 0.0), 1.0, SIZE[::-1], ground=-1.0)[1] >= 0)

    def _lay_octopus(self, picture: Floats, frame: int) -> None:
        """Lay the octopus and its shadow over a picture, which is changed in place."""
        posture = self.plan.posture(frame)
        x, y, width, height = posture.box
        left, top = max(int(x) - MARGIN, 0), max(int(y) - MARGIN, 0)
        right = min(int(x + width) + MARGIN, SIZE[0])
        bottom = min(int(y + height) + MARGIN, SIZE[1])
        window = picture[top:bottom, left:right]
        size = right - left, bottom - top
        coloured = self._skin.seen(posture, (left, top), size, *self.plan.look(frame))
        sheet = np.asarray(cv2.resize(coloured, size, interpolation=cv2.INTER_AREA), np.float32)
        shade(window, sheet[..., 3], *SHADOW)
        window *= 1 - sheet[..., 3:]
        window += sheet[..., :3]

    @cached_property
    def _skin(self) -> Skin:
        random, plan = self._random("skin"), self.plan
        own = painted(random, SKINS[plan.kinds[OWN]], plan.colours[OWN])
        # Turned round, so that nothing of a floor lies on the same thing on the skin.
        looks = [imitated(np.rot90(texture), own) for texture in self._textures]
        return Skin(random, plan.body, [*looks, own])

    @cached_property
    def _floor(self) -> Floats:
        return painted_floor(self._seed, self.plan.zones, self._textures)

    @cached_property
    def _textures(self) -> list[Array]:
        random, plan = self._random("textures"), self.plan
        return [
            painted(random, FLOOR_KINDS[kind], colour)
            for kind, colour in zip(plan.kinds[:OWN], plan.colours[:OWN], strict=True)
        ]

    @cached_property
    def _water(self) -> Water:
        return Water(self._random("water"))

    def _random(self, part: str) -> np.random.Generator:
        return part_generator(self._seed, f"moreno2005/octopus {part}")


_plan = lru_cache(maxsize=4)(drawn_plan)
