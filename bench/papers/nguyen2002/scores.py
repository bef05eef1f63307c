"""Stored runs of the paper's tracker as one tidy frame, a row a run and trace."""

from collections.abc import Collection
from functools import cache
from pathlib import Path
from typing import Any, get_args

import pandas as pd

from bench.claims.ledger import ANY
from bench.evaluation.record import Trace
from bench.experiments.contestant import contestant
from bench.papers.nguyen2002.measures import course_of
from bench.papers.scores import counts_of, runs_of, sequence_labels
from bench.store.layout import Cell
from bench.store.loading import as_revised
from bench.store.results import Results
from bench.store.truth import StoredTruth, read_truth
from datasets.text_form import format_text, parse_text

__all__ = ["CELL", "COLOURED", "LIGHTS", "labels_of", "tidy_scores"]

LIGHTS = "nguyen2002/lights"
COLOURED = "nguyen2002/lights:lamps=coloured"

CELL = ("sequence", "scene", "preset", "variant")
"""What a failed run costs: a scene under a reading, whatever the features are."""


def tidy_scores(folder: Path, cells: Collection[Cell] | None = None) -> pd.DataFrame:
    """Scores of an experiment's runs, a row a run and trace.

    Parameters
    ----------
    folder : Path
        Results of an experiment on synthetic sequences.
    cells : collection of Cell, optional
        The runs that are meant; all by default.

    Returns
    -------
    DataFrame
        `text` and `name` (text forms of tracker and sequence), `trace`; of the tracker, what
        `labels_of` gives; `sequence` (without variant, but that coloured lamps make it another),
        `scene`, `light` (`even`) and further options of the sequence; what
        `bench.papers.scores.counts_of` and `courses.course_of` give for the trace (NaN for a failed
        run); `kept_scene`, true of all.

    Raises
    ------
    ResultsError
        Where a run is missing or stale.
    """
    online = runs_of(folder, cells)
    revised = as_revised(online)
    traces = {"revised": online if revised is None else revised, "online": online}
    labels, labels_on = cache(labels_of), cache(_labels_on)
    known = pd.DataFrame(
        [
            {"text": text, "name": name, **labels(text), **labels_on(name)}
            for text, name in zip(online["tracker"], online["sequence"], strict=True)
        ]
    ).assign(kept_scene=True)
    counts = {trace: counts_of(folder, runs) for trace, runs in traces.items()}
    courses = _courses(folder, counts)
    pieces = [
        known.assign(trace=trace).join(counts[trace]).join(courses[trace]) for trace in traces
    ]
    return pd.concat(pieces, ignore_index=True)


def labels_of(text: str) -> dict[str, str]:
    """What a tracker's text form says, by columns of the ledger's readings.

    Parameters
    ----------
    text : str
        A label of results.

    Returns
    -------
    dict of str to str
        `features` (`intensity`, `rgb`, `invariants`), `definition` (of the invariants: `ratio`,
        `arctan`; else `any`), `preset`, `variant` (other parameters in text form; empty for none).
    """
    settled = contestant(text)
    _, options = parse_text(settled.label)
    features = str(settled.parameters["features"])
    definitions = {"invariants": "ratio", "arctan": "arctan"}
    others = {key: value for key, value in options.items() if key not in ("preset", "features")}
    return {
        "features": "invariants" if features in definitions else features,
        "definition": definitions.get(features, ANY),
        "preset": options.get("preset", "recommended"),
        "variant": format_text("", dict(sorted(others.items()))).removeprefix(":"),
    }


def _labels_on(name: str) -> dict[str, Any]:
    labels = {**sequence_labels(name), "light": "even"}
    if labels.get("lamps") == "coloured":
        labels["sequence"] = COLOURED
    return labels


def _courses(folder: Path, counts: dict[str, pd.DataFrame]) -> dict[str, pd.DataFrame]:
    """Courses by trace, a row a run; every run is read once."""
    results = Results(folder)
    truths: dict[tuple[str, str], StoredTruth] = {}
    rows: dict[str, list[dict[str, float]]] = {trace: [] for trace in counts}
    places = counts["online"][["path", "failure"]].itertuples(index=False, name=None)
    losses = {trace: found["first_loss"].to_numpy() for trace, found in counts.items()}
    for number, (path, failure) in enumerate(places):
        run = None if failure else results.read(Path(path))
        if run is not None:
            key = run.identity.sequence, run.identity.fingerprint
            if key not in truths:
                truths[key] = read_truth(folder, *key)
        for trace in get_args(Trace):
            known = {}
            if run is not None:
                known = course_of(run, truths[key], trace, losses[trace][number])
            rows[trace].append(known)
    return {trace: pd.DataFrame(found) for trace, found in rows.items()}
