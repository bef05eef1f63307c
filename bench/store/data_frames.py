"""Stored results as a data frame: requested and stored runs together."""

from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trackmark.bench.evaluation.scoring import REVISED
from trackmark.bench.store.layout import RUN_KEY_COLUMNS, RunKey, experiment_folders, run_key
from trackmark.bench.store.manifest import Manifest
from trackmark.bench.store.results import Results
from trackmark.bench.store.run_rows import NUMBERS, TEXTS, list_scored_runs

if TYPE_CHECKING:
    import pandas as pd


def load_results(folder: str | Path, cells: Collection[RunKey] | None = None) -> "pd.DataFrame":
    """All runs of an experiment, or of all experiments in a folder.

    Parameters
    ----------
    folder : str or Path
        `results/<experiment>` or `results`.
    cells : collection of RunKey, optional
        Selected runs, as (tracker, sequence, repetition, protocol); all by default.

    Returns
    -------
    DataFrame
        One row per run: `experiment`, the fields of `bench.store.run_rows.list_runs` (texts as
        categories), and one float column per score, in the order of the requests. Requested runs
        that are not stored come last and have the status `missing`. Runs of another version of the
        tracker or sequence than the requested one have the status `stale`.

    Raises
    ------
    ResultsError
        If there are no results, or a file is damaged.
    """
    chosen = None if cells is None else set(cells)
    rows: list[dict[str, Any]] = []
    for path in experiment_folders(Path(folder)):
        rows += [
            {"experiment": path.name, **row}
            for row in _with_manifest(Results(path))
            if chosen is None or run_key(row) in chosen
        ]
    return to_data_frame(rows)


def to_data_frame(rows: Iterable[Mapping[str, Any]]) -> "pd.DataFrame":
    """Return rows of `list_scored_runs`, possibly with further texts, as a data frame."""
    import pandas as pd

    rows = list(rows)
    columns: dict[str, Any] = {}
    further = dict.fromkeys(name for row in rows for name in row if name not in _FIELDS)
    for name in (*further, *TEXTS):
        values = [row.get(name) for row in rows]
        stored = {str(row[name]) for row in rows if row["status"] != "missing"}
        ordered = dict.fromkeys([*sorted(stored), *values])
        columns[name] = pd.Categorical(values, [v for v in ordered if v is not None])
    missing = any(row["status"] == "missing" for row in rows)
    kinds: dict[str, Any] = dict.fromkeys(NUMBERS, "float64") | {"repetition": "int32"}
    kinds["frames"] = "float64" if missing else "int32"
    for name in NUMBERS:
        columns[name] = pd.Series([row.get(name) for row in rows], dtype=kinds[name])
    for name in dict.fromkeys(name for row in rows for name in row.get("scores", ())):
        scores = [row.get("scores", {}).get(name) for row in rows]
        columns[name] = pd.Series(scores, dtype="float64")
    return pd.DataFrame(columns)


_FIELDS = {*TEXTS, *NUMBERS, "scores"}


def with_revised_scores(runs: "pd.DataFrame") -> "pd.DataFrame | None":
    """Return the runs with the scores of their revised boxes; None if no run has revised boxes.

    `runs`: of `load_results`. Runs without revised boxes keep the scores of their online boxes.
    """
    beside = [name for name in runs if str(name).startswith(REVISED)]
    if not runs[beside].notna().any(axis=None):
        return None
    names = [str(name).removeprefix(REVISED) for name in beside]
    revised = runs[beside].set_axis(names, axis=1)
    return runs.assign(**revised.where(revised.notna(), runs[names]))


def ordered_rows(results: Results, **only: str) -> list[dict[str, Any]]:
    """Return the rows of stored runs with scores, in the order of `load_results`.

    `results`: of an experiment. `only`: required values of fields.
    """
    return [
        row
        for row in _with_manifest(results)
        if row["status"] != "missing" and all(row[name] == text for name, text in only.items())
    ]


def _with_manifest(results: Results) -> list[dict[str, Any]]:
    """Return stored rows in the order of the requests, then other stored, then missing ones."""
    return with_manifest(list_scored_runs(results), results.manifest())


def with_manifest(rows: Iterable[dict[str, Any]], manifest: Manifest) -> list[dict[str, Any]]:
    """Return rows in the order of `load_results`, with the missing runs and stale ones marked."""
    stored = {run_key(row): row for row in rows}
    found = []
    for cell, version in manifest.versions.items():
        if row := stored.get(cell):
            found.append(row if row["version"] == version else {**row, "status": "stale"})
    found += [row for cell, row in stored.items() if cell not in manifest.versions]
    missing = [cell for cell in manifest.versions if cell not in stored]
    ended = {"status": "missing", "failure": ""}
    return [
        *found,
        *({**dict(zip(RUN_KEY_COLUMNS, cell, strict=True)), **ended} for cell in missing),
    ]
