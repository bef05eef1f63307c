"""Worker: bones in all frames, a textured mesh on the bones, and the visible part of the head.

World coordinates are x to the right, y up and z away from the camera [metres]. The axes of a bone
point to its left, up and forward.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.interface import Array
from trackmark.datasets.synthetic.render.figure import mesh
from trackmark.datasets.synthetic.render.figure.body import (
    FOREARM,
    NECK,
    SHOULDER,
    TRUNK,
    UPPER_ARM,
    body,
    head,
)
from trackmark.datasets.synthetic.render.figure.look import FigureLook
from trackmark.datasets.synthetic.render.figure.routine import Routine
from trackmark.datasets.synthetic.render.sprite import blend_sprite, instants
from trackmark.datasets.synthetic.scene import part_generator

Integers = NDArray[np.int64]
Picture = NDArray[np.uint8]

HEAD = 0  # index of the head's bone
CROWN = 0.252  # height of the crown above the base of the neck [metres]


class Bones(NamedTuple):
    """Axes and origins of head, neck, collar, trunk, upper arms, forearms, hands and legs."""

    axes: Array  # (n, 12, 3, 3), columns are left, up and forward
    origins: Array  # (n, 12, 3), [metres]


def place_bones(routine: Routine, look: FigureLook) -> Bones:
    """Return axes and origins of all bones in every frame of a routine."""
    nothing = np.zeros_like(routine.x)
    trunk = _rotate_axes(routine.heading, routine.lean, nothing)
    height = look.stature - CROWN - TRUNK - routine.crouch
    hips = np.stack([nothing, height, nothing], axis=1)
    root = hips + _offset(trunk, 0, TRUNK, 0)
    head = _rotate_axes(routine.turn, routine.nod, routine.tilt)
    middle = (routine.heading + routine.turn) / 2
    neck = _rotate_axes(middle, 0.5 * (routine.lean + routine.nod) + 0.2, routine.tilt / 2)
    atlas = root + _offset(neck, 0, NECK, 0)
    skull = atlas + _offset(head, 0, 0.045, 0.018)
    axes, origins = [head, neck, trunk, trunk], [skull, root, root, hips]
    upright = _rotate_axes(routine.heading, nothing, nothing)
    uppers, lowers, hands = [], [], []
    for hand, side in enumerate((1, -1)):
        joint = root + _offset(trunk, side * SHOULDER[0] * look.bulk, -SHOULDER[1], 0)
        working = root + _dot(upright, routine.hands[:, hand])
        at_face = skull + _offset(head, side * 0.09, -0.015, 0.155)
        share = routine.to_face[:, hand, None]
        wrist = working + (at_face - working) * share
        aside = _offset(trunk, side * 0.6, -1, -0.35)
        elbow, wrist = _bend_arm(joint, wrist, aside)
        forward = trunk[:, :, 2]
        uppers.append((_align_axes(joint - elbow, forward), joint))
        lowers.append((_align_axes(elbow - wrist, forward), elbow))
        # A hand at the face covers the brow.
        across = _align_axes(
            _unit(elbow - wrist) * (1 - 0.8 * share) + _offset(head, side * 0.8, -0.35, 0) * share,
            forward,
        )
        hands.append((across, wrist))
    for frame, origin in [*uppers, *lowers, *hands]:
        axes.append(frame)
        origins.append(origin)
    for side in (1, -1):
        axes.append(upright)
        origins.append(hips + _offset(upright, side * 0.085 * look.bulk, 0, 0))
    # The routine defines the position of the head; the body is moved to fit the head.
    places = np.stack(origins, axis=1)
    to_head = np.stack([routine.x - skull[:, 0], nothing, routine.z - skull[:, 2]], axis=1)
    return Bones(np.stack(axes, axis=1), places + to_head[:, None])


def _rotate_axes(heading: Array, pitch: Array, roll: Array) -> Array:
    """Return axes with a heading that are pitched down and rolled to the left, shape (n, 3, 3)."""
    nothing = np.zeros_like(heading)
    ahead = np.stack([np.cos(heading), nothing, -np.sin(heading)], axis=1)
    left = np.stack([np.sin(heading), nothing, np.cos(heading)], axis=1)
    up = np.array([0.0, 1.0, 0.0])
    cos, sin = np.cos(pitch)[:, None], np.sin(pitch)[:, None]
    ahead, up = cos * ahead - sin * up, sin * ahead + cos * up
    cos, sin = np.cos(roll)[:, None], np.sin(roll)[:, None]
    left, up = cos * left - sin * up, sin * left + cos * up
    return np.stack([left, up, ahead], axis=2)


def _dot(axes: Array, places: Array) -> Array:
    return np.asarray((axes * places[:, None, :]).sum(axis=2))


def _offset(axes: Array, left: float, up: float, forward: float) -> Array:
    return left * axes[:, :, 0] + up * axes[:, :, 1] + forward * axes[:, :, 2]


def _unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.sqrt((vectors * vectors).sum(axis=1, keepdims=True)))


def _align_axes(up: Array, forward: Array) -> Array:
    """Return axes with y along `up`, and z as close to `forward` as possible."""
    up = _unit(up)
    left = _unit(np.cross(forward, up))
    return np.stack([left, up, np.cross(up, left)], axis=2)


def _bend_arm(joint: Array, wrist: Array, aside: Array) -> tuple[Array, Array]:
    """Return elbow and wrist of an arm whose wrist is as close to a point as possible."""
    reach = wrist - joint
    length = np.sqrt((reach * reach).sum(axis=1, keepdims=True))
    towards = reach / length
    length = np.clip(length, 0.12, 0.985 * (UPPER_ARM + FOREARM))
    along = (length * length + UPPER_ARM**2 - FOREARM**2) / (2 * length)
    off = np.sqrt(np.maximum(UPPER_ARM**2 - along * along, 0.0))
    aside = _unit(aside - (aside * towards).sum(axis=1, keepdims=True) * towards)
    return joint + along * towards + off * aside, joint + length * towards


FULL = 255  # coverage of a fully covered pixel


class Worker:
    """Person who performs a routine in front of a camera.

    `camera` is focal length, column and row of the optical axis [pixels], and height [metres].
    `lamp` is the direction to the light and the ambient light. `seed` determines hair and folds.
    """

    def __init__(
        self, look: FigureLook, routine: Routine, camera: Array, lamp: Array, seed: int
    ) -> None:
        random = part_generator(seed, "factory worker")
        solids = [head(look, random), *body(look, random)]
        self._bones: Bones = place_bones(routine, look)
        self._camera, self._lamp = camera, lamp
        self._positions = np.concatenate([solid.vertices.reshape(-1, 3) for solid in solids])
        self._normals = np.concatenate([solid.normals.reshape(-1, 3) for solid in solids])
        self._vertex_parts = np.repeat(np.arange(len(solids)), [_count(solid) for solid in solids])
        self._triangles, self._places = _join_solids(solids)
        atlas = np.concatenate([solid.texture for solid in solids])
        self._atlas = np.clip(np.round(atlas), 0, 255).astype(np.uint8)
        self._parts = self._vertex_parts[self._triangles[:, 0]]

    def draw(self, canvas: Picture, frame: int, gain: float, shutter: float) -> None:
        """Draw the worker over a canvas, blurred by the motion of the head.

        `gain` is the light on the worker. `shutter` is the fraction of the frame time for which the
        shutter is open.
        """
        placed = self._placed(frame)
        left, top, width, height = _window(placed, canvas.shape)
        owners = mesh.visible_triangles(placed, self._triangles, left, top, height, width)
        picture = mesh.paint_owners(
            owners, placed, self._triangles, self._parts, self._places, self._atlas,
            left, top, round(256 * gain),
        )  # fmt: skip
        motion = self.motion(frame) * shutter
        moments = instants(float(np.abs(motion).max()))
        corners = np.round((np.array([left, top]) + moments[:, None] * motion) * 64)
        places = np.ascontiguousarray(corners.T.astype(np.int64))
        blend_sprite(canvas, picture, places[0], places[1], 1 << 16)

    @property
    def directions(self) -> Array:
        """Unit vectors in the direction of the face, shape (n, 3)."""
        return self._bones.axes[:, HEAD, :, 2]

    @property
    def facing(self) -> Array:
        """Cosine between the head's direction and the direction to the camera, shape (n,)."""
        forward = self.directions
        to_camera = np.array([0.0, self._camera[3], 0.0]) - self._bones.origins[:, HEAD]
        return np.asarray(
            (forward * to_camera).sum(axis=1) / np.sqrt((to_camera * to_camera).sum(axis=1))
        )

    def motion(self, frame: int) -> Array:
        """Return the motion of the head around a frame, right and down [pixels/frame]."""
        around = max(frame - 1, 0), min(frame + 1, len(self._bones.origins) - 1)
        first, last = (self.head_place(k) for k in around)
        return np.asarray((last - first) / (around[1] - around[0]))

    def head_place(self, frame: int) -> Array:
        """Return the image position of the head's centre [pixels], shape (2,)."""
        focal, column, row, eye = self._camera
        x, y, z = self._bones.origins[frame, HEAD]
        return np.array([column + x * focal / z, row + (eye - y) * focal / z])

    def head_box(self, frame: int) -> Array:
        """Return the box of the head from chin to crown, with hair and ears [pixels]."""
        placed = self._placed(frame)[self._vertex_parts == HEAD, :2] / (mesh.UNIT * mesh.FINE)
        low, high = placed.min(axis=0), placed.max(axis=0)
        return np.concatenate([low, high - low])

    def head_seen(self, frame: int) -> tuple[int, int, Picture, Picture]:
        """Return left and top of a window [pixels], coverage by the head, and its visible part.

        The window may lie outside the image; both coverages are in [0, 255].
        """
        placed = self._placed(frame)
        left, top, width, height = _window(placed[self._vertex_parts == HEAD], None)
        of_head = self._triangles[self._parts == HEAD]
        whole, all_parts = (
            mesh.visible_triangles(placed, triangles, left, top, height, width)
            for triangles in (of_head, self._triangles)
        )
        visible_head = (all_parts != mesh.NO_TRIANGLE) & (self._parts[all_parts] == HEAD)
        return left, top, _coverage(whole != mesh.NO_TRIANGLE), _coverage(visible_head)

    def _placed(self, frame: int) -> Integers:
        placed: Integers = mesh.place_vertices(
            self._positions,
            self._normals,
            self._vertex_parts,
            self._bones.axes[frame],
            self._bones.origins[frame],
            self._lamp,
            self._camera,
        )
        return placed


def _count(solid: mesh.Solid) -> int:
    rows, columns, _ = solid.vertices.shape
    return int(rows * columns)


def _join_solids(solids: list[mesh.Solid]) -> tuple[Integers, Integers]:
    """Return the triangles of all solids, and the atlas positions of their vertices."""
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
        places.append(place.reshape(-1, 2) * mesh.UNIT)
        vertices += rows * columns
        texels += len(solid.texture)
    return np.concatenate(triangles), np.concatenate(places)


def _window(placed: Integers, within: tuple[int, ...] | None) -> tuple[int, int, int, int]:
    """Return left, top, width and height of a window around vertices within an image [pixels]."""
    step = mesh.UNIT * mesh.FINE
    left, top = (int(v) for v in placed[:, :2].min(axis=0) // step)
    right, bottom = (int(v) for v in placed[:, :2].max(axis=0) // step + 1)
    if within is not None:
        reach = 16  # width of the blur [pixels]
        left, top = max(left, -reach), max(top, -reach)
        right, bottom = min(right, within[1] + reach), min(bottom, within[0] + reach)
    return left, top, max(right - left, 1), max(bottom - top, 1)


def _coverage(samples: NDArray[np.bool_]) -> Picture:
    rows, columns = samples.shape
    blocks = samples.reshape(rows // mesh.FINE, mesh.FINE, columns // mesh.FINE, mesh.FINE).sum(
        axis=(1, 3)
    )
    return np.asarray(blocks * FULL // (mesh.FINE * mesh.FINE), np.uint8)
