"""`moreno2005/book`: a book bends in front of desk and shelf while the light turns yellow.

The paper: the non-rigid boundary of a bending book; the light changes smoothly from natural to
yellow; the smooth model fails by "the effect of self-shadowing produced during the movement of
the book". All other properties are our choice: the hand, the room, the lamp that lights the book
from the side, bends that put most of the cover into its own shadow within a frame, and a cloth that
looks like the wall when it is in the shadow.
"""

from functools import lru_cache

import cv2
import numpy as np

from trackmark.datasets.interface import Image, Mask
from trackmark.datasets.synthetic.moreno2005.book.plan import FRAMES, SIZE
from trackmark.datasets.synthetic.moreno2005.book.setting import Setting
from trackmark.datasets.synthetic.moreno2005.knobs import BookKnobs
from trackmark.datasets.synthetic.render.camera import Camera, developed
from trackmark.datasets.synthetic.render.lamp import light_left
from trackmark.datasets.synthetic.render.triangles import lay
from trackmark.datasets.synthetic.scene import Scene, Truth

# Part of the front in its own shadow from which on a frame counts as `self-shadow`.
CONSIDERABLE = 0.25
BEHIND = 70.0  # how far behind the book its shadow falls [pixels]
SOFTNESS, DARKNESS = 9.0, 0.7  # of the shadow: see `light_left`
CAMERA = Camera(SIZE, noise=2.0, fall=(0.05, 0.05))


def scene(knobs: BookKnobs) -> "BookScene":
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
        """See `Scene.render`."""
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
        """See `Scene.mask`."""
        book = self.setting.seen(frame).coverage(SIZE)
        return np.asarray(book * (1 - self.setting.hand(frame)[..., 3]) >= 0.5)


@lru_cache(maxsize=4)
def _setting(seed: int) -> Setting:
    return Setting(seed)
