"""Failed runs in claims: they get the worst score, and the verdict names them."""

from collections.abc import Iterable, Sequence

import numpy as np
import pandas as pd

from bench.claims.kinds import ERRORS, IN_PIXELS

__all__ = ["all_failed", "failure_note", "with_worst_scores"]


def with_worst_scores(rows: pd.DataFrame, metrics: Iterable[str]) -> pd.DataFrame:
    """Return rows of runs with the worst value in each metric that a failed run lacks.

    It is 0, as for an overlap, and 1 for a metric whose name begins with "lost" and for relative
    errors. An error in pixels is the centre error of the failed run (the diagonal of the image) if
    the table has it, else the largest error in the table.
    """
    if "failure" not in rows or not (failed := (rows["failure"] != "").to_numpy(bool)).any():
        return rows
    filled = rows.copy()
    for metric in {*metrics} & {*rows}:
        values = rows[metric].to_numpy(np.float64)
        worst = np.full(len(rows), 1.0 if metric.startswith(("lost", *ERRORS)) else 0.0)
        if metric.startswith(IN_PIXELS):
            own = rows["centre_error"] if "centre_error" in rows else rows[metric]
            worst = own.fillna(rows[metric].max()).to_numpy(np.float64)
        filled[metric] = np.where(failed & np.isnan(values), worst, values)
    return filled


def all_failed(sides: Sequence[pd.DataFrame]) -> str:
    """Return `all runs of T failed: reason` for the first such tracker, else an empty text."""
    for side in sides:
        if "failure" not in side or (side["failure"] == "").all():
            continue
        for tracker, rows in side.groupby("text" if "text" in side else "tracker", sort=False):
            if (rows["failure"] != "").all():
                return f"all runs of {tracker} failed: {_reason(rows['failure'].iloc[0])}"
    return ""


def failure_note(sides: Sequence[pd.DataFrame]) -> str:
    """Return how many runs failed and why the first one did; empty if none failed."""
    every = [side["failure"] for side in sides if "failure" in side]
    failures = [text for column in every for text in column if text]
    if not failures:
        return ""
    count = f"{len(failures)} of {sum(map(len, every))} runs failed (worst score)"
    return f"{count}: {failures[0]}"


def _reason(failure: str) -> str:
    """Return the reason in a line that begins with the run's name."""
    return failure.partition(": ")[2] or failure
