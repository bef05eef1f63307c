"""Triangle meshes, rendered for a distant camera.

Points are image column, image row and nearness to the camera [pixels]. The renderer uses only sums,
products and quotients, so that all platforms give the same bytes.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from trackmark.datasets.interface import Array

Floats = NDArray[np.float32]
Indices = NDArray[np.int64]

FINE = 4  # samples per pixel and axis
NOTHING = -1  # triangle index of a sample that no triangle covers


@dataclass(frozen=True)
class Mesh:
    """Triangles with a texture."""

    triangles: Indices  # (t, 3), vertex indices of each triangle
    texels: Array  # (v, 2), texture column and row of each vertex; texel i covers [i, i + 1)
    texture: Floats  # (h, w, 3), reflected fraction of the light, BGR
    # True for the surface of a solid: a triangle is visible only if its vertices are clockwise in
    # the image. Otherwise both sides are visible.
    closed: bool


@dataclass(frozen=True)
class RenderedMesh:
    """Image of a mesh in a window."""

    window: tuple[slice, slice]  # rows and columns of the image
    # (h, w, 4), reflected light, BGR, premultiplied by the last channel, coverage in [0, 1]
    sheet: Floats

    def coverage(self, size: tuple[int, int]) -> Floats:
        """Return the coverage of each pixel of an image with a width and height, in [0, 1]."""
        whole = np.zeros(size[::-1], np.float32)
        whole[self.window] = self.sheet[..., 3]
        return whole


def rotation_axes(tilt: float, yaw: float, pitch: float) -> Array:
    """Return the directions of an object's axes after rotation, as columns.

    The rotations are in the image plane, to the right, and down [radians]. Without rotation, the
    axes point to the right, down and towards the camera.
    """
    (a, b, c), (d, e, f) = np.cos([tilt, yaw, pitch]), np.sin([tilt, yaw, pitch])
    in_picture = np.array([[a, -d, 0], [d, a, 0], [0, 0, 1]])
    aside = np.array([[b, 0, e], [0, 1, 0], [-e, 0, b]])
    over = np.array([[1, 0, 0], [0, c, -f], [0, f, c]])
    return np.asarray(in_picture @ over @ aside)


def bounding_box(points: Array) -> Array:
    """Return the bounding box (x, y, width, height) of points (column, row, …) [pixels]."""
    low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    return np.concatenate([low, high - low])


def grid_triangles(rows: int, columns: int) -> Indices:
    """Return the triangles (t, 3) of a grid of vertices, clockwise if rows run downwards."""
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    upper = np.stack([corner, corner + 1, corner + columns], axis=1)
    lower = np.stack([corner + 1, corner + columns + 1, corner + columns], axis=1)
    return np.concatenate([upper, lower])


def render_mesh(mesh: Mesh, points: Array, lights: Array, size: tuple[int, int]) -> RenderedMesh:
    """Render a mesh whose vertices are at `points`, in an image with a width and height [pixels].

    `lights`, shape (v, 3), is the light on each vertex, BGR.
    """
    low = np.clip(np.floor(points[:, :2].min(axis=0)), 0, size).astype(np.int64)
    high = np.clip(np.ceil(points[:, :2].max(axis=0)), low, size).astype(np.int64)
    (left, top), (right, bottom) = low.tolist(), high.tolist()
    placed = points.copy()
    placed[:, :2] = (placed[:, :2] - low) * FINE - 0.5
    owners = _owners(placed, mesh.triangles, mesh.closed, bottom - top, right - left)
    sheet = _shade_samples(owners, placed, mesh.triangles, mesh.texels, lights, mesh.texture)
    return RenderedMesh((slice(top, bottom), slice(left, right)), sheet)


@njit(cache=True, error_model="numpy")
def composite(picture: Floats, sheet: Floats) -> None:
    """Blend the sheet of a `RenderedMesh` in place over an image or sheet of equal size."""
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
    """Return the nearest triangle at each sample of a window, or `NOTHING`.

    Columns and rows of the points are in samples, relative to the centre of the first sample.
    """
    owners = np.full((height * FINE, width * FINE), NOTHING, np.int32)
    nearest = np.full(owners.shape, -1e30, np.float32)
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        a_x, a_y, a_z = points[a, 0], points[a, 1], points[a, 2]
        b_x, b_y, b_z = points[b, 0], points[b, 1], points[b, 2]
        c_x, c_y, c_z = points[c, 0], points[c, 1], points[c, 2]
        area = (b_x - a_x) * (c_y - a_y) - (b_y - a_y) * (c_x - a_x)
        if area == 0.0 or (closed and area < 0.0):
            continue
        if area < 0.0:
            b_x, b_y, b_z, c_x, c_y, c_z = c_x, c_y, c_z, b_x, b_y, b_z
            area = -area
        slope_x = ((b_z - a_z) * (c_y - a_y) - (c_z - a_z) * (b_y - a_y)) / area
        slope_y = ((c_z - a_z) * (b_x - a_x) - (b_z - a_z) * (c_x - a_x)) / area
        first_x = max(int(np.ceil(min(a_x, b_x, c_x))), 0)
        last_x = min(int(np.floor(max(a_x, b_x, c_x))), owners.shape[1] - 1)
        first_y = max(int(np.ceil(min(a_y, b_y, c_y))), 0)
        last_y = min(int(np.floor(max(a_y, b_y, c_y))), owners.shape[0] - 1)
        for y in range(first_y, last_y + 1):
            near = a_z + slope_y * (y - a_y) - slope_x * a_x
            for x in range(first_x, last_x + 1):
                if (
                    (c_x - b_x) * (y - b_y) >= (c_y - b_y) * (x - b_x)
                    and (a_x - c_x) * (y - c_y) >= (a_y - c_y) * (x - c_x)
                    and (b_x - a_x) * (y - a_y) >= (b_y - a_y) * (x - a_x)
                ):
                    depth = np.float32(near + slope_x * x)
                    if depth > nearest[y, x]:
                        nearest[y, x] = depth
                        owners[y, x] = t
    return owners


@njit(cache=True, error_model="numpy")
def _shade_samples(
    owners: NDArray[np.int32],
    points: Array,
    triangles: Indices,
    texels: Array,
    lights: Array,
    texture: Floats,
) -> Floats:
    """Return mean light and coverage per pixel; the light is sampled once per quarter pixel."""
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
            a_x, a_y = points[i, 0], points[i, 1]
            b_x, b_y = points[j, 0] - a_x, points[j, 1] - a_y
            c_x, c_y = points[k, 0] - a_x, points[k, 1] - a_y
            area = b_x * c_y - b_y * c_x
            b = ((x - a_x) * c_y - (y - a_y) * c_x) / area
            c = (b_x * (y - a_y) - b_y * (x - a_x)) / area
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
