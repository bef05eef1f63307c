"""Charts of lines, and the positions in the player that their points open."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from numpy.typing import ArrayLike


class PlayerPosition(NamedTuple):
    """Position in the player; `sequence` and `tracker` are indices into the lists of the page."""

    sequence: int
    tracker: int
    repetition: int
    frame: int
    start: int = 0  # index of the segment
    revised: bool = False  # True to select the revised boxes
    show: tuple[int, ...] = ()  # visible trackers; empty for the default

    @property
    def link(self) -> str:
        """Address within the page: its numbers, which `page.js` replaces by names."""
        details = (int(self.start), int(self.revised), *self.show) if any(self[4:]) else ()
        return "#" + ".".join(map(str, (*self[:4], *details)))


@dataclass(frozen=True)
class Line:
    """Line of a chart with k points; NaN makes a gap."""

    label: str
    position: int  # index of its colour
    x: ArrayLike
    y: ArrayLike
    low: ArrayLike = ()
    high: ArrayLike = ()
    positions: Sequence[PlayerPosition | None] = ()  # one per point, or one for all
    value: str = ""  # number after the label; see `Chart.value_name`


@dataclass(frozen=True)
class Chart:
    """Chart of lines; the description is also for screen readers."""

    title: str
    x: str
    y: str
    lines: Sequence[Line]
    description: str
    style: str = "line"  # or `step`, or `dots` for single points
    logarithmic: bool = False  # True if the abscissa is logarithmic: a time [ms]
    top: float | None = None  # upper limit of the ordinate
    figure: str = ""  # name of its file without suffix
    value_name: str = ""  # meaning of the numbers after the labels of lines
    caption: str = ""  # short text above the chart on a page, instead of the description
    is_percent: bool = False  # True if a page prints the ordinate in %
    has_line_names: bool = True  # True if lines have their names next to them on a page
    reference: float | None = None  # abscissa of a dashed vertical line
    reference_label: str = ""
