"""Runs as tables: tracking by figure, what the occlusion does, Hx with and without update."""

from collections.abc import Iterator
from math import nan
from typing import Any

import numpy as np
import pandas as pd

from bench.papers.nummiaro2003.scores import CELL, TRACKER
from bench.papers.scores import without_failures
from bench.papers.tables import median_quartiles, number_words, share_words, text_table
from reports.tables import MISSING, Table

__all__ = [
    "followed_rows",
    "occlusion_table",
    "readings_table",
    "scale_table",
    "tracking_table",
    "update_table",
]

SEQUENCES = tuple(
    f"nummiaro2003/{name}" for name in ("person", "car", "students", "traffic", "head")
)
STUDENTS, TRAFFIC, HEAD = SEQUENCES[2:]

HEAD_LENGTH = 450  # frames of the paper's Fig. 10, through all of which the head is followed

LABELS = ["tracker", "update", "re-initialisation"]
_BY = ["tracker", "preset", "variant", "update", "reinitialisation"]


def tracking_table(scores: pd.DataFrame) -> Table:
    """What every tracker reached on the sequences of the figures.

    Parameters
    ----------
    scores : DataFrame
        See `tidy_scores`; one light.
    """
    data = []
    for sequence, runs in _of_figures(scores):
        for labels, group in _trackers(runs):
            data.append(
                {
                    "sequence": sequence.partition("/")[2],
                    **labels,
                    "inside [%]": _shares(group, "frames_inside"),
                    "overlap ≥ 0.5 [%]": _shares(group, "success_frames"),
                    "before the first loss [%]": _shares(group, "first_loss"),
                    "mean overlap": median_quartiles(group, "mean_overlap", 1.0, 3),
                    "centre, rms [px]": median_quartiles(group, "centre_rms", 1.0, 1),
                }
            )
    n_scenes = scores["scene"].nunique()
    return text_table(
        "tracking",
        f"Fig. 4, 6, 8 and 10 in figures, other videos: median [quartiles] over {n_scenes} scenes "
        "and their repetitions; shares of the length, the given first frame counted",
        data,
        n_labels=4,
    )


def occlusion_table(scores: pd.DataFrame) -> Table:
    """Shares of the runs on `students`: what became of the target at the tree and afterwards."""
    events = {
        "count_fell": "count < bN behind the tree",
        "initialised": "initialising there",
        "tracking_again": "tracking 30 frames later",
        "recovered": "on target within 30 frames",
        "bridged": "short hidings bridged",
        "count_fell_shortly": "count < bN in one",
        "right_at_end": "right at the end",
        "count_fell_at_end": "count < bN when it has left",
    }
    data = [
        {
            **labels,
            **{words: share_words(group, name) for name, words in events.items()},
            "short hidings tested": f"{group['bridged'].notna().sum()} of {len(group)}",
        }
        for labels, group in _trackers(_ours_on(scores, STUDENTS))
    ]
    return text_table(
        "occlusion",
        "Fig. 6 and 7: shares of the runs in %, means over scenes; `right at the end` is the "
        "share of the last 20 frames in view with the centre inside. Short hidings: of the runs "
        "that tracked the target before one of them (tested); they last two to four frames, and a "
        "target is given up after loss_frames = 3 frames with fewer than b N",
        data,
        n_labels=3,
    )


def update_table(scores: pd.DataFrame, name: str) -> Table:
    """How often the model was updated, where it should be and where not (Eq. 11)."""
    chosen = scores[(scores["update"] == "with") & (scores["reinitialisation"] == "with")]
    data = []
    for labels, group in _trackers(chosen[chosen["sequence"].isin(SEQUENCES)]):
        row = {"tracker": labels["tracker"]}
        for sequence, runs in _of_figures(group):
            bare = sequence.partition("/")[2]
            counts = runs.sum(numeric_only=True)
            every_other = counts["other_frames"] + counts["waiting_frames"]
            for kind, updates, trials in (
                ("good", counts["good_updates"], counts["good_frames"]),
                ("other", counts["other_updates"], counts["other_frames"]),
                ("other or waiting", counts["other_updates"], every_other),
            ):
                row[f"{bare}, {kind}"] = number_words(100 * updates / trials if trials else nan, 1)
        data.append(row)
    return text_table(
        name,
        "Eq. 11: frames with an update in %, of the good ones (half of the target or more is "
        "visible, the centre inside) and of the others, while tracking; and of the others and "
        "those in which the tracker waits, initialising, together",
        data,
        n_labels=1,
    )


def scale_table(scores: pd.DataFrame, name: str, caption: str) -> Table:
    """Hx with and without update on `traffic`: a row a reading (Fig. 9).

    Parameters
    ----------
    scores : DataFrame
        See `tidy_scores`.
    name, caption : str
        Of the table.
    """
    chosen = _ours_on(scores, TRAFFIC)
    data = []
    for (preset, variant), every in chosen.groupby(["preset", "variant"], sort=False):
        runs = without_failures(every, CELL)
        wide = _by_update(runs, "size_error").dropna()
        smaller = int((wide["with"] < wide["without"]).sum())
        row = {"reading": _reading(preset, variant)}
        for metric, words, digits in (
            ("size_error", "|Hx error|", 3),
            ("size_bias", "bias", 3),
            ("size_correlation", "correlation", 2),
            ("mean_overlap", "overlap", 3),
        ):
            means = _by_update(runs, metric).mean()
            pair = [means[side] for side in ("without", "with")]
            row[words] = " / ".join(number_words(value, digits) for value in pair)
        updating = runs[runs["update"] == "with"]
        share = 100 * updating["good_updates"].sum() / max(updating["good_frames"].sum(), 1)
        row["updates [%]"] = f"{share:.0f}"
        row["smaller error with"] = f"{smaller} of {len(wide)} scenes"
        data.append(row)
    return text_table(name, caption, data, n_labels=1)


def readings_table(scores: pd.DataFrame) -> Table:
    """What decides the outcome: frames before the first loss by reading and sequence."""
    chosen = scores[(scores["tracker"] == TRACKER) & (scores["reinitialisation"] == "with")]
    chosen = chosen[chosen["sequence"].isin(SEQUENCES)]
    data = []
    for (preset, variant, light), runs in chosen.groupby(
        ["preset", "variant", "light"], sort=False
    ):
        row = {"reading": _reading(preset, variant), "light": str(light)}
        for sequence, here in _of_figures(runs.assign(share=runs["first_loss"] / runs["frames"])):
            means = 100 * _by_update(without_failures(here, CELL), "share").mean()
            pair = [means.get(side, np.nan) for side in ("without", "with")]
            row[sequence.partition("/")[2]] = " / ".join(number_words(value, 0) for value in pair)
        data.append(row)
    heads = ["reading", "light", *(name.partition("/")[2] for name in SEQUENCES)]
    data = [{head: row.get(head, MISSING) for head in heads} for row in data]
    return text_table(
        "readings",
        "What decides the outcome: frames before the first loss in % of the length, without / with "
        "update, means over scenes. `recommended`, σ = 0.05, the coefficient as the condition of "
        "the update and predicted places of re-initialisation are post hoc",
        data,
        n_labels=2,
    )


def followed_rows(scores: pd.DataFrame) -> list[dict[str, Any]]:
    """Fig. 10 for scripts: frames for which the head is followed, the paper's and ours."""
    head = scores[(scores["sequence"] == HEAD) & (scores["variant"] == "")]
    rows = []
    for (preset, update), runs in head.groupby(["preset", "update"], sort=False):
        found = runs[runs["failure"] == ""]["first_loss"]
        whole = len(found) == len(runs)
        rows.append(
            {
                "table": "figure-10",
                "label": f"head, {update} update",
                "column": preset,
                "published": HEAD_LENGTH if update == "with" else None,
                "measured": float(found.median()) if whole else None,
                "interval": [float(found.quantile(q)) for q in (0.25, 0.75)] if whole else None,
            }
        )
    return rows


def _of_figures(scores: pd.DataFrame) -> Iterator[tuple[str, pd.DataFrame]]:
    for sequence in SEQUENCES:
        runs = scores[scores["sequence"] == sequence]
        if len(runs):
            yield sequence, runs


def _ours_on(scores: pd.DataFrame, sequence: str) -> pd.DataFrame:
    return scores[(scores["sequence"] == sequence) & (scores["tracker"] == TRACKER)]


def _trackers(scores: pd.DataFrame) -> Iterator[tuple[dict[str, str], pd.DataFrame]]:
    """Labels and runs of every tracker and way to run it."""
    for key, runs in scores.groupby(_BY, sort=False):
        tracker, preset, variant, update, reinitialisation = map(str, key)
        is_ours = tracker == TRACKER
        label = _reading(preset, variant) if is_ours else tracker
        modes = (update, reinitialisation) if is_ours else (MISSING, MISSING)
        yield dict(zip(LABELS, (label, *modes), strict=True)), runs


def _reading(preset: object, variant: object) -> str:
    return f"{preset}, {str(variant).replace(':', ', ')}" if variant else str(preset)


def _by_update(runs: pd.DataFrame, metric: str) -> pd.DataFrame:
    """Means over repetitions by scene, with and without update."""
    wide = runs.pivot_table(metric, ["scene", "light"], "update", aggfunc="mean")
    return wide.reindex(columns=["without", "with"])


def _shares(runs: pd.DataFrame, metric: str) -> str:
    return median_quartiles(
        runs.assign(**{metric: 100 * runs[metric] / runs["frames"]}), metric, 1.0, 0
    )
