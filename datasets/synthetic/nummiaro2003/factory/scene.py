"""`nummiaro2003/head`: a worker's head, seen by a fixed camera, before machines of all colours.

The paper says: a Siemens factory, 450 frames. "The tracked person carries out several
operations on different machines", "large out-of-plane rotations of the head and unpredictable
locations in front of a highly textured background". All the rest is ours. That the camera
stands still is our choice, too: the words speak of the person's motion alone.

Nor do they say that he is quick, as they do of the car in traffic ("rapid movements of the target
and the camera"), and "training, on-line documentation" is no hurry. Yet as first drawn (`brisk`) he
crosses the hall at 0.85 m/s, and his head reaches half of its half width a frame. The paper's
filter lost it in most scenes, which is why there is a second pace; `calm` was drawn from everyday
speeds, looked at, and frozen before any tracker ran on it. The paper's claims are judged on it.
"""

from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from datasets.interface import Image, Mask
from datasets.synthetic.nummiaro2003.factory.hall import hall
from datasets.synthetic.nummiaro2003.knobs import HeadKnobs
from datasets.synthetic.render.attributes import occluded
from datasets.synthetic.render.camera import Camera, slow_exposure
from datasets.synthetic.render.figure.look import drawn_look
from datasets.synthetic.render.figure.routine import (
    BRISK,
    CALM,
    DEPTHS,
    FOCAL,
    FRAMES,
    FRAMES_PER_SECOND,
    SIZE,
    drawn_routine,
)
from datasets.synthetic.render.figure.worker import Worker
from datasets.synthetic.scene import Scene, Truth, part_generator, pasted

__all__ = ["HeadScene", "entries", "scene"]

Array = NDArray[np.float64]

WALL = 3.2
"""Distance of the machines from the camera [metres]."""

AXIS = 235.0
"""Row of the camera's horizon [pixels]."""

EXPOSURE = 0.4
"""Part of the time between two frames for which the shutter is open."""

CAMERA = Camera(SIZE, noise=2.5)

TURNED_AWAY = np.radians(120)
"""Where the head faces away from the camera by more than this, nothing is seen of the face."""

FAST = 0.1
"""A head is fast that moves by this part of its width in a frame."""

STATURES = 1.25, 1.65
"""Heights at which a head is, bending and standing [metres]."""


def scene(knobs: HeadKnobs) -> "HeadScene":
    """Renderer and truth; nothing is drawn yet."""
    return HeadScene(knobs.scene, knobs.light == "lamps", knobs.pace == "calm")


def entries(knobs: HeadKnobs) -> NDArray[np.float64]:
    """Left and right border, as far as heads are seen there."""
    focal, _, row, eye = _camera(knobs.scene)
    top, bottom = (row + (eye - up) * focal / DEPTHS[0] for up in STATURES[::-1])
    width = 0.17 * FOCAL / DEPTHS[0]
    return np.array([[left, top, width, bottom - top] for left in (0.0, SIZE[0] - width)])


class HeadScene(Scene):
    """A worker before machines.

    `lamps` says whether there is light and dark, else it is bright; `calm` whether he takes his
    time, else he hurries.
    """

    length, size = FRAMES, SIZE
    fps = FRAMES_PER_SECOND

    def __init__(self, seed: int, lamps: bool, calm: bool) -> None:
        self._seed = seed
        self._lamps = lamps
        self._calm = calm
        self.worker = _worker(seed, calm)

    def truth(self) -> Truth:
        """See `Scene.truth`.

        Boxes are those of the head, from the chin to the crown, with hair and ears.
        Attributes are `turned_away` (nothing is seen of the face), `fast` (moves by a tenth of
        its width in a frame) and `occlusion` (less than 0.9 of it is seen: hands, shoulders).
        """
        return _truth(self._seed, self._calm)

    def render(self, frame: int) -> Image:
        """See `Scene.render`."""
        canvas = self._wall.copy()
        column = round(float(self.worker.head_place(frame)[0]))
        self.worker.draw(canvas, frame, float(self._pools[column]), EXPOSURE)
        return CAMERA.exposed(canvas, self._seed, frame, self._exposure[frame])

    def mask(self, frame: int) -> Mask:
        """See `Scene.mask`."""
        left, top, _, seen = self.worker.head_seen(frame)
        return pasted(SIZE, left, top, seen) >= 128

    @cached_property
    def _wall(self) -> Image:
        wall = hall(part_generator(self._seed, "factory hall"), *SIZE, FOCAL / WALL)
        return np.clip(np.round(wall * self._pools[:, None]), 0, 255).astype(np.uint8)

    @cached_property
    def _pools(self) -> Array:
        """Light of each column of the picture."""
        if not self._lamps:
            return np.ones(SIZE[0])
        random = part_generator(self._seed, "factory lamps")
        spacing = random.uniform(210, 300)
        place = (np.arange(SIZE[0]) + 0.5) / spacing + random.uniform()
        return np.asarray(0.90 + 0.22 * np.cos(2 * np.pi * place))

    @cached_property
    def _exposure(self) -> Array:
        random = part_generator(self._seed, "factory exposure")
        return 1.04 * slow_exposure(random, FRAMES)


def _camera(seed: int) -> Array:
    random = part_generator(seed, "factory camera")
    return np.array([FOCAL, SIZE[0] / 2, AXIS, random.uniform(1.45, 1.55)])


@lru_cache(maxsize=4)
def _worker(seed: int, calm: bool) -> Worker:
    look = drawn_look(part_generator(seed, "factory look"))
    routine = drawn_routine(part_generator(seed, "factory routine"), CALM if calm else BRISK)
    lamp = np.array([part_generator(seed, "factory light").uniform(-0.5, 0.5), 0.8, -0.7])
    lamp /= np.sqrt((lamp * lamp).sum())
    return Worker(look, routine, _camera(seed), np.append(lamp, 0.5), seed)


@lru_cache(maxsize=4)
def _truth(seed: int, calm: bool) -> Truth:
    worker = _worker(seed, calm)
    boxes = np.stack([worker.head_box(frame) for frame in range(FRAMES)])
    motion = np.stack([worker.motion(frame) for frame in range(FRAMES)])
    visibility = np.empty(FRAMES)
    for frame in range(FRAMES):
        _, _, whole, seen = worker.head_seen(frame)
        visibility[frame] = seen.sum(dtype=np.float64) / whole.sum(dtype=np.float64)
    return Truth(
        boxes,
        visibility,
        {
            "turned_away": worker.facing < np.cos(TURNED_AWAY),
            "fast": np.sqrt((motion * motion).sum(axis=1)) > FAST * boxes[:, 2],
            "occlusion": occluded(visibility),
        },
    )
