"""Tables and curves of stored runs by any metrics.

The scores of each run are computed by all requested metrics. Metrics also combine the runs of a
tracker: by means over sequences or frames, or by a curve over lengths.
"""

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from math import isfinite, nan
from typing import Any, NamedTuple

import pandas as pd
from numpy.typing import NDArray

from trackmark.bench.analysis.run_tables import (
    SUMMARY,
    measure_of,
    tables,
)
from trackmark.bench.analysis.score_tables import (
    counted,
    mean_table,
    meaning_of_intervals,
    means_over,
    sequence_table,
    with_not_run,
)
from trackmark.bench.evaluation.scoring import LATE_ESTIMATES, can_score
from trackmark.bench.metrics import find_metrics
from trackmark.bench.metrics.interface import MetricResult, mean_of_sequences
from trackmark.bench.protocols import ONE_PASS, TIMING, ProtocolError, parse_protocol
from trackmark.bench.statistics.units import units_of
from trackmark.bench.store.runs import (
    DEFAULT_METRICS,
    NOT_SCORED,
    Runs,
    score_columns,
    without_failed_trackers,
)
from trackmark.reports.renderers import terminal_lines
from trackmark.reports.tables import MISSING, Cell, ScoreMeasure, Table

ALL_SEQUENCES = "all sequences"
"""Label of rows with the metrics' own scores over all sequences."""

MEAN_OF_SEQUENCES = "mean of sequences"
"""Label of rows with means over units, if the metrics weight sequences unequally."""

LATE = ScoreMeasure(LATE_ESTIMATES, "late estimates", "%", None, 1, scale=100, rank=-1)

_MAX_NOTES = 3
"""Maximum number of notes on runs that cannot be scored."""

_MAX_NAMES = 3
"""Maximum number of sequences without scores that a note names."""


class MetricTables(NamedTuple):
    """Tables of an experiment, and the curves of metrics other than `native`."""

    tables: list[Table]
    with_curves: "list[MetricScores]"


def metric_tables(runs: Runs, names: Sequence[str], title: str = "") -> MetricTables:
    """Score the runs of an experiment by metrics, and return tables of the scores.

    One-pass runs come first, with metrics in the order of `names`; `native` has the tables of
    `bench.analysis.run_tables`. Captions start with `title`, by default that of the experiment.
    Raises `ResultsError` if a file cannot be read.
    """
    protocols = runs.protocols
    title = title or runs.title
    is_named = not set(protocols) <= {ONE_PASS}  # whether captions name the protocol
    with_curves: list[MetricScores] = []
    for protocol in protocols:
        metrics = metrics_for(names, protocol)
        if protocol == ONE_PASS:
            metrics = [name for name in metrics if name != DEFAULT_METRICS]
        caption = _with_protocol(title, protocol, is_named)
        with_curves += [MetricScores(runs, name, protocol, caption) for name in metrics]
    all_tables = [scores.table for scores in with_curves]
    if DEFAULT_METRICS in names:
        index = names.index(DEFAULT_METRICS) if ONE_PASS in protocols else 0
        native = tables(runs, _with_protocol(title, ONE_PASS, is_named))
        all_tables[index:index] = native
    return MetricTables(all_tables, with_curves)


def _with_protocol(title: str, protocol: str, is_named: bool) -> str:
    return f"{title}, protocol {protocol}" if is_named else title


def metrics_for(names: Sequence[str], protocol: str) -> list[str]:
    """Return the metrics for runs by a protocol, which is given by its key.

    The metrics of the protocol replace `native`, which is kept if it can score such runs.
    """
    if protocol in (ONE_PASS, TIMING):
        return list(names)
    try:
        defaults = [parse_protocol(protocol).metrics]
    except ProtocolError:  # protocol of a later version of trackmark
        return list(names)
    defaults += [DEFAULT_METRICS] if can_score(DEFAULT_METRICS, protocol) else []
    metrics = [
        other for name in names for other in (defaults if name == DEFAULT_METRICS else [name])
    ]
    return list(dict.fromkeys(metrics))


def table_prefix(protocol: str) -> str:
    """Return the start of the names of tables by a protocol; empty for one-pass."""
    return "" if protocol == ONE_PASS else re.sub(r"[^a-z0-9.]+", "-", protocol) + "-"


def scores_by_metrics(
    runs: Runs, row: Mapping[str, Any], names: Sequence[str]
) -> dict[str, Mapping[str, Any] | None]:
    """Return the scores of the run of a row by metrics; None for metrics that cannot score it."""
    if row["status"] != "finished" or row["protocol"] == TIMING:
        return dict.fromkeys(names)
    outcomes = {name: runs.outcomes(name, pd.DataFrame([dict(row)]))[0] for name in names}
    return {
        name: {key: value if isfinite(value) else None for key, value in outcome.scores.items()}
        if isinstance(outcome, MetricResult)
        else None
        for name, outcome in outcomes.items()
    }


def summary_text(runs: Runs, metrics: Sequence[str], *, only_means: bool) -> str:
    """Return the tables of runs in a results folder for a terminal.

    With `only_means`, a table that has means over all sequences has no other rows.
    """
    option = "" if tuple(metrics) == (DEFAULT_METRICS,) else f" --metrics {','.join(metrics)}"
    more = f"`trackmark report {runs.folder}{option} --verbose`"
    printed = []
    for table in metric_tables(runs, metrics).tables:
        lines = terminal_lines(_only_means(table) if only_means else table, more)
        printed.append("\n".join(lines))
    return "\n\n".join(printed)


def _only_means(table: Table) -> Table:
    """Return a table with only its rows over all sequences, if it has any."""
    rows = [row for row in table.rows if row[0].text in (ALL_SEQUENCES, MEAN_OF_SEQUENCES)]
    return replace(table, rows=rows) if rows else table


class MetricScores:
    """Scores of the runs by one protocol and by metrics; captions start with `title`."""

    def __init__(self, runs: Runs, metrics: str, protocol: str, title: str = "") -> None:
        table = with_not_run(runs.table[runs.table["protocol"] == protocol]).reset_index(drop=True)
        outcomes = runs.outcomes(metrics, without_failed_trackers(table))
        self.protocol, self.metrics, self.title = protocol, metrics, title
        self._definition = find_metrics(metrics)
        self._results = {i: run for i, run in outcomes.items() if isinstance(run, MetricResult)}
        self._refused = {i: run for i, run in outcomes.items() if isinstance(run, str)}
        late = [LATE] if any(LATE.name in run.scores for run in self._results.values()) else []
        columns = [measure_of(key, column) for key, column in self._definition.metrics.items()]
        self._measures = [*(SUMMARY if metrics == DEFAULT_METRICS else columns), *late]
        labels = table[["tracker", "sequence", "repetition", "status", "failure"]].copy()
        labels.loc[list(self._refused), "status"] = NOT_SCORED
        names = [*self._definition.metrics, *(measure.name for measure in late)]
        self._runs = labels.join(score_columns(outcomes, names))
        self._overall = {
            str(tracker): self._combined(rows)
            for tracker, rows in self._runs.groupby("tracker", sort=False)
            if counted(rows, self._measures[0].name).all()
        }

    def _combined(self, rows: pd.DataFrame) -> MetricResult:
        """Combine the runs of a tracker."""
        by_sequence = [
            [self._results[row] for row in sequence_rows.index if row in self._results]
            for _, sequence_rows in rows.groupby("sequence", sort=False)
        ]
        return self._definition.overall(by_sequence)

    def of_group(self, sequences: Collection[str]) -> dict[str, MetricResult]:
        """Return the results over a group of sequences, by tracker whose runs all have scores."""
        return {
            str(tracker): self._combined(rows[rows["sequence"].isin(sequences)])
            for tracker, rows in self._runs.groupby("tracker", sort=False)
            if tracker in self._overall
        }

    @cached_property
    def curves(self) -> Mapping[str, Mapping[str, NDArray[Any]]]:
        """Curves of the trackers with all runs, by name of the curve and tracker."""
        return {
            curve: {
                tracker: result.curves[curve]
                for tracker, result in self._overall.items()
                if curve in result.curves
            }
            for curve in self._definition.curves
        }

    @cached_property
    def table(self) -> Table:
        """Scores by sequence, after those over all sequences."""
        table = sequence_table(self._runs, self._measures, self.title, self.metrics)
        if len(self._runs["sequence"].unique()) > 1:
            table = self._with_means(table)
        reasons = dict.fromkeys(f"{NOT_SCORED}: {reason}" for reason in self._refused.values())
        notes = [*list(reasons)[:_MAX_NOTES], *self._undefined_notes()]
        name = f"{table_prefix(self.protocol)}metrics-{self.metrics}"
        table = replace(table, name=name, notes=[*table.notes, *notes])
        if notes and not self._results:  # the table would have no scores
            caption = f"{self.title}; metrics {self.metrics}: nothing scored."
            table = replace(table, rows=[], caption=caption, notes=notes)
        return table

    def _undefined_notes(self) -> list[str]:
        """Return why runs have no scores although the metrics can score them."""
        rows = self._runs.loc[list(self._results)]
        sequences = list(dict.fromkeys(rows.loc[rows[self._measures[0].name].isna(), "sequence"]))
        if not sequences or not self._definition.undefined:
            return []
        more = f" and {len(sequences) - _MAX_NAMES} more" if len(sequences) > _MAX_NAMES else ""
        names = ", ".join(sequences[:_MAX_NAMES])
        return [f"{MISSING}: {self._definition.undefined}: {names}{more}"]

    def _with_means(self, table: Table) -> Table:
        """Return the table with additional first rows over all sequences.

        If the metrics have unequal weights of sequences, their own scores come first, without
        intervals, and the means over units follow.
        """
        only_overall = {
            name: nan for name, metric in self._definition.metrics.items() if metric.only_overall
        }
        runs = self._runs.assign(**only_overall)
        means = mean_table(runs, self._measures, "", self.metrics, skip_undefined=True)
        sequences = [str(name) for name in runs["sequence"].unique()]
        units = units_of(sequences)
        label, caption = ALL_SEQUENCES, means_over(sequences, len(units))
        rows, values = list[list[Cell]](), list[pd.DataFrame]()
        if self._definition.combine is not mean_of_sequences:
            label = MEAN_OF_SEQUENCES
            caption += f"; {ALL_SEQUENCES}: weighted as the metrics define, without interval"
            if self._overall:
                overall = self._overall_table()
                rows += [[*row[:2], *map(_without_interval, row[2:])] for row in overall.rows]
                counts = overall.records["tracker"].map(runs["tracker"].value_counts())
                values.append(overall.records.assign(runs=counts))
        rows += [[Cell(label), *row] for row in means.rows]
        values.append(means.records.assign(sequence=label))
        columns = [measure.name for measure in self._measures if measure.name not in only_overall]
        scores = runs.loc[counted(runs, self._measures[0].name), columns]
        undefined = f"{MISSING}: undefined in a run; the mean over all sequences omits this run"
        meaning = meaning_of_intervals(units)
        return replace(
            table,
            caption=f"{table.caption} {label.capitalize()}: {caption}. {meaning}",
            rows=rows + table.rows,
            notes=[*table.notes, *([undefined] if scores.isna().any(axis=None) else [])],
            records=pd.concat([*values, table.records], ignore_index=True)[list(table.records)],
        )

    def _overall_table(self) -> Table:
        """Return a table of the metrics' own scores over all sequences."""
        rows = pd.DataFrame(
            {"tracker": tracker, "sequence": ALL_SEQUENCES, "repetition": 0, **result.scores}
            for tracker, result in self._overall.items()
        ).assign(status="finished", failure="")
        return sequence_table(rows, self._measures, "", self.metrics)


def _without_interval(cell: Cell) -> Cell:
    """Return the cell with a dash in place of an interval."""
    return cell if cell.text == MISSING else replace(cell, text=f"{cell.text} –")
