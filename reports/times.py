"""Which times of a frame runs are compared by."""

import pandas as pd


def timed_by(runs: pd.DataFrame) -> str:
    """Columns of times to compare by: warm where all that were timed have it, or as decoded.

    `warm_seconds` or `cpu_seconds`, which `_median` and the like follow; empty for none.
    """
    decoded, warm = (runs.get(f"{one}_seconds_median", pd.Series()) for one in ("cpu", "warm"))
    if decoded.isna().all():
        return ""
    return "warm_seconds" if warm.notna().sum() == decoded.notna().sum() else "cpu_seconds"
