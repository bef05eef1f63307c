"""A clothed person, drawn in any gait phase, heading and size."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from datasets.synthetic.multipart.bands import AROUND, cover_part, paint_part
from datasets.synthetic.multipart.body import PARTS, place_parts
from datasets.synthetic.multipart.look import Look, wrapped
from datasets.synthetic.render.sprite import Sprite, superellipse

__all__ = ["Pose", "Walker"]

_SHADOW = 64  # half width of the contact shadow's sprite [pixels]


@dataclass(frozen=True)
class Pose:
    """How a body stands or walks.

    Attributes
    ----------
    phase : float
        Gait cycles; one cycle is two steps.
    stride : float
        In [0, 1]; 0 stands.
    heading : float
        0 is to the right, π/2 towards the camera, -π/2 away from it [radians].
    """

    phase: float
    stride: float
    heading: float


class Walker:
    """A clothed person.

    Parameters
    ----------
    look : Look
        Clothes and build.
    seed : int
        Of folds, strands of hair and weave.
    """

    def __init__(self, look: Look, seed: int) -> None:
        self.look = look
        self._seed = seed
        sleeves = 1.0 if look.jacket is None else 1.12
        self._build = np.array([look.bulk, sleeves, look.hem, look.loose])
        coverage = superellipse(2 * _SHADOW // 3, 2 * _SHADOW, _SHADOW / 4, _SHADOW * 0.85, 2)[2]
        shade = Sprite(np.zeros((*coverage.shape, 3)), coverage)
        self._shadow = shade.shadow(0.42, _SHADOW // 8)

    def draw(
        self,
        canvas: NDArray[np.uint8],
        x: float,
        y: float,
        height: float,
        pose: Pose,
        gains: ArrayLike,
        motion: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        """Draw the person with the soft shadow where he stands.

        Parameters
        ----------
        canvas : ndarray of uint8, shape (h, w, 3)
            Changed in place.
        x, y : float
            Ground below the body's axis [pixels].
        height : float
            Of the standing person [pixels].
        pose : Pose
            At mid-exposure; the limbs' own motion blurs them.
        gains : array of float64, shape (k,)
            Light from the head's top down to the ground, evenly spaced.
        motion : tuple of float
            Of the whole person during the exposure, right and down [pixels]. The part
            downwards is too small in a walk to be seen, and is not drawn.
        """
        light = np.asarray(gains, np.float64)
        self._draw_shadow(canvas, x, y, height)
        rows = np.arange(len(canvas)) + 0.5
        place = np.clip((rows - (y - height)) / height, 0, 1) * (len(light) - 1)
        row_gains = np.round(np.interp(place, np.arange(len(light)), light) * 256)
        front = round((pose.heading - np.pi / 2) / (2 * np.pi) * AROUND)
        nodes = self._nodes(x, y, height, pose, motion[0])
        for part in self._order(pose):
            paint_part(canvas, nodes[part], self._textures[part], front, row_gains.astype(np.int64))

    def coverage(
        self, x: float, y: float, height: float, pose: Pose
    ) -> tuple[int, int, NDArray[np.uint8]]:
        """Silhouette at mid-exposure.

        Returns
        -------
        left, top : int
            Corner of the window that holds it [pixels]; it may lie outside the picture.
        coverage : ndarray of uint8, shape (rows, columns)
            Covered part of each pixel, in [0, 255].
        """
        order = self._order(pose)
        nodes = self._nodes(x, y, height, pose, 0.0)
        chosen = nodes[order]
        left = int((chosen[..., 1] - chosen[..., 2]).min() >> 6) - 1
        right = int((chosen[..., 1] + chosen[..., 2]).max() >> 6) + 2
        top, bottom = int(chosen[..., 0].min() >> 6), int(chosen[..., 0].max() >> 6) + 1
        silhouette = np.zeros((bottom - top, right - left), np.uint8)
        for part in order:
            cover_part(silhouette, nodes[part], left, top)
        return left, top, silhouette

    def _draw_shadow(self, canvas: NDArray[np.uint8], x: float, y: float, height: float) -> None:
        middle = np.array([[x, y - 0.012 * height]])
        self._shadow.draw(canvas, middle, 0.19 * height / _SHADOW)

    @cached_property
    def _textures(self) -> NDArray[np.uint8]:
        return wrapped(self.look, self._seed)  # a silhouette needs none

    def _nodes(
        self, x: float, y: float, height: float, pose: Pose, motion: float
    ) -> NDArray[np.int64]:
        placed: NDArray[np.int64] = place_parts(
            float(x),
            float(y),
            float(height),
            float(pose.phase),
            float(pose.stride),
            float(pose.heading),
            self._build,
            float(motion),
        )
        return placed

    def _order(self, pose: Pose) -> list[int]:
        """Parts from the farthest to the nearest."""
        near, far = ("right", "left") if np.cos(pose.heading) > 0 else ("left", "right")
        pack = [] if self.look.bag is None else ["pack"]
        on_his_back = ["torso", "head", *pack]
        trunk = on_his_back if np.sin(pose.heading) < -0.2 else [*pack, "torso", "head"]
        order = [f"{far} arm", f"{far} shoe", f"{far} leg", f"{near} shoe", f"{near} leg"]
        return [PARTS.index(name) for name in [*order, *trunk, f"{near} arm"]]
