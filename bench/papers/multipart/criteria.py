"""Findings of an earlier trial on other scenes: met here or not; nothing is asserted."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from bench.papers.multipart.static import THRESHOLD, Scene
from bench.papers.multipart.tables import PLAIN, TWO_COLOURED, cell_shares
from reports.tables import MISSING, Cell, Table

__all__ = ["criteria_table"]

TIE = 0.02  # of the length


def criteria_table(
    scores: pd.DataFrame, scenes: Mapping[str, Scene], time_ratio: float | None
) -> Table:
    """What an earlier trial found with the body rectangle, and what is found here.

    Parameters
    ----------
    scores : DataFrame
        See `tidy_scores`, with the rows of `adaptive_rows`; no variant.
    scenes : mapping of str to Scene
        What was examined before.
    time_ratio : float or None
        Median time of multi over single; None where it was not measured.
    """
    body = scores[scores["initial"] == "body"]
    rows = [
        _switch("body", scenes, "64 of 64", 0.9),
        _switch("full", scenes, "5 of 8", None),
        *_comparisons(body),
        _light(body),
        _spread(scores[scores["initial"] == "full"]),
    ]
    if time_ratio is not None:
        met = "yes" if time_ratio <= 1.02 else "no"
        rows.append(["multi takes no longer in one pass (ratio)", "1.0", f"{time_ratio:.3f}", met])
    return Table(
        name="criteria",
        caption="Findings of an earlier trial on scenes of its own, and whether they are met here",
        heads=["finding", "earlier trial", "here", "met"],
        n_labels=1,
        rows=[[Cell(text) for text in row] for row in rows],
        data=pd.DataFrame(rows, columns=["finding", "earlier trial", "here", "met"]),
    )


def _switch(
    initial: str, scenes: Mapping[str, Scene], trial: str, wanted: float | None
) -> list[str]:
    right = [
        (getattr(scene, f"distance_{initial}") > THRESHOLD)
        == (name.partition(":")[0] in TWO_COLOURED)
        for name, scene in scenes.items()
    ]
    met = MISSING if wanted is None else _yes(np.mean(right) >= wanted)
    words = f"the switch is right with the {initial} rectangle"
    words += "" if wanted is None else f" (≥ {100 * wanted:.0f} %)"
    return [words, trial, f"{sum(right)} of {len(right)}", met]


def _comparisons(body: pd.DataFrame) -> list[list[str]]:
    overlap = cell_shares(body, "success_frames")
    loss = cell_shares(body, "first_loss")
    two_overlap = overlap.loc[overlap.index.isin(TWO_COLOURED, level="sequence")]
    two_loss = loss.loc[loss.index.isin(TWO_COLOURED, level="sequence")]
    plain_loss = loss.loc[loss.index.isin(PLAIN, level="sequence")]
    not_worse = two_overlap["multi"] >= two_overlap["single"]
    kept = two_loss["multi"] >= two_loss["single"] - TIE
    gain = plain_loss["multi"] - plain_loss["single"]
    better, worse = int((gain > TIE).sum()), int((gain < -TIE).sum())
    best = loss[["single", "multi"]].max(axis=1)
    near = loss["adaptive"] >= best - TIE
    return [
        [
            "two colours: multi has no fewer frames of overlap ≥ 0.5 (≥ 80 % of scenes)",
            "32 of 32",
            f"{not_worse.sum()} of {len(not_worse)}",
            _yes(not_worse.mean() >= 0.8),
        ],
        [
            "two colours: multi is lost no earlier, within 2 % (≥ 90 % of scenes)",
            "30 of 32",
            f"{kept.sum()} of {len(kept)}",
            _yes(kept.mean() >= 0.9),
        ],
        [
            "plain: no rule which is lost first (better, worse by 2 %; neither in 75 %)",
            "5, 5 of 32",
            f"{better}, {worse} of {len(gain)}",
            _yes(max(better, worse) < 0.75 * len(gain)),
        ],
        [
            "adaptive is the best of both, within 2 % of first loss (≥ 85 % of scenes)",
            "57 of 64",
            f"{near.sum()} of {len(near)}",
            _yes(near.mean() >= 0.85),
        ],
    ]


def _light(body: pd.DataFrame) -> list[str]:
    """Plain targets are lost in dappled light (their scale collapses), kept in even light."""
    kept = [
        cell_shares(plain, "first_loss")[["single", "multi"]].to_numpy().mean()
        for _, plain in body[body["sequence"].isin(PLAIN)].groupby("light")
    ]
    if len(kept) < 2:
        return ["plain: kept longer in even than in dappled light", ".98, .64", MISSING, MISSING]
    dappled, even = kept
    words = "plain: kept longer in even than in dappled light (share)"
    return [words, ".98, .64", f"{even:.2f}, {dappled:.2f}", _yes(even > dappled)]


def _spread(full: pd.DataFrame) -> list[str]:
    """A scene says more than a seed."""
    runs = full[full["representation"] != "adaptive"]
    shares = runs.assign(share=runs["first_loss"] / runs["frames"])
    keys = ["representation", "light", "sequence"]
    within = shares.groupby([*keys, "scene"])["share"].std().mean()
    between = shares.groupby([*keys, "scene"])["share"].mean().groupby(keys).std().mean()
    if not np.isfinite(within + between):
        return ["scenes differ more than repetitions of one", "ten times", MISSING, MISSING]
    said = f"{between:.3f} against {within:.3f}"
    return [
        "scenes differ more than repetitions of one (sd of the share before first loss)",
        "ten times",
        said,
        _yes(between > within),
    ]


def _yes(met: object) -> str:
    return "yes" if met else "no"
