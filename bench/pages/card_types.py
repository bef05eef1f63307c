"""Cards of pages: plain data that the macros of the same names in `cards.html` draw.

A list of cards is drawn by the macro of the plural name, such as `Loops`.

The tone of a verdict, `good`, `bad`, `undecided` or `none`, gives its colour.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from trackmark.bench.pages.content import PageTable
from trackmark.reports.charts import Chart, PlayerPosition

GLOSSARY: Mapping[str, str] = {
    "overlap": "Overlap (IoU): area shared by the estimated and the true box, divided by the area "
    "that both cover. 1 is perfect, 0 is a miss.",
    "success": "Share of frames with an overlap of at least 0.5.",
    "centre error": "Distance between the centres of the estimated and the true box.",
    "ms/frame": "Mean time of an update, without the time in which other processes had the "
    "processor. The first update is not included.",
    "95 % interval": "Range that contains the mean over new sequences in 95 % of cases. It is "
    "drawn from six sequences on.",
    "lost": "The estimated centre is outside the true box for ten visible frames in a row.",
    "true box": "Box of the target in the ground truth: annotated, or known from rendering.",
    "seed": "Number that initialises the random generator of a stochastic tracker.",
}
"""Definitions of the terms of a page, for tooltips and the glossary."""

SYMBOLS: Mapping[str, str] = {"good": "✓", "bad": "✕", "undecided": "?", "none": "–"}
"""Sign of each tone, as colour alone does not show a verdict."""

Box: TypeAlias = Sequence[float]
"""`[x, y, width, height]` [px]."""


@dataclass(frozen=True)
class Still:
    """Frame with the true box and the boxes of trackers."""

    image: bytes  # WebP; empty without frames
    size: tuple[int, int]  # width and height of the frame [px]
    truth: Box | None
    boxes: Sequence[tuple[int, int, Box]]  # indices of the tracker and of the dashes, and the box
    words: str  # description for screen readers
    round: bool = False  # True to draw ellipses in the boxes


@dataclass(frozen=True)
class LeaderRow:
    """Tracker in a leaderboard; texts are ready to print."""

    tracker: int
    label: str
    mean: float  # overlap; NaN if runs are missing
    interval: tuple[float, float] | None
    success: str
    error: str
    time: str  # ms per frame
    fps: str
    place: PlayerPosition | None = None
    note: str = ""
    marked: bool = False  # best, or not worse than any other tracker


@dataclass(frozen=True)
class Leaderboard:
    """Trackers by mean overlap, best first."""

    rows: Sequence[LeaderRow]
    over: str  # number of sequences: `3 sequences`
    notes: Sequence[str] = ()  # on the times


@dataclass(frozen=True)
class Loop:
    """Frames around the hardest moment of a sequence."""

    name: str
    first: int
    last: int
    still: Still
    overlaps: Sequence[tuple[int, str, float]]  # index and name of the tracker, and its overlap
    place: PlayerPosition


@dataclass(frozen=True)
class HeatRow:
    """Sequence in a heat map; values are NaN if missing."""

    name: str
    thumbnail: bytes
    values: Sequence[float]
    places: Sequence[PlayerPosition | None]


@dataclass(frozen=True)
class HeatTable:
    """Mean overlap by sequence and tracker; rows after `max_rows` are folded."""

    trackers: Sequence[tuple[int, str]]
    rows: Sequence[HeatRow]
    means: Sequence[float]
    max_rows: int


@dataclass(frozen=True)
class PairCell:
    """One tracker compared with another one."""

    answer: str  # `better`, `worse`, `equivalent` or `inconclusive`; empty for too few units
    difference: float
    won: int
    lost: int
    tip: str
    place: PlayerPosition | None


@dataclass(frozen=True)
class PairMatrix:
    """Answers on all pairs; the cell of a tracker with itself is None."""

    trackers: Sequence[tuple[int, str]]
    rows: Sequence[Sequence[PairCell | None]]
    note: str = ""


@dataclass(frozen=True)
class FailureCard:
    """Run that lost the target or stopped."""

    label: str
    sequence: str
    text: str
    still: Still
    place: PlayerPosition


@dataclass(frozen=True)
class SequenceFold:
    """Folded scores of a sequence with the overlap by frame."""

    key: str
    name: str
    thumbnail: bytes
    result: str
    means: Sequence[tuple[int, str, float]]  # index and name of the tracker, mean overlap
    chart: Chart | None
    scores: PageTable | None
    address: str  # of the sequence in the player
    why: str = ""  # reason why there are no frames


@dataclass(frozen=True)
class Fold:
    """Folded tables and paragraphs; commands have a button that copies them."""

    key: str
    title: str
    result: str = ""
    words: Sequence[str] = ()
    sheets: Sequence[PageTable] = ()
    commands: Sequence[str] = ()


@dataclass(frozen=True)
class VerdictCount:
    """Number of claims with a label."""

    label: str
    tone: str
    count: int
    key: str = ""  # group of claims that the number opens


@dataclass(frozen=True)
class SideCell:
    """Value of ours in a table of a paper."""

    text: str
    share: float | None = None  # length of the bar in [0, 1]
    tone: str = ""  # verdict on the claim that the value belongs to; empty without a verdict
    tip: str = ""
    place: PlayerPosition | None = None


@dataclass(frozen=True)
class SideRow:
    """Row: the paper's values, one per column or one for all, and ours by column and setting."""

    labels: Sequence[str]
    paper: Sequence[str]
    ours: Sequence[Sequence[SideCell]]


@dataclass(frozen=True)
class SideTable:
    """Values of a paper next to ours in each setting."""

    head: str
    columns: Sequence[str]
    settings: Sequence[str]
    rows: Sequence[SideRow]
    notes: Sequence[str] = ()

    @property
    def paired(self) -> bool:
        """True if the paper has a value in each column."""
        return any(len(row.paper) > 1 for row in self.rows)


@dataclass(frozen=True)
class StripTile:
    """Frame with one box per setting; `notes`: label, text and tone of the lines below it."""

    still: Still
    notes: Sequence[tuple[str, str, str]]


@dataclass(frozen=True)
class StripRow:
    """Frames with the boxes of one tracker."""

    label: str
    tracker: int  # index of the colour
    tiles: Sequence[StripTile]


@dataclass(frozen=True)
class FigurePanel:
    """Figure of a paper from our runs: rows of frames, or pictures."""

    label: str
    caption: str  # content of the paper's figure
    words: str  # content of ours
    frames: Sequence[str] = ()  # headings of the tiles
    rows: Sequence[StripRow] = ()
    pictures: Sequence[bytes] = ()


@dataclass(frozen=True)
class VerdictCell:
    """Verdict on a claim in a setting with its estimate and reason."""

    setting: str
    verdict: str
    tone: str
    effect: str
    reason: str = ""
    place: PlayerPosition | None = None


@dataclass(frozen=True)
class VerdictItem:
    """Claim with its verdicts; it unfolds a quote and facts by name."""

    key: str
    title: str
    paper: str
    cells: Sequence[VerdictCell]
    quote: str
    facts: Mapping[str, str]


@dataclass(frozen=True)
class VerdictGroup:
    """Claims with equal verdicts."""

    key: str
    title: str
    tone: str
    claims: Sequence[VerdictItem]


@dataclass(frozen=True)
class PaperRow:
    """Paper with its finding and the numbers of verdicts in each setting."""

    title: str
    address: str  # of its page; empty if there is none
    finding: str
    counts: Mapping[str, Sequence[VerdictCount]]  # by setting
    note: str
