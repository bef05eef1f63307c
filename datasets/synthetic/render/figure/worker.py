"""The worker: one mesh on bones, painted, and what is seen of his head."""

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.render.figure.clothes import body
from datasets.synthetic.render.figure.head import head
from datasets.synthetic.render.figure.look import Look
from datasets.synthetic.render.figure.mesh import (
    FINE,
    NOBODY,
    UNIT,
    Solid,
    paint_owners,
    place_vertices,
    which_is_seen,
)
from datasets.synthetic.render.figure.routine import Routine
from datasets.synthetic.render.figure.skeleton import HEAD, Bones, place_bones
from datasets.synthetic.render.layers import instants
from datasets.synthetic.render.sprite import blend_sprite
from datasets.synthetic.scene import part_generator

__all__ = ["Worker"]

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Picture = NDArray[np.uint8]

FULL = 255
"""Coverage of a pixel that is covered wholly."""


class Worker:
    """Somebody who goes through a routine before a camera.

    Parameters
    ----------
    look : Look
        Head and clothes.
    routine : Routine
        Pose in every frame.
    camera : ndarray of float64, shape (4,)
        Focal length, column and row of the optical axis [pixels], height [metres].
    lamp : ndarray of float64, shape (4,)
        Direction to the light, and the light where none of it falls.
    seed : int
        Of hair and folds.
    """

    def __init__(self, look: Look, routine: Routine, camera: Array, lamp: Array, seed: int) -> None:
        random = part_generator(seed, "factory worker")
        solids = [head(look, random), *body(look, random)]
        self._bones: Bones = place_bones(routine, look)
        self._camera, self._lamp = camera, lamp
        self._positions = np.concatenate([solid.vertices.reshape(-1, 3) for solid in solids])
        self._normals = np.concatenate([solid.normals.reshape(-1, 3) for solid in solids])
        self._of = np.repeat(np.arange(len(solids)), [_count(solid) for solid in solids])
        self._triangles, self._places = _joined(solids)
        atlas = np.concatenate([solid.texture for solid in solids])
        self._atlas = np.clip(np.round(atlas), 0, 255).astype(np.uint8)
        self._parts = self._of[self._triangles[:, 0]]

    def draw(self, canvas: Picture, frame: int, gain: float, shutter: float) -> None:
        """Draw him as he is seen in a frame, blurred by the motion of his head.

        Parameters
        ----------
        canvas : ndarray of uint8, shape (height, width, 3)
            Changed in place.
        frame : int
        gain : float
            Light on him.
        shutter : float
            Part of the time between two frames for which the shutter is open.
        """
        placed = self._placed(frame)
        left, top, width, height = _window(placed, canvas.shape)
        owners = which_is_seen(placed, self._triangles, left, top, height, width)
        picture = paint_owners(
            owners, placed, self._triangles, self._parts, self._places, self._atlas,
            left, top, round(256 * gain),
        )  # fmt: skip
        motion = self.motion(frame) * shutter
        moments = instants(float(np.abs(motion).max()))
        corners = np.round((np.array([left, top]) + moments[:, None] * motion) * 64)
        places = np.ascontiguousarray(corners.T.astype(np.int64))
        blend_sprite(canvas, picture, places[0], places[1], 1 << 16)

    @property
    def facing(self) -> Array:
        """Cosine between where the head faces and the way to the camera, shape (n,)."""
        forward = self._bones.axes[:, HEAD, :, 2]
        way = np.array([0.0, self._camera[3], 0.0]) - self._bones.origins[:, HEAD]
        return np.asarray((forward * way).sum(axis=1) / np.sqrt((way * way).sum(axis=1)))

    def motion(self, frame: int) -> Array:
        """Of the head around a frame, right and down [pixels/frame], shape (2,)."""
        around = max(frame - 1, 0), min(frame + 1, len(self._bones.origins) - 1)
        first, last = (self.head_place(k) for k in around)
        return np.asarray((last - first) / (around[1] - around[0]))

    def head_place(self, frame: int) -> Array:
        """Where the middle of the head is seen [pixels], shape (2,)."""
        focal, column, row, eye = self._camera
        x, y, z = self._bones.origins[frame, HEAD]
        return np.array([column + x * focal / z, row + (eye - y) * focal / z])

    def head_box(self, frame: int) -> Array:
        """Box around the head, chin to crown, hair and ears included [pixels], shape (4,)."""
        placed = self._placed(frame)[self._of == HEAD, :2] / (UNIT * FINE)
        low, high = placed.min(axis=0), placed.max(axis=0)
        return np.concatenate([low, high - low])

    def head_seen(self, frame: int) -> tuple[int, int, Picture, Picture]:
        """Silhouette of the head, and what of it nothing else hides.

        Returns
        -------
        left, top : int
            Corner of their window [pixels]; it may lie outside the picture.
        whole, seen : ndarray of uint8, shape (height, width)
            Covered part of each pixel, in [0, 255].
        """
        placed = self._placed(frame)
        left, top, width, height = _window(placed[self._of == HEAD], None)
        of_head = self._triangles[self._parts == HEAD]
        whole, all_parts = (
            which_is_seen(placed, triangles, left, top, height, width)
            for triangles in (of_head, self._triangles)
        )
        own = (all_parts != NOBODY) & (self._parts[all_parts] == HEAD)
        return left, top, _coverage(whole != NOBODY), _coverage(own)

    def _placed(self, frame: int) -> Integers:
        placed: Integers = place_vertices(
            self._positions,
            self._normals,
            self._of,
            self._bones.axes[frame],
            self._bones.origins[frame],
            self._lamp,
            self._camera,
        )
        return placed


def _count(solid: Solid) -> int:
    rows, columns, _ = solid.vertices.shape
    return int(rows * columns)


def _joined(solids: list[Solid]) -> tuple[Integers, Integers]:
    """Triangles of all solids, and where their vertices lie in the atlas."""
    triangles, places = [], []
    vertices, texels = 0, 0
    for solid in solids:
        rows, columns = solid.vertices.shape[:2]
        index = vertices + np.arange(rows * columns).reshape(rows, columns)
        a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
        triangles += [
            np.stack(corners, axis=2).reshape(-1, 3) for corners in ((a, b, c), (a, c, d))
        ]
        down, around = solid.spacing
        row, column = np.indices((rows, columns))
        place = np.stack([column * around, texels + row * down], axis=2)
        places.append(place.reshape(-1, 2) * UNIT)
        vertices += rows * columns
        texels += len(solid.texture)
    return np.concatenate(triangles), np.concatenate(places)


def _window(placed: Integers, within: tuple[int, ...] | None) -> tuple[int, int, int, int]:
    """Left, top, width and height of what holds the vertices, cut to a picture [pixels]."""
    step = UNIT * FINE
    left, top = (int(v) for v in placed[:, :2].min(axis=0) // step)
    right, bottom = (int(v) for v in placed[:, :2].max(axis=0) // step + 1)
    if within is not None:
        reach = 16  # of the blur
        left, top = max(left, -reach), max(top, -reach)
        right, bottom = min(right, within[1] + reach), min(bottom, within[0] + reach)
    return left, top, max(right - left, 1), max(bottom - top, 1)


def _coverage(samples: NDArray[np.bool_]) -> Picture:
    rows, columns = samples.shape
    blocks = samples.reshape(rows // FINE, FINE, columns // FINE, FINE).sum(axis=(1, 3))
    return np.asarray(blocks * FULL // (FINE * FINE), np.uint8)
