"""Scores against attributes of the sequences: numbers in, curves out.

A sequence is one observation: its score, and one value of the attribute. Frames are none, as a
target that was lost once stays lost, whatever the pictures are like then.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import isfinite
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from bench.statistics.correlation import rank_correlation
from bench.statistics.intervals import Interval
from bench.statistics.rules import MIN_UNITS, corrected_level
from reports.tables import MISSING, Cell, Measure, Table

__all__ = ["Bin", "Curve", "against", "attribute_table", "bins_of"]

MOST_BINS = 5
"""However many sequences there are: more would be a line that nobody can read."""


@dataclass(frozen=True)
class Bin:
    """Sequences whose values of an attribute are neighbours."""

    first: float  # least value of the attribute
    last: float
    centre: float  # its mean
    scores: NDArray[np.float64]  # of these sequences
    interval: Interval | None  # 95 %, of their mean

    @property
    def mean(self) -> float:
        """Mean score."""
        return float(self.scores.mean())


@dataclass(frozen=True)
class Curve:
    """Scores of a tracker against an attribute, on the n sequences that have it, (n,).

    `correlation` is Spearman's, NaN where scores or attribute are all the same; `interval` is at
    level 1 - 0.05 / m, corrected for all m curves that are looked at together.
    """

    label: str
    attribute: str
    places: NDArray[np.float64]  # values of the attribute
    scores: NDArray[np.float64]
    correlation: float
    interval: Interval
    bins: Sequence[Bin]  # in the order of the attribute; none where there are too few sequences


def against(
    values: Mapping[str, ArrayLike],
    attributes: Mapping[str, ArrayLike],
    interval: Callable[[ArrayLike], Interval | None],
) -> list[Curve]:
    """Every row of values against every attribute that two sequences have or more.

    Parameters
    ----------
    values : mapping of str to array of float, shape (n,)
        Scores by sequence, or differences of them, by label.
    attributes : mapping of str to array of float, shape (n,)
        Values by sequence, NaN where a sequence has none, by name.
    interval : callable
        Gives that of the mean of some values.
    """
    pairs = [
        (label, name, np.asarray(scores, np.float64), np.asarray(places, np.float64))
        for label, scores in values.items()
        for name, places in attributes.items()
        if np.isfinite(places).sum() > 1
    ]
    confidence = corrected_level(len(pairs))
    return [_curve(*pair, interval, confidence) for pair in pairs]


def bins_of(places: ArrayLike) -> list[NDArray[np.intp]]:
    """Numbers of sequences in bins of about as many, in the order of their values, (n,) finite.

    As many bins as have `MIN_UNITS` sequences each, five at most; equal values are never set apart.
    None where there would be one alone.
    """
    given = np.asarray(places, np.float64)
    order = np.argsort(given, kind="stable")
    ranked, n = given[order], len(given)
    count = min(MOST_BINS, n // MIN_UNITS)
    cuts = [0]
    for number in range(1, count):
        cut = int(np.searchsorted(ranked, ranked[number * n // count]))
        if min(cut - cuts[-1], n - cut) >= MIN_UNITS:
            cuts.append(cut)
    found = [order[first:last] for first, last in pairwise([*cuts, n])]
    return found if len(found) > 1 else []


def attribute_table(curves: Sequence[Curve], measure: Measure, name: str = "attributes") -> Table:
    """Return a table of the curves: rank correlation, and the means of the outermost bins.

    `name`: of the table's files. The data have a row per bin; a curve without bins has one row.
    """
    rows = []
    data: list[dict[str, Any]] = []
    for curve in curves:
        rows.append(
            [
                Cell(curve.label),
                Cell(curve.attribute),
                Cell(str(len(curve.places))),
                Cell(f"{curve.correlation:+.2f}" if isfinite(curve.correlation) else MISSING),
                Cell(
                    "[{:+.2f}, {:+.2f}]".format(*curve.interval),
                    best=curve.interval.low > 0 or curve.interval.high < 0,
                ),
                *map(Cell, _ends(curve, measure)),
            ]
        )
        data += _rows(curve)
    few = [curve for curve in curves if not curve.bins]
    notes = ["There is nothing to show: it takes two sequences with scores."] * (not curves)
    notes += [
        f"Intervals of correlations are corrected for all {len(curves)} rows (Bonferroni) and hold "
        "together at 95 %; * or bold: the interval excludes 0.",
        "Lowest and highest: means over the sequences with least and most of the attribute.",
    ]
    if few:
        notes.append(
            f"Without curve: {len(few)} of {len(curves)} rows. It takes two bins of "
            f"{MIN_UNITS} sequences with different values."
        )
    return Table(
        name=name,
        caption=(
            f"{measure.head} against attributes of the sequences (docs/attributes.md): rank "
            f"correlation of scores and attribute over n sequences, with its interval."
        ),
        heads=["tracker", "attribute", "n", "correlation", "interval", "lowest", "highest"],
        n_labels=2,
        rows=rows,
        notes=notes,
        data=pd.DataFrame(data),
        ranks=[2, 0, 0, 1, 1],
    )


def _curve(
    label: str,
    name: str,
    scores: NDArray[np.float64],
    places: NDArray[np.float64],
    interval: Callable[[ArrayLike], Interval | None],
    confidence: float,
) -> Curve:
    known = np.isfinite(scores) & np.isfinite(places)
    scores, places = scores[known], places[known]
    correlation, around = rank_correlation(places, scores, confidence)
    bins = [
        Bin(
            float(places[chosen].min()),
            float(places[chosen].max()),
            float(places[chosen].mean()),
            scores[chosen],
            interval(scores[chosen]),
        )
        for chosen in bins_of(places)
    ]
    return Curve(label, name, places, scores, correlation, around, bins)


def _rows(curve: Curve) -> list[dict[str, Any]]:
    told = {
        "tracker": curve.label,
        "attribute": curve.attribute,
        "sequences": len(curve.places),
        "correlation": curve.correlation,
        "low": curve.interval.low,
        "high": curve.interval.high,
    }
    bins: list[dict[str, Any]] = [
        {
            "bin": number,
            "bin_from": one.first,
            "bin_to": one.last,
            "bin_sequences": len(one.scores),
            "bin_mean": one.mean,
            "bin_low": one.interval and one.interval.low,
            "bin_high": one.interval and one.interval.high,
        }
        for number, one in enumerate(curve.bins, 1)
    ]
    return [{**told, **one} for one in bins] or [told]


def _ends(curve: Curve, measure: Measure) -> tuple[str, str]:
    """Means of the lowest and of the highest bin, and where these end."""
    if not curve.bins:
        return MISSING, MISSING
    low, high = (
        f"{one.mean * measure.scale:.{measure.decimals}f}"
        for one in (curve.bins[0], curve.bins[-1])
    )
    return f"{low} (≤ {curve.bins[0].last:.2g})", f"{high} (≥ {curve.bins[-1].first:.2g})"
