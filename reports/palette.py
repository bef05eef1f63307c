"""Colours, line styles and markers of trackers, also for colour-blind readers."""

from collections.abc import Sequence

COLOURS = ("#2B59FF", "#EA6301", "#469A6A", "#B975B3", "#AD5129", "#7D5DD8", "#7F6574")
"""Colours of medium lightness: visible on paper, on dark background and on frames."""

LINE_STYLES = ("-", "--", "-.", ":")
MARKERS = "os^Dv"
TRUTH_COLOUR = "#FFFFFF"


def colour(position: int) -> str:
    """Return the colour of the tracker with an index, as `#rrggbb`."""
    return COLOURS[position % len(COLOURS)]


def colours(labels: Sequence[str]) -> dict[str, str]:
    """Return colours by label, in the order of the labels."""
    return {label: colour(position) for position, label in enumerate(labels)}


def rgb(hexadecimal: str) -> tuple[int, int, int]:
    """Return red, green and blue, from 0 to 255, of `#rrggbb`."""
    red, green, blue = bytes.fromhex(hexadecimal.lstrip("#"))
    return red, green, blue


def to_bgr(hexadecimal: str) -> tuple[int, int, int]:
    """Return blue, green and red, from 0 to 255, of `#rrggbb`, in the order of images."""
    red, green, blue = rgb(hexadecimal)
    return blue, green, red
