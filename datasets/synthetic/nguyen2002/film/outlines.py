"""Outlines of targets by shape: what of its box a target covers."""

import numpy as np

from trackmark.datasets.synthetic.nguyen2002.film.sheet import DARK, PaintedSheet, joined

BODY = 0.87
"""Height of a van without its wheels [its height]."""


def _cover_ellipse(sheet: PaintedSheet, w: float, h: float, cut: float) -> None:
    sheet.cover_round(w / 2, h / 2, w / 2, h / 2)
    across, down = sheet.places()
    u, v = 2 * across - 1, 2 * down - 1
    sheet.light(1.06 - 0.34 * np.clip(u * u + v * v, 0, 1))


def _cover_box(sheet: PaintedSheet, w: float, h: float, cut: float) -> None:
    sheet.cover((cut, 0), (w - cut, 0), (w, cut), (w, h - cut), (w - cut, h), (cut, h),
                (0, h - cut), (0, cut))  # fmt: skip


def _cover_van(sheet: PaintedSheet, w: float, h: float, cut: float) -> None:
    """Cover a body on wheels, seen from behind, and paint the wheels."""
    body = BODY * h
    sheet.cover((cut, 0), (w - cut, 0), (w, cut), (w, body), (0, body), (0, cut))
    sheet.painting.patch(0, body, w, h - body, DARK * 0.7)
    for x in (0.04 * w, 0.76 * w):
        sheet.cover_box(x, body, 0.2 * w, h - body)
    sheet.cover_box(0.24 * w, body, 0.52 * w, 0.3 * (h - body))


def _cover_boat(sheet: PaintedSheet, w: float, h: float, cut: float) -> None:
    """Cover a hull with a narrower cabin on it."""
    across = (0.14, 0.86, 0.92, 1.0, 0.98, 0.88, 0.12, 0.02, 0.0, 0.08)
    down = (0.0, 0.0, 0.38, 0.38, 0.6, 1.0, 1.0, 0.6, 0.38, 0.38)
    sheet.cover(*joined(np.array(across) * w, np.array(down) * h))


OUTLINES = {
    "round": _cover_ellipse, "box": _cover_box, "van": _cover_van, "boat": _cover_boat,
}  # fmt: skip
"""By shape: cover a sheet of a width and height [UNIT] with corners cut off by `cut` [UNIT]."""
