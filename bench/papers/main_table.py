"""Main table of a paper: statements on videos, or counts, next to ours in equal units.

The paper's cell of a statement is `1 of 1` or `0 of 1`: the statement is true or false for the one
video that the paper shows. Our cell is the number of scenes for which the statement is true, such
as `18 of 24`. A count, such as tracked clips of 20, is our mean over scenes or sets.
"""

from dataclasses import dataclass

import pandas as pd

from trackmark.bench.papers import SETTING_LABELS, SETTINGS
from trackmark.bench.papers.measures import Measure
from trackmark.bench.papers.paper import MainRow, Paper
from trackmark.bench.papers.runs import Context
from trackmark.bench.papers.settings import setting_differences
from trackmark.bench.papers.strips import BOTH
from trackmark.reports.tables import MISSING, Table, text_table

SEPARATOR = " / "


@dataclass(frozen=True)
class MainCell:
    """Values of a cell, and the number of videos, scenes or objects that they are counted of."""

    values: tuple[str, ...]
    total: str = ""

    @classmethod
    def parse(cls, cell_text: str) -> "MainCell":
        """Read a cell such as `1 / 0 of 1`."""
        values, _, total = cell_text.partition(" of ")
        return cls(tuple(values.split(SEPARATOR)), total)

    def __str__(self) -> str:
        return SEPARATOR.join(self.values) + (f" of {self.total}" if self.total else "")


def shown_settings(paper: Paper) -> dict[str, str]:
    """Return the settings of the paper's tables with their labels: one if both are equal."""
    if any(setting_differences(paper).values()):
        return dict(SETTING_LABELS)
    return {SETTINGS[-1]: BOTH}


def main_table(context: Context) -> Table:
    """Return the paper's results and ours, row by row."""
    main, settings = context.paper.main_table, shown_settings(context.paper)
    headings = [*main.headings, "paper", *settings.values()]
    rows = [
        [*row.labels, row.paper, *(str(main_cell(row, setting, context)) for setting in settings)]
        for row in main.rows
    ]
    return text_table("main", main_caption(context), headings, rows, len(main.headings))


def main_caption(context: Context) -> str:
    """Return the caption of the main table with the number of scenes."""
    n_scenes = context.n_scenes
    counted = f"{n_scenes} scene{'s' * (n_scenes != 1)} per sequence"
    return f"{context.paper.main_table.caption} Ours: {counted}."


def main_cell(row: MainRow, setting: str, context: Context) -> MainCell:
    """Return our cell of a row in a setting."""
    if row.function:
        return MainCell.parse(str(row.function(context, setting)))
    assert row.sequence is not None
    tables = [
        context.runs.values(context.case(tracker, row.sequence, setting), measure)
        for tracker in row.trackers
        for measure in row.measures
    ]
    if row.compares:
        tables = [_nearer(tables[0], tables[1], row.measures[0])]
    if not row.total:
        return _counted(tables)
    form = ".0f" if all(measure.unit == "frames" for measure in row.measures) else ".1f"
    values = (f"{table['value'].mean():{form}}" if len(table) else MISSING for table in tables)
    return MainCell(tuple(values), str(row.total))


def _counted(tables: list[pd.DataFrame]) -> MainCell:
    """Return the numbers of scenes for which statements are true, which have the value 1."""
    total = max((len(table) for table in tables), default=0)
    counts = [f"{table['value'].sum():.0f}" if len(table) else MISSING for table in tables]
    return MainCell(tuple(counts), str(total))


def _nearer(first: pd.DataFrame, second: pd.DataFrame, measure: Measure) -> pd.DataFrame:
    """Return 1 for each scene in which the first tracker has the better value, else 0."""
    gains = first.set_index("rank")["value"] - second.set_index("rank")["value"]
    gains = (-gains if measure.lower_is_better else gains).dropna()
    return pd.DataFrame({"value": (gains > 0).astype(float)})
