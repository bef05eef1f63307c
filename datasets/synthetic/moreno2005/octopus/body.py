"""An octopus: mantle, head, eyes and eight arms with skin between them, as overlapping balls."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from trackmark.datasets.synthetic.render.texture import fractal, grass, lerp, pebbles, ramp, relief

Array = NDArray[np.float64]

SIDE = 512  # of textures [pixels]
IMITATION = 0.5  # share of a floor's look that a skin takes on


@dataclass(frozen=True)
class Kind:
    """Something that a floor or a skin looks like."""

    colour: tuple[float, float, float]  # mean, RGB in [0, 1]
    # texture of shape (SIDE, SIDE, 3), BGR, of any mean
    paint: Callable[[np.random.Generator], Array]


def painted(random: np.random.Generator, kind: Kind, colour: Array) -> Array:
    """Texture of a kind whose mean is a colour, RGB in [0, 1]; BGR, shape (SIDE, SIDE, 3)."""
    texture = kind.paint(random)
    return np.asarray(np.clip(texture * (colour[::-1] / texture.mean(axis=(0, 1))), 0, 1.2))


def imitated(texture: Array, own: Array) -> Array:
    """Return a skin's imitation of a floor's texture; a part of the skin's look stays its own."""
    return np.asarray(IMITATION * texture + (1 - IMITATION) * own)


def _sand(random: np.random.Generator) -> Array:
    """Ripples, grains, and bits of shell."""
    rows, columns = np.indices((SIDE, SIDE)) * (2 * np.pi / SIDE)
    bend = 5 * fractal(random, SIDE, 4, 16)
    ripples = np.sin(random.choice([-1, 1]) * 13 * columns + 31 * rows + bend)
    grain = fractal(random, SIDE, 64, 256, 1.0)
    shells = random.random((SIDE, SIDE))
    tone = 1 + 0.07 * ripples + 0.07 * grain + 0.06 * fractal(random, SIDE, 4, 32)
    tone += 0.25 * (shells > 0.995) - 0.35 * (shells < 0.006)
    return np.asarray(np.array([0.74, 0.88, 1.0]) * tone[..., None])


def _stones(random: np.random.Generator) -> Array:
    """Gravel, overgrown in places."""
    large = pebbles(random, SIDE) / 130
    halves = large.reshape(SIDE // 2, 2, SIDE // 2, 2, 3).mean(axis=(1, 3))
    stones = np.tile(halves, (2, 2, 1))
    overgrown = fractal(random, SIDE, 8, 64) - 0.3
    return lerp(stones, stones * np.array([0.75, 1.0, 0.95]), 2 * overgrown)


def _turf(random: np.random.Generator) -> Array:
    """Short algae, thick and thin."""
    blades = grass(random, SIDE) / 90
    dark = 1 + 0.35 * fractal(random, SIDE, 8, 64)
    return np.asarray(blades.mean(axis=2, keepdims=True) * np.clip(dark, 0.3, 2)[..., None]
                      * np.array([0.8, 1.0, 0.9]))  # fmt: skip


def _reef(random: np.random.Generator) -> Array:
    """Rough rock with crusts of other colours."""
    height = fractal(random, SIDE, 16, 256, 0.7)
    tones = np.array([[0.35, 0.38, 0.45], [0.7, 0.75, 0.9], [1.0, 1.05, 1.25]])
    rock = ramp(height, tones) * relief(9 * height, 0.35)[..., None]
    crust = fractal(random, SIDE, 32, 128) * 3 - 1.6
    return lerp(rock, rock * np.array([1.15, 0.82, 1.25]), crust)


def _spotted(random: np.random.Generator) -> Array:
    """Skin at ease: pale spots and dark lines between them."""
    cells = fractal(random, SIDE, 32, 64, 0.5)
    tone = 1 + 0.22 * np.clip(2 * cells, -1, 1) + 0.05 * fractal(random, SIDE, 128, 256, 1.0)
    pale = np.clip(4 * fractal(random, SIDE, 32, 32) - 3.4, 0, 1)
    return lerp(np.ones(3) * tone[..., None], np.array([1.2, 1.4, 1.4]), pale)


FLOOR_KINDS: Mapping[str, Kind] = {
    "sand": Kind((0.70, 0.63, 0.50), _sand),
    "stones": Kind((0.50, 0.46, 0.42), _stones),
    "turf": Kind((0.32, 0.38, 0.19), _turf),
    "reef": Kind((0.47, 0.29, 0.30), _reef),
}

SKINS: Mapping[str, Kind] = {
    "rust": Kind((0.62, 0.27, 0.17), _spotted),
    "ochre": Kind((0.74, 0.47, 0.16), _spotted),
    "violet": Kind((0.42, 0.22, 0.42), _spotted),
    "salmon": Kind((0.78, 0.50, 0.42), _spotted),
}


Floats = NDArray[np.float32]

# Where the light comes from: to the right, down, towards the camera.
SUN = np.array([-0.42, -0.5, 0.757], np.float32)
AMBIENT = 0.55  # light from all around, of what falls on level ground


def lit(height: Floats, soft: float) -> Floats:
    """Light on a surface, 1 on level ground, shape (rows, columns) as its height [samples].

    `soft` is the standard deviation of the blur that rounds edges [samples].
    """
    smooth = cv2.GaussianBlur(height, (0, 0), soft)
    right = cv2.Sobel(smooth, cv2.CV_32F, 1, 0, ksize=3, scale=0.125)
    down = cv2.Sobel(smooth, cv2.CV_32F, 0, 1, ksize=3, scale=0.125)
    straight = (SUN[2] - SUN[0] * right - SUN[1] * down) / np.sqrt(1 + right * right + down * down)
    return np.asarray(AMBIENT + (1 - AMBIENT) / SUN[2] * np.maximum(straight, 0), np.float32)


def shade(
    canvas: Floats, cover: Floats, shift: tuple[int, int], soft: float, darkness: float
) -> None:
    """Darken a canvas, in place, where something that covers a part of it takes the light.

    The shadow lies to the right and below by `shift`, which is not 0; `soft` is the standard
    deviation of its edge [samples], `darkness` what is taken in full shade.
    """
    right, down = shift
    thrown = np.zeros_like(cover)
    thrown[down:, right:] = cover[:-down, :-right]
    kept = 1 - np.float32(darkness) * np.asarray(cv2.GaussianBlur(thrown, (0, 0), soft), np.float32)
    canvas *= kept[..., None]


def moulded(
    balls: NDArray[np.float64],
    corner: tuple[float, float],
    step: float,
    shape: tuple[int, ...],
    ground: float = 0.0,
) -> tuple[Floats, NDArray[np.int32]]:
    """Heights of balls that rise from the ground, and which is seen where (-1: none).

    `corner` is the left top one of the samples, which are `step` apart; see `mould`.
    """
    height, owner = np.full(shape, ground, np.float32), np.full(shape, -1, np.int32)
    mould(balls, *corner, step, height, owner)
    return height, owner


@njit(cache=True)
def mould(
    balls: NDArray[np.float64],
    left: float,
    top: float,
    step: float,
    height: NDArray[np.float32],
    owner: NDArray[np.int32],
) -> None:
    """Find the highest surface at samples.

    `balls`: Middle (x, y), radius, height of the middle, half height as a part of the radius; shape
    (k, 5). `left, top, step`: Sample (row i, column j) lies at ``(left + (j + 0.5) * step, top + (i
    + 0.5) * step)``. `height`: Of what is there already; raised in place; shape (rows, columns).
    `owner`: Set where a ball is highest, to its number; shape (rows, columns).
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
    to_rest: NDArray[np.float64],
    before: NDArray[np.float32],
    after: NDArray[np.float32],
    order: NDArray[np.float32],
    share: float,
    soft: float,
    light: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    """Give samples of a skin the colours of two looks, of each where its time has come.

    `owner, left, top, step`: See `mould`. `to_rest`: From the picture to where that part of the
    skin is in the textures, by ball; shape (k, 2, 3). `before, after`: The looks; they repeat, and
    `side` is a power of two; shape (side, side, 3). `order`: When a place changes, in [0, 1]; shape
    (side, side). `share`: How far all has come, in [0, 1]. `soft`: How long a place takes, as a
    part of the whole change. `light`: That falls on the samples; shape (rows, columns). `out`:
    Colour with coverage, zeros; written where there is skin; shape (rows, columns, 4).
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
            for look, part in ((before, 1 - changed), (after, changed)):
                if part == 0:
                    continue
                part *= light[i, j]
                for channel in range(3):
                    upper = (1 - right) * look[c, a, channel] + right * look[c, b, channel]
                    lower = (1 - right) * look[d, a, channel] + right * look[d, b, channel]
                    out[i, j, channel] += part * ((1 - down) * upper + down * lower)
            out[i, j, 3] = 1.0


ARMS = 8
JOINTS = 20  # balls along an arm
WEBBED = 14  # of these, from the head on: with skin between them and those of the next arm
WEB = np.array([0.25, 0.5, 0.75])  # where balls of that skin lie, from one arm to the next
# Along the body and radius of the balls of the mantle, the head being at 0 [pixels].
MANTLE = np.array([[-7, 9], [-13, 12.5], [-19, 15.5], [-25, 17], [-31, 17], [-36, 15], [-41, 11]])
HEAD, EYE = 10.0, 3.6  # radii [pixels]
EYES = np.array([[2.0, -7.5], [2.0, 7.5]])  # where they are, forwards and to the right [pixels]
FIRST_ARM = 1.9  # directions of the outermost arms, from straight ahead [radians]
THICK, THIN = 6.8, 2.2  # radius of an arm at the head and at its tip [pixels]
FINE = 2  # samples per pixel and axis
ROUNDED = 2.2  # standard deviation of the blur that joins its parts [samples]
SOFT = 0.35  # how long a place takes to change, as a part of the whole change
IRIS, PUPIL = (0.20, 0.52, 0.62), (0.03, 0.03, 0.03)  # colours of the eyes, BGR in [0, 1]


@dataclass(frozen=True)
class Posture:
    """Balls as a camera above them sees them."""

    # (k, 5): middle (x, y) and radius [pixels], how high its middle is, and its half height as a
    # part of its radius
    balls: Array
    turns: Array  # (k,): how much each is turned [radians]

    @property
    def box(self) -> Array:
        """Extents of the silhouette: x, y, width, height [pixels]."""
        places, radii = self.balls[:, :2], self.balls[:, 2:3]
        low, high = (places - radii).min(axis=0), (places + radii).max(axis=0)
        return np.concatenate([low, high - low])


@dataclass(frozen=True)
class Body:
    """Proportions and habits of an animal."""

    scale: float  # size, about 1
    # (ARMS, 3): direction from straight ahead [radians], length [pixels], curl [radians]
    arms: Array
    waves: Array  # (ARMS, 3): that run along the arms: size [radians], period [frames], phase
    # (ARMS, 3): how the arms stretch and curl more and less: size, period [frames], phase
    reaching: Array
    breath: Array  # (3,): of the mantle: the same

    def at(self, time: float, place: Array, heading: float) -> Posture:
        """Posture at a time [frames], the head at a place [pixels], turned to a heading."""
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
        return Posture(balls, posture.turns + heading)

    def at_rest(self) -> Posture:
        """With straight arms, the head at the origin, turned along x."""
        return self._posture(np.zeros((ARMS, JOINTS)), np.ones((ARMS, 1)), 1.0)

    def _posture(self, bends: Array, stretch: Array, breath: float) -> Posture:
        along = (np.arange(JOINTS) + 0.5) / JOINTS
        angles = self.arms[:, :1] + bends
        steps = np.stack([np.cos(angles), np.sin(angles)], axis=2)
        lengths = (self.arms[:, 1:2] * stretch / JOINTS)[..., None]
        roots = 0.6 * HEAD * np.stack([np.cos(self.arms[:, 0]), np.sin(self.arms[:, 0])], axis=1)
        joints = roots[:, None] + np.cumsum(steps * lengths, axis=1)
        radii = np.broadcast_to(THICK + (THIN - THICK) * along**0.8, angles.shape)
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
        return Posture(balls, np.concatenate([web_bends.ravel(), bends.ravel(), rigid]))


def _balls(places: Array, radii: Array, height: float, flat: float) -> Array:
    rest = np.broadcast_to([height, flat], (radii.size, 2))
    return np.concatenate([places.reshape(-1, 2), radii.reshape(-1, 1), rest], axis=1)


def _wave(waves: Array, time: float) -> Array:
    """Offset of each row: size times the sine of time."""
    size, period, phase = waves.T
    return np.asarray(size * np.sin(2 * np.pi * time / period + phase))


def drawn_body(random: np.random.Generator) -> Body:
    """An animal, drawn at random."""
    directions = np.linspace(-FIRST_ARM, FIRST_ARM, ARMS) + random.uniform(-0.12, 0.12, ARMS)
    # Left arms curl to the left and right ones to the right, but for some.
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
    """Looks of a body, each of shape (SIDE, SIDE, 3), BGR in [0, 1].

    In which order places change from one to another is drawn at random.
    """

    def __init__(self, random: np.random.Generator, body: Body, looks: Sequence[Array]) -> None:
        rest = body.at_rest().balls
        self._rest = rest[:, :2]
        worn = moulded(rest, (-SIDE / 2, -SIDE / 2), 1.0, (SIDE, SIDE))[1] >= 0
        # Of the colour that it stands for, whatever part of a texture lies on the body.
        fitted = (look * (look.mean(axis=(0, 1)) / look[worn].mean(axis=0)) for look in looks)
        eyes = body.scale * EYES, body.scale * EYE
        self._looks = np.stack([_with_eyes(look, *eyes) for look in fitted]).astype(np.float32)
        order = fractal(random, SIDE, 16, 64, 0.6)
        ranks = order.ravel().argsort().argsort() / order.size
        self._order: Floats = ranks.reshape(order.shape).astype(np.float32)

    def seen(
        self,
        posture: Posture,
        corner: tuple[int, int],
        size: tuple[int, int],
        before: int,
        after: int,
        share: float,
    ) -> Floats:
        """BGR in [0, 1] and coverage in a window of the picture, with `FINE` samples a pixel.

        The window has a left top corner and a width and height [pixels]. A `share` in [0, 1] of
        the change from one look to another, given by their indices, has come.
        """
        shape = size[1] * FINE, size[0] * FINE
        left, top, step = float(corner[0]), float(corner[1]), 1 / FINE
        height, owner = moulded(posture.balls, (left, top), step, shape)
        looks = self._looks[before], self._looks[after]
        light = lit(height * FINE, ROUNDED)
        colour = np.zeros((*shape, 4), np.float32)
        colour_skin(
            owner, left, top, step, self._to_rest(posture), *looks, self._order, share, SOFT,
            light, colour,
        )  # fmt: skip
        return colour

    def _to_rest(self, posture: Posture) -> Array:
        """From the picture to places in the looks, by ball; shape (k, 2, 3)."""
        cosine, sine = np.cos(posture.turns), np.sin(posture.turns)
        rows = np.stack([cosine, sine], axis=1), np.stack([-sine, cosine], axis=1)
        turn = np.stack(rows, axis=1)
        turned = np.einsum("kij,kj->ki", turn, posture.balls[:, :2])
        shift = self._rest - turned + (SIDE / 2 - 0.5)
        return np.concatenate([turn, shift[..., None]], axis=2)


def _with_eyes(look: Array, places: Array, radius: float) -> Array:
    """A look with irises and slit pupils painted on it."""
    result = look.copy()
    rows, columns = np.indices(look.shape[:2]) + 0.5 - SIDE / 2
    for x, y in places:
        right, down = columns - x, rows - y
        result[right * right + down * down <= radius * radius] = IRIS
        result[(np.abs(right) < 0.7 * radius) & (np.abs(down) < 0.25 * radius)] = PUPIL
    return result
