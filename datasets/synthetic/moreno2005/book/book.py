"""The book: its front, its back and the edges of its pages, and what is printed on it."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.synthetic.moreno2005.book.plan import Pose
from trackmark.datasets.synthetic.moreno2005.book.sheet import Bending, bent, unshaded
from trackmark.datasets.synthetic.render.colours import any_of, varied
from trackmark.datasets.synthetic.render.finish import GAMMA
from trackmark.datasets.synthetic.render.painting import Colour, Painting
from trackmark.datasets.synthetic.render.texture import fractal
from trackmark.datasets.synthetic.render.triangles import Mesh, grid

Array = NDArray[np.float64]

FINE = 3  # texels a pixel, in either direction
# Rows of the texture below the cover: the pages' edges, then as many of the back's colour.
PAGES = 12

INKS = ((208, 224, 232), (70, 186, 226), (190, 206, 170), (46, 42, 44), (150, 176, 224))
SIDE = 512


def printed(
    random: np.random.Generator, half_width: float, height: float, cloth: Colour
) -> NDArray[np.float32]:
    """Paint a book's surface, linear, BGR: cover, then `PAGES` rows twice.

    The size is given in pixels, with `FINE` texels per pixel; the cloth is BGR in [0, 255].
    """
    columns, rows = round(2 * half_width * FINE), round(height * FINE)
    picture = np.empty((rows + 2 * PAGES, columns, 3), np.uint8)
    ink = any_of(random, INKS)
    if abs(float(ink.sum() - cloth.sum())) < 150:
        ink = varied(random, INKS[0])
    picture[:] = np.clip(cloth, 0, 255)
    _print(Painting(picture[:rows], float(columns)), random, cloth, ink, rows / columns)
    picture[rows : rows + PAGES] = _pages(random, columns)
    picture[rows + PAGES :] = np.clip(cloth * 0.8, 0, 255)
    woven = fractal(random, SIDE, 16, 256, 0.95)[:rows, :columns]
    blotched = fractal(random, SIDE, 4, 16)[:rows, :columns]
    gain = 1 + 0.05 * woven + 0.05 * blotched
    light = (picture / 255.0) ** GAMMA
    light[:rows] *= gain[..., None]
    return np.asarray(np.clip(light, 0, 1), np.float32)


def _print(
    cover: Painting, random: np.random.Generator, cloth: Colour, ink: Colour, high: float
) -> None:
    second = cloth * 0.55 + ink * 0.2
    cover.patch(0, 0, 0.08, high, cloth * 0.72)
    cover.patch(0.08, 0, 0.008, high, cloth * 0.5)
    left, right = 0.15, 0.93
    frame = [(left, 0.07), (right, 0.07), (right, high - 0.07), (left, high - 0.07), (left, 0.06)]
    cover.line(frame, 0.012, ink)
    for line in range(int(random.integers(1, 3))):
        _word(cover, random, 0.14 + 0.16 * line, 0.13, ink)
    _word(cover, random, high - 0.2, 0.06, ink)
    middle = high * random.uniform(0.58, 0.64)
    _device(cover, random, (left + right) / 2, middle, random.uniform(0.2, 0.26), second, ink)


def _word(
    cover: Painting, random: np.random.Generator, top: float, tall: float, ink: Colour
) -> None:
    """Letters, as wide together as the frame allows."""
    letters = "".join(random.choice(list("AEIORSTLNMDBKU"), int(random.integers(5, 8))))
    font, high = cv2.FONT_HERSHEY_DUPLEX, tall * cover.scale
    (wide, base), _ = cv2.getTextSize(letters, font, 1.0, 2)
    scale = min(high / base, 0.7 * cover.scale / wide)
    corner = round(0.54 * cover.scale - scale * wide / 2), round(top * cover.scale + scale * base)
    thick = max(1, round(0.13 * scale * base))
    cv2.putText(cover.picture, letters, corner, font, scale, ink.tolist(), thick, cv2.LINE_AA)


def _device(
    cover: Painting, random: np.random.Generator, x: float, y: float, radius: float,
    second: Colour, ink: Colour,
) -> None:  # fmt: skip
    """A disc with a star, with rings, or with a ship's sail."""
    cover.disc(x, y, radius, second)
    kind = int(random.integers(3))
    if kind == 0:
        turns = np.arange(10) * np.pi / 5 - np.pi / 2
        reach = radius * np.where(np.arange(10) % 2, 0.36, 0.86)
        cover.area(
            [(x + r * np.cos(t), y + r * np.sin(t)) for r, t in zip(reach, turns, strict=True)], ink
        )
    elif kind == 1:
        for share in (0.8, 0.62, 0.44, 0.26):
            cover.disc(x, y, share * radius, ink if share in (0.8, 0.44) else second)
    else:
        cover.area([(x - 0.05 * radius, y - 0.8 * radius), (x - 0.05 * radius, y + 0.3 * radius),
                    (x - 0.66 * radius, y + 0.3 * radius)], ink)  # fmt: skip
        cover.area([(x + 0.08 * radius, y - 0.6 * radius), (x + 0.6 * radius, y + 0.3 * radius),
                    (x + 0.08 * radius, y + 0.3 * radius)], ink)  # fmt: skip
        cover.area([(x - 0.6 * radius, y + 0.42 * radius), (x + 0.6 * radius, y + 0.42 * radius),
                    (x + 0.4 * radius, y + 0.66 * radius), (x - 0.4 * radius, y + 0.66 * radius)],
                   ink)  # fmt: skip


def _pages(random: np.random.Generator, columns: int) -> NDArray[np.uint8]:
    """Edges of leaves of paper, lighter and darker."""
    tones = random.uniform(0.72, 1.0, (PAGES, 1)) * random.uniform(0.97, 1.0, (PAGES, columns))
    return np.asarray(tones[..., None] * [196, 218, 228], np.uint8)


ROWS, COLUMNS = 31, 27  # vertices of the front
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

SPINE = 0  # edge that is of cloth
THICKNESS = 5.0  # [pixels]
# Directions to points of the lamp, from that to its middle, on the level [radians].
SPREAD = np.array([-0.12, -0.06, 0.0, 0.06, 0.12])


@dataclass(frozen=True)
class Surface:
    """The book in a frame, vertex by vertex: those of the front are the first."""

    points: Array  # (v, 3): column, row, nearness [pixels]
    normals: Array  # (v, 3): outwards, of length 1
    straight: Array  # (v,): part of the lamp's light that falls there, in [0, 1]


class Book:
    """A book of a size drawn at random."""

    def __init__(self, random: np.random.Generator) -> None:
        self.half_width = random.uniform(45, 51)
        self.height = 2 * self.half_width * random.uniform(1.25, 1.4)
        columns, rows = np.meshgrid(np.linspace(-1, 1, COLUMNS), np.linspace(-1, 0, ROWS))
        self._u, self._v = self.half_width * columns.ravel(), self.height * rows.ravel()

    def printed(self, random: np.random.Generator, cloth: Colour) -> NDArray[np.float32]:
        """Return its texture, printed at random on a cloth of a colour, BGR in [0, 255]."""
        return printed(random, self.half_width, self.height, cloth)

    def blank(self) -> NDArray[np.float32]:
        """Return a black texture of the same shape."""
        columns, rows = round(2 * self.half_width * FINE), round(self.height * FINE)
        return np.zeros((rows + 2 * PAGES, columns, 3), np.float32)

    def mesh(self, texture: NDArray[np.float32]) -> Mesh:
        """Return its triangles with a texture of the shape that `blank` gives."""
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
