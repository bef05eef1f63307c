"""The paper's numbers beside ours, for scripts."""

from typing import Any

import pandas as pd

from bench.papers.nguyen2002.measures import CLIPS
from bench.papers.nguyen2002.tables import PUBLISHED
from bench.papers.nguyen2002.timing import PUBLISHED as SECONDS
from bench.statistics.intervals import mean_interval

__all__ = ["table_rows", "time_rows"]


def table_rows(sets: pd.DataFrame) -> list[dict[str, Any]]:
    """Table 1 as written, by both traces.

    Parameters
    ----------
    sets : DataFrame
        See `set_table`.

    Returns
    -------
    list of dict
        See `bench.papers.Report.rows`; ours are means over sets, with a 95 % interval.
    """
    usual = (sets["sequence"] == CLIPS) & (sets["preset"] == "as-written")
    usual &= (sets["variant"] == "") & (sets["definition"] != "arctan")
    rows = []
    for features, (clips, occlusions) in PUBLISHED.items():
        for trace in ("revised", "online"):
            chosen = usual & (sets["features"] == features) & (sets["trace"] == trace)
            rows += [
                {
                    "table": "table-1",
                    "label": features,
                    "column": f"{words}, {trace} boxes",
                    "published": published,
                    **_measured(sets[chosen][metric]),
                }
                for words, metric, published in (
                    ("clips tracked of 20", "tracked", clips),
                    ("occlusions detected of 21", "detected", occlusions),
                )
            ]
    return rows


def time_rows(times: pd.DataFrame) -> list[dict[str, Any]]:
    """The time of section 3: seconds a frame, by features.

    Parameters
    ----------
    times : DataFrame
        `ng-10`: `features`, `milliseconds`.
    """
    return [
        {
            "table": "time",
            "label": features,
            "column": "seconds a frame",
            "published": SECONDS,
            "measured": float(runs["milliseconds"].mean()) / 1e3,
            "interval": None,
        }
        for features, runs in times.groupby("features", sort=False)
    ]


def _measured(values: "pd.Series[float]") -> dict[str, Any]:
    """Mean and interval of what was run; None for nothing."""
    if values.empty:
        return {"measured": None, "interval": None}
    interval = list(mean_interval(values)) if len(values) > 1 else None
    return {"measured": float(values.mean()), "interval": interval}
