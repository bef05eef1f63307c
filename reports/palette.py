"""Colours, line styles and markers of trackers, also for colour-blind readers."""

from collections.abc import Sequence

LIGHT = ("#2b59ff", "#d95700", "#2e8257", "#a04c9c", "#0f7c8a", "#b0305c", "#636b75")
DARK = ("#8fa9ff", "#ff9c52", "#72cf9f", "#e3a0de", "#5cc8d6", "#f08aae", "#9aa3ae")
"""Colours of six trackers, then grey for all others: on paper and light pages; on dark pages."""

LINE_STYLES = ("-", "--", "-.", ":")
DASHES: Sequence[Sequence[int]] = ((), (7, 4), (9, 3, 2, 3), (2, 3))
"""Lengths of dashes and gaps of the same styles [px]."""
MARKERS = "os^Dv"
MARKER_PATHS = (
    "M-5,0A5,5 0 1,0 5,0A5,5 0 1,0 -5,0Z",
    "M-4.5,-4.5H4.5V4.5H-4.5Z",
    "M0,-5L5,4H-5Z",
    "M0,-5.5L5.5,0L0,5.5L-5.5,0Z",
    "M0,5L5,-4H-5Z",
)
"""SVG paths of the same markers around the origin."""

TRUTH_COLOUR = "#FFFFFF"


def colour(position: int) -> str:
    """Return the colour of the tracker with an index on paper, as `#rrggbb`."""
    return LIGHT[colour_index(position)]


def colour_index(position: int) -> int:
    """Return the index into `LIGHT` and `DARK` of the tracker with an index."""
    return min(position, len(LIGHT) - 1)


def colours(labels: Sequence[str]) -> dict[str, str]:
    """Return colours by label, in the order of the labels."""
    return {label: colour(position) for position, label in enumerate(labels)}


def to_bgr(hexadecimal: str) -> tuple[int, int, int]:
    """Return blue, green and red, from 0 to 255, of `#rrggbb`, in the order of images."""
    red, green, blue = bytes.fromhex(hexadecimal.lstrip("#"))
    return blue, green, red
