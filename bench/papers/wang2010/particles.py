"""Row of the main table: the fewest particles with which the filters keep the ball."""

import pandas as pd

from trackmark.bench.papers.evidence import evidence
from trackmark.bench.papers.runs import Context
from trackmark.reports.tables import MISSING

CLAIM = "WA-13"
LARGEST = 400  # largest number of particles that is run


def fewest(context: Context, setting: str) -> str:
    """Return the median of the fewest particles over scenes, of the proposed and the old filter."""
    if context.options.quick:
        return f"{MISSING} / {MISSING}"
    values = evidence(context.paper.claims[CLAIM], setting, context)
    return f"{_median(values.first)} / {_median(values.second)}"


def _median(doublings: pd.DataFrame) -> str:
    """Return the median as text; `none` if most scenes need more particles than are run."""
    if doublings.empty:
        return MISSING
    median = 2 ** doublings["value"].median()
    return f"{median:.0f}" if median <= LARGEST else "none"
