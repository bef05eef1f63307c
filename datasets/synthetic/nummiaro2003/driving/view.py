"""Shapes of cars, and the pinhole camera: poses of solids, light on facets, upright cutouts.

World coordinates are x to the right, y up and z ahead [metres]. A yaw or heading of 0 points along
z, and one of π/2 along x.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np
from numba import njit
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.interface import Array
from trackmark.datasets.synthetic.render.prop import Prop
from trackmark.datasets.synthetic.render.sprite import Sprite
from trackmark.datasets.synthetic.render.views import Viewpoint

MAX_CORNERS = 8  # maximum number of corners of a facet


class Facets(NamedTuple):
    """Facets of a solid; a facet that can occlude another facet comes before it."""

    # (n, MAX_CORNERS, 3), in the solid's coordinates: right, up, ahead [metres]
    corners: Array
    counts: NDArray[np.int64]  # (n,), number of valid corners
    normals: Array  # (n, 3), outward unit normals
    kinds: NDArray[np.int64]  # (n,), index of the texture
    # (n, 2, 4), texture column and row as linear functions of a point: three factors, a constant
    places: Array
    # (n,), True for a shadow: it occupies no samples; its darkness is the texture's blue channel
    soft: NDArray[np.bool_]


class Pictures(NamedTuple):
    """Periodic textures at several resolutions, packed in one array."""

    pixels: NDArray[np.uint32]  # (k,), one byte per channel; blue is the lowest byte
    # (textures, levels), index of the first pixel in `pixels`; -1 for levels that do not exist
    starts: NDArray[np.int64]
    sizes: NDArray[np.int64]  # (textures, 2), log2 of width and height at the finest level


class Lens(NamedTuple):
    """Focal length, and column and row of the optical axis in the painted window [pixels]."""

    focal: float
    column: float
    row: float


class FacetPose(NamedTuple):
    """Pose of a solid relative to the camera, and its light."""

    turn: Array  # (3, 3), rotation from the solid's to the camera's axes (right, down, ahead)
    place: Array  # (3,), the solid's origin in camera coordinates [metres]
    gains: NDArray[np.int64]  # (n,), light on each facet, times 256
    # (2, 4), column and row in the texture of stains as linear functions of a point in camera
    # coordinates: three factors, a constant
    shading: Array


def pack_pictures(images: Sequence[Array]) -> Pictures:
    """Pack textures (BGR in [0, 255], sides are powers of two) at all resolutions."""
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


def blank_pictures(count: int = 1, level: float = 128.0) -> Pictures:
    """Return `count` textures of one grey pixel each."""
    return pack_pictures([np.full((1, 1, 3), level)] * count)


@dataclass(frozen=True)
class Face:
    """Plane polygon."""

    corners: Array  # (n, 3), in order around the polygon, n <= MAX_CORNERS [metres]
    outwards: Array  # (3,), a vector that points to the outer side
    kind: int  # index of the texture
    soft: bool = False  # True for a shadow


@dataclass(frozen=True)
class Ring:
    """Horizontal cross-section of a solid: a rectangle whose corners may be cut off."""

    height: float  # [metres]
    ahead: float  # front end along the solid's axis [metres]
    behind: float  # rear end along the solid's axis [metres]
    half_width: float  # [metres]

    def corners(self, cut: tuple[float, float]) -> Array:
        """Return the eight corners, from the left end of the front.

        `cut`: extent of a cut-off corner to the side and along the car [metres].
        """
        wide, narrow = self.half_width, self.half_width - cut[0]
        ahead, behind = self.ahead - cut[1], self.behind + cut[1]
        outline = [(-narrow, self.ahead), (narrow, self.ahead), (wide, ahead), (wide, behind),
                   (narrow, self.behind), (-narrow, self.behind), (-wide, behind),
                   (-wide, ahead)]  # fmt: skip
        return np.array([[x, self.height, z] for x, z in outline])


def side_faces(
    lower: Ring, upper: Ring, kinds: tuple[int, int, int], cut: tuple[float, float] = (0.0, 0.0)
) -> Iterator[Face]:
    """Yield the faces of a solid between two cross-sections.

    `kinds` are the textures of front, rear and sides; cut corners have the texture of front or
    rear. `cut` is described in `Ring.corners`; it is equal for both cross-sections, so that every
    face is plane.
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


def level_face(
    height: float, x: tuple[float, float], z: tuple[float, float], kind: int, soft: bool = False
) -> Face:
    """Return a horizontal rectangle that faces up."""
    outline = [(x[0], z[0]), (x[1], z[0]), (x[1], z[1]), (x[0], z[1])]
    corners = np.array([[a, height, b] for a, b in outline])
    return Face(corners, np.array([0.0, 1.0, 0.0]), kind, soft)


def upright_face(corners: Sequence[tuple[float, float]], z: float, ahead: bool, kind: int) -> Face:
    """Return a polygon of corners (x, y) in the plane `z` that faces ahead or backwards."""
    places = np.array([[x, y, z] for x, y in corners])
    return Face(places, np.array([0.0, 0.0, 1.0 if ahead else -1.0]), kind)


def assemble_facets(faces: Sequence[Face], projections: Array) -> Facets:
    """Return `faces` as facets in the same order.

    `projections`, shape (textures, 2, 4), contains the `Facets.places` of every texture.
    """
    corners = np.zeros((len(faces), MAX_CORNERS, 3))
    normals = np.empty((len(faces), 3))
    for k, face in enumerate(faces):
        corners[k, : len(face.corners)] = face.corners
        # The diagonals span the plane even if two corners coincide.
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


# textures of a car; TOP is the view from above
SIDE, FRONT, REAR, TOP, SHADOW = range(5)
REACH = 2.56  # half length that SIDE and TOP show [metres]
WIDE = 1.28  # half width that FRONT, REAR and TOP show [metres]
TALL = 1.92  # height that SIDE, FRONT and REAR show [metres]
# width and height of the textures [pixels]
SIZES = {SIDE: (512, 128), FRONT: (256, 128), REAR: (256, 128), TOP: (256, 128), SHADOW: (64, 64)}
BELT = 0.93  # height of the windows' lower edge [metres]
TYRE = 0.31  # radius of a tyre and height of its hub [metres]
_CUT = 0.16, 0.24  # size of the cut corners of the body, across and along [metres]
_DARK = 0.55  # distance by which the shadow extends beyond the body [metres]


@dataclass(frozen=True)
class CarShape:
    """Proportions of a car [metres]; positions along the car are positive ahead of its centre."""

    length: float  # length of the body
    width: float  # width of the body
    roof: float  # height of the roof
    bonnet: float  # height of the bonnet's front edge
    screen: tuple[float, float]  # foot and roof end of the windscreen
    rear_screen: tuple[float, float]  # foot and roof end of the rear window
    deck: float  # rear end of the body at the height of the windows
    axles: tuple[float, float]  # front axle and rear axle

    @property
    def rings(self) -> tuple[Ring, ...]:
        """Cross-sections of the body, from the sills to the windows."""
        end, wide = self.length / 2, self.width / 2
        return (
            Ring(0.21, end - 0.13, 0.13 - end, wide - 0.07),
            Ring(0.46, end, -end, wide - 0.01),
            Ring(self.bonnet, end - 0.08, 0.04 - end, wide),
            Ring(BELT, self.screen[0] + 0.04, self.deck, wide - 0.045),
        )

    @property
    def cabin(self) -> tuple[Ring, ...]:
        """Cross-sections of the cabin, from the windows to the roof."""
        wide = self.width / 2
        front, rear = self.screen[1], self.rear_screen[1]
        return (
            Ring(BELT, self.screen[0], self.rear_screen[0], wide - 0.075),
            Ring(self.roof - 0.05, front, rear, wide - 0.235),
            Ring(self.roof, front - 0.14, rear + 0.12, wide - 0.36),
        )

    @cached_property
    def facets(self) -> Facets:
        """All facets of the car, ordered for a camera above the car."""
        return assemble_facets(list(self._faces()), self._projections)

    def _faces(self) -> Iterator[Face]:
        foot, eaves, top = self.cabin
        yield level_face(
            top.height, (-top.half_width, top.half_width), (top.behind, top.ahead), TOP
        )
        yield from side_faces(eaves, top, (TOP, TOP, TOP))
        yield from side_faces(foot, eaves, (FRONT, REAR, SIDE))
        rings = self.rings
        deck = rings[-1]
        yield level_face(BELT, (-deck.half_width, deck.half_width), (deck.behind, deck.ahead), TOP)
        yield from side_faces(rings[2], rings[3], (TOP, REAR, SIDE), _CUT)
        yield from side_faces(rings[1], rings[2], (FRONT, REAR, SIDE), _CUT)
        yield from side_faces(rings[0], rings[1], (FRONT, REAR, SIDE), _CUT)
        yield from self._wheels()
        end, wide = self.length / 2 + _DARK, self.width / 2 + _DARK
        yield level_face(0.0, (-wide, wide), (-end, end), SHADOW, soft=True)

    def _wheels(self) -> Iterator[Face]:
        outer = self.rings[0].half_width
        inner = outer - 0.2
        angles = np.pi * (0.5 + np.arange(8)) / 4
        for axle in self.axles:
            for side in (-1, 1):
                tread = [(side * inner, 0.0), (side * outer, 0.0), (side * outer, 0.4),
                         (side * inner, 0.4)]  # fmt: skip
                rim = [
                    (side * outer, TYRE * (1 + 1.06 * np.sin(a)), axle + 1.06 * TYRE * np.cos(a))
                    for a in angles
                ]
                yield Face(np.array(rim), np.array([side, 0.0, 0.0]), SIDE)
                yield upright_face(tread, axle + 0.2, True, FRONT)
                yield upright_face(tread, axle - 0.2, False, REAR)

    @property
    def _projections(self) -> Array:
        """Projections of the car to its textures; see `assemble_facets`."""

        def scaled(kind: int, factors: list[list[float]]) -> Array:
            return np.multiply(factors, np.array(SIZES[kind], np.float64)[:, None])

        up = [0, -1 / TALL, 0, 1.0]
        along, across = [0, 0, 0.5 / REACH, 0.5], [0.5 / WIDE, 0, 0, 0.5]
        mirrored = [-0.5 / WIDE, 0, 0, 0.5]
        wide, end = self.width / 2 + _DARK, self.length / 2 + _DARK
        below = [[0.5 / wide, 0, 0, 0.5], [0, 0, 0.5 / end, 0.5]]
        return np.array(
            [
                scaled(SIDE, [along, up]),
                scaled(FRONT, [across, up]),
                scaled(REAR, [mirrored, up]),
                scaled(TOP, [along, across]),
                scaled(SHADOW, below),
            ]
        )


def sample_car_shape(random: Generator) -> CarShape:
    """Sample a saloon, hatchback or estate."""
    kind = ("saloon", "hatchback", "estate")[random.integers(3)]
    length = random.uniform(*{"saloon": (4.25, 4.6), "hatchback": (3.75, 4.1),
                              "estate": (4.3, 4.65)}[kind])  # fmt: skip
    end = length / 2
    foot = end - random.uniform(1.12, 1.26)
    slope = random.uniform(0.68, 0.82)
    if kind == "saloon":
        rear = -end + random.uniform(0.62, 0.74), -end + random.uniform(1.2, 1.34)
    elif kind == "hatchback":
        rear = -end + random.uniform(0.12, 0.16), -end + random.uniform(0.5, 0.66)
    else:
        rear = -end + random.uniform(0.1, 0.14), -end + random.uniform(0.3, 0.4)
    return CarShape(
        length=length,
        width=random.uniform(1.66, 1.76),
        roof=random.uniform(1.39, 1.47),
        bonnet=random.uniform(0.7, 0.76),
        screen=(foot, foot - slope),
        rear_screen=rear,
        deck=-end + 0.07,
        axles=(end - random.uniform(0.78, 0.86), -end + random.uniform(0.76, 0.88)),
    )


_STEP = 2.0**-30  # Sines and cosines are rounded to multiples: all platforms render equal bytes.


@dataclass(frozen=True)
class PerspectiveView:
    """Pose and intrinsic parameters of a camera at one time."""

    focal: float  # focal length [pixels]
    centre: tuple[float, float]  # column and row of the optical axis [pixels]
    place: tuple[float, float, float]  # position of the camera (x, y, z) [metres]
    yaw: float  # horizontal viewing direction [radians]
    pitch: float  # downwards [radians]

    @cached_property
    def turn(self) -> Array:
        """Rotation from the world's axes to the camera's (right, down, ahead), shape (3, 3)."""
        (cos, sin), (level, down) = _direction(self.yaw), _direction(self.pitch)
        return np.array(
            [
                [cos, 0.0, -sin],
                [-sin * down, -level, -cos * down],
                [sin * level, -down, cos * level],
            ]
        )

    @property
    def horizon(self) -> float:
        """Row of the horizon [pixels]."""
        level, down = _direction(self.pitch)
        return self.centre[1] - self.focal * down / level

    def shifted(self, right: int, down: int) -> "PerspectiveView":
        """Return the camera with its optical axis moved right and down in the image [pixels]."""
        return replace(self, centre=(self.centre[0] + right, self.centre[1] + down))

    def seen_from(self, points: ArrayLike) -> Array:
        """Transform points (..., 3) to camera coordinates: right, down, ahead [metres]."""
        offsets = np.asarray(points, np.float64) - self.place
        # The order of the sums is fixed, so that all platforms return equal bits.
        turn = self.turn
        return (
            offsets[..., 0, None] * turn[:, 0]
            + offsets[..., 1, None] * turn[:, 1]
            + offsets[..., 2, None] * turn[:, 2]
        )

    def place_of(self, x: float, z: float) -> tuple[float, float, float]:
        """Return column, row [pixels] and depth [metres] of a ground point; depth can be < 0."""
        x, up, z = x - self.place[0], -self.place[1], z - self.place[2]
        right, down, ahead = (a * x + b * up + c * z for a, b, c in self._rows)
        scale = self.focal / ahead if ahead > 0 else 0.0
        return self.centre[0] + right * scale, self.centre[1] + down * scale, ahead

    @cached_property
    def _rows(self) -> list[list[float]]:
        rows: list[list[float]] = self.turn.tolist()
        return rows

    def project(self, points: ArrayLike) -> Array:
        """Return column, row [pixels] and depth [metres] of points, shape (..., 3)."""
        right, down, ahead = np.moveaxis(self.seen_from(points), -1, 0)
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = self.focal / ahead
            return np.stack(
                [self.centre[0] + right * scale, self.centre[1] + down * scale, ahead], axis=-1
            )


def heading_axes(heading: float) -> Array:
    """Return the rotation from a solid's axes (right, up, ahead) to the world's, shape (3, 3)."""
    cos, sin = _direction(heading)
    return np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])


def _direction(angle: float) -> tuple[float, float]:
    cos, sin = (float(np.round(f(angle) / _STEP) * _STEP) for f in (np.cos, np.sin))
    return cos, sin


NEAREST_SOLID = 0.6  # solids with a corner nearer than this have no extents [metres]
STAINS_SIDE = 512  # side of the texture of stains on the ground [pixels]
STAINS_PERIOD = 16.0  # side of the ground area that this texture covers [metres]
Light = tuple[float, float, float, float]
"""Light on a facet: factors of its unit normal (x, y, z), and a constant; 1 keeps a texture."""

OVERCAST: Light = (-0.05, 0.23, -0.08, 0.8)
_DENSITY = STAINS_SIDE / STAINS_PERIOD * np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def facet_pose(
    view: PerspectiveView,
    facets: Facets,
    place: tuple[float, float, float] = (0, 0, 0),
    heading: float = 0.0,
    light: Light = OVERCAST,
) -> FacetPose:
    """Return the pose of a solid at the position `place` [metres] in a heading [radians]."""
    eye, axes = np.array(view.place), heading_axes(heading)
    sky, origin = np.array(light), np.array(place, float)
    return _pose(view.turn, eye, axes, origin, facets.normals, sky, _DENSITY)


@njit(cache=True)
def _pose(
    view: Array, eye: Array, axes: Array, place: Array, normals: Array, sky: Array, density: Array
) -> FacetPose:
    """Return the pose of a solid at the position `place` for a camera at `eye` [metres].

    `view`, shape (3, 3), rotates the world's axes to the camera's axes. `axes`, shape (3, 3),
    rotates the solid's axes to the world's axes. `normals` are the facet normals in the solid's
    axes. `sky` is described at `Light`. `density`, shape (2, 3), contains the factors that turn a
    world position into column and row of the texture of stains.
    """
    turn, offset, shading = np.zeros((3, 3)), np.zeros(3), np.zeros((2, 4))
    for i in range(3):
        for k in range(3):
            for j in range(3):
                turn[i, j] += view[i, k] * axes[k, j]
            offset[i] += view[i, k] * (place[k] - eye[k])
    for i in range(2):
        for k in range(3):
            for j in range(3):
                shading[i, j] += density[i, k] * view[j, k]
            shading[i, 3] += density[i, k] * eye[k]
    gains = np.empty(len(normals), np.int64)
    for f in range(len(normals)):
        gain = sky[3]
        for k in range(3):
            for j in range(3):
                gain += sky[k] * axes[k, j] * normals[f, j]
        gains[f] = np.int64(np.floor(gain * 256 + 0.5))
    return FacetPose(turn, offset, gains, shading)


@njit(cache=True)
def facet_extents(
    facets: Facets, pose: FacetPose, lens: Lens
) -> tuple[float, float, float, float, float]:
    """Return left, right, top and bottom of a solid in the image, and its minimum depth.

    The first four values are 0 if a corner is nearer than NEAREST_SOLID.
    """
    turn, place = pose.turn, pose.place
    nearest = np.inf
    left, right, top, bottom = np.inf, -np.inf, np.inf, -np.inf
    for f in range(len(facets.counts)):
        for k in range(facets.counts[f]):
            x, y, z = facets.corners[f, k]
            ahead = place[2] + turn[2, 0] * x + turn[2, 1] * y + turn[2, 2] * z
            nearest = min(nearest, ahead)
            if nearest < NEAREST_SOLID:
                return 0.0, 0.0, 0.0, 0.0, nearest
            across = place[0] + turn[0, 0] * x + turn[0, 1] * y + turn[0, 2] * z
            down = place[1] + turn[1, 0] * x + turn[1, 1] * y + turn[1, 2] * z
            column = lens.column + lens.focal * across / ahead
            row = lens.row + lens.focal * down / ahead
            left, right = min(left, column), max(right, column)
            top, bottom = min(top, row), max(bottom, row)
    return left, right, top, bottom, nearest


Window = tuple[int, int, int, int]  # left, top, right, bottom [pixels]; right, bottom are exclusive
NEAREST_DRAWN = 2.0  # minimum depth of drawn objects [metres]


class Drawable(Protocol):
    """Object at a position on the ground."""

    @property
    def x(self) -> float:
        """Position of the centre, to the right [metres]."""
        ...

    @property
    def z(self) -> float:
        """Position of the centre, ahead [metres]."""
        ...

    @property
    def reach(self) -> float:
        """Maximum horizontal distance of a part from the centre [metres]."""
        ...

    def window(self, view: PerspectiveView) -> Window | None:
        """Return a window around the object, also outside the image; None behind the camera."""
        ...

    def draw(self, canvas: NDArray[np.uint8], view: PerspectiveView) -> None:
        """Draw the object over a canvas in place."""
        ...


def sort_from_far(things: list[Drawable], view: PerspectiveView, width: int) -> list[Drawable]:
    """Return the objects that may be visible in an image of `width` pixels, farthest first."""
    x, z, reach = np.array([(thing.x, thing.z, thing.reach) for thing in things]).T
    right, _, ahead = view.seen_from(np.stack([x, np.zeros(len(x)), z], axis=1)).T
    # `edge` is the tangent of half the field of view.
    edge = width / 2 / view.focal
    may_be_visible = (ahead > -reach) & (np.abs(right) < edge * (ahead + reach) + 1.2 * reach)
    squared_distances = right * right + ahead * ahead
    return [things[i] for i in np.argsort(-squared_distances, kind="stable") if may_be_visible[i]]


def windows_meet(first_window: Window, second_window: Window) -> bool:
    """Return whether two windows overlap."""
    return (
        first_window[0] < second_window[2]
        and second_window[0] < first_window[2]
        and first_window[1] < second_window[3]
        and second_window[1] < first_window[3]
    )


METRE = 40.0  # scale of the images of cutouts [pixels/metre]


@dataclass(frozen=True)
class Cutout:
    """Image of an object with a transparent background."""

    sprite: Sprite
    foot: float  # row of its base [pixels]


@dataclass(frozen=True)
class UprightCutout:
    """Upright image at a position, always facing the camera; implements `Drawable`."""

    cutout: Cutout
    x: float  # to the right [metres]
    z: float  # ahead [metres]
    size: float = 1.0  # size relative to the image

    @property
    def reach(self) -> float:
        return float(self.cutout.sprite.width / 2 * self.size / METRE)

    def window(self, view: PerspectiveView) -> Window | None:
        column, row, depth = view.place_of(self.x, self.z)
        if depth < NEAREST_DRAWN:
            return None
        scale = view.focal / depth * self.size / METRE
        half, top = self.cutout.sprite.width / 2 * scale, row - self.cutout.foot * scale
        return (
            math.floor(column - half) - 1,
            math.floor(top) - 1,
            math.ceil(column + half) + 1,
            math.ceil(top + self.cutout.sprite.height * scale) + 1,
        )

    def draw(self, canvas: NDArray[np.uint8], view: PerspectiveView) -> None:
        column, row, depth = view.place_of(self.x, self.z)
        if depth >= NEAREST_DRAWN:
            scale = view.focal / depth * self.size / METRE
            rise = (self.cutout.foot - self.cutout.sprite.height / 2) * scale
            self.cutout.sprite.draw(canvas, np.array([[column, row - rise]]), scale)


def paint_cutout(
    make: Callable[[Generator, float, float, float], Prop], random: Generator
) -> Cutout:
    """Return an image of a street object, painted with METRE pixels per metre."""
    prop = make(random, 0.0, 1.0, METRE)
    _, top, alpha = prop.coverage(Viewpoint(METRE, 0.0, 0.0, 0.0))
    height, width = alpha.shape
    black = np.zeros((height, width, 3), np.uint8)
    prop.draw(black, Viewpoint(METRE, 0.0, horizon=-top, centre=width / 2))
    cover = alpha / 255
    colour = black / np.maximum(cover, 1 / 255)[..., None]
    return Cutout(Sprite(colour, cover), float(-top))
