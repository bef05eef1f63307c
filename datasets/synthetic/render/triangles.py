"""Triangles in space, seen by a camera far in front of them.

Points are column and row in the picture and nearness to the camera, all in pixels. Only sums,
products and quotients: the same bytes on every platform.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Floats = NDArray[np.float32]
Indices = NDArray[np.int64]

FINE = 4
"""Samples a pixel, in either direction."""

NOTHING = -1
"""What is seen at a sample that no triangle covers."""


@dataclass(frozen=True)
class Mesh:
    """Triangles with a texture."""

    triangles: Indices  # (t, 3), vertices of each
    # (v, 2), column and row of each vertex in the texture, which ends there; texel i spans [i, i
    # + 1)
    texels: Array
    texture: Floats  # (h, w, 3), part of the light that comes back, BGR
    # whether it is the surface of a solid: then a triangle is seen only where its vertices follow
    # one another clockwise in the picture. Otherwise both of its sides are.
    closed: bool


@dataclass(frozen=True)
class RenderedMesh:
    """What is seen of a mesh, in a window of the picture."""

    window: tuple[slice, slice]  # rows and columns of the picture
    # (h, w, 4), light that comes back, BGR, premultiplied by the last channel, coverage in [0, 1]
    sheet: Floats

    def coverage(self, size: tuple[int, int]) -> Floats:
        """Covered part of each pixel of a picture of a width and height, in [0, 1]."""
        whole = np.zeros(size[::-1], np.float32)
        whole[self.window] = self.sheet[..., 3]
        return whole


def rotation_axes(tilt: float, yaw: float, pitch: float) -> Array:
    """Directions of a thing's axes (columns), turned in the picture, to the right and down.

    Angles are in radians; the axes are to the right, down and towards the camera where all are 0.
    """
    (a, b, c), (d, e, f) = np.cos([tilt, yaw, pitch]), np.sin([tilt, yaw, pitch])
    in_picture = np.array([[a, -d, 0], [d, a, 0], [0, 0, 1]])
    aside = np.array([[b, 0, e], [0, 1, 0], [-e, 0, b]])
    over = np.array([[1, 0, 0], [0, c, -f], [0, f, c]])
    return np.asarray(in_picture @ over @ aside)


def bounding_box(points: Array) -> Array:
    """Extents (x, y, width, height) in the picture of points, columns and rows first [pixels]."""
    low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    return np.concatenate([low, high - low])


def grid_triangles(rows: int, columns: int) -> Indices:
    """Triangles between the vertices of a grid, which count row by row; shape (t, 3).

    Each is clockwise in the picture where rows go down and columns to the right.
    """
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    upper = np.stack([corner, corner + 1, corner + columns], axis=1)
    lower = np.stack([corner + 1, corner + columns + 1, corner + columns], axis=1)
    return np.concatenate([upper, lower])


def render_mesh(mesh: Mesh, points: Array, lights: Array, size: tuple[int, int]) -> RenderedMesh:
    """Look at a mesh whose vertices are at `points` [pixels], in a picture of a size.

    `lights`, shape (v, 3), is the light that falls on each, BGR; the size is width and height
    [pixels].
    """
    low = np.clip(np.floor(points[:, :2].min(axis=0)), 0, size).astype(np.int64)
    high = np.clip(np.ceil(points[:, :2].max(axis=0)), low, size).astype(np.int64)
    (left, top), (right, bottom) = low.tolist(), high.tolist()
    placed = points.copy()
    placed[:, :2] = (placed[:, :2] - low) * FINE - 0.5
    owners = _owners(placed, mesh.triangles, mesh.closed, bottom - top, right - left)
    sheet = _lit(owners, placed, mesh.triangles, mesh.texels, lights, mesh.texture)
    return RenderedMesh((slice(top, bottom), slice(left, right)), sheet)


@njit(cache=True, error_model="numpy")
def composite(picture: Floats, sheet: Floats) -> None:
    """Lay a sheet, see `RenderedMesh`, over a picture or another sheet of its size, in place."""
    for row in range(picture.shape[0]):
        for column in range(picture.shape[1]):
            rest = np.float32(1) - sheet[row, column, 3]
            if rest == np.float32(1):
                continue
            for channel in range(picture.shape[2]):
                below = rest * picture[row, column, channel]
                picture[row, column, channel] = below + sheet[row, column, channel]


@njit(cache=True, error_model="numpy")
def _owners(
    points: Array, triangles: Indices, closed: bool, height: int, width: int
) -> NDArray[np.int32]:
    """Triangle that is nearest at each sample of a window, or `NOTHING`.

    Columns and rows of the points count samples, from the middle of the first.
    """
    owners = np.full((height * FINE, width * FINE), NOTHING, np.int32)
    nearest = np.full(owners.shape, -1e30, np.float32)
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ax, ay, az = points[a, 0], points[a, 1], points[a, 2]
        bx, by, bz = points[b, 0], points[b, 1], points[b, 2]
        cx, cy, cz = points[c, 0], points[c, 1], points[c, 2]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0.0 or (closed and area < 0.0):
            continue
        if area < 0.0:
            bx, by, bz, cx, cy, cz = cx, cy, cz, bx, by, bz
            area = -area
        slope_x = ((bz - az) * (cy - ay) - (cz - az) * (by - ay)) / area
        slope_y = ((cz - az) * (bx - ax) - (bz - az) * (cx - ax)) / area
        first_x = max(int(np.ceil(min(ax, bx, cx))), 0)
        last_x = min(int(np.floor(max(ax, bx, cx))), owners.shape[1] - 1)
        first_y = max(int(np.ceil(min(ay, by, cy))), 0)
        last_y = min(int(np.floor(max(ay, by, cy))), owners.shape[0] - 1)
        for y in range(first_y, last_y + 1):
            near = az + slope_y * (y - ay) - slope_x * ax
            for x in range(first_x, last_x + 1):
                if (
                    (cx - bx) * (y - by) >= (cy - by) * (x - bx)
                    and (ax - cx) * (y - cy) >= (ay - cy) * (x - cx)
                    and (bx - ax) * (y - ay) >= (by - ay) * (x - ax)
                ):
                    depth = np.float32(near + slope_x * x)
                    if depth > nearest[y, x]:
                        nearest[y, x] = depth
                        owners[y, x] = t
    return owners


@njit(cache=True, error_model="numpy")
def _lit(
    owners: NDArray[np.int32],
    points: Array,
    triangles: Indices,
    texels: Array,
    lights: Array,
    texture: Floats,
) -> Floats:
    """Means over the samples of each pixel: light that comes back, and coverage.

    Light is taken at one of the samples of each quarter of a pixel.
    """
    half = FINE // 2
    picture = np.zeros((owners.shape[0] // FINE, owners.shape[1] // FINE, 4), np.float32)
    last_row, last_column = texture.shape[0] - 1, texture.shape[1] - 1
    for top in range(0, owners.shape[0], half):
        for left in range(0, owners.shape[1], half):
            covered, x, y = 0, 0, 0
            for sample in range(half * half):
                row, column = top + sample // half, left + sample % half
                if owners[row, column] != NOTHING:
                    covered, x, y = covered + 1, column, row
            if covered == 0:
                continue
            i, j, k = triangles[owners[y, x]]
            ax, ay = points[i, 0], points[i, 1]
            bx, by = points[j, 0] - ax, points[j, 1] - ay
            cx, cy = points[k, 0] - ax, points[k, 1] - ay
            area = bx * cy - by * cx
            b = ((x - ax) * cy - (y - ay) * cx) / area
            c = (bx * (y - ay) - by * (x - ax)) / area
            a = 1.0 - b - c
            column = int(a * texels[i, 0] + b * texels[j, 0] + c * texels[k, 0])
            row = int(a * texels[i, 1] + b * texels[j, 1] + c * texels[k, 1])
            texel = texture[min(max(row, 0), last_row), min(max(column, 0), last_column)]
            out, share = picture[y // FINE, x // FINE], covered / (FINE * FINE)
            for channel in range(3):
                light = a * lights[i, channel] + b * lights[j, channel] + c * lights[k, channel]
                out[channel] += np.float32(share * light) * texel[channel]
            out[3] += np.float32(share)
    return picture
