"""Cards of the pages of papers: plain data that the macros of the same names in `cards.html` draw.

A tone is `good`, `bad`, `undecided` or `none`; it gives the colour of a verdict.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from trackmark.reports.page.cards import Still
from trackmark.reports.page.content import PageTable, PlayerPosition

SYMBOLS: Mapping[str, str] = {"good": "✓", "bad": "✕", "undecided": "?", "none": "–"}
"""Sign of each tone, as colour alone does not show a verdict."""


@dataclass(frozen=True)
class VerdictCount:
    """Number of claims with a label."""

    label: str
    tone: str
    count: int
    key: str = ""  # group of claims that the number opens


@dataclass(frozen=True)
class VerdictBar:
    """Numbers of claims by group, as a bar."""

    counts: Sequence[VerdictCount]


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
class FigureSwitch:
    """Figures in the same place, with a switch; the first one with frames is shown first."""

    panels: Sequence[FigurePanel]

    @property
    def initial(self) -> int:
        """Index of the panel that is shown first."""
        return next((i for i, panel in enumerate(self.panels) if panel.rows), 0)


@dataclass(frozen=True)
class VerdictCell:
    """Verdict on a claim in a setting with its estimate and reason."""

    verdict: str
    tone: str
    effect: str
    reason: str = ""
    place: PlayerPosition | None = None


@dataclass(frozen=True)
class VerdictItem:
    """Claim with its verdicts; it unfolds a quote, facts by name, and tables."""

    key: str
    title: str
    paper: str
    cells: Sequence[VerdictCell]
    quote: str
    facts: Mapping[str, str]
    sheets: Sequence[PageTable]


@dataclass(frozen=True)
class VerdictGroup:
    """Claims with equal verdicts."""

    key: str
    title: str
    tone: str
    items: Sequence[VerdictItem]


@dataclass(frozen=True)
class VerdictList:
    """Claims by their verdicts in all settings."""

    settings: Sequence[str]
    groups: Sequence[VerdictGroup]


@dataclass(frozen=True)
class PaperRow:
    """Paper with its finding and the numbers of verdicts in each setting."""

    title: str
    address: str  # of its page; empty if there is none
    finding: str
    counts: Sequence[Sequence[VerdictCount]]
    note: str


@dataclass(frozen=True)
class PaperList:
    """Papers with one bar of verdicts per setting."""

    settings: Sequence[str]
    rows: Sequence[PaperRow]
