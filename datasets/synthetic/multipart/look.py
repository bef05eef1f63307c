"""Clothes and body textures of a walking person, wrapped around the parts of the body.

A body part is round like a sleeve, along a mostly upright centre line. In every image row it covers
one span of pixels. Sideways motion during the exposure turns the ends of the span into ramps, which
is the exact average over the exposure. The texture around a part determines its appearance from
every side. All pixel arithmetic uses integers.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numba import njit
from numpy.random import Generator
from numpy.typing import NDArray

from trackmark.datasets.interface import Array
from trackmark.datasets.synthetic.render.colours import BGR
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

# number of stripes on each part of striped clothes, and fraction that they cover
STRIPES, STRIPES_SHARE = 5, 0.8


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
    # True for broad stripes: in the trousers' colour on the shirt, and vice versa
    striped: bool = False
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
    cloth = _striped(look, look.trousers, look.jacket or look.shirt, rows) * folded(1.0)[..., None]
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


def _striped(look: WalkerLook, colour: Array | BGR, other: BGR, rows: Array) -> Array:
    """Return the colours of cloth, with broad horizontal stripes if the clothes are striped."""
    cloth = _plain(colour)
    if not look.striped:
        return cloth
    band = np.broadcast_to(rows * STRIPES % 1 < STRIPES_SHARE, cloth.shape[:2])[..., None]
    return np.where(band, np.array(other, np.float64), cloth)


def _weave(look: WalkerLook, colour: Array, rows: Array) -> Array:
    cloth = _striped(look, colour, look.trousers, rows)
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
