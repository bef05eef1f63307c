"""Colours, line styles and markers by order of the trackers; also for colour-blind readers."""

from collections.abc import Sequence

__all__ = [
    "BRIGHT",
    "COLOURS",
    "LINE_STYLES",
    "MARKERS",
    "TRUTH_COLOUR",
    "bright",
    "brights",
    "colour",
    "colours",
    "rgb",
    "to_bgr",
]

COLOURS = ("#005F9E", "#D55E00", "#008A63", "#C0649A", "#7A5200", "#3B8BEA", "#000000")
"""On white paper: the hues of `BRIGHT`, each dark enough to be seen there as a thin line."""

# Okabe and Ito's palette without yellow, which is too close to the dashes of the truth.
BRIGHT = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""On frames and on dark ground; black is rimmed there, or stands for what text is written in."""

LINE_STYLES = ("-", "--", "-.", ":")
MARKERS = "os^Dv"
TRUTH_COLOUR = "#FFFFFF"


def colour(position: int) -> str:
    """Colour on paper of the tracker in a position of the table, as `#rrggbb`."""
    return COLOURS[position % len(COLOURS)]


def bright(position: int) -> str:
    """Its colour on frames."""
    return BRIGHT[position % len(BRIGHT)]


def colours(labels: Sequence[str]) -> dict[str, str]:
    """Colour on paper by label, in order."""
    return {label: colour(position) for position, label in enumerate(labels)}


def brights(labels: Sequence[str]) -> dict[str, str]:
    """Colour on frames by label, in order."""
    return {label: bright(position) for position, label in enumerate(labels)}


def rgb(hexadecimal: str) -> tuple[int, int, int]:
    """Red, green, blue in 0..255 of `#rrggbb`."""
    red, green, blue = bytes.fromhex(hexadecimal.lstrip("#"))
    return red, green, blue


def to_bgr(hexadecimal: str) -> tuple[int, int, int]:
    """Blue, green, red in 0..255 of `#rrggbb`, as images have it."""
    red, green, blue = rgb(hexadecimal)
    return blue, green, red
