"""`wang2010/cup`: a hand carries a cup past objects of a similar colour.

The authors recorded 80 frames of 108 x 85 pixels of a cup. In frame 36 the surroundings have almost
the target's colour, and an object of almost that colour occludes a part of the target. Colour is
unreliable in this frame; the motion cue remains good. All other properties are our choice.

The paper's frame 36 is `EVENT` here. Before this frame, the cup descends; behind it is an object of
similar colour and in front of it a box of similar colour. After this frame, the cup rises and moves
away from both. The kitchen consists of a wall, a counter, several objects, the two objects of
similar colour, and the held cup, whose foot is the origin.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias

import cv2
import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.interface import Array, Image, Mask
from trackmark.datasets.synthetic.parameters import SceneParameters
from trackmark.datasets.synthetic.render import colours
from trackmark.datasets.synthetic.render.camera import Camera
from trackmark.datasets.synthetic.render.figure.look import sample_skin
from trackmark.datasets.synthetic.render.finish import (
    Finish,
    Pattern,
    SceneObject,
    grain,
    shade_objects,
    tiles,
    uniform,
)
from trackmark.datasets.synthetic.render.path import quantised, smooth_step
from trackmark.datasets.synthetic.render.solids import (
    NOTHING,
    ParallelView,
    bowl,
    box,
    cast_rays,
    chain,
    half_space,
    limb,
    mirror_limbs,
)
from trackmark.datasets.synthetic.scene import SceneTruth, SeededScene

FRAMES = 80
SIZE = 108, 85
EVENT = 35

WALL = -45.0  # depth of the wall relative to the cup, positive towards the camera [pixels]
DOWN, UP = (12.0, 32.0), (45.0, 72.0)  # first and last frame of the cup's descent, and of its rise
# frames in which the cup moves faster sideways, past the border of the object behind it
HASTE = 12.0, 40.0


@dataclass(frozen=True)
class Cup:
    """Dimensions of the upright cup with its foot at the origin [pixels]."""

    height: float
    foot: float  # radius at the foot
    rim: float  # radius at the rim
    handle: float  # distance to which the handle extends from the cup's wall
    hand: int  # side of the hand, -1 (left) or 1 (right); the handle is on the other side


@dataclass(frozen=True)
class CupPlan:
    """Random layout of a kitchen, and the cup's path through it from left to right."""

    view: ParallelView
    horizon: float  # image row at which the wall meets the counter [pixels]
    cup: Cup
    mirrored: bool  # True if the images are mirrored horizontally
    pace: float  # sideways speed of the cup [pixels/frame]
    haste: float  # additional sideways distance in the frames `HASTE` [pixels]
    # (2, 3): rows are path and tilt; columns are amplitude, period [frames] and phase
    unevenness: Array
    # column and row of the cup's centre in frame `EVENT` [pixels]
    column: float
    low: float
    fall: float  # height of the descent before `EVENT` [pixels]
    rise: float  # height of the rise after `EVENT` [pixels]
    behind: tuple[float, float]  # left and right border of the object behind the cup [pixels]
    before: tuple[float, float]  # centre and half width of the box in front of the cup [pixels]
    # height of the box's upper edge above the lowest position of the cup's centre [pixels]
    hidden: float

    def middle(self, times: ArrayLike) -> Array:
        """Return the centre of the cup's axis in the image [pixels], shape `times.shape + (2,)`."""
        t = np.asarray(times, np.float64)
        x = self.column + self._across(t) - self._across(EVENT)
        down, up = smooth_step(t, *DOWN), smooth_step(t, *UP)
        y = self.low - self.fall * (1 - down) - self.rise * up
        return quantised(np.stack([x, y], axis=-1))

    def tilt(self, times: ArrayLike) -> Array:
        """Return the tilt of the cup to the right [radians]."""
        return self._uneven(1, np.asarray(times, np.float64))

    def _across(self, times: ArrayLike) -> Array:
        t = np.asarray(times, np.float64)
        return self.pace * t + self.haste * smooth_step(t, *HASTE) + self._uneven(0, t)

    def _uneven(self, row: int, times: ArrayLike) -> Array:
        size, period, phase = self.unevenness[row]
        return np.asarray(size * np.sin(2 * np.pi * np.asarray(times) / period + phase))


def sample_plan(random: Generator) -> CupPlan:
    """Sample the layout of a kitchen."""
    side = random.choice([-1.0, 1.0]) * random.uniform(0.45, 0.8)
    light = np.array([side, random.uniform(0.55, 0.8), 1.0])
    light /= np.sqrt((light * light).sum())
    view = ParallelView(
        random.uniform(0.22, 0.32), (float(light[0]), float(light[1]), float(light[2]))
    )
    rim = random.uniform(6.8, 7.5)
    cup = Cup(
        height=random.uniform(15.2, 16.6),
        foot=rim * random.uniform(0.76, 0.98),
        rim=rim,
        handle=random.uniform(4.0, 4.8),
        hand=int(random.choice([-1, 1])),
    )
    pace, haste = random.uniform(0.72, 0.80), random.uniform(9.5, 11.0)
    before = haste * float(smooth_step(np.array(EVENT), *HASTE))
    least = 14.5 + EVENT * pace + before
    column = random.uniform(least, 94.5 - (FRAMES - 1 - EVENT) * pace - (haste - before))
    left = column - random.uniform(11.5, 13.5)
    return CupPlan(
        view=view,
        horizon=random.uniform(59, 63),
        cup=cup,
        mirrored=bool(random.integers(2)),
        pace=pace,
        haste=haste,
        unevenness=np.array(
            [
                [random.uniform(0.3, 0.9), random.uniform(42, 70), random.uniform(0, 6.28)],
                [random.uniform(0.02, 0.06), random.uniform(40, 70), random.uniform(0, 6.28)],
            ]
        ),
        column=column,
        low=random.uniform(46, 49),
        fall=random.uniform(8, 11),
        rise=random.uniform(6, 11),
        behind=(left, left + random.uniform(34, 37)),
        before=(column + random.uniform(2, 5) * pace, random.uniform(10.5, 13.0)),
        hidden=random.uniform(-1.0, 0.5),
    )


BOX_DEPTH = 20.0  # depth of the box in front of the cup's path [pixels]


def bare_room(random: Generator, cup: Array, tiled: bool) -> list[SceneObject]:
    """Return the wall and the counter."""
    wood = colours.sample_other_hue(random, colours.COUNTERS, cup)
    wall = colours.sample_other_hue(random, colours.NEUTRALS, cup)
    pattern = grain(random, 0.018)
    if tiled:
        size = random.uniform(10, 15)
        pattern = tiles(random, size * random.choice([1.0, 1.8]), size, np.full(3, 0.88))
    ground = grain(random, 0.09, (0.12, 1.0, 1.4), 16)
    return [
        SceneObject(Finish(wall, 0.02, pattern), [half_space((0, 0, 1), WALL)]),
        SceneObject(Finish(wood, 0.03, ground), [half_space((0, 1, 0), 0)]),
    ]


def similar_objects(plan: CupPlan, random: Generator, cup: Array) -> list[SceneObject]:
    """Return a board, or a cloth and its bolts; the first object has nearly the cup's colour."""
    left, right = (border - SIZE[0] / 2 for border in plan.behind)
    middle, half = (left + right) / 2, (right - left) / 2
    colour = colours.vary_slightly(random, cup)
    top = _height(plan, random.uniform(13, 19), WALL + 3)
    if random.random() < 0.5:
        board = box((middle, top / 2, WALL + 3.2), (half, top / 2, 1.1), 1.0, lean=0.08)
        return [SceneObject(Finish(colour, 0.06, grain(random, 0.02)), [board])]
    hem = random.uniform(1.5, 4.0)
    folds = random.uniform(0.35, 0.7), random.uniform(0.45, 0.7)
    size = half, (top - hem) / 2, 1.0
    cloth = box((middle, (top + hem) / 2, WALL + 3.4), size, 0.9, folds=folds)
    ends = [np.array([middle + side * (half + 2.5), top - 0.8, WALL + 3.4]) for side in (-1, 1)]
    bolts = [limb(end, (end[0], end[1], WALL), (0.7, 0.7)) for end in ends]
    return [
        SceneObject(Finish(colour, 0.0, grain(random, 0.04, coarsest=32)), [cloth]),
        SceneObject(
            Finish(colours.sample_other_hue(random, colours.STEELS, cup), 0.5),
            [limb(ends[0], ends[1], (0.7, 0.7)), *bolts],
        ),
    ]


def carton(plan: CupPlan, random: Generator, cup: Array) -> SceneObject:
    """Return a box with a lid in nearly the cup's colour, in front of the cup's path."""
    place, half = plan.before
    turn = random.uniform(-0.4, 0.4)
    deep = random.uniform(5.0, 7.0)
    wide = (half - deep * abs(np.sin(turn))) / np.cos(turn)
    upper = plan.low - plan.hidden  # image row of the rear edge of the box's top
    height = _height(plan, upper, BOX_DEPTH - deep)
    lid, x = random.uniform(0.16, 0.3) * height, place - SIZE[0] / 2
    body = box((x, height / 2, BOX_DEPTH), (wide - 0.6, height / 2, deep - 0.6), 0.5, turn=turn)
    cover = box((x, height - lid / 2, BOX_DEPTH), (wide, lid / 2, deep), 0.5, turn=turn)
    return SceneObject(
        Finish(colours.vary_slightly(random, cup), 0.05, grain(random, 0.02)), [body, cover]
    )


def _height(plan: CupPlan, row: float, z: float) -> float:
    """Return the height above the counter at which a point appears in an image row [pixels]."""
    view = plan.view
    below = row - plan.horizon + float(view.row(0.0, WALL))
    return float((z * np.sin(view.pitch) - below) / np.cos(view.pitch))


def kitchen_objects(plan: CupPlan, random: Generator, cup: Array) -> list[SceneObject]:
    """Return jars, bottles and bowls next to the similar object, in hues unlike the cup's."""
    left, right = (border - SIZE[0] / 2 for border in plan.behind)
    kinds = [_jar, _bottle, _fruit, _holder]
    order = random.permutation(len(kinds)).tolist()
    things: list[SceneObject] = []
    for start, end in ((-SIZE[0] / 2 - 4, left - 2), (right + 2, SIZE[0] / 2 + 4)):
        x = start + random.uniform(0, 5)
        while order and x + 8 < end:
            wide = random.uniform(4.5, 7.0)
            z = WALL + wide + random.uniform(2, 7)
            if x + 2 * wide > end:
                break
            things += kinds[order.pop()](random, cup, x + wide, z, wide)
            x += 2 * wide + random.uniform(1.5, 9)
    return things


def _jar(random: Generator, cup: Array, x: float, z: float, wide: float) -> list[SceneObject]:
    high = random.uniform(14, 20)
    glaze = colours.sample_other_hue(random, colours.ACCENTS, cup)
    lid = colours.sample_other_hue(random, (*colours.NEUTRALS, *colours.COUNTERS), cup)
    body = bowl((x, 0.5, z), high, (wide * 0.92, wide), 1.0, closed=True)
    cap = bowl((x, high + 0.6, z), 2.0, (wide * 1.02, wide * 1.02), 1.2, closed=True)
    return [
        SceneObject(Finish(glaze, 0.3, _label(random, x, z, high, wide)), [body]),
        SceneObject(Finish(lid, 0.05), [cap]),
    ]


def _label(random: Generator, x: float, z: float, high: float, wide: float) -> Pattern:
    low, up = 0.3 * high, random.uniform(0.5, 0.7) * high
    half = random.uniform(0.5, 0.8) * wide

    def gain(places: Array) -> Array:
        on_label = (places[:, 1] > low) & (places[:, 1] < up) & (np.abs(places[:, 0] - x) < half)
        ink = 0.6 + 0.4 * (np.sin(places[:, 1] * 3.0) < 0.4)
        return np.where(on_label, 1.35 * ink, 1.0)[:, None]

    return gain if random.random() < 0.6 else uniform


def _bottle(random: Generator, cup: Array, x: float, z: float, wide: float) -> list[SceneObject]:
    slim, high = 0.62 * wide, random.uniform(19, 25)
    glass = colours.sample_other_hue(
        random, ((40, 66, 52), (34, 60, 96), (52, 50, 48), (60, 150, 176)), cup
    )
    body = bowl((x, 0.4, z), high, (slim, slim), 0.8, closed=True)
    neck = limb((x, high + 0.3, z), (x, high + 7, z), (slim * 0.72, slim * 0.34))
    cap = limb((x, high + 7.5, z), (x, high + 9.5, z), (slim * 0.42, slim * 0.42))
    paper = colours.sample_other_hue(random, colours.NEUTRALS, cup)
    label = bowl((x, 0.35 * high, z), 0.35 * high, (slim + 0.1, slim + 0.1), 0.8, closed=True)
    return [
        SceneObject(Finish(glass, 0.5), [body, neck]),
        SceneObject(Finish(colours.sample_other_hue(random, colours.ACCENTS, cup), 0.1), [cap]),
        SceneObject(Finish(paper, 0.02, grain(random, 0.06, (1, 2, 0.2), 32)), [label]),
    ]


def _fruit(random: Generator, cup: Array, x: float, z: float, wide: float) -> list[SceneObject]:
    dish = bowl((x, 0.6, z), 5.5, (0.5 * wide, 1.05 * wide), 0.9)
    kind = colours.sample_other_hue(
        random, ((40, 110, 214), (48, 190, 222), (40, 46, 176), (70, 160, 140)), cup
    )
    places = ((-0.5, 5.4, 0.1), (0.45, 5.3, 0.2), (0.0, 5.2, -0.5), (0.0, 8.2, 0.0))
    fruits = []
    for u, y, w in places:
        centre = np.array([x + u * wide, y, z + w * wide])
        fruits.append(limb(centre, centre + np.array([0.3, 0.2, 0.0]), (0.42 * wide, 0.42 * wide)))
    return [
        SceneObject(Finish(colours.sample_other_hue(random, colours.NEUTRALS, cup), 0.2), [dish]),
        SceneObject(Finish(kind, 0.12, grain(random, 0.05)), fruits),
    ]


def _holder(random: Generator, cup: Array, x: float, z: float, wide: float) -> list[SceneObject]:
    high = random.uniform(10, 13)
    pot = bowl((x, 0.5, z), high, (0.72 * wide, 0.8 * wide), 1.0)
    spoons, spatulas = [], []
    for k in range(4):
        lean = random.uniform(-0.22, 0.22)
        foot = np.array([x + (k - 1.5) * 0.3 * wide, 2.0, z + random.uniform(-0.2, 0.3) * wide])
        tip = foot + random.uniform(18, 23) * np.array([lean, 1.0, -0.05])
        stick = limb(foot, tip, (0.6, 0.6))
        if k % 2:
            spoons += [stick, limb(tip, tip + np.array([lean, 2.5, 0.0]), (1.7, 1.2), 0.6)]
        else:
            spatulas += [stick, box(tip, (1.5, 2.6, 0.5), 0.4)]
    wood = colours.sample_other_hue(random, colours.COUNTERS[:3], cup)
    dark = colours.sample_other_hue(random, colours.ACCENTS[5:], cup)
    return [
        SceneObject(Finish(colours.sample_other_hue(random, colours.ACCENTS, cup), 0.25), [pot]),
        SceneObject(Finish(wood, 0.02), spoons),
        SceneObject(Finish(dark, 0.05), spatulas),
    ]


THICK = 1.1  # thickness of the cup's wall [pixels]


def held_cup(cup: Cup, colour: Array, random: Generator) -> list[SceneObject]:
    """Return cup, hand and sleeve; `colour` is the colour of the cup, BGR in [0, 255]."""
    skin = sample_skin(random)
    cloth = colours.sample_other_hue(random, colours.CLOTHES, colour)
    slope = random.uniform(-0.34, 0.02)
    grip = random.uniform(0.46, 0.54) * cup.height
    return [
        SceneObject(Finish(colour, 0.08), _cup(cup)),
        SceneObject(Finish(skin, 0.04, grain(random, 0.03)), _hand(cup, grip, slope)),
        SceneObject(Finish(cloth, 0.0, _knitted(random, slope)), _sleeve(cup, grip, slope)),
    ]


def _cup(cup: Cup) -> list[Array]:
    body = bowl((0, THICK / 2, 0), cup.height - THICK, (cup.foot, cup.rim), THICK)
    angles = np.linspace(-1.5, 1.5, 10)
    height = 0.52 * cup.height + 0.31 * cup.height * np.sin(angles)
    wall = cup.foot + (cup.rim - cup.foot) * height / cup.height
    out = wall + (cup.handle - 1.1) * np.cos(angles) ** 0.7
    turn = 0.3  # displacement of the handle towards the camera
    arc = np.stack([-cup.hand * out * np.cos(turn), height, out * np.sin(turn)], axis=1)
    return [body, *chain(arc, np.full(10, 1.1), 0.0)]


def _hand(cup: Cup, grip: float, slope: float) -> list[Array]:
    """Return the thumb in front of the cup, the fingers behind it, and the palm at its side."""
    cup_side = cup.rim
    wrist = np.array([cup_side + 14.5, grip + 14.5 * slope, 2.5])
    knuckles = [
        np.array([cup_side + 3.4 - 0.3 * k * k, grip + 5.2 - 3.1 * k, 0.4]) for k in range(4)
    ]
    solids = []
    for k, knuckle in enumerate(knuckles):
        radius = (1.75, 1.8, 1.7, 1.5)[k]
        root = wrist + np.array([-1.0, 2.4 - 1.6 * k, -0.6])
        around = np.array([0.55 * cup_side, knuckle[1] - 0.3, -cup_side - 1.6])
        tip = np.array([-0.55 * cup_side, knuckle[1] - 0.9, -cup_side - 0.9])
        solids += chain([root, knuckle, around, tip], (2.6, radius, radius, radius - 0.3), 1.2)
    ball = np.array([cup_side + 6.0, grip + 0.2 + 4.0 * slope, 3.6])
    joint = np.array([0.80 * cup_side, grip + 1.6, 0.72 * cup_side + 1.6])
    tip = np.array([0.10 * cup_side, grip + 2.6, cup_side + 1.2])
    solids += chain([wrist, ball, joint, tip], (3.2, 2.7, 1.9, 1.45), 1.6)
    arm = wrist + np.array([9.0, 9.0 * slope, 1.0])
    solids += chain([wrist, arm], (3.8, 4.6), 2.0)
    return mirror_limbs(solids, cup.hand)


def _sleeve(cup: Cup, grip: float, slope: float) -> list[Array]:
    start = np.array([cup.rim + 20.5, grip + 20.5 * slope, 3.0])
    direction = np.array([1.0, slope, 0.10])
    cuff = chain([start, start + 2.6 * direction], (5.4, 5.5), 0.0)
    arm = chain(
        [start + 1.5 * direction, start + 30 * direction, start + 110 * direction],
        (5.0, 6.6, 9.5),
        1.0,
    )
    return mirror_limbs([*cuff, *arm], cup.hand)


def _knitted(random: Generator, slope: float) -> Pattern:
    uneven = grain(random, 0.08, (0.6, 1.0, 1.0), 16)

    def gain(places: Array) -> Array:
        along = places[:, 0] + slope * places[:, 1]
        return np.asarray(uneven(places) * (1 + 0.03 * np.sin(2.4 * along))[:, None])

    return gain


FINE = 4  # samples per pixel and axis


class PlacedLayer:
    """Flat layer that can be moved, and tilted around an anchor.

    `picture` is a uint8 array with `FINE` samples per pixel and axis; it is 0 where the layer is
    empty. `anchor` is the reference point relative to the upper left corner [pixels].
    """

    def __init__(self, picture: NDArray[np.uint8], anchor: ArrayLike) -> None:
        self._picture = picture
        self._anchor = np.asarray(anchor, np.float64)

    def render_at(self, place: ArrayLike, tilt: float) -> Array:
        """Render the layer with its anchor at a position [pixels], tilted to the right [radians].

        Returns the whole image, shape (height, width) or (height, width, channels), in [0, 1].
        """
        turn = np.array([[np.cos(tilt), np.sin(tilt)], [-np.sin(tilt), np.cos(tilt)]])
        middle = FINE * np.asarray(place, np.float64) - 0.5
        shift = FINE * self._anchor - 0.5 - turn @ middle
        canvas = FINE * SIZE[0], FINE * SIZE[1]
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        matrix = np.column_stack([turn, shift])
        return downsample(cv2.warpAffine(self._picture, matrix, canvas, flags=flags))

    def extents(self, places: Array, tilts: Array) -> Array:
        """Return tight boxes around the layer for n positions and tilts, shape (n, 4) [pixels]."""
        rows, columns = np.nonzero(self._picture)
        ends = [(columns + u, rows + v) for u in (0, 1) for v in (0, 1)]
        corners = np.concatenate([np.stack(end, axis=1) for end in ends]).astype(np.int32)
        outline = cv2.convexHull(corners)[:, 0] / FINE - self._anchor
        cosine, sine = np.cos(tilts)[:, None], np.sin(tilts)[:, None]
        x = places[:, :1] + cosine * outline[:, 0] - sine * outline[:, 1]
        y = places[:, 1:] + sine * outline[:, 0] + cosine * outline[:, 1]
        left, top = x.min(axis=1), y.min(axis=1)
        return np.stack([left, top, x.max(axis=1) - left, y.max(axis=1) - top], axis=1)


def downsample(picture: NDArray[Any], fine: int = FINE) -> Array:
    """Return the mean of the samples of each pixel, scaled from [0, 255] to [0, 1]."""
    height, width = picture.shape[0] // fine, picture.shape[1] // fine
    pixel_means = cv2.resize(
        picture.astype(np.float64), (width, height), interpolation=cv2.INTER_AREA
    )
    return np.asarray(pixel_means / 255)


Corner: TypeAlias = tuple[float, float]

STILL_FINE = 3  # samples per pixel and axis of static objects
# window of the cup: upper left corner relative to the cup's centre, and size [pixels]
CUP_CORNER, CUP_SIZE = (-14, -13), (28, 26)
# size of the window of cup, hand and arm; it begins slightly above the cup [pixels]
ARM_SIZE = 112, 66


EXPOSURE = 0.5  # fraction of the frame time for which the shutter is open
CAMERA = Camera(SIZE, noise=2.2)

# fraction of light that the shadow on the wall removes, and softness of the shadow [pixels]
SHADOW, SOFTNESS = 0.3, 2.2
# the attributes `occluded` and `similar background` need at least this fraction of the cup
NOTICED = 0.1


class CupScene(SeededScene):
    """Scene of a cup in a hand in a kitchen.

    `plan` is the layout and `colour` the colour of the cup, BGR in [0, 255]. Layers and coverages
    are not mirrored.
    """

    label, length, size = "kitchen", FRAMES, SIZE

    def __init__(self, parameters: SceneParameters) -> None:
        super().__init__(parameters)
        self.plan = sample_plan(self._random("plan"))
        random = self._random("cup")
        self.colour = colours.vary_slightly(
            random, colours.CUPS[int(random.integers(len(colours.CUPS)))], 0.06
        )

    @cached_property
    def carried(self) -> PlacedLayer:
        """Layer of cup, hand and arm with BGR and coverage; the anchor is the cup's centre."""
        left = CUP_CORNER[0] if self.plan.cup.hand > 0 else -CUP_CORNER[0] - ARM_SIZE[0]
        top = CUP_CORNER[1] - 2
        picture, _ = self._look(self._held, (left, top + self._rise), ARM_SIZE, FINE)
        return PlacedLayer(picture, (-left, -top))

    @cached_property
    def silhouettes(self) -> tuple[PlacedLayer, PlacedLayer]:
        """Layers of the whole cup, and of the part that the hand does not occlude."""
        corner = CUP_CORNER[0], CUP_CORNER[1] + self._rise
        anchor = -CUP_CORNER[0], -CUP_CORNER[1]
        alone, held = (
            PlacedLayer(np.uint8(255) * (self._trace(things, corner, CUP_SIZE) == 0), anchor)
            for things in (self._held[:1], self._held)
        )
        return alone, held

    @cached_property
    def still(self) -> tuple[Array, Array]:
        """Background (height, width, 3), and the box in front of the cup (height, width, 4).

        Both are in [0, 1]. The box is premultiplied by its coverage. The background contains the
        shadow of the box.
        """
        random = self._random("room")
        room = bare_room(random, self.colour, random.random() < 0.5)
        room += [*self._similar, *kitchen_objects(self.plan, self._random("stores"), self.colour)]
        picture, owners = self._look([*room, *self._carton], self._corner, SIZE, STILL_FINE)
        before = owners == len(room)
        box = picture * before[..., None]
        rows, columns = (np.flatnonzero(before.any(axis=k)) // STILL_FINE for k in (1, 0))
        left, top = int(columns[0]), int(rows[0])
        size = int(columns[-1]) + 1 - left, int(rows[-1]) + 1 - top
        corner = self._corner[0] + left, self._corner[1] + top
        uncovered, _ = self._look(room, corner, size, STILL_FINE)
        window = np.ix_(*(
            np.arange(STILL_FINE * start, STILL_FINE * (start + length))
            for start, length in ((top, size[1]), (left, size[0]))
        ))  # fmt: skip
        picture[window] = np.where(before[window][..., None], uncovered, picture[window])
        return downsample(picture[..., :3], STILL_FINE), downsample(box, STILL_FINE)

    @cached_property
    def hidden(self) -> Array:
        """Coverage by the box in front of the cup, shape (height, width)."""
        return self._coverage(self._carton)

    @cached_property
    def similar(self) -> Array:
        """Coverage by the object of similar colour behind the cup, shape (height, width)."""
        return self._coverage(self._similar[:1])

    @cached_property
    def _held(self) -> list[SceneObject]:
        return held_cup(self.plan.cup, self.colour, self._random("hand"))

    @cached_property
    def _carton(self) -> list[SceneObject]:
        return [carton(self.plan, self._random("box"), self.colour)]

    @cached_property
    def _similar(self) -> list[SceneObject]:
        return similar_objects(self.plan, self._random("cloth"), self.colour)

    @property
    def _rise(self) -> float:
        """Row of the cup's centre relative to its foot [pixels]."""
        return float(self.plan.view.row(self.plan.cup.height / 2, 0.0))

    @property
    def _corner(self) -> Corner:
        """Upper left corner of the image relative to the origin [pixels]."""
        return -SIZE[0] / 2, float(self.plan.view.row(0.0, WALL)) - self.plan.horizon

    def _coverage(self, things: Sequence[SceneObject]) -> Array:
        return downsample(255.0 * (self._trace(things, self._corner, SIZE) != NOTHING))

    def _trace(
        self, things: Sequence[SceneObject], corner: Corner, size: tuple[int, int]
    ) -> NDArray[np.int64]:
        solids = [thing.solids for thing in things]
        owners, _, _ = cast_rays(solids, self.plan.view, corner, size, FINE, shaded=False)
        return owners

    def _look(
        self, things: Sequence[SceneObject], corner: Corner, size: tuple[int, int], fine: int
    ) -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
        solids = [thing.solids for thing in things]
        owners, places, lights = cast_rays(solids, self.plan.view, corner, size, fine)
        return shade_objects([thing.finish for thing in things], owners, places, lights), owners

    def truth(self) -> SceneTruth:
        """Return the ground truth of all frames.

        A box contains the cup with its handle. Attributes are `occluded` (the box occludes at least
        a tenth of the cup) and `similar background` (at least a tenth of the cup is in front of the
        object of similar colour).
        """
        times = np.arange(FRAMES)
        boxes = self.silhouettes[0].extents(self.plan.middle(times), self.plan.tilt(times))
        if self.plan.mirrored:
            boxes[:, 0] = SIZE[0] - boxes[:, 0] - boxes[:, 2]
        shares = np.empty((FRAMES, 3))
        for frame in range(FRAMES):
            whole, seen = self.seen(frame)
            parts = seen, whole * self.hidden, whole * self.similar
            shares[frame] = [part.sum() / whole.sum() for part in parts]
        return SceneTruth(
            boxes,
            shares[:, 0],
            {"occluded": shares[:, 1] >= NOTICED, "similar background": shares[:, 2] >= NOTICED},
        )

    def render(self, frame: int) -> Image:
        behind, box = self.still
        instants = frame + EXPOSURE * np.array([-0.25, 0.25])
        carried = np.mean([self.carried.render_at(*self._pose(t)) for t in instants], axis=0)
        picture = behind * (1 - self._shadow(carried[..., 3]))[..., None]
        for layer in (carried, box):
            picture = picture * (1 - layer[..., 3:]) + layer[..., :3]
        canvas = np.round(255 * np.clip(picture, 0, 1)).astype(np.uint8)
        if self.plan.mirrored:
            canvas = np.ascontiguousarray(canvas[:, ::-1])
        return CAMERA.exposed(canvas, self._seed, frame)

    def mask(self, frame: int) -> Mask:
        mask = self.seen(frame)[1] >= 0.5
        return np.asarray(mask[:, ::-1] if self.plan.mirrored else mask)

    def seen(self, frame: int) -> tuple[Array, Array]:
        """Return the coverage by the whole cup, and by its visible part; not mirrored."""
        whole, held = (layer.render_at(*self._pose(frame)) for layer in self.silhouettes)
        return whole, held * (1 - self.hidden)

    def _pose(self, time: float) -> tuple[Array, float]:
        return self.plan.middle(time), float(self.plan.tilt(time))

    def _shadow(self, coverage: Array) -> Array:
        """Return the fraction of light that cup, hand and arm remove from the wall."""
        x, y, z = self.plan.view.light
        shift = WALL * x / z, float(self.plan.view.row(WALL * y / z, WALL))
        matrix = np.column_stack([np.eye(2), shift])
        thrown = cv2.warpAffine(coverage, matrix, SIZE)
        return np.asarray(SHADOW * cv2.GaussianBlur(thrown, (0, 0), SOFTNESS))
