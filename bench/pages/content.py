"""Content of a page: sections of tables and charts, and the sequences of its player."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from typing import Any, TypeAlias
from urllib.parse import urlencode

import numpy as np
from numpy.typing import NDArray

from trackmark.reports.charts import PlayerPosition
from trackmark.reports.tables import Table

Film: TypeAlias = Sequence[Sequence[bytes]]
"""Encoded frames in chunks; see `bench.pages.player_frames.encode_film`."""

Shapes: TypeAlias = Mapping[int, Mapping[str, Any]]
"""Outlines and particles by frame and kind."""

Numbers: TypeAlias = Mapping[str, Sequence[float | str | None]]
"""Values of a tracker, numbers or texts, by name and frame."""


@dataclass(frozen=True)
class PageTable:
    """Table with links from its cells to the player or to other pages."""

    table: Table
    places: Sequence[Sequence[PlayerPosition | None]] = ()  # links of the columns after the labels

    def place(self, row: int, column: int) -> PlayerPosition | None:
        """Return the position that a cell opens, if any."""
        column -= self.table.n_labels
        if column < 0 or not self.places:
            return None
        return self.places[row][column]


@dataclass(frozen=True)
class PageSection:
    """Section of a page.

    `blocks`: cards (see `bench.pages.card_types`), charts and tables. `scenes`: True to list the
    sequences. `span`: width in twelfths of the page. `nav`: name in the navigation.
    """

    key: str
    title: str
    scenes: bool = False
    blocks: Sequence[object] = ()
    caption: str = ""
    span: int = 12
    nav: str = ""


@dataclass(frozen=True, eq=False)
class PlayerRun:
    """Run or segment of a run in the player."""

    tracker: int  # index into the list of the page
    repetition: int
    boxes: NDArray[np.float64]  # (n, 4), a row per frame; NaN if missing
    revised: NDArray[np.float64] | None = None  # revised boxes, (n, 4)
    failure: str = ""
    round: bool = False  # True if the target is the ellipse in the box
    shapes: Shapes = field(default_factory=dict)
    maps: Mapping[str, Film] = field(default_factory=dict)  # frames without a map are empty
    numbers: Numbers = field(default_factory=dict)
    start: int = 0  # index of the segment
    start_label: str = ""  # description of the start of a segment; empty for a whole run
    judged: Sequence[tuple[int, int]] = ()  # first and last frame of intervals; empty for all
    marks: Sequence[int] = ()  # frames in which the tracker was restarted


@dataclass(frozen=True, eq=False)
class PlayerScene:
    """Sequence in the player."""

    name: str
    size: tuple[int, int]  # width and height of a frame [px]
    boxes: NDArray[np.float64]  # (n, 4): ground truth, a row per frame
    takes: Sequence[PlayerRun]
    thumbnails: Film = ()
    full: Sequence[Sequence[int]] = ()  # sizes of full-size frames, see `write_chunk` [bytes]
    why: str = ""  # reason why there are no frames
    frame_numbers: Sequence[int] | None = None  # numbers of the existing frames; None for all
    fps: float | None = None
    first: int = 0  # first frame with ground truth
    shapes: Shapes = field(default_factory=dict)  # of the ground truth

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.boxes)

    @property
    def images(self) -> list[bytes]:
        """Encoded thumbnails of all frames, or of those in `frame_numbers`."""
        return [*chain(*self.thumbnails)]


@dataclass(frozen=True)
class Page:
    """Content of a page."""

    title: str
    sections: Sequence[PageSection]
    trackers: Sequence[str] = ()
    scenes: Sequence[PlayerScene] = ()
    start: str = ""  # address that the page opens by default, such as `#frame=3`
    meta: str = ""  # line above the heading: size and date of the runs
    answer: str = ""  # heading; the title by default
    details: Sequence[str] = ()  # sentences below the heading

    def opening(self, scene: PlayerScene, frame: int | None = None, **options: str) -> str:
        """Return the address of a sequence, by default at its first frame with ground truth."""
        query = {"sequence": scene.name, "frame": scene.first if frame is None else frame}
        return f"#{urlencode(query | options, errors='replace')}"
