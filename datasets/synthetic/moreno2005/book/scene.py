"""`moreno2005/book`: a book bends in front of desk and shelf while the light turns yellow.

The paper: the non-rigid boundary of a bending book; the light changes smoothly from natural to
yellow; the smooth model fails by "the effect of self-shadowing produced during the movement of
the book". All other properties are our choice: the hand, the room, the lamp that lights the book
from the side, bends that put most of the cover into its own shadow within a frame, and a cloth that
looks like the wall when it is in the shadow.
"""

from functools import cached_property, lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.interface import Image, Mask
from trackmark.datasets.synthetic.knobs import SceneKnobs
from trackmark.datasets.synthetic.moreno2005.book.book import (
    FRAMES,
    SIZE,
    Book,
    Plan,
    Surface,
    drawn_plan,
    self_shadow,
)
from trackmark.datasets.synthetic.render.camera import Camera, developed
from trackmark.datasets.synthetic.render.colours import CLOTHES, one_of
from trackmark.datasets.synthetic.render.desk import seen_room
from trackmark.datasets.synthetic.render.figure.look import drawn_skin
from trackmark.datasets.synthetic.render.finish import GAMMA, Finish, Thing, grain, looked_at
from trackmark.datasets.synthetic.render.lamp import REACH, light_left, light_on, unshaded
from trackmark.datasets.synthetic.render.path import smooth_step
from trackmark.datasets.synthetic.render.solids import chain
from trackmark.datasets.synthetic.render.triangles import (
    Mesh,
    Seen,
    box_around,
    lay,
    seen,
)
from trackmark.datasets.synthetic.scene import Scene, Truth, part_generator

Array = NDArray[np.float64]
Floats = NDArray[np.float32]

# Light from all around, and of the lamp on a surface of the book or of the room that faces it.
AROUND, STRAIGHT, ROOM_STRAIGHT = 0.22, 1.7, 0.35
# Colours of the light, BGR: as of a window to the north; as of a bulb.
NATURAL, YELLOW = np.array([1.12, 1.0, 0.90]), np.array([0.32, 0.84, 1.08])
FAR = 620.0  # how far the lamp is from the middle of the picture [pixels]
SHADOWED = 1.1  # light on the cloth that looks like the wall, in parts of `AROUND`
HORIZON = 178  # row in which the wall meets the desk [pixels]
ROOM_FINE = 2  # samples a pixel of what stands still, in either direction
# What holds hand and arm: left top from the held place, and size [pixels]; samples a pixel.
HAND_CORNER, HAND_SIZE, HAND_FINE = (-90, -34), (180, 190), 2
BLEND = 4.0  # how far the hand's parts run into one another [pixels]


class Setting:
    """All parts of a scene that are drawn from its seed.

    `lamp` is the direction to the light: aside, a little above, before the book; shape (3,).
    """

    def __init__(self, seed: int) -> None:
        self._seed = seed
        random = self._random("lamp")
        lamp = np.array([random.choice([-1, 1]) * random.uniform(0.80, 0.90), -0.25, 0.40])
        self.lamp: Array = lamp / np.sqrt((lamp * lamp).sum())
        self.book = Book(self._random("book"))

    @cached_property
    def plan(self) -> Plan:
        """How the book moves and bends."""
        return drawn_plan(self._random("plan"), self.book.height, float(np.sign(self.lamp[0])))

    @cached_property
    def illuminants(self) -> Array:
        """Gains of BGR as the light turns from natural to yellow, shape (FRAMES, 3)."""
        random = self._random("illuminant")
        start, end = random.uniform(0.02, 0.12), random.uniform(0.88, 0.98)
        share = smooth_step(np.arange(FRAMES) / (FRAMES - 1), start, end)[:, None]
        return np.asarray(NATURAL * (1 - share) + YELLOW * share)

    @cached_property
    def room(self) -> Floats:
        """What stands still, in white light, shape (height, width, 3)."""
        surface = seen_room(self._random("room"), SIZE, HORIZON, ROOM_FINE)
        place = np.array([SIZE[0] / 2, SIZE[1] / 2, 0.0]) + FAR * self.lamp
        straight, _ = light_on(place, surface.depth, surface.normal, ROOM_FINE)
        straight *= ROOM_STRAIGHT * (FAR / REACH) ** 2
        light = AROUND + straight[..., None] * unshaded(surface.depth, place, ROOM_FINE)
        returned = np.asarray(surface.colour * light, np.float32)
        return np.asarray(cv2.resize(returned, SIZE, interpolation=cv2.INTER_AREA))

    @cached_property
    def _hand(self) -> Floats:
        """What holds the book, in white light, premultiplied by the last channel, coverage."""
        random = self._random("hand")
        side = float(random.choice([-1, 1]))
        skin, cloth = drawn_skin(random), one_of(random, CLOTHES, 0.06)
        things = [
            Thing(Finish(skin, 0.0, grain(random, 0.04)), _skin(random, side)),
            Thing(Finish(cloth, 0.0, grain(random, 0.09, (1.0, 0.6, 1.0), 16)), _sleeve(side)),
        ]
        surface = looked_at(things, HAND_CORNER, HAND_SIZE, HAND_FINE)
        light = AROUND + STRAIGHT * np.maximum(surface.normal @ self.lamp, 0)
        there = (surface.which >= 0)[..., None]
        sheet = np.concatenate([surface.colour * light[..., None], there], axis=2)
        return np.asarray(cv2.resize(sheet, HAND_SIZE, interpolation=cv2.INTER_AREA), np.float32)

    def hand(self, frame: int) -> Floats:
        """The hand where it holds the book in a frame, shape (height, width, 4)."""
        pose = self.plan.poses[frame]
        cosine, sine = np.cos(pose.tilt), np.sin(pose.tilt)
        turn = pose.scale * np.array([[cosine, -sine], [sine, cosine]])
        shift = pose.place + turn @ (np.array(HAND_CORNER) + 0.5) - 0.5
        matrix = np.column_stack([turn, shift])
        return np.asarray(cv2.warpAffine(self._hand, matrix, SIZE, flags=cv2.INTER_LINEAR))

    def surface(self, frame: int) -> Surface:
        """The book in a frame."""
        return self.book.surface(self.plan.bendings[frame], self.plan.poses[frame], self.lamp)

    def seen(self, frame: int) -> Seen:
        """Return the book as it would be seen without the hand."""
        return self._looked_at(self._mesh, self.surface(frame))

    def _looked_at(self, mesh: Mesh, surface: Surface) -> Seen:
        open_ = 0.7 + 0.3 * surface.normals[:, 2]
        light = AROUND * open_ + STRAIGHT * surface.straight
        return seen(mesh, surface.points, np.repeat(light[:, None], 3, axis=1), SIZE)

    @cached_property
    def truth(self) -> tuple[Array, Array, Array]:
        """Boxes, visibility, and the front's part in its own shadow, in every frame."""
        # Coverage needs no colours: the room, from which the cloth has its own, is rendered later.
        mesh = self.book.mesh(self.book.blank())
        boxes, visibility, shadow = np.empty((FRAMES, 4)), np.empty(FRAMES), np.empty(FRAMES)
        for frame in range(FRAMES):
            surface = self.surface(frame)
            boxes[frame] = box_around(surface.points)
            book = self._looked_at(mesh, surface)
            hidden = self.hand(frame)[..., 3][book.window]
            whole = book.sheet[..., 3].sum(dtype=np.float64)
            visibility[frame] = 1 - (book.sheet[..., 3] * hidden).sum(dtype=np.float64) / whole
            shadow[frame] = self_shadow(surface, self.lamp)
        return boxes, visibility, shadow

    @cached_property
    def _mesh(self) -> Mesh:
        """The book's triangles; in its own shadow the cloth looks like the wall behind it."""
        wall = _most_frequent(self.room[20:HORIZON, 60:-60].reshape(-1, 3))
        light = np.clip(wall / (SHADOWED * AROUND), 0, 0.8)
        return self.book.mesh(self.book.printed(self._random("cover"), 255 * light ** (1 / GAMMA)))

    def _random(self, part: str) -> np.random.Generator:
        return part_generator(self._seed, f"moreno2005/book {part}")


def _most_frequent(colours: Floats) -> Array:
    """Return the mean of the fullest of 12³ bins of linear colours, shape (k, 3)."""
    bins = (12 * np.sqrt(np.clip(colours, 0, 0.999))).astype(int)
    _, inverse, counts = np.unique(bins, axis=0, return_inverse=True, return_counts=True)
    return np.asarray(colours[inverse.ravel() == counts.argmax()].mean(axis=0), np.float64)


def _skin(random: np.random.Generator, side: float) -> list[Array]:
    """Thumb, its ball, the palm's edge, knuckles and wrist; y upwards from the held place."""
    lean = random.uniform(-3, 3)
    wrist = (side * 14, -46, -6)
    solids = [
        *chain([(side * 12, -30, 6), (side * 6, -9, 12), (lean, 12, 13)], (9.5, 7.2, 5.2), BLEND),
        *chain([wrist, (side * 12, -28, 4)], (10.5, 11), BLEND),
    ]
    for k in range(4):
        knuckle = (side * (-17 + 9.5 * k), -12 - 1.5 * abs(k - 1.4), -2 - 2 * k)
        solids += chain([(side * (-2 + 5 * k), -34, -2), knuckle], (9, 6.2), BLEND)
    return solids


def _sleeve(side: float) -> list[Array]:
    cuff = chain([(side * 15, -50, -6), (side * 17, -58, -6)], (15, 15.5), BLEND)
    return cuff + chain([(side * 16, -54, -6), (side * 34, -160, -6)], (14, 22), BLEND)


# Part of the front in its own shadow from which on a frame counts as `self-shadow`.
CONSIDERABLE = 0.25
BEHIND = 70.0  # how far behind the book its shadow falls [pixels]
SOFTNESS, DARKNESS = 9.0, 0.7  # of the shadow: see `light_left`
CAMERA = Camera(SIZE, noise=2.0, fall=(0.05, 0.05))


def scene(knobs: SceneKnobs) -> "BookScene":
    """Renderer and truth; nothing is drawn yet."""
    return BookScene(knobs.scene)


class BookScene(Scene):
    """A book that bends in a hand."""

    length, size = FRAMES, SIZE

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self.setting = _setting(seed)

    def truth(self) -> Truth:
        """See `Scene.truth`.

        Boxes are those of the whole book, with what the thumb hides. The attribute is
        `self-shadow`: at least a quarter of the front, as far as it faces the camera, gets less
        than half of the lamp's light that it would get if it were flat before the camera.
        """
        boxes, visibility, shadow = self.setting.truth
        return Truth(boxes, visibility, {"self-shadow": shadow >= CONSIDERABLE})

    def render(self, frame: int) -> Image:
        setting = self.setting
        book = setting.seen(frame)
        hand = setting.hand(frame)
        covered = np.maximum(hand[..., 3], book.coverage(SIZE))
        shift = -BEHIND * setting.lamp[:2] / setting.lamp[2]
        left = light_left(covered, shift, SOFTNESS, DARKNESS)
        picture = np.asarray(cv2.multiply(setting.room, left), np.float32)
        lay(picture[book.window], book.sheet)
        lay(picture, hand)
        picture *= setting.illuminants[frame].astype(np.float32)
        return CAMERA.exposed(developed(picture), self._seed, frame)

    def mask(self, frame: int) -> Mask:
        book = self.setting.seen(frame).coverage(SIZE)
        return np.asarray(book * (1 - self.setting.hand(frame)[..., 3]) >= 0.5)


_setting = lru_cache(maxsize=4)(Setting)
