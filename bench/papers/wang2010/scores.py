"""Stored runs of the paper's filters and CamShifts as one tidy frame."""

from collections.abc import Collection
from functools import cache
from math import nan
from pathlib import Path
from typing import Any

import pandas as pd

from bench.claims.ledger import ANY
from bench.experiments.contestant import contestant
from bench.papers.scores import counts_of, runs_of, sequence_labels
from bench.papers.wang2010.courses import CUP, TABLE_TENNIS, course_of
from bench.store.layout import Cell
from bench.store.results import Results
from bench.store.truth import StoredTruth, read_truth
from datasets.text_form import format_text, parse_text

__all__ = [
    "CAMSHIFT",
    "CELL",
    "FILTER",
    "IMPROVED",
    "PROPOSED",
    "RULE",
    "TEN",
    "by_number",
    "labels_of",
    "tidy_scores",
    "with_shared_runs",
]

PROPOSED, FILTER = "wang2010", "particle-filter"
CAMSHIFT, IMPROVED = "camshift", "camshift-improved"

RULE, TEN = "rule", "10"
"""How far the filters' particles are thrown: by the formula √N / 2, or 10 pixels."""

CELL = ("sequence", "scene", "preset", "variant")
"""What a failed run costs: a scene under a reading, whatever tracks it and its radius."""

PAPERS = {"alpha": 0.7, "beta": 0.8}

MODELS = {(0.7, 0.8): "fused", (0.7, 0.0): "colour", (1.0, 0.0): "hue"}
"""By α and β; others are named by the one that is not the paper's."""

_REACH = "3.87"  # pixels: the proposed filter's by the formula, given to the traditional one
_TEN_BY_RULE = 400  # particles

_NO_VARIANT = {"preset", "alpha", "beta", "particles", "window", "radius"}
_ALL_ANY = dict.fromkeys(("preset", "variant", "model", "budget", "radius", "reach", "window"), ANY)


def tidy_scores(folder: Path, cells: Collection[Cell] | None = None) -> pd.DataFrame:
    """Scores of an experiment's runs, one row a run.

    Parameters
    ----------
    folder : Path
        Results of an experiment on synthetic sequences.
    cells : collection of Cell, optional
        The runs that are meant; all by default.

    Returns
    -------
    DataFrame
        `text` and `name` (text forms of tracker and sequence); of the tracker, what `labels_of`
        gives; `sequence` (without variant, but that a plain background makes it another),
        `scene`, `light` (`even`) and further options of the sequence; what
        `bench.papers.scores.counts_of` gives; `centre_error` (mean over the frames after the
        first); what `courses.course_of` gives (NaN for a failed run); `kept_scene`, true of all.

    Raises
    ------
    ResultsError
        Where a run is missing or stale.
    """
    runs = runs_of(folder, cells)
    labels_on, labels = cache(_labels_on), cache(labels_of)
    known: list[dict[str, Any]] = []
    for text, name in zip(runs["tracker"], runs["sequence"], strict=True):
        on = labels_on(name)
        known.append({"text": text, "name": name, **labels(text, on["sequence"]), **on})
    rows = pd.DataFrame(known).join(counts_of(folder, runs))
    errors = runs["centre_error"].to_numpy() if "centre_error" in runs else nan  # all failed
    rows = rows.assign(centre_error=errors, kept_scene=True)
    results = Results(folder)
    truths: dict[tuple[str, str], StoredTruth] = {}
    courses: list[dict[str, float]] = []
    places = zip(rows["path"], rows["failure"], rows["sequence"], strict=True)
    for path, failure, sequence in places:
        if failure:
            courses.append({})
            continue
        run = results.read(Path(path))
        key = run.identity.sequence, run.identity.fingerprint
        if key not in truths:
            truths[key] = read_truth(folder, *key)
        courses.append(course_of(run, truths[key], sequence))
    scores: pd.DataFrame = rows.join(pd.DataFrame(courses, rows.index))
    return scores


def labels_of(text: str, sequence: str) -> dict[str, Any]:
    """What a tracker's text form says, by columns of the ledger's readings.

    Parameters
    ----------
    text : str
        A label of results.
    sequence : str
        Name of the sequence without variant.

    Returns
    -------
    dict of str to value
        `tracker` (name alone); `particles` (0 without); `preset`; `variant` (other parameters
        that are no column of their own, in text form; empty for none); `model` (`fused`,
        `colour`, `hue`, or α or β where these are others); `budget` (`paper` for the paper's
        number of particles, else `other`); `radius` (of a filter's transition: `rule` or
        pixels; `any` with 400 particles, for which the rule gives 10); `reach` (whether the
        traditional filter's is `rule`, or the proposed one's, `3.87`); `window` (of CamShift).
        What a tracker does not know is `any`.
    """
    settled = contestant(text)
    name, options = parse_text(settled.label)
    parameters = settled.parameters
    labels = {"tracker": name, "particles": int(parameters.get("particles", 0)), **_ALL_ANY}
    if name in (CAMSHIFT, IMPROVED):
        labels["window"] = parameters["window"]
    if name not in (PROPOSED, FILTER, IMPROVED):
        return labels
    others = [f"{key}={value}" for key, value in options.items() if key not in _NO_VARIANT]
    labels |= {
        "preset": options.get("preset", "recommended"),
        "variant": ":".join(sorted(others)),
        "model": _model(parameters["alpha"], parameters["beta"]),
    }
    if name == IMPROVED:
        return labels
    usual = {FILTER: 400, PROPOSED: 15 if sequence == CUP else 60}[name]
    labels["budget"] = "paper" if labels["particles"] == usual else "other"
    radius = options.get("radius", RULE)
    if name == FILTER:
        labels["reach"] = radius if radius == _REACH else RULE
        radius = RULE if radius == _REACH else radius
    is_ten = radius == RULE and labels["particles"] == _TEN_BY_RULE and labels["reach"] != _REACH
    return labels | {"radius": ANY if is_ten else radius}


def _model(alpha: float, beta: float) -> str:
    told = {"alpha": alpha, "beta": beta}
    others = {key: value for key, value in told.items() if value != PAPERS[key]}
    return MODELS.get((alpha, beta)) or format_text("", others).removeprefix(":")


def _labels_on(name: str) -> dict[str, Any]:
    labels = {**sequence_labels(name), "light": "even"}
    if labels.get("background") == "plain":
        labels["sequence"] = format_text(labels["sequence"], {"background": "plain"})
    return labels


def with_shared_runs(scores: pd.DataFrame) -> pd.DataFrame:
    """The scores, and those of the improved CamShift as written again as `recommended`.

    It has no σ: the two are the same.
    """
    written = (scores["preset"] == "as-written") & (scores["variant"] == "")
    improved = scores[written & (scores["tracker"] == IMPROVED)]
    return pd.concat([scores, improved.assign(preset="recommended")], ignore_index=True)


def by_number(scores: pd.DataFrame) -> pd.DataFrame:
    """Runs of the filters on the ball, as far as there are several numbers of particles.

    Those whose radius is 10 by the formula are there once for either `radius`.
    """
    fused = scores["tracker"].isin([PROPOSED, FILTER]) & (scores["model"] == "fused")
    runs = scores[fused & (scores["sequence"] == TABLE_TENNIS)]
    both = runs["radius"] == ANY
    either = [runs[both].assign(radius=radius) for radius in (RULE, TEN)]
    runs = pd.concat([runs[~both], *either], ignore_index=True)
    several = runs.groupby(["tracker", "preset", "variant", "radius", "reach"])["particles"]
    return runs[several.transform("nunique") > 1]
