"""Prints on objects: a book's cover, a tea packet, a toy's box."""

from collections.abc import Sequence

import numpy as np
from numpy.random import Generator

from trackmark.datasets.interface import Array, Image
from trackmark.datasets.synthetic.render.colours import vary_colour
from trackmark.datasets.synthetic.render.painting import Colour, Painting
from trackmark.datasets.synthetic.render.texture import fractal, lerp, ramp

KINDS = "book", "tea", "toy"

SIDE = 512

INKS = (
    (44, 40, 178),  # red
    (40, 116, 224),  # orange
    (52, 190, 232),  # yellow
    (70, 150, 70),  # green
    (128, 132, 30),  # teal
    (168, 92, 40),  # blue
    (134, 58, 108),  # violet
    (120, 80, 206),  # pink
)
PAPER, BLACK = (206, 222, 228), (48, 42, 40)

Place = tuple[float, float]


def print_picture(random: Generator, kind: str, width: int, height: int) -> Image:
    """Return a print of a kind in `KINDS`, BGR."""
    picture = np.empty((height, width, 3), np.uint8)
    inks = [vary_colour(random, ink, 0.06) for ink in random.permutation(INKS)[:6]]
    painting = Painting(picture, float(width))
    {"book": _book, "tea": _tea, "toy": _toy}[kind](painting, random, inks, height / width)
    wear = fractal(random, SIDE, 8, 256, 0.85)[:height, :width]
    return np.asarray(np.clip(picture * (1 + 0.035 * wear[..., None]), 0, 255), np.uint8)


def _book(cover: Painting, random: Generator, inks: Sequence[Colour], high: float) -> None:
    cover.patch(0, 0, 1, high, inks[0])
    cover.patch(0, 0, 0.07, high, inks[0] * 0.7)
    left, top, wide, tall = 0.15, random.uniform(0.36, 0.44), 0.77, 0.62
    cover.patch(left - 0.02, top - 0.02, wide + 0.04, tall + 0.04, PAPER)
    _landscape(cover, random, (left, top, wide, tall), inks)
    _letters(cover, random, (0.16, 0.09), 0.14, 6, [PAPER if inks[0].sum() < 420 else BLACK])
    _letters(cover, random, (0.28, 0.265), 0.065, 9, [inks[1]])
    _letters(cover, random, (0.22, high - 0.13), 0.06, 11, [inks[2]])
    cover.disc(0.84, high - 0.10, 0.055, inks[3])


def _landscape(
    cover: Painting,
    random: Generator,
    where: tuple[float, float, float, float],
    inks: Sequence[Colour],
) -> None:
    x, y, wide, tall = where
    scale = cover.scale
    rows, columns = round(tall * scale), round(wide * scale)
    top, left = round(y * scale), round(x * scale)
    rough = fractal(random, SIDE, 4, 64, 0.6)[:rows, :columns]
    line = np.linspace(-1, 1, rows)[:, None] + 0.3 * rough
    sky = ramp(line, np.stack([inks[4], 0.4 * inks[4] + 130, np.asarray(PAPER, np.float64)]))
    view = cover.picture[top : top + rows, left : left + columns]
    for k, ink in enumerate((inks[1] * 0.75, inks[3], inks[2])):
        ridge = 0.34 + 0.21 * k + 0.10 * fractal(random, SIDE, 4, 32)[40 + 90 * k, :columns]
        hill = lerp(ink * 1.12, ink * 0.66, np.clip(0.5 + rough, 0, 1))
        under = np.clip(scale / 6 * (np.linspace(0, 1, rows)[:, None] - ridge), 0, 1)
        sky = lerp(sky, hill, under)
    view[:] = np.clip(sky, 0, 255).astype(np.uint8)
    cover.disc(x + wide * random.uniform(0.2, 0.8), y + 0.13, 0.075, inks[5] * 0.5 + 110)
    u, v = x + wide * random.uniform(0.2, 0.6), y + tall * 0.62
    cover.patch(u, v, 0.16, 0.13, PAPER)
    cover.area([(u - 0.03, v), (u + 0.08, v - 0.10), (u + 0.19, v)], inks[0] * 0.8 + 20)
    cover.patch(u + 0.04, v + 0.05, 0.04, 0.08, BLACK)


def _tea(cover: Painting, random: Generator, inks: Sequence[Colour], high: float) -> None:
    cover.patch(0, 0, 1, high, inks[0])
    for y in (0.0, high - 0.24):
        cover.patch(0, y, 1, 0.24, inks[1])
        cover.patch(0, y + 0.105, 1, 0.03, PAPER)
        count = int(random.integers(5, 8))
        for k in range(count):
            x, half = (k + 0.5) / count, 0.36 / count
            corners = [(x - half, y + 0.12), (x, y + 0.02), (x + half, y + 0.12), (x, y + 0.22)]
            cover.area(corners, inks[2 + k % 2])
            cover.disc(x, y + 0.12, 0.2 / count, inks[1] * 0.5)
    middle = high * 0.46
    for radius, ink in ((0.40, inks[4] * 0.8), (0.36, PAPER), (0.33, inks[4] * 0.45 + 120)):
        cover.disc(0.5, middle, radius, ink)
    start = random.uniform(0, np.pi)
    for k in range(7):
        angle = start + 2 * np.pi * k / 7
        _leaf(cover, (0.5, middle), angle, 0.30, inks[3 if k % 2 else 5] * random.uniform(0.7, 1))
    cover.disc(0.5, middle, 0.07, inks[2])
    band = high * 0.70
    cover.patch(0.06, band, 0.88, 0.2, BLACK)
    cover.patch(0.075, band + 0.015, 0.85, 0.17, inks[5])
    _letters(cover, random, (0.14, band + 0.045), 0.11, 7, [PAPER])


def _leaf(cover: Painting, foot: Place, angle: float, length: float, ink: Colour) -> None:
    t = np.linspace(0.15, 1, 9)
    half = 0.28 * length * np.sin(np.pi * (t - 0.15) / 0.85)
    sides = [
        (
            foot[0] + length * t * np.cos(angle) + side * half * np.sin(angle),
            foot[1] + length * t * np.sin(angle) - side * half * np.cos(angle),
        )
        for side in (1, -1)
    ]
    edges = [list(zip(x.tolist(), y.tolist(), strict=True)) for x, y in sides]
    cover.area(edges[0] + edges[1][::-1], ink)
    tip = foot[0] + length * np.cos(angle), foot[1] + length * np.sin(angle)
    cover.line([foot, tip], 0.012, ink * 0.4 + 120)


def _toy(cover: Painting, random: Generator, inks: Sequence[Colour], high: float) -> None:
    cover.patch(0, 0, 1, high, inks[0])
    middle = high * 0.6
    for k in range(0, 24, 2):
        a, b = (2 * np.pi * (k + j) / 24 for j in (0, 1))
        far = [(0.5 + 2 * np.cos(t), middle + 2 * np.sin(t)) for t in (a, b)]
        cover.area([(0.5, middle), *far], inks[1])
    cover.disc(0.5, middle, 0.40, inks[0] * 0.45 + 125)
    body, dark = inks[2], inks[2] * 0.55
    for side in (-1, 1):
        cover.line(
            [(0.5, middle), (0.5 + side * 0.33, middle + random.uniform(-0.24, 0.18))], 0.08, dark
        )
        cover.patch(0.5 + side * 0.11 - 0.06, middle + 0.18, 0.12, 0.2, dark)
        cover.disc(0.5 + side * 0.11, middle + 0.40, 0.08, inks[3])
    cover.patch(0.3, middle - 0.1, 0.4, 0.32, body)
    cover.patch(0.36, middle - 0.05, 0.28, 0.13, inks[3])
    for k in range(3):
        cover.disc(0.40 + 0.1 * k, middle + 0.15, 0.035, inks[3 + k])
    cover.patch(0.34, middle - 0.36, 0.32, 0.24, inks[4])
    for x in (0.42, 0.58):
        cover.disc(x, middle - 0.26, 0.055, PAPER)
        cover.disc(x, middle - 0.26, 0.026, BLACK)
    cover.patch(0.42, middle - 0.17, 0.16, 0.025, BLACK)
    cover.patch(0, 0, 1, 0.27, inks[5] * 0.6)
    _letters(cover, random, (0.07, 0.055), 0.17, 6, [PAPER, inks[1], inks[2], inks[3]])
    star = [
        (0.85 + r * np.sin(t), high - 0.16 - r * np.cos(t))
        for t, r in zip(np.arange(16) * np.pi / 8, [0.14, 0.085] * 8, strict=True)
    ]
    cover.area(star, inks[3])
    _letters(cover, random, (0.77, high - 0.19), 0.06, 3, [BLACK])


STROKES: tuple[tuple[Place, Place], ...] = (
    ((0, 0), (0, 1)), ((0.62, 0), (0.62, 1)), ((0, 0), (0.62, 0)), ((0, 0.5), (0.62, 0.5)),
    ((0, 1), (0.62, 1)), ((0, 0), (0.62, 1)), ((0.62, 0), (0, 1)),
)  # fmt: skip


def _letters(
    cover: Painting,
    random: Generator,
    corner: Place,
    size: float,
    count: int,
    inks: Sequence[Sequence[float] | Array],
) -> None:
    """Paint letters of a fictitious alphabet with the height `size`."""
    for k in range(count):
        chosen = random.permutation(len(STROKES))[: int(random.integers(2, 5))].tolist()
        for index in chosen:
            ends = [
                (corner[0] + size * (0.85 * k + u), corner[1] + size * v) for u, v in STROKES[index]
            ]
            cover.line(ends, 0.2 * size, inks[k % len(inks)])
