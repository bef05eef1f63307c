"""Scores of stored runs by attributes of their sequences: bins, correlations, tables, plots.

A sequence is one observation: its score and its value of the attribute. Frames are not
observations, as a target that is lost usually stays lost in all later frames.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from math import inf, isfinite
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from trackmark.bench.analysis.run_tables import measures_of
from trackmark.bench.analysis.score_tables import counted, with_not_run
from trackmark.bench.protocols import ONE_PASS
from trackmark.bench.statistics.correlation import rank_correlation
from trackmark.bench.statistics.intervals import Interval
from trackmark.bench.statistics.rules import MIN_UNITS, corrected_level, interval_or_none
from trackmark.bench.store.runs import DEFAULT_METRICS, Runs, reopen_sequence
from trackmark.datasets import SequenceError, attributes
from trackmark.reports.tables import MISSING, Cell, ScoreMeasure, Table

Progress = Callable[[int, int], object]
"""Callback with the number of measured frames and the number of all frames."""

MAX_BINS = 5
"""Maximum number of bins. A line with more points is hard to read."""

_BIN_COLUMNS = ("bin_from", "bin_to", "bin_sequences", "bin_mean", "bin_low", "bin_high")


class Bin(NamedTuple):
    """Sequences with neighbouring values of an attribute."""

    first: float  # lowest value of the attribute
    last: float  # highest value
    sequences: int
    mean: float  # mean score
    low: float  # lower end of the 95 % interval of the mean score
    high: float  # upper end of this interval
    centre: float  # mean value of the attribute


@dataclass(frozen=True)
class Curve:
    """Scores of a tracker by an attribute, on the n sequences that have the attribute.

    `correlation`: Spearman's, NaN if all scores or all attributes are equal. `interval`: at level
    1 - 0.05 / m, corrected for all m curves of a report.
    """

    label: str
    attribute: str
    attribute_values: NDArray[np.float64]  # (n,): values of the attribute
    scores: NDArray[np.float64]  # (n,)
    correlation: float
    interval: Interval
    bins: Sequence[Bin]  # in the order of the attribute; empty if there are too few sequences


class AttributeReport(NamedTuple):
    """Scores by attributes of the sequences."""

    table: Table
    measure: ScoreMeasure
    curves: Sequence[Curve]


def attribute_report(
    runs: Runs,
    metrics: Collection[str],
    progress: Progress,
    on_message: Callable[[str], None],
) -> list[AttributeReport]:
    """Return the first score of all metrics by attributes of the sequences; see `attributes_of`."""
    reports = []
    for name in metrics:
        measure = next(measure for measure in measures_of(name) if measure.direction)
        if name != DEFAULT_METRICS:
            measure = replace(measure, title=f"{measure.title} ({name})")
        scored = runs.scored(name, ONE_PASS, strict=True)
        sequences = [str(sequence) for sequence in scored["sequence"].unique()]
        means = _means_by_sequence(scored, measure)
        values = attributes_of(scored, sequences, progress, on_message)
        curves = attribute_curves(means, values, measure.minimum, measure.maximum)
        file_name = "attributes" if name == DEFAULT_METRICS else f"attributes-{name}"
        table = attribute_table(curves, measure, file_name)
        for tracker in sorted(set(scored["tracker"]) - set(means)):
            table.notes.append(f"{tracker} is left out: some of its runs have no score.")
        reports.append(AttributeReport(table, measure, curves))
    return reports


def _means_by_sequence(runs: pd.DataFrame, measure: ScoreMeasure) -> dict[str, NDArray[np.float64]]:
    """Return mean scores by sequence, (n,), of trackers whose runs all have a score."""
    runs = with_not_run(runs).astype(dict.fromkeys(["tracker", "sequence", "status"], str))
    names = runs["sequence"].unique()
    return {
        str(tracker): rows.groupby("sequence")[measure.name].mean().reindex(names).to_numpy()
        for tracker, rows in runs.groupby("tracker", sort=False)
        if counted(rows, measure.name).all()
    }


def attributes_of(
    runs: pd.DataFrame,
    sequences: Sequence[str],
    progress: Progress,
    on_message: Callable[[str], None],
) -> dict[str, NDArray[np.float64]]:
    """Return values of every attribute by sequence, (n,), NaN if a sequence does not have it.

    Sequences that were measured before are not opened. `progress` is called with the number of
    measured frames of all sequences, and `on_message` with a message on each sequence that cannot
    be measured.
    """
    finished = runs[runs["status"] == "finished"].drop_duplicates("sequence").to_dict("records")
    rows = {row["sequence"]: row for row in finished if row["sequence"] in sequences}
    measured = {name: attributes.cached_values(row["fingerprint"]) for name, row in rows.items()}
    opened = {}
    for name in [name for name, values in measured.items() if values is None]:
        try:
            opened[name] = reopen_sequence(rows[name])
        except SequenceError as error:
            on_message(f"attributes are unknown: {error}")
    total, done = sum(map(len, opened.values())), 0
    for name, sequence in opened.items():
        report = partial(lambda before, frames, _: progress(before + frames, total), done)
        measured[name] = attributes.measure(sequence, report)
        done += len(sequence)
    means = {name: attributes.overall(values) for name, values in measured.items() if values}
    return {
        attribute: np.array([means.get(name, {}).get(attribute, np.nan) for name in sequences])
        for attribute in attributes.ATTRIBUTES
    }


def attribute_curves(
    values: Mapping[str, ArrayLike],
    attributes: Mapping[str, ArrayLike],
    minimum: float = -inf,
    maximum: float = inf,
) -> list[Curve]:
    """Return the curve of each tracker and each attribute that at least two sequences have.

    `values`: scores by sequence, (n,), by tracker, in the range from `minimum` to `maximum`.
    `attributes`: values by sequence, (n,), by name; NaN if a sequence does not have it.
    """
    pairs = [
        (label, name, np.asarray(scores, np.float64), np.asarray(attribute_values, np.float64))
        for label, scores in values.items()
        for name, attribute_values in attributes.items()
        if np.isfinite(attribute_values).sum() > 1
    ]
    level = corrected_level(len(pairs))
    curves = []
    for label, name, scores, attribute_values in pairs:
        finite = np.isfinite(scores) & np.isfinite(attribute_values)
        scores, attribute_values = scores[finite], attribute_values[finite]
        correlation, interval = rank_correlation(attribute_values, scores, level)
        bins = []
        for members in bins_of(attribute_values):
            x, y = attribute_values[members], scores[members]
            low, high = interval_or_none(y, 1, minimum, maximum) or (np.nan, np.nan)
            extent = float(x.min()), float(x.max()), len(x)
            bins.append(Bin(*extent, float(y.mean()), low, high, float(x.mean())))
        curves.append(Curve(label, name, attribute_values, scores, correlation, interval, bins))
    return curves


def bins_of(attribute_values: ArrayLike) -> list[NDArray[np.intp]]:
    """Return indices of sequences in bins of similar size, in the order of their values, (n,).

    Each bin has at least `MIN_UNITS` sequences. The number of bins is 0 or from 2 to `MAX_BINS`.
    Equal values are in the same bin.
    """
    values = np.asarray(attribute_values, np.float64)
    order = np.argsort(values, kind="stable")
    ranked, n = values[order], len(values)
    count = min(MAX_BINS, n // MIN_UNITS)
    cuts = [0]
    for index in range(1, count):
        cut = int(np.searchsorted(ranked, ranked[index * n // count]))
        if min(cut - cuts[-1], n - cut) >= MIN_UNITS:
            cuts.append(cut)
    bins = [order[first:last] for first, last in pairwise([*cuts, n])]
    return bins if len(bins) > 1 else []


def attribute_table(
    curves: Sequence[Curve], measure: ScoreMeasure, name: str = "attributes"
) -> Table:
    """Make a table of curves: correlations, and the means of the lowest and the highest bin.

    `name`: file name of the table. Its data have one row per bin; a curve without bins has one.
    """
    rows = []
    for curve in curves:
        low, high = curve.interval
        correlation = f"{curve.correlation:+.2f}" if isfinite(curve.correlation) else MISSING
        labels = curve.label, curve.attribute, str(len(curve.attribute_values)), correlation
        interval = Cell(f"[{low:+.2f}, {high:+.2f}]", is_best=low > 0 or high < 0)
        rows.append([*map(Cell, labels), interval, *map(Cell, _ends(curve, measure))])
    few = sum(not curve.bins for curve in curves)
    notes = ["The table is empty: at least two sequences with scores are needed."] * (not curves)
    notes += [
        f"Intervals of correlations are corrected for all {len(curves)} rows (Bonferroni) and hold "
        "together at 95 %; * or bold: the interval excludes 0.",
        "Lowest and highest: mean scores in the bins with the lowest and highest attribute values.",
    ]
    if few:
        notes.append(
            f"{few} of {len(curves)} rows have no curve: a curve needs two bins of {MIN_UNITS} "
            "sequences with different values."
        )
    return Table(
        name=name,
        caption=(
            f"{measure.heading} against attributes of the sequences (docs/attributes.md): rank "
            "correlation of scores and attribute over n sequences, with its interval."
        ),
        headings=["tracker", "attribute", "n", "correlation", "interval", "lowest", "highest"],
        n_labels=2,
        rows=rows,
        notes=notes,
        records=pd.DataFrame([row for curve in curves for row in _rows(curve)]),
        ranks=[2, 0, 0, 1, 1],
    )


def _rows(curve: Curve) -> list[dict[str, Any]]:
    """Return one row of data per bin, or one row without bin."""
    common = {
        "tracker": curve.label,
        "attribute": curve.attribute,
        "sequences": len(curve.attribute_values),
        "correlation": curve.correlation,
        **curve.interval._asdict(),
    }
    bins = [dict(zip(_BIN_COLUMNS, values, strict=False)) for values in curve.bins]
    return [common | {"bin": number} | row for number, row in enumerate(bins, 1)] or [common]


def _ends(curve: Curve, measure: ScoreMeasure) -> tuple[str, str]:
    """Return the means of the lowest and the highest bin with the inner limits of the bins."""
    if not curve.bins:
        return MISSING, MISSING
    first, last = curve.bins[0], curve.bins[-1]
    low, high = (f"{end.mean * measure.scale:.{measure.decimals}f}" for end in (first, last))
    return f"{low} (≤ {first.last:.2g})", f"{high} (≥ {last.first:.2g})"
