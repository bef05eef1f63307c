"""`moreno2005/book`: a book bends in front of desk and shelf while the light turns yellow.

The paper describes the non-rigid boundary of a bending book. The light changes smoothly from
natural to yellow. A model of smooth changes fails because of "the effect of self-shadowing produced
during the movement of the book". All other properties are our choice: the hand, the room, and the
lamp at the side of the book. When the book bends, most of its cover lies in its own shadow within
one frame, and its shadowed cloth looks like the wall.

The book is a sheet that bends without stretching. The hand holds it at the middle of its lower
edge, which is the origin of the coordinates u (right), v (down, from minus the height to 0) and w
(towards the camera). The bent sheet is a part of a general cylinder: its rulings, which are the
straight lines on the cylinder, are parallel, and its cross-section is any curve.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import cycle

import cv2
import numpy as np
from numba import njit
from numpy.random import Generator
from numpy.typing import NDArray

from trackmark.datasets.interface import Array, Image, Mask
from trackmark.datasets.synthetic.parameters import SceneParameters
from trackmark.datasets.synthetic.render.camera import Camera, develop_light
from trackmark.datasets.synthetic.render.colours import (
    CLOTHES,
    sample_colour,
    sample_similar,
    vary_colour,
)
from trackmark.datasets.synthetic.render.desk import render_room
from trackmark.datasets.synthetic.render.figure.look import sample_skin
from trackmark.datasets.synthetic.render.finish import (
    GAMMA,
    Finish,
    SceneObject,
    grain,
    render_surfaces,
)
from trackmark.datasets.synthetic.render.lamp import (
    REACH,
    lamp_visibility,
    remaining_light,
    surface_light,
)
from trackmark.datasets.synthetic.render.painting import Colour, Painting
from trackmark.datasets.synthetic.render.path import smooth_step
from trackmark.datasets.synthetic.render.solids import chain
from trackmark.datasets.synthetic.render.texture import fractal
from trackmark.datasets.synthetic.render.triangles import (
    Mesh,
    RenderedMesh,
    bounding_box,
    composite,
    grid_triangles,
    render_mesh,
    rotation_axes,
)
from trackmark.datasets.synthetic.render.views import random_wander
from trackmark.datasets.synthetic.scene import SceneTruth, SeededScene

STEPS = 48  # number of line segments of a cross-section
NEAR = 1.0  # an intersection nearer than this is the starting point of the ray [pixels]


@dataclass(frozen=True)
class Bending:
    """Bending of a sheet at one time."""

    left: float  # angle by which the left end is turned away from the camera [radians]
    right: float  # angle by which the right end is turned away from the camera [radians]
    slant: float  # angle of the rulings, from upright to the left [radians]


@dataclass(frozen=True)
class Section:
    """Cross-section of a sheet, perpendicular to the rulings, as n points."""

    along: Array  # (n,): arc length from the ruling through the origin
    across: Array  # (n,): positions perpendicular to the rulings
    near: Array  # (n,): positions towards the camera
    turn: Array  # (n,): inclination, positive if the sheet recedes to the right [radians]


def bend_sheet(
    bending: Bending, half_width: float, u: Array, v: Array
) -> tuple[Array, Array, Section]:
    """Bend a sheet with a half width; u and v (k,) are points on the flat sheet [pixels].

    Returns the positions of these points (k, 3), the unit normals of the front (k, 3), and the
    cross-section.
    """
    cosine, sine = np.cos(bending.slant), np.sin(bending.slant)
    along, ruling = u * cosine + v * sine, v * cosine - u * sine
    section = _section(bending, half_width, float(along.min()), float(along.max()))
    across = np.interp(along, section.along, section.across)
    near = np.interp(along, section.along, section.near)
    turn = np.interp(along, section.along, section.turn)
    points = np.stack([across * cosine - ruling * sine, across * sine + ruling * cosine, near], 1)
    aside = np.sin(turn)
    normals = np.stack([aside * cosine, aside * sine, np.cos(turn)], axis=1)
    return points, normals, section


def _section(bending: Bending, half_width: float, low: float, high: float) -> Section:
    along = np.linspace(low, high, STEPS + 1)
    distance = np.minimum(np.abs(along) / half_width, 1)
    turn = distance * np.where(along < 0, -bending.left, bending.right)
    middle = (turn[1:] + turn[:-1]) / 2
    step = along[1] - along[0]
    across, near = (
        np.concatenate([[0.0], np.cumsum(step * part)])
        for part in (np.cos(middle), -np.sin(middle))
    )
    return Section(
        along, across - np.interp(0.0, along, across), near - np.interp(0.0, along, near), turn
    )


def lit_share(
    section: Section, bending: Bending, size: tuple[float, float], u: Array, v: Array, lamp: Array
) -> Array:
    """Return the fraction of a lamp that the sheet does not hide from its points (k,), in [0, 1].

    The orientation of the sheet towards the lamp is ignored. `size` is the sheet's half width and
    height [pixels]. `lamp`, shape (m, 3), contains the directions (u, v, w) to points of the lamp.
    For the other parameters see `bend_sheet`.
    """
    cosine, sine = float(np.cos(bending.slant)), float(np.sin(bending.slant))
    along, ruling = u * cosine + v * sine, v * cosine - u * sine
    curve = np.stack([section.along, section.across, section.near], axis=1)
    starts = np.stack([np.interp(along, section.along, part) for part in curve.T[1:]], axis=1)
    towards = np.stack(
        [
            lamp[:, 0] * cosine + lamp[:, 1] * sine,
            lamp[:, 1] * cosine - lamp[:, 0] * sine,
            lamp[:, 2],
        ],
        axis=1,
    )
    blocked = _blocked(curve, starts, ruling, towards, cosine, sine, *size)
    return 1 - blocked / len(lamp)


@njit(cache=True, error_model="numpy")
def _blocked(
    curve: Array,
    starts: Array,
    ruling: Array,
    towards: Array,
    cosine: float,
    sine: float,
    half_width: float,
    height: float,
) -> NDArray[np.int64]:
    """Count the rays from each point that intersect the sheet again.

    In the plane perpendicular to the rulings, a ray and a segment of the cross-section are straight
    lines. The ray misses the sheet if their intersection lies beyond the end of the ruling.
    """
    counts = np.zeros(len(starts), np.int64)
    for i in range(len(starts)):
        for k in range(len(towards)):
            dx, dz = towards[k, 0], towards[k, 2]
            for j in range(len(curve) - 1):
                ex, ez = curve[j + 1, 1] - curve[j, 1], curve[j + 1, 2] - curve[j, 2]
                fx, fz = curve[j, 1] - starts[i, 0], curve[j, 2] - starts[i, 1]
                across = dx * ez - dz * ex
                far, share = (fx * ez - fz * ex) / across, (fx * dz - fz * dx) / across
                if not (far > NEAR and 0.0 <= share <= 1.0):
                    continue
                a = curve[j, 0] + share * (curve[j + 1, 0] - curve[j, 0])
                b = ruling[i] + far * towards[k, 1]
                u, v = a * cosine - b * sine, a * sine + b * cosine
                if abs(u) <= half_width and -height <= v <= 0.0:
                    counts[i] += 1
                    break
    return counts


FRAMES = 100
SIZE = 320, 240
SETTLED = 15.0  # first frame in which the book rotates with the full amplitude
DISTANCE = 800.0  # distance of the camera from the book [pixels]
SWAY = (1.4, 4.0)  # range of periods of the slow movements [seconds]
# duration of a bend [frames]; it lies between two frames, so that the shadow appears suddenly
QUICK = 1
SLOW = 2, 4  # range of the duration of a release [frames]
HELD = 2, 4  # range of the time until the next movement [frames]


@dataclass(frozen=True)
class BookPose:
    """Position and orientation of the book at the point that the hand holds."""

    place: Array  # (2,): column and row [pixels]
    # (3, 3): columns are the directions of u, v and w in the axes right, down, towards the camera
    axes: Array
    tilt: float  # rotation in the image plane, to the right [radians]
    scale: float

    def project(self, points: Array) -> Array:
        """Project points of the book: column, row and nearness [pixels], shape (k, 3)."""
        turned = self.scale * points @ self.axes.T
        larger = DISTANCE / (DISTANCE - turned[:, 2:])
        return np.hstack([self.place + turned[:, :2] * larger, turned[:, 2:]])


@dataclass(frozen=True)
class BookPlan:
    """Poses and bendings of the book in every frame."""

    poses: tuple[BookPose, ...]
    bendings: tuple[Bending, ...]


def sample_plan(random: Generator, height: float, side: float) -> BookPlan:
    """Sample the motion of a book with a height [pixels].

    `side` is 1 if the light comes from the right, and -1 if it comes from the left.
    """
    middle = np.array([160.0, 106 + height / 2]) + random.uniform(-1, 1, 2) * [22, 8]
    x, y = (random_wander(random, FRAMES, SWAY, spread) for spread in (11.0, 5.0))
    turns = [random_wander(random, FRAMES, SWAY, spread) for spread in (0.07, 0.06, 0.06)]
    for turn in turns[1:]:  # At first, the book faces the camera.
        turn *= smooth_step(np.arange(float(FRAMES)), -2.0, SETTLED)
    scales = 1 + random_wander(random, FRAMES, SWAY, 0.025)
    away, bendings = _movements(random, side)
    turns[1] -= side * away
    poses = tuple(
        BookPose(middle + [x[k], y[k]], rotation_axes(*(float(turn[k]) for turn in turns)),
             float(turns[0][k]), float(scales[k]))
        for k in range(FRAMES)
    )  # fmt: skip
    return BookPlan(poses, bendings)


def _movements(random: Generator, side: float) -> tuple[Array, tuple[Bending, ...]]:
    """Return the rotation away from the light [radians] and the bending of the book, by frame.

    The book is repeatedly bent and turned away from the light, and released more slowly. The side
    away from the light bends away from the camera, or the other side bends towards the camera, or
    both. Most of the book then lies in its own shadow.
    """
    times, keys = [0, int(random.integers(5, 8))], [_sample_release(random)] * 2
    kinds = cycle(random.permutation(["far", "near", "both"]).tolist())
    while times[-1] < FRAMES:
        bend = times[-1] + QUICK
        release = bend + int(random.integers(*HELD, endpoint=True))
        end = release + int(random.integers(*SLOW, endpoint=True))
        times += [bend, release, end, end + int(random.integers(*HELD, endpoint=True))]
        keys += [_sample_bend(random, next(kinds))] * 2
        keys += [_sample_release(random)] * 2
    far, near, slant, away = _eased(np.arange(float(FRAMES)), times, np.array(keys)).T
    left, right = (far, near) if side > 0 else (near, far)
    bendings = np.stack([left, right, slant], axis=1).tolist()
    return away, tuple(Bending(*values) for values in bendings)


def _sample_release(random: Generator) -> tuple[float, float, float, float]:
    bending = random.uniform(0.0, 0.25), random.uniform(-0.15, 0.2), random.uniform(-0.3, 0.3)
    return *bending, -random.uniform(0.05, 0.15)


def _sample_bend(random: Generator, kind: str) -> tuple[float, float, float, float]:
    far = random.uniform(0.2, 0.6) if kind == "near" else random.uniform(0.4, 0.7)
    near = random.uniform(-0.4, 0.4) if kind == "far" else -random.uniform(0.4, 0.7)
    return far, near, random.uniform(-0.4, 0.4), random.uniform(0.28, 0.4)


def _eased(moments: Array, times: Sequence[int], values: Array) -> Array:
    """Interpolate values between key frames, with zero speed at every key frame."""
    whole = np.interp(moments, times, np.arange(len(values)))
    first = np.minimum(whole.astype(np.int64), len(values) - 2)
    share = smooth_step(whole - first, 0.0, 1.0)[:, None]
    return np.asarray(values[first] * (1 - share) + values[first + 1] * share)


FINE = 3  # texels per pixel and axis
# rows of the texture below the cover for the edges of the pages, and for the back cover
PAGES = 12

INKS = ((208, 224, 232), (70, 186, 226), (190, 206, 170), (46, 42, 44), (150, 176, 224))
SIDE = 512


def print_cover(
    random: Generator, half_width: float, height: float, cloth: Colour
) -> NDArray[np.float32]:
    """Return the texture of a book, linear BGR: the cover, then twice `PAGES` rows.

    `half_width` and `height` are in pixels; the texture has `FINE` texels per pixel and axis.
    `cloth` is the colour of the cover, BGR in [0, 255].
    """
    columns, rows = round(2 * half_width * FINE), round(height * FINE)
    picture = np.empty((rows + 2 * PAGES, columns, 3), np.uint8)
    ink = sample_colour(random, INKS)
    if abs(float(ink.sum() - cloth.sum())) < 150:
        ink = vary_colour(random, INKS[0])
    picture[:] = np.clip(cloth, 0, 255)
    _print_front(Painting(picture[:rows], float(columns)), random, cloth, ink, rows / columns)
    picture[rows : rows + PAGES] = _pages(random, columns)
    picture[rows + PAGES :] = np.clip(cloth * 0.8, 0, 255)
    woven = fractal(random, SIDE, 16, 256, 0.95)[:rows, :columns]
    blotched = fractal(random, SIDE, 4, 16)[:rows, :columns]
    gain = 1 + 0.05 * woven + 0.05 * blotched
    light = (picture / 255.0) ** GAMMA
    light[:rows] *= gain[..., None]
    return np.asarray(np.clip(light, 0, 1), np.float32)


def _print_front(
    cover: Painting, random: Generator, cloth: Colour, ink: Colour, high: float
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


def _word(cover: Painting, random: Generator, top: float, tall: float, ink: Colour) -> None:
    letters = "".join(random.choice(list("AEIORSTLNMDBKU"), int(random.integers(5, 8))))
    font, high = cv2.FONT_HERSHEY_DUPLEX, tall * cover.scale
    (wide, base), _ = cv2.getTextSize(letters, font, 1.0, 2)
    scale = min(high / base, 0.7 * cover.scale / wide)
    corner = round(0.54 * cover.scale - scale * wide / 2), round(top * cover.scale + scale * base)
    thick = max(1, round(0.13 * scale * base))
    cv2.putText(cover.picture, letters, corner, font, scale, ink.tolist(), thick, cv2.LINE_AA)


def _device(
    cover: Painting, random: Generator, x: float, y: float, radius: float,
    second: Colour, ink: Colour,
) -> None:  # fmt: skip
    """Paint a disc with a star, rings or a sailing ship."""
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


def _pages(random: Generator, columns: int) -> NDArray[np.uint8]:
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
"""Vertices along each edge of the front, their inner neighbours, and the orientation.

The orientation is the order of vertices for which triangles between front and back are clockwise
when seen from outside.
"""

SPINE = 0  # index of the edge that is the spine, made of cloth
THICKNESS = 5.0  # [pixels]
# horizontal angles between points of the lamp and its centre [radians]
SPREAD = np.array([-0.12, -0.06, 0.0, 0.06, 0.12])


@dataclass(frozen=True)
class BookSurface:
    """Vertices of the book in a frame; the front vertices come first."""

    points: Array  # (v, 3): column, row, nearness [pixels]
    normals: Array  # (v, 3): outward unit normals
    straight: Array  # (v,): fraction of the lamp's light that reaches the vertex, in [0, 1]


class Book:
    """Book with a random size."""

    def __init__(self, random: Generator) -> None:
        self.half_width = random.uniform(45, 51)
        self.height = 2 * self.half_width * random.uniform(1.25, 1.4)
        columns, rows = np.meshgrid(np.linspace(-1, 1, COLUMNS), np.linspace(-1, 0, ROWS))
        self._u, self._v = self.half_width * columns.ravel(), self.height * rows.ravel()

    def print_cover(self, random: Generator, cloth: Colour) -> NDArray[np.float32]:
        """Return the texture with a random print on a cloth colour, BGR in [0, 255]."""
        return print_cover(random, self.half_width, self.height, cloth)

    def blank(self) -> NDArray[np.float32]:
        """Return a black texture with the shape of `print_cover`."""
        columns, rows = round(2 * self.half_width * FINE), round(self.height * FINE)
        return np.zeros((rows + 2 * PAGES, columns, 3), np.float32)

    def mesh(self, texture: NDArray[np.float32]) -> Mesh:
        """Return the triangles of the book; `texture` has the shape of `blank`."""
        front = np.stack([self._u + self.half_width, self._v + self.height], axis=1) * FINE
        rows, columns = texture.shape[0] - 2 * PAGES, texture.shape[1]
        texels = [front, [0, rows + PAGES + 1.5] + 0 * front]
        triangles = [grid_triangles(ROWS, COLUMNS)]
        triangles.append(triangles[0][:, ::-1] + FRONT)
        start = 2 * FRONT
        for k, (border, _, order) in enumerate(BORDERS):
            along = np.linspace(0, columns, len(border))
            first = rows + (k == SPINE) * PAGES
            ends = first + 0.5, first + PAGES - 0.5
            texels += [np.stack([along, np.full(len(along), row)], axis=1) for row in ends]
            triangles.append(grid_triangles(2, len(border))[:, ::order] + start)
            start += 2 * len(border)
        return Mesh(np.concatenate(triangles), np.concatenate(texels), texture, closed=True)

    def surface(self, bending: Bending, pose: BookPose, lamp: Array) -> BookSurface:
        """Return the vertices of the bent book in a pose; `lamp` is the direction to the lamp."""
        places, normals, section = bend_sheet(bending, self.half_width, self._u, self._v)
        level = np.array([lamp[2], 0.0, -lamp[0]])
        rays = (lamp + SPREAD[:, None] * level) @ pose.axes
        size = self.half_width, self.height
        left = lit_share(section, bending, size, self._u, self._v, rays)
        back = places - THICKNESS * normals
        points, directions, parts = [places, back], [normals, -normals], [left, left]
        for border, inner, _ in BORDERS:
            outwards = places[border] - places[inner]
            outwards /= np.sqrt((outwards * outwards).sum(axis=1, keepdims=True))
            points += [places[border], back[border]]
            directions += [outwards, outwards]
            parts += [left[border], left[border]]
        turned = np.concatenate(directions) @ pose.axes.T
        straight = np.concatenate(parts) * np.maximum(turned @ lamp, 0)
        return BookSurface(pose.project(np.concatenate(points)), turned, straight)


def self_shadow(surface: BookSurface, lamp: Array) -> float:
    """Return the fraction of the visible front that is in its own shadow.

    A vertex is in shadow if it receives less than half of the light that it would receive on a flat
    book that faces the camera.
    """
    facing = np.maximum(surface.normals[:FRONT, 2], 0)
    shaded = surface.straight[:FRONT] < 0.5 * lamp[2]
    return float((facing * shaded).sum() / facing.sum())


Floats = NDArray[np.float32]

# ambient light, and light of the lamp on facing surfaces of the book and of the room
AROUND, STRAIGHT, ROOM_STRAIGHT = 0.22, 1.7, 0.35
# colours of the light, BGR: a window to the north, a light bulb
NATURAL, YELLOW = np.array([1.12, 1.0, 0.90]), np.array([0.32, 0.84, 1.08])
FAR = 620.0  # distance of the lamp from the centre of the image [pixels]
SHADOWED = 1.1  # light on the cloth in which the cloth looks like the wall [multiples of `AROUND`]
HORIZON = 178  # image row at which the wall meets the desk [pixels]
ROOM_FINE = 2  # samples per pixel and axis of static objects
# window of hand and arm: upper left corner relative to the held point, size, samples per pixel
HAND_CORNER, HAND_SIZE, HAND_FINE = (-90, -34), (180, 190), 2
BLEND = 4.0  # distance over which the solids of the hand merge [pixels]


# minimum fraction of the front in its own shadow for the attribute `self-shadow`
CONSIDERABLE = 0.25
BEHIND = 70.0  # distance from the book to the surface on which its shadow falls [pixels]
SOFTNESS, DARKNESS = 9.0, 0.7  # softness and darkness of the shadow; see `remaining_light`
CAMERA = Camera(SIZE, noise=2.0, fall=(0.05, 0.05))


class BookScene(SeededScene):
    """Scene of a book that bends in a hand.

    `lamp`, shape (3,), is the direction to the light, which is at one side, slightly above and in
    front of the book.
    """

    label, length, size = "moreno2005/book", FRAMES, SIZE

    def __init__(self, parameters: SceneParameters) -> None:
        super().__init__(parameters)
        random = self._random("lamp")
        lamp = np.array([random.choice([-1, 1]) * random.uniform(0.80, 0.90), -0.25, 0.40])
        self.lamp: Array = lamp / np.sqrt((lamp * lamp).sum())
        self.book = Book(self._random("book"))

    @cached_property
    def plan(self) -> BookPlan:
        """Motion and bending of the book."""
        return sample_plan(self._random("plan"), self.book.height, float(np.sign(self.lamp[0])))

    @cached_property
    def illuminants(self) -> Array:
        """Colour of the light in every frame, BGR, from natural to yellow, shape (FRAMES, 3)."""
        random = self._random("illuminant")
        start, end = random.uniform(0.02, 0.12), random.uniform(0.88, 0.98)
        share = smooth_step(np.arange(FRAMES) / (FRAMES - 1), start, end)[:, None]
        return np.asarray(NATURAL * (1 - share) + YELLOW * share)

    @cached_property
    def room(self) -> Floats:
        """Static background in white light, shape (height, width, 3)."""
        surface = render_room(self._random("room"), SIZE, HORIZON, ROOM_FINE)
        place = np.array([SIZE[0] / 2, SIZE[1] / 2, 0.0]) + FAR * self.lamp
        straight, _ = surface_light(place, surface.depth, surface.normal, ROOM_FINE)
        straight *= ROOM_STRAIGHT * (FAR / REACH) ** 2
        light = AROUND + straight[..., None] * lamp_visibility(surface.depth, place, ROOM_FINE)
        returned = np.asarray(surface.colour * light, np.float32)
        return np.asarray(cv2.resize(returned, SIZE, interpolation=cv2.INTER_AREA))

    @cached_property
    def _hand(self) -> Floats:
        """Hand and sleeve in white light, premultiplied by the coverage, the last channel."""
        random = self._random("hand")
        side = float(random.choice([-1, 1]))
        skin, cloth = sample_skin(random), sample_similar(random, CLOTHES, 0.06)
        things = [
            SceneObject(Finish(skin, 0.0, grain(random, 0.04)), _skin(random, side)),
            SceneObject(
                Finish(cloth, 0.0, grain(random, 0.09, (1.0, 0.6, 1.0), 16)), _sleeve(side)
            ),
        ]
        surface = render_surfaces(things, HAND_CORNER, HAND_SIZE, HAND_FINE)
        light = AROUND + STRAIGHT * np.maximum(surface.normal @ self.lamp, 0)
        covered = (surface.owners >= 0)[..., None]
        sheet = np.concatenate([surface.colour * light[..., None], covered], axis=2)
        return np.asarray(cv2.resize(sheet, HAND_SIZE, interpolation=cv2.INTER_AREA), np.float32)

    def hand(self, frame: int) -> Floats:
        """Return the hand at the position that it has in a frame, shape (height, width, 4)."""
        pose = self.plan.poses[frame]
        cosine, sine = np.cos(pose.tilt), np.sin(pose.tilt)
        turn = pose.scale * np.array([[cosine, -sine], [sine, cosine]])
        shift = pose.place + turn @ (np.array(HAND_CORNER) + 0.5) - 0.5
        matrix = np.column_stack([turn, shift])
        return np.asarray(cv2.warpAffine(self._hand, matrix, SIZE, flags=cv2.INTER_LINEAR))

    def surface(self, frame: int) -> BookSurface:
        """Return the vertices of the book in a frame."""
        return self.book.surface(self.plan.bendings[frame], self.plan.poses[frame], self.lamp)

    def render_book(self, frame: int) -> RenderedMesh:
        """Render the book without the hand."""
        return self._looked_at(self._mesh, self.surface(frame))

    def _looked_at(self, mesh: Mesh, surface: BookSurface) -> RenderedMesh:
        open_ = 0.7 + 0.3 * surface.normals[:, 2]
        light = AROUND * open_ + STRAIGHT * surface.straight
        return render_mesh(mesh, surface.points, np.repeat(light[:, None], 3, axis=1), SIZE)

    def truth(self) -> SceneTruth:
        """Return the ground truth of all frames.

        Boxes contain the whole book, including the part behind the thumb. The attribute
        `self-shadow` means that at least a quarter of the visible front is in its own shadow (see
        `Book.self_shadow`).
        """
        # The coverage does not depend on colours, which would require rendering the room.
        mesh = self.book.mesh(self.book.blank())
        boxes, visibility, shadow = np.empty((FRAMES, 4)), np.empty(FRAMES), np.empty(FRAMES)
        for frame in range(FRAMES):
            surface = self.surface(frame)
            boxes[frame] = bounding_box(surface.points)
            book = self._looked_at(mesh, surface)
            hidden = self.hand(frame)[..., 3][book.window]
            whole = book.sheet[..., 3].sum(dtype=np.float64)
            visibility[frame] = 1 - (book.sheet[..., 3] * hidden).sum(dtype=np.float64) / whole
            shadow[frame] = self_shadow(surface, self.lamp)
        return SceneTruth(boxes, visibility, {"self-shadow": shadow >= CONSIDERABLE})

    @cached_property
    def _mesh(self) -> Mesh:
        """Triangles of the book; the colour of its shadowed cloth is that of the wall."""
        wall = _most_frequent(self.room[20:HORIZON, 60:-60].reshape(-1, 3))
        light = np.clip(wall / (SHADOWED * AROUND), 0, 0.8)
        return self.book.mesh(
            self.book.print_cover(self._random("cover"), 255 * light ** (1 / GAMMA))
        )

    def render(self, frame: int) -> Image:
        book = self.render_book(frame)
        hand = self.hand(frame)
        covered = np.maximum(hand[..., 3], book.coverage(SIZE))
        shift = -BEHIND * self.lamp[:2] / self.lamp[2]
        left = remaining_light(covered, shift, SOFTNESS, DARKNESS)
        picture = np.asarray(cv2.multiply(self.room, left), np.float32)
        composite(picture[book.window], book.sheet)
        composite(picture, hand)
        picture *= self.illuminants[frame].astype(np.float32)
        return CAMERA.exposed(develop_light(picture), self._seed, frame)

    def mask(self, frame: int) -> Mask:
        book = self.render_book(frame).coverage(SIZE)
        return np.asarray(book * (1 - self.hand(frame)[..., 3]) >= 0.5)


def _most_frequent(colours: Floats) -> Array:
    """Return the mean of those colours, of shape (k, 3), that fall in the fullest of 12³ bins."""
    bins = (12 * np.sqrt(np.clip(colours, 0, 0.999))).astype(int)
    _, inverse, counts = np.unique(bins, axis=0, return_inverse=True, return_counts=True)
    return np.asarray(colours[inverse.ravel() == counts.argmax()].mean(axis=0), np.float64)


def _skin(random: Generator, side: float) -> list[Array]:
    """Return the solids of a hand; the origin is the held point of the book, and y is upwards."""
    lean = random.uniform(-3, 3)
    wrist = (side * 14, -46, -6)
    solids = [
        *chain([(side * 12, -30, 6), (side * 6, -9, 12), (lean, 12, 13)], (9.5, 7.2, 5.2), BLEND),
        *chain([wrist, (side * 12, -28, 4)], (10.5, 11), BLEND),
    ]
    for k in range(4):
        knuckle = (side * (-17 + 9.5 * k), -12 - 1.5 * abs(k - 1.4), -2 - 2 * k)
        solids += chain([(side * (-2 + 5 * k), -34, -2), knuckle], (9, 6.2), BLEND)
    return solids


def _sleeve(side: float) -> list[Array]:
    cuff = chain([(side * 15, -50, -6), (side * 17, -58, -6)], (15, 15.5), BLEND)
    return cuff + chain([(side * 16, -54, -6), (side * 34, -160, -6)], (14, 22), BLEND)
