"""Targets of the clips: outlines, painted marks, and two textures under different light.

A mark is a print, window, band, lamp, strap or similar. The function of a mark takes a painting, a
generator, width and height, and the colours of the target.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from trackmark.datasets.interface import Array
from trackmark.datasets.synthetic.nguyen2002.film.objects import (
    DARK,
    GLASS,
    LIGHTS,
    PAINTS,
    UNIT,
    WOODS,
    PaintedSheet,
    point_list,
)
from trackmark.datasets.synthetic.render.colours import sample_colour, vary_colour
from trackmark.datasets.synthetic.render.painting import Colour, Painting
from trackmark.datasets.synthetic.render.texture import fractal, lerp

BODY = 0.87  # height of a van's body relative to the height of the van with its wheels


def _cover_ellipse(sheet: PaintedSheet, w: float, h: float, cut: float) -> None:
    sheet.cover_round(w / 2, h / 2, w / 2, h / 2)
    across, down = sheet.places()
    u, v = 2 * across - 1, 2 * down - 1
    sheet.light(1.06 - 0.34 * np.clip(u * u + v * v, 0, 1))


def _cover_box(sheet: PaintedSheet, w: float, h: float, cut: float) -> None:
    sheet.cover((cut, 0), (w - cut, 0), (w, cut), (w, h - cut), (w - cut, h), (cut, h),
                (0, h - cut), (0, cut))  # fmt: skip


def _cover_van(sheet: PaintedSheet, w: float, h: float, cut: float) -> None:
    body = BODY * h
    sheet.cover((cut, 0), (w - cut, 0), (w, cut), (w, body), (0, body), (0, cut))
    sheet.painting.patch(0, body, w, h - body, DARK * 0.7)
    for x in (0.04 * w, 0.76 * w):
        sheet.cover_box(x, body, 0.2 * w, h - body)
    sheet.cover_box(0.24 * w, body, 0.52 * w, 0.3 * (h - body))


def _cover_boat(sheet: PaintedSheet, w: float, h: float, cut: float) -> None:
    across = (0.14, 0.86, 0.92, 1.0, 0.98, 0.88, 0.12, 0.02, 0.0, 0.08)
    down = (0.0, 0.0, 0.38, 0.38, 0.6, 1.0, 1.0, 0.6, 0.38, 0.38)
    sheet.cover(*point_list(np.array(across) * w, np.array(down) * h))


# functions by shape that cover an outline of a width and height with cut corners [UNIT]
OUTLINES = {
    "round": _cover_ellipse, "box": _cover_box, "van": _cover_van, "boat": _cover_boat,
}  # fmt: skip


@dataclass(frozen=True)
class TargetLook:
    """Colours of a target."""

    body: Colour
    second: Colour
    ink: Colour


Mark = Callable[[Generator, Painting, float, float, TargetLook], None]


def _writing(
    random: Generator, p: Painting, box: tuple[float, float, float, float], ink: Colour
) -> None:
    left, top, width, height = box
    x, thick = left, 0.16 * height
    while x + 0.35 * height <= left + width:
        wide = random.uniform(0.35, 0.7) * height
        wide = min(wide, left + width - x)
        p.patch(x, top, thick, height, ink)
        for level in random.choice([0.0, 0.42, 0.84], int(random.integers(1, 3)), replace=False):
            p.patch(x, top + level * height, wide, thick, ink)
        if random.random() < 0.5:
            p.patch(x + wide - thick, top, thick, height * random.choice([0.5, 1.0]), ink)
        x += wide + 0.22 * height


def lettering(random: Generator, p: Painting, w: float, h: float, look: TargetLook) -> None:
    """Paint a line of large letters, and a line of smaller letters below it."""
    top, tall = random.uniform(0.38, 0.5) * h, random.uniform(0.13, 0.19) * h
    _writing(random, p, (0.14 * w, top, 0.72 * w, tall), look.ink)
    _writing(random, p, (0.2 * w, top + 1.35 * tall, 0.6 * w, 0.45 * tall), look.second)


def number(random: Generator, p: Painting, w: float, h: float, look: TargetLook) -> None:
    """Paint two or three large figures on a plate."""
    left, top = random.uniform(0.24, 0.34) * w, random.uniform(0.62, 0.68) * h
    p.patch(left - 0.05 * w, top - 0.03 * h, 0.46 * w, 0.21 * h, look.second)
    _writing(random, p, (left, top, 0.36 * w, 0.15 * h), DARK if look.second.mean() > 110 else
             np.array(LIGHTS[0], np.float64))  # fmt: skip


def band(random: Generator, p: Painting, w: float, h: float, look: TargetLook) -> None:
    """Paint one or two horizontal stripes."""
    top = random.uniform(0.3, 0.62) * h
    p.patch(0, top, w, random.uniform(0.1, 0.2) * h, look.second)
    if random.random() < 0.6:
        p.patch(0, top + 0.24 * h, w, 0.04 * h, look.ink)


def slanted(random: Generator, p: Painting, w: float, h: float, look: TargetLook) -> None:
    """Paint a slanted stripe of the second colour."""
    x, lean, wide = random.uniform(0.05, 0.4) * w, random.uniform(-0.4, 0.4) * w, 0.3 * w
    p.area([(x, 0), (x + wide, 0), (x + wide + lean, h), (x + lean, h)], look.second)
    p.area([(x + 1.2 * wide, 0), (x + 1.4 * wide, 0), (x + 1.4 * wide + lean, h),
            (x + 1.2 * wide + lean, h)], look.ink)  # fmt: skip


def window(random: Generator, p: Painting, w: float, h: float, look: TargetLook) -> None:
    """Paint panes that reflect the sky."""
    top, tall = random.uniform(0.07, 0.11) * h, random.uniform(0.24, 0.32) * h
    panes = int(random.integers(1, 3))
    glass = vary_colour(random, GLASS, 0.2)
    p.plate(0.08 * w, top - 0.02 * h, 0.84 * w, tall + 0.04 * h, look.body * 0.55, 0.01)
    for pane in range(panes):
        wide = 0.8 * w / panes
        x = 0.1 * w + pane * wide
        p.patch(x + 0.01, top, wide - 0.02, tall, glass)
        glare_x = x + random.uniform(0.15, 0.5) * wide
        p.area([(glare_x, top), (glare_x + 0.22 * wide, top), (glare_x + 0.05 * wide, top + tall),
                (glare_x - 0.17 * wide, top + tall)], glass * 1.3 + 56)  # fmt: skip
        p.patch(x + 0.01, top + 0.75 * tall, wide - 0.02, 0.25 * tall, glass * 0.6)


def lamps(random: Generator, p: Painting, w: float, h: float, look: TargetLook) -> None:
    """Paint lamps on both sides, a bumper, a number plate."""
    paint = sample_colour(random, ((52, 52, 190), (90, 200, 226), (216, 226, 228)))
    for x in (0.05 * w, 0.83 * w):
        p.plate(x, 0.66 * h, 0.12 * w, 0.13 * h, paint, 0.008)
        p.patch(x, 0.73 * h, 0.12 * w, 0.03 * h, (70, 150, 230))
    p.plate(0.02 * w, 0.85 * h, 0.96 * w, 0.09 * h, vary_colour(random, (88, 88, 90)), 0.01)
    p.patch(0.32 * w, 0.74 * h, 0.36 * w, 0.09 * h, LIGHTS[0])
    _writing(random, p, (0.35 * w, 0.755 * h, 0.3 * w, 0.055 * h), DARK)


def door(random: Generator, p: Painting, w: float, h: float, look: TargetLook) -> None:
    """Paint the gap between two door leaves, hinges, a handle."""
    x = random.uniform(0.42, 0.58) * w
    p.darken(x, 0.03 * h, 0.012, 0.9 * h, 0.5)
    for y in (0.45, 0.8):
        p.plate(x + 0.02, y * h, 0.07 * w, 0.03 * h, look.body * 0.6 + 30, 0.006)


def visor(random: Generator, p: Painting, w: float, h: float, look: TargetLook) -> None:
    """Paint a dark visor with a glare, and its rim."""
    top, low = random.uniform(0.32, 0.38) * h, random.uniform(0.58, 0.66) * h
    glass = vary_colour(random, (66, 54, 50), 0.3)
    rim = [(0, top - 0.05 * h), (w, top - 0.05 * h), (w, low), (0.5 * w, low + 0.07 * h), (0, low)]
    p.area(rim, look.ink)
    p.area([(0.04 * w, top), (0.96 * w, top), (0.95 * w, low - 0.05 * h),
            (0.5 * w, low + 0.02 * h), (0.05 * w, low - 0.05 * h)], glass)  # fmt: skip
    x = random.uniform(0.15, 0.5) * w
    p.area([(x, top), (x + 0.24 * w, top), (x + 0.12 * w, low - 0.04 * h),
            (x - 0.04 * w, low - 0.04 * h)], glass + 110)  # fmt: skip


def crest(random: Generator, p: Painting, w: float, h: float, look: TargetLook) -> None:
    """Paint stripes over the crown."""
    x = random.uniform(0.36, 0.5) * w
    p.patch(x, 0, 0.18 * w, h, look.second)
    p.patch(x + 0.24 * w, 0, 0.05 * w, h, look.ink)


def planks(random: Generator, p: Painting, w: float, h: float, look: TargetLook) -> None:
    """Paint boards with gaps, a frame and nails."""
    count = int(random.integers(4, 7))
    for k in range(count):
        p.patch(0, k * h / count, w, h / count, look.body * random.uniform(0.78, 1.14))
        p.darken(0, k * h / count, w, 0.014, 0.45)
    beam = 0.13 * w
    for x in (0.0, w - beam):
        p.plate(x, 0, beam, h, look.body * random.uniform(0.85, 1.05), 0.012)
        for k in range(count):
            p.disc(x + beam / 2, (k + 0.5) * h / count, 0.012, DARK)
    if random.random() < 0.5:
        p.line([(beam, h), (w - beam, 0)], 0.1 * w, look.body * 0.86)


def label(random: Generator, p: Painting, w: float, h: float, look: TargetLook) -> None:
    """Paint a paper label with fine print, and a coloured bar."""
    x, y = random.uniform(0.16, 0.4) * w, random.uniform(0.1, 0.2) * h
    p.plate(x, y, 0.42 * w, 0.26 * h, sample_colour(random, LIGHTS), 0.008)
    p.label(random, x + 0.02, y + 0.02, 0.42 * w - 0.04, 0.16 * h, LIGHTS[0], DARK)
    p.patch(x + 0.02, y + 0.19 * h, 0.2 * w, 0.05 * h, look.second)


def straps(random: Generator, p: Painting, w: float, h: float, look: TargetLook) -> None:
    """Paint leather straps with buckles, and patched corners."""
    leather = look.body * 0.5
    for x in (0.22 * w, 0.68 * w):
        p.plate(x, 0, 0.1 * w, h, leather, 0.01)
        p.plate(x - 0.01, random.uniform(0.2, 0.3) * h, 0.1 * w + 0.02, 0.07 * h,
                (120, 176, 190), 0.008)  # fmt: skip
    for x in (0.0, 0.86 * w):
        for y in (0.0, 0.88 * h):
            p.plate(x, y, 0.14 * w, 0.12 * h, leather * 1.2, 0.006)
    p.darken(0, 0.46 * h, w, 0.016, 0.45)


def stickers(random: Generator, p: Painting, w: float, h: float, look: TargetLook) -> None:
    """Paint hotel labels."""
    for place in ((0.36, 0.12), (0.4, 0.56), (0.05, 0.36)):
        x, y = (np.array(place) + random.uniform(-0.03, 0.05, 2)) * (w, h)
        paint = sample_colour(random, PAINTS)
        if random.random() < 0.5:
            p.disc(x + 0.13 * w, y + 0.12 * h, 0.13 * w, paint)
            p.disc(x + 0.13 * w, y + 0.12 * h, 0.09 * w, sample_colour(random, LIGHTS))
            p.patch(x + 0.06 * w, y + 0.1 * h, 0.14 * w, 0.04 * h, paint)
        else:
            p.patch(x, y, 0.28 * w, 0.22 * h, paint)
            _writing(random, p, (x + 0.03 * w, y + 0.04 * h, 0.22 * w, 0.09 * h),
                     np.array(LIGHTS[0], np.float64))  # fmt: skip


def hoops(random: Generator, p: Painting, w: float, h: float, look: TargetLook) -> None:
    """Paint rolled hoops with rust streaks."""
    for y in (0.0, 0.3, 0.64, 0.95):
        p.plate(0, y * h, w, 0.05 * h, look.body * 0.86, 0.01)
    for _ in range(int(random.integers(3, 7))):
        x, y = random.uniform(0, 0.95) * w, random.uniform(0, 0.7) * h
        p.darken(x, y, random.uniform(0.02, 0.07) * w, random.uniform(0.1, 0.3) * h, 0.72)


def ribs(random: Generator, p: Painting, w: float, h: float, look: TargetLook) -> None:
    """Paint the hoops of a paper lantern, darker towards its ends."""
    count = int(random.integers(7, 11))
    for k in range(count):
        p.darken(0, k * h / count, w, 0.02, 0.78)
    for y in (0.0, 0.87 * h):
        p.patch(0, y, w, 0.13 * h, look.ink)
        p.patch(0, y + 0.04 * h, w, 0.03 * h, look.second)


def emblem(random: Generator, p: Painting, w: float, h: float, look: TargetLook) -> None:
    """Paint a disc with a star-shaped emblem."""
    x, y, size = 0.5 * w, random.uniform(0.4, 0.52) * h, random.uniform(0.2, 0.27) * w
    p.disc(x, y, size, look.second)
    inner = look.body * 0.7 if random.random() < 0.5 else look.ink
    sides = int(random.integers(3, 6))
    turn = 2 * np.pi * (np.arange(2 * sides) / (2 * sides) + random.uniform())
    far = np.where(np.arange(2 * sides) % 2, 0.42, 0.95) * size
    p.area(point_list(x + far * np.cos(turn), y + far * np.sin(turn)), inner)


def rim(random: Generator, p: Painting, w: float, h: float, look: TargetLook) -> None:
    """Paint the plate of a sign: a coloured ring around a light field."""
    turn = np.linspace(0, 2 * np.pi, 61)
    wide = random.uniform(0.36, 0.41)
    x, y = 0.5 + wide * np.cos(turn), 0.5 + wide * np.sin(turn)
    p.area(point_list(x * w, y * h), sample_colour(random, LIGHTS))


def device(random: Generator, p: Painting, w: float, h: float, look: TargetLook) -> None:
    """Paint a sign's symbol: an arrow, bars or a peak, with a line of writing below."""
    side = float(random.choice([-1, 1]))
    ink = look.body * 0.6 if look.body.mean() > 90 else DARK
    shapes = (
        [[(-0.26, -0.05), (0.02, -0.05), (0.02, -0.13), (0.26, 0.02), (0.02, 0.17), (0.02, 0.09),
          (-0.26, 0.09)]],
        [[(x, -0.16), (x + 0.12, -0.16), (x + 0.02, 0.15), (x - 0.1, 0.15)]
         for x in (-0.22, -0.02, 0.18)],
        [[(-0.28, 0.16), (-0.08, -0.16), (0.04, 0.16)], [(0.0, 0.16), (0.12, -0.04), (0.26, 0.16)]],
    )  # fmt: skip
    for k, shape in enumerate(shapes[int(random.integers(len(shapes)))]):
        points = [((0.5 + side * x) * w, (0.4 + y) * h) for x, y in shape]
        p.area(points, look.second * 0.8 if k == 1 else ink)
    _writing(random, p, (0.28 * w, 0.62 * h, 0.44 * w, 0.13 * h), look.second * 0.7)


def dial(random: Generator, p: Painting, w: float, h: float, look: TargetLook) -> None:
    """Paint the face of a stopped clock: strokes and hands."""
    rim(random, p, w, h, look)
    for k in range(12):
        turn, start = np.pi * k / 6, 0.27 if k % 3 == 0 else 0.31
        ends = [((0.5 + r * np.cos(turn)) * w, (0.5 + r * np.sin(turn)) * h) for r in (start, 0.35)]
        p.line(ends, 0.035 if k % 3 == 0 else 0.022, DARK)
    for length, thick in ((0.2, 0.036), (0.3, 0.024)):
        turn = random.uniform(0, 2 * np.pi)
        p.line([(0.5 * w, 0.5 * h), ((0.5 + length * np.cos(turn)) * w,
               (0.5 + length * np.sin(turn)) * h)], thick, look.body * 0.6)  # fmt: skip
    _writing(random, p, (0.36 * w, 0.62 * h, 0.28 * w, 0.06 * h), look.body * 0.7)


def poster(random: Generator, p: Painting, w: float, h: float, look: TargetLook) -> None:
    """Paint a poster with ground, sky, a disc and triangles."""
    sky, ground, sun = (sample_colour(random, PAINTS) for _ in range(3))
    p.patch(0.07 * w, 0.06 * h, 0.86 * w, 0.56 * h, sky)
    level = random.uniform(0.38, 0.5) * h
    p.patch(0.07 * w, level, 0.86 * w, 0.62 * h - level, ground)
    x, y = random.uniform(0.25, 0.75) * w, random.uniform(0.18, 0.36) * h
    p.disc(x, y, 0.11 * w, sun * 0.5 + 110)
    for _ in range(3):
        x, tall = random.uniform(0.12, 0.66) * w, random.uniform(0.1, 0.3) * h
        p.area([(x, level), (x + 0.11 * w, level - tall), (x + 0.24 * w, level)], sky * 0.55)
    _writing(random, p, (0.1 * w, 0.68 * h, 0.8 * w, 0.15 * h), look.ink)
    _writing(random, p, (0.14 * w, 0.88 * h, 0.72 * w, 0.06 * h), look.second)


def tyre(random: Generator, p: Painting, w: float, h: float, look: TargetLook) -> None:
    """Paint a rubber tyre around a painted cover."""
    turn = np.linspace(0, 2 * np.pi, 61)
    for far, paint in ((0.47, DARK), (0.43, DARK * 1.5), (0.405, look.ink)):
        x, y = (0.5 + far * np.cos(turn)) * w, (0.5 + far * np.sin(turn)) * h
        p.line(point_list(x, y), 0.07 * w, paint)


def hull(random: Generator, p: Painting, w: float, h: float, look: TargetLook) -> None:
    """Paint the front of a boat: cabin, planks, a stripe, the water line."""
    p.patch(0.0, 0, w, 0.4 * h, vary_colour(random, LIGHTS[0]))
    for x in (0.18, 0.42, 0.66):
        p.hole(x * w, 0.1 * h, 0.17 * w, 0.17 * h, vary_colour(random, GLASS, 0.3))
    p.plate(0, 0.38 * h, w, 0.06 * h, look.second, 0.012)
    for y in (0.55, 0.66, 0.77):
        p.darken(0, y * h, w, 0.01, 0.72)
    p.patch(0, 0.86 * h, w, 0.14 * h, vary_colour(random, (52, 56, 120)))
    p.darken(0.5 * w, 0.44 * h, 0.5 * w, h, 0.8)
    _writing(random, p, (0.1 * w, 0.48 * h, 0.34 * w, 0.1 * h), look.ink)
    for x in (0.64, 0.82):
        p.disc(x * w, 0.62 * h, 0.06 * w, DARK)
        p.disc(x * w, 0.62 * h, 0.025 * w, look.body)


def foam(random: Generator, p: Painting, w: float, h: float, look: TargetLook) -> None:
    """Paint foam at the water line."""
    for x in np.arange(0, w, 0.02):
        tall = random.uniform(0.02, 0.09) * h
        p.patch(float(x), h - tall, 0.02, tall, vary_colour(random, (214, 210, 198), 0.06))


@dataclass(frozen=True)
class TargetKind:
    """Kind of target: shape, marks and carrier."""

    shape: str  # `round` (an ellipse: the corners of its box are background), `box`, `van`, `boat`
    corner: float  # size of the cut corners of the other shapes, relative to the width
    marks: tuple[Mark, ...]  # marks that are painted on it, in order
    paints: tuple[tuple[int, int, int], ...]
    carrier: str  # name in `objects.CARRIERS`

    @property
    def round(self) -> bool:
        """True if the shape is an ellipse."""
        return self.shape == "round"


def paint_target(random: Generator, kind: TargetKind, width: float, height: float) -> PaintedSheet:
    """Return a painted target of a kind with a width and height [pixels]."""
    w, h = width / UNIT, height / UNIT
    body = sample_colour(random, kind.paints)
    other_paints = [paint for paint in PAINTS if np.abs(np.subtract(paint, body)).sum() > 110]
    light = sample_colour(random, LIGHTS)
    second = light if random.random() < 0.45 else sample_colour(random, other_paints)
    look = TargetLook(body, second, DARK if body.mean() > 125 else light)
    sheet = PaintedSheet(w, h, UNIT, body)
    for mark in kind.marks:
        mark(random, sheet.painting, w, BODY * h if kind.shape == "van" else h, look)
    OUTLINES[kind.shape](sheet, w, h, kind.corner * w)
    sheet.wear(random, random.uniform(0.05, 0.09), 8, 128)
    return sheet


def two_textures(random: Generator, colour: Array) -> tuple[Array, Array]:
    """Return a texture (h, w, 3) in two variants that differ in highlight and dust."""
    height, width = colour.shape[:2]
    across = np.linspace(-1, 1, width) * random.choice([-1.0, 1.0])
    slant = across + random.uniform(-0.5, 0.5) * np.linspace(-1, 1, height)[:, None]
    lean, gloss = random.uniform(0.06, 0.18), random.uniform(5, 30)
    textures = []
    for side in (-1, 1):
        shine = np.clip(1 - np.square((slant - 0.5 * side) / 0.3), 0, 1)
        textures.append(colour * (1 + lean * side * slant)[..., None] + gloss * shine[..., None])
    dust = 0.5 + 0.5 * fractal(random, 256, 8, 128)[:height, :width]
    dusty = lerp(textures[1], np.array([150.0, 168.0, 182.0]), dust * random.uniform(0.0, 0.3))
    return textures[0], dusty


# kinds of targets by name
KINDS = {
    "van": TargetKind("van", 0.05, (band, door, window, lettering, lamps), PAINTS, "wheels"),
    "helmet": TargetKind("round", 0.0, (crest, visor, number), PAINTS, "rider"),
    "sign": TargetKind("round", 0.0, (rim, device), PAINTS[:6], "trailer"),
    "board": TargetKind("box", 0.01, (poster,), PAINTS, "trailer"),
    "boat": TargetKind("boat", 0.12, (hull, foam), PAINTS, "water"),
    "buoy": TargetKind("round", 0.0, (slanted, band, emblem, number, foam), PAINTS[:4], "water"),
    "fender": TargetKind("round", 0.0, (slanted, band, emblem, lettering), PAINTS, "ropes"),
    "crate": TargetKind("box", 0.01, (planks, label, number), WOODS, "ropes"),
    "barrel": TargetKind("round", 0.0, (planks, emblem, lettering), WOODS, "cart"),
    "spare wheel": TargetKind("round", 0.0, (slanted, emblem, lettering, tyre), PAINTS, "car"),
    "drum": TargetKind("box", 0.06, (band, hoops, label, lettering), PAINTS, "cart"),
    "case": TargetKind("box", 0.07, (straps, stickers), WOODS + PAINTS[6:9], "cart"),
    "clock": TargetKind("round", 0.0, (dial,), PAINTS, "trailer"),
    "lantern": TargetKind("round", 0.0, (slanted, ribs, emblem), PAINTS[:6], "ropes"),
}
