"""What people wear: natural colours of clothes, drawn at random."""

import numpy as np

from datasets.synthetic.render.colours import BGR, varied

__all__ = [
    "bag",
    "clothes",
    "other_clothes",
    "plain_clothes",
    "shirt_below",
    "two_coloured_clothes",
]

SHIRTS = (
    (212, 216, 220),  # white
    (150, 152, 154),  # grey
    (62, 60, 60),  # charcoal
    (86, 58, 44),  # navy
    (150, 104, 66),  # blue
    (196, 168, 132),  # light blue
    (52, 48, 158),  # red
    (54, 40, 96),  # burgundy
    (64, 104, 88),  # olive
    (70, 84, 50),  # bottle green
    (70, 152, 196),  # mustard
    (142, 172, 194),  # beige
    (66, 88, 118),  # brown
    (168, 152, 206),  # pink
    (108, 80, 100),  # plum
    (118, 106, 62),  # petrol
)
TROUSERS = (
    (120, 88, 62),  # jeans
    (82, 58, 44),  # dark jeans
    (46, 44, 44),  # black
    (112, 112, 114),  # grey
    (128, 158, 180),  # chinos
    (58, 78, 102),  # brown
    (66, 88, 84),  # olive
    (182, 190, 196),  # off-white
)
BOTH = (
    (50, 48, 48),  # black
    (76, 70, 66),  # charcoal
    (124, 124, 126),  # grey
    (86, 60, 46),  # navy
    (124, 92, 64),  # denim
    (66, 96, 88),  # olive
    (116, 150, 172),  # khaki
    (62, 82, 110),  # brown
    (58, 44, 98),  # burgundy
)
"""Colours that people wear from top to bottom (suits, overalls, tracksuits), and of bags."""

TONE = np.array([0.114, 0.587, 0.299])
"""Weights of blue, green and red in the tone (Rec. 601)."""

CLEAR_TONE = 55.0
"""Tones that differ by this much differ clearly [grey levels]."""

CLEAR_COLOUR = 28.0
"""Colours that differ by this much beside the tone differ clearly [grey levels]."""


def clothes(random: np.random.Generator) -> tuple[BGR, BGR]:
    """Shirt and trousers, each at random."""
    return _dyed(random, _one(random, SHIRTS)), _dyed(random, _one(random, TROUSERS))


def two_coloured_clothes(random: np.random.Generator) -> tuple[BGR, BGR]:
    """Shirt and trousers at random that differ clearly, in colour and in tone."""
    pairs = [
        (shirt, trousers) for shirt in SHIRTS for trousers in TROUSERS if _clear(shirt, trousers)
    ]
    shirt, trousers = pairs[random.integers(len(pairs))]
    return _dyed(random, shirt, spread=0.04), _dyed(random, trousers, spread=0.04)


def plain_clothes(random: np.random.Generator) -> tuple[BGR, BGR]:
    """Shirt and trousers of nearly the same colour and tone."""
    cloth = _dyed(random, _one(random, BOTH))
    return cloth, _dyed(random, cloth, spread=0.03)


def shirt_below(random: np.random.Generator, jacket: BGR) -> BGR:
    """Shirt of clearly another tone than the open jacket over it."""
    others = tuple(
        shirt for shirt in SHIRTS if abs(np.subtract(shirt, jacket) @ TONE) >= CLEAR_TONE
    )
    return _dyed(random, _one(random, others), spread=0.04)


def bag(random: np.random.Generator) -> BGR:
    """Bag in a colour that hides the dirt."""
    return _dyed(random, _one(random, BOTH))


def other_clothes(random: np.random.Generator, first: tuple[BGR, BGR]) -> tuple[BGR, BGR]:
    """Shirt and trousers of clearly other colours than another person's shirt and trousers."""

    def unlike(colour: BGR) -> float:
        return -min(float(np.abs(np.subtract(colour, worn)).max()) for worn in first)

    shirt, trousers = (
        _one(random, tuple(sorted(colours, key=unlike)[: len(colours) // 4]))
        for colours in (SHIRTS, TROUSERS)
    )
    return _dyed(random, shirt), _dyed(random, trousers)


def _clear(shirt: BGR, trousers: BGR) -> bool:
    difference = np.subtract(shirt, trousers, dtype=np.float64)
    tone = float(difference @ TONE)
    colour = np.abs(difference - tone).max()
    return bool(abs(tone) >= CLEAR_TONE and colour >= CLEAR_COLOUR)


def _one(random: np.random.Generator, colours: tuple[BGR, ...]) -> BGR:
    return colours[random.integers(len(colours))]


def _dyed(random: np.random.Generator, colour: BGR, spread: float = 0.08) -> BGR:
    blue, green, red = np.round(varied(random, colour, spread)).astype(int).tolist()
    return blue, green, red
