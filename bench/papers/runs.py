"""Stored runs of a paper's experiments: as one tidy frame, and one by one."""

import json
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

import datasets
from bench.claims.sides import SETTLED, run_key
from bench.evaluation.record import Run, Trace
from bench.experiments.contestant import contestant
from bench.papers import Asked
from bench.papers.description import Description
from bench.papers.measures import Course, Series, measured
from bench.reporting.failed_runs import with_worst_scores
from bench.store.files import ResultsError
from bench.store.layout import Cell, run_path
from bench.store.loading import as_revised, load_results
from bench.store.results import Results
from bench.store.truth import StoredTruth, read_truth
from datasets.text_form import format_text, parse_text

__all__ = ["OfRun", "StoredRuns", "as_run", "labels_of", "over_frames", "tidy_runs"]

OfRun = Callable[[Course], Mapping[str, float]]
"""What a paper's own `of_run` measures of a run."""

_GENERAL = {"scene": 0, "light": "even"}
"""What is said of sequences that have no such knob."""

_SCORES = ("success_frames", "frames_inside", "first_loss", "mean_overlap")
_CELL = ["tracker", "sequence", "repetition", "protocol"]


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
        matched by) and every parameter, one of the same name as a knob as `tracker.<name>`.

        Of the sequence `name` (canonical), `sequence` (without variant, but with the knobs that
        set it apart), `scene`, `light` and every knob; `kept_scene`, true of all.

        Of the run `trace`, `repetition`, `frames` (length with the given first frame),
        `success_frames` and `frames_inside` (both count the given frame), `first_loss` (frames
        before the loss), `mean_overlap`, the other scores of the results (the worst ones of a
        failed run), and what was measured (NaN for a failed run); `path`, and `failure` (a line
        that names the run and says why it failed; empty for others).

    Raises
    ------
    ResultsError
        Where a run is missing or stale: no verdict is passed on what is left.
    """
    online = _complete(folder, cells)
    revised = as_revised(online) if description.traces else None
    by_trace = {"online": online, "revised": online if revised is None else revised}
    names = zip(online["tracker"], online["sequence"], strict=True)
    known = pd.DataFrame([labels_of(text, name, description.apart) for text, name in names])
    pieces = []
    for trace in description.traces or ("online",):
        runs = with_worst_scores(folder, by_trace[trace].reset_index(drop=True))
        counts = _counts(folder, runs)
        further = runs[[column for column in runs if runs[column].dtype.kind == "f"]]
        further = further.drop(columns=[name for name in further if name in (*counts, *known)])
        measures = _measures(folder, known, counts, trace, description, series, of_run)
        further = further.drop(columns=[name for name in further if name in measures])
        counts = counts.drop(columns=[name for name in counts if name in measures])
        pieces.append(pd.concat([known, counts, further, measures], axis=1).assign(trace=trace))
    return pd.concat(pieces, ignore_index=True).assign(kept_scene=True)


def labels_of(tracker: str, sequence: str, apart: Sequence[str] = ()) -> dict[str, Any]:
    """Columns of `tidy_runs` that say what was run on what, of two text forms.

    The knobs `apart` set a sequence apart.
    """
    of_tracker, knobs = _tracker_labels(tracker), _sequence_labels(sequence, tuple(apart))
    own = {key if key not in knobs else f"tracker.{key}": of_tracker[key] for key in of_tracker}
    return {**own, **knobs}


def as_run(rows: pd.DataFrame, **parameters: Any) -> pd.DataFrame:
    """Runs (of `tidy_runs`) as those of trackers with other parameters, which would be the same.

    The parameters are what else the tracker's text form says, `preset` among them.
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


def _complete(folder: Path, cells: Collection[Cell] | None) -> pd.DataFrame:
    """Runs of an experiment, finished or failed, as `load_results` gives them."""
    runs = load_results(folder, cells)
    lacking = runs[~runs["status"].isin(["finished", "failed"])]
    if len(lacking):
        first = lacking.iloc[0]
        raise ResultsError(
            f"{folder}: {len(lacking)} of {len(runs)} runs are {first['status']}, the first "
            f"{first['tracker']} on {first['sequence']}, repetition {first['repetition']}. "
            "Run `trackmark reproduce` again; `trackmark results list` shows them."
        )
    return runs


def _counts(folder: Path, runs: pd.DataFrame) -> pd.DataFrame:
    """What is known of every run; see `tidy_runs`."""
    scores = {name: runs.get(name, pd.Series(np.nan, runs.index)).to_numpy() for name in _SCORES}
    return pd.DataFrame(
        {
            "repetition": runs["repetition"].to_numpy(),
            "frames": runs["frames"].to_numpy(np.int64),
            "success_frames": scores["success_frames"] + 1,
            "frames_inside": scores["frames_inside"] + 1,
            "first_loss": scores["first_loss"],
            "mean_overlap": scores["mean_overlap"],
            "path": [str(folder / run_path(*cell)) for cell in runs[_CELL].itertuples(index=False)],
            "failure": [_failure(run) for _, run in runs.iterrows()],
        }
    )


def _failure(run: "pd.Series[Any]") -> str:
    if not run["failure"]:
        return ""
    reason = str(run["failure"]).partition("\n")[0]
    return f"{run['tracker']} on {run['sequence']}, repetition {run['repetition']}: {reason}"


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


class StoredRuns:
    """Finished runs that this call asked for, in the folder of all experiments."""

    def __init__(self, results: Path, asked: Asked) -> None:
        self._results, self._asked = results, asked
        self._listed = cache(self._list)

    def of(self, experiment: str, sequence: str, tracker: str) -> list[Run]:
        """Runs of a tracker (text form) on a sequence (canonical name), by their repetitions.

        There are none where none was asked for.
        """
        label = contestant(tracker).label
        runs = self._listed(experiment)
        runs = runs[(runs["tracker"] == label) & (runs["sequence"] == sequence)]
        results = Results(self._results / experiment)
        places = runs.sort_values("repetition")[_CELL]
        return [
            results.read(results.folder / run_path(*place))
            for place in places.itertuples(index=False, name=None)
        ]

    def read(self, path: str) -> Run:
        """A run by its file, as `path` among the scores says."""
        file = Path(path)
        return Results(file.parent.parent.parent).read(file)

    def sequences(self, experiment: str) -> list[str]:
        """Canonical names of the sequences that there are runs on, in the order of the runs."""
        return [str(name) for name in self._listed(experiment)["sequence"].unique()]

    def truth(self, experiment: str, run: Run) -> StoredTruth:
        """Truth that a run was made with."""
        key = run.identity
        return read_truth(self._results / experiment, key.sequence, key.fingerprint)

    def _list(self, experiment: str) -> pd.DataFrame:
        if experiment not in self._asked:
            return pd.DataFrame(columns=_CELL)
        runs = load_results(self._results / experiment, self._asked[experiment])
        return runs[runs["status"] == "finished"]


def over_frames(runs: Mapping[str, list[Run]], *details: str) -> pd.DataFrame:
    """Details of runs by label, a row a frame in which the tracker said something.

    `label`, `repetition`, `frame` and the details.
    """
    pieces = [pd.DataFrame(columns=["label", "repetition", "frame", *details])]
    for label, repetitions in runs.items():
        for run in repetitions:
            columns = {name: run.details[name] for name in details}
            rows = pd.DataFrame({"label": label, "repetition": run.identity.repetition} | columns)
            pieces.append(rows.assign(frame=np.arange(len(rows))).dropna())
    return pd.concat(pieces[1:] or pieces, ignore_index=True)
