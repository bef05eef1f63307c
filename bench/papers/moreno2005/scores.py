"""Stored runs of the paper's tracker and of its baseline as one tidy frame, a row a run."""

from collections.abc import Collection, Mapping
from functools import cache
from math import nan
from pathlib import Path
from typing import Any

import pandas as pd

from bench.claims.ledger import ANY
from bench.experiments.contestant import contestant
from bench.papers.moreno2005.courses import COURSE, course_of
from bench.papers.moreno2005.learnt import OTHERS, PROPOSED, is_deviation
from bench.papers.scores import counts_of, runs_of, sequence_labels
from bench.store.layout import Cell
from bench.store.results import Results
from bench.store.truth import StoredTruth, read_truth
from datasets.text_form import format_text, parse_text

__all__ = [
    "BASELINE",
    "CELL",
    "MODERATE",
    "as_frozen",
    "labels_of",
    "similar_patches",
    "tidy_scores",
]

BASELINE = "baseline"
"""A method; others are `proposed`, or what of the structure is otherwise: `association=uniform`."""

STRUCTURE = (
    "association",
    "colour_model",
    "output",
    "plane_samples",
    "position",
    "snake",
    "snake_edges",
    "start",
)
"""Parameters that make another method; what else differs from a preset is a variant of it."""

MODERATE = "moderate"
"""Clutter of the ellipse that is post hoc: no claim rests on it."""

CELL = (
    "sequence",
    "scene",
    "lighting",
    "clutter",
    "illuminant",
    "shadow",
    "jump",
    "preset",
    "variant",
)
"""What a failed run costs: a scene under a reading, whatever the method."""

_EXAMPLE = dict.fromkeys(("set", "scale", "dependence"), ANY)
"""Readings of the one-dimensional example, on which no run depends."""

_KNOBS = {"lighting": "even", "clutter": "", "illuminant": "", "shadow": "", "jump": ""}
_MASKS = ["mean_region_similarity", "mean_contour_accuracy"]


def tidy_scores(folder: Path, cells: Collection[Cell] | None = None) -> pd.DataFrame:
    """Scores of an experiment's runs, a row a run.

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
        gives; `sequence` (without variant), `scene`, `light` (even: what it does is a column of its
        own), `lighting`, `clutter` (of the ellipse), `illuminant`, `shadow` (of the book), `jump`
        (of the leaf; all empty for others), `set`, `scale` and `dependence` (`any`); what
        `bench.papers.scores.counts_of` gives, `mean_region_similarity`, `mean_contour_accuracy`,
        and what `courses.course_of` gives, which has a `first_loss` of its own (NaN for a failed
        run); `kept_scene`, true of all.

    Raises
    ------
    ResultsError
        Where a run is missing or stale.
    """
    runs = runs_of(folder, cells)
    labels, labels_on = cache(labels_of), cache(_labels_on)
    known = pd.DataFrame(
        [
            {"text": text, "name": name, **labels(text), **labels_on(name)}
            for text, name in zip(runs["tracker"], runs["sequence"], strict=True)
        ]
    ).assign(kept_scene=True)
    counts = counts_of(folder, runs).drop(columns="first_loss")
    masks = runs.reindex(columns=_MASKS).reset_index(drop=True)
    return known.join(counts).join(masks).join(_courses(folder, counts))


def labels_of(text: str) -> dict[str, str]:
    """What a tracker's text form says, by columns of the ledger's readings.

    Parameters
    ----------
    text : str
        A label of results.

    Returns
    -------
    dict of str to str
        `method` (`proposed`, `baseline`, or what of the structure is otherwise), `preset`,
        `variant` (other parameters that differ from the preset's, in text form; empty for none),
        `mixing` (a of the baseline) and `plane` (its plane; both `any` for others).
    """
    settled = contestant(text)
    _, options = parse_text(settled.label)
    labels = {"preset": options.pop("preset", "recommended"), "mixing": ANY, "plane": ANY}
    if settled.name == "contour-smooth-color":
        for key in ("mixing", "plane"):
            options.pop(key, None)
            labels[key] = format_text("", {key: settled.parameters[key]}).rpartition("=")[2]
        return {**labels, "method": BASELINE, "variant": _words(options)}
    # One plane that goes on at random is another than one that stays.
    further = ("plane_spread",) if "plane_samples" in options else ()
    structure = {key: options.pop(key) for key in (*STRUCTURE, *further) if key in options}
    deviations = [options.pop(key) for key in list(options) if is_deviation(key)]
    method = OTHERS if deviations else _words(structure) or PROPOSED
    return {**labels, "method": method, "variant": _words(options)}


def as_frozen(scores: pd.DataFrame) -> pd.DataFrame:
    """Runs on sequences that claims rest on: none in moderate clutter, which is post hoc."""
    return scores[scores["clutter"] != MODERATE]


def similar_patches(scores: pd.DataFrame) -> pd.DataFrame:
    """Region similarity of the proposed method by whether a similar patch is at the target.

    Returns
    -------
    DataFrame
        Rows as of the scores, two a run: `patch` (`touching`, `apart`), `region_similarity`.
    """
    runs = scores[(scores["method"] == PROPOSED) & scores["near_patch"].notna()]
    columns = {"touching": "near_patch", "apart": "elsewhere"}
    return pd.concat(
        [
            runs.assign(patch=patch, region_similarity=runs[column])
            for patch, column in columns.items()
        ],
        ignore_index=True,
    )


def _words(options: Mapping[str, object]) -> str:
    return format_text("", dict(sorted(options.items()))).removeprefix(":")


def _labels_on(name: str) -> dict[str, Any]:
    labels = sequence_labels(name)
    return {
        **_EXAMPLE,
        **_KNOBS,
        "lighting": labels.pop("light", "even"),
        **labels,
        "light": "even",
    }


def _courses(folder: Path, counts: pd.DataFrame) -> pd.DataFrame:
    """Courses, a row a run; each is read once."""
    results = Results(folder)
    truths: dict[tuple[str, str], StoredTruth] = {}
    rows: list[dict[str, float]] = []
    for path, failure in counts[["path", "failure"]].itertuples(index=False, name=None):
        run = None if failure else results.read(Path(path))
        if run is None:
            rows.append(dict.fromkeys(COURSE, nan))
            continue
        key = run.identity.sequence, run.identity.fingerprint
        if key not in truths:
            truths[key] = read_truth(folder, *key)
        rows.append(course_of(run, truths[key]))
    return pd.DataFrame(rows)
