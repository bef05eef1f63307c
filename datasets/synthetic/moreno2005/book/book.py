"""The book: its front, its back and the edges of its pages."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.moreno2005.book.cover import FINE, PAGES, printed
from datasets.synthetic.moreno2005.book.plan import Pose
from datasets.synthetic.moreno2005.book.sheet import Bending, bent, unshaded
from datasets.synthetic.render.triangles import Mesh, grid

__all__ = ["Book", "Surface", "self_shadow"]

Array = NDArray[np.float64]

ROWS, COLUMNS = 31, 27
"""Vertices of the front."""

FRONT = ROWS * COLUMNS

_INDEX = np.arange(FRONT).reshape(ROWS, COLUMNS)
BORDERS = (
    (_INDEX[:, 0], _INDEX[:, 1], 1),
    (_INDEX[:, -1], _INDEX[:, -2], -1),
    (_INDEX[0], _INDEX[1], -1),
    (_INDEX[-1], _INDEX[-2], 1),
)
"""Vertices of the front along each of its edges, those beside them, and the order in which
triangles from there to the back are clockwise seen from outside."""

SPINE = 0
"""Edge that is of cloth."""

THICKNESS = 5.0
"""[pixels]"""

SPREAD = np.array([-0.12, -0.06, 0.0, 0.06, 0.12])
"""Directions to points of the lamp, from that to its middle, on the level [radians]."""


@dataclass(frozen=True)
class Surface:
    """The book in a frame, vertex by vertex: those of the front are the first.

    Attributes
    ----------
    points : ndarray of float64, shape (v, 3)
        Column, row, nearness [pixels].
    normals : ndarray of float64, shape (v, 3)
        Outwards, of length 1.
    straight : ndarray of float64, shape (v,)
        Part of the lamp's light that falls there, in [0, 1].
    """

    points: Array
    normals: Array
    straight: Array


class Book:
    """A book of a size drawn at random."""

    def __init__(self, random: np.random.Generator) -> None:
        self.half_width = random.uniform(45, 51)
        self.height = 2 * self.half_width * random.uniform(1.25, 1.4)
        columns, rows = np.meshgrid(np.linspace(-1, 1, COLUMNS), np.linspace(-1, 0, ROWS))
        self._u, self._v = self.half_width * columns.ravel(), self.height * rows.ravel()

    def mesh(self, random: np.random.Generator) -> Mesh:
        """Its triangles, printed at random."""
        texture = printed(random, self.half_width, self.height)
        front = np.stack([self._u + self.half_width, self._v + self.height], axis=1) * FINE
        rows, columns = texture.shape[0] - 2 * PAGES, texture.shape[1]
        texels, triangles = [front, [0, rows + PAGES + 1.5] + 0 * front], [grid(ROWS, COLUMNS)]
        triangles.append(triangles[0][:, ::-1] + FRONT)
        start = 2 * FRONT
        for k, (border, _, order) in enumerate(BORDERS):
            along = np.linspace(0, columns, len(border))
            first = rows + (k == SPINE) * PAGES
            ends = first + 0.5, first + PAGES - 0.5
            texels += [np.stack([along, np.full(len(along), row)], axis=1) for row in ends]
            triangles.append(grid(2, len(border))[:, ::order] + start)
            start += 2 * len(border)
        return Mesh(np.concatenate(triangles), np.concatenate(texels), texture, closed=True)

    def surface(self, bending: Bending, pose: Pose, lamp: Array) -> Surface:
        """The book, bent and held somewhere, in the light of a lamp in a direction."""
        places, normals, section = bent(bending, self.half_width, self._u, self._v)
        level = np.array([lamp[2], 0.0, -lamp[0]])
        rays = (lamp + SPREAD[:, None] * level) @ pose.axes
        size = self.half_width, self.height
        left = unshaded(section, bending, size, self._u, self._v, rays)
        back = places - THICKNESS * normals
        points, directions, parts = [places, back], [normals, -normals], [left, left]
        for border, beside, _ in BORDERS:
            outwards = places[border] - places[beside]
            outwards /= np.sqrt((outwards * outwards).sum(axis=1, keepdims=True))
            points += [places[border], back[border]]
            directions += [outwards, outwards]
            parts += [left[border], left[border]]
        turned = np.concatenate(directions) @ pose.axes.T
        straight = np.concatenate(parts) * np.maximum(turned @ lamp, 0)
        return Surface(pose.seen(np.concatenate(points)), turned, straight)


def self_shadow(surface: Surface, lamp: Array) -> float:
    """Part of the front, as far as it faces the camera, that is in its own shadow.

    That is where it gets less than half of the lamp's light that it would get if it were flat
    before the camera.
    """
    facing = np.maximum(surface.normals[:FRONT, 2], 0)
    shaded = surface.straight[:FRONT] < 0.5 * lamp[2]
    return float((facing * shaded).sum() / facing.sum())
