"""Runs as tables: the paper's figures in figures, particles needed, how weights fared."""

from collections.abc import Iterator, Mapping
from typing import Any

import pandas as pd

from bench.claims.ledger import ANY
from bench.papers.tables import median_quartiles, share_words, text_table
from bench.papers.wang2010.courses import CUP, CURVE, HAND, SHOWN, STRETCHES, TABLE_TENNIS
from bench.papers.wang2010.scores import CAMSHIFT, FILTER, IMPROVED, PROPOSED, RULE, by_number
from reports.tables import MISSING, Table

__all__ = [
    "HINDSIGHT",
    "curve_table",
    "figure_table",
    "particles_table",
    "setting",
    "weights_table",
]

FIGURES = {TABLE_TENNIS: "Fig. 3", HAND: "Fig. 5", CUP: "Fig. 6"}

TRACKERS = {
    PROPOSED: "proposed",
    FILTER: "particle filter",
    CAMSHIFT: "CamShift",
    IMPROVED: "improved CamShift",
    "opencv-camshift": "OpenCV's CamShift",
}
MODELS = {"fused": "", "colour": "no motion (β = 0)", "hue": "hue alone (α = 1, β = 0)"}
HINDSIGHT = ("robust", "sigma=0.2", "radius=10")
"""Presets, variants and radii chosen after seeing results."""

_SETTING = ["tracker", "particles", "preset", "variant", "model", "radius", "reach", "window"]


def setting(run: "Mapping[str, Any] | pd.Series[Any]") -> str:
    """How a tracker was run, in words; see `scores.labels_of`."""
    words = [run["preset"], *str(run["variant"]).split(":"), MODELS.get(run["model"], run["model"])]
    radii = (run[column] for column in ("radius", "reach"))
    words += [f"radius={radius}" for radius in radii if radius not in (RULE, ANY)]
    words.append(run["window"])
    marked = (f"{word} (post hoc)" if word in HINDSIGHT else str(word) for word in words)
    return ", ".join(word for word in marked if word not in ("", ANY)) or MISSING


def figure_table(scores: pd.DataFrame, sequence: str) -> Table:
    """What every tracker reached on a sequence: success, errors, and the frames of the figure.

    Parameters
    ----------
    scores : DataFrame
        Of the figure's experiment; see `tidy_scores`.
    sequence : str
        Its name.
    """
    data = []
    for labels, runs in by_setting(scores[scores["sequence"] == sequence]):
        row = {
            **labels,
            "success [%]": share_words(runs, "success"),
            "frames in tolerance [%]": median_quartiles(runs, "tolerated", 100, 0),
        }
        for first, last in STRETCHES[sequence]:
            column = f"centre_error_{first}_to_{last}"
            row[f"error {first}–{last} [px]"] = median_quartiles(runs, column)
        for frame in SHOWN[sequence]:
            row[f"at {frame} [%]"] = share_words(runs, f"tolerated_at_{frame}")
        data.append({**row, "runs": str(len(runs))})
    figure = FIGURES[sequence]
    return text_table(
        figure.replace("Fig. ", "figure-"),
        f"{figure} in figures, other videos: medians [quartiles] and shares over "
        f"{scores['scene'].nunique()} scenes and their repetitions; frames counted from 1; the "
        "tolerance is half the mean side of the boxes, and `at` the share of the runs in it",
        data,
        n_labels=3,
    )


def curve_table(scores: pd.DataFrame) -> Table:
    """Fig. 4: centre error by frame."""
    fused = scores["model"].isin(["fused", ANY]) & (scores["tracker"] != IMPROVED)
    data = [
        {**labels} | {str(frame): median_quartiles(runs, f"error_at_{frame}") for frame in CURVE}
        for labels, runs in by_setting(scores[(scores["sequence"] == TABLE_TENNIS) & fused])
    ]
    return text_table(
        "figure-4",
        "Fig. 4 in figures: centre error [px] at frames, median [quartiles] over scenes and "
        "repetitions (the paper's values are lost)",
        data,
        n_labels=3,
    )


def particles_table(scores: pd.DataFrame) -> Table:
    """Success against the number of particles."""
    chosen = by_number(scores)
    data = []
    for (_, label), every in chosen.groupby(
        [chosen["tracker"], chosen.assign(particles=0).apply(setting, axis=1)], sort=False
    ):
        row = {"tracker": TRACKERS[every["tracker"].iloc[0]], "setting": str(label)}
        for number, runs in every.groupby("particles"):
            row[str(number)] = share_words(runs, "success")
        data.append(row)
    heads = ["tracker", "setting", *map(str, sorted(chosen["particles"].unique()))]
    return text_table(
        "particles",
        "How many particles are needed on the first sequence: success in %, mean over scenes, by "
        "their number (the paper: 60 suffice, of the traditional filter at least 400 are needed); "
        "by the formula the radius grows with the number, too; radius=10 is that of 400",
        [{head: row.get(head, MISSING) for head in heads} for row in data],
        n_labels=2,
    )


def weights_table(scores: pd.DataFrame, on_target: pd.DataFrame | None) -> Table:
    """How alike weights are, and what drift and resampling make of the particles.

    Parameters
    ----------
    scores : DataFrame
        See `tidy_scores`.
    on_target : DataFrame or None
        Table `wa-29` of `checks`; None where it was not measured.
    """
    filters = scores[scores["tracker"].isin([PROPOSED, FILTER]) & (scores["budget"] == "paper")]
    by_rule = filters["reach"].isin([RULE, ANY]) & filters["radius"].isin([RULE, ANY])
    filters = filters[(filters["model"] == "fused") & by_rule]
    filters = filters[filters["variant"].isin(["", "sigma=0.2"])]
    data = []
    for sequence, here in filters.groupby("sequence", sort=False):
        for labels, runs in by_setting(here):
            first = runs.iloc[0]
            beside = _on_target(on_target, first) if first["variant"] == "" else {}
            data.append(
                {
                    "sequence": str(sequence).partition("/")[2],
                    **labels,
                    "ESS/N": median_quartiles(runs, "effective_sample_size", 1, 3),
                    "least": median_quartiles(runs, "least_sample_size", 1, 3),
                    "greatest weight × N": median_quartiles(runs, "weight_ratio", 1, 2),
                    "spread [px]": median_quartiles(runs, "spread"),
                    "pixels with a particle": median_quartiles(runs, "modes", 1, 0),
                    "iterations": median_quartiles(runs, "iterations", 1, 2),
                    "on target [%]": beside.get("on", MISSING),
                    "weight on / off target": beside.get("ratio", MISSING),
                }
            )
    return text_table(
        "weights",
        "Does the observation function tell particles apart (Eq. 10)? Medians [quartiles] over "
        "runs of their means over frames; effective sample size over N (1: all weights alike), its "
        "least over frames; on target: share of the particles inside the true box, over scenes",
        data,
        n_labels=4,
    )


def _on_target(table: pd.DataFrame | None, run: "pd.Series[Any]") -> dict[str, str]:
    """Share of particles on the target, and how their weights compare, over scenes."""
    if table is None:
        return {}
    rows = table
    for column in ("sequence", "tracker", "preset"):
        rows = rows[rows[column] == run[column]]
    if rows.empty:
        return {}
    ratio = rows["on_over_off"].dropna()
    return {
        "on": f"{100 * rows['on_target'].mean():.0f}",
        "ratio": f"{ratio.median():.2f}" if len(ratio) else MISSING,
    }


def by_setting(scores: pd.DataFrame) -> Iterator[tuple[dict[str, str], pd.DataFrame]]:
    """Labels and runs of every tracker and way to run it."""
    for _, runs in scores.groupby(_SETTING, sort=False):
        first = runs.iloc[0]
        yield (
            {
                "tracker": TRACKERS[first["tracker"]],
                "N": str(first["particles"] or MISSING),
                "setting": setting(first),
            },
            runs,
        )
