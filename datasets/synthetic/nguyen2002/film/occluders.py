"""Objects that pass in front of the target, painted at their size in the image."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from trackmark.datasets.synthetic.nguyen2002.film.sheet import (
    LIGHTS,
    PAINTS,
    UNIT,
    WOODS,
    PaintedSheet,
    adjacent_spans,
    point_list,
)
from trackmark.datasets.synthetic.render.colours import sample_colour, vary_colour
from trackmark.datasets.synthetic.render.texture import noise

WALLS = ((84, 98, 150), (120, 150, 176), (150, 158, 164), (104, 122, 142), (170, 186, 192))
STONES = ((150, 158, 164), (128, 146, 160), (108, 114, 118), (164, 176, 186))
COATS = ((52, 48, 46), (84, 74, 60), (70, 92, 120), (58, 70, 52), (60, 50, 96), (120, 132, 140))


@dataclass(frozen=True)
class Occluder:
    """Kind of object that passes in front of the target."""

    # function of a generator, width and height [UNIT]; paints an object that hides this area
    paint: Callable[[np.random.Generator, float, float], PaintedSheet]
    fixed: bool  # True if the object is static and passes only because the camera moves
    tall: bool  # True if the object extends beyond the upper and the lower image border
    # True if the object stands on the ground on wheels, nearer to the camera than the target
    stands: bool = False


def _pillar(random: np.random.Generator, width: float, height: float) -> PaintedSheet:
    """Paint a round pillar of stone or painted iron, with a base and a poster."""
    sheet = PaintedSheet(width, height, UNIT, sample_colour(random, STONES + PAINTS[6:8]))
    p = sheet.painting
    for y in np.arange(random.uniform(0, 0.4), height, random.uniform(0.5, 0.9)):
        p.darken(0, y, width, 0.018, 0.6)
    if random.random() < 0.7:
        x, y = random.uniform(0.1, 0.3) * width, random.uniform(0.6, 1.3)
        p.patch(x, y, 0.5 * width, 0.62 * width, sample_colour(random, LIGHTS))
        p.patch(x + 0.05 * width, y + 0.05 * width, 0.4 * width, 0.3 * width,
                sample_colour(random, PAINTS))  # fmt: skip
        p.label(random, x, y + 0.38 * width, 0.5 * width, 0.22 * width)
    sheet.cover_box(0, 0, width, height)
    across, _ = sheet.places()
    side = 2 * across - 1 + random.choice([-0.3, 0.3])
    sheet.light(1.1 - 0.5 * np.clip(side * side, 0, 1))
    sheet.wear(random, 0.1, 4, 128)
    return sheet


def _trunk(random: np.random.Generator, width: float, height: float) -> PaintedSheet:
    """Paint a thick trunk with bark; it is at least `width` wide everywhere."""
    bulge = 0.12 * width
    sheet = PaintedSheet(
        width + 2 * bulge, height, UNIT, sample_colour(random, ((58, 76, 92), (72, 82, 90)))
    )
    edges = [bulge * (0.5 + 0.45 * np.clip(noise(random, 256, 8)[0, ::8], -1, 1)) for _ in "lr"]
    rows = np.linspace(0, height, len(edges[0]))
    left, right = point_list(bulge - edges[0], rows), point_list(width + bulge + edges[1], rows)
    sheet.cover(*left, *right[::-1])
    sheet.wear(random, 0.3, 16, 64, stretch=5)
    sheet.wear(random, 0.1, 4, 32)
    sheet.rounded(1.12, 0.55, 0.8)
    return sheet


def _wall_end(random: np.random.Generator, width: float, height: float) -> PaintedSheet:
    """Paint the end of a wall of bricks or blocks, with a poster or a painted sign."""
    colour = sample_colour(random, WALLS)
    sheet = PaintedSheet(width, height, UNIT, colour * 0.72)
    p, course = sheet.painting, random.uniform(0.1, 0.16)
    for k, y in enumerate(np.arange(0, height, course)):
        x = -random.uniform(0.4, 0.6) * course * (k % 2) * 2
        while x < width:
            p.patch(x, y, 2.2 * course - 0.014, course - 0.014, vary_colour(random, colour, 0.12))
            x += 2.2 * course
    if random.random() < 0.7:
        y = random.uniform(0.7, 1.4)
        p.plate(0.15 * width, y, 0.66 * width, 0.4 * width, sample_colour(random, PAINTS), 0.012)
        p.patch(
            0.22 * width, y + 0.1 * width, 0.5 * width, 0.07 * width, sample_colour(random, LIGHTS)
        )
        p.patch(
            0.22 * width,
            y + 0.23 * width,
            0.36 * width,
            0.05 * width,
            sample_colour(random, LIGHTS),
        )
    sheet.cover_box(0, 0, width, height)
    sheet.wear(random, 0.12, 4, 128)
    return sheet


def _lorry(random: np.random.Generator, width: float, height: float) -> PaintedSheet:
    """Paint the canvas-covered load of a lorry, on wheels."""
    sheet = PaintedSheet(width, height + 0.34, UNIT, sample_colour(random, PAINTS))
    p = sheet.painting
    second = sample_colour(random, LIGHTS if random.random() < 0.6 else PAINTS)
    p.patch(0, random.uniform(0.3, 0.6) * height, width, random.uniform(0.1, 0.2) * height, second)
    for x in np.arange(0.1, width, random.uniform(0.22, 0.34)):
        p.darken(x, 0, 0.05, height, 0.86)
        p.darken(x + 0.05, 0, 0.03, height, 1.1)
    for x in np.arange(0.2 * width, 0.72 * width, 0.13 * width):
        p.patch(x, 0.2 * height, 0.03 * width, 0.16 * height, second)
        p.patch(x, random.choice([0.2, 0.27, 0.33]) * height, 0.09 * width, 0.03 * height, second)
    sheet.anchor = width / 2, height / 2
    p.patch(0, height - 0.09, width, 0.09, (52, 52, 54))
    for x in (0.22 * width, 0.76 * width):
        sheet.wheel(x, height + 0.14, 0.2, (34, 32, 32), 0.1, (120, 122, 124))
    sheet.cover_box(0, 0, width, height)
    sheet.wear(random, 0.09, 4, 64)
    return sheet


def _bus(random: np.random.Generator, width: float, height: float) -> PaintedSheet:
    """Paint the side of a bus or carriage: windows above, panels and a number below."""
    body = sample_colour(random, PAINTS)
    sheet = PaintedSheet(width, height + 0.3, UNIT, body)
    sheet.anchor = width / 2, height / 2
    p, second = sheet.painting, sample_colour(random, LIGHTS)
    p.patch(0, 0, width, 0.08 * height, second)
    p.patch(0, 0.54 * height, width, 0.07 * height, second)
    pitch = random.uniform(0.3, 0.4)
    for x in np.arange(0.05, width - 0.1, pitch):
        wide = min(pitch - 0.06, width - x - 0.04)
        glass = vary_colour(random, (112, 98, 84), 0.3)
        p.hole(x, 0.14 * height, wide, 0.34 * height, glass)
        p.area([(x + 0.3 * wide, 0.15 * height), (x + 0.6 * wide, 0.15 * height),
                (x + 0.3 * wide, 0.48 * height), (x, 0.48 * height)], glass + 40)  # fmt: skip
        p.darken(x - 0.03, 0.62 * height, 0.012, 0.34 * height, 0.6)
    for x in (0.25 * width, 0.75 * width):
        sheet.wheel(x, height + 0.08, 0.19, (36, 34, 34), 0.09, (150, 150, 150))
    sheet.cover_box(0, 0, width, height)
    sheet.wear(random, 0.05, 4, 64)
    return sheet


def _container(random: np.random.Generator, width: float, height: float) -> PaintedSheet:
    """Paint a container with corrugated sides, rust and a number, on wheels."""
    colour = sample_colour(random, PAINTS)
    sheet = PaintedSheet(width, height + 0.34, UNIT, colour)
    sheet.anchor = width / 2, height / 2
    p, pitch = sheet.painting, random.uniform(0.07, 0.11)
    for x in np.arange(0, width, pitch):
        p.darken(x, 0, 0.4 * pitch, height, 0.74)
        p.darken(x + 0.4 * pitch, 0, 0.2 * pitch, height, 1.14)
    for _ in range(7):
        x, y = random.uniform(0, width), random.uniform(0, 0.6) * height
        p.patch(x, y, random.uniform(0.01, 0.04), random.uniform(0.1, 0.3), (40, 66, 108))
    for y in (0.0, height - 0.07):
        p.plate(0, y, width, 0.07, colour * 0.8, 0.02)
    for x in np.arange(0.5 * width, 0.9 * width, 0.08 * width):
        p.patch(x, 0.2 * height, 0.05 * width, random.uniform(0.06, 0.12) * height, LIGHTS[0])
    for x in (0.14 * width, 0.3 * width, 0.84 * width):
        sheet.wheel(x, height + 0.14, 0.2, (34, 32, 32), 0.1, (120, 122, 124))
    sheet.cover_box(0, 0, width, height)
    sheet.wear(random, 0.08, 4, 64)
    return sheet


def _ship(random: np.random.Generator, width: float, height: float) -> PaintedSheet:
    """Paint a part of a ship's hull with railing, portholes, plates and water line."""
    colour = sample_colour(random, PAINTS)
    rail, draught = 0.16, 0.3
    sheet = PaintedSheet(width, rail + height + draught, UNIT, colour)
    sheet.anchor = width / 2, rail + height / 2
    p = sheet.painting
    p.patch(0, 0, width, rail, sample_colour(random, LIGHTS))
    p.plate(0, rail, width, 0.07, sample_colour(random, LIGHTS), 0.012)
    for y in np.arange(rail + 0.2, rail + height, 0.22):
        p.darken(0, y, width, 0.012, 0.7)
    for x in np.arange(0.14, width - 0.05, random.uniform(0.2, 0.3)):
        p.disc(x, rail + 0.26 * height, 0.055, colour * 0.6)
        p.disc(x, rail + 0.26 * height, 0.036, (92, 84, 76))
        p.patch(x + 0.05, rail + 0.6 * height, 0.025, random.uniform(0.1, 0.3), (40, 66, 108))
    p.patch(0, rail + height, width, draught, (48, 50, 110))
    p.patch(0, rail + height + 0.22, width, draught, (196, 192, 178))
    for x in np.arange(0.0, width, 0.12):
        sheet.cover_box(x, 0, 0.014, rail)
    sheet.cover_box(0, 0, width, 0.02)
    sheet.cover_box(0, rail, width, height + draught)
    sheet.wear(random, 0.1, 4, 64)
    return sheet


def _load(random: np.random.Generator, width: float, height: float) -> PaintedSheet:
    """Paint boxes on a pallet that hangs from a crane."""
    ropes = 1.9
    sheet = PaintedSheet(width, ropes + height, UNIT, (90, 110, 130))
    sheet.anchor = width / 2, ropes + height / 2
    p = sheet.painting
    rows = int(random.integers(2, 4))
    for row in range(rows):
        for x, wide in adjacent_spans(random, width, (0.22, 0.45)):
            wood = sample_colour(random, WOODS + PAINTS[6:10])
            p.plate(x, ropes + row * height / rows, wide, height / rows, wood, 0.016)
            p.label(random, x + 0.2 * wide, ropes + (row + 0.3) * height / rows, 0.5 * wide,
                    0.3 * height / rows)  # fmt: skip
    p.patch(0, ropes + height - 0.07, width, 0.07, (54, 84, 116))
    sheet.cover_box(0, ropes, width, height)
    for side in (0.03 * width, 0.97 * width):
        rope = [(side - 0.012, ropes + 0.02), (0.5 * width - 0.012, 0), (0.5 * width + 0.012, 0),
                (side + 0.012, ropes + 0.02)]  # fmt: skip
        p.area(rope, (70, 74, 78))
        sheet.cover(*rope)
    sheet.wear(random, 0.07, 4, 64)
    return sheet


def _passer_by(random: np.random.Generator, width: float, height: float) -> PaintedSheet:
    """Paint the back of a person in a long coat, close to the camera.

    `width` is the width of the coat. The shoulders are at least as high as the top of the target.
    """
    head = 0.62 * width
    cloth = sample_colour(random, COATS)
    neck = 0.05 + 1.35 * head
    side, tall = width + 0.3, neck + 0.15 + height + 1.6
    sheet = PaintedSheet(side, tall, UNIT, cloth)
    sheet.anchor = side / 2, neck + 0.15 + height / 2
    p, middle = sheet.painting, side / 2
    p.patch(0, 0, side, neck, sample_colour(random, ((40, 44, 52), (60, 84, 112), (110, 120, 128))))
    p.patch(0, neck - 0.35 * head, side, 0.35 * head + 0.02, (128, 152, 196))
    folds = [(0.2, 0.78), (0.42, 1.16), (0.55, 0.7), (0.7, 1.1), (0.86, 0.8)]
    for place, gain in folds:
        x = middle + (place - 0.5) * width + random.uniform(-0.04, 0.04)
        p.darken(x, neck + 0.25, 0.05, tall, gain)
    p.darken(middle - 0.006, neck + 0.1, 0.012, tall, 0.5)
    p.area([(middle - 0.3 * head, neck - 0.06), (middle + 0.3 * head, neck - 0.06),
            (middle + 0.5 * head, neck + 0.12), (middle - 0.5 * head, neck + 0.12)],
           cloth * 0.7)  # fmt: skip
    sheet.cover_round(middle, 0.05 + 0.62 * head, 0.42 * head, 0.6 * head)
    half = width / 2
    sheet.cover((middle - 0.2 * head, 0.9 * head), (middle + 0.2 * head, 0.9 * head),
                (middle + 0.24 * head, neck), (middle + 0.8 * half, neck + 0.04),
                (middle + half, neck + 0.15), (middle + half + 0.1, tall),
                (middle - half - 0.1, tall), (middle - half, neck + 0.15),
                (middle - 0.8 * half, neck + 0.04), (middle - 0.24 * head, neck))  # fmt: skip
    sheet.rounded(1.08, 0.35, 0.85)
    sheet.wear(random, 0.1, 8, 128)
    return sheet


def _post(random: np.random.Generator, width: float, height: float) -> PaintedSheet:
    """Paint a lamp post or a pole with painted rings."""
    sheet = PaintedSheet(
        width, height, UNIT, sample_colour(random, ((70, 74, 76), (60, 84, 64), WOODS[2]))
    )
    if random.random() < 0.5:
        for y in np.arange(0.2, height, 0.5):
            sheet.painting.patch(0, y, width, 0.25, (60, 70, 190))
    sheet.cover_box(0, 0, width, height)
    sheet.rounded(1.15, 0.6, 0.8)
    sheet.wear(random, 0.08, 8, 64)
    return sheet


def _heap(random: np.random.Generator, width: float, height: float) -> PaintedSheet:
    """Paint a heap of boxes and sacks, down to the lower image border."""
    sheet = PaintedSheet(width, height, UNIT, (70, 88, 104))
    for x, wide in adjacent_spans(random, width, (0.2, 0.4)):
        y = random.uniform(0.0, 0.07)
        sheet.cover_box(x, y, wide, height)
        while y < height:
            tall = random.uniform(0.2, 0.45)
            sheet.painting.plate(x, y, wide, tall, sample_colour(random, WOODS + PAINTS), 0.012)
            sheet.painting.label(random, x + 0.2 * wide, y + 0.06, 0.5 * wide, 0.1)
            y += tall
    sheet.wear(random, 0.08, 4, 64)
    return sheet


OCCLUDERS = {
    "pillar": Occluder(_pillar, True, True),
    "trunk": Occluder(_trunk, True, True),
    "wall end": Occluder(_wall_end, True, True),
    "lorry": Occluder(_lorry, False, False, True),
    "bus": Occluder(_bus, False, False, True),
    "container": Occluder(_container, False, False, True),
    "ship": Occluder(_ship, False, False),
    "load": Occluder(_load, False, False),
    "passer-by": Occluder(_passer_by, False, False),
    "post": Occluder(_post, True, True),
    "heap": Occluder(_heap, False, False),
}
"""Occluders by name; the last two occlude only a part of the target."""
