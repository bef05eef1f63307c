"""Scores, or differences of scores, by attributes of the sequences: bins, correlations, a table.

A sequence is one observation: its score and one value of the attribute. Frames are not
observations, because a lost target stays lost regardless of later frames.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import inf, isfinite
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from bench.statistics.correlation import rank_correlation
from bench.statistics.intervals import Interval, mean_interval
from bench.statistics.rules import MIN_UNITS, corrected_level
from reports.tables import MISSING, Cell, Measure, Table

MOST_BINS = 5
"""Maximum number of bins. A line with more points is hard to read."""

_BIN_COLUMNS = ("bin_from", "bin_to", "bin_sequences", "bin_mean", "bin_low", "bin_high")


class Bin(NamedTuple):
    """Sequences with neighbouring values of an attribute."""

    first: float  # lowest value of the attribute
    last: float  # highest value
    sequences: int
    mean: float  # of the scores
    low: float  # of the 95 % interval of this mean
    high: float
    centre: float  # mean of the attribute


@dataclass(frozen=True)
class Curve:
    """Scores of a tracker, or differences of two, by an attribute; (n,) sequences that have it.

    `correlation` is Spearman's, NaN if all scores or all attributes are equal. `interval` is at
    level 1 - 0.05 / m, corrected for all m curves that are shown together.
    """

    label: str
    attribute: str
    places: NDArray[np.float64]  # values of the attribute
    scores: NDArray[np.float64]
    correlation: float
    interval: Interval
    bins: Sequence[Bin]  # in the order of the attribute; empty if there are too few sequences


def against(
    values: Mapping[str, ArrayLike],
    attributes: Mapping[str, ArrayLike],
    least: float = -inf,
    most: float = inf,
) -> list[Curve]:
    """Return curves of all values by every attribute that at least two sequences have.

    `values`: scores or differences by sequence, (n,), by label; they lie from `least` to `most`.
    `attributes`: values by sequence, (n,), by name; NaN if a sequence does not have it.
    """
    pairs = [
        (label, name, np.asarray(scores, np.float64), np.asarray(places, np.float64))
        for label, scores in values.items()
        for name, places in attributes.items()
        if np.isfinite(places).sum() > 1
    ]
    level = corrected_level(len(pairs))
    curves = []
    for label, name, scores, places in pairs:
        finite = np.isfinite(scores) & np.isfinite(places)
        scores, places = scores[finite], places[finite]
        correlation, interval = rank_correlation(places, scores, level)
        bins = []
        for members in bins_of(places):
            x, y = places[members], scores[members]
            ends = mean_interval(y).within(least, most)
            extent = float(x.min()), float(x.max()), len(x)
            bins.append(Bin(*extent, float(y.mean()), *ends, centre=float(x.mean())))
        curves.append(Curve(label, name, places, scores, correlation, interval, bins))
    return curves


def bins_of(places: ArrayLike) -> list[NDArray[np.intp]]:
    """Return indices of sequences in bins of similar size, in the order of their values, (n,).

    There are as many bins as have `MIN_UNITS` sequences each, at most five, and none instead of a
    single one. Equal values share a bin.
    """
    values = np.asarray(places, np.float64)
    order = np.argsort(values, kind="stable")
    ranked, n = values[order], len(values)
    count = min(MOST_BINS, n // MIN_UNITS)
    cuts = [0]
    for number in range(1, count):
        cut = int(np.searchsorted(ranked, ranked[number * n // count]))
        if min(cut - cuts[-1], n - cut) >= MIN_UNITS:
            cuts.append(cut)
    bins = [order[first:last] for first, last in pairwise([*cuts, n])]
    return bins if len(bins) > 1 else []


def attribute_table(
    curves: Sequence[Curve], measure: Measure, what: str, name: str = "attributes"
) -> Table:
    """Make a table of curves: correlations, and the means of the lowest and the highest bin.

    `what`: kind of the labels, `tracker` or `pair`. `name`: of the table's files. Its data have
    one row per bin, or one row without bin.
    """
    sign, scores = ("+", "differences") if what == "pair" else ("", "scores")
    rows = []
    for curve in curves:
        low, high = curve.interval
        correlation = f"{curve.correlation:+.2f}" if isfinite(curve.correlation) else MISSING
        labels = curve.label, curve.attribute, str(len(curve.places)), correlation
        interval = Cell(f"[{low:+.2f}, {high:+.2f}]", best=low > 0 or high < 0)
        rows.append([*map(Cell, labels), interval, *map(Cell, _ends(curve, measure, sign))])
    few = sum(not curve.bins for curve in curves)
    notes = ["There is nothing to show: it takes two sequences with scores."] * (not curves)
    notes += [
        f"Intervals of correlations are corrected for all {len(curves)} rows (Bonferroni) and hold "
        "together at 95 %; * or bold: the interval excludes 0.",
        "Lowest and highest: means over the sequences with least and most of the attribute.",
    ]
    if few:
        notes.append(
            f"Without curve: {few} of {len(curves)} rows. It takes two bins of "
            f"{MIN_UNITS} sequences with different values."
        )
    return Table(
        name=name,
        caption=(
            f"{measure.head} against attributes of the sequences (docs/attributes.md): rank "
            f"correlation of {scores} and attribute over n sequences, with its interval."
        ),
        heads=[what, "attribute", "n", "correlation", "interval", "lowest", "highest"],
        n_labels=2,
        rows=rows,
        notes=notes,
        data=pd.DataFrame([row for curve in curves for row in _rows(curve, what)]),
        ranks=[2, 0, 0, 1, 1],
    )


def as_data(curves: Sequence[Curve], what: str) -> list[dict[str, Any]]:
    """Return curves for `--json`: unscaled scores; `what` is the kind of the labels."""
    return [
        {
            what: curve.label,
            "attribute": curve.attribute,
            "places": curve.places.tolist(),
            "scores": curve.scores.tolist(),
            "correlation": curve.correlation if isfinite(curve.correlation) else None,
            "interval": list(curve.interval),
            "bins": [
                dict(zip(("from", "to", "sequences", "mean"), values, strict=False))
                | {"interval": [values.low, values.high]}
                for values in curve.bins
            ],
        }
        for curve in curves
    ]


def _rows(curve: Curve, what: str) -> list[dict[str, Any]]:
    """Return one row of data per bin, or one without bin."""
    common = {
        what: curve.label,
        "attribute": curve.attribute,
        "sequences": len(curve.places),
        "correlation": curve.correlation,
        **curve.interval._asdict(),
    }
    bins = [dict(zip(_BIN_COLUMNS, values, strict=False)) for values in curve.bins]
    return [common | {"bin": number} | row for number, row in enumerate(bins, 1)] or [common]


def _ends(curve: Curve, measure: Measure, sign: str) -> tuple[str, str]:
    """Return the means of the lowest and the highest bin, and the inner limits of these bins."""
    if not curve.bins:
        return MISSING, MISSING
    first, last = curve.bins[0], curve.bins[-1]
    low, high = (f"{end.mean * measure.scale:{sign}.{measure.decimals}f}" for end in (first, last))
    return f"{low} (≤ {first.last:.2g})", f"{high} (≥ {last.first:.2g})"
