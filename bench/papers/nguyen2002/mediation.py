"""Whether the invariants fail where they tell less of the target from clutter."""

from collections.abc import Iterator

import pandas as pd

from bench.papers.nguyen2002.sets import CLIPS

__all__ = ["failures_by_margin"]

COLUMNS = ["sequence", "scene", "trace", "preset", "clips", "pairs", "correlation"]


def failures_by_margin(margins: pd.DataFrame, scores: pd.DataFrame) -> pd.DataFrame:
    """Rank correlation, over a set's clips, of what the invariants lose of margin and of target.

    Both are differences to RGB: of the mean margin (`ng-9`), and of the share of clear frames on
    the target.

    Parameters
    ----------
    margins : DataFrame
        `name`, `features`, `margin`; the clips that count.
    scores : DataFrame
        See `tidy_scores`.

    Returns
    -------
    DataFrame
        By set, trace and preset: `sequence` (of all clips), `scene`, `trace`, `preset`, `clips`
        (number), and in a row each `pairs` (`of a clip`, `by chance`) with their `correlation`,
        which is 0 by chance. Without the sets in which all clips fare alike.
    """
    by_clip = margins.pivot_table("margin", "name", "features")
    lost = by_clip["rgb"] - by_clip["invariants"]
    plain = scores[(scores["variant"] == "") & (scores["definition"] != "arctan")]
    rows = [
        {**labels, "clips": len(both), "pairs": pairs, "correlation": value}
        for labels, both in _sets(lost, plain)
        for pairs, value in (("of a clip", _rank_correlation(both)), ("by chance", 0.0))
    ]
    return pd.DataFrame(rows, columns=COLUMNS)


def _sets(
    lost: "pd.Series[float]", scores: pd.DataFrame
) -> Iterator[tuple[dict[str, object], pd.DataFrame]]:
    """Sets in which clips differ in either loss: their labels, and both losses by clip."""
    for (scene, trace, preset), runs in scores.groupby(["scene", "trace", "preset"], sort=False):
        shares = runs.pivot_table("on_target", "name", "features")
        if not {"rgb", "invariants"} <= set(shares):
            continue
        failing = shares["rgb"] - shares["invariants"]
        both = pd.DataFrame({"margin": lost, "target": failing}).dropna()
        if (both.min() < both.max()).all():
            labels = {"sequence": CLIPS, "scene": scene, "trace": trace, "preset": preset}
            yield labels, both


def _rank_correlation(both: pd.DataFrame) -> float:
    return float(both["margin"].corr(both["target"], method="spearman"))
