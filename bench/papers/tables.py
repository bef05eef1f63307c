"""What the tables of every paper have in common: figures of runs in words, and what failed."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from reports.tables import MISSING, Cell, Table

__all__ = ["failed_words", "median_quartiles", "number_words", "share_words", "text_table"]


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


def failed_words(runs: pd.DataFrame) -> str:
    """What stands in the place of a figure that a failed run is part of; empty for none.

    Parameters
    ----------
    runs : DataFrame
        A row a run, with `failure`, as all here.
    """
    failed = int((runs["failure"] != "").sum())
    return f"{MISSING} ({failed} of {len(runs)} failed)" if failed else ""


def median_quartiles(runs: pd.DataFrame, metric: str, scale: float = 1.0, digits: int = 1) -> str:
    """Median [quartiles] over runs."""
    if lacking := failed_words(runs):
        return lacking
    values = scale * runs[metric].dropna()
    if not len(values):
        return MISSING
    low, middle, high = (values.quantile(q) for q in (0.25, 0.5, 0.75))
    return f"{middle:.{digits}f} [{low:.{digits}f}–{high:.{digits}f}]"


def share_words(runs: pd.DataFrame, metric: str) -> str:
    """In %, mean over scenes, of what is known."""
    if lacking := failed_words(runs):
        return lacking
    return number_words(100 * runs.groupby(["scene", "light"])[metric].mean().mean(), 0)


def number_words(value: float, digits: int) -> str:
    """A number, or a dash for what is not known."""
    return f"{value:.{digits}f}" if np.isfinite(value) else MISSING
