"""Clothes of the eight sequences, chosen by their distance from the street and from passers-by.

The grey and brown houses, roads and passers-by of the street have little chroma. Targets wear
saturated clothes. Passers-by wear clothes whose chromaticity differs from both of the target's.
"""

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.synthetic.multipart.casting import SHIRTS, TROUSERS, dyed
from trackmark.datasets.synthetic.multipart.look import Look
from trackmark.datasets.synthetic.render.colours import BGR

SATURATED: tuple[BGR, ...] = (
    (40, 36, 200),  # red
    (60, 30, 170),  # crimson
    (190, 90, 30),  # blue
    (170, 60, 40),  # royal blue
    (40, 200, 230),  # yellow
    (30, 110, 230),  # orange
    (150, 50, 110),  # purple
    (140, 50, 200),  # magenta
)

DIFFERENT_HALVES = 90.0, 25.0
"""Least distances of shirt and trousers of two colours: in chromaticity and in L* [CIE L*u*v*]."""

UNLIKE_TARGET = 45.0
"""Least distance of a passer-by's chromaticities from the target's [CIE u*, v*]."""


def plain_clothes(random: np.random.Generator) -> tuple[BGR, BGR]:
    """Shirt and trousers of nearly the same saturated colour."""
    cloth = dyed(random, SATURATED[random.integers(len(SATURATED))], 0.04)
    return cloth, dyed(random, cloth, 0.03)


def two_coloured_clothes(random: np.random.Generator) -> tuple[BGR, BGR]:
    """Shirt and trousers of two saturated colours that differ clearly."""
    pairs = [
        (shirt, trousers)
        for shirt in SATURATED
        for trousers in SATURATED
        if _differ(shirt, trousers)
    ]
    shirt, trousers = pairs[random.integers(len(pairs))]
    return dyed(random, shirt, 0.04), dyed(random, trousers, 0.04)


def passer_clothes(random: np.random.Generator, target: tuple[BGR, BGR]) -> tuple[BGR, BGR]:
    """Shirt and trousers of a passer-by, of other chromaticities than the target's."""
    shirts, trousers = (
        [c for c in colours if min(chroma_distance(c, worn) for worn in target) >= UNLIKE_TARGET]
        for colours in (SHIRTS, TROUSERS)
    )
    shirt, lower = shirts[random.integers(len(shirts))], trousers[random.integers(len(trousers))]
    return dyed(random, shirt), dyed(random, lower)


def mixed(look: Look) -> Look:
    """Clothes of the same build that are striped in the colours of shirt and trousers.

    They resemble the whole of the target and neither of its halves: four fifths of each garment
    have the colour of the target's other one.
    """
    return replace(look, shirt=look.jacket or look.shirt, striped=True, jacket=None, bag=None)


def _differ(first: BGR, second: BGR) -> bool:
    chroma, lightness = DIFFERENT_HALVES
    apart = abs(float(_luv(first)[0] - _luv(second)[0])) >= lightness
    return apart and chroma_distance(first, second) >= chroma


def chroma_distance(first: BGR, second: BGR) -> float:
    """Distance of two colours in CIE u* and v*."""
    difference = _luv(first)[1:] - _luv(second)[1:]
    return float(np.hypot(*difference))


def _luv(colour: BGR) -> NDArray[np.float32]:
    pixel = np.array([[colour]], np.float32) / 255
    return np.asarray(cv2.cvtColor(pixel, cv2.COLOR_BGR2Luv)[0, 0], np.float32)


def shade(colour: BGR, gain: float) -> BGR:
    """Darker or lighter colour of the same chromaticity."""
    blue, green, red = np.clip(np.round(np.multiply(colour, gain)), 0, 255).astype(int).tolist()
    return blue, green, red
