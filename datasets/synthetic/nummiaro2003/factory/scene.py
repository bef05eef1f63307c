"""`nummiaro2003/head`: a worker's head, seen by a fixed camera, before machines of all colours.

The paper says: a Siemens factory, 450 frames. "The tracked person carries out several
operations on different machines", "large out-of-plane rotations of the head and unpredictable
locations in front of a highly textured background". All the rest is ours. That the camera
stands still is our choice, too: the words speak of the person's motion alone.

The paper does not say that the worker is quick, as it does of the car in traffic ("rapid movements
of the target and the camera"). The use is "training, on-line documentation and planning". So he
moves at everyday speeds (see `routine`).
"""

from dataclasses import replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.interface import Image, Mask
from trackmark.datasets.synthetic.knobs import SceneKnobs
from trackmark.datasets.synthetic.nummiaro2003.factory.hall import hall
from trackmark.datasets.synthetic.render.attributes import occluded
from trackmark.datasets.synthetic.render.camera import Camera, slow_exposure
from trackmark.datasets.synthetic.render.figure.look import drawn_look
from trackmark.datasets.synthetic.render.figure.routine import (
    FOCAL,
    FRAMES,
    FRAMES_PER_SECOND,
    SIZE,
    drawn_routine,
)
from trackmark.datasets.synthetic.render.figure.worker import Worker
from trackmark.datasets.synthetic.scene import Scene, Truth, part_generator, pasted

Array = NDArray[np.float64]

WALL = 3.2  # distance of the machines from the camera [metres]
AXIS = 235.0  # row of the camera's horizon [pixels]
EXPOSURE = 0.4  # part of the time between two frames for which the shutter is open
CAMERA = Camera(SIZE, noise=2.5)

# Where the head faces away from the camera by more than this, nothing is seen of the face.
TURNED_AWAY = np.radians(120)
FAST = 0.1  # a head is fast that moves by this part of its width in a frame


def scene(knobs: SceneKnobs) -> "HeadScene":
    """Return renderer and ground truth; nothing is drawn yet."""
    return HeadScene(knobs.scene)


class HeadScene(Scene):
    """A worker before machines, in a bright hall."""

    length, size = FRAMES, SIZE
    fps = FRAMES_PER_SECOND

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self.worker = _worker(seed)

    def truth(self) -> Truth:
        """See `Scene.truth`.

        Boxes are those of the head, from the chin to the crown, with hair and ears.
        Attributes are `turned_away` (nothing is seen of the face), `fast` (moves by a tenth of
        its width in a frame) and `occlusion` (less than 0.9 of it is seen: hands, shoulders).
        """
        return _truth(self._seed)

    def render(self, frame: int) -> Image:
        canvas = self._wall.copy()
        self.worker.draw(canvas, frame, 1.0, EXPOSURE)
        return CAMERA.exposed(canvas, self._seed, frame, self._exposure[frame])

    def mask(self, frame: int) -> Mask:
        left, top, _, seen = self.worker.head_seen(frame)
        return pasted(SIZE, left, top, seen) >= 128

    @cached_property
    def _wall(self) -> Image:
        wall = hall(part_generator(self._seed, "factory hall"), *SIZE, FOCAL / WALL)
        return np.clip(np.round(wall), 0, 255).astype(np.uint8)

    @cached_property
    def _exposure(self) -> Array:
        random = part_generator(self._seed, "factory exposure")
        return 1.04 * slow_exposure(random, FRAMES)


def _camera(seed: int) -> Array:
    random = part_generator(seed, "factory camera")
    return np.array([FOCAL, SIZE[0] / 2, AXIS, random.uniform(1.45, 1.55)])


@lru_cache(maxsize=4)
def _worker(seed: int) -> Worker:
    look = drawn_look(part_generator(seed, "factory look"))
    # Front and back of the head differ in colour, so that large rotations show.
    look = replace(look, beard=False, cut="short" if look.cut == "full" else look.cut)
    routine = drawn_routine(part_generator(seed, "factory routine"))
    lamp = np.array([part_generator(seed, "factory light").uniform(-0.5, 0.5), 0.8, -0.7])
    lamp /= np.sqrt((lamp * lamp).sum())
    return Worker(look, routine, _camera(seed), np.append(lamp, 0.5), seed)


@lru_cache(maxsize=4)
def _truth(seed: int) -> Truth:
    worker = _worker(seed)
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
