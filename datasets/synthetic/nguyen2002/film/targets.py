"""Targets: rigid things by kind, with their marks and how they come to look otherwise."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.nguyen2002.film import marks
from datasets.synthetic.nguyen2002.film.marks import Look, Mark
from datasets.synthetic.nguyen2002.film.paints import DARK, LIGHTS, PAINTS, WOODS
from datasets.synthetic.nguyen2002.film.sheet import UNIT, Sheet
from datasets.synthetic.render.colours import any_of
from datasets.synthetic.render.texture import fractal, lerp

__all__ = ["KINDS", "Kind", "paint_target", "two_looks"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Kind:
    """What targets of a kind have in common.

    Attributes
    ----------
    round : bool
        An ellipse: the corners of its box are background.
    corner : float
        Of the outline otherwise, cut off [share of the width].
    marks : tuple of functions
        What is painted on it, in order.
    paints : tuple of colours
    carrier : str
        What holds it; see `carriers`.
    """

    round: bool
    corner: float
    marks: tuple[Mark, ...]
    paints: tuple[tuple[int, int, int], ...]
    carrier: str


def paint_target(random: np.random.Generator, kind: Kind, width: float, height: float) -> Sheet:
    """Paint a target.

    Parameters
    ----------
    random : numpy.random.Generator
        Draws its colours and marks.
    kind : Kind
    width, height : float
        [pixels].
    """
    w, h = width / UNIT, height / UNIT
    body = any_of(random, kind.paints)
    others = [paint for paint in PAINTS if np.abs(np.subtract(paint, body)).sum() > 110]
    light = any_of(random, LIGHTS)
    second = light if random.random() < 0.45 else any_of(random, others)
    look = Look(body, second, DARK if body.mean() > 125 else light)
    sheet = Sheet(w, h, UNIT, body)
    for mark in kind.marks:
        mark(random, sheet.painting, w, h, look)
    if kind.round:
        sheet.cover_round(w / 2, h / 2, w / 2, h / 2)
        across, down = sheet.places()
        u, v = 2 * across - 1, 2 * down - 1
        sheet.light(1.06 - 0.34 * np.clip(u * u + v * v, 0, 1))
    else:
        cut = kind.corner * w
        sheet.cover((cut, 0), (w - cut, 0), (w, cut), (w, h - cut), (w - cut, h), (cut, h),
                    (0, h - cut), (0, cut))  # fmt: skip
    sheet.wear(random, random.uniform(0.05, 0.09), 8, 128)
    return sheet


def two_looks(random: np.random.Generator, colour: Array) -> tuple[Array, Array]:
    """The same surface in other light, with a gloss that has wandered, and some more dust.

    Parameters
    ----------
    random : numpy.random.Generator
        Draws how far it changes.
    colour : ndarray of float64, shape (h, w, 3)
    """
    height, width = colour.shape[:2]
    across = np.linspace(-1, 1, width) * random.choice([-1.0, 1.0])
    slant = across + random.uniform(-0.5, 0.5) * np.linspace(-1, 1, height)[:, None]
    lean, gloss = random.uniform(0.06, 0.18), random.uniform(5, 30)
    looks = []
    for side in (-1, 1):
        shine = np.clip(1 - np.square((slant - 0.5 * side) / 0.3), 0, 1)
        looks.append(colour * (1 + lean * side * slant)[..., None] + gloss * shine[..., None])
    dust = 0.5 + 0.5 * fractal(random, 256, 8, 128)[:height, :width]
    dusty = lerp(looks[1], np.array([150.0, 168.0, 182.0]), dust * random.uniform(0.0, 0.3))
    return looks[0], dusty


KINDS = {
    "van": Kind(
        False,
        0.05,
        (marks.band, marks.door, marks.window, marks.lettering, marks.lamps),
        PAINTS,
        "wheels",
    ),
    "helmet": Kind(True, 0.0, (marks.crest, marks.visor, marks.number), PAINTS, "rider"),
    "sign": Kind(True, 0.0, (marks.rim, marks.device), PAINTS[:6], "post"),
    "board": Kind(False, 0.01, (marks.poster,), PAINTS, "post"),
    "boat": Kind(False, 0.12, (marks.hull,), PAINTS, "water"),
    "buoy": Kind(
        True, 0.0, (marks.slanted, marks.band, marks.emblem, marks.number), PAINTS[:4], "water"
    ),
    "fender": Kind(
        True, 0.0, (marks.slanted, marks.band, marks.emblem, marks.lettering), PAINTS, "ropes"
    ),
    "crate": Kind(False, 0.01, (marks.planks, marks.label, marks.number), WOODS, "ropes"),
    "barrel": Kind(True, 0.0, (marks.planks, marks.emblem, marks.lettering), WOODS, "cart"),
    "spare wheel": Kind(
        True, 0.0, (marks.slanted, marks.emblem, marks.lettering, marks.tyre), PAINTS, "wheels"
    ),
    "drum": Kind(
        False, 0.06, (marks.band, marks.hoops, marks.label, marks.lettering), PAINTS, "cart"
    ),
    "case": Kind(False, 0.07, (marks.straps, marks.stickers), WOODS + PAINTS[6:9], "cart"),
    "clock": Kind(True, 0.0, (marks.dial,), PAINTS, "post"),
    "lantern": Kind(True, 0.0, (marks.slanted, marks.ribs, marks.emblem), PAINTS[:6], "ropes"),
}
"""By name."""
