"""Renderer of `plain/target`."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.interface import Image, Mask
from trackmark.datasets.synthetic.plain import appearance
from trackmark.datasets.synthetic.plain.appearance import Thing
from trackmark.datasets.synthetic.plain.knobs import TargetKnobs
from trackmark.datasets.synthetic.plain.motion import TargetMotion
from trackmark.datasets.synthetic.plain.truth import target_truth
from trackmark.datasets.synthetic.render import sprite
from trackmark.datasets.synthetic.render.camera import Camera
from trackmark.datasets.synthetic.render.sprite import Sprite
from trackmark.datasets.synthetic.scene import Scene, Truth

MOST_INSTANTS = 32


def scene(knobs: TargetKnobs) -> "TargetScene":
    """Renderer and truth; nothing is painted yet."""
    return TargetScene(knobs)


class TargetScene(Scene):
    """A target, what is around it and what passes over it."""

    def __init__(self, knobs: TargetKnobs) -> None:
        self.knobs = knobs
        self.motion = TargetMotion(knobs)
        self.length, self.size = knobs.length, (knobs.width, knobs.height)

    def truth(self) -> Truth:
        """See `Scene.truth`."""
        return target_truth(self.motion)

    def render(self, frame: int) -> Image:
        """See `Scene.render`."""
        knobs, motion = self.knobs, self.motion
        side = len(self._ground) - knobs.height - 1
        x, y = (np.round(motion.window(frame) * 64).astype(np.int64) % (side * 64)).tolist()
        canvas: Image = sprite.window(self._ground, x, y, knobs.height, knobs.width)
        for thing, path in zip(self._distractors, motion.distractors, strict=True):
            self._place(canvas, thing, path.at(self._instants(frame, knobs.speed)), 1.0)
        scale = float(motion.scale(frame))
        self._place(canvas, self._target, motion.centre(self._target_instants(frame)), scale)
        if motion.board_width > 0:
            self._place(canvas, self._board, self._board_centres(frame), 1.0)
        across = (np.arange(knobs.width) + 0.5) / knobs.width * 2 - 1
        sun = motion.light(frame, across)
        return self._camera.exposed(canvas, knobs.scene, frame, sun)

    def mask(self, frame: int) -> Mask:
        """See `Scene.mask`."""
        motion = self.motion
        canvas = np.zeros((self.knobs.height, self.knobs.width, 3), np.uint8)
        scale = float(motion.scale(frame)) / self._target.oversize
        self._target_silhouette.draw(canvas, motion.centre(frame)[None], scale)
        if motion.board_width > 0:
            place = np.array([[float(motion.board(frame)), self.knobs.height / 2]])
            self._board_silhouette.draw(canvas, place, 1.0)
        return np.asarray(canvas[:, :, 0] >= 128)

    def _place(
        self, canvas: Image, thing: Thing, centres: NDArray[np.float64], scale: float
    ) -> None:
        """Draw a thing and, first, its shadow."""
        drop = self.motion.half_size[1] * np.array([0.16, 0.24]) * scale
        thing.shadow.draw(canvas, centres + drop, scale / thing.oversize)
        thing.sprite.draw(canvas, centres, scale / thing.oversize)

    def _instants(self, frame: int, travelled: float) -> NDArray[np.float64]:
        """Instants of the exposure [frames], a power of two of them, a pixel's way apart."""
        way = max(1.0, travelled * self.knobs.blur)
        count = min(MOST_INSTANTS, 1 << int(np.ceil(way) - 1).bit_length())
        return frame + self.knobs.blur * ((np.arange(count) + 0.5) / count - 0.5)

    def _target_instants(self, frame: int) -> NDArray[np.float64]:
        way = np.abs(np.diff(self.motion.centre(np.array([frame - 0.5, frame + 0.5])), axis=0))
        return self._instants(frame, float(way.max()))

    def _board_centres(self, frame: int) -> NDArray[np.float64]:
        way = abs(float(np.diff(self.motion.board(np.array([frame, frame + 1])))[0]))
        middles = self.motion.board(self._instants(frame, way))
        return np.stack([middles, np.full(len(middles), self.knobs.height / 2)], axis=1)

    @cached_property
    def _ground(self) -> NDArray[np.uint8]:
        return appearance.ground(self.motion)

    @cached_property
    def _target(self) -> Thing:
        return appearance.target(self.motion)

    @cached_property
    def _target_silhouette(self) -> Sprite:
        return self._target.sprite.silhouette(255)

    @cached_property
    def _distractors(self) -> list[Thing]:
        return appearance.distractors(self.motion)

    @cached_property
    def _board(self) -> Thing:
        return appearance.board(self.motion)

    @cached_property
    def _board_silhouette(self) -> Sprite:
        return self._board.sprite.silhouette(0)

    @cached_property
    def _camera(self) -> Camera:
        return Camera(self.size, self.knobs.noise, fall=(0.1, 0.14))
