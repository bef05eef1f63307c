"""`nguyen2002/lights`: a hand moves a printed object in a room with two lamps.

The authors of the paper recorded a sequence with several complete occlusions. They changed the
illumination abruptly by turning off one of the light sources. All other properties are our choice:
the number, power and position of the lamps, the object, its motion, the occluders and their number,
and that the lamp is turned on again.

The origin of each object is its centre. Occluders are taller than the image.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numba import njit
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.interface import Array, Image, Mask
from trackmark.datasets.synthetic.parameters import SceneParameters
from trackmark.datasets.synthetic.render.camera import LENS, Camera
from trackmark.datasets.synthetic.render.colours import (
    ACCENTS,
    CLOTHES,
    COUNTERS,
    NEUTRALS,
    sample_similar,
)
from trackmark.datasets.synthetic.render.desk import render_room
from trackmark.datasets.synthetic.render.figure.look import sample_skin
from trackmark.datasets.synthetic.render.finish import (
    GAMMA,
    VIEW,
    Finish,
    Pattern,
    SceneObject,
    SurfaceBuffer,
    grain,
    picture_on,
    render_surfaces,
    staggered,
)
from trackmark.datasets.synthetic.render.lamp import (
    AMBIENT,
    Lamp,
    blend_lit_card,
    lamp_visibility,
    plane_crossings,
    shadow_softness,
    surface_light,
)
from trackmark.datasets.synthetic.render.path import Loop, quantised, random_loop
from trackmark.datasets.synthetic.render.prints import KINDS, print_picture
from trackmark.datasets.synthetic.render.solids import box, cast_rays, chain, limb, mirror_limbs
from trackmark.datasets.synthetic.render.texture import fractal
from trackmark.datasets.synthetic.scene import SceneTruth, SeededScene, part_generator

HALF_WIDTH, HALF_HEIGHT = 108, 130  # half size of a window that contains any occluder [pixels]
LENGTH = 175.0  # half height of an occluder, whose ends are outside the image [pixels]
PRINT_FINE = 6  # resolution of the print [dots/pixel]
SATURATION = 0.5  # saturation of the faded print relative to fresh ink
DEPTHS = {"book": 5.0, "tea": 11.0, "toy": 13.0}  # half the thickness by kind of object [pixels]


def held_objects(random: Generator) -> list[SceneObject]:
    """Return a printed object that leans back slightly, the hand that holds it, and a sleeve."""
    kind = KINDS[int(random.integers(len(KINDS)))]
    wide = random.uniform(28, 31)
    half = np.array([wide, wide * random.uniform(1.28, 1.36), DEPTHS[kind]])
    lean = random.uniform(0.06, 0.2)
    width, height = (round(2 * PRINT_FINE * side) for side in half[:2])
    face = picture_on(
        _faded(print_picture(random, kind, width, height)), (0.0, 0.0), half[:2], lean
    )
    skin, cloth = sample_skin(random), sample_similar(random, CLOTHES, 0.06)
    side, slope = float(random.choice([-1, 1])), random.uniform(-0.1, 0.4)
    solid = box(np.zeros(3), half, 0.8, lean=-lean)
    return [
        SceneObject(Finish(np.full(3, 255.0), 0.05, face), [solid]),
        SceneObject(Finish(skin, 0.03, grain(random, 0.035)), _hand(half, side, slope)),
        SceneObject(Finish(cloth, 0.0, _knitted(random)), _sleeve(half[1], side, slope)),
    ]


def _faded(picture: Image) -> Image:
    grey = picture.mean(axis=2, keepdims=True)
    return np.asarray(grey + SATURATION * (picture - grey), np.uint8)


def _hand(half: Array, side: float, slope: float) -> list[Array]:
    """Return the thumb in front of an object, the fingers behind it, and the palm below it."""
    _, high, deep = half
    low = -high
    wrist = np.array([8.0 + 26 * slope, low - 40, 4.0])
    solids = []
    for k in range(4):
        x = -13.0 + 8.4 * k
        knuckle = np.array([x + 1, low - 11 + 1.5 * abs(k - 1.3), -0.5 * deep - 3])
        behind = np.array([x, low + 16, -deep - 6])
        root = wrist + np.array([-8 + 5.5 * k, 7.0, -2.0])
        solids += chain([root, knuckle, behind], (8.5, 5.4, 3.6), 5.0)
    ball = np.array([-9.0 + 8 * slope, low - 19, deep + 2])
    joint = np.array([-12.0, low - 3, deep + 5.5])
    tip = np.array([-7.0, low + 12.5, deep + 4.2])
    solids += chain([wrist, ball, joint, tip], (9.0, 7.4, 4.6, 3.4), 4.0)
    arm = wrist + np.array([22 * slope, -24.0, 0.0])
    solids += chain([wrist, arm], (10.5, 12.5), 5.0)
    return mirror_limbs(solids, side)


def _sleeve(high: float, side: float, slope: float) -> list[Array]:
    start = np.array([8.0 + 40 * slope, -high - 56, 4.0])
    direction = np.array([0.9 * slope, -1.0, 0.0])
    cuff = chain([start, start + 7 * direction], (15.5, 16.0), 0.0)
    arm = chain(
        [start + 4 * direction, start + 60 * direction, start + 200 * direction],
        (14.5, 17.5, 25),
        2.0,
    )
    return mirror_limbs([*cuff, *arm], side)


def _knitted(random: Generator) -> Pattern:
    uneven = grain(random, 0.09, (1.0, 0.6, 1.0), 16)

    def gain(places: Array) -> Array:
        return np.asarray(uneven(places) * (1 + 0.06 * np.sin(1.3 * places[:, 1]))[:, None])

    return gain


def occluder_objects(kind: str, random: Generator) -> list[SceneObject]:
    """Return an occluder of a kind: `board`, `door`, `cloth` or `back`."""
    makers = {"board": _board, "door": _door, "cloth": _cloth, "back": _back}
    return makers[kind](random)


def _sample_colour(random: Generator, colours: tuple[tuple[int, int, int], ...]) -> Array:
    return sample_similar(random, colours, 0.08)


def _board(random: Generator) -> list[SceneObject]:
    half = random.uniform(56, 62)
    wood = _sample_colour(random, COUNTERS[:3])
    things = [
        SceneObject(
            Finish(wood * random.uniform(0.86, 1.1), 0.03, _wooden(random)),
            [box((x, 0, 0), (half / 3 - 0.4, LENGTH, 4), 1.0)],
        )
        for x in (-2 * half / 3, 0, 2 * half / 3)
    ]
    things.append(SceneObject(Finish(wood * 0.4), [box((0, 0, -3), (half - 2, LENGTH, 1.5), 0.5)]))
    battens = [box((0, y, 7), (half - 6, 11, 4), 1.0) for y in (random.uniform(40, 80), -70.0)]
    nails = [
        limb((x, y, 10.5), (x, y, 11), (1.6, 1.6))
        for y in (battens[0][4], battens[1][4])
        for x in (-2 * half / 3, 0.0, 2 * half / 3)
    ]
    return [
        *things,
        SceneObject(Finish(wood * 0.8, 0.03, _wooden(random, along=0)), battens),
        SceneObject(Finish((150, 152, 154), 0.4), nails),
    ]


def _wooden(random: Generator, along: int = 1) -> Pattern:
    warp = fractal(random, 256, 2, 16)
    fine = fractal(random, 256, 16, 128, 0.8)
    shift, pace = random.uniform(0, 256), random.uniform(0.35, 0.55)

    def gain(places: Array) -> Array:
        length, across = places[:, along], places[:, 1 - along]
        row = np.round(0.35 * length + shift).astype(np.int64) % 256
        column = np.round(2 * across).astype(np.int64) % 256
        rings = np.sin(pace * across * (1 + 0.15 * np.sin(0.01 * length)) + 5 * warp[row, column])
        return np.asarray(1 + 0.13 * rings + 0.08 * fine[row // 2, column])[:, None]

    return gain


def _door(random: Generator) -> list[SceneObject]:
    half = random.uniform(58, 66)
    colour = _sample_colour(random, (*ACCENTS[:5], *NEUTRALS[2:]))
    paint, panel = grain(random, 0.03), grain(random, 0.03)
    stile = 13.0
    rails = [box((side * (half - stile), 0, 2), (stile, LENGTH, 6), 1.4) for side in (-1, 1)]
    rails += [
        box((0, y, 2), (half - stile, 11, 6), 1.4) for y in (-115, random.uniform(-20, 20), 115)
    ]
    fields = [box((0, 0, 0), (half - 4, LENGTH, 3), 1.0)]
    raised = [box((0, y, 1), (half - 2.6 * stile, 38, 4.5), 3.0) for y in (-62, 66)]
    x = float(random.choice([-1, 1])) * (half - stile)
    knob = [limb((x, 20, 8), (x, 20, 17), (3, 5.5), 2.0)]
    return [
        SceneObject(Finish(colour, 0.10, paint), rails),
        SceneObject(Finish(colour * 0.86, 0.08, panel), [*fields, *raised]),
        SceneObject(Finish((120, 160, 178), 0.5), knob),
    ]


def _cloth(random: Generator) -> list[SceneObject]:
    half = random.uniform(60, 68)
    folds = random.uniform(3.0, 4.2), random.uniform(0.17, 0.24)
    ground, ink = _sample_colour(random, (*CLOTHES, *NEUTRALS)), _sample_colour(random, ACCENTS[:5])
    pattern = _dotted(random, ink / ground)
    return [
        SceneObject(
            Finish(ground, 0.0, pattern), [box((0, 0, 0), (half, LENGTH, 5), 2, folds=folds)]
        )
    ]


def _dotted(random: Generator, ink: Array) -> Pattern:
    """Return a pattern of flowers or dots; every other row is shifted by half the spacing."""
    pitch, petals = random.uniform(17, 24), int(random.choice([0, 5, 6]))
    weave = grain(random, 0.05, coarsest=32)
    second = 0.5 + 0.5 * ink[::-1]

    def gain(places: Array) -> Array:
        x, y = staggered(places, pitch)
        radius = np.sqrt(x * x + y * y)
        edge = 0.30 + 0.08 * np.cos(petals * np.arctan2(y, x)) * (petals > 0)
        colour = np.where((radius < edge)[:, None], ink, 1.0)
        colour = np.where((radius < 0.11)[:, None], second, colour)
        return np.asarray(colour * weave(places))

    return gain


def _back(random: Generator) -> list[SceneObject]:
    shirt = _sample_colour(random, (*CLOTHES, *ACCENTS[:5]))
    trousers = _sample_colour(random, CLOTHES[:2])
    checks = _checked(random) if random.random() < 0.6 else grain(random, 0.06)
    wide = random.uniform(52, 58)
    hem = random.uniform(-96, -84)
    thick = 0.6 * wide, 0.56 * wide
    torso = [
        limb((side * 0.42 * wide, 150, 0), (side * 0.36 * wide, hem, 4), thick, 12)
        for side in (-1, 1)
    ]
    spine = [limb((0, 150, 22), (0, hem + 6, 26), (13, 12), 14.0)]
    arms = [
        limb((side * (wide + 6), 120, 0), (side * (wide + 19), hand, 4), (20, 15), 6)
        for side, hand in ((side, random.uniform(-30, 0)) for side in (-1, 1))
    ]
    arms += [limb(arm[6:9], arm[6:9] + np.array([0.0, -95.0, 22.0]), (15, 11), 6) for arm in arms]
    hips = [
        limb((side * 0.4 * wide, hem - 6, 2), (side * 0.44 * wide, -200, 2), (0.56 * wide,) * 2, 8)
        for side in (-1, 1)
    ]
    return [
        SceneObject(Finish(shirt, 0.0, checks), [*torso, *spine, *arms]),
        SceneObject(Finish(trousers, 0.0, grain(random, 0.06, coarsest=32)), hips),
    ]


def _checked(random: Generator) -> Pattern:
    pitch, share = random.uniform(13, 20), random.uniform(0.3, 0.5)
    bar_gain, line_gain = random.uniform(0.55, 0.9, 3), random.uniform(0.6, 1.2, 3)
    weave = grain(random, 0.05, coarsest=32)

    def gain(places: Array) -> Array:
        bars = [places[:, axis] / pitch - np.floor(places[:, axis] / pitch) for axis in (0, 1)]
        colour = np.where((bars[0] < share)[:, None], bar_gain, 1.0)
        colour = colour * np.where((bars[1] < share)[:, None], bar_gain, 1.0)
        thin = (np.abs(bars[0] - 0.75) < 0.05) | (np.abs(bars[1] - 0.75) < 0.05)
        return np.asarray(np.where(thin[:, None], line_gain * colour, colour) * weave(places))

    return gain


FRAMES = 300
SIZE = 320, 240
OCCLUDERS = "board", "door", "cloth", "back"

# approximate times of the occlusions: two lamps are on at the first and third, one at the second
CROSSING_TIMES = (60, 166, 252)
# approximate times at which a lamp is turned off and on again, far from the occlusions
OFF, ON = 110, 215


@dataclass(frozen=True)
class Passage:
    """Passage of an occluder in front of the object."""

    # name in `OCCLUDERS`: a wooden board, a panelled door, a patterned cloth, a person's back
    kind: str
    middle: float  # time at which the centres of occluder and object are in one column [frames]
    pace: float  # velocity to the right [pixels/frame]


@dataclass(frozen=True)
class LightsPlan:
    """Motion of the object, passages of occluders, and times at which the lamp is switched."""

    loop: Loop  # path of the object's centre [pixels]
    # (4, 3): rows are scale, tilt, yaw, pitch; columns are amplitude, period [frames], phase
    waves: Array
    passages: tuple[Passage, ...]  # passages in order of time
    off: int  # first frame without the lamp
    on: int  # first frame in which the lamp is on again

    def place(self, times: ArrayLike) -> Array:
        """Return the centre of the object [pixels], shape `times.shape + (2,)`."""
        return quantised(self.loop.positions(times))

    def scale(self, times: ArrayLike) -> Array:
        """Return the scale of the object, about 1."""
        return 1 + self._wave(0, times)

    def tilt(self, times: ArrayLike) -> Array:
        """Return the tilt of the object to the right [radians]."""
        return self._wave(1, times)

    def facing(self, times: ArrayLike) -> Array:
        """Return yaw and pitch of the object [radians], shape `times.shape + (2,)`."""
        return np.stack([self._wave(2, times), self._wave(3, times)], axis=-1)

    def occluder_column(self, passage: Passage, times: ArrayLike) -> Array:
        """Return the image column of an occluder's centre [pixels]."""
        since = np.asarray(times, np.float64) - passage.middle
        return quantised(self.place(passage.middle)[0] + passage.pace * since)

    def lamp_is_on(self, frame: int) -> bool:
        """Return whether the switched lamp is on."""
        return not self.off <= frame < self.on

    def _wave(self, row: int, times: ArrayLike) -> Array:
        size, period, phase = self.waves[row]
        return np.asarray(size * np.sin(2 * np.pi * np.asarray(times) / period + phase))


def sample_plan(random: Generator) -> LightsPlan:
    """Sample a plan."""
    loop = random_loop(random, (70, 66), (250, 150), random.uniform(1.2, 1.7))
    sizes = (0.06, 0.11), (0.010, 0.025), (0.05, 0.12), (0.03, 0.08)
    waves = [
        [random.uniform(*size), random.uniform(110, 210), random.uniform(0, 2 * np.pi)]
        for size in sizes
    ]
    kinds = random.permutation(OCCLUDERS)[: len(CROSSING_TIMES)].tolist()
    passages = []
    for kind, about in zip(kinds, CROSSING_TIMES, strict=True):
        middle, side = about + random.uniform(-5, 5), float(random.choice([-1, 1]))
        pace = side * random.uniform(6.5, 8.0) * (1.3 if kind == "back" else 1)
        passages.append(Passage(kind, middle, pace))
    off, on = (time + int(random.integers(-4, 5)) for time in (OFF, ON))
    return LightsPlan(loop, np.array(waves), tuple(passages), off, on)


Floats = NDArray[np.float32]

# depth of the held object and of the occluders [pixels towards the camera]
HELD, PASSING = 15.0, 43.0
HORIZON = 180  # image row at which the wall meets the desk [pixels]
CARD_FINE, ROOM_FINE = 3, 2  # samples per pixel and axis of moving and of static objects
CARD_LAID = 2  # samples per pixel and axis at which a card is resampled into the image
# window of the object: upper left corner relative to its origin, and size [pixels]
CORNER, EXTENT = (-45, -56), (90, 112)
# window of object, hand and arm: upper left corner and size [pixels]
HELD_CORNER, HELD_SIZE = (-125, -56), (250, 272)


class CardPose:
    """Pose of a card: image position of its anchor [pixels], scale, tilt to the right [radians]."""

    def __init__(self, place: ArrayLike, scale: float = 1.0, tilt: float = 0.0) -> None:
        self._place = np.asarray(place, np.float64)
        self._scale = scale
        self._turn = np.array([[np.cos(tilt), -np.sin(tilt)], [np.sin(tilt), np.cos(tilt)]])

    def onto_picture(self, points: Array) -> Array:
        """Map points (n, 2) of the card, relative to its anchor, to the image [pixels]."""
        return np.asarray(self._place + self._scale * points @ self._turn.T)

    def onto_card(self, anchor: Array, fine: int) -> Array:
        """Return the affine map from image positions to samples of a flat card, shape (2, 3)."""
        back = fine / self._scale * self._turn.T
        return np.column_stack([back, fine * anchor - back @ self._place - 0.5])


class FlatCard:
    """Flat layer of a moving object, parallel to the image plane.

    `sheets` are aligned images (fine * h, fine * w, 4), premultiplied by the coverage, which is the
    last channel of the first image. `anchor`, shape (2,), is the point by which the card is
    positioned, relative to its upper left corner [pixels]. `fine` is the number of samples per
    pixel and axis.
    """

    def __init__(self, sheets: Sequence[Floats], anchor: ArrayLike, fine: int) -> None:
        self._sheets = sheets
        self._anchor = np.asarray(anchor, np.float64)
        self._fine = fine

    def place(self, pose: CardPose) -> list[Floats]:
        """Return the sheets resampled at a pose in the image, each of shape (height, width, 4)."""
        matrix = pose.onto_card(self._anchor, self._fine)
        matrix[:, 2] += matrix[:, :2] @ np.full(2, 0.5 / CARD_LAID)
        matrix[:, :2] /= CARD_LAID
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        size = CARD_LAID * SIZE[0], CARD_LAID * SIZE[1]
        resampled = [cv2.warpAffine(sheet, matrix, size, flags=flags) for sheet in self._sheets]
        return [
            np.asarray(cv2.resize(sheet, SIZE, interpolation=cv2.INTER_AREA), np.float32)
            for sheet in resampled
        ]

    def may_be_seen(self, pose: CardPose) -> bool:
        """Return whether the card can overlap the image."""
        height, width = self._sheets[0].shape[:2]
        corners = np.array([(x, y) for x in (-1, width + 1) for y in (-1, height + 1)])
        places = pose.onto_picture(corners / self._fine - self._anchor)
        return bool((places.max(axis=0) > 0).all() and (places.min(axis=0) < SIZE).all())

    def shade(self, shadow_softness: float = 0.0) -> "ShadowMask":
        """Return the coverage of the card as a shadow mask with edges of a softness [pixels]."""
        coverage = self._sheets[0][..., 3]
        if not shadow_softness:
            return ShadowMask(coverage, self._anchor, self._fine)
        margin = round(3 * shadow_softness) * self._fine
        soft = cv2.GaussianBlur(np.pad(coverage, margin), (0, 0), shadow_softness * self._fine)
        return ShadowMask(np.asarray(soft), self._anchor + margin / self._fine, self._fine)


class ShadowMask:
    """Coverage of a card that can be sampled at any point; parameters as in `FlatCard`."""

    def __init__(self, coverage: Floats, anchor: Array, fine: int) -> None:
        self._coverage = coverage
        self._anchor = anchor
        self._fine = fine

    def sample(self, pose: CardPose, points: Floats) -> Floats:
        """Return the coverage in [0, 1] at image points (h, w, 2), columns and rows [pixels]."""
        places = cv2.transform(points, pose.onto_card(self._anchor, self._fine))
        columns, rows = (np.ascontiguousarray(places[..., k]) for k in (0, 1))
        return np.asarray(cv2.remap(self._coverage, columns, rows, cv2.INTER_LINEAR), np.float32)


class LightsSetting:
    """Room and moving objects of the scene with number `seed`, independent of the light."""

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self.plan = sample_plan(self._random("plan"))

    @cached_property
    def held_card(self) -> FlatCard:
        """Card of object, hand and arm; its two sheets contain colour, and normal with gloss."""
        surface = render_surfaces(self._things, HELD_CORNER, HELD_SIZE, CARD_FINE)
        return FlatCard(surface.reduced(1), self._middle - HELD_CORNER, CARD_FINE)

    @cached_property
    def silhouette(self) -> FlatCard:
        """Card with four channels: visible part of the held object, 0, 0, whole object."""
        whole, seen = self._outlines
        sheet = np.stack([seen, 0 * seen, 0 * seen, whole], axis=2)
        return FlatCard([sheet.astype(np.float32)], self._middle - CORNER, CARD_FINE)

    @property
    def extent(self) -> Array:
        """Width and height of the whole object at scale 1 [pixels], shape (2,)."""
        low, high = self._bounds
        return high - low

    @property
    def points(self) -> tuple[Array, int]:
        """Return the visible points of the object and the number of all its points.

        The points, shape (n, 2), are relative to the object's centre; there is one per pixel.
        """
        pixel_centres = slice(CARD_FINE // 2, None, CARD_FINE)  # one sample per pixel
        whole, seen = (outline[pixel_centres, pixel_centres] for outline in self._outlines)
        rows, columns = np.nonzero(seen)
        points = np.stack([columns, rows], axis=1) + 0.5 + CORNER - self._middle
        return points, int(whole.sum())

    @cached_property
    def occluders(self) -> list[FlatCard]:
        """Cards of the occluders in order of time; their sheets are as in `held_card`."""
        cards = []
        for k, passage in enumerate(self.plan.passages):
            things = occluder_objects(passage.kind, self._random(f"passer {k}"))
            size = 2 * HALF_WIDTH, 2 * HALF_HEIGHT
            surface = render_surfaces(things, (-HALF_WIDTH, -HALF_HEIGHT), size, ROOM_FINE)
            cards.append(FlatCard(surface.reduced(1), (HALF_WIDTH, HALF_HEIGHT), ROOM_FINE))
        return cards

    @cached_property
    def room(self) -> SurfaceBuffer:
        """Static background with `ROOM_FINE` samples per pixel and axis."""
        return render_room(self._random("room"), SIZE, HORIZON, ROOM_FINE)

    @cached_property
    def _things(self) -> list[SceneObject]:
        """Held object, hand and sleeve."""
        return held_objects(self._random("object"))

    @cached_property
    def _outlines(self) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Masks of the samples of the whole object, and of those that the hand does not occlude."""
        solids = [thing.solids for thing in self._things]
        whole, seen = (
            cast_rays(things, VIEW, CORNER, EXTENT, CARD_FINE, shaded=False)[0] == 0
            for things in (solids[:1], solids)
        )
        return whole, seen

    @cached_property
    def _bounds(self) -> tuple[Array, Array]:
        """Upper left and lower right corner of the whole object [pixels]."""
        whole, _ = self._outlines
        ends = [np.flatnonzero(whole.any(axis=axis)) for axis in (0, 1)]
        low, high = (np.array([end[k] for end in ends], np.float64) for k in (0, -1))
        return CORNER + low / CARD_FINE, CORNER + (high + 1) / CARD_FINE

    @property
    def _middle(self) -> Array:
        low, high = self._bounds
        return (low + high) / 2

    def _random(self, part: str) -> Generator:
        return part_generator(self._seed, f"nguyen2002/lights {part}")


AFAR = -90.0  # approximate depth of the static surfaces on which shadows fall [pixels]
# The two lamps are alike: each has about half of the power. The switched lamp's fraction of the
# power, and ranges of column (distance from the centre), row and depth of both lamps [pixels].
SHARE = 0.42, 0.58
ASIDE, LEVEL, FRONT = (170.0, 240.0), (-80.0, 20.0), (225.0, 285.0)


def sample_lamps(random: Generator) -> tuple[Lamp, Lamp]:
    """Sample the switched lamp and a lamp of similar power on the other side.

    Both are nearly white: they differ by 6 % in blue and by 2.5 % in green.
    """
    side = float(random.choice([-1, 1]))
    first, second = (
        np.array(
            [
                SIZE[0] / 2 + direction * random.uniform(*ASIDE),
                random.uniform(*LEVEL),
                random.uniform(*FRONT),
            ]
        )
        for direction in (-side, side)
    )
    share = random.uniform(*SHARE)
    tint = 1 + random.choice([-1, 1]) * np.array([0.06, 0.025, 0.0])
    return Lamp(first, np.full(3, share)), Lamp(second, (1 - share) * tint)


class Lighting:
    """Renderer of a setting under two lamps, in linear light."""

    def __init__(self, setting: LightsSetting, lamps: Sequence[Lamp]) -> None:
        self._setting = setting
        self._lamps = lamps

    def picture(
        self,
        lamps_on: Sequence[int],
        held: CardPose,
        turn: Array,
        occluders: Sequence[tuple[int, CardPose, int]],
    ) -> Floats:
        """Render the scene, shape (height, width, 3), with the lamps whose indices are `lamps_on`.

        `turn`, shape (2,), is the rotation of the held object to the right and down [radians].
        `occluders` contains index, pose and blur [pixels] of every occluder.
        """
        picture = np.zeros((*SIZE[::-1], 3), np.float32)
        for k in lamps_on:
            ambient, direct = self._reflected_light[k]
            through, passed = self._shadow_points[k]
            visible_share = 1 - self._held_shadows[k].sample(held, through)
            for number, pose, _ in occluders:
                visible_share *= 1 - self._far_shadows[k][number].sample(pose, passed)
            picture += ambient + direct * visible_share[..., None]
        visible = np.ones((len(lamps_on), *SIZE[::-1]), np.float32)
        for visible_share, k in zip(visible, lamps_on, strict=True):
            for number, pose, _ in occluders:
                visible_share *= 1 - self._near_shadows[k][number].sample(
                    pose, self._near_shadow_points[k]
                )
        self._lay(picture, lamps_on, self._setting.held_card.place(held), HELD, turn, visible)
        for number, pose, blur in occluders:
            card = self._setting.occluders[number]
            if not card.may_be_seen(pose):  # Outside the image, an occluder only casts shadows.
                continue
            blurred = [
                np.asarray(cv2.blur(sheet, (blur, 1)), np.float32) for sheet in card.place(pose)
            ]
            self._lay(picture, lamps_on, blurred, PASSING, np.zeros(2), np.ones_like(visible))
        return picture

    def _lay(
        self, picture: Floats, lamps_on: Sequence[int], sheets: Sequence[Floats], depth: float,
        turn: Array, visible: Floats,
    ) -> None:  # fmt: skip
        """Render a card at a depth over an image; `visible` is the visible share of each lamp."""
        places = np.stack([self._lamps[k].place for k in lamps_on])
        powers = np.stack([self._lamps[k].colour for k in lamps_on])
        blend_lit_card(picture, sheets[0], sheets[1], depth, turn, places, powers, visible)

    @cached_property
    def _reflected_light(self) -> list[tuple[Floats, Floats]]:
        """Ambient and direct light of each lamp, reflected from the room to the camera."""
        room = self._setting.room
        colour = room.reduced(ROOM_FINE)[0][..., :3]
        pairs = []
        for lamp in self._lamps:
            light, shine = surface_light(lamp.place, room.depth, room.normal, ROOM_FINE)
            seen = lamp_visibility(room.depth, lamp.place, ROOM_FINE)
            back = (room.colour * light[..., None] + (room.gloss * shine)[..., None]) * seen
            direct = cv2.resize(back, SIZE, interpolation=cv2.INTER_AREA)
            ambient = (AMBIENT * lamp.colour * colour).astype(np.float32)
            pairs.append((ambient, (lamp.colour * direct).astype(np.float32)))
        return pairs

    @cached_property
    def _shadow_points(self) -> list[tuple[Floats, Floats]]:
        """Points where the rays of each lamp to the room cross the planes of the moving objects."""
        depth = cv2.resize(self._setting.room.depth, SIZE, interpolation=cv2.INTER_AREA)
        points = _pixel_centres(np.asarray(depth))
        return [
            (plane_crossings(lamp, points, HELD), plane_crossings(lamp, points, PASSING))
            for lamp in self._lamps
        ]

    @cached_property
    def _near_shadow_points(self) -> list[Floats]:
        """Points where the rays of each lamp to the object cross the plane of the occluders."""
        points = _pixel_centres(np.full(SIZE[::-1], HELD))
        return [plane_crossings(lamp, points, PASSING) for lamp in self._lamps]

    @cached_property
    def _held_shadows(self) -> list[ShadowMask]:
        return [
            self._setting.held_card.shade(shadow_softness(lamp, HELD, AFAR)) for lamp in self._lamps
        ]

    @cached_property
    def _far_shadows(self) -> list[list[ShadowMask]]:
        return self._occluder_shadows(AFAR)

    @cached_property
    def _near_shadows(self) -> list[list[ShadowMask]]:
        return self._occluder_shadows(HELD)

    def _occluder_shadows(self, depth: float) -> list[list[ShadowMask]]:
        """Return the shadow mask of every occluder and lamp on a surface at a depth."""
        return [
            [card.shade(shadow_softness(lamp, PASSING, depth)) for card in self._setting.occluders]
            for lamp in self._lamps
        ]


@njit(cache=True)
def _power(values: Floats, exponent: np.float32) -> Floats:
    """Return `values ** exponent`, which NumPy rounds differently on processors with AVX-512."""
    powers = np.empty_like(values)
    for index, value in np.ndenumerate(values):
        powers[index] = value**exponent
    return powers


def _pixel_centres(depth: Array) -> Floats:
    """Return the centres of the image pixels at a depth, shape (height, width, 3)."""
    rows, columns = np.indices(depth.shape) + 0.5
    return np.stack([columns, rows, depth], axis=2).astype(np.float32)


EXPOSURE = 0.5  # fraction of the frame time for which the shutter is open
SENSITIVITY = 0.92  # grey level of a white surface in light of 1; the exposure is fixed
REACH = 400.0  # an object farther than this from the image casts no shadow into it [pixels]
CAMERA = Camera(SIZE, noise=2.0, fall=(0.04, 0.06))


class LightsScene(SeededScene):
    """Scene of a printed object in a hand, in the light of two lamps."""

    label, length, size = "nguyen2002/lights", FRAMES, SIZE

    def __init__(self, parameters: SceneParameters) -> None:
        super().__init__(parameters)
        self.setting = LightsSetting(self._seed)
        self.plan = self.setting.plan

    @cached_property
    def lighting(self) -> Lighting:
        """Setting in the light of two lamps."""
        return Lighting(self.setting, sample_lamps(self._random("lamps")))

    def truth(self) -> SceneTruth:
        """Return the ground truth of all frames.

        Boxes contain the whole object, including occluded parts, but ignore its slight tilt.
        Attributes are `occluded` (less than half of the object is visible), `partly occluded` (half
        or more, but less than nine tenths) and `lamp off`.
        """
        setting, plan = self.setting, self.plan
        times = np.arange(FRAMES)
        size = setting.extent * plan.scale(times)[:, None]
        points, whole = setting.points
        visibility = np.full(FRAMES, len(points) / whole)
        shadows = [card.shade() for card in setting.occluders]
        for frame in range(FRAMES):
            seen = _pose(plan, frame).onto_picture(points)[:, None]
            for number, pose in _visible_occluders(plan, frame):
                visibility[frame] *= (
                    1 - shadows[number].sample(pose, seen.astype(np.float32)).mean()
                )
        occluded = visibility < 0.5
        return SceneTruth(
            np.hstack([plan.place(times) - size / 2, size]),
            visibility,
            {
                "occluded": occluded,
                "partly occluded": (visibility < 0.9) & ~occluded,
                "lamp off": np.array([not plan.lamp_is_on(frame) for frame in range(FRAMES)]),
            },
        )

    def render(self, frame: int) -> Image:
        lamps_on = [0, 1] if self.plan.lamp_is_on(frame) else [1]
        occluders = [
            (number, pose, 2 * round(abs(self.plan.passages[number].pace) * EXPOSURE / 2) + 1)
            for number, pose in _visible_occluders(self.plan, frame)
        ]
        facing = self.plan.facing(frame)
        picture = self.lighting.picture(lamps_on, _pose(self.plan, frame), facing, occluders)
        seen = SENSITIVITY * np.asarray(cv2.GaussianBlur(picture, (0, 0), LENS))
        canvas: Image = np.round(255 * _power(np.clip(seen, 0, 1), np.float32(1 / GAMMA))).astype(
            np.uint8
        )
        return CAMERA.exposed(canvas, self._seed, frame)

    def mask(self, frame: int) -> Mask:
        seen = self.setting.silhouette.place(_pose(self.plan, frame))[0][..., 0]
        for number, pose in _visible_occluders(self.plan, frame):
            seen = seen * (1 - self.setting.occluders[number].place(pose)[0][..., 3])
        return np.asarray(seen >= 0.5)


def _pose(plan: LightsPlan, frame: int) -> CardPose:
    return CardPose(plan.place(frame), float(plan.scale(frame)), float(plan.tilt(frame)))


def _visible_occluders(plan: LightsPlan, frame: int) -> list[tuple[int, CardPose]]:
    """Return index and pose of the occluders that are in the image or cast shadows into it."""
    poses = []
    for number, passage in enumerate(plan.passages):
        column = float(plan.occluder_column(passage, frame))
        if -REACH < column < SIZE[0] + REACH:
            poses.append((number, CardPose((column, SIZE[1] / 2))))
    return poses
