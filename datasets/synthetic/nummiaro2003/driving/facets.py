"""Solids of plane facets and the pictures on them: faces, and the tuples of arrays for kernels."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MOST = 8
"""Corners of a facet."""


class Facets(NamedTuple):
    """Facets of a solid, from front to back wherever one can hide another."""

    # (n, MOST, 3), in the solid's own frame: right, up, ahead [metres]
    corners: NDArray[np.float64]
    counts: NDArray[np.int64]  # (n,), corners that count
    normals: NDArray[np.float64]  # (n, 3), of length 1, outwards
    kinds: NDArray[np.int64]  # (n,), number of the picture
    # (n, 2, 4), column and row in the picture, each as three factors of the place and a constant
    places: NDArray[np.float64]
    soft: NDArray[np.bool_]  # (n,), a shadow, as dark as its picture's blue says; takes no samples


class Pictures(NamedTuple):
    """Periodic pictures at falling resolutions, one after the other."""

    pixels: NDArray[np.uint32]  # (k,), red, green and blue in bytes, blue the lowest
    # (pictures, levels), where in `pixels` each begins; -1 beyond the coarsest
    starts: NDArray[np.int64]
    sizes: NDArray[np.int64]  # (pictures, 2), width and height of the finest as powers of two


class Lens(NamedTuple):
    """Focal length and optical centre in the window that is painted [pixels]."""

    focal: float
    column: float
    row: float


class Pose(NamedTuple):
    """Where a solid is for the camera, and its light."""

    turn: NDArray[np.float64]  # (3, 3), from the solid's frame to the camera's: right, down, ahead
    place: NDArray[np.float64]  # (3,), of the solid's origin in the camera's frame [metres]
    gains: NDArray[np.int64]  # (n,), light on each facet, times 256
    # (2, 4), column and row in the picture of stains, each as three factors of the place in the
    # camera's frame and a constant
    shading: NDArray[np.float64]


def packed(images: Sequence[NDArray[np.float64]]) -> Pictures:
    """Pictures, BGR in [0, 255], at all resolutions; their sides are powers of two."""
    depth = 1 + max(min(image.shape[:2]).bit_length() - 1 for image in images)
    pixels: list[NDArray[np.uint32]] = []
    starts = np.full((len(images), depth), -1)
    sizes = np.array([[side.bit_length() - 1 for side in im.shape[1::-1]] for im in images])
    place = 0
    for number, finest in enumerate(images):
        image = np.clip(finest, 0, 255)
        for level in range(1 + int(sizes[number].min())):
            starts[number, level] = place
            blue, green, red = np.moveaxis(np.floor(image + 0.5).astype(np.uint32), 2, 0)
            pixels.append((blue | green << 8 | red << 16).ravel())
            place += len(pixels[-1])
            if level < sizes[number].min():
                half = image[0::2] + image[1::2]
                image = (half[:, 0::2] + half[:, 1::2]) / 4
    return Pictures(np.concatenate(pixels), starts.astype(np.int64), sizes.astype(np.int64))


def blank(count: int = 1, level: float = 128.0) -> Pictures:
    """Pictures of one grey pixel each."""
    return packed([np.full((1, 1, 3), level)] * count)


@dataclass(frozen=True)
class Face:
    """A plane polygon."""

    corners: Array  # (n, 3), in order around it, at most MOST [metres]
    outwards: Array  # (3,), some direction that it faces
    kind: int  # number of the picture on it
    soft: bool = False  # whether it is a shadow


@dataclass(frozen=True)
class Ring:
    """Outline of a solid at a height: a rectangle with its corners cut off."""

    height: float  # [metres]
    # ahead, behind: where it ends along the solid's axis [metres]
    ahead: float
    behind: float
    half_width: float  # [metres]

    def corners(self, cut: tuple[float, float]) -> Array:
        """Eight corners from the front's left end on; `cut` is across and along [metres]."""
        wide, narrow = self.half_width, self.half_width - cut[0]
        ahead, behind = self.ahead - cut[1], self.behind + cut[1]
        outline = [(-narrow, self.ahead), (narrow, self.ahead), (wide, ahead), (wide, behind),
                   (narrow, self.behind), (-narrow, self.behind), (-wide, behind),
                   (-wide, ahead)]  # fmt: skip
        return np.array([[x, self.height, z] for x, z in outline])


def between(
    lower: Ring, upper: Ring, kinds: tuple[int, int, int], cut: tuple[float, float] = (0.0, 0.0)
) -> Iterator[Face]:
    """Faces around a solid between two outlines.

    `kinds` are the pictures on the front with its corners, on the rear with its corners and on the
    sides; `cut` is as in `Ring.corners`, the same at both, so that every face is plane.
    """
    below, above = lower.corners(cut), upper.corners(cut)
    front, rear, side = kinds
    for k, kind in enumerate((front, front, side, rear, rear, rear, side, front)):
        after = (k + 1) % 8
        corners = np.array([below[k], below[after], above[after], above[k]])
        if cut == (0.0, 0.0) and k % 2:
            continue
        middle = (below[k] + below[after]) / 2
        away = [middle[0], 0.0, middle[2] - (lower.ahead + lower.behind) / 2]
        yield Face(corners, np.array(away), kind)


def flat(
    height: float, x: tuple[float, float], z: tuple[float, float], kind: int, soft: bool = False
) -> Face:
    """Level rectangle that is seen from above."""
    outline = [(x[0], z[0]), (x[1], z[0]), (x[1], z[1]), (x[0], z[1])]
    corners = np.array([[a, height, b] for a, b in outline])
    return Face(corners, np.array([0.0, 1.0, 0.0]), kind, soft)


def upright(corners: Sequence[tuple[float, float]], z: float, ahead: bool, kind: int) -> Face:
    """Polygon of corners (x, y) that stands across the axis at `z`, and faces along it."""
    places = np.array([[x, y, z] for x, y in corners])
    return Face(places, np.array([0.0, 0.0, 1.0 if ahead else -1.0]), kind)


def assembled(faces: Sequence[Face], projections: Array) -> Facets:
    """Facets of faces that are listed from front to back.

    `projections`, shape (pictures, 2, 4), are column and row in every picture, as in
    `Facets.places`.
    """
    corners = np.zeros((len(faces), MOST, 3))
    normals = np.empty((len(faces), 3))
    for k, face in enumerate(faces):
        corners[k, : len(face.corners)] = face.corners
        # The diagonals span the plane even where two corners are one.
        first, second = face.corners[2] - face.corners[0], face.corners[-1] - face.corners[1]
        normal = np.cross(first, second)
        normal /= np.sqrt((normal * normal).sum())
        normals[k] = normal if (normal * face.outwards).sum() > 0 else -normal
    kinds = np.array([face.kind for face in faces])
    return Facets(
        corners,
        np.array([len(face.corners) for face in faces]),
        normals,
        kinds,
        np.ascontiguousarray(projections[kinds]),
        np.array([face.soft for face in faces]),
    )
