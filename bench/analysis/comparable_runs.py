"""Selection and checks of the stored runs that are compared."""

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from itertools import combinations, product
from math import inf, nan
from numbers import Real
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from trackmark.bench.analysis.by_metrics import measures_of, runs_by
from trackmark.bench.analysis.failed_runs import with_worst_scores
from trackmark.bench.analysis.run_tables import PRESET, without_undefined
from trackmark.bench.metrics import preset as metrics_preset
from trackmark.bench.metrics.preset import mean_of_sequences
from trackmark.bench.protocols import STORED_ONE_PASS, TIMING, title
from trackmark.bench.store.files import ResultsError
from trackmark.bench.store.results import Results
from trackmark.reports.tables import ScoreMeasure

DECIMALS = 3
"""Number of decimals to which boxes are compared."""


class ComparisonError(ResultsError):
    """Runs that cannot be compared; the message names them and the remedy."""


class AllFailedError(ComparisonError):
    """Every run of every tracker failed."""


def compared_measure(
    preset: str, metric: str | None = None, margin: float | None = None
) -> ScoreMeasure:
    """Return a score of a metrics preset, by default the first one, with its equivalence margin.

    Raises `ComparisonError` for an invalid margin, if the preset has no such score, or if the score
    has no default margin.
    """
    if margin is not None and not (isinstance(margin, Real) and 0 <= margin < inf):
        raise ComparisonError(f"margin: {margin!r}. Expected: a finite number of 0 or more.")
    definitions = metrics_preset(preset)
    measures = {measure.name: measure for measure in measures_of(preset) if measure.direction}
    name = metric or next(iter(measures))
    if name not in measures:
        problem = f"{preset} has no score {name!r}"
        if name in definitions.columns and definitions.columns[name].whole:
            problem = (
                f"{name} is a score of all sequences together; trackers are compared by sequence"
            )
        raise ComparisonError(
            f"{problem}. Choose one of {', '.join(measures)}, or other metrics: --metrics, or "
            "metrics= in Python."
        )
    measure = measures[name]
    if preset != PRESET:
        if margin is None and measure.direction == "lower":
            raise ComparisonError(
                f"{name} has no default equivalence margin. Give one with --margin, or margin= in "
                "Python."
            )
        title = f"{measure.title} ({preset})"
        if definitions.combine is not mean_of_sequences:  # `report` prints a different mean
            title = f"mean of sequences' {title}"
        measure = replace(measure, title=title)
    return measure if margin is None else replace(measure, margin=margin)


def scored_runs(
    folder: Path, runs: pd.DataFrame, stored: str, preset: str, measure: ScoreMeasure
) -> tuple[pd.DataFrame, ScoreMeasure]:
    """Return the runs by one protocol with scores of a preset, and the measure with a new title.

    `folder`: results folder of the experiment. `runs`: as `load_runs` returns them. `stored`:
    stored name of the protocol. Failed runs have the worst scores. The runs are relabelled as
    one-pass; timing runs are kept. `first_loss` is NaN except for one-pass runs. The title names
    the protocol, but one-pass evaluation only if runs by other protocols exist. Raises
    `ComparisonError` if no run used the protocol.
    """
    protocols = runs["protocol"].astype(str)
    others = [title(name) for name in protocols.unique() if name not in (stored, TIMING)]
    if stored not in protocols.unique():
        remedy = f" Stored runs used {', '.join(others)}. Select one with --protocol."
        raise ComparisonError(
            f"no stored run used the protocol {title(stored)}.{remedy if others else ''}"
        )
    if others or stored != STORED_ONE_PASS:
        measure = replace(measure, title=f"{measure.title}, protocol {title(stored)}")
    scored = runs if preset == PRESET else runs_by(folder, preset, runs, stored)
    scored = with_worst_scores(folder, scored, preset)
    if stored == STORED_ONE_PASS:
        return scored, measure
    selected = protocols.isin([stored, TIMING])
    renamed = protocols[selected].replace(stored, STORED_ONE_PASS)
    return scored[selected].assign(protocol=renamed, first_loss=nan), measure


def selected_trackers(
    scored: pd.DataFrame, trackers: Sequence[str] | None, against: str | None
) -> list[str]:
    """Return the labels of the compared trackers; raise `ComparisonError` for an unknown one."""
    stored = [str(name) for name in scored["tracker"].unique()]
    selected = list(stored if trackers is None else trackers)
    if against is not None and against not in selected:
        selected.insert(0, against)
    for name in selected:
        if name not in stored:
            raise ComparisonError(
                f"{name!r}: no stored runs of this tracker. Stored are {', '.join(stored)}."
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
                f"{_place(row)}, repetition {row['repetition']}: the run is {status} ({len(rows)} "
                f"of {len(scored)} runs are). All runs are needed. Execute them {remedy}"
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
            f"{_place(row)}: {measure.title} is {row[measure.name]}. Choose another --metric, or "
            "omit the sequence."
        )


def _place(row: "pd.Series[str]") -> str:
    return f"tracker {row['tracker']}, sequence {row['sequence']}"


def same_boxes(
    folder: Path, runs: pd.DataFrame, stored: str = STORED_ONE_PASS
) -> Counter[tuple[str, str]]:
    """Return the number of sequences on which two trackers gave equal boxes in all runs.

    Sequences whose overlap is undefined are not counted: they have no estimates to compare.
    `folder`: results folder of the experiment. `runs`: as `load_runs` returns them. `stored`:
    stored name of the protocol. Raises `ResultsError` if a file is damaged.
    """
    results = Results(folder)

    @cache
    def boxes(tracker: str, sequence: str, seed: int) -> NDArray[np.float64]:
        run = results.read((tracker, sequence, seed, stored))
        return np.round(run.boxes, DECIMALS)

    columns = ["sequence", "tracker", "repetition", "mean_overlap", "centre_error"]
    finished = runs[(runs["protocol"] == stored) & (runs["status"] == "finished")]
    finished, _ = without_undefined(finished, "mean_overlap")
    rows = finished.reindex(columns=columns).astype({"sequence": str, "tracker": str}).round(9)
    scores: defaultdict[str, dict[str, dict[int, list[float]]]] = defaultdict(dict)
    for sequence, tracker, seed, *run_scores in rows.fillna(-1.0).itertuples(
        index=False, name=None
    ):
        scores[sequence].setdefault(tracker, {})[seed] = run_scores
    same: Counter[tuple[str, str]] = Counter()
    for sequence, by_tracker in scores.items():
        for first, second in combinations(by_tracker, 2):
            # Only runs with equal scores can have equal boxes; other files are not opened.
            same[first, second] += by_tracker[first] == by_tracker[second] and all(
                np.array_equal(
                    boxes(first, sequence, seed), boxes(second, sequence, seed), equal_nan=True
                )
                for seed in by_tracker[first]
            )
    return +same
