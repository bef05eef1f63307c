"""Data frame of the requested and stored runs of experiments."""

from collections.abc import Iterable, Mapping
from operator import itemgetter
from typing import TYPE_CHECKING, Any

from trackmark.bench.store.keys import RUN_KEY_COLUMNS, RunKey, run_key
from trackmark.bench.store.run_rows import NUMBER_FIELDS, TEXT_FIELDS

if TYPE_CHECKING:
    import pandas as pd


def to_data_frame(rows: Iterable[Mapping[str, Any]]) -> "pd.DataFrame":
    """Convert rows of `StoredRuns`, which may have further text fields, to a data frame."""
    import pandas as pd

    rows = list(rows)
    columns: dict[str, Any] = {}
    further = dict.fromkeys(name for row in rows for name in row if name not in _FIELDS)
    for name in (*further, *TEXT_FIELDS):
        # No categories: pandas cannot reindex groups of more than 127 categories. Objects share
        # equal texts; the type `str` copies them.
        columns[name] = pd.Series([row.get(name) for row in rows], dtype=object)
    missing = any(row["status"] == "missing" for row in rows)
    kinds: dict[str, Any] = dict.fromkeys(NUMBER_FIELDS, "float64") | {"repetition": "int32"}
    kinds["frames"] = "float64" if missing else "int32"
    for name in NUMBER_FIELDS:
        columns[name] = pd.Series([row.get(name) for row in rows], dtype=kinds[name])
    for name in dict.fromkeys(name for row in rows for name in row.get("scores", ())):
        scores = [row.get("scores", {}).get(name) for row in rows]
        columns[name] = pd.Series(scores, dtype="float64")
    return pd.DataFrame(columns)


_FIELDS = {*TEXT_FIELDS, *NUMBER_FIELDS, "scores"}


def with_one_version(rows: Iterable[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return rows in which each tracker and each sequence has runs of one version only.

    The version of the run that was stored last counts. Runs of another version of their tracker or
    sequence have the status `stale`: if only a part of the runs was repeated after an edit, scores
    of both versions must not be averaged or compared.
    """
    rows = list(rows)
    by_date = sorted((row for row in rows if row["status"] != "missing"), key=itemgetter("date"))
    trackers = {row["tracker"]: row["tracker_version"] for row in by_date}  # the last one remains
    sequences = {row["sequence"]: row["fingerprint"] for row in by_date}
    return [
        row
        if row["status"] == "missing"
        or (trackers[row["tracker"]], sequences[row["sequence"]])
        == (row["tracker_version"], row["fingerprint"])
        else {**row, "status": "stale"}
        for row in rows
    ]


def with_missing(
    rows: Iterable[dict[str, Any]], requested: Mapping[RunKey, str]
) -> list[dict[str, Any]]:
    """Return rows of requested stored runs, of other stored runs, and of missing runs, in order.

    The status of a missing run is `missing`. The status of a stored run is `stale` if another
    version is requested.
    """
    row_of_key = {run_key(row): row for row in rows}
    ordered = []
    for key, version in requested.items():
        if row := row_of_key.get(key):
            ordered.append(row if row["version"] == version else {**row, "status": "stale"})
    ordered += [row for key, row in row_of_key.items() if key not in requested]
    for key in requested:
        if key not in row_of_key:
            fields = dict(zip(RUN_KEY_COLUMNS, key, strict=True))
            ordered.append({**fields, "status": "missing", "failure": ""})
    return ordered
