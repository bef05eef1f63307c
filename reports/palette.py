"""Colours and line styles by order of the trackers; distinct for colour-blind readers too."""

from collections.abc import Sequence

__all__ = ["COLOURS", "LINE_STYLES", "TRUTH_COLOUR", "colour", "colours", "rgb", "to_bgr"]

# Okabe and Ito's palette without yellow, which is too light on white paper.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
LINE_STYLES = ("-", "--", "-.", ":")
TRUTH_COLOUR = "#FFFFFF"


def colour(position: int) -> str:
    """Colour of the tracker in a position of the table, as `#rrggbb`."""
    return COLOURS[position % len(COLOURS)]


def colours(labels: Sequence[str]) -> dict[str, str]:
    """Colour by label, in order."""
    return {label: colour(position) for position, label in enumerate(labels)}


def rgb(hexadecimal: str) -> tuple[int, int, int]:
    """Red, green, blue in 0..255 of `#rrggbb`."""
    red, green, blue = bytes.fromhex(hexadecimal.lstrip("#"))
    return red, green, blue


def to_bgr(hexadecimal: str) -> tuple[int, int, int]:
    """Blue, green, red in 0..255 of `#rrggbb`, as images have it."""
    red, green, blue = rgb(hexadecimal)
    return blue, green, red
