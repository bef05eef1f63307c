"""Things of a street: lamp posts, signs, bins; trees and bushes, which are clumps of leaves."""

import cv2
import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.render.prop import Prop
from datasets.synthetic.render.texture import fractal

__all__ = ["bush", "litter_bin", "post", "sign", "tree"]

Array = NDArray[np.float64]


def post(
    random: np.random.Generator, x: float, z: float, scale: float, thickness: float | None = None
) -> Prop:
    """Lamp post or pillar, higher than the picture.

    Parameters
    ----------
    random : numpy.random.Generator
        Draws its colour and, where none is given, its thickness.
    x, z : float
        Where it stands [metres].
    scale : float
        At its depth [pixels/metre].
    thickness : float, optional
        [metres].
    """
    thick = random.uniform(0.10, 0.18) if thickness is None else thickness
    colour, coverage = _upright(4.5 * scale, thick * scale, _metal(random))
    base = round(0.5 * scale)
    wide = _upright(base, 1.7 * thick * scale, _metal(random) * 0.9)
    return _stacked(x, z, colour, coverage, *wide)


def sign(random: np.random.Generator, x: float, z: float, scale: float) -> Prop:
    """Round or square sign on a pole."""
    colour, coverage = _upright(2.2 * scale, 0.07 * scale, np.array([150.0, 152.0, 154.0]))
    radius = random.uniform(0.26, 0.34) * scale
    size = int(np.ceil(2 * radius)) + 2
    y, x_ = (np.indices((size, size)) + 0.5 - size / 2) / radius
    far = np.hypot(x_, y) if random.random() < 0.6 else np.maximum(np.abs(x_), np.abs(y))
    plate = np.clip((1 - far) * radius + 0.5, 0, 1)
    rim, inner = ((44, 40, 170), (220, 222, 224)) if random.random() < 0.5 else (
        (220, 222, 224), (150, 84, 40))  # fmt: skip
    face = np.where((far > 0.78)[..., None], np.array(rim, np.float64), np.array(inner, np.float64))
    return _stacked(x, z, face, plate, colour, coverage)


def litter_bin(random: np.random.Generator, x: float, z: float, scale: float) -> Prop:
    """Litter bin."""
    paint = np.array(
        [[58, 84, 44], [60, 58, 58], [120, 70, 40], [44, 110, 150]][random.integers(4)]
    )
    body, cover = _upright(0.8 * scale, 0.46 * scale, paint.astype(np.float64))
    rows = np.arange(len(body))[:, None] / len(body)
    body = body * np.where((rows > 0.14) & (rows < 0.24), 0.45, 1.0)[..., None]
    lid, lid_cover = _upright(0.1 * scale, 0.54 * scale, paint * 0.7)
    return _stacked(x, z, lid, lid_cover, body, cover)


def _metal(random: np.random.Generator) -> Array:
    tone = random.uniform(60, 150)
    return np.array([tone, tone * random.uniform(0.98, 1.06), tone * 0.97])


def _upright(height: float, width: float, colour: Array) -> tuple[Array, Array]:
    """A cylinder: its picture and coverage."""
    rows, columns = max(1, round(height)), int(np.ceil(width)) + 2
    u = (np.arange(columns) + 0.5 - columns / 2) / (width / 2)
    cover = np.clip((1 - np.abs(u)) * width / 2 + 0.5, 0, 1)
    shade = 0.55 + 0.5 * np.sqrt(np.clip(1 - u * u, 0, 1)) - 0.18 * np.clip(u, -1, 1)
    picture = np.broadcast_to(colour * shade[:, None], (rows, columns, 3)).copy()
    return picture, np.broadcast_to(cover, (rows, columns)).copy()


def _stacked(
    x: float, z: float, upper: Array, upper_cover: Array, lower: Array, lower_cover: Array
) -> Prop:
    """One thing on another, in the middle; the whole stands on the ground."""
    width = max(upper.shape[1], lower.shape[1])
    height = len(upper) + len(lower)
    colour, coverage = np.zeros((height, width, 3)), np.zeros((height, width))
    for part, cover, top in ((upper, upper_cover, 0), (lower, lower_cover, len(upper))):
        left = (width - part.shape[1]) // 2
        colour[top : top + len(part), left : left + part.shape[1]] = part
        coverage[top : top + len(part), left : left + part.shape[1]] = cover
    return Prop(x, z, colour, coverage, height)


GREENS = ((44, 98, 72), (40, 84, 60), (52, 118, 96), (34, 76, 62), (48, 108, 120))
_LIGHT = np.array([-0.45, -0.65, 0.6])


def tree(random: np.random.Generator, x: float, z: float, scale: float) -> Prop:
    """Street tree of 5 to 8 metres.

    Parameters
    ----------
    random : numpy.random.Generator
        Draws its growth.
    x, z : float
        Where it stands [metres].
    scale : float
        At its depth [pixels/metre].
    """
    tall, wide = random.uniform(5.0, 7.5), random.uniform(2.8, 4.4)
    stem = random.uniform(2.0, 2.7)
    height, width = round((tall + 0.3) * scale), round((wide + 0.8) * scale)
    foot, middle = height - round(0.12 * scale), width / 2
    colour, coverage = np.zeros((height, width, 3)), np.zeros((height, width))
    _trunk(random, colour, coverage, middle, foot, stem * scale, tall * scale, scale)
    leaves = np.array(GREENS[random.integers(len(GREENS))], np.float64)
    grain = fractal(random, 256, 32, 128, 0.9)
    clumps = []
    for _ in range(46):
        angle, out = random.uniform(0, 2 * np.pi), np.sqrt(random.uniform())
        up = (stem + tall) / 2 + 0.15 + np.sin(angle) * out * (tall - stem) * 0.42
        taper = 1 - 0.45 * np.clip((up - stem) / (tall - stem), 0, 1)
        across = np.cos(angle) * out * wide * 0.42 * (0.6 + taper * 0.6)
        clumps.append((across, up, random.uniform(0.42, 0.85) * (0.75 + 0.35 * taper)))
    ordered = sorted(clumps, key=lambda clump: clump[1] * 0.5 + random.uniform(0, 3.0))
    for number, (across, up, size) in enumerate(ordered):
        depth = 0.55 + 0.45 * number / len(clumps)
        centre = (middle + across * scale, foot - up * scale)
        _clump(random, colour, coverage, centre, size * scale, leaves * depth, grain)
    return Prop(x, z, colour, coverage, foot)


def bush(random: np.random.Generator, x: float, z: float, scale: float) -> Prop:
    """Low bush, wider than high."""
    tall, wide = random.uniform(0.7, 1.3), random.uniform(1.2, 2.4)
    height, width = round((tall + 0.4) * scale), round((wide + 0.6) * scale)
    foot = height - round(0.1 * scale)
    colour, coverage = np.zeros((height, width, 3)), np.zeros((height, width))
    leaves = np.array(GREENS[random.integers(len(GREENS))], np.float64)
    grain = fractal(random, 256, 32, 128, 0.9)
    for number in range(22):
        depth = 0.6 + 0.4 * number / 22
        up = random.uniform(0.15, max(tall - 0.25, 0.3)) * (1.1 - 0.4 * number / 22)
        across = random.uniform(-0.5, 0.5) * (wide - 0.5)
        centre = (width / 2 + across * scale, foot - up * scale)
        size = random.uniform(0.2, 0.36) * scale
        _clump(random, colour, coverage, centre, size, leaves * depth, grain)
    return Prop(x, z, colour, coverage, foot)


def _clump(
    random: np.random.Generator,
    colour: Array,
    coverage: Array,
    centre: tuple[float, float],
    radius: float,
    leaves: Array,
    grain: Array,
) -> None:
    """Paint a ragged ball of leaves, lit from the left top, over what is there."""
    reach = int(np.ceil(1.5 * radius))
    left, top = round(centre[0]) - reach, round(centre[1]) - reach
    rows = slice(max(top, 0), min(top + 2 * reach, len(colour)))
    columns = slice(max(left, 0), min(left + 2 * reach, colour.shape[1]))
    if rows.start >= rows.stop or columns.start >= columns.stop:
        return
    y, x = np.mgrid[rows, columns].astype(np.float64)
    u, v = (x + 0.5 - centre[0]) / radius, (y + 0.5 - centre[1]) / radius
    shift = random.integers(0, 256, 2)
    ragged = grain[np.ix_((np.arange(rows.start, rows.stop) + shift[0]) % 256,
                          (np.arange(columns.start, columns.stop) + shift[1]) % 256)]  # fmt: skip
    distance = np.sqrt(u * u + v * v)
    cover = np.clip((1 + 0.34 * ragged - distance) * radius * 0.35, 0, 1)
    up = np.sqrt(np.clip(1 - distance * distance, 0, 1))
    facing = np.clip(u * _LIGHT[0] + v * _LIGHT[1] + up * _LIGHT[2], 0, 1)
    tone = 0.52 + 0.75 * facing + 0.30 * ragged
    here, behind = colour[rows, columns], coverage[rows, columns]
    here[:] = here + (np.clip(leaves * tone[..., None], 8, 255) - here) * cover[..., None]
    behind[:] = 1 - (1 - behind) * (1 - cover)


def _trunk(
    random: np.random.Generator,
    colour: Array,
    coverage: Array,
    middle: float,
    foot: float,
    stem: float,
    tall: float,
    scale: float,
) -> None:
    mask = np.zeros(coverage.shape, np.uint8)
    thick = random.uniform(0.09, 0.15) * scale
    lean = random.uniform(-0.15, 0.15) * scale
    shape = [(middle - 1.25 * thick, foot), (middle + 1.25 * thick, foot),
             (middle + 0.85 * thick, foot - 0.25 * stem),
             (middle + lean + 0.6 * thick, foot - stem),
             (middle + lean - 0.6 * thick, foot - stem),
             (middle - 0.85 * thick, foot - 0.25 * stem)]  # fmt: skip
    cv2.fillPoly(mask, [np.round(shape).astype(np.int32)], 255, cv2.LINE_AA)
    for _ in range(7):
        end = (middle + random.uniform(-1.4, 1.4) * scale, foot - random.uniform(stem, 0.85 * tall))
        start = (middle + lean, foot - stem * random.uniform(0.92, 1.0))
        points = np.round([start, end]).astype(int).tolist()
        cv2.line(mask, points[0], points[1], 255, max(1, round(0.45 * thick)), cv2.LINE_AA)
    bark = fractal(random, 256, 8, 128, 0.8)
    rows, columns = np.indices(coverage.shape)
    side = np.clip((columns - middle) / (1.3 * thick), -1, 1)
    tone = (0.92 - 0.30 * side) * (1 + 0.16 * bark[(rows // 3) % 256, (columns * 2) % 256])
    colour[:] = np.array([62.0, 76.0, 90.0]) * tone[..., None]
    coverage[:] = mask / 255
