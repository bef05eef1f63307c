"""What a cell of a paper's table says of its rows: shares, quartiles, means, counts."""

from collections.abc import Callable, Mapping

import numpy as np
import pandas as pd

from bench.papers.description import Column
from reports.tables import MISSING

__all__ = ["cell_words", "failed_words", "median_quartiles"]


def cell_words(rows: pd.DataFrame, column: Column) -> str:
    """What a column says of the rows of a cell; a dash where there are none."""
    statistic, digits = STATISTICS[column.how]
    if not len(rows):
        return MISSING
    return statistic(rows, column, digits if column.digits is None else column.digits)


def failed_words(runs: pd.DataFrame) -> str:
    """What stands in the place of a figure that a failed run is part of; empty for none."""
    if "failure" not in runs:
        return ""
    failed = int((runs["failure"] != "").sum())
    return f"{MISSING} ({failed} of {len(runs)} failed)" if failed else ""


def median_quartiles(runs: pd.DataFrame, metric: str, scale: float = 1.0, digits: int = 1) -> str:
    """Median [quartiles] over runs."""
    if lacking := failed_words(runs):
        return lacking
    values = scale * runs[metric].dropna()
    if not len(values):
        return MISSING
    low, middle, high = values.quantile([0.25, 0.5, 0.75])
    return f"{middle:.{digits}f} [{low:.{digits}f}–{high:.{digits}f}]"


def _number(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if np.isfinite(value) else MISSING


Told = Callable[[pd.DataFrame, Column, int], str]


def _of_values(reduced: Callable[["pd.Series[float]"], float], *, failing: bool) -> Told:
    """A number of the values; that some runs failed is told in its place where it is `failing`."""

    def told(runs: pd.DataFrame, column: Column, digits: int) -> str:
        lacking = failed_words(runs) if failing else ""
        return lacking or _number(column.scale * reduced(runs[column.of]), digits)

    return told


def _share(runs: pd.DataFrame, column: Column, digits: int) -> str:
    """In %, mean over scenes, of what is known."""
    scenes = [key for key in ("sequence", "scene", "light") if key in runs]
    share = 100 * runs.groupby(scenes)[column.of].mean().mean()
    return failed_words(runs) or _number(share, digits)


def _mean_error(runs: pd.DataFrame, column: Column, digits: int) -> str:
    """Mean±its standard error."""
    values = column.scale * runs[column.of].dropna().to_numpy(np.float64)
    error = values.std(ddof=1) / np.sqrt(len(values))
    return failed_words(runs) or f"{values.mean():.{digits}f}±{error:.{digits}f}"


def _scene_means(runs: pd.DataFrame, column: Column, digits: int) -> str:
    """Mean [quartiles] over scenes, each the mean of its runs."""
    if lacking := failed_words(runs):
        return lacking
    means = column.scale * runs.groupby(["sequence", "scene"])[column.of].mean()
    low, high = (_number(float(means.quantile(q)), digits) for q in (0.25, 0.75))
    return f"{_number(float(means.mean()), digits)} [{low}–{high}]"


def _ratio(runs: pd.DataFrame, column: Column, digits: int) -> str:
    """One measure's sum to another's."""
    whole = runs[column.to].sum()
    return _number(column.scale * runs[column.of].sum() / whole, digits) if whole else MISSING


def _range(runs: pd.DataFrame, column: Column, digits: int) -> str:
    """Mean (least–greatest)."""
    values = column.scale * runs[column.of].dropna()
    low, high = _number(values.min(), 0), _number(values.max(), 0)
    return f"{_number(values.mean(), digits)} ({low}–{high})" if len(values) else MISSING


def _count(runs: pd.DataFrame, column: Column, digits: int) -> str:
    known = runs[column.of].dropna()
    return f"{known.sum():.0f} of {len(known)}" if len(known) else MISSING


STATISTICS: Mapping[str, tuple[Told, int]] = {
    "share": (_share, 0),
    "quartiles": (lambda r, c, digits: median_quartiles(r, c.of, c.scale, digits), 1),
    "mean": (_of_values(pd.Series.mean, failing=True), 2),
    "median": (_of_values(pd.Series.median, failing=True), 1),
    "mean-error": (_mean_error, 2),
    "scene-means": (_scene_means, 3),
    "least": (_of_values(pd.Series.min, failing=False), 1),
    "greatest": (_of_values(pd.Series.max, failing=False), 1),
    "range": (_range, 1),
    "ratio": (_ratio, 2),
    "count": (_count, 0),
    "runs": (lambda runs, *_: str(len(runs)), 0),
    "scenes": (lambda runs, *_: str(runs["scene"].nunique()), 0),
}
"""By name: what is said of the rows of a cell, and its usual number of digits."""
