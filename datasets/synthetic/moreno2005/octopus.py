"""`moreno2005/octopus`: an octopus crawls over the sea floor and imitates it.

The paper uses "a real video sequence of an octopus changing its appearance while camouflaging". Its
"appearance [...]" is at times "quite similar to the background". All other properties are our
choice: body and motion, zones of the floor, times of the changes, stones and algae, the moving
light below the water, and sensor noise. The camouflaged skin adopts most of the floor's appearance.
Colours alone then separate the body only roughly, but a person can still find it. The arms are
short, webbed and move little, because the paper's contours change by affine maps from frame to
frame.

The body consists of overlapping balls: mantle, head, eyes and eight arms with skin between them.
Stones and algae are on the floor. The water focuses and scatters the light, and tints the image.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np
from numba import njit
from numpy.random import Generator
from numpy.typing import NDArray

from trackmark.datasets.interface import Array, Image, Mask
from trackmark.datasets.synthetic.parameters import SceneParameters
from trackmark.datasets.synthetic.render.camera import Camera
from trackmark.datasets.synthetic.render.path import quantised, smooth_step
from trackmark.datasets.synthetic.render.texture import fractal, grass, lerp, pebbles, ramp, relief
from trackmark.datasets.synthetic.scene import SceneTruth, SeededScene, part_generator

SIDE = 512  # width and height of textures [pixels]
IMITATION = 0.85  # share of the floor's texture in the camouflaged skin


@dataclass(frozen=True)
class TextureKind:
    """Kind of texture of a floor or skin."""

    colour: tuple[float, float, float]  # mean colour, RGB in [0, 1]
    # returns a texture of shape (SIDE, SIDE, 3), BGR, with an arbitrary mean
    paint: Callable[[Generator], Array]


def paint_texture(random: Generator, kind: TextureKind, colour: Array) -> Array:
    """Return a BGR texture, shape (SIDE, SIDE, 3), with a mean colour (RGB in [0, 1])."""
    texture = kind.paint(random)
    return np.asarray(np.clip(texture * (colour[::-1] / texture.mean(axis=(0, 1))), 0, 1.2))


def imitate_floor(texture: Array, skin_texture: Array) -> Array:
    """Return a mixture of a floor's texture and a skin's texture."""
    return np.asarray(IMITATION * texture + (1 - IMITATION) * skin_texture)


def _sand(random: Generator) -> Array:
    rows, columns = np.indices((SIDE, SIDE)) * (2 * np.pi / SIDE)
    bend = 5 * fractal(random, SIDE, 4, 16)
    ripples = np.sin(random.choice([-1, 1]) * 13 * columns + 31 * rows + bend)
    grain = fractal(random, SIDE, 64, 256, 1.0)
    shells = random.random((SIDE, SIDE))
    tone = 1 + 0.07 * ripples + 0.07 * grain + 0.06 * fractal(random, SIDE, 4, 32)
    tone += 0.25 * (shells > 0.995) - 0.35 * (shells < 0.006)
    return np.asarray(np.array([0.74, 0.88, 1.0]) * tone[..., None])


def _stones(random: Generator) -> Array:
    large = pebbles(random, SIDE) / 130
    halves = large.reshape(SIDE // 2, 2, SIDE // 2, 2, 3).mean(axis=(1, 3))
    stones = np.tile(halves, (2, 2, 1))
    overgrown = fractal(random, SIDE, 8, 64) - 0.3
    return lerp(stones, stones * np.array([0.75, 1.0, 0.95]), 2 * overgrown)


def _turf(random: Generator) -> Array:
    blades = grass(random, SIDE) / 90
    dark = 1 + 0.35 * fractal(random, SIDE, 8, 64)
    return np.asarray(blades.mean(axis=2, keepdims=True) * np.clip(dark, 0.3, 2)[..., None]
                      * np.array([0.8, 1.0, 0.9]))  # fmt: skip


def _reef(random: Generator) -> Array:
    height = fractal(random, SIDE, 16, 256, 0.7)
    tones = np.array([[0.35, 0.38, 0.45], [0.7, 0.75, 0.9], [1.0, 1.05, 1.25]])
    rock = ramp(height, tones) * relief(9 * height, 0.35)[..., None]
    crust = fractal(random, SIDE, 32, 128) * 3 - 1.6
    return lerp(rock, rock * np.array([1.15, 0.82, 1.25]), crust)


def _spotted(random: Generator) -> Array:
    """Return a texture of relaxed skin: pale spots with dark lines between them."""
    cells = fractal(random, SIDE, 32, 64, 0.5)
    tone = 1 + 0.22 * np.clip(2 * cells, -1, 1) + 0.05 * fractal(random, SIDE, 128, 256, 1.0)
    pale = np.clip(4 * fractal(random, SIDE, 32, 32) - 3.4, 0, 1)
    return lerp(np.ones(3) * tone[..., None], np.array([1.2, 1.4, 1.4]), pale)


FLOOR_KINDS: Mapping[str, TextureKind] = {
    "sand": TextureKind((0.70, 0.63, 0.50), _sand),
    "stones": TextureKind((0.50, 0.46, 0.42), _stones),
    "turf": TextureKind((0.37, 0.44, 0.22), _turf),
    "reef": TextureKind((0.47, 0.29, 0.30), _reef),
}

SKINS: Mapping[str, TextureKind] = {
    "rust": TextureKind((0.62, 0.27, 0.17), _spotted),
    "ochre": TextureKind((0.74, 0.47, 0.16), _spotted),
    "violet": TextureKind((0.42, 0.22, 0.42), _spotted),
    "salmon": TextureKind((0.78, 0.50, 0.42), _spotted),
}


Floats = NDArray[np.float32]

# direction to the light: to the right, down, towards the camera
SUN = np.array([-0.42, -0.5, 0.757], np.float32)
AMBIENT = 0.55  # fraction of the light on level ground that is ambient


def relief_light(height: Floats, soft: float) -> Floats:
    """Return the light on a height map [samples], shape (rows, columns); it is 1 on level ground.

    `soft` is the standard deviation of the blur that rounds edges [samples].
    """
    smooth = cv2.GaussianBlur(height, (0, 0), soft)
    right = cv2.Sobel(smooth, cv2.CV_32F, 1, 0, ksize=3, scale=0.125)
    down = cv2.Sobel(smooth, cv2.CV_32F, 0, 1, ksize=3, scale=0.125)
    straight = (SUN[2] - SUN[0] * right - SUN[1] * down) / np.sqrt(1 + right * right + down * down)
    return np.asarray(AMBIENT + (1 - AMBIENT) / SUN[2] * np.maximum(straight, 0), np.float32)


def cast_shadow(
    canvas: Floats, cover: Floats, shift: tuple[int, int], soft: float, darkness: float
) -> None:
    """Darken a canvas in place by the shadow of an object above it.

    `cover` is the object's coverage. The shadow is displaced by `shift` > 0 to the right and down
    [samples]. `soft` is the standard deviation of its edge [samples], `darkness` the fraction of
    light that full shadow removes.
    """
    right, down = shift
    thrown = np.zeros_like(cover)
    thrown[down:, right:] = cover[:-down, :-right]
    remaining = 1 - np.float32(darkness) * np.asarray(
        cv2.GaussianBlur(thrown, (0, 0), soft), np.float32
    )
    canvas *= remaining[..., None]


def mould_heights(
    balls: Array,
    corner: tuple[float, float],
    step: float,
    shape: tuple[int, ...],
    ground: float = 0.0,
) -> tuple[Floats, NDArray[np.int32]]:
    """Return heights of balls on the ground, and the index of the visible ball (or -1), by sample.

    `corner` is the upper left corner of the samples, and `step` their distance; see `mould`.
    """
    height, owner = np.full(shape, ground, np.float32), np.full(shape, -1, np.int32)
    mould(balls, *corner, step, height, owner)
    return height, owner


@njit(cache=True)
def mould(
    balls: Array,
    left: float,
    top: float,
    step: float,
    height: NDArray[np.float32],
    owner: NDArray[np.int32],
) -> None:
    """Find the highest surface of balls at samples.

    The columns of `balls`, shape (k, 5), are centre (x, y), radius, height of the centre, and half
    height relative to the radius. The sample in row i and column j lies at ``(left + (j + 0.5) *
    step, top + (i + 0.5) * step)``. `height`, shape (rows, columns), is raised in place. `owner`,
    shape (rows, columns), is set to the index of the highest ball.
    """
    rows, columns = height.shape
    for k in range(len(balls)):
        x, y, radius, middle, flat = balls[k]
        first_row = max(int(np.floor((y - radius - top) / step - 0.5)), 0)
        last_row = min(int(np.ceil((y + radius - top) / step - 0.5)), rows - 1)
        first_column = max(int(np.floor((x - radius - left) / step - 0.5)), 0)
        last_column = min(int(np.ceil((x + radius - left) / step - 0.5)), columns - 1)
        for i in range(first_row, last_row + 1):
            down = top + (i + 0.5) * step - y
            chord = radius * radius - down * down
            for j in range(first_column, last_column + 1):
                right = left + (j + 0.5) * step - x
                rest = chord - right * right
                if rest < 0:
                    continue
                surface = middle + flat * np.sqrt(rest)
                if surface > height[i, j]:
                    height[i, j] = surface
                    owner[i, j] = k


@njit(cache=True)
def colour_skin(
    owner: NDArray[np.int32],
    left: float,
    top: float,
    step: float,
    to_rest: Array,
    before: NDArray[np.float32],
    after: NDArray[np.float32],
    order: NDArray[np.float32],
    share: float,
    soft: float,
    light: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    """Colour the samples of a skin during the change from one texture to another.

    `owner`, `left`, `top` and `step` are as in `mould`. `to_rest`, shape (k, 2, 3), maps image to
    texture positions for each ball. `before` and `after`, shape (side, side, 3), are periodic
    textures whose side is a power of two. `order`, shape (side, side), is the time at which a texel
    changes, in [0, 1]. `share` is the progress of the whole change, in [0, 1], and `soft` the
    duration of a texel's change relative to the whole change. `light`, shape (rows, columns), is
    the light on the samples. `out`, shape (rows, columns, 4), is the result: colour and coverage.
    It must be 0 at first and changes only at samples of the skin.
    """
    rows, columns = owner.shape
    last = order.shape[0] - 1
    for i in range(rows):
        y = top + (i + 0.5) * step
        for j in range(columns):
            k = owner[i, j]
            if k < 0:
                continue
            x = left + (j + 0.5) * step
            u = to_rest[k, 0, 0] * x + to_rest[k, 0, 1] * y + to_rest[k, 0, 2]
            v = to_rest[k, 1, 0] * x + to_rest[k, 1, 1] * y + to_rest[k, 1, 2]
            column, row = int(np.floor(u)), int(np.floor(v))
            right, down = u - column, v - row
            a, b = column & last, (column + 1) & last
            c, d = row & last, (row + 1) & last
            changed = min(max((share * (1 + soft) - order[c, a]) / soft, 0.0), 1.0)
            for texture, part in ((before, 1 - changed), (after, changed)):
                if part == 0:
                    continue
                part *= light[i, j]
                for channel in range(3):
                    upper = (1 - right) * texture[c, a, channel] + right * texture[c, b, channel]
                    lower = (1 - right) * texture[d, a, channel] + right * texture[d, b, channel]
                    out[i, j, channel] += part * ((1 - down) * upper + down * lower)
            out[i, j, 3] = 1.0


ARMS = 8
JOINTS = 20  # balls per arm
WEBBED = 14  # number of balls per arm, counted from the head, that skin joins to the next arm
WEB = np.array([0.25, 0.5, 0.75])  # positions of the balls of skin between two arms
# position along the body and radius of the balls of the mantle; the head is at 0 [pixels]
MANTLE = np.array([[-7, 9], [-13, 12.5], [-19, 15.5], [-25, 17], [-31, 17], [-36, 15], [-41, 11]])
HEAD, EYE = 10.0, 3.6  # radii [pixels]
EYES = np.array([[2.0, -7.5], [2.0, 7.5]])  # positions, forwards and to the right [pixels]
FIRST_ARM = 1.9  # direction of the outermost arms, from straight ahead [radians]
ARM_THICKNESS, TIP_THICKNESS = 6.8, 2.2  # radius of an arm at the head and at its tip [pixels]
FINE = 2  # samples per pixel and axis
ROUNDED = 2.2  # standard deviation of the blur that merges the balls [samples]
SKIN_SOFTNESS = 0.35  # duration of a texel's change relative to the whole change
IRIS, PUPIL = (0.20, 0.52, 0.62), (0.03, 0.03, 0.03)  # colours of the eyes, BGR in [0, 1]


@dataclass(frozen=True)
class OctopusPosture:
    """Balls of the body, seen by a camera above the octopus."""

    # (k, 5): centre (x, y) and radius [pixels], height of the centre, half height relative to the
    # radius
    balls: Array
    turns: Array  # (k,): rotation of each ball [radians]

    @property
    def box(self) -> Array:
        """Bounding box of the silhouette: x, y, width, height [pixels]."""
        places, radii = self.balls[:, :2], self.balls[:, 2:3]
        low, high = (places - radii).min(axis=0), (places + radii).max(axis=0)
        return np.concatenate([low, high - low])


@dataclass(frozen=True)
class Body:
    """Proportions and motion pattern of an octopus."""

    scale: float  # relative size, about 1
    # (ARMS, 3): direction from straight ahead [radians], length [pixels], curl [radians]
    arms: Array
    waves: Array  # (ARMS, 3): waves along the arms: amplitude [radians], period [frames], phase
    # (ARMS, 3): oscillation of the arms' stretch and curl: amplitude, period [frames], phase
    reaching: Array
    breath: Array  # (3,): oscillation of the mantle: amplitude, period [frames], phase

    def posture_at(self, time: float, place: Array, heading: float) -> OctopusPosture:
        """Return the posture at a time [frames], with the head at a position [pixels]."""
        size, period, phase = self.waves.T[..., None]
        along = (np.arange(JOINTS) + 0.5) / JOINTS
        reach = _wave(self.reaching, time)[:, None]
        curl = self.arms[:, 2:] * (1 + 2 * reach) * along**1.5
        rising = 2 * np.pi * (time / period - 0.8 * along) + phase
        bends = curl + size * np.sqrt(along) * np.sin(rising)
        posture = self._posture(bends, 1 + reach, 1 + float(_wave(self.breath, time)))
        cosine, sine = np.cos(heading), np.sin(heading)
        turn = np.array([[cosine, sine], [-sine, cosine]])
        balls = posture.balls.copy()
        balls[:, :2] = place + balls[:, :2] @ turn
        return OctopusPosture(balls, posture.turns + heading)

    def at_rest(self) -> OctopusPosture:
        """Return the posture with straight arms, the head at the origin and the heading along x."""
        return self._posture(np.zeros((ARMS, JOINTS)), np.ones((ARMS, 1)), 1.0)

    def _posture(self, bends: Array, stretch: Array, breath: float) -> OctopusPosture:
        along = (np.arange(JOINTS) + 0.5) / JOINTS
        angles = self.arms[:, :1] + bends
        steps = np.stack([np.cos(angles), np.sin(angles)], axis=2)
        lengths = (self.arms[:, 1:2] * stretch / JOINTS)[..., None]
        roots = 0.6 * HEAD * np.stack([np.cos(self.arms[:, 0]), np.sin(self.arms[:, 0])], axis=1)
        joints = roots[:, None] + np.cumsum(steps * lengths, axis=1)
        radii = np.broadcast_to(
            ARM_THICKNESS + (TIP_THICKNESS - ARM_THICKNESS) * along**0.8, angles.shape
        )
        near, far = joints[:-1, :WEBBED, None], joints[1:, :WEBBED, None]
        web = near + (far - near) * WEB[:, None]
        web_bends = bends[:-1, :WEBBED, None] * (1 - WEB) + bends[1:, :WEBBED, None] * WEB
        web_radii = np.broadcast_to(
            4.5 - 2.2 * along[:WEBBED, None] / along[WEBBED], web.shape[:-1]
        )
        mantle = np.stack([MANTLE[:, 0], 0 * MANTLE[:, 0]], axis=1)
        parts = [
            _balls(web, web_radii, 0.0, 0.5),
            _balls(joints, radii, 1.0, 0.9),
            _balls(mantle, MANTLE[:, 1] * breath, 2.0, 0.9),
            _balls(np.zeros((1, 2)), np.full(1, HEAD), 5.0, 0.8),
            _balls(EYES, np.full(2, EYE), 11.5, 0.9),
        ]
        balls = np.concatenate(parts)
        balls[:, :4] *= self.scale
        rigid = np.zeros(len(MANTLE) + 1 + len(EYES))
        return OctopusPosture(balls, np.concatenate([web_bends.ravel(), bends.ravel(), rigid]))


def _balls(places: Array, radii: Array, height: float, flat: float) -> Array:
    rest = np.broadcast_to([height, flat], (radii.size, 2))
    return np.concatenate([places.reshape(-1, 2), radii.reshape(-1, 1), rest], axis=1)


def _wave(waves: Array, time: float) -> Array:
    """Return a sine at a time [frames] for each row (amplitude, period, phase) of `waves`."""
    size, period, phase = waves.T
    return np.asarray(size * np.sin(2 * np.pi * time / period + phase))


def sample_body(random: Generator) -> Body:
    """Sample a body."""
    directions = np.linspace(-FIRST_ARM, FIRST_ARM, ARMS) + random.uniform(-0.12, 0.12, ARMS)
    # Most left arms curl to the left, and most right arms curl to the right.
    curls = np.sign(directions) * random.uniform(0.5, 1.2, ARMS)
    curls *= random.choice([-1, 1], ARMS, p=[0.1, 0.9])
    turns = 2 * np.pi * random.random((3, ARMS))
    return Body(
        float(random.uniform(1.05, 1.25)),
        np.stack([directions, random.uniform(28, 36, ARMS), curls], axis=1),
        np.stack(
            [random.uniform(0.06, 0.16, ARMS), random.uniform(26, 46, ARMS), turns[0]], axis=1
        ),
        np.stack(
            [random.uniform(0.02, 0.05, ARMS), random.uniform(24, 40, ARMS), turns[1]], axis=1
        ),
        np.array([random.uniform(0.03, 0.06), random.uniform(28, 44), turns[2, 0]]),
    )


class Skin:
    """Textures of a body, each of shape (SIDE, SIDE, 3), BGR in [0, 1].

    Texels change from one texture to another in a random order.
    """

    def __init__(self, random: Generator, body: Body, textures: Sequence[Array]) -> None:
        rest = body.at_rest().balls
        self._rest = rest[:, :2]
        on_body = mould_heights(rest, (-SIDE / 2, -SIDE / 2), 1.0, (SIDE, SIDE))[1] >= 0
        # Scaled so that the part of the texture on the body has the given mean colour.
        fitted = (
            texture * (texture.mean(axis=(0, 1)) / texture[on_body].mean(axis=0))
            for texture in textures
        )
        eyes = body.scale * EYES, body.scale * EYE
        self._textures = np.stack([_with_eyes(texture, *eyes) for texture in fitted]).astype(
            np.float32
        )
        order = fractal(random, SIDE, 16, 64, 0.6)
        ranks = order.ravel().argsort().argsort() / order.size
        self._order: Floats = ranks.reshape(order.shape).astype(np.float32)

    def render(
        self,
        posture: OctopusPosture,
        corner: tuple[int, int],
        size: tuple[int, int],
        before: int,
        after: int,
        share: float,
    ) -> Floats:
        """Render a window with `FINE` samples per pixel and axis: BGR in [0, 1] and coverage.

        `corner` is the upper left corner, `size` the width and height of the window [pixels].
        `before` and `after` are indices of textures, `share` the progress of the change between
        them in [0, 1].
        """
        shape = size[1] * FINE, size[0] * FINE
        left, top, step = float(corner[0]), float(corner[1]), 1 / FINE
        height, owner = mould_heights(posture.balls, (left, top), step, shape)
        textures = self._textures[before], self._textures[after]
        light = relief_light(height * FINE, ROUNDED)
        colour = np.zeros((*shape, 4), np.float32)
        colour_skin(
            owner, left, top, step, self._to_rest(posture), *textures, self._order, share,
            SKIN_SOFTNESS, light, colour,
        )  # fmt: skip
        return colour

    def _to_rest(self, posture: OctopusPosture) -> Array:
        """Return the maps from image to texture positions, one per ball, shape (k, 2, 3)."""
        cosine, sine = np.cos(posture.turns), np.sin(posture.turns)
        rows = np.stack([cosine, sine], axis=1), np.stack([-sine, cosine], axis=1)
        turn = np.stack(rows, axis=1)
        turned = np.einsum("kij,kj->ki", turn, posture.balls[:, :2])
        shift = self._rest - turned + (SIDE / 2 - 0.5)
        return np.concatenate([turn, shift[..., None]], axis=2)


def _with_eyes(texture: Array, places: Array, radius: float) -> Array:
    result = texture.copy()
    rows, columns = np.indices(texture.shape[:2]) + 0.5 - SIDE / 2
    for x, y in places:
        right, down = columns - x, rows - y
        result[right * right + down * down <= radius * radius] = IRIS
        result[(np.abs(right) < 0.7 * radius) & (np.abs(down) < 0.25 * radius)] = PUPIL
    return result


FRAMES = 100
SIZE = 320, 240
# columns of the first and last position of the head, or vice versa [pixels]
ENDS = ((74.0, 92.0), (228.0, 246.0))
LEVELS = 92.0, 148.0  # range of rows of the first and last position of the head [pixels]
BULGE = 14.0  # maximum sideways deviation of the path [pixels]
TINT = 0.08  # maximum relative deviation of a colour channel from the mean of its texture kind
FIRST_CHANGE = 8.0, 16.0  # time at which the skin starts to imitate the first floor [frames]
# time from the arrival on another floor until the skin starts to imitate it [frames]
DELAY = 3.0, 8.0
LASTING = 12.0, 20.0  # duration of a change [frames]
AROUND = 2.0  # distance of the surrounding floor from the octopus's box [pixels]
# maximum distance between the mean colours of a camouflaged octopus and the floors, RGB of [0, 1]
CLOSE = 0.2
# minimum distance between the initial mean colour and the first floor's, RGB of [0, 1]
CONTRAST = 0.25

FLOORS = 3  # kinds of floor in a scene: at the start, at the destination, and a third kind
OWN = FLOORS  # index of the initial texture; the preceding textures imitate the floors
BORDER_SOFTNESS = 4.0  # approximate width of the transition between floors [pixels]
# amplitude and length of the waves of the borders in both directions [pixels]
WAVES = ((9.0, 75.0), (4.0, 31.0), (2.0, 14.0))
# minimum distance of additional zones from the path, and from one another [pixels]
ASIDE, APART = 105.0, 80.0
TRIALS = 60  # number of candidate positions for additional zones


@dataclass(frozen=True)
class Zones:
    """Floor zones around points, with wavy borders."""

    points: Array  # (k, 2): [pixels]
    floors: NDArray[np.int64]  # (k,): index of each zone's floor
    phases: Array  # (2, 3): of the waves

    def shares(self, places: Array) -> Array:
        """Return the share of each floor, shape (..., FLOORS), at points (..., 2)."""
        bent = places.copy()
        for (size, length), phases in zip(WAVES, self.phases.T, strict=True):
            bent += size * np.sin(2 * np.pi * places[..., ::-1] / length + phases)
        distance = np.linalg.norm(bent[..., None, :] - self.points, axis=-1)
        nearest = np.stack(
            [distance[..., self.floors == floor].min(axis=-1) for floor in range(FLOORS)], axis=-1
        )
        weights = np.exp((nearest.min(axis=-1, keepdims=True) - nearest) / BORDER_SOFTNESS)
        return np.asarray(weights / weights.sum(axis=-1, keepdims=True))


def _sample_zones(random: Generator, path: Array) -> Zones:
    """Sample two zones along a path, shape (n, 2), and other zones away from the path."""
    points = [path[len(path) // 8], path[-len(path) // 8]]
    for place in random.uniform((-50, -50), np.array(SIZE) + 50, (TRIALS, 2)):
        far = np.linalg.norm(path - place, axis=1).min() > ASIDE
        if far and np.linalg.norm(points - place, axis=1).min() > APART:
            points.append(place)
    further = random.permutation(np.arange(len(points) - 2) + 2) % FLOORS
    floors = np.concatenate([[0, 1], further])
    # A floor without a zone gets a zone far outside the image.
    points.append(np.full(2, 1e4))
    phases = random.uniform(0, 2 * np.pi, (2, len(WAVES)))
    return Zones(np.array(points), np.append(floors, FLOORS - 1), phases)


@dataclass(frozen=True)
class OctopusPlan:
    """Motion, floor, and changes of the skin's texture."""

    body: Body
    place: Array  # (FRAMES, 2): position of the head [pixels]
    heading: Array  # (FRAMES,): heading of the body, from x towards y [radians]
    zones: Zones
    kinds: tuple[str, ...]  # kinds of the floors, and of the octopus's initial skin
    colours: Array  # (FLOORS + 1, 3): mean colours of `kinds`, RGB in [0, 1]
    # (2, 2): start and end of the change to the texture of the first and second floor [frames]
    changes: Array

    def posture(self, frame: int) -> OctopusPosture:
        """Return the posture of the octopus in a frame."""
        return self.body.posture_at(frame, self.place[frame], float(self.heading[frame]))

    @cached_property
    def boxes(self) -> Array:
        """Boxes of the whole octopus, shape (FRAMES, 4): x, y, width, height [pixels]."""
        return np.stack([self.posture(frame).box for frame in range(FRAMES)])

    def texture_change(self, frame: int) -> tuple[int, int, float]:
        """Return the textures before and after the current change, and its progress in [0, 1]."""
        first, second = (
            float(smooth_step(np.array(float(frame)), *change)) for change in self.changes
        )
        return (0, 1, second) if second > 0 else (OWN, 0, first)

    @cached_property
    def camouflaged(self) -> NDArray[np.bool_]:
        """Return for every frame whether the skin has nearly the colour of the floors around it."""
        own_colour = self.colours[OWN]
        textures = np.vstack([imitate_floor(self.colours[:OWN], own_colour), own_colour])
        skin = np.empty((FRAMES, 3))
        for frame in range(FRAMES):
            before, after, share = self.texture_change(frame)
            skin[frame] = (1 - share) * textures[before] + share * textures[after]
        distances = np.linalg.norm(skin[:, None] - self.colours[:OWN], axis=2)
        around = _surroundings(self.zones, self.boxes)
        return np.asarray((around * distances).sum(axis=1) <= CLOSE)


def _surroundings(zones: Zones, boxes: Array) -> Array:
    """Return the share of each floor, shape (n, FLOORS), around boxes of shape (n, 4)."""
    angles = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    middle, half = boxes[:, :2] + boxes[:, 2:] / 2, boxes[:, 2:] / 2 + AROUND
    return np.asarray(zones.shares(middle[:, None] + half[:, None] * directions).mean(axis=1))


def sample_plan(seed: int) -> OctopusPlan:
    """Sample the plan of a scene."""
    random, floors = (
        part_generator(seed, f"moreno2005/octopus {part}") for part in ("way", "floors")
    )
    place = quantised(_head_path(random))
    travel = np.arctan2(*(place[-1] - place[0])[::-1])
    swing, period, phase = random.uniform((0.1, 50, 0), (0.3, 90, 2 * np.pi))
    times = np.arange(FRAMES)
    heading = (
        travel + random.uniform(-0.7, 0.7) + swing * np.sin(2 * np.pi * times / period + phase)
    )
    body = sample_body(part_generator(seed, "moreno2005/octopus body"))
    kinds = floors.permutation(list(FLOOR_KINDS))[:FLOORS].tolist()
    first = np.array(FLOOR_KINDS[kinds[0]].colour)
    contrasting_kinds = [
        kind for kind, skin in SKINS.items() if np.linalg.norm(skin.colour - first) > CONTRAST
    ]
    own_kind = str(floors.choice(contrasting_kinds))
    mean_colours = [*(FLOOR_KINDS[kind].colour for kind in kinds), SKINS[own_kind].colour]
    colours = np.array(mean_colours) * floors.uniform(1 - TINT, 1 + TINT, (FLOORS + 1, 3))
    zones = _sample_zones(floors, place)
    still = OctopusPlan(body, place, heading, zones, (*kinds, own_kind), colours, np.zeros((2, 2)))
    arrival = float(np.argmax(_surroundings(zones, still.boxes)[:, 1] > 0.5))
    start = random.uniform(*FIRST_CHANGE)
    end = start + random.uniform(*LASTING)
    again = max(arrival, end) + random.uniform(*DELAY)
    changes = np.array([[start, end], [again, again + random.uniform(*LASTING)]])
    return replace(still, changes=changes)


def _head_path(random: Generator) -> Array:
    """Return the path of the head with varying speed, shape (FRAMES, 2) [pixels]."""
    columns = [random.uniform(*end) for end in ENDS]
    if random.random() < 0.5:
        columns.reverse()
    start, end = np.stack([columns, random.uniform(*LEVELS, 2)], axis=1)
    times = np.arange(FRAMES)
    period, phase = random.uniform(18, 28), random.uniform(0, 2 * np.pi)
    surge = random.uniform(0.3, 0.6) * period / (2 * np.pi * FRAMES)
    share = times / (FRAMES - 1) + surge * np.sin(2 * np.pi * times / period + phase)
    across = (end - start)[::-1] * (-1, 1) / np.linalg.norm(end - start)
    bulge = 4 * random.uniform(-BULGE, BULGE) * share * (1 - share)
    return np.asarray(start + (end - start) * share[:, None] + bulge[:, None] * across)


STONES, TUFTS = 34, 26  # number of stones and of tufts of algae
STONE = 2.5, 11.0  # radius of a stone; small ones are more frequent [pixels]
BLADES = 10, 26  # number of blades in a tuft of algae
BLADE = 7.0, 17.0  # length of a blade [pixels]
# colours of algae, RGB in [0, 1]
ALGAE = np.array([[0.30, 0.42, 0.14], [0.44, 0.30, 0.12], [0.50, 0.14, 0.20], [0.62, 0.58, 0.26]])
REPEAT = 256  # period of the light pattern [pixels]
DRIFT = 0.35, 0.75  # speed of the two layers of waves that form the light pattern [pixels/frame]
DARKEST, BRIGHTER = 0.94, 0.8  # light between the bright lines, and its increase on the lines
THROUGH = np.array([0.93, 1.0, 0.80], np.float32)  # transmission of the water, BGR
HAZE = np.array([0.34, 0.31, 0.16], np.float32)  # colour of the water alone, BGR
HAZE_SHARE = 0.14  # share of the water's colour in the image


def paint_floor(seed: int, zones: Zones, textures: Sequence[Array]) -> Floats:
    """Return the whole floor in even light, BGR in [0, 1], from the textures of its zones."""
    random = part_generator(seed, "moreno2005/octopus things")
    rows, columns = (np.indices(SIZE[::-1]) + 0.5).astype(np.float64)
    uneven = 9 * fractal(random, SIDE, 32, 128)[: SIZE[1], : SIZE[0], None]
    shares = zones.shares(np.stack([columns, rows], axis=2) + uneven)
    ground = np.zeros((*SIZE[::-1], 3))
    for floor, texture in enumerate(textures):
        ground += shares[..., floor : floor + 1] * texture[: SIZE[1], : SIZE[0]]
    large = cv2.resize(ground, None, fx=FINE, fy=FINE, interpolation=cv2.INTER_CUBIC)
    canvas = np.asarray(large, np.float32)
    grain = fractal(random, SIDE, 64, 256, 0.8)
    places = random.uniform((0, 0), SIZE, (STONES + TUFTS, 2))
    for number, place in enumerate(places):
        if number < STONES:
            _lay_stone(random, canvas, grain, place)
        else:
            _plant_tuft(random, canvas, place)
    reduced = cv2.resize(canvas, SIZE, interpolation=cv2.INTER_AREA)
    return np.asarray(np.clip(reduced, 0, 1), np.float32)


def _lay_stone(random: Generator, canvas: Floats, grain: Array, place: Array) -> None:
    radius = STONE[0] + (STONE[1] - STONE[0]) * random.random() ** 2
    count = int(random.integers(3, 7))
    middles = place + random.uniform(-0.7, 0.7, (count, 2)) * radius
    radii = radius * random.uniform(0.5, 1.0, (count, 1))
    balls = np.hstack([middles, radii, np.zeros((count, 1)), np.full((count, 1), 0.6)])
    window, corner = _window(canvas, place, 3 * radius)
    height, owner = mould_heights(balls, corner, 1 / FINE, window.shape[:2])
    covered = owner >= 0
    fall = 1 + round(0.25 * radius * FINE), 1 + round(0.35 * radius * FINE)
    cast_shadow(window, covered.astype(np.float32), fall, 0.25 * radius * FINE + 0.5, 0.5)
    column, row = random.integers(SIDE // 2, size=2)
    rough = grain[row:, column:][: window.shape[0], : window.shape[1], None]
    tone = random.uniform(0.22, 0.62) * random.uniform(0.85, 1.1, 3)
    colour = tone * (1 + 0.16 * rough) * relief_light(height * FINE, 1.5)[..., None]
    window[covered] = colour[covered]


def _plant_tuft(random: Generator, canvas: Floats, place: Array) -> None:
    window, corner = _window(canvas, place, 1.5 * BLADE[1])
    colour = ALGAE[random.integers(len(ALGAE)), ::-1] * random.uniform(0.8, 1.15)
    lean = random.uniform(0, 2 * np.pi)
    blades = []
    for _ in range(int(random.integers(*BLADES))):
        along = np.linspace(0, 1, 8)[:, None]
        direction = lean + random.normal(0, 0.9) + random.normal(0, 0.8) * along
        steps = np.hstack([np.cos(direction), np.sin(direction)]) * random.uniform(*BLADE) / 8
        points = place - corner + random.normal(0, 2.0, 2) + np.cumsum(steps, axis=0)
        blades.append(np.round(points * FINE * 16).astype(np.int32))
    shadow = np.zeros(window.shape[:2], np.float32)
    for blade in blades:
        cv2.polylines(shadow, [blade], False, 1.0, 3, cv2.LINE_8, 4)
    cast_shadow(window, shadow, (3, 4), 2.0, 0.4)
    drawn = window.copy()  # OpenCV draws only on contiguous arrays.
    for blade in blades:
        tone = (colour * random.uniform(0.6, 1.35)).tolist()
        cv2.polylines(drawn, [blade], False, tone, int(random.integers(1, 4)), cv2.LINE_8, 4)
    window[:] = drawn


def _window(canvas: Floats, place: Array, reach: float) -> tuple[Floats, tuple[float, float]]:
    """Return the window of a canvas around a point, and its upper left corner [pixels]."""
    left, top = np.maximum(np.floor((place - reach) * FINE), 0).astype(int).tolist()
    right, bottom = np.ceil((place + reach) * FINE).astype(int).tolist()
    return canvas[top:bottom, left:right], (left / FINE, top / FINE)


class Water:
    """Water: slow caustics (bright lines of focused light) and haze."""

    def __init__(self, random: Generator) -> None:
        self._random = random

    def over(self, picture: Floats, frame: int) -> Image:
        """Return an image (in even light, BGR in [0, 1]) as it looks below the water."""
        canvas = np.empty(picture.shape, np.uint8)
        first, second = (self._layer(layer, frame) for layer in range(2))
        _look_through(picture, first, second, THROUGH * (1 - HAZE_SHARE), HAZE * HAZE_SHARE, canvas)
        return canvas

    def _layer(self, layer: int, frame: int) -> Floats:
        texture, drift = self._layers[layer]
        x, y = np.mod(drift * frame, REPEAT) + 1
        centre = (x + (SIZE[0] - 1) / 2, y + (SIZE[1] - 1) / 2)
        return np.asarray(cv2.getRectSubPix(texture, SIZE, centre), np.float32)

    @cached_property
    def _layers(self) -> list[tuple[Floats, Array]]:
        """Two textures of bright lines with a margin, and their velocities [pixels/frame]."""
        layers = []
        turn = self._random.uniform(0, 2 * np.pi)
        for layer in range(2):
            waves = fractal(self._random, REPEAT, 8, 16, 0.5)
            lines = np.clip(1 - 1.15 * np.abs(waves), 0, 1)
            wide = np.tile(lines, (3, 3))[: SIZE[1] + REPEAT + 3, : SIZE[0] + REPEAT + 3]
            angle = turn + layer * np.pi * self._random.uniform(0.6, 1.4)
            pace = self._random.uniform(*DRIFT)
            drift = pace * np.array([np.cos(angle), np.sin(angle)])
            layers.append((wide.astype(np.float32), drift))
        return layers


@njit(cache=True)
def _look_through(
    picture: Floats, first: Floats, second: Floats, through: Floats, haze: Floats, out: Image
) -> None:
    """Lighten an image where both layers have a line, tint it, and convert it to grey levels."""
    rows, columns = first.shape
    for i in range(rows):
        for j in range(columns):
            line = min(first[i, j], second[i, j])
            gain = np.float32(DARKEST) + np.float32(BRIGHTER) * line * line * line
            for k in range(3):
                value = picture[i, j, k] * gain * through[k] + haze[k]
                out[i, j, k] = int(min(max(value, np.float32(0)), np.float32(1)) * 255 + 0.5)


CAMERA = Camera(SIZE, noise=3.0, fall=(0.06, 0.09))
MARGIN = 14  # margin around the octopus for its shadow [pixels]
# shadow of the octopus: offset [pixels], softness [pixels], fraction of light that it removes
SHADOW = (4, 5), 3.0, 0.45


class OctopusScene(SeededScene):
    """Scene of an octopus on the sea floor."""

    label, length, size = "moreno2005/octopus", FRAMES, SIZE

    def __init__(self, parameters: SceneParameters) -> None:
        super().__init__(parameters)
        self.plan = sample_plan(self._seed)

    def truth(self) -> SceneTruth:
        """Return the ground truth of all frames.

        The attribute `camouflaged` means that the mean colour of the octopus is within 0.2 of the
        mean colours of the surrounding floors (RGB of [0, 1], in even light). Distances to several
        floors are averaged with their shares of the surroundings as weights.
        """
        plan = self.plan
        return SceneTruth(plan.boxes, np.ones(FRAMES), {"camouflaged": plan.camouflaged})

    def render(self, frame: int) -> Image:
        picture = self._floor.copy()
        self._lay_octopus(picture, frame)
        canvas = self._water.over(picture, frame)
        return CAMERA.exposed(canvas, self._seed, frame)

    def mask(self, frame: int) -> Mask:
        balls = self.plan.posture(frame).balls
        return np.asarray(mould_heights(balls, (0.0, 0.0), 1.0, SIZE[::-1], ground=-1.0)[1] >= 0)

    def _lay_octopus(self, picture: Floats, frame: int) -> None:
        posture = self.plan.posture(frame)
        x, y, width, height = posture.box
        left, top = max(int(x) - MARGIN, 0), max(int(y) - MARGIN, 0)
        right = min(int(x + width) + MARGIN, SIZE[0])
        bottom = min(int(y + height) + MARGIN, SIZE[1])
        window = picture[top:bottom, left:right]
        size = right - left, bottom - top
        coloured = self._skin.render(posture, (left, top), size, *self.plan.texture_change(frame))
        sheet = np.asarray(cv2.resize(coloured, size, interpolation=cv2.INTER_AREA), np.float32)
        cast_shadow(window, sheet[..., 3], *SHADOW)
        window *= 1 - sheet[..., 3:]
        window += sheet[..., :3]

    @cached_property
    def _skin(self) -> Skin:
        random, plan = self._random("skin"), self.plan
        own_texture = paint_texture(random, SKINS[plan.kinds[OWN]], plan.colours[OWN])
        # The texture is rotated, so that the floor's pattern does not continue on the skin.
        textures = [imitate_floor(np.rot90(texture), own_texture) for texture in self._textures]
        return Skin(random, plan.body, [*textures, own_texture])

    @cached_property
    def _floor(self) -> Floats:
        return paint_floor(self._seed, self.plan.zones, self._textures)

    @cached_property
    def _textures(self) -> list[Array]:
        random, plan = self._random("textures"), self.plan
        return [
            paint_texture(random, FLOOR_KINDS[kind], colour)
            for kind, colour in zip(plan.kinds[:OWN], plan.colours[:OWN], strict=True)
        ]

    @cached_property
    def _water(self) -> Water:
        return Water(self._random("water"))
