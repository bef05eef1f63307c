"""What a cell of a paper's table says of its rows: shares, quartiles, means, counts."""

from collections.abc import Callable, Mapping

import numpy as np
import pandas as pd

from bench.papers.description import Column
from reports.tables import MISSING

__all__ = ["STATISTICS", "failed_words", "median_quartiles", "number_words", "share_words"]


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
    low, middle, high = (values.quantile(q) for q in (0.25, 0.5, 0.75))
    return f"{middle:.{digits}f} [{low:.{digits}f}–{high:.{digits}f}]"


def share_words(runs: pd.DataFrame, metric: str, digits: int = 0) -> str:
    """In %, mean over scenes, of what is known."""
    if lacking := failed_words(runs):
        return lacking
    scenes = [key for key in ("sequence", "scene", "light") if key in runs]
    return number_words(100 * runs.groupby(scenes)[metric].mean().mean(), digits)


def number_words(value: float, digits: int) -> str:
    """A number, or a dash for what is not known."""
    return f"{value:.{digits}f}" if np.isfinite(value) else MISSING


def _mean(runs: pd.DataFrame, column: Column, digits: int) -> str:
    return failed_words(runs) or number_words(column.scale * runs[column.of].mean(), digits)


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
    low, high = (number_words(float(means.quantile(q)), digits) for q in (0.25, 0.75))
    return f"{number_words(float(means.mean()), digits)} [{low}–{high}]"


def _median(runs: pd.DataFrame, column: Column, digits: int) -> str:
    return failed_words(runs) or number_words(column.scale * runs[column.of].median(), digits)


def _least(runs: pd.DataFrame, column: Column, digits: int) -> str:
    return number_words(column.scale * runs[column.of].min(), digits)


def _greatest(runs: pd.DataFrame, column: Column, digits: int) -> str:
    return number_words(column.scale * runs[column.of].max(), digits)


def _ratio(runs: pd.DataFrame, column: Column, digits: int) -> str:
    """One measure's sum to another's."""
    whole = runs[column.to].sum()
    return number_words(column.scale * runs[column.of].sum() / whole, digits) if whole else MISSING


def _range(runs: pd.DataFrame, column: Column, digits: int) -> str:
    """Mean (least–greatest)."""
    values = column.scale * runs[column.of].dropna()
    if not len(values):
        return MISSING
    low, high = number_words(values.min(), 0), number_words(values.max(), 0)
    return f"{number_words(values.mean(), digits)} ({low}–{high})"


def _count(runs: pd.DataFrame, column: Column, digits: int) -> str:
    known = runs[column.of].dropna()
    return f"{known.sum():.0f} of {len(known)}" if len(known) else MISSING


STATISTICS: Mapping[str, tuple[Callable[[pd.DataFrame, Column, int], str], int]] = {
    "share": (lambda runs, column, digits: share_words(runs, column.of, digits), 0),
    "quartiles": (lambda r, c, digits: median_quartiles(r, c.of, c.scale, digits), 1),
    "mean": (_mean, 2),
    "median": (_median, 1),
    "mean-error": (_mean_error, 2),
    "scene-means": (_scene_means, 3),
    "least": (_least, 1),
    "greatest": (_greatest, 1),
    "range": (_range, 1),
    "ratio": (_ratio, 2),
    "count": (_count, 0),
    "runs": (lambda runs, *_: str(len(runs)), 0),
    "scenes": (lambda runs, *_: str(runs["scene"].nunique()), 0),
}
"""By name: what is said of the rows of a cell, and its usual number of digits."""
