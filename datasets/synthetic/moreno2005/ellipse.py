"""`moreno2005/ellipse`: an ellipse with random changes in front of clutter.

The paper shows "a synthetically generated sequence of an ellipse that changes randomly its
position, color and shape in a cluttered background". It is tracked "even when the background has a
similar color to the target (observe the frame before last)". All other properties are our choice.
Shape and colour make a random step in every frame. The speed is limited to two standard deviations
of the displacement that the paper's trackers assume. The ellipse touches a background patch of its
colour three times. Many other background shapes have a colour that the ellipse has at another time.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import cv2
import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from trackmark.datasets.interface import Array, Image, Mask
from trackmark.datasets.synthetic.parameters import SceneParameters
from trackmark.datasets.synthetic.render.camera import Camera
from trackmark.datasets.synthetic.render.path import quantised
from trackmark.datasets.synthetic.render.texture import fractal, ramp
from trackmark.datasets.synthetic.scene import SceneTruth, SeededScene, part_generator

FRAMES = 100
SIZE = 320, 240
BORDER = 38.0  # minimum distance of the centre from the image border [pixels]
HALF_AXES = 11.0, 34.0  # minimum and maximum [pixels]
KEPT = 0.85  # coefficient of the autoregressive process of the velocity
NEW_SPEED = 1.8  # standard deviation of each component of the velocity noise [pixels/frame]
# maximum speed [pixels/frame]: two standard deviations of the shift that trackers assume
FASTEST = 6.9
# Standard deviation of the independent steps of the logarithm of each half axis, and of the angle
# [radians]. Trackers assume .03 for stretches and .05 for shears. Earlier tests on other scenes
# showed that trackers can follow steps of .03 (mean overlap .86).
NEW = 0.03
STEP = 0.05  # mean step of the colour per frame, in RGB of [0, 1]
# standard deviation of the noise that is added to the unit direction of the colour path
TURN = 0.45
COLOURS = 0.08, 0.92  # minimum and maximum of every channel


@dataclass(frozen=True)
class EllipsePlan:
    """Position, shape and colour of the ellipse in every frame."""

    centre: Array  # (FRAMES, 2): in the image, (x, y) [pixels]
    half_axes: Array  # (FRAMES, 2): [pixels]
    angle: Array  # (FRAMES,): of the first half axis, from x towards y [radians]
    colour: Array  # (FRAMES, 3): RGB in [0, 1]

    @cached_property
    def boxes(self) -> Array:
        """Extents, shape (FRAMES, 4): x, y, width, height [pixels]."""
        directions = np.stack([np.cos(self.angle), np.sin(self.angle)], axis=1)
        across = directions[:, ::-1]
        first, second = np.split(self.half_axes, 2, axis=1)
        half = np.sqrt((first * directions) ** 2 + (second * across) ** 2)
        return np.hstack([self.centre - half, 2 * half])

    def inwards(self, frame: int, points: Array) -> Array:
        """Map image points (..., 2) to coordinates in which the ellipse is the unit circle."""
        cosine, sine = np.cos(self.angle[frame]), np.sin(self.angle[frame])
        turn = np.array([[cosine, -sine], [sine, cosine]])
        return np.asarray((points - self.centre[frame]) @ turn / self.half_axes[frame])

    def around(self, frame: int) -> tuple[tuple[slice, slice], Array]:
        """Return a window around the ellipse, and its pixel centres transformed by `inwards`."""
        x, y, width, height = self.boxes[frame]
        left, top = int(x) - 1, int(y) - 1
        right, bottom = int(x + width) + 2, int(y + height) + 2
        rows, columns = np.mgrid[top:bottom, left:right] + 0.5
        window = slice(top, bottom), slice(left, right)
        return window, self.inwards(frame, np.stack([columns, rows], axis=2))

    def covers(self, frame: int) -> Mask:
        """Return the pixels whose centres lie within the ellipse, shape (height, width)."""
        window, inwards = self.around(frame)
        covered = np.zeros(SIZE[::-1], np.bool_)
        covered[window] = (inwards * inwards).sum(axis=2) <= 1
        return covered

    def reach(self, frame: int, direction: float) -> float:
        """Return the radius [pixels] in a `direction`, from x towards y [radians]."""
        towards = np.array([np.cos(direction), np.sin(direction)])
        return float(1 / np.linalg.norm(self.inwards(frame, self.centre[frame] + towards)))


def sample_plan(seed: int) -> EllipsePlan:
    """Sample trajectory, shape and colour."""
    path, shape, colour = (
        part_generator(seed, f"moreno2005/ellipse {part}") for part in ("way", "shape", "colour")
    )
    far = np.array(SIZE) - BORDER
    least, greatest = (np.full(2, np.log(half)) for half in HALF_AXES)
    turn = np.array([4 * np.pi])
    half_axes = np.exp(_random_walk(shape, least, greatest))
    angle = _random_walk(shape, -turn, turn)[:, 0]
    centre = quantised(_trajectory(path, np.full(2, BORDER), far))
    return EllipsePlan(centre, quantised(half_axes), angle, _colour_path(colour))


def _trajectory(random: Generator, low: Array, high: Array) -> Array:
    """Sample a path, shape (FRAMES, 2), with an autoregressive velocity, reflected at bounds."""
    place = random.uniform(low, high)
    rate = random.normal(0, NEW_SPEED / np.sqrt(1 - KEPT * KEPT), low.shape)
    places = np.empty((FRAMES, *low.shape))
    for frame in range(FRAMES):
        places[frame] = place
        rate = KEPT * rate + random.normal(0, NEW_SPEED, low.shape)
        rate *= min(1.0, FASTEST / float(np.linalg.norm(rate)))
        place, rate = _reflect(place + rate, rate, low, high)
    return places


def _random_walk(random: Generator, low: Array, high: Array) -> Array:
    """Sample a random walk, shape (FRAMES, k), with independent steps, reflected at bounds (k,)."""
    places = [random.uniform(low, high)]
    for step in random.normal(0, NEW, (FRAMES - 1, *low.shape)):
        places.append(_reflect(places[-1] + step, step, low, high)[0])
    return np.array(places)


def _colour_path(random: Generator) -> Array:
    """Sample a curved path through RGB space at nearly constant speed, shape (FRAMES, 3)."""
    low, high = (np.full(3, level) for level in COLOURS)
    place, heading = random.uniform(low, high), _unit(random.normal(size=3))
    places = np.empty((FRAMES, 3))
    for frame in range(FRAMES):
        places[frame] = place
        heading = _unit(heading + TURN * random.normal(size=3))
        step = STEP * random.uniform(0.5, 1.5)
        place, heading = _reflect(place + step * heading, heading, low, high)
    return places


def _reflect(place: Array, rate: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """Reflect a position that lies beyond a bound, and reverse its velocity."""
    beyond = (place < low) | (place > high)
    bound = np.clip(place, low, high)
    return 2 * bound - place, np.where(beyond, -rate, rate)


def _unit(vector: Array) -> Array:
    return np.asarray(vector / np.linalg.norm(vector))


# Samples of a painting per pixel and axis. The number is odd, so the middle sample is the pixel's
# centre.
FINE = 3
SUBPIXEL = 4  # fractional bits of the outline positions that OpenCV draws

# first frame in which the ellipse can touch a patch; before it, trackers learn the ellipse
FIRST = 10
MEETINGS = 3  # number of touched patches: one in each third of the frames after `FIRST`
PATCH_RADIUS = 10.0, 18.0  # range of the radii of patches [pixels]
# distance of a touched patch's centre from the ellipse's outline [radii of the patch]
SHOWN = 0.2, 0.7
ASIDE = 8.0, 26.0  # distance of an untouched patch from the ellipse's outline [pixels]
SIMILAR = 0.15  # maximum distance between similar colours, in RGB of [0, 1]
ADJOINING = 8  # minimum number of common border pixels of the ellipse and a patch that touches it

TONES = 7  # colours of the texture behind the shapes
SHAPES = 400  # number of shapes
SIMILAR_SHARE = 0.8  # fraction of shapes with a colour that the ellipse has at some time
SHAPE_RADIUS = 5.0, 18.0  # range of the radii of shapes [pixels]; small shapes are more frequent
MOTTLE = 0.06  # standard deviation of a shape's texture, relative to its colour
SHAPE_SLANT = 0.14  # maximum difference of brightness between the ends of a shape
SHADOW = 0.45  # maximum fraction of light that the shadow of a shape removes
THICK = 2.2  # approximate width of a shape's shadow [pixels]
TILE = 1024  # side of the textures [samples]; larger than the image


def covered_samples(outline: Array) -> NDArray[np.bool_]:
    """Return the mask (height * FINE, width * FINE) of samples in an outline (k, 2) [pixels]."""
    canvas = np.zeros((SIZE[1] * FINE, SIZE[0] * FINE), np.uint8)
    points = np.round((outline * FINE - 0.5) * (1 << SUBPIXEL)).astype(np.int32)
    cv2.fillPoly(canvas, [points], 1, shift=SUBPIXEL)
    return canvas.astype(np.bool_)


def sample_outline(random: Generator, centre: Array, radius: float) -> Array:
    """Sample the outline of a random shape with the area of a circle around a point [pixels]."""
    kinds = _box, _polygon, _oval, _blob
    points = kinds[random.integers(len(kinds))](random)
    stretch = np.exp(random.uniform(-0.4, 0.4))
    angle = random.uniform(0, 2 * np.pi)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return np.asarray(centre + radius * (points * (stretch, 1 / stretch)) @ turn)


def _box(random: Generator) -> Array:
    return 0.9 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def _polygon(random: Generator) -> Array:
    corners = int(random.integers(3, 7))
    angles = (np.arange(corners) + random.uniform(-0.3, 0.3, corners)) * (2 * np.pi / corners)
    return 1.15 * random.uniform(0.8, 1.2, (corners, 1)) * _directions(angles)


def _oval(random: Generator) -> Array:
    return _directions(np.linspace(0, 2 * np.pi, 64, endpoint=False))


def _blob(random: Generator) -> Array:
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
class EllipsePatch:
    """Background patch with the colour that the ellipse has at one time."""

    outline: Array  # (k, 2) [pixels]
    colour: Array  # (3,): RGB in [0, 1]


def sample_patches(seed: int, plan: EllipsePlan) -> list[EllipsePatch]:
    """Sample pairs of background patches with the colour that the ellipse has in one frame.

    In this frame, one patch lies at some distance from the ellipse; the other patch touches it.
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
            patches.append(EllipsePatch(sample_outline(random, middle, radius), plan.colour[frame]))
    return patches


def similar_patch_frames(patches: Sequence[EllipsePatch], plan: EllipsePlan) -> NDArray[np.bool_]:
    """Return for every frame whether the ellipse touches a patch of a similar colour.

    Parts of a patch that the ellipse or another patch occludes do not count.
    """
    topmost = np.full((SIZE[1], SIZE[0]), -1)
    for number, patch in enumerate(patches):
        topmost[covered_samples(patch.outline)[FINE // 2 :: FINE, FINE // 2 :: FINE]] = number
    colours = np.stack([patch.colour for patch in patches])
    touching = np.zeros(FRAMES, np.bool_)
    for frame in range(FRAMES):
        inside = plan.covers(frame)
        grown = cv2.dilate(inside.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
        neighbours = topmost[grown & ~inside]
        counts = np.bincount(neighbours[neighbours >= 0], minlength=len(patches))
        similar = np.linalg.norm(colours - plan.colour[frame], axis=1) <= SIMILAR
        touching[frame] = (counts[similar] >= ADJOINING).any()
    return touching


def paint_background(seed: int, plan: EllipsePlan, patches: Sequence[EllipsePatch]) -> Image:
    """Return the background, BGR, with the patches on top."""
    random = part_generator(seed, "moreno2005/ellipse clutter")
    rows, columns = SIZE[1] * FINE, SIZE[0] * FINE
    smooth = fractal(random, TILE, 4, 256, 0.6)[:rows, :columns]
    canvas = ramp(smooth, random.uniform(*COLOURS, (TONES, 3)))
    mottle = MOTTLE * fractal(random, TILE, 32, 512, 0.8)
    for _ in range(SHAPES):
        middle = random.uniform((0, 0), SIZE)
        radius = SHAPE_RADIUS[0] + (SHAPE_RADIUS[1] - SHAPE_RADIUS[0]) * random.random() ** 2
        outline = sample_outline(random, middle, radius)
        similar, frame = random.random() < SIMILAR_SHARE, int(random.integers(FRAMES))
        colour = plan.colour[frame] if similar else random.uniform(*COLOURS, 3)
        _paint_shape(random, canvas, mottle, outline, colour)
    for patch in patches:
        _paint_shape(random, canvas, mottle, patch.outline, patch.colour)
    reduced = cv2.resize(np.clip(canvas, 0, 1), SIZE, interpolation=cv2.INTER_AREA)
    return np.ascontiguousarray(np.round(255 * np.asarray(reduced)[..., ::-1]).astype(np.uint8))


def _paint_shape(
    random: Generator, canvas: Array, mottle: Array, outline: Array, colour: Array
) -> None:
    """Paint a shape with its shadow over a canvas in place; the canvas has `FINE` resolution."""
    rows, columns = _window(outline)
    window = canvas[rows, columns]
    if not window.size:  # The shape lies outside the image.
        return
    corner = np.array([columns.start, rows.start])
    covered = np.zeros(window.shape[:2], np.uint8)
    points = np.round((outline * FINE - 0.5 - corner) * (1 << SUBPIXEL)).astype(np.int32)
    cv2.fillPoly(covered, [points], 1, shift=SUBPIXEL)
    reach = 2 * round(THICK * FINE) + 1
    soft = cv2.blur(covered.astype(np.float64), (reach, reach))
    window *= 1 - SHADOW * np.asarray(soft)[..., None]
    y, x = np.nonzero(covered)
    direction, slant = random.uniform(0, 2 * np.pi), SHAPE_SLANT * random.random()
    along = (x * np.cos(direction) + y * np.sin(direction)) / (FINE * 2 * SHAPE_RADIUS[1])
    lighter = slant * (along - along.mean()) if len(along) else along
    shift = random.integers(TILE, size=2)
    texture = mottle[(y + shift[0]) % TILE, (x + shift[1]) % TILE]
    window[y, x] = colour * (1 + lighter + texture)[:, None]


def _window(outline: Array) -> tuple[slice, slice]:
    """Return rows and columns of the samples that the shadow of a shape may cover."""
    margin = THICK + 2
    low = np.maximum(np.floor((outline.min(axis=0) - margin) * FINE), 0).astype(int)
    high = np.maximum(np.ceil((outline.max(axis=0) + margin) * FINE), 0).astype(int)
    return slice(int(low[1]), int(high[1])), slice(int(low[0]), int(high[0]))


CAMERA = Camera(SIZE, noise=5.0, fall=(0, 0))
# brightness of the ellipse in ambient light, and the increase by direct light
SHADING = 0.78, 0.34
LIGHT_SLANT = 0.9  # angle between the direct light and the line of sight [radians]


class EllipseScene(SeededScene):
    """Scene of an ellipse in front of clutter."""

    label, length, size = "moreno2005/ellipse", FRAMES, SIZE

    def __init__(self, parameters: SceneParameters) -> None:
        super().__init__(parameters)
        self.plan = sample_plan(self._seed)
        self.patches = sample_patches(self._seed, self.plan)

    def truth(self) -> SceneTruth:
        """Return the ground truth of all frames.

        The attribute `similar patch` means that the ellipse touches a patch whose colour is similar
        to the current colour of the ellipse.
        """
        touching = similar_patch_frames(self.patches, self.plan)
        return SceneTruth(self.plan.boxes, np.ones(FRAMES), {"similar patch": touching})

    def render(self, frame: int) -> Image:
        canvas = self._backdrop.copy()
        self._lay_ellipse(canvas, frame)
        return CAMERA.exposed(canvas, self._seed, frame)

    def mask(self, frame: int) -> Mask:
        return self.plan.covers(frame)

    def _lay_ellipse(self, canvas: Image, frame: int) -> None:
        window, inwards = self.plan.around(frame)
        square = (inwards * inwards).sum(axis=2)
        # Distance to the outline along the gradient, a first-order approximation.
        slope = 2 * np.linalg.norm(inwards / self.plan.half_axes[frame], axis=2)
        coverage = np.clip(0.5 + (1 - square) / np.maximum(slope, 1e-9), 0, 1)[..., None]
        rise = np.sqrt(np.maximum(1 - square, 0))
        turned = self._light_angle - self.plan.angle[frame]
        along = inwards @ np.array([np.cos(turned), np.sin(turned)])
        straight = np.maximum(np.cos(LIGHT_SLANT) * rise + np.sin(LIGHT_SLANT) * along, 0)
        shading = (SHADING[0] + SHADING[1] * straight)[..., None]
        colour = 255 * np.minimum(self.plan.colour[frame, ::-1] * shading, 1)
        under = canvas[window]
        canvas[window] = np.round(under + coverage * (colour - under)).astype(np.uint8)

    @cached_property
    def _backdrop(self) -> Image:
        return paint_background(self._seed, self.plan, self.patches)

    @cached_property
    def _light_angle(self) -> float:
        return float(self._random("shading").uniform(0, 2 * np.pi))
