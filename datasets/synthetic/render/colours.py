"""Palette of objects in kitchens, rooms and factories, BGR in [0, 255]."""

from collections.abc import Sequence
from colorsys import rgb_to_hsv
from typing import TypeAlias

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike

from trackmark.datasets.interface import Array

BGR: TypeAlias = tuple[int, int, int]

# Colours of cups. No cup has the hue of skin, wood or a cream wall.
CUPS: tuple[BGR, ...] = (
    (168, 88, 36),  # blue
    (140, 62, 44),  # dark blue
    (132, 124, 28),  # turquoise
    (66, 126, 42),  # green
    (138, 62, 96),  # violet
    (62, 30, 164),  # crimson
    (104, 46, 150),  # magenta
)

NEUTRALS: tuple[BGR, ...] = (
    (192, 208, 216),  # cream
    (200, 210, 214),  # white
    (168, 176, 182),  # warm grey
    (152, 174, 190),  # sand
    (204, 196, 182),  # pale blue
)
COUNTERS: tuple[BGR, ...] = (
    (92, 132, 172),  # beech
    (58, 88, 124),  # walnut
    (120, 158, 190),  # maple
    (118, 126, 132),  # stone
)
ACCENTS: tuple[BGR, ...] = (
    (44, 160, 216),  # mustard
    (46, 104, 206),  # orange
    (44, 44, 172),  # red
    (60, 138, 122),  # olive green
    (150, 104, 56),  # blue
    (196, 204, 206),  # white
    (56, 52, 50),  # black
    (96, 130, 160),  # earthenware
)
STEELS: tuple[BGR, ...] = ((152, 158, 160), (160, 156, 150))
CLOTHES: tuple[BGR, ...] = (
    (74, 70, 68),  # charcoal
    (150, 148, 144),  # grey
    (186, 200, 208),  # cream
    (60, 110, 96),  # olive
    (44, 74, 150),  # rust
    (96, 62, 46),  # navy
    (70, 148, 190),  # ochre
)

MACHINES: tuple[BGR, ...] = (
    (96, 118, 84),  # machine green
    (150, 128, 96),  # blue grey
    (176, 180, 178),  # light grey
    (158, 190, 204),  # cream
    (146, 96, 50),  # blue
    (62, 158, 196),  # yellow
    (52, 108, 192),  # orange
    (128, 140, 62),  # turquoise
    (96, 94, 92),  # dark grey
    (110, 150, 182),  # beige
    (58, 56, 130),  # red
)
# colours of buttons, lamps, signs and wires
SIGNALS: tuple[BGR, ...] = (
    (40, 36, 190),  # red
    (40, 190, 220),  # yellow
    (60, 150, 50),  # green
    (180, 90, 30),  # blue
    (36, 120, 224),  # orange
    (224, 226, 226),  # white
    (36, 34, 34),  # black
    (150, 60, 130),  # violet
    (160, 160, 40),  # cyan
)

STORED: tuple[BGR, ...] = (
    (92, 134, 170), (110, 152, 186),  # cardboard
    (190, 110, 40), (46, 46, 176), (50, 180, 214), (84, 140, 52),  # plastic boxes
    (120, 122, 124), (206, 208, 206), (52, 50, 50),  # cans
    (62, 96, 138),  # wood
)  # fmt: skip
STEEL, DARK = (150, 150, 146), (44, 44, 46)

APART = 0.1  # minimum hue difference between the cup and other objects; hues are in [0, 1]


def sample_other_hue(random: Generator, colours: Sequence[BGR], cup: Array) -> Array:
    """Sample a slightly varied colour whose hue differs from the hue of the cup."""
    fit = [colour for colour in colours if APART < abs(_hue(colour) - _hue(cup)) < 1 - APART]
    return sample_similar(random, fit, 0.05)


def sample_colour(random: Generator, colours: Sequence[BGR], spread: float = 0.10) -> Array:
    """Sample one of several colours and apply `vary_colour`."""
    return vary_colour(random, colours[int(random.integers(len(colours)))], spread)


def vary_colour(random: Generator, colour: ArrayLike, spread: float = 0.10) -> Array:
    """Vary brightness and channels of a colour slightly."""
    gains = (1 + spread * random.uniform(-1, 1)) * (1 + spread / 2 * random.uniform(-1, 1, 3))
    return np.asarray(np.clip(np.asarray(colour, np.float64) * gains, 0, 255))


def sample_similar(random: Generator, colours: Sequence[BGR], spread: float) -> Array:
    """Sample one of several colours and apply `vary_slightly`."""
    return vary_slightly(random, colours[int(random.integers(len(colours)))], spread)


def vary_slightly(random: Generator, colour: ArrayLike, spread: float = 0.03) -> Array:
    """Vary mainly the brightness of a colour."""
    gains = (1 + spread * random.uniform(-1, 1)) * (1 + 0.4 * spread * random.uniform(-1, 1, 3))
    return np.asarray(np.clip(np.asarray(colour, np.float64) * gains, 0, 255))


def _hue(colour: ArrayLike) -> float:
    blue, green, red = (np.asarray(colour, np.float64) / 255).tolist()
    return rgb_to_hsv(red, green, blue)[0]
