"""Tables of stored results."""

from collections.abc import Sequence
from dataclasses import replace
from math import inf

import numpy as np
import pandas as pd

from trackmark.bench.analysis import MARGINS
from trackmark.bench.analysis.score_tables import mean_table, sequence_table
from trackmark.bench.analysis.times import (
    TIME,
    TIMES,
    time_notes,
    with_fps,
    with_times,
)
from trackmark.bench.evaluation.scoring import REVISED
from trackmark.bench.metrics import find_metrics
from trackmark.bench.metrics.interface import Metric, heading
from trackmark.bench.protocols import ONE_PASS, TIMING
from trackmark.bench.statistics.rules import MARGIN
from trackmark.bench.store.runs import DEFAULT_METRICS, Runs
from trackmark.reports.tables import ScoreMeasure, Table

SUMMARY = tuple(
    replace(measure, minimum=0.0, margin=MARGINS[measure.name])
    for measure in (
        ScoreMeasure("mean_overlap", "mean overlap", direction="higher", decimals=3, maximum=1.0),
        ScoreMeasure("success_rate", "success", "%", "higher", 1, scale=100, maximum=1.0),
        ScoreMeasure("inside_rate", "inside", "%", "higher", 1, scale=100, rank=1, maximum=1.0),
        ScoreMeasure("centre_error", "centre error", "px", "lower", 2),
        ScoreMeasure("centre_error_median", "median", "px", "lower", 2, rank=2),
    )
)
"""Columns over several sequences: shares, so that all sequences have equal weights."""

PER_SEQUENCE = (
    ScoreMeasure("mean_overlap", "mean overlap", direction="higher", decimals=3),
    ScoreMeasure("success_frames", "success", "frames", "higher", 1, out_of="evaluated_frames"),
    ScoreMeasure(
        "inside_frames", "inside", "frames", "higher", 1, out_of="evaluated_frames", rank=2
    ),
    ScoreMeasure(
        "first_loss", "first loss", "frame", "higher", 1, out_of="frames", never="none", rank=1
    ),
    ScoreMeasure("centre_error", "centre error", "px", "lower", 2),
    ScoreMeasure("centre_error_p90", "90th percentile", "px", "lower", 2, rank=3),
)
"""Columns of one sequence: counts of frames, as in papers."""

MASKS = (
    ScoreMeasure(
        "mean_region_similarity", "region similarity J", "", "higher", 3, minimum=0.0, maximum=1.0
    ),
    ScoreMeasure(
        "mean_contour_accuracy", "contour accuracy F", "", "higher", 3, minimum=0.0, maximum=1.0
    ),
)
"""Columns of runs with masks, in addition to the scores of boxes."""

SEGMENTATION = (
    ScoreMeasure("mean_region_similarity", "J, mean", direction="higher", decimals=3),
    ScoreMeasure("region_recall", "J, recall", "%", "higher", 1, scale=100),
    ScoreMeasure("region_decay", "J, decay", direction="lower", decimals=3, rank=1),
    ScoreMeasure("mean_contour_accuracy", "F, mean", direction="higher", decimals=3),
    ScoreMeasure("contour_recall", "F, recall", "%", "higher", 1, scale=100),
    ScoreMeasure("contour_decay", "F, decay", direction="lower", decimals=3, rank=1),
)
"""Columns of runs with masks: mean, recall and decay of J and F, as DAVIS defines them."""


def measures_of(metrics: str) -> list[ScoreMeasure]:
    """Return the scores of metrics that have a mean over sequences."""
    if metrics == DEFAULT_METRICS:
        return list(SUMMARY)
    columns = find_metrics(metrics).metrics
    return [measure_of(name, column) for name, column in columns.items() if not column.only_overall]


def measure_of(name: str, column: Metric) -> ScoreMeasure:
    """Return a score as a column of a table; scores of which higher is better are shares."""
    is_share = column.direction == "higher"
    return ScoreMeasure(
        name,
        heading(name),
        direction=column.direction,
        decimals=3 if column.direction else 0,
        minimum=0.0,
        maximum=1.0 if is_share else inf,
        margin=MARGIN if is_share else 0.0,
    )


def tables(runs: Runs, title: str = "") -> list[Table]:
    """Make the tables of one-pass and timing runs: summary, sequences, masks if any, and times.

    Captions start with `title`, by default that of the experiment. If a tracker revised boxes,
    there are tables of the online boxes and of the revised boxes, which captions distinguish.
    """
    title = title or runs.title
    scored, timed = runs.scored(DEFAULT_METRICS, ONE_PASS), runs.timed
    revised = with_revised_scores(scored)
    if revised is None:
        result = score_tables(scored, timed, title)
    else:
        result = score_tables(scored, timed, f"{title}, online boxes")
        again = score_tables(revised, timed, f"{title}, revised boxes")
        result += [replace(table, name=f"{table.name}-revised") for table in again]
    segmenting = scored[scored["tracker"].isin(_segmenting(scored))]
    masks = f"{title}, masks: region similarity J and contour accuracy F as DAVIS defines them"
    result += _table_of("segmentation", segmenting, SEGMENTATION, masks)
    notes = not_repeatable(runs.table).values()
    result = [replace(table, notes=[*table.notes, *notes]) for table in result]
    for table in _table_of("times", timed, TIMES, f"{title}, timing runs"):
        marked = with_fps(table, timed)
        result.append(replace(marked, notes=[*table.notes, *time_notes(timed)]))
    return result


def _table_of(
    name: str, runs: pd.DataFrame, measures: Sequence[ScoreMeasure], title: str
) -> list[Table]:
    """Make a table of scores by sequence with the given name; an empty list without runs."""
    if runs.empty:
        return []
    return [replace(sequence_table(runs, measures, title, DEFAULT_METRICS), name=name)]


def not_repeatable(runs: pd.DataFrame) -> dict[str, str]:
    """Return a note for each tracker with different scores in a one-pass and its timing run.

    `runs`: as in `Runs.table`. Scores are compared, as equal boxes have equal scores.
    """
    if not (runs["protocol"] == TIMING).any():
        return {}
    key, scores = ["tracker", "sequence", "repetition"], ["mean_overlap", "centre_error"]
    finished = runs[runs["status"] == "finished"].reindex(columns=["protocol", *key, *scores])
    first, second = (
        finished[finished["protocol"] == name].astype(dict.fromkeys(key[:2], str)).set_index(key)
        for name in (ONE_PASS, TIMING)
    )
    both = first.index.intersection(second.index)
    before, again = (frame.loc[both, scores].to_numpy(np.float64) for frame in (first, second))
    differs = ~np.isclose(before, again, rtol=0, atol=1e-9, equal_nan=True).all(axis=1)
    first_differences = {
        tracker: (sequence, repetition) for tracker, sequence, repetition in both[differs][::-1]
    }
    return {
        tracker: f"{tracker} is not repeatable: repetition {repetition} gave other boxes on "
        f"{sequence} in a timing run"
        for tracker, (sequence, repetition) in first_differences.items()
    }


def score_tables(scored: pd.DataFrame, timed: pd.DataFrame, title: str) -> list[Table]:
    """Make the summary, if there are several sequences, and the table of every sequence.

    Failed runs among `scored` have the worst scores. Times come from the timing runs `timed` if
    there are enough of them; see `with_times`.
    """
    several = len(scored["sequence"].unique()) > 1
    result = [summary_of(scored, timed, title)] if several else []
    if len(scored):
        columns = PER_SEQUENCE + _mask_columns(scored)
        result.append(sequence_table(scored, columns, title, DEFAULT_METRICS))
    return result


def summary_of(scored: pd.DataFrame, timed: pd.DataFrame, title: str) -> Table:
    """Make the table of means over sequences; parameters as for `score_tables`."""
    scored, undefined = without_undefined(scored, SUMMARY[0].name)
    runs, measured = with_times(scored, timed)
    measures = (*SUMMARY, *_mask_columns(scored), TIME)
    table = with_fps(mean_table(runs, measures, title, DEFAULT_METRICS), measured)
    further_notes = [*undefined_notes(undefined, SUMMARY[0]), *time_notes(measured)]
    return replace(table, notes=[*table.notes, *further_notes])


def without_undefined(runs: pd.DataFrame, score: str) -> tuple[pd.DataFrame, list[str]]:
    """Return the runs without sequences on which the score is undefined, and these sequences.

    It is undefined for all trackers if a sequence has, for example, no target after its first
    frame. A sequence with a missing or stale run is kept. If there is no other sequence, the runs
    are unchanged.
    """
    if score not in runs:
        return runs, []
    ended = runs["status"].isin(["finished", "failed"]) & runs[score].isna()
    by_sequence = runs["sequence"].astype(str)
    undefined = ended.groupby(by_sequence).transform("all")
    undefined &= (runs["status"] == "finished").groupby(by_sequence).transform("any")
    if not undefined.any() or undefined.all():
        return runs, []
    return runs[~undefined], list(by_sequence[undefined].unique())


def undefined_notes(sequences: Sequence[str], measure: ScoreMeasure) -> list[str]:
    """Return a note on the sequences that `without_undefined` leaves out."""
    if not sequences:
        return []
    return [f"left out: {', '.join(sequences)}; {measure.title} is undefined for all trackers"]


def _mask_columns(scored: pd.DataFrame) -> tuple[ScoreMeasure, ...]:
    return MASKS if _segmenting(scored) else ()


def _segmenting(scored: pd.DataFrame) -> set[str]:
    """Return the trackers with scores of masks."""
    columns = [measure.name for measure in MASKS if measure.name in scored]
    return set(scored["tracker"][scored[columns].notna().any(axis=1)])


def with_revised_scores(runs: pd.DataFrame) -> pd.DataFrame | None:
    """Return the runs with the scores of their revised boxes; None if no run has revised boxes.

    `runs` is a data frame of `Runs.scored`. Runs without revised boxes keep the scores of their
    online boxes.
    """
    revised_names = [name for name in runs if str(name).startswith(REVISED)]
    if not runs[revised_names].notna().any(axis=None):
        return None
    names = [str(name).removeprefix(REVISED) for name in revised_names]
    revised = runs[revised_names].set_axis(names, axis=1)
    return runs.assign(**revised.where(revised.notna(), runs[names]))
