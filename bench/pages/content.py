"""Content of a page: sections of cards, and the sequences and runs of its player."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from typing import Any, NamedTuple, TypeAlias
from urllib.parse import urlencode

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from trackmark.bench.evaluation.run_record import Trajectory
from trackmark.reports.charts import PlayerPosition
from trackmark.reports.tables import Table

FrameChunks: TypeAlias = Sequence[Sequence[bytes]]
"""Encoded frames in chunks; see `bench.pages.player_frames.encode_images`."""

Shapes: TypeAlias = Mapping[int, Mapping[str, Any]]
"""Outlines and particles by frame and kind."""

TrackerValues: TypeAlias = Mapping[str, Sequence[float | str | None]]
"""Values of a tracker, numbers or texts, by name and frame."""


@dataclass(frozen=True)
class PageTable:
    """Table whose cells after the labels open positions in the player; without any, no links."""

    table: Table
    positions: Sequence[Sequence[PlayerPosition | None]] = ()

    def link(self, row: int, column: int) -> str:
        """Return the address that a cell opens; empty for a cell without a position."""
        column -= self.table.n_labels
        if column < 0 or not self.positions:
            return ""
        position = self.positions[row][column]
        return position.link if position else ""


@dataclass(frozen=True)
class PageSection:
    """Section of a page: a title, which `nav` abbreviates in the navigation, and cards.

    The width `span` is in twelfths of the page.
    """

    key: str
    title: str
    cards: Sequence[Markup] = ()
    lists_sequences: bool = False  # True to list the sequences of the player after the cards
    caption: str = ""
    span: int = 12
    nav: str = ""


class ThresholdShares(NamedTuple):
    """Share of frames by threshold, and the frame nearest to each threshold; fields are (k,)."""

    shares: NDArray[np.float64]
    distances: NDArray[np.float64]  # difference between the value of this frame and the threshold
    frames: NDArray[np.int64]


@dataclass(frozen=True, eq=False, kw_only=True)
class PlayerRun:
    """Run or segment of a run with its scores by frame."""

    tracker: int  # index into the list of the page
    repetition: int
    boxes: NDArray[np.float64]  # (n, 4), a row per frame; NaN if missing
    revised: NDArray[np.float64] | None  # revised boxes, (n, 4)
    failure: str  # reason of a failed run
    is_ellipse: bool  # True if the target is the ellipse in the box
    shapes: Shapes
    maps: Mapping[str, FrameChunks]  # frames without a map are empty
    overlaps: NDArray[np.float32]  # (n,); NaN if the frame is not scored
    shares: Mapping[str, ThresholdShares]  # `success` and `precision` of finished one-pass runs
    worst: Mapping[tuple[str, Trajectory], tuple[float, int]]  # see `player_runs.find_worst_frames`
    tracker_values: TrackerValues = field(default_factory=dict)
    start: int = 0  # index of the segment
    start_label: str = ""  # description of the start of a segment; empty for a whole run
    scored: Sequence[tuple[int, int]] = ()  # first and last frame of intervals; empty for all
    restarts: Sequence[int] = ()  # frames in which the tracker was restarted

    @property
    def severity(self) -> float:
        """Negative mean overlap of the online boxes; infinite for failed runs."""
        return self.worst["overlap", "online"][0]

    @property
    def worst_frame(self) -> int:
        """Frame in which the target was lost, or else that of the lowest overlap."""
        return self.worst["overlap", "online"][1]

    def position(self, sequence: int, frame: int) -> PlayerPosition:
        """Return the position of a frame of this run on the sequence with an index."""
        return PlayerPosition(sequence, self.tracker, self.repetition, frame, self.start)


@dataclass(frozen=True, eq=False)
class PlayerSequence:
    """Sequence in the player with the runs on it."""

    name: str
    size: tuple[int, int]  # width and height of a frame [px]
    boxes: NDArray[np.float64]  # (n, 4): ground truth by which runs are scored, a row per frame
    one_pass: list[PlayerRun] = field(default_factory=list)
    other_runs: list[PlayerRun] = field(default_factory=list)  # by other protocols
    row: Mapping[str, Any] = field(default_factory=dict)  # row of any run, which names the source
    thumbnails: FrameChunks = ()
    full: Sequence[int] = ()  # numbers of full-size frames by chunk; see `write_chunk`
    reason: str = ""  # reason why there are no frames
    frame_numbers: Sequence[int] | None = None  # numbers of the existing frames; None for all
    fps: float | None = None
    first: int = 0  # first frame with ground truth
    shapes: Shapes = field(default_factory=dict)  # of the ground truth

    @property
    def n_frames(self) -> int:
        """Number of frames."""
        return len(self.boxes)

    @property
    def runs(self) -> list[PlayerRun]:
        """All runs, one-pass runs first."""
        return [*self.one_pass, *self.other_runs]

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
    sequences: Sequence[PlayerSequence] = ()
    start: str = ""  # address that the page opens by default, such as `#frame=3`
    meta: str = ""  # line above the heading: size and date of the runs
    heading: str = ""  # heading; the title by default
    sums: Sequence[str] = ()  # lines below the heading
    details: Sequence[str] = ()  # sentences below these lines
    styles: Sequence[str] = ()  # style sheets of `templates` in addition to `page.css`


def player_link(sequence: PlayerSequence, frame: int | None = None, **options: str) -> str:
    """Return the address of a sequence, by default at its first frame with ground truth."""
    query = {"sequence": sequence.name, "frame": sequence.first if frame is None else frame}
    return f"#{urlencode(query | options, errors='replace')}"
