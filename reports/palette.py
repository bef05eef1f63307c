"""Colours, line styles and markers by order of the trackers; also for colour-blind readers."""

from collections.abc import Sequence

COLOURS = ("#2B59FF", "#EA6301", "#469A6A", "#B975B3", "#AD5129", "#7D5DD8", "#7F6574")
"""Neither light nor dark: a tracker has one colour on paper, on dark ground and on frames."""

LINE_STYLES = ("-", "--", "-.", ":")
MARKERS = "os^Dv"
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
