"""Street objects: lamp posts, signs, bins, parked cars, trees and bushes."""

import cv2
import numpy as np
from numba import njit
from numpy.random import Generator
from numpy.typing import NDArray

from trackmark.datasets.interface import Array
from trackmark.datasets.synthetic.render.prop import Prop
from trackmark.datasets.synthetic.render.texture import fractal


def post(
    random: Generator, x: float, z: float, scale: float, thickness: float | None = None
) -> Prop:
    """Return a lamp post or pillar that is taller than the image.

    Position (x, z) and thickness are in metres; the default is the thickness of a lamp post.
    `scale` is the scale at the depth z [pixels/metre].
    """
    thick = random.uniform(0.10, 0.18) if thickness is None else thickness
    colour, coverage = _upright(4.5 * scale, thick * scale, _metal(random))
    base = round(0.5 * scale)
    wide = _upright(base, 1.7 * thick * scale, _metal(random) * 0.9)
    return _stacked(x, z, colour, coverage, *wide)


def sign(random: Generator, x: float, z: float, scale: float) -> Prop:
    """Return a round or square sign on a pole."""
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


def litter_bin(random: Generator, x: float, z: float, scale: float) -> Prop:
    """Return a litter bin."""
    paint = np.array(
        [[58, 84, 44], [60, 58, 58], [120, 70, 40], [44, 110, 150]][random.integers(4)]
    )
    body, cover = _upright(0.8 * scale, 0.46 * scale, paint.astype(np.float64))
    rows = np.arange(len(body))[:, None] / len(body)
    body = body * np.where((rows > 0.14) & (rows < 0.24), 0.45, 1.0)[..., None]
    lid, lid_cover = _upright(0.1 * scale, 0.54 * scale, paint * 0.7)
    return _stacked(x, z, lid, lid_cover, body, cover)


def _metal(random: Generator) -> Array:
    tone = random.uniform(60, 150)
    return np.array([tone, tone * random.uniform(0.98, 1.06), tone * 0.97])


def _upright(height: float, width: float, colour: Array) -> tuple[Array, Array]:
    rows, columns = max(1, round(height)), int(np.ceil(width)) + 2
    u = (np.arange(columns) + 0.5 - columns / 2) / (width / 2)
    cover = np.clip((1 - np.abs(u)) * width / 2 + 0.5, 0, 1)
    shade = 0.55 + 0.5 * np.sqrt(np.clip(1 - u * u, 0, 1)) - 0.18 * np.clip(u, -1, 1)
    picture = np.broadcast_to(colour * shade[:, None], (rows, columns, 3)).copy()
    return picture, np.broadcast_to(cover, (rows, columns)).copy()


def _stacked(
    x: float, z: float, upper: Array, upper_cover: Array, lower: Array, lower_cover: Array
) -> Prop:
    """Return an object that is centred on top of another object, which stands on the ground."""
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


def tree(random: Generator, x: float, z: float, scale: float) -> Prop:
    """Return a street tree of 5 to 8 metres at (x, z) [metres]; `scale` is in pixels/metre."""
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


def bush(random: Generator, x: float, z: float, scale: float) -> Prop:
    """Return a low bush, wider than high."""
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
    random: Generator,
    colour: Array,
    coverage: Array,
    centre: tuple[float, float],
    radius: float,
    leaves: Array,
    grain: Array,
) -> None:
    reach = int(np.ceil(1.5 * radius))
    left, top = round(centre[0]) - reach, round(centre[1]) - reach
    rows = slice(max(top, 0), min(top + 2 * reach, len(colour)))
    columns = slice(max(left, 0), min(left + 2 * reach, colour.shape[1]))
    if rows.start >= rows.stop or columns.start >= columns.stop:
        return
    shift = random.integers(0, 256, 2)
    corner = np.array([rows.start, columns.start])
    _paint_leaves(
        colour[rows, columns], coverage[rows, columns], corner, centre, radius, leaves, grain, shift
    )


@njit(cache=True)
def _paint_leaves(
    colour: Array,
    coverage: Array,
    corner: NDArray[np.int64],
    centre: tuple[float, float],
    radius: float,
    leaves: Array,
    grain: Array,
    shift: NDArray[np.int64],
) -> None:
    """Paint a ball of leaves into a window; `corner` is its row and column in the image."""
    for i in range(len(colour)):
        row = i + corner[0]
        v = (row + 0.5 - centre[1]) / radius
        for j in range(colour.shape[1]):
            column = j + corner[1]
            u = (column + 0.5 - centre[0]) / radius
            ragged = grain[(row + shift[0]) % 256, (column + shift[1]) % 256]
            distance = np.sqrt(u * u + v * v)
            cover = min(max((1 + 0.34 * ragged - distance) * radius * 0.35, 0.0), 1.0)
            if cover == 0:
                continue
            up = np.sqrt(min(max(1 - distance * distance, 0.0), 1.0))
            facing = min(max(u * _LIGHT[0] + v * _LIGHT[1] + up * _LIGHT[2], 0.0), 1.0)
            tone = 0.52 + 0.75 * facing + 0.30 * ragged
            for c in range(3):
                painted = min(max(leaves[c] * tone, 8.0), 255.0)
                colour[i, j, c] = colour[i, j, c] + (painted - colour[i, j, c]) * cover
            coverage[i, j] = 1 - (1 - coverage[i, j]) * (1 - cover)


def _trunk(
    random: Generator,
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


PAINTS = (
    (176, 180, 182),
    (60, 58, 58),
    (120, 84, 52),
    (52, 44, 130),
    (206, 210, 212),
    (84, 96, 60),
    (110, 110, 112),
    (70, 120, 150),
)
FINE = 3  # supersampling of cars per axis

Outline = list[tuple[float, float]]

# outlines in metres, forward to the right, up from the ground
_BODY = [(-2.05, 0.34), (-2.08, 0.62), (-2.0, 0.86), (-1.6, 0.94), (-1.05, 0.97), (-0.62, 1.38),
         (-0.3, 1.44), (0.4, 1.43), (0.72, 1.34), (1.22, 0.96), (1.78, 0.86), (2.04, 0.68),
         (2.1, 0.42), (2.06, 0.30), (-2.0, 0.28)]  # fmt: skip
_GLASS = [[(-0.9, 0.98), (-0.55, 1.33), (-0.04, 1.37), (-0.04, 0.98)],
          [(0.04, 0.98), (0.04, 1.37), (0.42, 1.36), (0.66, 1.28), (1.02, 0.97)]]  # fmt: skip
_WHEELS, _SEAMS, _HANDLES = (-1.3, 1.32), (-0.95, 0.0, 0.98), (-0.82, 0.16)
_LAMPS = (
    ([(1.86, 0.62), (2.06, 0.60), (2.02, 0.72), (1.84, 0.76)], (216.0, 220.0, 222.0)),
    ([(-2.06, 0.66), (-1.94, 0.66), (-1.92, 0.84), (-2.0, 0.84)], (40.0, 36.0, 150.0)),
)

# height ranges and their gains: sheet metal reflects the sky above and the street below
_METAL = (
    (0.28, 0.45, 0.55), (0.45, 0.62, 0.78), (0.80, 0.88, 1.16), (0.88, 0.99, 1.3),
    (1.36, 1.5, 1.22),
)  # fmt: skip


def car(random: Generator, x: float, z: float, scale: float) -> Prop:
    """Return a small car that is parked along the kerb, in a random direction.

    The centre of the car is at (x, z) [metres]; `scale` is the scale at the depth z [pixels/metre].
    """
    metre = scale * random.uniform(0.98, 1.1)
    height, width = round(1.75 * metre), round(4.7 * metre)
    foot = height - round(0.16 * metre)
    picture, mask = _paint_car(random, (FINE * height, FINE * width), FINE * foot, FINE * metre)
    colour = cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA).astype(np.float64)
    cover = cv2.resize(mask, (width, height), interpolation=cv2.INTER_AREA) / 255
    # Edge pixels contain black from outside the body, which is divided out.
    colour = colour / np.maximum(cover, 0.25)[..., None]
    colour, cover = _over_shadow(np.minimum(colour, 255), cover, foot, metre)
    if random.random() < 0.5:
        colour, cover = colour[:, ::-1].copy(), cover[:, ::-1].copy()
    return Prop(x, z, colour, cover, foot)


def _paint_car(
    random: Generator, size: tuple[int, int], foot: float, metre: float
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return image and mask of a car that stands at the row `foot`; `metre` is in pixels."""
    picture, mask = np.zeros((*size, 3), np.uint8), np.zeros(size, np.uint8)
    stretch = np.array([1.0, random.uniform(0.95, 1.08)])

    def to_pixels(points: Outline) -> NDArray[np.int32]:
        placed = np.array(points) * stretch
        columns, rows = size[1] / 2 + placed[:, 0] * metre, foot - placed[:, 1] * metre
        return np.round(np.stack([columns, rows], 1)).astype(np.int32)

    def paint(points: Outline, colour: Array) -> None:
        cv2.fillPoly(picture, [to_pixels(points)], colour.tolist())

    body = np.array(PAINTS[random.integers(len(PAINTS))], np.float64) * random.uniform(0.85, 1.1)
    cv2.fillPoly(mask, [to_pixels(_BODY)], 255)
    paint(_BODY, body)
    for low, high, gain in _METAL:
        top, bottom = to_pixels([(0, high)])[0, 1], to_pixels([(0, low)])[0, 1]
        band = picture[top:bottom]
        band[:] = np.clip(band * gain, 0, 255).astype(np.uint8)
    for pane in _GLASS:
        paint(pane, np.array([70.0, 62.0, 56.0]))
        paint([(a, max(b, 1.17)) for a, b in pane], np.array([128.0, 118.0, 108.0]))
    dark = body * 0.55
    for place in _SEAMS:
        start, end = to_pixels([(place, 0.4), (place, 0.97)]).tolist()
        cv2.line(picture, start, end, dark.tolist(), FINE)
    for place in _HANDLES:
        paint([(place, 0.84), (place + 0.16, 0.84), (place + 0.16, 0.87), (place, 0.87)], dark)
    for lamp, colour in _LAMPS:
        paint(lamp, np.array(colour))
    for place in _WHEELS:
        _paint_wheel(random, picture, mask, to_pixels([(place, 0.31)])[0].tolist(), metre)
    return picture, mask


def _paint_wheel(
    random: Generator,
    picture: NDArray[np.uint8],
    mask: NDArray[np.uint8],
    hub: list[int],
    metre: float,
) -> None:
    cv2.circle(picture, hub, round(0.385 * metre), (24, 22, 22), -1)
    cv2.circle(mask, hub, round(0.31 * metre), 255, -1)
    cv2.circle(picture, hub, round(0.31 * metre), (38, 36, 36), -1)
    cv2.circle(picture, hub, round(0.2 * metre), (140, 142, 144), -1)
    for spoke in np.arange(5) * 2 * np.pi / 5 + random.uniform(0, 1):
        end = np.array(hub) + np.round(np.array([np.cos(spoke), np.sin(spoke)]) * 0.18 * metre)
        cv2.line(picture, hub, end.astype(int).tolist(), (90, 90, 92), FINE)
    cv2.circle(picture, hub, round(0.05 * metre), (60, 60, 60), -1)


def _over_shadow(colour: Array, cover: Array, foot: float, metre: float) -> tuple[Array, Array]:
    rows, columns = np.indices(cover.shape)
    u = (columns + 0.5 - cover.shape[1] / 2) / (2.15 * metre)
    v = (rows + 0.5 - foot + 0.02 * metre) / (0.15 * metre)
    dark = 0.75 * np.clip(1.3 - 1.3 * (u**8 + v * v), 0, 1)
    both = cover + dark * (1 - cover)
    share = np.divide(cover, both, out=np.zeros_like(cover), where=both > 0)
    return colour * share[..., None], both
