"""Machines and switchboards along the wall of a factory.

Each paints itself on a piece of wall of a given width and height, from what is drawn at random.
"""

import numpy as np

from datasets.synthetic.nummiaro2003.factory.instruments import (
    control_panel,
    row_of_instruments,
    stripes,
    warning,
)
from datasets.synthetic.nummiaro2003.factory.paints import ACCENTS, DARK, PAINTS, STEEL
from datasets.synthetic.render.painting import Painting, any_of, varied

__all__ = ["cabinet", "machine_tool", "wiring"]


def cabinet(painting: Painting, random: np.random.Generator, width: float, height: float) -> None:
    """Control cabinet: instruments in rows on its doors."""
    paint = any_of(random, PAINTS)
    painting.plate(0, 0, width, height, paint, 0.03)
    doors = 2 if width > 0.75 else 1
    for door in range(doors):
        wide = width / doors
        inner = painting.part(door * wide, 0)
        inner.plate(
            0.015, 0.02, wide - 0.03, height - 0.04, paint * random.uniform(0.92, 1.06), 0.008
        )
        y = 0.07
        while y < height - 0.35:
            deep = random.uniform(0.07, 0.15)
            row_of_instruments(inner, random, 0.05, y, wide - 0.10, deep)
            y += deep + random.uniform(0.015, 0.05)
        for slot in range(7):
            inner.patch(0.08, height - 0.28 + 0.025 * slot, wide - 0.16, 0.009, paint * 0.35)
        inner.plate(wide - 0.06, height - 0.5, 0.02, 0.13, np.array(DARK) * 1.4, 0.008)
        warning(inner, random, 0.05, height - 0.44, 0.09)


def machine_tool(
    painting: Painting, random: np.random.Generator, width: float, height: float
) -> None:
    """Machine tool: a window with the tool behind it, a panel with a screen, hand wheels."""
    paint, other = any_of(random, PAINTS), any_of(random, PAINTS)
    painting.plate(0, 0.05, width, height - 0.05, paint, 0.03)
    painting.plate(0, 0, width, 0.22, other, 0.02)
    painting.label(
        random, 0.06, 0.06, 0.3 * width, 0.09, any_of(random, ACCENTS), any_of(random, ACCENTS)
    )
    wide = 0.60 * width
    top, deep = 0.30, 0.55
    painting.plate(0.04, top - 0.03, wide, deep + 0.06, paint * 0.75, 0.01)
    painting.hole(0.07, top, wide - 0.06, deep, (66, 62, 58))
    middle = 0.07 + 0.5 * (wide - 0.06)
    painting.pipe((0.09, top + 0.30), (middle - 0.05, top + 0.30), 0.07, STEEL)
    painting.knob(middle - 0.02, top + 0.30, 0.09, (128, 128, 124))
    for angle in np.arange(3) * 2.1 + random.uniform(0, 2):
        jaw = middle - 0.02 + 0.05 * np.cos(angle), top + 0.30 + 0.05 * np.sin(angle)
        painting.knob(*jaw, 0.018, (90, 92, 92))
    painting.plate(middle + 0.10, top + 0.2, 0.11, 0.2, any_of(random, PAINTS) * 0.8, 0.01)
    for _ in range(5):
        start = random.uniform(0.1, wide - 0.1), top + 0.02
        painting.wire(
            start,
            (middle + random.uniform(-0.1, 0.15), top + 0.25),
            0.05,
            0.014,
            any_of(random, ACCENTS),
        )
    for _ in range(40):  # chips
        spot = 0.08 + random.uniform(0, wide - 0.09), top + deep - random.uniform(0, 0.07)
        painting.line(
            [spot, (spot[0] + 0.015, spot[1] + random.uniform(-0.01, 0.01))],
            0.006,
            any_of(random, ((120, 160, 190), STEEL)),
        )
    painting.darken(0.07, top, 0.35 * wide, deep, 1.25)  # its pane mirrors something bright
    control_panel(painting.part(wide + 0.06, 0.28), random, width - wide - 0.09, 0.62)
    stripes(painting, 0, 0.97, width, 0.06)
    y = 1.06
    while y < height - 0.12:
        for x in np.arange(0.08, width - 0.1, random.uniform(0.16, 0.3)):
            choice = random.random()
            if choice < 0.3:
                painting.knob(x + 0.05, y + 0.07, 0.05, any_of(random, ACCENTS))
                painting.knob(x + 0.05, y + 0.07, 0.016, STEEL)
            elif choice < 0.6:
                row_of_instruments(painting, random, x, y, 0.14, 0.1)
            else:
                painting.plate(x, y, 0.12, 0.13, varied(random, other), 0.008)
        y += 0.19


def wiring(painting: Painting, random: np.random.Generator, width: float, height: float) -> None:
    """Open switch cabinet: breakers in rows, ducts, and bundles of coloured wires."""
    painting.plate(0, 0, width, height, any_of(random, PAINTS), 0.03)
    painting.hole(
        0.03,
        0.03,
        width - 0.06,
        height - 0.06,
        any_of(random, ((150, 150, 148), (120, 132, 140), (60, 140, 190))),
    )
    rows = np.arange(0.12, height - 0.2, random.uniform(0.2, 0.27))
    for y in rows:
        painting.patch(0.05, y + 0.035, width - 0.10, 0.02, STEEL)
        x = 0.06
        while x < width - 0.10:
            wide = random.uniform(0.02, 0.07)
            paint = any_of(
                random,
                (
                    (206, 208, 208),
                    (206, 208, 208),
                    DARK,
                    (110, 150, 60),
                    (50, 90, 190),
                    (190, 180, 160),
                ),
            )
            painting.plate(x, y, wide, 0.095, paint, 0.008)
            painting.patch(x + 0.2 * wide, y + 0.03, 0.5 * wide, 0.025, any_of(random, ACCENTS))
            for _ in range(2):
                ends = x + random.uniform(0.1, 0.9) * wide, x + random.uniform(-0.15, 0.15)
                painting.wire(
                    (ends[0], y + 0.09),
                    (float(np.clip(ends[1], 0.05, width - 0.05)), y + 0.17),
                    0.01,
                    0.006,
                    any_of(random, ACCENTS),
                )
            x += wide + 0.003
        painting.plate(0.05, y + 0.15, width - 0.10, 0.03, (150, 156, 158), 0.006)
        for x in np.arange(0.055, width - 0.06, 0.014):
            painting.patch(x, y + 0.153, 0.006, 0.024, (80, 84, 86))
    for side in (0.045, width - 0.05):
        for k in range(7):
            painting.line(
                [(side + 0.004 * (k - 3), 0.06), (side + 0.004 * (k - 3), height - 0.08)],
                0.005,
                any_of(random, ACCENTS),
            )
