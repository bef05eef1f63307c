"""What is behind the ellipse: a smooth texture, shapes of all colours over it, the patches."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.interface import Image
from trackmark.datasets.synthetic.moreno2005.ellipse.plan import COLOURS, FRAMES, SIZE, Plan
from trackmark.datasets.synthetic.render.texture import fractal, ramp
from trackmark.datasets.synthetic.scene import part_generator

Array = NDArray[np.float64]

# Samples of a painting per pixel and axis; odd, so that the middle one is the pixel's centre.
FINE = 3
SUBPIXEL = 4  # binary digits by which OpenCV places outlines between samples

FIRST = 10  # frame from which on patches are met: the ellipse was seen without them
MEETINGS = 3  # one in each third of the frames from then on
PATCH_RADIUS = 10.0, 18.0  # of patches [pixels]
# How far a patch's middle is beyond the ellipse's outline when they meet, in its own radii.
SHOWN = 0.2, 0.7
ASIDE = 8.0, 26.0  # how far the one that is not met is from the ellipse's outline [pixels]
SIMILAR = 0.15  # greatest distance between similar colours, in RGB of [0, 1]
ADJOINING = 8  # least number of pixels of a patch beside the ellipse's where one touches the other

TONES = 7  # colours of the texture behind the shapes
SHAPES, ALIKE = 400, 0.8  # number of shapes; share in a colour that the ellipse has at some time
SHAPE_RADIUS = 5.0, 18.0  # of shapes; the smaller, the more of them [pixels]
MOTTLE = 0.06  # standard deviation of a shape's texture, of its colour
SLANT = 0.14  # how much lighter a shape is at most at one end than at the other, of its colour
SHADOW = 0.45  # what a shape takes at most of the light around it
THICK = 2.2  # about how far its shadow reaches [pixels]
TILE = 1024  # side of the textures [samples]; more than the picture has


def samples(outline: Array) -> NDArray[np.bool_]:
    """Which samples a closed outline (k, 2) [pixels] surrounds: (height * FINE, width * FINE)."""
    canvas = np.zeros((SIZE[1] * FINE, SIZE[0] * FINE), np.uint8)
    points = np.round((outline * FINE - 0.5) * (1 << SUBPIXEL)).astype(np.int32)
    cv2.fillPoly(canvas, [points], 1, shift=SUBPIXEL)
    return canvas.astype(np.bool_)


def drawn_shape(random: np.random.Generator, centre: Array, radius: float) -> Array:
    """Outline of a shape of any kind around a place (2,), as large as a circle [pixels]."""
    kinds = _box, _polygon, _oval, _blob
    points = kinds[random.integers(len(kinds))](random)
    stretch = np.exp(random.uniform(-0.4, 0.4))
    angle = random.uniform(0, 2 * np.pi)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return np.asarray(centre + radius * (points * (stretch, 1 / stretch)) @ turn)


def _box(random: np.random.Generator) -> Array:
    return 0.9 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def _polygon(random: np.random.Generator) -> Array:
    corners = int(random.integers(3, 7))
    angles = (np.arange(corners) + random.uniform(-0.3, 0.3, corners)) * (2 * np.pi / corners)
    return 1.15 * random.uniform(0.8, 1.2, (corners, 1)) * _directions(angles)


def _oval(random: np.random.Generator) -> Array:
    return _directions(np.linspace(0, 2 * np.pi, 64, endpoint=False))


def _blob(random: np.random.Generator) -> Array:
    angles = np.linspace(0, 2 * np.pi, 96, endpoint=False)
    waves = [
        random.uniform(0, 0.4 / k) * np.sin(k * angles + random.uniform(0, 2 * np.pi))
        for k in range(2, 6)
    ]
    radii: Array = 1 + np.sum(waves, axis=0)
    return radii[:, None] * _directions(angles)


def _directions(angles: Array) -> Array:
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)


@dataclass(frozen=True)
class Patch:
    """Something of the colour that the ellipse has at one time."""

    outline: Array  # (k, 2) [pixels]
    colour: Array  # (3,): RGB in [0, 1]


def drawn_patches(seed: int, plan: Plan) -> list[Patch]:
    """Draw pairs of patches of the ellipse's colour in a frame, near its place in that frame.

    One patch of each pair touches the ellipse, the other is beside it.
    """
    random = part_generator(seed, "moreno2005/ellipse patches")
    bounds = np.linspace(FIRST, FRAMES, MEETINGS + 1).astype(int).tolist()
    patches = []
    for first, end in pairwise(bounds):
        frame = int(random.integers(first, end))
        for met in (False, True):
            radius, direction = random.uniform(*PATCH_RADIUS), random.uniform(0, 2 * np.pi)
            beyond = radius * random.uniform(*SHOWN) if met else radius + random.uniform(*ASIDE)
            towards = np.array([np.cos(direction), np.sin(direction)])
            middle = plan.centre[frame] + (plan.reach(frame, direction) + beyond) * towards
            patches.append(Patch(drawn_shape(random, middle, radius), plan.colour[frame]))
    return patches


def touched(patches: Sequence[Patch], plan: Plan) -> NDArray[np.bool_]:
    """In which frames the ellipse touches a patch of about the colour that it has then.

    A patch that is hidden, by the ellipse or by another patch, does not count where it is.
    """
    topmost = np.full((SIZE[1], SIZE[0]), -1)
    for number, patch in enumerate(patches):
        topmost[samples(patch.outline)[FINE // 2 :: FINE, FINE // 2 :: FINE]] = number
    colours = np.stack([patch.colour for patch in patches])
    found = np.zeros(FRAMES, np.bool_)
    for frame in range(FRAMES):
        inside = plan.covers(frame)
        grown = cv2.dilate(inside.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
        beside = topmost[grown & ~inside]
        counts = np.bincount(beside[beside >= 0], minlength=len(patches))
        alike = np.linalg.norm(colours - plan.colour[frame], axis=1) <= SIMILAR
        found[frame] = (counts[alike] >= ADJOINING).any()
    return found


def painted(seed: int, plan: Plan, patches: Sequence[Patch]) -> Image:
    """Paint the background, BGR, with the patches on top."""
    random = part_generator(seed, "moreno2005/ellipse clutter")
    rows, columns = SIZE[1] * FINE, SIZE[0] * FINE
    smooth = fractal(random, TILE, 4, 256, 0.6)[:rows, :columns]
    canvas = ramp(smooth, random.uniform(*COLOURS, (TONES, 3)))
    mottle = MOTTLE * fractal(random, TILE, 32, 512, 0.8)
    for _ in range(SHAPES):
        middle = random.uniform((0, 0), SIZE)
        radius = SHAPE_RADIUS[0] + (SHAPE_RADIUS[1] - SHAPE_RADIUS[0]) * random.random() ** 2
        outline = drawn_shape(random, middle, radius)
        alike, frame = random.random() < ALIKE, int(random.integers(FRAMES))
        colour = plan.colour[frame] if alike else random.uniform(*COLOURS, 3)
        _lay(random, canvas, mottle, outline, colour)
    for patch in patches:
        _lay(random, canvas, mottle, patch.outline, patch.colour)
    reduced = cv2.resize(np.clip(canvas, 0, 1), SIZE, interpolation=cv2.INTER_AREA)
    return np.ascontiguousarray(np.round(255 * np.asarray(reduced)[..., ::-1]).astype(np.uint8))


def _lay(
    random: np.random.Generator, canvas: Array, mottle: Array, outline: Array, colour: Array
) -> None:
    """Lay a shape over a canvas of samples, with its shadow; the canvas is changed in place."""
    rows, columns = _window(outline)
    window = canvas[rows, columns]
    if not window.size:  # it lies beside the picture
        return
    corner = np.array([columns.start, rows.start])
    covered = np.zeros(window.shape[:2], np.uint8)
    points = np.round((outline * FINE - 0.5 - corner) * (1 << SUBPIXEL)).astype(np.int32)
    cv2.fillPoly(covered, [points], 1, shift=SUBPIXEL)
    reach = 2 * round(THICK * FINE) + 1
    soft = cv2.blur(covered.astype(np.float64), (reach, reach))
    window *= 1 - SHADOW * np.asarray(soft)[..., None]
    y, x = np.nonzero(covered)
    direction, slant = random.uniform(0, 2 * np.pi), SLANT * random.random()
    along = (x * np.cos(direction) + y * np.sin(direction)) / (FINE * 2 * SHAPE_RADIUS[1])
    lighter = slant * (along - along.mean()) if len(along) else along
    shift = random.integers(TILE, size=2)
    texture = mottle[(y + shift[0]) % TILE, (x + shift[1]) % TILE]
    window[y, x] = colour * (1 + lighter + texture)[:, None]


def _window(outline: Array) -> tuple[slice, slice]:
    """Rows and columns of samples that a shape's shadow may reach."""
    margin = THICK + 2
    low = np.maximum(np.floor((outline.min(axis=0) - margin) * FINE), 0).astype(int)
    high = np.maximum(np.ceil((outline.max(axis=0) + margin) * FINE), 0).astype(int)
    return slice(int(low[1]), int(high[1])), slice(int(low[0]), int(high[0]))
