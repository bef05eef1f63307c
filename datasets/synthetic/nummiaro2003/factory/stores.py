"""Shelves, boards with tools and walls with notices.

Each paints itself on a piece of wall of a given width and height, from what is drawn at random.
"""

import numpy as np

from datasets.synthetic.nummiaro2003.factory.paints import ACCENTS, DARK, PAINTS, STEEL, THINGS
from datasets.synthetic.render.painting import Painting, any_of, varied

__all__ = ["notices", "shelf", "tools"]


def shelf(painting: Painting, random: np.random.Generator, width: float, height: float) -> None:
    """Shelf with boxes, cans, parts and papers."""
    painting.hole(0, 0, width, height, any_of(random, PAINTS) * 0.45)
    frame = any_of(random, PAINTS)
    y = random.uniform(0.22, 0.32)
    while y < height:
        x = 0.03
        while x < width - 0.07:
            wide = min(random.uniform(0.05, 0.22), width - 0.04 - x)
            high = random.uniform(0.08, 0.21)
            if random.random() < 0.85:
                _stored(painting, random, x, y - high, wide, high)
            x += wide + random.uniform(0.0, 0.02)
        painting.plate(0, y, width, 0.028, frame, 0.015)
        for x in np.arange(0.05, width - 0.08, 0.16):
            painting.label(random, x, y + 0.004, 0.06, 0.02)
        y += random.uniform(0.24, 0.34)
    for x in (0.0, width - 0.035):
        painting.plate(x, 0, 0.035, height, frame * 0.9, 0.01)
        for hole in np.arange(0.02, height, 0.05):
            painting.patch(x + 0.012, hole, 0.01, 0.018, DARK)


def _stored(
    painting: Painting, random: np.random.Generator, x: float, y: float, width: float, height: float
) -> None:
    colour = any_of(random, THINGS)
    choice = random.random()
    if choice < 0.35:  # a box with a label
        painting.plate(x, y, width, height, colour, 0.01)
        if random.random() < 0.7:
            painting.label(random, x + 0.15 * width, y + 0.25 * height, 0.6 * width, 0.4 * height)
        else:
            painting.patch(x + 0.42 * width, y, 0.16 * width, height, colour * 0.8)
    elif choice < 0.6:  # an open bin, full of parts
        painting.patch(x, y + 0.2 * height, width, 0.3 * height, DARK)
        for _ in range(14):
            spot = x + random.uniform(0.1, 0.9) * width, y + random.uniform(0.15, 0.45) * height
            painting.disc(
                *spot,
                0.01,
                any_of(random, (STEEL, (90, 130, 160), (60, 100, 150), (200, 202, 200))),
            )
        painting.plate(x, y + 0.45 * height, width, 0.55 * height, colour, 0.008)
        painting.label(random, x + 0.3 * width, y + 0.6 * height, 0.4 * width, 0.2 * height)
    elif choice < 0.8:  # cans and bottles
        place = x
        while place + 0.04 < x + width:
            paint = any_of(random, (*THINGS, *ACCENTS))
            high = height * random.uniform(0.6, 0.95)
            painting.pipe(
                (place + 0.02, y + height - 0.01), (place + 0.02, y + height - high), 0.018, paint
            )
            painting.patch(
                place + 0.006, y + height - 0.6 * high, 0.028, 0.3 * high, any_of(random, ACCENTS)
            )
            place += 0.045
    else:  # files, books
        place = x
        while place + 0.03 < x + width:
            wide = random.uniform(0.015, 0.032)
            painting.plate(
                place,
                y + random.uniform(0, 0.2) * height,
                wide,
                height,
                any_of(random, (*THINGS, *ACCENTS)),
                0.004,
            )
            place += wide


def tools(painting: Painting, random: np.random.Generator, width: float, height: float) -> None:
    """Board with tools that hang in rows, and drawers below it."""
    board = any_of(
        random, ((132, 164, 190), (188, 190, 188), (120, 92, 60), (92, 130, 168), (120, 130, 80))
    )
    deep = 0.62 * height
    painting.plate(0, 0, width, deep, board, 0.012)
    for y in np.arange(0.03, deep - 0.02, 0.04):
        for x in np.arange(0.03, width - 0.02, 0.04):
            painting.disc(x, y, 0.005, board * 0.45)
    y = 0.05
    while y < deep - 0.2:
        x, high = 0.05, random.uniform(0.16, 0.28)
        while x < width - 0.06:
            _tool(painting, random, x, y, random.uniform(0.6, 1.0) * high)
            x += random.uniform(0.05, 0.10)
        y += high + 0.04
    painting.plate(-0.01, deep, width + 0.02, 0.05, (70, 104, 142), 0.02)
    top = deep + 0.06
    paint = any_of(random, PAINTS)
    rows, columns = 5, max(2, int(width / 0.18))
    for row in range(rows):
        for column in range(columns):
            wide, high = width / columns, (height - top) / rows
            drawer = painting.part(column * wide, top + row * high)
            drawer.plate(
                0.006, 0.006, wide - 0.012, high - 0.012, varied(random, paint, 0.15), 0.008
            )
            drawer.label(random, 0.3 * wide, 0.2 * high, 0.4 * wide, 0.2 * high)
            drawer.plate(0.3 * wide, 0.6 * high, 0.4 * wide, 0.02, DARK, 0.006)


def _tool(
    painting: Painting, random: np.random.Generator, x: float, y: float, length: float
) -> None:
    grip = any_of(random, (*ACCENTS, (62, 96, 138), (70, 120, 170)))
    shadow = np.array(DARK) * 1.2
    choice = random.integers(4)
    if choice == 0:  # spanner
        painting.line([(x + 0.008, y + 0.02), (x + 0.008, y + length)], 0.016, shadow)
        painting.line([(x, y + 0.01), (x, y + length)], 0.014, STEEL)
        for end in (y + 0.01, y + length):
            painting.disc(x, end, 0.02, STEEL)
            painting.disc(x, end, 0.009, shadow)
    elif choice == 1:  # screwdriver
        painting.line([(x, y), (x, y + length)], 0.007, (190, 190, 188))
        painting.pipe((x, y + 0.5 * length), (x, y + length), 0.014, grip)
    elif choice == 2:  # hammer
        painting.pipe((x, y + 0.02), (x, y + length), 0.010, grip)
        painting.plate(x - 0.045, y, 0.09, 0.035, (96, 96, 96), 0.008)
    else:  # pliers
        for side in (-1, 1):
            painting.line([(x, y), (x - 0.010 * side, y + 0.4 * length)], 0.012, (110, 110, 110))
            painting.line(
                [(x - 0.010 * side, y + 0.4 * length), (x + 0.025 * side, y + length)], 0.014, grip
            )


def notices(painting: Painting, random: np.random.Generator, width: float, height: float) -> None:
    """A piece of wall with papers, signs, pipes with valves and a fire extinguisher."""
    for _ in range(int(14 * width)):
        x, y = random.uniform(0, width - 0.16), random.uniform(0, 0.75 * height)
        wide, high = random.uniform(0.08, 0.22), random.uniform(0.08, 0.28)
        wide = min(wide, width - x)
        paper = any_of(random, ((222, 226, 226), (222, 226, 226), (150, 214, 228), *ACCENTS))
        painting.plate(x, y, wide, high, paper, 0.006)
        painting.label(
            random,
            x + 0.1 * wide,
            y + 0.1 * high,
            0.8 * wide,
            0.35 * high,
            paper,
            any_of(random, ACCENTS),
        )
        if random.random() < 0.6:
            painting.patch(
                x + 0.1 * wide,
                y + 0.55 * high,
                0.8 * wide,
                0.35 * high,
                any_of(random, (*ACCENTS, *PAINTS)),
            )
    for x in np.cumsum(random.uniform(0.08, 0.3, 4)):
        if x > width - 0.03:
            break
        paint = any_of(random, (*PAINTS, STEEL))
        painting.pipe((x, -0.5), (x, height + 0.2), random.uniform(0.014, 0.032), paint)
        for y in random.uniform(0.1, height, 3):
            painting.patch(x - 0.035, y, 0.07, 0.035, paint * 0.75)
            painting.knob(x, y + 0.017, 0.035, any_of(random, ACCENTS))
    x, y = random.uniform(0.08, max(width - 0.1, 0.09)), 0.62 * height
    painting.pipe((x, y), (x, y + 0.42), 0.075, (36, 30, 178))
    painting.label(random, x - 0.05, y + 0.1, 0.10, 0.16)
    painting.plate(x - 0.03, y - 0.12, 0.06, 0.06, DARK, 0.008)
