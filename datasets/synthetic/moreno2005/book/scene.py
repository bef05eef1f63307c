"""`moreno2005/book`: a book bends before desk and shelf, while the light turns yellow.

The paper says: the non-rigid boundary of a bending book; the light changes smoothly from natural
to yellow; the movement of the book brings self-shadowing about. All the rest is ours: what book,
that a hand holds it, where the light comes from, how the book bends, the room.
"""

from functools import lru_cache

import cv2
import numpy as np

from datasets.interface import Image, Mask
from datasets.synthetic.moreno2005.book.plan import FRAMES, SIZE
from datasets.synthetic.moreno2005.book.setting import Setting
from datasets.synthetic.moreno2005.knobs import BookKnobs
from datasets.synthetic.render.camera import Camera, developed
from datasets.synthetic.render.lamp import light_left
from datasets.synthetic.render.triangles import lay
from datasets.synthetic.scene import Scene, Truth

__all__ = ["BookScene", "scene"]

# Part of the front in its own shadow from which on a frame counts as `self-shadow`.
CONSIDERABLE = 0.25
BEHIND = 70.0  # how far behind the book its shadow falls [pixels]
SOFTNESS, DARKNESS = 9.0, 0.7  # of the shadow: see `light_left`
CAMERA = Camera(SIZE, noise=2.0, fall=(0.05, 0.05))


def scene(knobs: BookKnobs) -> "BookScene":
    """Renderer and truth; nothing is drawn yet."""
    return BookScene(knobs.scene, knobs.illuminant == "changing", knobs.shadow == "self")


class BookScene(Scene):
    """A book that bends in a hand.

    The light turns yellow if it is `changing`; if the book is `shaded`, the light on it depends
    on how it is bent and turned.
    """

    length, size = FRAMES, SIZE

    def __init__(self, seed: int, changing: bool, shaded: bool) -> None:
        self._seed = seed
        self._changing = changing
        self._shaded = shaded
        self.setting = _setting(seed)

    def truth(self) -> Truth:
        """See `Scene.truth`.

        Boxes are those of the whole book, with what the thumb hides. The attribute is
        `self-shadow`: at least a quarter of the front, as far as it faces the camera, gets less
        than half of the lamp's light that it would get if it were flat before the camera.
        """
        boxes, visibility, shadow = self.setting.truth
        considerable = np.logical_and(shadow >= CONSIDERABLE, self._shaded)
        return Truth(boxes, visibility, {"self-shadow": considerable})

    def render(self, frame: int) -> Image:
        """See `Scene.render`."""
        setting = self.setting
        book = setting.seen(frame, self._shaded)
        hand = setting.hand(frame)
        covered = np.maximum(hand[..., 3], book.coverage(SIZE))
        shift = -BEHIND * setting.lamp[:2] / setting.lamp[2]
        left = light_left(covered, shift, SOFTNESS, DARKNESS)
        picture = np.asarray(cv2.multiply(setting.room, left), np.float32)
        lay(picture[book.window], book.sheet)
        lay(picture, hand)
        picture *= setting.illuminants[frame if self._changing else 0].astype(np.float32)
        return CAMERA.exposed(developed(picture), self._seed, frame)

    def mask(self, frame: int) -> Mask:
        """See `Scene.mask`."""
        book = self.setting.seen(frame, shaded=False).coverage(SIZE)
        return np.asarray(book * (1 - self.setting.hand(frame)[..., 3]) >= 0.5)


@lru_cache(maxsize=4)
def _setting(seed: int) -> Setting:
    return Setting(seed)
