"""Renderer of a clothed walking person in any gait phase, heading and size.

Lengths of the body are fractions of the standing height. The body faces forward.

A body part is round like a sleeve, along a mostly upright centre line. In every image row it covers
one span of pixels. Sideways motion during the exposure turns the ends of the span into ramps, which
is the exact average over the exposure. The texture around a part determines its appearance from
every side. All pixel arithmetic uses integers.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numba import njit
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.interface import Array
from trackmark.datasets.synthetic.render.colours import BGR
from trackmark.datasets.synthetic.render.prop import Coverage
from trackmark.datasets.synthetic.render.sprite import Sprite, superellipse
from trackmark.datasets.synthetic.render.texture import creases, fractal
from trackmark.datasets.synthetic.scene import part_generator

COLUMNS = (
    5  # numbers of a node (cross-section) of a part: row, centre, half width, blur, texture row
)
ROWS = 128  # number of texture rows, from the upper to the lower end of a part
AROUND = 256  # number of texture columns around a part; column 0 is the front

_ANGLES = np.round(np.arcsin(np.arange(-256, 257) / 256) / (2 * np.pi) * AROUND).astype(np.int64)
_FACING = np.sqrt(1 - (np.arange(-256, 257) / 257) ** 2)
_SHADES = np.round(256 * (0.60 + 0.44 * _FACING - 0.10 * np.arange(-256, 257) / 256)).astype(
    np.int64
)


@njit(cache=True)
def _row_span(nodes: NDArray[np.int64], y: int) -> tuple[int, int, int, int, int]:
    """Return centre, half width, blur [1/64 pixel], texture row, and coverage [1/256] of a row."""
    top, bottom = nodes[0, 0], nodes[-1, 0]
    inside = min((y + 1) << 6, bottom) - max(y << 6, top)
    if inside <= 0:
        return 0, 0, 64, 0, 0
    middle = min(max((y << 6) + 32, top), bottom - 1)
    k = 0
    while k + 2 < len(nodes) and nodes[k + 1, 0] <= middle:
        k += 1
    length = max(nodes[k + 1, 0] - nodes[k, 0], 1)
    share = ((middle - nodes[k, 0]) << 10) // length
    centre = nodes[k, 1] + (((nodes[k + 1, 1] - nodes[k, 1]) * share) >> 10)
    half = nodes[k, 2] + (((nodes[k + 1, 2] - nodes[k, 2]) * share) >> 10)
    blur = nodes[k, 3] + (((nodes[k + 1, 3] - nodes[k, 3]) * share) >> 10)
    row = nodes[k, 4] + (((nodes[k + 1, 4] - nodes[k, 4]) * share) >> 10)
    return centre, max(half, 8), max(blur, 64), row, inside * 4


@njit(cache=True)
def _covered(x: int, centre: int, half: int, ramp: int) -> int:
    """Return the coverage of a pixel by a span with edges of the width `ramp` [1/256]."""
    distance = half - abs((x << 6) + 32 - centre)
    value = ((2 * distance + ramp) << 7) // ramp
    # A span that is narrower than its ramp never covers a whole pixel.
    return min(max(value, 0), 256, (half << 9) // ramp)


@njit(cache=True)
def paint_part(
    canvas: NDArray[np.uint8],
    nodes: NDArray[np.int64],
    texture: NDArray[np.uint8],
    front: int,
    gains: NDArray[np.int64],
) -> None:
    """Paint a part over a canvas in place.

    `nodes`, shape (k, COLUMNS), are sorted by row; the units are 1/64 pixel and 1/64 texture row.
    `texture`, shape (ROWS, AROUND, 3), is wrapped around the part; its column `front` faces the
    camera. `gains` is the light in every row of the canvas, times 256.
    """
    height, width = canvas.shape[:2]
    for y in range(max(nodes[0, 0] >> 6, 0), min((nodes[-1, 0] >> 6) + 1, height)):
        centre, half, ramp, row, inside = _row_span(nodes, y)
        if inside == 0:
            continue
        reach = half + (ramp >> 1)
        first, last = max((centre - reach) >> 6, 0), min(((centre + reach) >> 6) + 1, width)
        line = texture[min(max(row >> 6, 0), ROWS - 1)]
        # The position across the part, as quotient and remainder; only the quotient is used.
        start = ((first << 6) + 32 - centre) << 8
        quotient, remainder = start // half, start % half
        step, step_remainder = (64 << 8) // half, (64 << 8) % half
        inner_cover = (min(256, (half << 9) // ramp) * inside) >> 8
        for x in range(first, last):
            u = min(max(quotient, -256), 256) + 256
            quotient, remainder = quotient + step, remainder + step_remainder
            if remainder >= half:
                quotient, remainder = quotient + 1, remainder - half
            if 2 * (half - abs((x << 6) + 32 - centre)) >= ramp:  # inner pixels of the span
                cover = inner_cover
            else:
                cover = (_covered(x, centre, half, ramp) * inside) >> 8
            if cover == 0:
                continue
            around = (_ANGLES[u] + front) & (AROUND - 1)
            light = _SHADES[u] * gains[y]
            for c in range(3):
                value = min((line[around, c] * light) >> 16, 255)
                canvas[y, x, c] += ((value - canvas[y, x, c]) * cover + 128) >> 8


@njit(cache=True)
def silhouette(nodes: NDArray[np.int64]) -> tuple[int, int, NDArray[np.uint8]]:
    """Return the silhouette of parts at mid-exposure: left, top and coverage.

    `nodes`, shape (parts, k, COLUMNS), are those of `paint_part`.
    """
    left = ((nodes[:, :, 1] - nodes[:, :, 2]).min() >> 6) - 1
    right = ((nodes[:, :, 1] + nodes[:, :, 2]).max() >> 6) + 2
    top, bottom = nodes[:, :, 0].min() >> 6, (nodes[:, :, 0].max() >> 6) + 1
    coverage = np.zeros((bottom - top, right - left), np.uint8)
    for part in nodes:
        _cover_part(coverage, part, left, top)
    return left, top, coverage


@njit(cache=True)
def _cover_part(coverage: NDArray[np.uint8], nodes: NDArray[np.int64], left: int, top: int) -> None:
    """Add the coverage by a part at mid-exposure to a silhouette whose corner is (left, top)."""
    height, width = coverage.shape
    for row in range(max((nodes[0, 0] >> 6) - top, 0), min((nodes[-1, 0] >> 6) + 1 - top, height)):
        centre, half, _, _, inside = _row_span(nodes, row + top)
        if inside == 0:
            continue
        first = max(((centre - half - 32) >> 6) - left, 0)
        last = min(((centre + half + 32) >> 6) + 1 - left, width)
        for x in range(first, last):
            cover = (_covered(x + left, centre, half, 64) * inside) >> 8
            if cover > 0:
                uncovered = (255 - np.int64(coverage[row, x])) * (256 - cover)
                coverage[row, x] = 255 - (uncovered >> 8)


_QUARTER = AROUND // 4


@dataclass(frozen=True)
class WalkerLook:
    """Clothes and build of a person. Colours are BGR in [0, 255]."""

    shirt: BGR
    trousers: BGR
    hair: BGR = (38, 46, 58)
    skin: BGR = (132, 160, 205)
    shoes: BGR = (44, 44, 50)
    # jacket, worn open over the shirt, which is then visible only from the front
    jacket: BGR | None = None
    bag: BGR | None = None  # backpack, visible from behind and from the side
    # length of the sleeves of the upper garment
    weave: Literal["plain", "stripes", "knit"] = "plain"
    long_hair: bool = False  # True for hair down to the shoulders
    hem: float = 0.475  # lower end of the upper garment, in standing heights above the ground
    bulk: float = 1.0  # relative breadth of the body
    loose: float = 1.0  # relative breadth of the trousers


def wrap_textures(look: WalkerLook, seed: int) -> NDArray[np.uint8]:
    """Return the textures of the parts in the order of `walker.PARTS`, shape (9, 128, 256, 3)."""
    random = part_generator(seed, "clothes")
    rows = np.arange(ROWS)[:, None] / ROWS
    turn = np.arange(AROUND, dtype=np.float64)[None, :]
    turn = np.minimum(turn, AROUND - turn)  # distance from the front, 0 to 128
    upper = np.array(look.jacket or look.shirt, np.float64)
    folded = _ClothFolds(random)
    legs = [_leg(look, folded, rows, turn) for _ in range(2)]
    shoes = [_shoe(look, random, rows)] * 2
    arms = [_arm(look, upper, folded, rows) for _ in range(2)]
    parts = [*legs, *shoes, *arms, _torso(look, upper, folded, rows, turn)]
    parts += [_head(look, random, rows, turn), _pack(look, folded, rows, turn)]
    return np.clip(np.round(np.stack(parts)), 0, 255).astype(np.uint8)


class _ClothFolds:
    """Shading of cloth: broad folds across a part, steep folds along it, and grain.

    A person has one pair of patterns; each part uses a different section of these patterns.
    """

    def __init__(self, random: Generator) -> None:
        self._random = random
        self._broad, self._slope = creases(random, AROUND)

    def __call__(self, strength: float) -> Array:
        """Return a light gain, shape (ROWS, AROUND)."""
        down, around = self._random.integers(0, AROUND, 2)
        rows = np.arange(ROWS)[:, None]
        columns = np.arange(AROUND)[None, :] + around
        broad = self._broad[(2 * rows + down) % AROUND, columns % AROUND]
        slope = self._slope[(rows + down) % AROUND, (columns + rows // 3) % AROUND]
        grain = self._random.normal(0, 0.016, (ROWS, AROUND))
        return np.asarray(1 + strength * (0.10 * broad + 0.34 * slope) + grain)


def _plain(colour: Array | BGR) -> Array:
    return np.broadcast_to(np.asarray(colour, np.float64), (ROWS, AROUND, 3)).copy()


def _leg(look: WalkerLook, folded: _ClothFolds, rows: Array, turn: Array) -> Array:
    cloth = _plain(look.trousers) * folded(1.0)[..., None]
    knee = np.exp(-np.square((rows - 0.5) / 0.07)) * np.clip(1 - turn / 60, 0, 1)
    behind = np.exp(-np.square((rows - 0.53) / 0.05)) * np.clip((turn - 70) / 50, 0, 1)
    seam = np.abs(turn - _QUARTER) < 2
    hem = rows > 0.97
    gain = 1 + 0.07 * knee - 0.18 * behind - 0.10 * seam - 0.16 * hem
    return np.asarray(cloth * gain[..., None])


def _shoe(look: WalkerLook, random: Generator, rows: Array) -> Array:
    leather = _plain(look.shoes) * (1 + 0.05 * random.normal(0, 1, (ROWS, AROUND)))[..., None]
    sole = np.broadcast_to(rows > 0.8, (ROWS, AROUND))[..., None]
    return np.where(sole, leather * 0.45 + 22, leather * (1.15 - 0.3 * rows)[..., None])


def _arm(look: WalkerLook, upper: Array, folded: _ClothFolds, rows: Array) -> Array:
    cloth = _weave(look, upper, rows) * folded(1.1)[..., None]
    inner = np.exp(-np.square((rows - 0.45) / 0.05))
    cuff = (rows > 0.80) & (rows < 0.83)
    cloth = cloth * (1 - 0.14 * inner - 0.2 * cuff)[..., None]
    hand = _plain(look.skin) * (1.0 - 0.25 * np.clip((rows - 0.9) / 0.1, 0, 1))[..., None]
    return np.where(np.broadcast_to(rows >= 0.83, (ROWS, AROUND))[..., None], hand, cloth)


def _torso(look: WalkerLook, upper: Array, folded: _ClothFolds, rows: Array, turn: Array) -> Array:
    cloth = _weave(look, upper, rows) * folded(0.8)[..., None]
    shoulder_blades = np.exp(-np.square((rows - 0.3) / 0.12)) * np.clip((turn - 90) / 30, 0, 1)
    cloth = cloth * (1 + 0.05 * shoulder_blades)[..., None]
    if look.jacket is None:
        collar = (rows < 0.06) & (turn < 200)
        buttons = (turn < 2) & (rows < 0.98)
        cloth = cloth * (1 - 0.16 * collar - 0.12 * buttons)[..., None]
    else:
        width = 9 + 9 * rows
        opened = np.clip(width - turn + 0.5, 0, 1)[..., None]
        shirt = _plain(look.shirt) * folded(0.5)[..., None]
        edge = np.clip(1 - np.abs(turn - width - 2) / 3, 0, 1)
        cloth = (cloth * (1 - 0.3 * edge)[..., None]) * (1 - opened) + shirt * opened
    if look.bag is not None:  # straps of the bag
        strap = np.clip(2.5 - np.abs(turn - (34 - 14 * rows)), 0, 1) * (rows < 0.55)
        cloth = cloth + (np.array(look.bag) * 0.8 - cloth) * strap[..., None]
    hem = rows > 0.965
    return cloth * (1 - 0.2 * hem)[..., None]


def _weave(look: WalkerLook, colour: Array, rows: Array) -> Array:
    cloth = _plain(colour)
    if look.weave == "stripes":
        band = (np.sin(rows * 2 * np.pi * 9) > 0.25)[..., None]
        cloth = np.where(np.broadcast_to(band, cloth.shape), cloth * 0.72 + 14, cloth)
    elif look.weave == "knit":
        ribs = np.sin(np.arange(AROUND)[None, :] * 2 * np.pi / 8)[..., None]
        cloth = cloth * (1 + 0.05 * ribs)
    return cloth


def _head(look: WalkerLook, random: Generator, rows: Array, turn: Array) -> Array:
    skin = _plain(look.skin)
    v = rows * np.ones_like(turn)
    cheeks = np.exp(-np.square((v - 0.52) / 0.1) - np.square((turn - 26) / 12))
    skin = skin * (1 + np.array([-0.06, -0.06, 0.05]) * cheeks[..., None])
    skin = skin * (1 - 0.22 * np.clip((v - 0.68) / 0.1, 0, 1))[..., None]  # below the chin
    eyes = np.exp(-np.square((v - 0.40) / 0.035) - np.square((turn - 17) / 6))
    brows = np.exp(-np.square((v - 0.34) / 0.02) - np.square((turn - 17) / 9))
    mouth = np.exp(-np.square((v - 0.61) / 0.022) - np.square(turn / 10))
    nose = np.exp(-np.square((v - 0.49) / 0.05) - np.square((turn - 4) / 3))
    dark = np.clip(0.75 * eyes + 0.5 * brows + 0.35 * mouth + 0.2 * nose, 0, 1)[..., None]
    skin = skin * (1 - dark) + np.array([40.0, 44.0, 70.0]) * dark
    ears = np.exp(-np.square((v - 0.46) / 0.07) - np.square((turn - 66) / 6))
    skin = skin * (1 - 0.12 * ears)[..., None]
    strands = fractal(random, AROUND, 8, 128, 0.8)[::2, :]
    hair = _plain(look.hair) * (1 + 0.22 * strands + 0.12 * (0.3 - v))[..., None]
    line = 0.22 + 0.42 * np.clip((turn - 34) / 30, 0, 1)  # hair reaches lower at the sides
    line = np.where(turn > 78, 0.74, line)
    if look.long_hair:
        line = np.where(turn > 46, 1.2, line)
    covered = np.clip((line + 0.03 * strands - v) * 25, 0, 1)[..., None]
    return np.asarray(skin * (1 - covered) + hair * covered)


def _pack(look: WalkerLook, folded: _ClothFolds, rows: Array, turn: Array) -> Array:
    cloth = _plain(look.bag or (0, 0, 0)) * folded(0.7)[..., None]
    pocket = ((rows > 0.5) & (rows < 0.53)) | (np.abs(rows - 0.14) < 0.012)
    return cloth * (1 - 0.3 * (pocket & (turn > 40)))[..., None]


PARTS = (
    "left leg", "right leg", "left shoe", "right shoe",
    "left arm", "right arm", "torso", "head", "pack",
)  # fmt: skip

NODES = 9
_THIGH, _SHANK, _ANKLE = 0.245, 0.235, 0.045
_EXPOSURE = 0.02  # fraction of a gait cycle that passes during the exposure at full stride


@njit(cache=True)
def _leg_angles(phase: float, stride: float) -> tuple[float, float]:
    """Return hip angle (forward positive) and knee flexion of the left leg [radians]."""
    turn = 2 * np.pi * phase
    hip = stride * (0.36 * np.sin(turn) + 0.09)
    swing = max(0.0, np.cos(turn + 0.2))
    return hip, 0.06 + stride * (0.95 * swing**3 + 0.12 * max(0.0, -np.sin(turn + 0.6)))


@njit(cache=True)
def _skeleton(phase: float, stride: float, forward: float, side: float, build: Array) -> Array:
    """Return nodes of all parts, shape (parts, nodes, 4).

    The columns are height, sideways offset, half width, and position along the part in [0, 1].
    `forward` and `side` are the components to the right, in the image, of the body's forward and
    left direction: cosine and sine of the heading.
    """
    parts = np.zeros((9, NODES, 4))
    bulk, sleeve, hem, loose = build[0], build[1], build[2], build[3]
    hips = 0.0
    angles = np.zeros((2, 2))
    for leg in range(2):
        angles[leg] = _leg_angles(phase + 0.5 * leg, stride)
        reach = _THIGH * np.cos(angles[leg, 0]) + _SHANK * np.cos(angles[leg, 0] - angles[leg, 1])
        hips = max(hips, reach + _ANKLE)
    bob = hips - (_THIGH + _SHANK + _ANKLE)
    for leg in range(2):
        lateral = 0.048 if leg == 0 else -0.048
        hip, knee = angles[leg]
        lower = hip - knee
        knee_x = lateral * side + _THIGH * np.sin(hip) * forward
        knee_y = hips - _THIGH * np.cos(hip)
        ankle_x = knee_x + _SHANK * np.sin(lower) * forward
        ankle_y = knee_y - _SHANK * np.cos(lower)
        for k in range(NODES):
            t = k / (NODES - 1)
            # A quadratic spline through thigh and shank, because cloth bends smoothly.
            if t < 0.5:
                a = 2 * t
                x = lateral * side * (1 - a) + knee_x * a
                y = (hips + 0.03) * (1 - a) + knee_y * a
            else:
                a = 2 * t - 1
                x = knee_x * (1 - a) + ankle_x * a
                y = knee_y * (1 - a) + (ankle_y - 0.008) * a
            bend = max(0.0, 1 - abs(t - 0.5) * 4)
            x += bend * 0.12 * ((lateral * side + ankle_x) / 2 - knee_x)
            slope = hip if t < 0.5 else lower
            width = (0.058 - 0.022 * t + 0.005 * np.sin(6.28 * t)) * bulk * loose
            if t == 0.0:
                width *= 0.8
            if t > 0.9:
                width *= 1.05
            parts[leg, k] = y, x, width / max(0.72, np.cos(slope * forward)), t
        pitch = lower * 0.55
        for k in range(NODES):
            t = k / (NODES - 1)
            y = ankle_y + 0.012 - t * (_ANKLE + 0.010)
            pitched = 1 - 0.45 * min(1.0, abs(pitch))
            length = 0.027 + 0.050 * np.sqrt(t) * abs(forward) * pitched
            shift = (0.010 + 0.034 * np.sqrt(t)) * forward * pitched
            parts[2 + leg, k] = y, ankle_x + shift + 0.03 * pitch * forward * t, length, t
    for arm in range(2):
        lateral = 0.118 * bulk if arm == 0 else -0.118 * bulk
        swing = -0.85 * stride * np.sin(2 * np.pi * (phase + 0.5 * arm)) * 0.48
        elbow = 0.22 + 0.25 * stride * max(0.0, np.sin(swing))
        shoulder_y = 0.812 + bob
        elbow_x = lateral * side * 1.08 + 0.165 * np.sin(swing) * forward
        elbow_y = shoulder_y - 0.165 * np.cos(swing)
        hand = swing + elbow
        hand_x = elbow_x + 0.205 * np.sin(hand) * forward
        hand_y = elbow_y - 0.205 * np.cos(hand)
        for k in range(NODES):
            t = k / (NODES - 1)
            if t < 0.45:
                a = t / 0.45
                x = lateral * side * (0.86 * (1 - a)) + elbow_x * a
                y = (shoulder_y + 0.004) * (1 - a) + elbow_y * a
            else:
                a = (t - 0.45) / 0.55
                x, y = elbow_x * (1 - a) + hand_x * a, elbow_y * (1 - a) + hand_y * a
            width = (0.041 - 0.016 * t) * sleeve
            if t > 0.8:
                width = 0.021 - 0.008 * max(0.0, t - 0.93) / 0.07
            if k < 2:
                width = (0.020 + 0.020 * k) * sleeve
            parts[4 + arm, k] = y, x, width, t
    heights = np.array([0.860, 0.846, 0.828, 0.790, 0.72, 0.64, 0.585, 0.53, hem])
    across = np.array([0.034, 0.066, 0.104, 0.118, 0.109, 0.100, 0.099, 0.106, 0.108])
    deep = np.array([0.034, 0.046, 0.060, 0.074, 0.076, 0.070, 0.070, 0.076, 0.074])
    for k in range(NODES):
        half = np.hypot(across[k] * side, deep[k] * forward) * bulk
        lean = 0.012 * forward * (heights[k] - hem) / 0.4
        parts[6, k] = heights[k] + bob, lean, half, (0.860 - heights[k]) / (0.860 - hem)
    heights = np.array([1.0, 0.992, 0.978, 0.955, 0.93, 0.905, 0.885, 0.868, 0.838])
    across = np.array([0.012, 0.030, 0.043, 0.049, 0.048, 0.043, 0.032, 0.030, 0.034])
    deep = np.array([0.014, 0.036, 0.052, 0.059, 0.058, 0.052, 0.036, 0.031, 0.034])
    for k in range(NODES):
        half = np.hypot(across[k] * side, deep[k] * forward)
        nod = (0.022 if k < 6 else 0.012) * forward
        parts[7, k] = heights[k] + bob, nod, half, (1.0 - heights[k]) / 0.162
    heights = np.linspace(0.83, 0.55, NODES)
    for k in range(NODES):
        t = k / (NODES - 1)
        round_off = np.sqrt(max(0.0, 1 - (2 * t - 1) ** 4))
        half = np.hypot(0.082 * side, 0.052 * forward) * (0.25 + 0.75 * round_off)
        parts[8, k] = heights[k] + bob, -0.105 * forward, half, t
    return parts


@njit(cache=True)
def place_parts(
    x: float,
    y: float,
    height: float,
    phase: float,
    stride: float,
    heading: float,
    build: Array,
    motion_x: float,
) -> NDArray[np.int64]:
    """Return the nodes of all parts in the image, shape (parts, nodes, 5); see `COLUMNS`.

    (`x`, `y`) is the ground point below the body's axis, `height` the height of the standing
    person, and `motion_x` the horizontal motion during the exposure [pixels]. Phase, stride and
    heading are as in `GaitPose`. `build` is breadth, width of the sleeves, hem of the upper
    garment, and width of the trousers.
    """
    forward, side = np.cos(heading), np.sin(heading)
    now = _skeleton(phase, stride, forward, side, build)
    step = _EXPOSURE * stride
    before = _skeleton(phase - step / 2, stride, forward, side, build)
    after = _skeleton(phase + step / 2, stride, forward, side, build)
    nodes = np.zeros((len(now), NODES, 5), np.int64)
    for p in range(len(now)):
        for k in range(NODES):
            moved = (after[p, k, 1] - before[p, k, 1]) * height + motion_x
            nodes[p, k, 0] = round((y - now[p, k, 0] * height) * 64)
            nodes[p, k, 1] = round((x + now[p, k, 1] * height) * 64)
            nodes[p, k, 2] = round(now[p, k, 2] * height * 64)
            nodes[p, k, 3] = 64 + round(abs(moved) * 64)
            nodes[p, k, 4] = round(now[p, k, 3] * 128 * 64)
        for k in range(1, NODES):  # Rows must increase.
            nodes[p, k, 0] = max(nodes[p, k, 0], nodes[p, k - 1, 0] + 1)
    return nodes


_SHADOW = 64  # half width of the contact shadow's sprite [pixels]


@dataclass(frozen=True)
class GaitPose:
    """Gait phase, stride and heading of a body."""

    phase: float  # gait cycles; one cycle is two steps
    stride: float  # relative step length in [0, 1]; 0 is standing
    heading: float  # 0 is to the right, π/2 towards the camera, -π/2 away from it [radians]


class Walker:
    """Clothed person; `seed` initialises folds, strands of hair and weave."""

    def __init__(self, look: WalkerLook, seed: int) -> None:
        self.look = look
        self._seed = seed
        sleeves = 1.0 if look.jacket is None else 1.12
        self._build = np.array([look.bulk, sleeves, look.hem, look.loose])
        coverage = superellipse(2 * _SHADOW // 3, 2 * _SHADOW, _SHADOW / 4, _SHADOW * 0.85, 2)[2]
        shade = Sprite(np.zeros((*coverage.shape, 3)), coverage)
        self._shadow = shade.shadow(0.42, _SHADOW // 8)

    def draw(
        self,
        canvas: NDArray[np.uint8],
        x: float,
        y: float,
        height: float,
        pose: GaitPose,
        gains: ArrayLike,
        motion: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        """Draw the person with a soft contact shadow over a canvas in place.

        (`x`, `y`) is the ground point below the body's axis, and `height` the height of the
        standing person [pixels]. The pose is that at the middle of the exposure; the limbs are
        blurred by their motion. `gains` is the light at evenly spaced heights from head to ground.
        `motion` is the motion of the whole person during the exposure, right and down [pixels]; its
        vertical part is too small to be visible and is ignored.
        """
        light = np.asarray(gains, np.float64)
        self._draw_shadow(canvas, x, y, height)
        rows = np.arange(len(canvas)) + 0.5
        place = np.clip((rows - (y - height)) / height, 0, 1) * (len(light) - 1)
        row_gains = np.round(np.interp(place, np.arange(len(light)), light) * 256)
        front = round((pose.heading - np.pi / 2) / (2 * np.pi) * AROUND)
        nodes = self._nodes(x, y, height, pose, motion[0])
        for part in self._order(pose):
            paint_part(canvas, nodes[part], self._textures[part], front, row_gains.astype(np.int64))

    def coverage(self, x: float, y: float, height: float, pose: GaitPose) -> Coverage:
        """Return the silhouette at mid-exposure; its window may lie outside the image."""
        nodes = self._nodes(x, y, height, pose, 0.0)[self._order(pose)]
        covered: Coverage = silhouette(nodes)
        return covered

    def _draw_shadow(self, canvas: NDArray[np.uint8], x: float, y: float, height: float) -> None:
        middle = np.array([[x, y - 0.012 * height]])
        self._shadow.draw(canvas, middle, 0.19 * height / _SHADOW)

    @cached_property
    def _textures(self) -> NDArray[np.uint8]:
        """Textures of the parts, which are not painted for silhouettes."""
        return wrap_textures(self.look, self._seed)

    def _nodes(
        self, x: float, y: float, height: float, pose: GaitPose, motion: float
    ) -> NDArray[np.int64]:
        placed: NDArray[np.int64] = place_parts(
            float(x),
            float(y),
            float(height),
            float(pose.phase),
            float(pose.stride),
            float(pose.heading),
            self._build,
            float(motion),
        )
        return placed

    def _order(self, pose: GaitPose) -> list[int]:
        """Return the parts from the farthest to the nearest."""
        near, far = ("right", "left") if np.cos(pose.heading) > 0 else ("left", "right")
        pack = [] if self.look.bag is None else ["pack"]
        on_his_back = ["torso", "head", *pack]
        trunk = on_his_back if np.sin(pose.heading) < -0.2 else [*pack, "torso", "head"]
        order = [f"{far} arm", f"{far} shoe", f"{far} leg", f"{near} shoe", f"{near} leg"]
        return [PARTS.index(name) for name in [*order, *trunk, f"{near} arm"]]
