"""Surface finishes: colours, patterns and gloss, and their shading under light."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

import cv2
import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.interface import Array
from trackmark.datasets.synthetic.render.solids import NOTHING, ParallelView, cast_rays
from trackmark.datasets.synthetic.render.texture import fractal, lerp

Pattern: TypeAlias = Callable[[Array], Array]

GAMMA = 2.2  # exponent that converts the camera's grey levels to linear light


def uniform(places: Array) -> Array:
    """Return a gain of 1 for all points: a surface without pattern."""
    return np.ones((len(places), 1))


@dataclass(frozen=True)
class Finish:
    """Colour, gloss and pattern of a surface."""

    colour: ArrayLike  # (3,), colour in full light, BGR in [0, 255]
    gloss: float = 0.0  # fraction of a lamp's light that the surface mirrors
    # maps points, shape (k, 3) [pixels], to gains of the colour, shape (k, 1) or (k, 3)
    pattern: Pattern = uniform


@dataclass(frozen=True)
class SceneObject:
    """Solids (see `solids`) with one finish."""

    finish: Finish
    solids: list[Array] = field(default_factory=list)


def shade_objects(
    finishes: Sequence[Finish], owners: NDArray[np.int64], places: Array, lights: Array
) -> NDArray[np.uint8]:
    """Return a `cast_rays` result as an image, shape (h, w, 4): BGR, and 255 on objects."""
    picture = np.zeros((*owners.shape, 4), np.uint8)
    for k, finish in enumerate(finishes):
        covered = owners == k
        bright, shine = np.split(lights[covered], 2, axis=1)
        surface = np.asarray(finish.colour, np.float64) * finish.pattern(places[covered])
        light = np.clip(surface / 255, 0, 1) ** GAMMA * bright + finish.gloss * shine
        picture[covered, :3] = np.round(255 * np.clip(light, 0, 1) ** (1 / GAMMA))
        picture[covered, 3] = 255
    return picture


def grain(
    random: Generator,
    strength: float,
    stretch: tuple[float, float, float] = (1.0, 1.0, 1.0),
    coarsest: int = 8,
) -> Pattern:
    """Return a pattern of uneven brightness; along axes with a small `stretch` it varies slowly."""
    texture = fractal(random, 256, coarsest, 128, 0.75)
    weights = np.array(stretch) * 2.0

    def gain(places: Array) -> Array:
        along = places * weights
        row = np.round(along[:, 1] + along[:, 2]).astype(np.int64) % 256
        column = np.round(along[:, 0]).astype(np.int64) % 256
        return np.asarray(1 + strength * texture[row, column])[:, None]

    return gain


def tiles(random: Generator, width: float, height: float, joint: ArrayLike) -> Pattern:
    """Return a pattern of wall tiles; `joint` is the gain of the joints, shape (3,)."""
    tones = random.normal(1, 0.025, (64, 64))
    shift = random.uniform(0, 64, 2)
    bond = 0.5 * random.integers(2)

    def gain(places: Array) -> Array:
        row = places[:, 1] / height + shift[1]
        column = places[:, 0] / width + shift[0] + bond * (np.floor(row) % 2)
        tone = tones[np.floor(row).astype(np.int64) % 64, np.floor(column).astype(np.int64) % 64]
        within = [np.abs(u - np.floor(u) - 0.5) * s for u, s in ((column, width), (row, height))]
        rim = np.minimum(width / 2 - within[0], height / 2 - within[1])
        flat = np.repeat(tone[:, None], 3, axis=1)
        return lerp(np.asarray(joint, np.float64), flat, np.clip(rim / 0.35 - 0.6, 0, 1))

    return gain


def picture_on(
    picture: NDArray[np.generic], middle: tuple[float, float], half: ArrayLike, lean: float = 0.0
) -> Pattern:
    """Return a picture in [0, 255] as the pattern of an upright face.

    `middle` is the centre of the face and `half` its half width and height [pixels]. The face leans
    back by `lean` [radians]. Beyond a border of the picture, the colours at this border
    continue.
    """
    (x, y), (wide, high) = middle, np.asarray(half).tolist()

    def gain(places: Array) -> Array:
        u = ((places[:, 0] - x) / wide + 1) / 2 * picture.shape[1]
        v = (1 - (places[:, 1] / np.cos(lean) - y) / high) / 2 * picture.shape[0]
        column = np.clip(u.astype(np.int64), 0, picture.shape[1] - 1)
        row = np.clip(v.astype(np.int64), 0, picture.shape[0] - 1)
        return np.asarray(picture[row, column] / 255.0)

    return gain


def staggered(places: Array, pitch: float) -> tuple[Array, Array]:
    """Return positions within cells, in [-0.5, 0.5]; every other row is shifted by half a cell."""
    row = np.floor(places[:, 1] / pitch)
    y = places[:, 1] / pitch - row - 0.5
    x = places[:, 0] / pitch + 0.5 * (row % 2)
    return x - np.floor(x) - 0.5, y


PITCH = 0.27  # downward angle of the camera [radians]

# A sample is an edge if the slopes on its two sides differ more than this [pixels/sample]
EDGE = 0.5

BEYOND = 1e9  # placeholder for the depth difference to another object [pixels]

VIEW = ParallelView(PITCH, (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class SurfaceBuffer:
    """Properties of the visible surface at every sample."""

    owners: NDArray[np.int64]  # (h, w), index of the visible object or `NOTHING`
    colour: Array  # (h, w, 3), reflected fraction of the light, BGR; 0 if there is no object
    normal: Array  # (h, w, 3), outward normal: right, down, towards the camera
    depth: Array  # (h, w), depth relative to the origin, positive towards the camera [pixels]
    gloss: Array  # (h, w), fraction of a lamp's light that is mirrored; 0 if there is no object

    def reduced(self, fine: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return block means of colour with coverage, and of normal with gloss.

        Blocks have `fine` x `fine` samples, so the two shapes are (h // fine, w // fine, 4). Both
        results are premultiplied by the coverage.
        """
        covered = (self.owners != NOTHING)[..., None]
        sheets = (self.colour, covered), (self.normal * covered, self.gloss[..., None])
        size = self.owners.shape[1] // fine, self.owners.shape[0] // fine
        colour, normal = (
            np.asarray(
                cv2.resize(np.concatenate(parts, axis=2), size, interpolation=cv2.INTER_AREA),
                np.float32,
            )
            for parts in sheets
        )
        return colour, normal


def render_surfaces(
    things: Sequence[SceneObject], corner: tuple[float, float], size: tuple[int, int], fine: int
) -> SurfaceBuffer:
    """Render objects without light; parameters as in `solids.cast_rays`."""
    solids = [thing.solids for thing in things]
    owners, places, _ = cast_rays(solids, VIEW, corner, size, fine, shaded=False)
    colour, gloss = np.zeros((*owners.shape, 3)), np.zeros(owners.shape)
    for k, thing in enumerate(things):
        covered = owners == k
        shade_objects = np.asarray(thing.finish.colour) * thing.finish.pattern(places[covered])
        colour[covered] = np.clip(shade_objects / 255, 0, 1) ** GAMMA
        gloss[covered] = thing.finish.gloss
    depth = places[..., 1] * np.sin(PITCH) + places[..., 2] * np.cos(PITCH)
    return SurfaceBuffer(owners, colour, _normals(owners, depth, 1 / fine), depth, gloss)


def _normals(owners: NDArray[np.int64], depth: Array, step: float) -> Array:
    """Return normals from the slopes of the depth; at an edge, the smaller slope is used."""
    slopes = [_slope(owners, depth, axis) / step for axis in (1, 0)]
    normal = np.stack([-slopes[0], -slopes[1], np.ones(depth.shape)], axis=2)
    return np.asarray(normal / np.sqrt((normal * normal).sum(axis=2, keepdims=True)))


def _slope(owners: NDArray[np.int64], depth: Array, axis: int) -> Array:
    """Return the slope of the depth: the mean of both sides of a sample, except at edges."""
    rise = np.diff(depth, axis=axis)
    rise[np.diff(owners, axis=axis) != 0] = BEYOND
    end = np.full_like(np.take(depth, [0], axis=axis), BEYOND)
    before, after = (np.concatenate(p, axis=axis) for p in ([end, rise], [rise, end]))
    gentler = np.where(np.abs(before) < np.abs(after), before, after)
    smooth = np.abs(before - after) < EDGE
    return np.where(smooth, (before + after) / 2, gentler) * (np.abs(gentler) < BEYOND)
