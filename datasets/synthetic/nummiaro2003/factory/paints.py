"""Colours that things in a factory have. BGR in [0, 255]."""

__all__ = ["ACCENTS", "DARK", "PAINTS", "STEEL", "THINGS"]

PAINTS = (
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
ACCENTS = (
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
THINGS = (
    (92, 134, 170),  # cardboard
    (110, 152, 186),
    (190, 110, 40),  # plastic boxes
    (46, 46, 176),
    (50, 180, 214),
    (84, 140, 52),
    (120, 122, 124),
    (206, 208, 206),
    (52, 50, 50),
    (62, 96, 138),  # wood
)
STEEL = (150, 150, 146)
DARK = (44, 44, 46)
