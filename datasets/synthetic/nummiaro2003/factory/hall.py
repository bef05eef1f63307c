"""A wall of a factory: machines, shelves, boards with tools, notices; pipes and cables above them.

Each unit paints itself on a piece of wall of a given width and height [metres], from what is drawn
at random.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.synthetic.nummiaro2003.factory.machines import cabinet, machine_tool, wiring
from trackmark.datasets.synthetic.render.colours import (
    DARK,
    MACHINES,
    SIGNALS,
    STEEL,
    STORED,
    any_of,
    varied,
)
from trackmark.datasets.synthetic.render.painting import Painting
from trackmark.datasets.synthetic.render.texture import fractal

PARTS = (STEEL, (90, 130, 160), (60, 100, 150), (200, 202, 200))
GOODS = (*STORED, *SIGNALS)
BOARDS = ((132, 164, 190), (188, 190, 188), (120, 92, 60), (92, 130, 168), (120, 130, 80))
GRIPS = (*SIGNALS, (62, 96, 138), (70, 120, 170))
PAPERS = ((222, 226, 226), (222, 226, 226), (150, 214, 228), *SIGNALS)


def _shelf(wall: Painting, random: np.random.Generator, width: float, height: float) -> None:
    """Shelf with boxes, cans, parts and papers."""
    wall.hole(0, 0, width, height, any_of(random, MACHINES) * 0.45)
    frame = any_of(random, MACHINES)
    y = random.uniform(0.22, 0.32)
    while y < height:
        x = 0.03
        while x < width - 0.07:
            wide = min(random.uniform(0.05, 0.22), width - 0.04 - x)
            high = random.uniform(0.08, 0.21)
            if random.random() < 0.85:
                _stored(wall, random, x, y - high, wide, high)
            x += wide + random.uniform(0.0, 0.02)
        wall.plate(0, y, width, 0.028, frame, 0.015)
        for x in np.arange(0.05, width - 0.08, 0.16):
            wall.label(random, x, y + 0.004, 0.06, 0.02)
        y += random.uniform(0.24, 0.34)
    for x in (0.0, width - 0.035):
        wall.plate(x, 0, 0.035, height, frame * 0.9, 0.01)
        for hole in np.arange(0.02, height, 0.05):
            wall.patch(x + 0.012, hole, 0.01, 0.018, DARK)


def _stored(
    wall: Painting, random: np.random.Generator, x: float, y: float, width: float, height: float
) -> None:
    colour = any_of(random, STORED)
    choice = random.random()
    if choice < 0.35:  # a box with a label
        wall.plate(x, y, width, height, colour, 0.01)
        if random.random() < 0.7:
            wall.label(random, x + 0.15 * width, y + 0.25 * height, 0.6 * width, 0.4 * height)
        else:
            wall.patch(x + 0.42 * width, y, 0.16 * width, height, colour * 0.8)
    elif choice < 0.6:  # an open bin, full of parts
        wall.patch(x, y + 0.2 * height, width, 0.3 * height, DARK)
        for _ in range(14):
            spot = x + random.uniform(0.1, 0.9) * width, y + random.uniform(0.15, 0.45) * height
            wall.disc(*spot, 0.01, any_of(random, PARTS))
        wall.plate(x, y + 0.45 * height, width, 0.55 * height, colour, 0.008)
        wall.label(random, x + 0.3 * width, y + 0.6 * height, 0.4 * width, 0.2 * height)
    elif choice < 0.8:  # cans and bottles
        place = x
        while place + 0.04 < x + width:
            paint = any_of(random, GOODS)
            high = height * random.uniform(0.6, 0.95)
            middle, label = place + 0.02, y + height - 0.6 * high
            wall.pipe((middle, y + height - 0.01), (middle, y + height - high), 0.018, paint)
            wall.patch(place + 0.006, label, 0.028, 0.3 * high, any_of(random, SIGNALS))
            place += 0.045
    else:  # files, books
        place = x
        while place + 0.03 < x + width:
            wide = random.uniform(0.015, 0.032)
            top = y + random.uniform(0, 0.2) * height
            wall.plate(place, top, wide, height, any_of(random, GOODS), 0.004)
            place += wide


def _tools(wall: Painting, random: np.random.Generator, width: float, height: float) -> None:
    """Board with tools that hang in rows, and drawers below it."""
    board = any_of(random, BOARDS)
    deep = 0.62 * height
    wall.plate(0, 0, width, deep, board, 0.012)
    for y in np.arange(0.03, deep - 0.02, 0.04):
        for x in np.arange(0.03, width - 0.02, 0.04):
            wall.disc(x, y, 0.005, board * 0.45)
    y = 0.05
    while y < deep - 0.2:
        x, high = 0.05, random.uniform(0.16, 0.28)
        while x < width - 0.06:
            _tool(wall, random, x, y, random.uniform(0.6, 1.0) * high)
            x += random.uniform(0.05, 0.10)
        y += high + 0.04
    wall.plate(-0.01, deep, width + 0.02, 0.05, (70, 104, 142), 0.02)
    top = deep + 0.06
    paint = any_of(random, MACHINES)
    rows, columns = 5, max(2, int(width / 0.18))
    for row in range(rows):
        for column in range(columns):
            wide, high = width / columns, (height - top) / rows
            drawer = wall.part(column * wide, top + row * high)
            tone = varied(random, paint, 0.15)
            drawer.plate(0.006, 0.006, wide - 0.012, high - 0.012, tone, 0.008)
            drawer.label(random, 0.3 * wide, 0.2 * high, 0.4 * wide, 0.2 * high)
            drawer.plate(0.3 * wide, 0.6 * high, 0.4 * wide, 0.02, DARK, 0.006)


def _tool(wall: Painting, random: np.random.Generator, x: float, y: float, length: float) -> None:
    grip = any_of(random, GRIPS)
    shadow = np.array(DARK) * 1.2
    choice = random.integers(4)
    if choice == 0:  # spanner
        wall.line([(x + 0.008, y + 0.02), (x + 0.008, y + length)], 0.016, shadow)
        wall.line([(x, y + 0.01), (x, y + length)], 0.014, STEEL)
        for end in (y + 0.01, y + length):
            wall.disc(x, end, 0.02, STEEL)
            wall.disc(x, end, 0.009, shadow)
    elif choice == 1:  # screwdriver
        wall.line([(x, y), (x, y + length)], 0.007, (190, 190, 188))
        wall.pipe((x, y + 0.5 * length), (x, y + length), 0.014, grip)
    elif choice == 2:  # hammer
        wall.pipe((x, y + 0.02), (x, y + length), 0.010, grip)
        wall.plate(x - 0.045, y, 0.09, 0.035, (96, 96, 96), 0.008)
    else:  # pliers
        for side in (-1, 1):
            joint = x - 0.010 * side, y + 0.4 * length
            wall.line([(x, y), joint], 0.012, (110, 110, 110))
            wall.line([joint, (x + 0.025 * side, y + length)], 0.014, grip)


def _notices(wall: Painting, random: np.random.Generator, width: float, height: float) -> None:
    """A piece of wall with papers, signs, pipes with valves and a fire extinguisher."""
    for _ in range(int(14 * width)):
        x, y = random.uniform(0, width - 0.16), random.uniform(0, 0.75 * height)
        wide, high = random.uniform(0.08, 0.22), random.uniform(0.08, 0.28)
        wide = min(wide, width - x)
        paper = any_of(random, PAPERS)
        wall.plate(x, y, wide, high, paper, 0.006)
        start, span, tall = x + 0.1 * wide, 0.8 * wide, 0.35 * high
        ink = any_of(random, SIGNALS)
        wall.label(random, start, y + 0.1 * high, span, tall, paper, ink)
        if random.random() < 0.6:
            picture = any_of(random, (*SIGNALS, *MACHINES))
            wall.patch(start, y + 0.55 * high, span, tall, picture)
    for x in np.cumsum(random.uniform(0.08, 0.3, 4)):
        if x > width - 0.03:
            break
        paint = any_of(random, (*MACHINES, STEEL))
        wall.pipe((x, -0.5), (x, height + 0.2), random.uniform(0.014, 0.032), paint)
        for y in random.uniform(0.1, height, 3):
            wall.patch(x - 0.035, y, 0.07, 0.035, paint * 0.75)
            wall.knob(x, y + 0.017, 0.035, any_of(random, SIGNALS))
    x, y = random.uniform(0.08, max(width - 0.1, 0.09)), 0.62 * height
    wall.pipe((x, y), (x, y + 0.42), 0.075, (36, 30, 178))
    wall.label(random, x - 0.05, y + 0.1, 0.10, 0.16)
    wall.plate(x - 0.03, y - 0.12, 0.06, 0.06, DARK, 0.008)


FINE = 2
"""It is painted larger by this."""

WALLS = ((176, 184, 186), (150, 178, 190), (168, 182, 160), (120, 140, 170), (150, 150, 148))

FADED = 0.22
"""Of the colours' strength."""

CABLES = (DARK,) * 6 + (STEEL,) * 4

UNITS = (cabinet, machine_tool, _shelf, _tools, wiring, _notices)
"""What stands along the wall, each once before any comes again."""


def hall(random: np.random.Generator, width: int, height: int, scale: float) -> NDArray[np.uint8]:
    """Paint a wall with machines, shape (height, width, 3), at a scale [pixels/metre]."""
    wall = any_of(random, WALLS)
    picture = np.empty((FINE * height, FINE * width, 3), np.uint8)
    picture[:] = np.round(wall).astype(np.uint8)
    painting = Painting(picture, FINE * scale)
    wide, high = width / scale, height / scale
    painting.patch(0, 0.55 * high, wide, high, any_of(random, MACHINES) * 0.9)
    order = random.permutation(len(UNITS)).tolist()
    x, k = -random.uniform(0.0, 0.4), 0
    while x < wide:
        unit = UNITS[order[k % len(order)]]
        span = random.uniform(0.5, 0.95)
        top = random.uniform(0.22, 0.5)
        unit(painting.part(x, top), random, span, high - top + 0.1)
        x, k = x + span + random.uniform(0.02, 0.14), k + 1
    _overhead(painting, random, wide)
    smaller = np.empty((height, width, 3), np.uint8)
    cv2.resize(picture, (width, height), smaller, interpolation=cv2.INTER_AREA)
    return _used(random, smaller)


def _overhead(painting: Painting, random: np.random.Generator, width: float) -> None:
    """Pipes, a cable tray and cables that hang down, lamps."""
    painting.darken(0, 0, width, 0.10, 0.7)
    y = 0.02
    while y < 0.26:
        radius = random.uniform(0.012, 0.035)
        paint = any_of(random, (*MACHINES, STEEL))
        painting.pipe((-0.1, y), (width + 0.1, y), radius, paint)
        for x in random.uniform(0, width, 4):
            painting.patch(x, y - radius, 0.05, 2 * radius, any_of(random, SIGNALS))
        y += 2 * radius + random.uniform(0.01, 0.05)
    for _ in range(8):
        start = random.uniform(0, width), random.uniform(0.1, 0.28)
        end = start[0] + random.uniform(-0.5, 0.5), random.uniform(0.25, 0.8)
        sag, thick = random.uniform(0.02, 0.2), random.uniform(0.005, 0.012)
        painting.wire(start, end, sag, thick, any_of(random, (*CABLES, *SIGNALS)))


def _used(random: np.random.Generator, picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Dirt, oil and uneven paint."""
    height, width = picture.shape[:2]
    broad, fine = fractal(random, 1024, 8, 64, 0.7), fractal(random, 1024, 128, 512, 0.8)
    gain = 1 + 0.09 * broad[:height, :width] + 0.06 * fine[:height, :width]
    grime = np.clip(fractal(random, 1024, 16, 256, 0.75)[:height, :width] - 0.7, 0, 1)[..., None]
    # What is far from the worker is a little out of focus, and no paint is as bright as new.
    soft = cv2.GaussianBlur(picture, (5, 5), 0.75).astype(np.float64)
    soft += FADED * (soft.mean(axis=2, keepdims=True) - soft)
    used = soft * gain[..., None]
    used = used + (np.array([40.0, 50.0, 58.0]) - used) * 0.6 * grime
    return np.clip(np.round(used), 0, 255).astype(np.uint8)
