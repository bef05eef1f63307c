"""Whether the invariants fail where they tell less of the target from clutter."""

import pandas as pd

__all__ = ["failures_by_margin"]


def failures_by_margin(margins: pd.DataFrame, scores: pd.DataFrame) -> pd.DataFrame:
    """Rank correlation, over clips, of what the invariants lose of the margin, and of the target.

    Both are differences to RGB: of the mean margin (`ng-9`), and of the share of clear frames on
    the target.

    Parameters
    ----------
    margins : DataFrame
        `name`, `features`, `margin`.
    scores : DataFrame
        See `tidy_scores`.

    Returns
    -------
    DataFrame
        `trace`, `preset`, `correlation`, `clips`; without those in which all clips fare alike.
    """
    by_clip = margins.pivot_table("margin", "name", "features")
    lost = by_clip["rgb"] - by_clip["invariants"]
    plain = scores[(scores["variant"] == "") & (scores["definition"] != "arctan")]
    rows = []
    for (trace, preset), runs in plain.groupby(["trace", "preset"], sort=False):
        shares = runs.pivot_table("on_target", "name", "features")
        if not {"rgb", "invariants"} <= set(shares):
            continue
        failing = shares["rgb"] - shares["invariants"]
        both = pd.DataFrame({"lost": lost, "failing": failing}).dropna()
        if (both["failing"] != both["failing"].iloc[:1].sum()).any():
            correlation = float(both["lost"].corr(both["failing"], method="spearman"))
            rows.append(
                {
                    "trace": trace,
                    "preset": preset,
                    "correlation": correlation,
                    "clips": len(both),
                }
            )
    return pd.DataFrame(rows, columns=["trace", "preset", "correlation", "clips"])
