"""`nummiaro2003/head`: a worker's head in front of machines, recorded by a fixed camera.

The paper uses 450 frames from a Siemens factory. "The tracked person carries out several operations
on different machines", with "large out-of-plane rotations of the head and unpredictable locations
in front of a highly textured background". All other properties are our choice, including the static
camera: the paper mentions only the person's motion.

The paper gives no speed of the worker, who is filmed for "training, on-line documentation and
planning purposes". Each scene draws the speed of the walks between machines from the range of
recorded heads (see `render.figure.routine`).

The background is a wall of machines, switchboards, shelves, tool boards and notices, with pipes and
cables above them. Functions with the parameters `width` and `height` paint one such object on a
piece of wall of this size [metres].
"""

from dataclasses import replace
from functools import cached_property

import cv2
import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from trackmark.datasets.interface import Array, Image, Mask
from trackmark.datasets.synthetic.render.attributes import occluded
from trackmark.datasets.synthetic.render.camera import Camera, slow_exposure
from trackmark.datasets.synthetic.render.colours import (
    DARK,
    MACHINES,
    SIGNALS,
    STEEL,
    STORED,
    sample_colour,
    vary_colour,
)
from trackmark.datasets.synthetic.render.figure.look import sample_figure_look
from trackmark.datasets.synthetic.render.figure.routine import (
    FOCAL,
    FRAMES,
    FRAMES_PER_SECOND,
    SIZE,
    sample_routine,
)
from trackmark.datasets.synthetic.render.figure.worker import Worker
from trackmark.datasets.synthetic.render.painting import Painting
from trackmark.datasets.synthetic.render.texture import fractal
from trackmark.datasets.synthetic.scene import SceneTruth, SeededScene, paste_window

SCREENS = ((120, 60, 20), (40, 70, 30), (170, 150, 120), (90, 40, 70))
WRITING = ((80, 220, 120), (230, 230, 230), (60, 200, 230))
DIGITS = ((60, 190, 80), (60, 60, 220), (40, 170, 230), (190, 160, 60))
KEYS = (*SIGNALS, STEEL, STEEL, (200, 202, 204))
WHITE = (206, 208, 208)
BREAKERS = (WHITE, WHITE, DARK, (110, 150, 60), (50, 90, 190), (190, 180, 160))
BACKS = ((150, 150, 148), (120, 132, 140), (60, 140, 190))
CHIPS = ((120, 160, 190), STEEL)
BLACK = (30, 30, 32)


def _row_of_instruments(
    wall: Painting, random: Generator, x: float, y: float, width: float, height: float
) -> None:
    """Fill a rectangle [metres] with gauges, buttons, signs, displays or switches of one kind."""
    kind = random.integers(5)
    if random.random() < 0.5:
        wall.hole(x, y, width, height, sample_colour(random, MACHINES) * 0.8)
    size = height * random.uniform(0.75, 0.95)
    place = x + 0.01
    while place + size < x + width:
        middle = place + size / 2, y + height / 2
        if kind == 0:
            _gauge(wall, random, *middle, size / 2)
        elif kind == 1:
            small = max(0.4 * size / 2, 0.011)
            for row in (-0.25, 0.25):
                wall.knob(middle[0], middle[1] + row * size, small, sample_colour(random, SIGNALS))
        elif kind == 2:
            wall.plate(
                place,
                y + 0.15 * height,
                0.8 * size,
                0.7 * height,
                sample_colour(random, SIGNALS),
                0.006,
            )
            wall.label(random, place, y, 0.8 * size, 0.016)
        elif kind == 3:
            wall.plate(place, y + 0.1 * height, 0.85 * size, 0.8 * height, DARK, 0.006)
            lit = sample_colour(random, DIGITS)
            wall.label(
                random, place + 0.1 * size, y + 0.22 * height, 0.65 * size, 0.5 * height, DARK, lit
            )
        else:
            wall.knob(*middle, size / 2.6, DARK)
            wall.line([middle, (middle[0], middle[1] - size / 3)], 0.006, (220, 222, 224))
        place += size * random.uniform(1.0, 1.25)


def _gauge(wall: Painting, random: Generator, x: float, y: float, radius: float) -> None:
    wall.knob(x, y, radius, STEEL)
    wall.disc(x, y, 0.8 * radius, (216, 222, 224))
    for angle in np.linspace(-2.4, 2.4, 9):
        ray = np.sin(angle), -np.cos(angle)
        colour = (40, 36, 190) if angle > 1.4 else DARK
        ends = [(x + k * radius * ray[0], y + k * radius * ray[1]) for k in (0.58, 0.74)]
        wall.line(ends, 0.12 * radius, colour)
    angle = random.uniform(-2.2, 1.8)
    tip = x + 0.6 * radius * np.sin(angle), y - 0.6 * radius * np.cos(angle)
    wall.line([(x, y), tip], 0.1 * radius, DARK)


def _warning(wall: Painting, random: Generator, x: float, y: float, size: float) -> None:
    if random.random() < 0.6:
        middle, low = x + size / 2, y + 0.93 * size
        wall.area([(x, y + size), (middle, y), (x + size, y + size)], BLACK)
        inner = [(x + 0.12 * size, low), (middle, y + 0.16 * size), (x + 0.88 * size, low)]
        wall.area(inner, (40, 196, 226))
        wall.line([(middle, y + 0.45 * size), (middle, y + 0.72 * size)], 0.1 * size, BLACK)
    else:
        wall.label(random, x, y, size, size, sample_colour(random, SIGNALS[:6]))


def _controls(wall: Painting, random: Generator, width: float, height: float) -> None:
    wall.plate(0, 0, width, height, sample_colour(random, MACHINES), 0.02)
    wall.plate(0.03, 0.03, width - 0.06, 0.2, DARK, 0.006)
    back, ink = sample_colour(random, SCREENS), sample_colour(random, WRITING)
    wall.label(random, 0.045, 0.045, width - 0.09, 0.17, back, ink)
    for row in range(4):
        for x in np.arange(0.035, width - 0.045, 0.042):
            wall.plate(x, 0.26 + 0.042 * row, 0.032, 0.032, sample_colour(random, KEYS), 0.005)
    wall.disc(0.10, height - 0.09, 0.06, (40, 190, 220))
    wall.knob(0.10, height - 0.09, 0.042, (36, 32, 196))
    wall.knob(width - 0.08, height - 0.09, 0.035, sample_colour(random, SIGNALS))


def _stripes(wall: Painting, x: float, y: float, width: float, height: float) -> None:
    wall.patch(x, y, width, height, (40, 186, 220))
    for left in np.arange(x, x + width - height, 2 * height):
        right = left + height
        band = [(left, y + height), (right, y), (left + 2 * height, y), (right, y + height)]
        wall.area(band, (36, 36, 38))


def cabinet(wall: Painting, random: Generator, width: float, height: float) -> None:
    """Paint a control cabinet with rows of instruments on its doors."""
    paint = sample_colour(random, MACHINES)
    wall.plate(0, 0, width, height, paint, 0.03)
    doors = 2 if width > 0.75 else 1
    for door in range(doors):
        wide = width / doors
        inner = wall.part(door * wide, 0)
        tone = paint * random.uniform(0.92, 1.06)
        inner.plate(0.015, 0.02, wide - 0.03, height - 0.04, tone, 0.008)
        y = 0.07
        while y < height - 0.35:
            deep = random.uniform(0.07, 0.15)
            _row_of_instruments(inner, random, 0.05, y, wide - 0.10, deep)
            y += deep + random.uniform(0.015, 0.05)
        for slot in range(7):
            inner.patch(0.08, height - 0.28 + 0.025 * slot, wide - 0.16, 0.009, paint * 0.35)
        inner.plate(wide - 0.06, height - 0.5, 0.02, 0.13, np.array(DARK) * 1.4, 0.008)
        _warning(inner, random, 0.05, height - 0.44, 0.09)


def machine_tool(wall: Painting, random: Generator, width: float, height: float) -> None:
    """Paint a machine tool with a window, a control panel with a screen, and hand wheels."""
    paint, other = sample_colour(random, MACHINES), sample_colour(random, MACHINES)
    wall.plate(0, 0.05, width, height - 0.05, paint, 0.03)
    wall.plate(0, 0, width, 0.22, other, 0.02)
    paper, ink = sample_colour(random, SIGNALS), sample_colour(random, SIGNALS)
    wall.label(random, 0.06, 0.06, 0.3 * width, 0.09, paper, ink)
    wide = 0.60 * width
    top, deep = 0.30, 0.55
    wall.plate(0.04, top - 0.03, wide, deep + 0.06, paint * 0.75, 0.01)
    wall.hole(0.07, top, wide - 0.06, deep, (66, 62, 58))
    middle = 0.07 + 0.5 * (wide - 0.06)
    wall.pipe((0.09, top + 0.30), (middle - 0.05, top + 0.30), 0.07, STEEL)
    wall.knob(middle - 0.02, top + 0.30, 0.09, (128, 128, 124))
    for angle in np.arange(3) * 2.1 + random.uniform(0, 2):
        jaw = middle - 0.02 + 0.05 * np.cos(angle), top + 0.30 + 0.05 * np.sin(angle)
        wall.knob(*jaw, 0.018, (90, 92, 92))
    wall.plate(middle + 0.10, top + 0.2, 0.11, 0.2, sample_colour(random, MACHINES) * 0.8, 0.01)
    for _ in range(5):
        start = random.uniform(0.1, wide - 0.1), top + 0.02
        end = middle + random.uniform(-0.1, 0.15), top + 0.25
        wall.wire(start, end, 0.05, 0.014, sample_colour(random, SIGNALS))
    for _ in range(40):  # chips
        spot = 0.08 + random.uniform(0, wide - 0.09), top + deep - random.uniform(0, 0.07)
        end = spot[0] + 0.015, spot[1] + random.uniform(-0.01, 0.01)
        wall.line([spot, end], 0.006, sample_colour(random, CHIPS))
    wall.darken(0.07, top, 0.35 * wide, deep, 1.25)  # bright reflection in the pane
    _controls(wall.part(wide + 0.06, 0.28), random, width - wide - 0.09, 0.62)
    _stripes(wall, 0, 0.97, width, 0.06)
    y = 1.06
    while y < height - 0.12:
        for x in np.arange(0.08, width - 0.1, random.uniform(0.16, 0.3)):
            choice = random.random()
            if choice < 0.3:
                wall.knob(x + 0.05, y + 0.07, 0.05, sample_colour(random, SIGNALS))
                wall.knob(x + 0.05, y + 0.07, 0.016, STEEL)
            elif choice < 0.6:
                _row_of_instruments(wall, random, x, y, 0.14, 0.1)
            else:
                wall.plate(x, y, 0.12, 0.13, vary_colour(random, other), 0.008)
        y += 0.19


def wiring(wall: Painting, random: Generator, width: float, height: float) -> None:
    """Paint an open switch cabinet with rows of breakers, cable ducts and coloured wires."""
    wall.plate(0, 0, width, height, sample_colour(random, MACHINES), 0.03)
    wall.hole(0.03, 0.03, width - 0.06, height - 0.06, sample_colour(random, BACKS))
    rows = np.arange(0.12, height - 0.2, random.uniform(0.2, 0.27))
    for y in rows:
        wall.patch(0.05, y + 0.035, width - 0.10, 0.02, STEEL)
        x = 0.06
        while x < width - 0.10:
            wide = random.uniform(0.02, 0.07)
            paint = sample_colour(random, BREAKERS)
            wall.plate(x, y, wide, 0.095, paint, 0.008)
            wall.patch(x + 0.2 * wide, y + 0.03, 0.5 * wide, 0.025, sample_colour(random, SIGNALS))
            for _ in range(2):
                ends = x + random.uniform(0.1, 0.9) * wide, x + random.uniform(-0.15, 0.15)
                wall.wire(
                    (ends[0], y + 0.09),
                    (float(np.clip(ends[1], 0.05, width - 0.05)), y + 0.17),
                    0.01,
                    0.006,
                    sample_colour(random, SIGNALS),
                )
            x += wide + 0.003
        wall.plate(0.05, y + 0.15, width - 0.10, 0.03, (150, 156, 158), 0.006)
        for x in np.arange(0.055, width - 0.06, 0.014):
            wall.patch(x, y + 0.153, 0.006, 0.024, (80, 84, 86))
    for side in (0.045, width - 0.05):
        for k in range(7):
            wall.line(
                [(side + 0.004 * (k - 3), 0.06), (side + 0.004 * (k - 3), height - 0.08)],
                0.005,
                sample_colour(random, SIGNALS),
            )


PARTS = (STEEL, (90, 130, 160), (60, 100, 150), (200, 202, 200))
GOODS = (*STORED, *SIGNALS)
BOARDS = ((132, 164, 190), (188, 190, 188), (120, 92, 60), (92, 130, 168), (120, 130, 80))
GRIPS = (*SIGNALS, (62, 96, 138), (70, 120, 170))
PAPERS = ((222, 226, 226), (222, 226, 226), (150, 214, 228), *SIGNALS)


def _shelf(wall: Painting, random: Generator, width: float, height: float) -> None:
    wall.hole(0, 0, width, height, sample_colour(random, MACHINES) * 0.45)
    frame = sample_colour(random, MACHINES)
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
    wall: Painting, random: Generator, x: float, y: float, width: float, height: float
) -> None:
    colour = sample_colour(random, STORED)
    choice = random.random()
    if choice < 0.35:  # a box with a label
        wall.plate(x, y, width, height, colour, 0.01)
        if random.random() < 0.7:
            wall.label(random, x + 0.15 * width, y + 0.25 * height, 0.6 * width, 0.4 * height)
        else:
            wall.patch(x + 0.42 * width, y, 0.16 * width, height, colour * 0.8)
    elif choice < 0.6:  # an open bin with parts
        wall.patch(x, y + 0.2 * height, width, 0.3 * height, DARK)
        for _ in range(14):
            spot = x + random.uniform(0.1, 0.9) * width, y + random.uniform(0.15, 0.45) * height
            wall.disc(*spot, 0.01, sample_colour(random, PARTS))
        wall.plate(x, y + 0.45 * height, width, 0.55 * height, colour, 0.008)
        wall.label(random, x + 0.3 * width, y + 0.6 * height, 0.4 * width, 0.2 * height)
    elif choice < 0.8:  # cans and bottles
        place = x
        while place + 0.04 < x + width:
            paint = sample_colour(random, GOODS)
            high = height * random.uniform(0.6, 0.95)
            middle, label = place + 0.02, y + height - 0.6 * high
            wall.pipe((middle, y + height - 0.01), (middle, y + height - high), 0.018, paint)
            wall.patch(place + 0.006, label, 0.028, 0.3 * high, sample_colour(random, SIGNALS))
            place += 0.045
    else:  # files, books
        place = x
        while place + 0.03 < x + width:
            wide = random.uniform(0.015, 0.032)
            top = y + random.uniform(0, 0.2) * height
            wall.plate(place, top, wide, height, sample_colour(random, GOODS), 0.004)
            place += wide


def _tools(wall: Painting, random: Generator, width: float, height: float) -> None:
    board = sample_colour(random, BOARDS)
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
    paint = sample_colour(random, MACHINES)
    rows, columns = 5, max(2, int(width / 0.18))
    for row in range(rows):
        for column in range(columns):
            wide, high = width / columns, (height - top) / rows
            drawer = wall.part(column * wide, top + row * high)
            tone = vary_colour(random, paint, 0.15)
            drawer.plate(0.006, 0.006, wide - 0.012, high - 0.012, tone, 0.008)
            drawer.label(random, 0.3 * wide, 0.2 * high, 0.4 * wide, 0.2 * high)
            drawer.plate(0.3 * wide, 0.6 * high, 0.4 * wide, 0.02, DARK, 0.006)


def _tool(wall: Painting, random: Generator, x: float, y: float, length: float) -> None:
    grip = sample_colour(random, GRIPS)
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


def _notices(wall: Painting, random: Generator, width: float, height: float) -> None:
    for _ in range(int(14 * width)):
        x, y = random.uniform(0, width - 0.16), random.uniform(0, 0.75 * height)
        wide, high = random.uniform(0.08, 0.22), random.uniform(0.08, 0.28)
        wide = min(wide, width - x)
        paper = sample_colour(random, PAPERS)
        wall.plate(x, y, wide, high, paper, 0.006)
        start, span, tall = x + 0.1 * wide, 0.8 * wide, 0.35 * high
        ink = sample_colour(random, SIGNALS)
        wall.label(random, start, y + 0.1 * high, span, tall, paper, ink)
        if random.random() < 0.6:
            picture = sample_colour(random, (*SIGNALS, *MACHINES))
            wall.patch(start, y + 0.55 * high, span, tall, picture)
    for x in np.cumsum(random.uniform(0.08, 0.3, 4)):
        if x > width - 0.03:
            break
        paint = sample_colour(random, (*MACHINES, STEEL))
        wall.pipe((x, -0.5), (x, height + 0.2), random.uniform(0.014, 0.032), paint)
        for y in random.uniform(0.1, height, 3):
            wall.patch(x - 0.035, y, 0.07, 0.035, paint * 0.75)
            wall.knob(x, y + 0.017, 0.035, sample_colour(random, SIGNALS))
    x, y = random.uniform(0.08, max(width - 0.1, 0.09)), 0.62 * height
    wall.pipe((x, y), (x, y + 0.42), 0.075, (36, 30, 178))
    wall.label(random, x - 0.05, y + 0.1, 0.10, 0.16)
    wall.plate(x - 0.03, y - 0.12, 0.06, 0.06, DARK, 0.008)


FINE = 2  # supersampling per axis
WALLS = ((176, 184, 186), (150, 178, 190), (168, 182, 160), (120, 140, 170), (150, 150, 148))

FADED = 0.22  # fraction by which the saturation of colours is reduced
CABLES = (DARK,) * 6 + (STEEL,) * 4

# Objects along the wall. All kinds appear once before a kind is repeated.
UNITS = (cabinet, machine_tool, _shelf, _tools, wiring, _notices)


def hall(random: Generator, width: int, height: int, scale: float) -> NDArray[np.uint8]:
    """Return an image of a wall with machines, shape (height, width, 3); scale in pixels/metre."""
    wall = sample_colour(random, WALLS)
    picture = np.empty((FINE * height, FINE * width, 3), np.uint8)
    picture[:] = np.round(wall).astype(np.uint8)
    painting = Painting(picture, FINE * scale)
    wide, high = width / scale, height / scale
    painting.patch(0, 0.55 * high, wide, high, sample_colour(random, MACHINES) * 0.9)
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


def _overhead(painting: Painting, random: Generator, width: float) -> None:
    painting.darken(0, 0, width, 0.10, 0.7)
    y = 0.02
    while y < 0.26:
        radius = random.uniform(0.012, 0.035)
        paint = sample_colour(random, (*MACHINES, STEEL))
        painting.pipe((-0.1, y), (width + 0.1, y), radius, paint)
        for x in random.uniform(0, width, 4):
            painting.patch(x, y - radius, 0.05, 2 * radius, sample_colour(random, SIGNALS))
        y += 2 * radius + random.uniform(0.01, 0.05)
    for _ in range(8):
        start = random.uniform(0, width), random.uniform(0.1, 0.28)
        end = start[0] + random.uniform(-0.5, 0.5), random.uniform(0.25, 0.8)
        sag, thick = random.uniform(0.02, 0.2), random.uniform(0.005, 0.012)
        painting.wire(start, end, sag, thick, sample_colour(random, (*CABLES, *SIGNALS)))


def _used(random: Generator, picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the picture with dirt, oil and uneven paint."""
    height, width = picture.shape[:2]
    broad, fine = fractal(random, 1024, 8, 64, 0.7), fractal(random, 1024, 128, 512, 0.8)
    gain = 1 + 0.09 * broad[:height, :width] + 0.06 * fine[:height, :width]
    grime = np.clip(fractal(random, 1024, 16, 256, 0.75)[:height, :width] - 0.7, 0, 1)[..., None]
    # The wall is slightly out of focus, and its paint is faded.
    soft = cv2.GaussianBlur(picture, (5, 5), 0.75).astype(np.float64)
    soft += FADED * (soft.mean(axis=2, keepdims=True) - soft)
    used = soft * gain[..., None]
    used = used + (np.array([40.0, 50.0, 58.0]) - used) * 0.6 * grime
    return np.clip(np.round(used), 0, 255).astype(np.uint8)


WALL = 3.2  # distance of the machines from the camera [metres]
AXIS = 235.0  # row of the camera's horizon [pixels]
EXPOSURE = 0.4  # fraction of the frame time for which the shutter is open
CAMERA = Camera(SIZE, noise=2.5)

# minimum angle between the head's direction and the camera at which the face is invisible
TURNED_AWAY = np.radians(120)
FAST = 0.1  # minimum motion per frame for the attribute `fast` [head widths]


class HeadScene(SeededScene):
    """Scene of a worker in front of machines in a bright factory hall."""

    label, length, size = "factory", FRAMES, SIZE
    fps = FRAMES_PER_SECOND

    @cached_property
    def worker(self) -> Worker:
        """Worker, recorded by a camera at the height of the eyes."""
        look = sample_figure_look(self._random("look"))
        # Front and back of the head differ in colour, so that large rotations are visible.
        look = replace(look, beard=False, cut="short" if look.cut == "full" else look.cut)
        routine = sample_routine(self._random("routine"))
        lamp = np.array([self._random("light").uniform(-0.5, 0.5), 0.8, -0.7])
        lamp /= np.sqrt((lamp * lamp).sum())
        eye = self._random("camera").uniform(1.45, 1.55)
        camera = np.array([FOCAL, SIZE[0] / 2, AXIS, eye])
        return Worker(look, routine, camera, np.append(lamp, 0.5), self._seed)

    def truth(self) -> SceneTruth:
        """Return the ground truth of all frames.

        A box contains the head from the chin to the crown, with hair and ears. Attributes are
        `turned_away` (the face is invisible), `fast` (the head moves by more than a tenth of its
        width in a frame) and `occlusion` (hands or shoulders hide more than a tenth of the head).
        """
        worker = self.worker
        boxes = np.stack([worker.head_box(frame) for frame in range(FRAMES)])
        motion = np.stack([worker.motion(frame) for frame in range(FRAMES)])
        visibility = np.empty(FRAMES)
        for frame in range(FRAMES):
            _, _, whole, seen = worker.head_seen(frame)
            visibility[frame] = seen.sum(dtype=np.float64) / whole.sum(dtype=np.float64)
        return SceneTruth(
            boxes,
            visibility,
            {
                "turned_away": worker.facing < np.cos(TURNED_AWAY),
                "fast": np.sqrt((motion * motion).sum(axis=1)) > FAST * boxes[:, 2],
                "occlusion": occluded(visibility),
            },
        )

    def render(self, frame: int) -> Image:
        canvas = self._wall.copy()
        self.worker.draw(canvas, frame, 1.0, EXPOSURE)
        return CAMERA.exposed(canvas, self._seed, frame, self._exposure[frame])

    def mask(self, frame: int) -> Mask:
        left, top, _, seen = self.worker.head_seen(frame)
        return paste_window(SIZE, left, top, seen) >= 128

    @cached_property
    def _wall(self) -> Image:
        wall = hall(self._random("hall"), *SIZE, FOCAL / WALL)
        return np.clip(np.round(wall), 0, 255).astype(np.uint8)

    @cached_property
    def _exposure(self) -> Array:
        return 1.04 * slow_exposure(self._random("exposure"), FRAMES)
