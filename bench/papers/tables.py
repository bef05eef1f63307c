"""Tables of a paper: of runs, of what was measured besides, as its `[table]` entries say."""

import json
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from bench.claims.sides import Table as Lookup
from bench.claims.sides import light_rows, limited, run_key
from bench.papers.cells import cell_words
from bench.papers.description import Column, Description, Line, TableEntry
from bench.papers.wording import POST_HOC, Wording
from datasets.text_form import format_text, parse_text
from reports.tables import MISSING, Cell, Table

__all__ = [
    "RunTable",
    "beside_ours",
    "make_table",
    "text_table",
]

SCORES = "scores"

LINE_HEADS = ("claim", "quantity")
"""Of the words of a table's lines."""


@dataclass(frozen=True)
class RunTable(Table):
    """A table of what runs scored, with the files of those behind each cell beside the labels."""

    runs: Sequence[Sequence[Collection[str]]] = ()


def text_table(name: str, caption: str, data: Sequence[Mapping[str, str]], n_labels: int) -> Table:
    """A table of texts; the keys of its rows are the heads."""
    heads = list(data[0]) if data else []
    return Table(
        name=name,
        caption=caption,
        heads=heads,
        n_labels=n_labels,
        rows=[[Cell(row.get(head, MISSING)) for head in heads] for row in data],
        data=pd.DataFrame(data),
    )


def make_table(
    name: str,
    entry: TableEntry,
    frames: Mapping[str, pd.DataFrame],
    description: Description,
    lookup: Lookup,
) -> Table | None:
    """A table as its entry (no hook) says; None where there is nothing to put into it.

    `frames` are `scores` and all other tables by name; `lookup` has the scores, too.
    """
    wording = Wording(description)
    runs: list[list[Collection[str]]] = []
    if entry.lines:
        data = list(_lines(entry, frames))
    else:
        rows = frames.get(entry.table)
        if rows is None:
            return None
        if entry.experiments:
            names = "|".join(f",{description.experiment(one)}," for one in entry.experiments)
            rows = rows[rows["experiments"].str.contains(names)]
        if "copied" in rows and not entry.copies:
            rows = rows[~rows["copied"]]
        if entry.trackers:
            rows = rows.loc[[place for place in _of(entry.trackers, lookup) if place in rows.index]]
        rows = limited(rows, entry.where)
        rows = light_rows(rows, _needed(entry))
        made = list(_rows(rows, entry, wording, lookup))
        data, runs = [told for told, _ in made], [files for _, files in made]
    if not data:
        return None
    labels = [*entry.rows] if not entry.vary else ["tracker", "parameter", "value"]
    n_labels = max(len(line.words) for line in entry.lines) if entry.lines else len(labels)
    table = text_table(name, entry.caption, data, n_labels)
    heads = [entry.heads.get(head, head) for head in table.heads]
    return RunTable(**{**vars(table), "heads": heads, "notes": list(entry.notes)}, runs=runs)


def _needed(entry: TableEntry) -> set[str]:
    """Columns that a table is made of."""
    columns = [*entry.columns, *([entry.across] if entry.across else [])]
    named = {*entry.rows, *(name for one in columns for name in (one.of, one.to))}
    named |= {key for one in columns for key in one.where}
    named |= {entry.across.head} if entry.across else set()
    return named | {"text", "tracker", "settled", "sequence", "scene", "light", "failure", "path"}


def _of(trackers: Sequence[str], lookup: Lookup) -> pd.Index:
    """Rows of runs of these trackers, with what is usual on each sequence."""
    found = pd.Index([])
    for text in trackers:
        tracker, parameters = parse_text(text)
        sequences = lookup.rows["sequence"].unique()
        for told in _swept(tracker, parameters, lookup.rows):
            found = found.append(lookup.index(tracker, told, sequences))
    return found.unique()


def _swept(
    tracker: str, parameters: Mapping[str, str], rows: pd.DataFrame
) -> Iterator[dict[str, Any]]:
    """Parameters, and in place of `*` every value that there are runs with."""
    free = [key for key, value in parameters.items() if value == "*"]
    if not free:
        yield {**parameters}
        return
    for values in rows.loc[rows["tracker"] == tracker, free].drop_duplicates().to_numpy():
        yield {**parameters, **dict(zip(free, map(_plain, values), strict=True))}


def _rows(
    rows: pd.DataFrame, entry: TableEntry, wording: Wording, lookup: Lookup
) -> Iterator[tuple[dict[str, str], list[Collection[str]]]]:
    """Rows of a table of runs, or of another table's rows, told apart by labels.

    Beside each the files of the runs behind its cells; none behind those of another table.
    """
    if entry.vary is not None:
        groups = _varied(rows, entry, wording, lookup)
    else:
        groups = _told_apart(rows, entry, wording)
    columns = list(entry.columns)
    across = entry.across
    if across is not None:
        values = rows[across.head].dropna().unique()
        numbers = pd.api.types.is_numeric_dtype(values)
        columns += [
            across.model_copy(
                update={
                    "head": f"{value:g}" if numbers else wording.of(value),
                    "where": {across.head: [value]},
                }
            )
            for value in (sorted(values) if numbers else values)
        ]
    for labels, group in groups:
        behind = {column.head: limited(group, column.where) for column in columns}
        cells = {one.head: cell_words(behind[one.head], one) for one in columns}
        if set(cells.values()) != {MISSING}:
            yield (
                labels | cells,
                [set(here["path"]) if "path" in here else () for here in behind.values()],
            )


def _told_apart(
    rows: pd.DataFrame, entry: TableEntry, wording: Wording
) -> Iterator[tuple[dict[str, str], pd.DataFrame]]:
    """Groups of rows with equal labels, in the order in which these appear."""
    elsewhere = [*entry.rows, *([entry.across.head] if entry.across else [])]
    settings = {
        text: wording.setting(text, elsewhere)
        for text in (rows["text"].unique() if "setting" in entry.rows else ())
    }
    labels = pd.DataFrame(
        {
            label: [settings[text] for text in rows["text"]]
            if label == "setting"
            else [wording.of(_plain(value)) for value in rows[label]]
            for label in entry.rows
        },
        index=rows.index,
    )
    for _, here in labels.groupby(list(entry.rows), sort=False):
        yield dict(zip(entry.rows, here.iloc[0], strict=True)), rows.loc[here.index]


def _plain(value: Any) -> Any:
    """A number as short as it can be: 60 for 60.0."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _varied(
    rows: pd.DataFrame, entry: TableEntry, wording: Wording, lookup: Lookup
) -> Iterator[tuple[dict[str, str], pd.DataFrame]]:
    """Runs as a tracker's text form says, and those with one parameter otherwise."""
    vary = entry.vary
    assert vary is not None
    for base in vary.base:
        changed = _changes(rows, base, lookup)
        for parameter in ("", *vary.parameters):
            values = {value for key, value in changed.values() if key == parameter}
            for value in sorted(values, key=_by_size):
                here = [k for k, one in changed.items() if one == (parameter, value)]
                keys = pd.MultiIndex.from_frame(rows[["settled", "sequence"]])
                name, _ = parse_text(base)
                told = wording.setting(base, ["preset"])
                labels = {
                    "tracker": wording.of(name) + (f", {told}" if told != MISSING else ""),
                    "parameter": wording.of(parameter) if parameter else "as written",
                    "value": value + _marked(wording, name, parameter, value),
                }
                yield labels, rows[keys.isin(here)]


def _marked(wording: Wording, name: str, parameter: str, value: str) -> str:
    told = (
        wording.setting(f"{name}:{parameter}={value}", ["preset"])
        if parameter.isidentifier()
        else ""
    )
    return POST_HOC if told.endswith(POST_HOC) else ""


def _changes(
    rows: pd.DataFrame, base: str, lookup: Lookup
) -> dict[tuple[str, str], tuple[str, str]]:
    """The one parameter that is otherwise, and its value, by key and sequence of runs."""
    tracker, parameters = parse_text(base)
    found = {}
    here = rows[rows["tracker"] == tracker]
    for key, sequence in set(zip(here["settled"], here["sequence"], strict=True)):
        usual = lookup.readings.usual.get(sequence, {}).get(tracker, {})
        _, settled, _ = json.loads(run_key(format_text(tracker, {**usual, **parameters})))
        _, other, _ = json.loads(key)
        changed = {k: v for k, v in other.items() if settled[k] != v}
        if len({str(value) for value in changed.values()}) < 2:
            value = next(iter(changed.values()), "")
            found[key, sequence] = (
                " = ".join(changed),
                format_text("", {"": value}).rpartition("=")[2] if changed else "",
            )
    return found


def _by_size(value: str) -> tuple[float, str]:
    """Numbers by size, before words."""
    try:
        return float(value), ""
    except ValueError:
        return float("inf"), value


def _lines(entry: TableEntry, frames: Mapping[str, pd.DataFrame]) -> Iterator[dict[str, str]]:
    """Rows that are each of a table of its own."""
    for line in entry.lines:
        table = frames.get(line.table)
        if table is None:
            continue
        chosen = limited(table, line.where)
        groups: Any = [((), chosen)]
        if line.each:
            groups = chosen.groupby(list(line.each), sort=False)
        for values, rows in groups:
            told = [word.format(*map(_plain, values)) for word in line.words]
            labels = dict(zip(LINE_HEADS[-len(told) :], told, strict=True))
            yield labels | {column.head: _line_cell(rows, line, column) for column in entry.columns}


def _line_cell(rows: pd.DataFrame, line: Line, column: Column) -> str:
    told = {"of": line.of, "scale": line.scale, "digits": line.digits}
    known = rows.dropna(subset=[line.of])
    return cell_words(limited(known, column.where), column.model_copy(update=told))


def beside_ours(name: str, rows: Sequence[Mapping[str, Any]]) -> Table:
    """Published numbers with ours beside them, a row a number; see `bench.papers.Report.rows`.

    What is of one kind stands together.
    """
    kinds = list(dict.fromkeys((row["table"], row["column"]) for row in rows))
    data = [
        {
            "number": row["column"],
            "of": row["label"],
            "paper": _number(row["published"]),
            "ours": _with_interval(row),
        }
        for row in sorted(rows, key=lambda row: kinds.index((row["table"], row["column"])))
    ]
    return text_table(name, "The paper's numbers, and ours [interval or quartiles]", data, 2)


def _with_interval(row: Mapping[str, Any]) -> str:
    interval = row.get("interval")
    told = f" [{_number(interval[0])}–{_number(interval[1])}]" if interval else ""
    return _number(row.get("measured")) + told


def _number(value: float | None) -> str:
    if value is None or not np.isfinite(value):
        return MISSING
    return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.3g}"
