"""Checks of stored runs: whether trackers can be compared, equal boxes, boxes that are corners."""

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations, product
from math import inf
from numbers import Real

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from trackmark.bench.analysis.run_tables import measures_of, without_undefined
from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.metrics import find_metrics
from trackmark.bench.metrics.boxes import overlap
from trackmark.bench.metrics.interface import mean_of_sequences
from trackmark.bench.protocols import ONE_PASS, TIMING
from trackmark.bench.store.database import ResultsError
from trackmark.bench.store.runs import DEFAULT_METRICS, Runs
from trackmark.reports.tables import ScoreMeasure

DECIMALS = 3
"""Number of decimals to which boxes are compared."""


class ComparisonError(ResultsError):
    """Runs that cannot be compared; the message names them and the remedy."""


class AllFailedError(ComparisonError):
    """Every run of every tracker failed."""


def compared_measure(
    metrics: str, metric: str | None = None, margin: float | None = None
) -> ScoreMeasure:
    """Return a score of metrics, by default the first one, with its equivalence margin.

    Raises `ComparisonError` for an invalid margin, if the metrics have no such score, or if the
    score has no default margin.
    """
    if margin is not None and not (isinstance(margin, Real) and 0 <= margin < inf):
        raise ComparisonError(f"margin: {margin!r}. Expected: a finite number of 0 or more.")
    definitions = find_metrics(metrics)
    measures = {measure.name: measure for measure in measures_of(metrics) if measure.direction}
    name = metric or next(iter(measures))
    if name not in measures:
        problem = f"{metrics} has no score {name!r}"
        if name in definitions.metrics and definitions.metrics[name].only_overall:
            problem = (
                f"{name} is a score of all sequences together; trackers are compared by sequence"
            )
        raise ComparisonError(
            f"{problem}. Choose one of {', '.join(measures)}, or other metrics: --metrics, or "
            "metrics= in Python."
        )
    measure = measures[name]
    if metrics != DEFAULT_METRICS:
        if margin is None and measure.direction == "lower":
            raise ComparisonError(
                f"{name} has no default equivalence margin. Give one with --margin, or margin= in "
                "Python."
            )
        title = f"{measure.title} ({metrics})"
        if definitions.combine is not mean_of_sequences:  # `report` prints a different mean
            title = f"mean of sequences' {title}"
        measure = replace(measure, title=title)
    return measure if margin is None else replace(measure, margin=margin)


def selected_trackers(
    scored: pd.DataFrame, trackers: Sequence[str] | None, against: str | None
) -> list[str]:
    """Return the labels of the compared trackers; raise `ComparisonError` for an unknown one."""
    stored_trackers = scored["tracker"].astype(str).unique().tolist()
    selected = list(stored_trackers if trackers is None else trackers)
    if against is not None and against not in selected:
        selected.insert(0, against)
    for name in selected:
        if name not in stored_trackers:
            raise ComparisonError(
                f"{name!r}: no stored runs of this tracker. Stored are "
                f"{', '.join(stored_trackers)}."
            )
        if selected.count(name) > 1:
            raise ComparisonError(f"{name!r} is named twice. Name each tracker once.")
    return selected


def check_runs(
    scored: pd.DataFrame, trackers: Sequence[str], sequences: Sequence[str], measure: ScoreMeasure
) -> None:
    """Raise `ComparisonError` unless all runs can be compared."""
    remedy = "with `trackmark run` or with --sequences, or name other trackers."
    for status in ("missing", "stale"):
        rows = scored[scored["status"] == status]
        if len(rows):
            row = rows.iloc[0]
            raise ComparisonError(
                f"{_location(row)}, repetition {row['repetition']}: the run is {status} "
                f"({len(rows)} of {len(scored)} runs are). All runs are needed. Execute them "
                f"{remedy}"
            )
    present = set(zip(scored["tracker"].astype(str), scored["sequence"].astype(str), strict=True))
    for name, sequence in product(trackers, sequences):
        if (name, sequence) not in present:
            raise ComparisonError(
                f"tracker {name}, sequence {sequence}: the run is missing. Execute it {remedy}"
            )
    versions = scored.dropna(subset="fingerprint").groupby("sequence", observed=True)["fingerprint"]
    counts = versions.nunique()
    if changed := counts[counts > 1].index.tolist():
        raise ComparisonError(
            f"sequence {changed[0]}: its images or its ground truth changed between stored runs. "
            "Run all trackers on it again."
        )
    if measure.name not in scored:
        raise ComparisonError(f"the runs have no score {measure.name!r}.")
    undefined = scored[~np.isfinite(scored[measure.name])]
    if len(undefined):
        row = undefined.iloc[0]
        raise ComparisonError(
            f"{_location(row)}: {measure.title} is {row[measure.name]}. Choose another --metric, "
            "or omit the sequence."
        )


def _location(row: "pd.Series[str]") -> str:
    return f"tracker {row['tracker']}, sequence {row['sequence']}"


def same_boxes(runs: Runs, protocol: str = ONE_PASS) -> Counter[tuple[str, str]]:
    """Return the number of sequences on which two trackers gave equal boxes in all runs.

    Sequences whose overlap is undefined are not counted: they have no estimates to compare. Raises
    `ResultsError` if a file is damaged.
    """
    columns = ["sequence", "tracker", "repetition", "mean_overlap", "centre_error"]
    table = runs.table
    finished = table[(table["protocol"] == protocol) & (table["status"] == "finished")]
    finished, _ = without_undefined(finished, "mean_overlap")
    rows = finished.reindex(columns=columns).round(9).fillna(-1.0)
    scores: defaultdict[str, dict[str, dict[int, list[float]]]] = defaultdict(dict)
    for sequence, tracker, repetition, *run_scores in rows.itertuples(index=False, name=None):
        scores[sequence].setdefault(tracker, {})[repetition] = run_scores
    # Only runs with equal scores can have equal boxes; other runs are not read.
    equal = [
        (sequence, *pair)
        for sequence, by_tracker in scores.items()
        for pair in combinations(by_tracker, 2)
        if by_tracker[pair[0]] == by_tracker[pair[1]]
    ]
    compared = {(tracker, sequence) for sequence, *pair in equal for tracker in pair}
    compared_rows = (
        row
        for row in runs.evaluated_rows(protocol=protocol)
        if row["status"] == "finished" and (row["tracker"], row["sequence"]) in compared
    )
    boxes: defaultdict[tuple[str, str], dict[int, NDArray[np.float64]]] = defaultdict(dict)
    for row, run, _ in runs.read(compared_rows):
        boxes[row["tracker"], row["sequence"]][row["repetition"]] = np.round(run.boxes, DECIMALS)
    return Counter(
        (first, second)
        for sequence, first, second in equal
        if all(
            np.array_equal(array, boxes[second, sequence][repetition], equal_nan=True)
            for repetition, array in boxes[first, sequence].items()
        )
    )


_MIN_GAIN = 0.3
"""Gain of mean overlap above which boxes are likely to be corners."""

_FIRST_FRAMES = 10
"""Number of frames after the init box in which most trackers still follow the target."""

_MAX_RUNS = 3
"""Maximum number of runs of a tracker that are read."""


def corner_boxes(runs: Runs, protocol: str = "") -> list[str]:
    """Return a hint for each tracker whose boxes match the targets only as corners.

    Of each tracker, the first finished runs with a low or unknown overlap are checked, by default
    those by any protocol.
    """
    hints, table = [], runs.table
    is_checked = table["protocol"] == protocol if protocol else table["protocol"] != TIMING
    finished = table[(table["status"] == "finished") & is_checked]
    overlaps = finished.reindex(columns=["mean_overlap"])["mean_overlap"]
    low = finished[~(overlaps >= 1 - _MIN_GAIN)]
    for tracker, rows in low.groupby("tracker", sort=False):
        for _, run, truth in runs.read(rows.head(_MAX_RUNS).to_dict("records")):
            gain = _gain(run, truth.boxes)
            if gain > _MIN_GAIN:
                hints.append(
                    f"{tracker}: the boxes look like [x1, y1, x2, y2]. Expected: [x, y, width, "
                    f"height]. Read as corners, they overlap the target by {gain:.2f} more."
                )
                break
    return hints


def _gain(run: Run, truth: NDArray[np.float64]) -> float:
    """Return by how much the mean overlap rises if boxes are read as corners; 0 without truth.

    The mean is that of all frames or, if more, of the first frames: the target may be lost later.
    """
    frames = np.concatenate(run.segments) if run.segments else np.arange(len(run.boxes))
    is_later = frames != frames[0]
    boxes, truth = run.boxes[is_later], truth[frames][is_later]
    is_known = np.isfinite(np.hstack([boxes, truth])).all(axis=1)
    boxes, truth = boxes[is_known], truth[is_known]
    if not len(boxes):
        return 0.0
    with np.errstate(over="ignore"):  # coordinates of 1e308
        corners = np.column_stack([boxes[:, :2], boxes[:, 2:] - boxes[:, :2]])
    gains = overlap(truth, corners) - overlap(truth, boxes)
    return float(max(gains.mean(), gains[:_FIRST_FRAMES].mean()))
