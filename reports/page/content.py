"""What a page shows: sections of tables and charts, and scenes that its player opens."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TypeAlias
from urllib.parse import urlencode

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trackmark.reports.tables import Table

Film: TypeAlias = Sequence[Sequence[bytes]]
"""Encoded frames in chunks; see `reports.page.film.film`."""

Shapes: TypeAlias = Mapping[int, Mapping[str, Any]]
"""Outlines and particles by frame and kind."""

Numbers: TypeAlias = Mapping[str, Sequence[float | str | None]]
"""Numbers of a tracker by name and frame."""


class PlayerPosition(NamedTuple):
    """Where the player opens: positions of sequence and tracker in the page's lists."""

    sequence: int
    tracker: int
    repetition: int
    frame: int
    start: int = 0  # which segment of a run that has several
    revised: bool = False  # whether its revised boxes are meant
    show: tuple[int, ...] = ()  # trackers that are shown; empty for the first ones


@dataclass(frozen=True)
class PageTable:
    """A table, with what its numbers open."""

    table: Table
    values: Sequence[Sequence[float]] = ()  # of the columns beside the labels, to sort by
    places: Sequence[Sequence[PlayerPosition | None]] = ()  # likewise; where they lead
    links: Sequence[str] = ()  # addresses that the first cells of rows lead to; empty for none
    heat: bool = False  # whether cells are shaded by their value, in [0, 1]

    def value(self, row: int, column: int) -> float | None:
        """What a cell is sorted by; None where its text says it."""
        column -= self.table.n_labels
        if column < 0 or not len(self.values):
            return None
        return self.values[row][column]

    def place(self, row: int, column: int) -> PlayerPosition | None:
        """Where a cell leads."""
        column -= self.table.n_labels
        if column < 0 or not self.places:
            return None
        return self.places[row][column]


@dataclass(frozen=True)
class Line:
    """A line of a chart: shapes (k,), NaN where it has a gap."""

    label: str
    position: int  # of its colour
    x: ArrayLike
    y: ArrayLike
    low: ArrayLike = ()
    high: ArrayLike = ()
    places: Sequence[PlayerPosition | None] = ()  # one a point, or one for all
    told: str = ""  # behind its label: what the chart's `told` says


@dataclass(frozen=True)
class Chart:
    """Lines over a quantity; `words` say what is seen, also to those who don't see it."""

    title: str
    x: str
    y: str
    lines: Sequence[Line]
    words: str
    kind: str = "line"  # or `step`, or `dots`, which stand alone
    logarithmic: bool = False
    top: float | None = None  # the ordinate ends there
    figure: str = ""  # of its file, without suffix, where it is written as one
    told: str = ""  # what number stands behind the labels of lines


@dataclass(frozen=True)
class Picture:
    """A figure, PNG or WebP; `words` say what is seen where the caption does not."""

    content: bytes
    caption: str
    words: str = ""


@dataclass(frozen=True)
class Card:
    """A foldable description of one thing, opened by `#key`: a quote, facts by name, tables."""

    key: str
    title: str
    quote: str = ""
    facts: Mapping[str, str] = field(default_factory=dict)
    sheets: Sequence[PageTable] = ()


@dataclass(frozen=True)
class PageSection:
    """A part of a page. `command` makes again what it shows; `scenes`: whether these are listed.

    `folded`: line that stands for the contents until it is clicked; empty if they are visible.
    """

    key: str
    title: str
    words: Sequence[str] = ()
    sheets: Sequence[PageTable] = ()
    charts: Sequence[Chart] = ()
    pictures: Sequence[Picture] = ()
    cards: Sequence[Card] = ()
    command: str = ""
    scenes: bool = False
    folded: str = ""


@dataclass(frozen=True, eq=False)
class PlayerRun:
    """A run as the player shows it, or one segment of a run that has several."""

    tracker: int  # position in the page's list
    repetition: int
    boxes: NDArray[np.float64]  # (n, 4), a row per frame; NaN if there is none
    revised: NDArray[np.float64] | None = None  # likewise
    failure: str = ""
    round: bool = False  # whether the target is the ellipse in the box
    shapes: Shapes = field(default_factory=dict)
    maps: Mapping[str, Film] = field(default_factory=dict)  # frames without a map are empty
    numbers: Numbers = field(default_factory=dict)
    start: int = 0  # number of the segment
    begun: str = ""  # how the segment begins; empty for a run over all frames
    judged: Sequence[tuple[int, int]] = ()  # first and last frame of stretches; empty for all
    marks: Sequence[int] = ()  # frames in which the tracker was restarted


@dataclass(frozen=True, eq=False)
class PlayerScene:
    """A sequence as the player shows it."""

    name: str
    size: tuple[int, int]  # width and height of a frame [px]
    boxes: NDArray[np.float64]  # (n, 4): ground truth, a row per frame
    takes: Sequence[PlayerRun]
    thumbnails: Film = ()
    full: Sequence[Sequence[int]] = ()  # sizes of the larger frames that `write_chunk` wrote
    why: str = ""  # why there are no frames
    kept: Sequence[int] | None = None  # numbers of the frames that there are; None for all
    fps: float | None = None
    first: int = 0  # first frame with ground truth
    shapes: Shapes = field(default_factory=dict)  # of the ground truth
    show: str = ""  # command that draws a frame, to which its number is added

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.boxes)


@dataclass(frozen=True)
class Page:
    """All that a page shows."""

    title: str
    sections: Sequence[PageSection]
    trackers: Sequence[str] = ()
    scenes: Sequence[PlayerScene] = ()
    start: str = ""  # the address that it opens at, where it is opened without one

    def first_with(self, command: str) -> PageSection | None:
        """The section that says a command first; others that it makes again lead to it."""
        return next((one for one in self.sections if command and one.command == command), None)

    def address(self, place: PlayerPosition) -> str:
        """Where the player opens a place, as part of a link."""
        asked = {
            "sequence": self.scenes[place.sequence].name,
            "tracker": self.trackers[place.tracker],
            "repetition": place.repetition,
            "frame": place.frame,
        }
        asked |= {"start": place.start} if place.start else {}
        asked |= {"trace": "revised"} if place.revised else {}
        asked |= {"show": ".".join(map(str, place.show))} if place.show else {}
        return "#" + urlencode(asked, errors="replace")

    def opening(self, scene: PlayerScene, frame: int | None = None, **chosen: str) -> str:
        """Where the player opens a scene: on its first frame with truth by default.

        `chosen`: what else is in the address.
        """
        asked = {"sequence": scene.name, "frame": scene.first if frame is None else frame, **chosen}
        return "#" + urlencode(asked, errors="replace")
