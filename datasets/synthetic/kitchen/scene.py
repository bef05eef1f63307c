"""`wang2010/cup`: a hand carries a cup past things of nearly its colour.

The paper says: an own recording, 80 frames of 108 x 85, a cup. At frame 36 the target is
disturbed by surroundings of almost its colour and partly hidden by something of almost its
colour; colour can't be relied upon there, while the motion stays good. All the rest is ours.
"""

from functools import cached_property, lru_cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from datasets.interface import Image, Mask
from datasets.synthetic.engine import compositing, light, noise
from datasets.synthetic.engine.scene import Scene, Truth, part_generator
from datasets.synthetic.kitchen.colours import CUPS, nearly
from datasets.synthetic.kitchen.hand import held_cup
from datasets.synthetic.kitchen.knobs import CupKnobs
from datasets.synthetic.kitchen.layer import FINE, Layer, smaller
from datasets.synthetic.kitchen.painting import Thing, painted
from datasets.synthetic.kitchen.plan import FRAMES, SIZE, WALL, drawn_plan
from datasets.synthetic.kitchen.rays import NOTHING, what_is_seen
from datasets.synthetic.kitchen.room import bare_room, carton, similar_things, stores

__all__ = ["CupScene", "scene"]

Array = NDArray[np.float64]

STILL_FINE = 3
"""Samples a pixel of what stands still, in either direction."""

EXPOSURE = 0.5
"""Part of the time between two frames for which the shutter is open."""

NOISE = 2.2
"""Standard deviation of the sensor's noise [grey levels]."""

SHADOW, SOFTNESS = 0.3, 2.2
"""How much light the shadow on the wall takes, and its softness [pixels]."""

NOTICED = 0.1
"""Part of the cup that must be hidden, or before something of its colour, to be worth a word."""

WINDOW = (-14, -13), (28, 26)
"""Around the cup: left top from its middle, and size [pixels]."""

REACH, DROP = 112, 66
"""How far the arm is drawn, aside and down [pixels]."""


def scene(knobs: CupKnobs) -> "CupScene":
    """Renderer and truth; nothing is drawn yet."""
    return CupScene(knobs.scene, knobs.background == "plain")


class CupScene(Scene):
    """A cup in a hand.

    Parameters
    ----------
    seed : int
        Of all that is drawn at random.
    plain : bool
        Whether there is nothing but a wall of another colour, a counter, and the cup.
    """

    def __init__(self, seed: int, plain: bool) -> None:
        self._seed = seed
        self._plain = plain
        self.plan = drawn_plan(part_generator(seed, "kitchen plan"))
        random = part_generator(seed, "kitchen cup")
        self.colour = nearly(random, CUPS[int(random.integers(len(CUPS)))], 0.06)

    def __len__(self) -> int:
        return FRAMES

    @property
    def size(self) -> tuple[int, int]:
        """See `Scene.size`."""
        return SIZE

    def truth(self) -> Truth:
        """See `Scene.truth`.

        Boxes are those of the cup with its handle. Attributes are `occluded` (the box before
        it hides a tenth of the cup or more) and `similar background` (a tenth or more of it is
        before the thing of nearly its colour).
        """
        return _truth(self._seed, self._plain)

    def render(self, frame: int) -> Image:
        """See `Scene.render`."""
        behind, box = self._still
        instants = frame + EXPOSURE * np.array([-0.25, 0.25])
        carried = np.mean([self._carried.at(*self._pose(t)) for t in instants], axis=0)
        shade = SHADOW * cv2.GaussianBlur(self._shifted(carried[..., 3]), (0, 0), SOFTNESS)
        picture = behind * (1 - shade[..., None])
        for layer in (carried, box):
            picture = picture * (1 - layer[..., 3:]) + layer[..., :3]
        canvas = np.round(255 * np.clip(picture, 0, 1)).astype(np.uint8)
        canvas = np.ascontiguousarray(self._sided(canvas))
        compositing.develop(
            canvas,
            light.fixed_point(light.vignette(SIZE[1], 0.08)),
            light.fixed_point(light.vignette(SIZE[0], 0.1)),
            self._noise_table,
            noise.random_bytes(self._seed, frame, canvas.size),
        )
        return canvas

    def mask(self, frame: int) -> Mask:
        """See `Scene.mask`."""
        return np.asarray(self._sided(self.seen(frame)[1]) >= 0.5)

    def seen(self, frame: int) -> tuple[Array, Array]:
        """Part of each pixel that the cup covers, and part that shows it; not yet mirrored."""
        whole, bare = (layer.at(*self._pose(frame)) for layer in self.silhouettes)
        return whole, bare * (1 - self.hidden)

    @cached_property
    def silhouettes(self) -> tuple[Layer, Layer]:
        """The whole cup, and what the hand leaves of it."""
        corner = WINDOW[0][0], WINDOW[0][1] + self._rise
        things = [thing.solids for thing in self._things]
        pictures = []
        for some in (things[:1], things):
            which, _, _ = what_is_seen(some, self.plan.view, corner, WINDOW[1], FINE, shaded=False)
            pictures.append(np.where(which == 0, 255, 0).astype(np.uint8))
        anchor = -np.array(WINDOW[0], np.float64)
        return Layer(pictures[0], anchor), Layer(pictures[1], anchor)

    @cached_property
    def hidden(self) -> Array:
        """Part of each pixel that the box before the cup hides; not yet mirrored."""
        return self._silhouette(self._carton)

    @cached_property
    def similar(self) -> Array:
        """Part of each pixel that the thing of nearly the cup's colour covers, as `hidden`."""
        return self._silhouette(self._similar[:1])

    def _pose(self, time: float) -> tuple[Array, float]:
        return self.plan.middle(time), float(self.plan.tilt(time))

    def _sided(self, picture: NDArray[Any]) -> NDArray[Any]:
        return picture[:, ::-1] if self.plan.mirrored else picture

    def _shifted(self, coverage: Array) -> Array:
        """Where the lamp throws the shadow of what is carried: on the wall."""
        x, y, z = self.plan.view.light
        shift = -WALL * x / z, float(self.plan.view.row(WALL * y / z, WALL))
        matrix = np.array([[1, 0, -shift[0]], [0, 1, shift[1]]])
        return np.asarray(cv2.warpAffine(coverage, matrix, SIZE))

    @property
    def _rise(self) -> float:
        """Row of the cup's middle where its foot stands at the origin [pixels]."""
        return float(self.plan.view.row(self.plan.cup.height / 2, 0.0))

    @property
    def _corner(self) -> tuple[float, float]:
        """Left top of the picture from the origin [pixels]."""
        return -SIZE[0] / 2, float(self.plan.view.row(0.0, WALL)) - self.plan.horizon

    @cached_property
    def _things(self) -> list[Thing]:
        random = part_generator(self._seed, "kitchen hand")
        return held_cup(self.plan.cup, self.colour, random)

    @cached_property
    def _carton(self) -> list[Thing]:
        if self._plain:
            return []
        return [carton(self.plan, part_generator(self._seed, "kitchen box"), self.colour)]

    @cached_property
    def _similar(self) -> list[Thing]:
        if self._plain:
            return []
        random = part_generator(self._seed, "kitchen cloth")
        return similar_things(self.plan, random, self.colour)

    def _silhouette(self, things: list[Thing]) -> Array:
        if not things:
            return np.zeros(SIZE[::-1])
        solids = [thing.solids for thing in things]
        which, _, _ = what_is_seen(solids, self.plan.view, self._corner, SIZE, FINE, shaded=False)
        return smaller(np.where(which == NOTHING, 0, 255).astype(np.uint8))

    @cached_property
    def _carried(self) -> Layer:
        """Cup, hand and arm."""
        left = WINDOW[0][0] if self.plan.cup.hand > 0 else -WINDOW[0][0] - REACH
        top = WINDOW[0][1] - 2
        picture, _ = self._drawn(self._things, (left, top + self._rise), (REACH, DROP), FINE)
        return Layer(picture, (-left, -top))

    @cached_property
    def _still(self) -> tuple[Array, Array]:
        """What is behind the cup, with the shadow of what is before it; and that itself."""
        random = part_generator(self._seed, "kitchen room")
        room = bare_room(random, self.colour, not self._plain and random.random() < 0.5)
        if not self._plain:
            random = part_generator(self._seed, "kitchen stores")
            room = [*room, *self._similar, *stores(self.plan, random, self.colour)]
        behind, which = self._drawn([*room, *self._carton], self._corner, SIZE, STILL_FINE)
        before = which == len(room)
        box = behind * before[..., None]
        if before.any():
            rows, columns = (np.flatnonzero(before.any(axis=k)) // STILL_FINE for k in (1, 0))
            left, top = int(columns[0]), int(rows[0])
            size = int(columns[-1]) + 1 - left, int(rows[-1]) + 1 - top
            corner = self._corner[0] + left, self._corner[1] + top
            uncovered, _ = self._drawn(room, corner, size, STILL_FINE)
            part = tuple(
                slice(STILL_FINE * start, STILL_FINE * (start + length))
                for start, length in ((top, size[1]), (left, size[0]))
            )
            behind[part] = np.where(before[part][..., None], uncovered, behind[part])
        return smaller(behind[..., :3], STILL_FINE), smaller(box, STILL_FINE)

    def _drawn(
        self, things: list[Thing], corner: tuple[float, float], size: tuple[int, int], fine: int
    ) -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
        solids = [thing.solids for thing in things]
        which, places, lights = what_is_seen(solids, self.plan.view, corner, size, fine)
        return painted([thing.finish for thing in things], which, places, lights), which

    @cached_property
    def _noise_table(self) -> NDArray[np.int32]:
        return noise.noise_table(NOISE)


@lru_cache(maxsize=32)
def _truth(seed: int, plain: bool) -> Truth:
    cup = CupScene(seed, plain)
    times = np.arange(FRAMES)
    whole, _ = cup.silhouettes
    boxes = whole.extents(cup.plan.middle(times), cup.plan.tilt(times))
    if cup.plan.mirrored:
        boxes[:, 0] = SIZE[0] - boxes[:, 0] - boxes[:, 2]
    shares = np.empty((FRAMES, 3))
    for frame in range(FRAMES):
        covered, bare = cup.seen(frame)
        parts = bare, covered * cup.hidden, covered * cup.similar
        shares[frame] = [part.sum() / covered.sum() for part in parts]
    return Truth(
        boxes,
        shares[:, 0],
        {"occluded": shares[:, 1] >= NOTICED, "similar background": shares[:, 2] >= NOTICED},
    )
