"""The paper's numbers beside ours, for scripts."""

from math import exp, isfinite
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from bench.claims.checks.wang2010 import particles_needed, success_by_number
from bench.claims.ledger import ANY
from bench.papers.wang2010.courses import HAND, TABLE_TENNIS
from bench.papers.wang2010.scores import FILTER, PROPOSED, RULE
from bench.papers.wang2010.timing import PUBLISHED
from bench.statistics.intervals import mean_interval

__all__ = ["particle_rows", "time_rows"]

NAMES = {TABLE_TENNIS: "table-1", HAND: "section-3.2"}
NEEDED = {PROPOSED: 60, FILTER: 400}
SUCCESS = 0.9  # of the runs, that make a number suffice


def time_rows(times: pd.DataFrame) -> list[dict[str, Any]]:
    """Table 1 and the times of section 3.2: seconds a frame, and ratios to CamShift's.

    Parameters
    ----------
    times : DataFrame
        `method_times` of `timing`; ours are those in plain NumPy, CamShift's window fixed.

    Returns
    -------
    list of dict
        See `bench.papers.Report.rows`. Seconds have quartiles over passes, ratios a 95 %
        interval, which one pass alone has not; there is no row of what was never measured
        undisturbed.
    """
    plain = times[(times["implementation"] == "plain") & (times["window"] == "fixed")]
    rows = []
    for sequence, seconds in PUBLISHED.items():
        here = plain[plain["sequence"] == sequence]
        for method, published in seconds.items():
            label = {"table": NAMES[sequence], "label": method}
            if here.empty:
                continue
            low, middle, high = (float(here[method].quantile(q)) for q in (0.25, 0.5, 0.75))
            rows.append(
                label
                | {"column": "seconds a frame", "published": published}
                | {"measured": middle, "interval": [low, high]}
            )
            if method != "camshift":
                logs = np.log(here[method] / here["camshift"])
                rows.append(
                    label
                    | {
                        "column": "ratio to CamShift",
                        "published": published / seconds["camshift"],
                        "measured": exp(logs.mean()),
                        "interval": _ratios_between(logs),
                    }
                )
    return rows


def _ratios_between(logs: ArrayLike) -> list[float] | None:
    """95 % interval of a ratio from its logarithms a pass; None where a single one is left."""
    return [exp(limit) for limit in mean_interval(logs)] if np.size(logs) > 1 else None


def particle_rows(scores: pd.DataFrame) -> list[dict[str, Any]]:
    """How many particles the filters need as written; None where no number suffices.

    Parameters
    ----------
    scores : DataFrame
        See `tidy_scores`.
    """
    written = (scores["preset"] == "as-written") & (scores["variant"] == "")
    written &= (scores["model"] == "fused") & (scores["sequence"] == TABLE_TENNIS)
    by_formula = (scores["reach"] != "3.87") & scores["radius"].isin([RULE, ANY])
    runs = scores[written & by_formula]
    rows = []
    for tracker, published in NEEDED.items():
        number = particles_needed(success_by_number(runs, tracker), SUCCESS)
        rows.append(
            {
                "table": "particles",
                "label": tracker,
                "column": "particles needed on the first sequence",
                "published": published,
                "measured": number if isfinite(number) else None,
                "interval": None,
            }
        )
    return rows
