"""What holds a target and moves with it: no part of it, and painted beneath it."""

import numpy as np

from datasets.synthetic.nguyen2002.film.paints import PAINTS
from datasets.synthetic.nguyen2002.film.sheet import UNIT, Sheet
from datasets.synthetic.render.colours import any_of
from datasets.synthetic.render.painting import Painting

__all__ = ["paint_carrier"]

STEEL = (96, 98, 100)
TYRE = (36, 34, 34)


def paint_carrier(random: np.random.Generator, kind: str, width: float, height: float) -> Sheet:
    """Paint a carrier around a target in its middle.

    Parameters
    ----------
    random : numpy.random.Generator
        Draws its colours.
    kind : {'wheels', 'rider', 'post', 'ropes', 'cart', 'water'}
    width, height : float
        Of the target [pixels].
    """
    w, h = width / UNIT, height / UNIT
    across, down = 2.6 * w, 6.0 * h
    sheet = Sheet(across, down, UNIT, STEEL)
    PAINTERS[kind](random, sheet, sheet.painting, (across / 2, down / 2), (w, h))
    sheet.wear(random, 0.08, 8, 64)
    return sheet


Pair = tuple[float, float]


def _wheels(
    random: np.random.Generator, sheet: Sheet, p: Painting, middle: Pair, size: Pair
) -> None:
    x, y = middle[0] - size[0] / 2, middle[1] + 0.4 * size[1]
    p.patch(x, y, size[0], 0.3 * size[1], (40, 40, 42))
    sheet.cover_box(x + 0.03, y, size[0] - 0.06, 0.18 * size[1])
    for at in (0.05, 0.77):
        p.patch(x + at * size[0], y, 0.18 * size[0], 0.31 * size[1], TYRE)
        sheet.cover_box(x + at * size[0], y, 0.18 * size[0], 0.3 * size[1])


def _rider(
    random: np.random.Generator, sheet: Sheet, p: Painting, middle: Pair, size: Pair
) -> None:
    (x, y), (w, h) = middle, size
    jacket = any_of(random, PAINTS[5:] + ((50, 48, 48), (66, 60, 56)))
    shape = [(x - 0.3 * w, y + 0.3 * h), (x + 0.3 * w, y + 0.3 * h), (x + 0.85 * w, y + 0.62 * h),
             (x + 1.1 * w, y + 1.3 * h), (x + 0.8 * w, y + 1.5 * h), (x + 0.62 * w, y + 2.9 * h),
             (x - 0.62 * w, y + 2.9 * h), (x - 0.8 * w, y + 1.5 * h), (x - 1.1 * w, y + 1.3 * h),
             (x - 0.85 * w, y + 0.62 * h)]  # fmt: skip
    p.area(shape, jacket)
    sheet.cover(*shape)
    for side in (-1, 1):
        p.line([(x + side * 0.4 * w, y + 0.5 * h), (x + side * 0.6 * w, y + 1.4 * h)], 0.05,
               jacket * 0.6)  # fmt: skip
    p.patch(x - 0.5 * w, y + 0.86 * h, w, 0.1 * h, any_of(random, PAINTS[:5]))
    p.line([(x, y + 0.5 * h), (x, y + 2.5 * h)], 0.02, jacket * 0.5)


def _post(random: np.random.Generator, sheet: Sheet, p: Painting, middle: Pair, size: Pair) -> None:
    thick = 0.09 * size[0]
    p.patch(middle[0] - thick, middle[1], 2 * thick, 3 * size[1], STEEL)
    p.patch(middle[0] - 0.5 * thick, middle[1], 0.5 * thick, 3 * size[1], (150, 152, 152))
    sheet.cover_box(middle[0] - thick, middle[1], 2 * thick, 3 * size[1])


def _ropes(
    random: np.random.Generator, sheet: Sheet, p: Painting, middle: Pair, size: Pair
) -> None:
    (x, y), (w, h) = middle, size
    p.patch(0, 0, 2.6 * w, 3 * h, (70, 92, 106))
    for side in (-0.42, 0.42):
        at = x + side * w
        sheet.cover((at - 0.012, y - 0.3 * h), (at + 0.012, y - 0.3 * h),
                    (x + 0.012, y - 1.1 * h), (x - 0.012, y - 1.1 * h))  # fmt: skip
    sheet.cover_box(x - 0.014, 0, 0.028, y - h)


def _cart(random: np.random.Generator, sheet: Sheet, p: Painting, middle: Pair, size: Pair) -> None:
    (x, y), (w, h) = middle, size
    left, top = x - 0.66 * w, y + 0.47 * h
    p.patch(left, top, 1.32 * w, 0.12 * h, any_of(random, PAINTS))
    p.patch(left, top + 0.08 * h, 1.32 * w, 0.05 * h, (50, 52, 56))
    sheet.cover_box(left, top, 1.32 * w, 0.13 * h)
    for at in (left + 0.22 * w, left + 1.1 * w):
        p.disc(at, top + 0.22 * h, 0.13 * w, TYRE)
        p.disc(at, top + 0.22 * h, 0.06 * w, STEEL)
        sheet.cover_round(at, top + 0.22 * h, 0.13 * w, 0.13 * w)
    rail = left + 1.28 * w
    sheet.cover_box(rail, y - 0.3 * h, 0.04 * w, 0.8 * h)


def _water(
    random: np.random.Generator, sheet: Sheet, p: Painting, middle: Pair, size: Pair
) -> None:
    (x, y), (w, h) = middle, size
    p.patch(0, y, 2.6 * w, 3 * h, (206, 204, 190))
    p.patch(0, y + 0.56 * h, 2.6 * w, 2 * h, (96, 84, 66))
    sheet.cover_round(x, y + 0.5 * h, 0.62 * w, 0.1 * h)
    for k in range(4):
        sheet.cover_round(x + random.uniform(-0.1, 0.1) * w, y + (0.6 + 0.1 * k) * h,
                          (0.5 - 0.07 * k) * w, 0.035 * h)  # fmt: skip


PAINTERS = {
    "wheels": _wheels,
    "rider": _rider,
    "post": _post,
    "ropes": _ropes,
    "cart": _cart,
    "water": _water,
}
