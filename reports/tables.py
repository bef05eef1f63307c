"""Tables: one model for all renderers."""

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal

import pandas as pd

MISSING = "—"

_NO_FRAME = "none"  # instead of a frame number
_NUMBER = re.compile(
    r"[\[(~<>≤≥]*\s*[+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?(?=$|[\s,;%\])±–*])",
    re.IGNORECASE | re.ASCII,
)
"""Number at the start of a text, such as `~3.1`, `[-0.2, 0.1]` or `54 of 99`."""


@dataclass(frozen=True)
class ScoreMeasure:
    """Column of a table: a score and its format."""

    name: str  # column of the data frame of runs
    title: str  # column heading
    unit: str = ""  # unit of the printed value; empty for pure numbers
    direction: Literal["higher", "lower"] | None = None  # better values; None if no value is better
    decimals: int = 2  # number of printed decimals
    scale: float = 1.0  # factor from score to printed value (1000 prints seconds as ms)
    out_of: str = ""  # column with the maximum of a count, printed as `k of n`
    never: str = ""  # text for a score that equals this maximum, instead of `n of n`
    rank: int = 0  # a narrow terminal omits columns of the highest rank first
    minimum: float = -math.inf  # lowest possible score
    maximum: float = math.inf  # highest possible score
    margin: float = 0.0  # difference of scores that is irrelevant in practice

    @property
    def heading(self) -> str:
        """Column heading with unit."""
        return f"{self.title} [{self.unit}]" if self.unit else self.title

    @property
    def sign(self) -> float:
        """1 if higher scores are better, else -1."""
        return 1.0 if self.direction == "higher" else -1.0


@dataclass(frozen=True)
class Cell:
    """Cell of a table: its text, and whether it is marked by a star or bold type."""

    text: str
    is_best: bool = False


@dataclass(frozen=True)
class Table:
    """Table, independent of an output format."""

    name: str  # file name without suffix
    caption: str
    headings: list[str]  # column headings
    n_labels: int  # number of leading columns with the labels of a row
    rows: list[list[Cell]]
    notes: list[str] = field(default_factory=list)  # below the table: failed and missing runs
    records: pd.DataFrame = field(default_factory=pd.DataFrame)  # one row per value, unrounded
    ranks: list[int] = field(default_factory=list)  # `ScoreMeasure.rank` of the score columns


def text_table(
    name: str,
    caption: str,
    headings: Iterable[str],
    rows: list[list[str]],
    n_labels: int = 1,
    notes: Iterable[str] = (),
    records: pd.DataFrame | None = None,
) -> Table:
    """Return a table of texts, which are also its records by default."""
    cells = [[Cell(text) for text in row] for row in rows]
    records = pd.DataFrame(rows, columns=[*headings]) if records is None else records
    return Table(name, caption, [*headings], n_labels, cells, [*notes], records)


def text_columns(table: Table) -> list[bool]:
    """Return for each column whether it has texts: labels, or mostly cells without a number.

    Cells with several statements (`0 of 2; fragile`) are always texts.
    """
    are_texts = []
    for column in range(len(table.headings)):
        cells = [row[column].text for row in table.rows]
        filled = [text for text in cells if text not in ("", _NO_FRAME) and text[0] != MISSING]
        n_numbers = sum(_NUMBER.match(text) is not None for text in filled)
        has_statements = any(";" in text for text in filled)
        is_text = column < table.n_labels or has_statements or 2 * n_numbers < len(filled)
        are_texts.append(is_text)
    return are_texts
