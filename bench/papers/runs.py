"""Stored runs of a paper's experiments as one tidy frame, a row a run and trace."""

import json
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

import datasets
from bench.claims.sides import SETTLED, run_key
from bench.evaluation.record import Trace
from bench.experiments.contestant import contestant
from bench.papers.description import Description
from bench.papers.measures import Course, Series, measured
from bench.papers.scores import counts_of, runs_of
from bench.store.layout import Cell
from bench.store.loading import as_revised
from bench.store.results import Results
from bench.store.truth import StoredTruth, read_truth
from datasets.text_form import format_text, parse_text

__all__ = ["OfRun", "as_run", "labels_of", "tidy_runs"]

OfRun = Callable[[Course], Mapping[str, float]]
"""What a paper's own `of_run` measures of a run."""

_GENERAL = {"scene": 0, "light": "even"}
"""What is said of sequences that have no such knob."""


def tidy_runs(
    folder: Path,
    cells: Collection[Cell] | None,
    description: Description,
    series: Mapping[str, Series],
    of_run: OfRun | None = None,
) -> pd.DataFrame:
    """Runs of an experiment, one row a run and trace.

    Parameters
    ----------
    folder : Path
        Results of an experiment on synthetic sequences.
    cells : collection of Cell, optional
        The runs that are meant; all by default.
    description : Description
        Of the paper.
    series, of_run
        What the paper's `measures.py` measures beside its `[measures]`.

    Returns
    -------
    DataFrame
        Of the tracker `text` (label), `tracker` (name), `preset`, `init`, `settled` (what runs are
        matched by) and every parameter, one of the same name as a knob as `tracker.<name>`; of the
        sequence `name` (canonical), `sequence` (without variant, but with the knobs that set it
        apart), `scene`, `light` and every knob; `trace`; what `bench.papers.scores.counts_of`
        gives, the scores of the results, and what was measured (NaN for a failed run);
        `kept_scene`, true of all.

    Raises
    ------
    ResultsError
        Where a run is missing or stale.
    """
    online = runs_of(folder, cells)
    revised = as_revised(online) if description.traces else None
    by_trace = {"online": online, "revised": online if revised is None else revised}
    names = zip(online["tracker"], online["sequence"], strict=True)
    known = pd.DataFrame([labels_of(text, name, description.apart) for text, name in names])
    pieces = []
    for trace in description.traces or ("online",):
        runs = by_trace[trace].reset_index(drop=True)
        counts = counts_of(folder, runs)
        further = runs[[column for column in runs if runs[column].dtype.kind == "f"]]
        further = further.drop(columns=[name for name in further if name in (*counts, *known)])
        measures = _measures(folder, known, counts, trace, description, series, of_run)
        further = further.drop(columns=[name for name in further if name in measures])
        counts = counts.drop(columns=[name for name in counts if name in measures])
        pieces.append(pd.concat([known, counts, further, measures], axis=1).assign(trace=trace))
    return pd.concat(pieces, ignore_index=True).assign(kept_scene=True)


def labels_of(tracker: str, sequence: str, apart: Sequence[str] = ()) -> dict[str, Any]:
    """Columns of `tidy_runs` that say what was run on what.

    Parameters
    ----------
    tracker, sequence : str
        Text forms.
    apart : sequence of str
        Knobs that set a sequence apart.
    """
    of_tracker, knobs = _tracker_labels(tracker), _sequence_labels(sequence, tuple(apart))
    own = {key if key not in knobs else f"tracker.{key}": of_tracker[key] for key in of_tracker}
    return {**own, **knobs}


def as_run(rows: pd.DataFrame, **parameters: Any) -> pd.DataFrame:
    """The same runs as those of trackers with other parameters, which would be the same.

    Parameters
    ----------
    rows : DataFrame
        Of `tidy_runs`.
    parameters
        What else the tracker's text form says: `preset`, or a parameter.
    """
    labels = []
    for text in rows["text"]:
        name, options = parse_text(text)
        labels.append(_tracker_labels(format_text(name, {**options, **parameters})))
    told = pd.DataFrame(labels, index=rows.index)
    taken = {name: f"tracker.{name}" for name in told if f"tracker.{name}" in rows}
    return rows.assign(**told.rename(columns=taken), copied=True)


@cache
def _tracker_labels(text: str) -> dict[str, Any]:
    settled = contestant(text)
    return {
        "text": settled.label,
        "tracker": settled.name,
        "preset": settled.preset,
        "init": settled.init,
        SETTLED: run_key(text),
        **{key: _plain(value) for key, value in settled.parameters.items()},
    }


def _plain(value: Any) -> Any:
    """What can be compared and told apart in a column."""
    return value if isinstance(value, str | int | float | None) else json.dumps(value)


@cache
def _sequence_labels(text: str, apart: tuple[str, ...]) -> dict[str, Any]:
    name, variant = parse_text(text)
    knobs = {
        knob["name"]: type(knob["default"])(variant.get(knob["name"], knob["default"]))
        for knob in datasets.options(name)
    }
    usual = {knob["name"]: knob["default"] for knob in datasets.options(name)}
    told = {key: knobs[key] for key in apart if key in knobs and knobs[key] != usual[key]}
    return {"name": text, "sequence": format_text(name, told), **_GENERAL, **knobs}


def _measures(
    folder: Path,
    known: pd.DataFrame,
    counts: pd.DataFrame,
    trace: Trace,
    description: Description,
    series: Mapping[str, Series],
    of_run: OfRun | None,
) -> pd.DataFrame:
    """What is measured of each run, a row a run; each is read once."""
    results = Results(folder)
    truths: dict[tuple[str, str], StoredTruth] = {}
    rows: list[dict[str, float]] = []
    known_of = counts.drop(columns=["path", "failure"])
    told = [
        dict(zip(map(str, known_of), values, strict=True))
        for values in known_of.itertuples(index=False, name=None)
    ]
    places = zip(counts["path"], counts["failure"], known["sequence"], told, strict=True)
    for path, failure, sequence, scores in places:
        if failure:
            rows.append({})
            continue
        run = results.read(Path(path))
        key = run.identity.sequence, run.identity.fingerprint
        if key not in truths:
            truths[key] = read_truth(folder, *key)
        course = Course(run, truths[key], sequence, description.tolerance, trace, scores)
        found = measured(course, description, series)
        rows.append(found | dict(of_run(course) if of_run else {}))
    frame = pd.DataFrame(rows, index=counts.index)
    return frame.reindex(columns=[*frame]).astype(np.float64)
