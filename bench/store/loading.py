"""Stored results as a data frame: what was asked for and what is there, put side by side."""

from collections.abc import Collection, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
from pyarrow import compute

from trackmark.bench.evaluation.scoring import REVISED
from trackmark.bench.store.asked import Asked, Cells
from trackmark.bench.store.columns import CELL, coded, codes, numbered, places
from trackmark.bench.store.index import index_rows, read_table
from trackmark.bench.store.layout import Cell, experiment_folders
from trackmark.bench.store.results import Results

if TYPE_CHECKING:
    import pandas as pd


def load_results(folder: str | Path, cells: Collection[Cell] | None = None) -> "pd.DataFrame":
    """All runs of an experiment, or of all experiments in a folder.

    Parameters
    ----------
    folder : str or Path
        `results/<experiment>` or `results`.
    cells : collection of Cell, optional
        Runs that are meant, as (tracker, sequence, repetition, protocol); all by default.

    Returns
    -------
    DataFrame
        One row a run: `experiment`, what `bench.store.index.read_table` gives of it (text as
        categories), and one float column a score, in the order in which the runs were last
        asked for. Runs that were asked for and are not there come last and have the status
        `missing`; those made with another version of tracker or sequence than was asked for
        last have the status `stale`. `bench.store.layout.run_path` tells where a run lies.

    Raises
    ------
    ResultsError
        Where there are no results, or a file is damaged.
    """
    chosen = None
    if cells is not None:
        chosen = cells if isinstance(cells, Cells) else Cells.of(dict.fromkeys(cells, ""))
    pieces = []
    for path in experiment_folders(Path(folder)):
        table = with_asked(read_table(results := Results(path)), results.asked())
        if chosen is not None:
            there, wanted = numbered([table, chosen.table], CELL)
            table = table.filter(pa.array(np.isin(there, wanted)))
        name = coded([path.name], np.zeros(len(table)))
        pieces.append(table.drop_columns(["size", "mtime"]).add_column(0, "experiment", name))
    table = pa.concat_tables(pieces, promote_options="default").unify_dictionaries()
    pieces.clear()  # what is turned into a frame need not stay beside it
    frame: pd.DataFrame = table.to_pandas(split_blocks=True, self_destruct=True)
    return frame


def as_revised(runs: "pd.DataFrame") -> "pd.DataFrame | None":
    """The same runs with the scores of their revised boxes, where they have any.

    `runs`: as `load_results` gives them: scores of online boxes, those of revised ones beside them.

    None where no tracker revised anything: there is only one trace then.
    """
    beside = [name for name in runs if str(name).startswith(REVISED)]
    if not runs[beside].notna().any(axis=None):
        return None
    names = [str(name).removeprefix(REVISED) for name in beside]
    revised = runs[beside].set_axis(names, axis=1)
    return runs.assign(**revised.where(revised.notna(), runs[names]))


def with_asked(index: pa.Table, asked: Asked) -> pa.Table:
    """An index in the order in which the runs were last asked for, and what it lacks.

    Stale runs are marked as such, others that nobody asked for come after those that
    somebody did, and missing ones last; see `load_results`.
    """
    rows, wanted = numbered([index, asked.table], CELL)
    place = places(rows, wanted)
    known = place >= 0
    _, (made, planned) = codes(index["version"], asked.table["version"])
    stale = np.zeros(len(index), bool)
    stale[known] = made[known] != planned[place[known]]
    names, (status,) = codes(index["status"])
    marked = coded([*names.to_pylist(), "stale"], np.where(stale, len(names), status))
    index = index.set_column(index.schema.get_field_index("status"), "status", marked)
    index = index.take(pa.array(np.argsort(np.where(known, place, len(wanted)), kind="stable")))
    missing = asked.table.filter(pa.array(places(wanted, rows) < 0)).select(CELL)
    for column, text in (("status", "missing"), ("failure", "")):
        missing = missing.append_column(column, coded([text], np.zeros(len(missing))))
    whole = pa.concat_tables([index, missing], promote_options="default")
    return whole.unify_dictionaries().combine_chunks()


def ordered_rows(results: Results, **only: str) -> Iterator[dict[str, Any]]:
    """Rows of runs that are there, one by one, in the order of `load_results`.

    `results`: of an experiment. `only`: what their columns of text must say.
    """
    table = with_asked(read_table(results), results.asked())
    table = table.filter(compute.not_equal(table["status"], "missing"))
    for column, text in only.items():
        table = table.filter(compute.equal(table[column], text))
    return index_rows(table)
