"""Things that stand about in a clip: a camera that moves along passes them at their depth."""

import numpy as np

from datasets.synthetic.nguyen2002.film.paints import LIGHTS, PAINTS, WOODS
from datasets.synthetic.nguyen2002.film.sheet import Sheet
from datasets.synthetic.render.colours import any_of
from datasets.synthetic.render.prop import Prop

__all__ = ["boat", "bollard", "column", "goods", "rock", "stall", "trolley"]


def _prop(sheet: Sheet, x: float, z: float, random: np.random.Generator) -> Prop:
    """What stands on its sheet's lower border."""
    sheet.wear(random, 0.08, 4, 32, side=128)
    colour, coverage = sheet.reduced()
    return Prop(x, z, colour, coverage, float(len(coverage)))


def goods(random: np.random.Generator, x: float, z: float, scale: float) -> Prop:
    """Boxes and drums on a heap."""
    width, height = random.uniform(1.4, 2.6), random.uniform(0.8, 1.7)
    sheet = Sheet(width, height, scale, any_of(random, WOODS))
    p, left = sheet.painting, 0.0
    while left < width - 0.05:
        wide, tall = min(random.uniform(0.5, 0.9), width - left), random.uniform(0.5, 1) * height
        paint = any_of(random, WOODS + PAINTS)
        p.plate(left, height - tall, wide, tall, paint, 0.03)
        for y in np.arange(height - tall + 0.2, height, 0.3):
            p.darken(left, y, wide, 0.03, 0.7)
        p.label(random, left + 0.2 * wide, height - 0.8 * tall, 0.5 * wide, 0.2)
        sheet.cover_box(left, height - tall, wide, tall)
        left += wide + 0.02
    return _prop(sheet, x, z, random)


def bollard(random: np.random.Generator, x: float, z: float, scale: float) -> Prop:
    """Iron bollard, or a mooring post with rings."""
    tall = random.uniform(0.6, 1.5)
    sheet = Sheet(0.5, tall, scale, any_of(random, ((52, 54, 58), (60, 84, 104), (46, 50, 120))))
    sheet.painting.patch(0, 0, 0.5, 0.16, any_of(random, LIGHTS))
    sheet.painting.patch(0, 0.3, 0.5, 0.12, any_of(random, LIGHTS))
    sheet.cover_box(0.1, 0.0, 0.3, tall)
    sheet.cover_box(0.0, tall - 0.12, 0.5, 0.12)
    across, _ = sheet.places()
    sheet.light(1.15 - 0.5 * np.square(2 * across - 0.8))
    return _prop(sheet, x, z, random)


def boat(random: np.random.Generator, x: float, z: float, scale: float) -> Prop:
    """A small boat with a mast."""
    paint = any_of(random, PAINTS)
    sheet = Sheet(3.4, 3.6, scale, paint)
    p = sheet.painting
    p.patch(0, 0, 3.4, 2.6, any_of(random, LIGHTS))
    p.patch(1.6, 0, 0.1, 2.6, (70, 90, 110))
    for left in (0.8, 1.4, 2.0):
        p.patch(left, 2.15, 0.4, 0.3, (76, 68, 60))
    p.patch(0, 2.72, 3.4, 0.14, any_of(random, LIGHTS))
    p.patch(0, 3.4, 3.4, 0.2, paint * 0.5)
    sheet.cover_box(0.7, 2.0, 1.9, 0.6)
    sheet.cover_box(1.6, 0.0, 0.09, 2.2)
    sheet.cover((0.0, 2.6), (3.4, 2.5), (3.1, 3.6), (0.4, 3.6))
    return _prop(sheet, x, z, random)


def column(random: np.random.Generator, x: float, z: float, scale: float) -> Prop:
    """Iron column of a hall's roof, higher than the picture."""
    wide, tall = random.uniform(0.24, 0.36), 8.0
    sheet = Sheet(2 * wide, tall, scale, any_of(random, ((84, 104, 70), (92, 86, 80), PAINTS[0])))
    for y in (tall - 1.1, tall - 3.2, tall - 3.5):
        sheet.painting.patch(0, y, 2 * wide, 0.12, any_of(random, LIGHTS))
    sheet.cover_box(wide / 2, 0, wide, tall)
    sheet.cover_box(0, tall - 0.4, 2 * wide, 0.4)
    across, _ = sheet.places()
    sheet.light(1.15 - 0.6 * np.square(2 * across - 0.8))
    return _prop(sheet, x, z, random)


def trolley(random: np.random.Generator, x: float, z: float, scale: float) -> Prop:
    """Cases on a trolley."""
    width, height = 1.7, 1.5
    sheet = Sheet(width, height, scale, (70, 74, 80))
    p, top = sheet.painting, height - 0.35
    for _ in range(int(random.integers(1, 4))):
        wide = random.uniform(0.8, 1.4)
        left = (width - wide) / 2 + random.uniform(-0.12, 0.12)
        tall = random.uniform(0.25, 0.4)
        top -= tall
        paint = any_of(random, WOODS + PAINTS)
        p.plate(left, top, wide, tall, paint, 0.03)
        p.patch(left + 0.2 * wide, top, 0.08, tall, paint * 0.5)
        p.patch(left + 0.7 * wide, top, 0.08, tall, paint * 0.5)
        sheet.cover_box(left, top, wide, tall)
    sheet.cover_box(0.1, height - 0.35, 1.5, 0.1)
    for at in (0.4, 1.3):
        p.disc(at, height - 0.14, 0.14, (40, 40, 42))
        sheet.cover_round(at, height - 0.14, 0.14, 0.14)
    return _prop(sheet, x, z, random)


def stall(random: np.random.Generator, x: float, z: float, scale: float) -> Prop:
    """A market stall: striped awning, lamps, heaps of fruit."""
    width, height = random.uniform(2.4, 3.4), 2.7
    sheet = Sheet(width, height, scale, (70, 84, 100))
    p = sheet.painting
    first, second = any_of(random, PAINTS), any_of(random, LIGHTS)
    stripes = int(random.integers(6, 10))
    for k in range(stripes):
        p.patch(k * width / stripes, 0, width / stripes, 0.75, first if k % 2 else second)
    p.darken(0, 0.62, width, 0.13, 0.75)
    p.patch(0, 0.75, width, 1.0, (48, 58, 70))
    for at in np.arange(0.2, width, 0.4):
        p.patch(at, 0.8, 0.22, random.uniform(0.2, 0.7), any_of(random, PAINTS))
    counter, left = 1.72, 0.0
    while left < width - 0.1:
        wide, fruit = min(random.uniform(0.5, 0.9), width - left), any_of(random, PAINTS[:5])
        for _ in range(26):
            at = left + random.uniform(0.05, wide - 0.05), counter + random.uniform(0, 0.2)
            p.disc(*at, 0.075, fruit * random.uniform(0.7, 1.2))
        left += wide
    p.plate(0, 1.95, width, 0.8, any_of(random, WOODS), 0.04)
    for at in np.arange(0, width, 0.35):
        p.darken(at, 1.95, 0.03, 0.8, 0.6)
    sheet.cover((0.15, 0.0), (width - 0.15, 0.0), (width, 0.75), (0.0, 0.75))
    sheet.cover_box(0.1, 0.7, width - 0.2, height - 0.7)
    return _prop(sheet, x, z, random)


def rock(random: np.random.Generator, x: float, z: float, scale: float) -> Prop:
    """A boulder with cracks."""
    width, height = random.uniform(0.8, 2.4), random.uniform(0.4, 1.1)
    sheet = Sheet(width, height, scale, any_of(random, ((92, 128, 164), (108, 136, 158))))
    turn = np.linspace(np.pi, 2 * np.pi, 12)
    far = random.uniform(0.75, 1.0, 12)
    along = (0.5 + 0.5 * far * np.cos(turn)) * width
    up = height * (1 + far * np.sin(turn))
    sheet.cover(*zip(along.tolist(), up.tolist(), strict=True))
    _, down = sheet.places()
    sheet.light(1.2 - 0.6 * down)
    sheet.wear(random, 0.25, 8, 64, side=128)
    return _prop(sheet, x, z, random)
