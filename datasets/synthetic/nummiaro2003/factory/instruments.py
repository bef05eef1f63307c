"""What the front of a machine holds: gauges, buttons, lamps, screens, signs."""

import numpy as np

from datasets.synthetic.nummiaro2003.factory.paints import ACCENTS, DARK, PAINTS, STEEL
from datasets.synthetic.render.painting import Painting, any_of

__all__ = ["control_panel", "row_of_instruments", "stripes", "warning"]


def row_of_instruments(
    painting: Painting, random: np.random.Generator, x: float, y: float, width: float, height: float
) -> None:
    """Gauges, buttons, signs, displays or switches, as many as there is room for [metres]."""
    kind = random.integers(5)
    if random.random() < 0.5:
        painting.hole(x, y, width, height, any_of(random, PAINTS) * 0.8)
    size = height * random.uniform(0.75, 0.95)
    place = x + 0.01
    while place + size < x + width:
        middle = place + size / 2, y + height / 2
        if kind == 0:
            _gauge(painting, random, *middle, size / 2)
        elif kind == 1:
            small = max(0.4 * size / 2, 0.011)
            for row in (-0.25, 0.25):
                painting.knob(middle[0], middle[1] + row * size, small, any_of(random, ACCENTS))
        elif kind == 2:
            painting.plate(
                place, y + 0.15 * height, 0.8 * size, 0.7 * height, any_of(random, ACCENTS), 0.006
            )
            painting.label(random, place, y, 0.8 * size, 0.016)
        elif kind == 3:
            painting.plate(place, y + 0.1 * height, 0.85 * size, 0.8 * height, DARK, 0.006)
            lit = any_of(random, ((60, 190, 80), (60, 60, 220), (40, 170, 230), (190, 160, 60)))
            painting.label(
                random, place + 0.1 * size, y + 0.22 * height, 0.65 * size, 0.5 * height, DARK, lit
            )
        else:
            painting.knob(*middle, size / 2.6, DARK)
            painting.line([middle, (middle[0], middle[1] - size / 3)], 0.006, (220, 222, 224))
        place += size * random.uniform(1.0, 1.25)


def _gauge(
    painting: Painting, random: np.random.Generator, x: float, y: float, radius: float
) -> None:
    painting.knob(x, y, radius, STEEL)
    painting.disc(x, y, 0.8 * radius, (216, 222, 224))
    for angle in np.linspace(-2.4, 2.4, 9):
        ray = np.sin(angle), -np.cos(angle)
        colour = (40, 36, 190) if angle > 1.4 else DARK
        ends = [(x + k * radius * ray[0], y + k * radius * ray[1]) for k in (0.58, 0.74)]
        painting.line(ends, 0.12 * radius, colour)
    angle = random.uniform(-2.2, 1.8)
    painting.line(
        [(x, y), (x + 0.6 * radius * np.sin(angle), y - 0.6 * radius * np.cos(angle))],
        0.1 * radius,
        DARK,
    )


def warning(
    painting: Painting, random: np.random.Generator, x: float, y: float, size: float
) -> None:
    """Sign with a warning, or with writing."""
    if random.random() < 0.6:
        painting.area([(x, y + size), (x + size / 2, y), (x + size, y + size)], (30, 30, 32))
        inner = [
            (x + 0.12 * size, y + 0.93 * size),
            (x + size / 2, y + 0.16 * size),
            (x + 0.88 * size, y + 0.93 * size),
        ]
        painting.area(inner, (40, 196, 226))
        painting.line(
            [(x + size / 2, y + 0.45 * size), (x + size / 2, y + 0.72 * size)],
            0.1 * size,
            (30, 30, 32),
        )
    else:
        painting.label(random, x, y, size, size, any_of(random, ACCENTS[:6]))


def control_panel(
    painting: Painting, random: np.random.Generator, width: float, height: float
) -> None:
    """Screen, keys and the button that stops it all."""
    painting.plate(0, 0, width, height, any_of(random, PAINTS), 0.02)
    painting.plate(0.03, 0.03, width - 0.06, 0.2, DARK, 0.006)
    back = any_of(random, ((120, 60, 20), (40, 70, 30), (170, 150, 120), (90, 40, 70)))
    painting.label(
        random,
        0.045,
        0.045,
        width - 0.09,
        0.17,
        back,
        any_of(random, ((80, 220, 120), (230, 230, 230), (60, 200, 230))),
    )
    for row in range(4):
        for x in np.arange(0.035, width - 0.045, 0.042):
            painting.plate(
                x,
                0.26 + 0.042 * row,
                0.032,
                0.032,
                any_of(random, (*ACCENTS, STEEL, STEEL, (200, 202, 204))),
                0.005,
            )
    painting.disc(0.10, height - 0.09, 0.06, (40, 190, 220))
    painting.knob(0.10, height - 0.09, 0.042, (36, 32, 196))
    painting.knob(width - 0.08, height - 0.09, 0.035, any_of(random, ACCENTS))


def stripes(painting: Painting, x: float, y: float, width: float, height: float) -> None:
    """Band of yellow and black."""
    painting.patch(x, y, width, height, (40, 186, 220))
    for left in np.arange(x, x + width - height, 2 * height):
        painting.area(
            [
                (left, y + height),
                (left + height, y),
                (left + 2 * height, y),
                (left + height, y + height),
            ],
            (36, 36, 38),
        )
