"""Tables and curves of stored runs by any metrics presets.

The scores of each run are computed by all requested presets. A preset also combines the runs of a
tracker: by means over sequences or frames, or by a curve over lengths.
"""

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from math import inf, isfinite, nan
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from trackmark.bench.analysis.failed_runs import failed_runs, judge_failed
from trackmark.bench.analysis.run_tables import (
    PRESET,
    SUMMARY,
    mean_table,
    meaning_of_intervals,
    tables,
    title_of,
)
from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.evaluation.scoring import can_score, score_run
from trackmark.bench.metrics import preset as metrics_preset
from trackmark.bench.metrics.preset import Column, PresetResult, heading, mean_of_sequences
from trackmark.bench.protocols import STORED_ONE_PASS, TIMING, ProtocolError, parse_protocol
from trackmark.bench.protocols import title as title_of_protocol
from trackmark.bench.statistics.rules import MARGIN
from trackmark.bench.statistics.units import units_of
from trackmark.bench.store.data_frames import load_runs
from trackmark.bench.store.files import ResultsError
from trackmark.bench.store.layout import RunKey, run_key
from trackmark.bench.store.results import Results
from trackmark.bench.store.truth import StoredTruth, read_truth
from trackmark.reports.renderers import terminal_lines
from trackmark.reports.tables import (
    MISSING,
    ScoreMeasure,
    Table,
    complete,
    counted,
    means_over,
    sequence_table,
)
from trackmark.reports.tables import Cell as TableCell

TOGETHER = "all sequences"
"""Label of rows with a preset's scores over all sequences."""

MEANS = "mean of sequences"
"""Label of rows with means over units, if the preset weights sequences unequally."""

LATE = ScoreMeasure("late_share", "late estimates", "%", None, 1, scale=100, rank=-1)
"""Share of frames after the first with an estimate of an earlier frame (real-time evaluation)."""

NOT_SCORED = "not scored"
"""Status of finished runs that a preset cannot score."""

_MAX_NOTES = 3
"""Maximum number of notes on runs that cannot be scored."""

_MAX_NAMES = 3
"""Maximum number of sequences without scores that a note names."""

ScoredRun = PresetResult | str
"""Result of a run by a preset, or the reason why the preset cannot score the run."""


@dataclass(frozen=True)
class PresetScores:
    """Scores of an experiment's runs by one protocol and one preset."""

    preset: str
    title: str
    table: Table
    # by curve and tracker; of trackers with all runs
    curves: Mapping[str, Mapping[str, NDArray[Any]]]


class PresetReport(NamedTuple):
    """Tables of an experiment, and the scores of presets other than `native`."""

    tables: list[Table]
    scored: list[PresetScores]


def preset_report(
    folder: Path, names: Sequence[str], cells: Collection[RunKey] | None = None, title: str = ""
) -> PresetReport:
    """Score the runs of an experiment by presets.

    One-pass runs come first, with presets in the order of `names`; `native` has the tables of
    `bench.analysis.run_tables`. `folder`: folder of the results. `cells`: selected runs, all by
    default. `title`: start of captions. Raises `ResultsError` if a file cannot be read.
    """
    runs = load_runs(folder, cells)
    stored_names = sorted(
        set(map(str, runs["protocol"].unique())) - {TIMING},
        key=lambda name: (name != STORED_ONE_PASS, name),
    )
    title = title or title_of(folder)
    named = not set(stored_names) <= {STORED_ONE_PASS}  # True if captions name the protocol
    scored: list[PresetScores] = []
    for stored in stored_names:
        presets = presets_for(names, stored)
        if stored == STORED_ONE_PASS:
            presets = [name for name in presets if name != PRESET]
        caption = _with_protocol(title, stored, named)
        scored += [ScoredRuns(folder, name, runs, stored, caption).report() for name in presets]
    all_tables = [scores.table for scores in scored]
    if PRESET in names:
        index = names.index(PRESET) if STORED_ONE_PASS in stored_names else 0
        all_tables[index:index] = tables(
            folder, cells, _with_protocol(title, STORED_ONE_PASS, named)
        )
    return PresetReport(all_tables, scored)


def _with_protocol(title: str, stored: str, named: bool) -> str:
    return f"{title}, protocol {title_of_protocol(stored)}" if named else title


def presets_for(names: Sequence[str], stored: str) -> list[str]:
    """Return the presets for runs by the protocol with the stored name `stored`.

    The preset of the protocol replaces `native`, which is kept if it can score such runs.
    """
    if stored in (STORED_ONE_PASS, TIMING):
        return list(names)
    try:
        defaults = [parse_protocol(stored).preset]
    except ProtocolError:  # protocol of a later version of trackmark
        return list(names)
    defaults += [PRESET] if can_score(PRESET, stored) else []
    presets = [preset for name in names for preset in (defaults if name == PRESET else [name])]
    return list(dict.fromkeys(presets))


def table_prefix(stored: str) -> str:
    """Return the start of the names of tables by a protocol; empty for one-pass."""
    return "" if stored == STORED_ONE_PASS else re.sub(r"[^a-z0-9.]+", "-", stored) + "-"


def runs_by(
    folder: Path,
    name: str,
    runs: pd.DataFrame,
    stored: str = STORED_ONE_PASS,
    *,
    strict: bool = True,
) -> pd.DataFrame:
    """Return runs with the scores of a preset as columns.

    `runs`: as `load_runs` returns them; only runs by the protocol `stored` are scored. A run that
    the preset cannot score raises `ResultsError`, or has the status `not scored` if not `strict`.
    """
    finished = runs[(runs["protocol"] == stored) & (runs["status"] == "finished")]
    results = _judge_runs(folder, name, finished)
    refused = {index: reason for index, reason in results.items() if isinstance(reason, str)}
    if refused and strict:
        raise ResultsError(next(iter(refused.values())))
    if refused:
        runs = runs.astype({"status": str, "failure": str})
        runs.loc[[*refused], "status"] = NOT_SCORED
        runs.loc[[*refused], "failure"] = [*refused.values()]
    columns = list(metrics_preset(name).columns)
    return runs.drop(columns=columns, errors="ignore").join(_scores(results, columns))


def scores_by_group(
    folder: Path, name: str, runs: pd.DataFrame, groups: Mapping[str, Collection[str]], stored: str
) -> dict[str, dict[str, PresetResult]]:
    """Return the results of a preset over groups of sequences, by group and tracker.

    `runs`: as `load_runs` returns them. `groups`: names of sequences by group. `stored`: stored
    name of the protocol. A tracker is omitted if one of its runs has no score.
    """
    scored = ScoredRuns(folder, name, runs, stored)
    return {
        group: {
            str(tracker): scored.overall(rows[rows["sequence"].isin(members)])
            for tracker, rows in scored.runs.groupby("tracker", sort=False)
            if tracker in scored.together
        }
        for group, members in groups.items()
    }


def scores_by(folder: Path, row: Mapping[str, Any], names: Sequence[str]) -> dict[str, Any]:
    """Return the scores of a run by preset; None for a preset that cannot score the run.

    `row`: row of the run in the index.
    """
    if row["status"] != "finished" or row["protocol"] == TIMING:
        return dict.fromkeys(names)
    scores_by_preset: dict[str, Any] = dict.fromkeys(names)
    for name in names:
        run = _judge_runs(folder, name, pd.DataFrame([dict(row)]))[0]
        if isinstance(run, PresetResult):
            scores_by_preset[name] = {
                key: value if isfinite(value) else None for key, value in run.scores.items()
            }
    return scores_by_preset


def summary_text(
    folder: Path,
    cells: Collection[RunKey],
    metrics: Sequence[str] = (PRESET,),
    *,
    whole: bool = True,
) -> str:
    """Return the tables of selected runs of an experiment for a terminal.

    `whole`: with the rows of every sequence, also if there are rows of means.
    """
    option = "" if tuple(metrics) == (PRESET,) else f" --metrics {','.join(metrics)}"
    more = f"`trackmark report {folder}{option} --wide`"
    report = preset_report(folder, metrics, cells)
    tables = report.tables if whole else map(_means_only, report.tables)
    return "\n\n".join("\n".join(terminal_lines(table, more)) for table in tables)


def _means_only(table: Table) -> Table:
    """Return a table with only its rows over all sequences, if it has any."""
    rows = [row for row in table.rows if row[0].text in (TOGETHER, MEANS)]
    return replace(table, rows=rows) if rows else table


def _judge_runs(folder: Path, name: str, runs: pd.DataFrame) -> dict[int, ScoredRun]:
    """Score finished and failed runs by a preset; return results by row.

    Failed runs have the worst scores. Trackers whose runs all failed are omitted.
    """
    results, truth = Results(folder), cache(partial(read_truth, folder))
    left_out = runs["tracker"].isin(failed_runs(runs).left_out)
    ended = runs[runs["status"].isin(["finished", "failed"]) & ~left_out]
    return {
        number: _judge_run(
            results.read(run_key(row)), truth(row["sequence"], row["fingerprint"]), name
        )
        for number, row in zip(ended.index.tolist(), ended.to_dict("records"), strict=True)
    }


def _judge_run(run: Run, truth: StoredTruth, name: str) -> ScoredRun:
    """Return the scores of a run with its late estimates, or why a preset cannot score it."""
    try:
        if run.failure:
            return judge_failed(run, truth, name)
        judged = score_run(run, truth, name)
    except ValueError as error:  # raised by a preset that cannot score the run
        return str(error)
    if run.source_frames is None:
        return judged
    frames = np.flatnonzero(run.source_frames >= 0)[1:]
    late = float(np.mean(run.source_frames[frames] != frames)) if len(frames) else nan
    return replace(judged, scores={**judged.scores, LATE.name: late})


def _scores(scored: Mapping[int, ScoredRun], columns: list[str]) -> pd.DataFrame:
    """Return the scores of runs by row."""
    scores = {row: dict(run.scores) for row, run in scored.items() if isinstance(run, PresetResult)}
    return pd.DataFrame.from_dict(scores, "index", columns=columns)


class ScoredRuns:
    """Runs by one protocol with their scores by one preset.

    `runs`: as `load_runs` returns them. `stored`: stored name of the protocol. `title`: start of
    the caption.
    """

    def __init__(
        self, folder: Path, name: str, runs: pd.DataFrame, stored: str, title: str = ""
    ) -> None:
        runs = complete(runs[runs["protocol"] == stored]).reset_index(drop=True)
        runs = runs.astype(dict.fromkeys(["tracker", "sequence", "status"], str))
        scored = _judge_runs(folder, name, runs)
        self.stored = stored
        self.name, self.title, self.preset = name, title, metrics_preset(name)
        self.judged = {row: run for row, run in scored.items() if isinstance(run, PresetResult)}
        self.refused = {row: run for row, run in scored.items() if isinstance(run, str)}
        late = [LATE] if any(LATE.name in run.scores for run in self.judged.values()) else []
        measures = [_measure(key, column) for key, column in self.preset.columns.items()]
        self.measures = [*(SUMMARY if name == PRESET else measures), *late]
        labels = runs[["tracker", "sequence", "repetition", "status", "failure"]].copy()
        labels.loc[list(self.refused), "status"] = NOT_SCORED
        names = [*self.preset.columns, *(measure.name for measure in late)]
        self.runs = labels.join(_scores(scored, names))
        self.together = {
            str(tracker): self.overall(rows)
            for tracker, rows in self.runs.groupby("tracker", sort=False)
            if counted(rows, self.measures[0].name).all()
        }

    def overall(self, rows: pd.DataFrame) -> PresetResult:
        """Combine the runs of a tracker."""
        by_sequence = [
            [self.judged[row] for row in sequence_rows.index if row in self.judged]
            for _, sequence_rows in rows.groupby("sequence", sort=False)
        ]
        return self.preset.overall(by_sequence)

    def report(self) -> PresetScores:
        """Return the table and the curves."""
        table = sequence_table(self.runs, self.measures, self.title, self.name)
        if len(self.runs["sequence"].unique()) > 1:
            table = self._with_means(table)
        reasons = dict.fromkeys(f"{NOT_SCORED}: {why}" for why in self.refused.values())
        notes = [*list(reasons)[:_MAX_NOTES], *self._undefined_notes()]
        name = f"{table_prefix(self.stored)}metrics-{self.name}"
        table = replace(table, name=name, notes=[*table.notes, *notes])
        if notes and not self.judged:  # the table would have no scores
            caption = f"{self.title}; metrics preset {self.name}: nothing scored."
            table = replace(table, rows=[], caption=caption, notes=notes)
        curves = {
            curve: {
                tracker: result.curves[curve]
                for tracker, result in self.together.items()
                if curve in result.curves
            }
            for curve in self.preset.curves
        }
        return PresetScores(self.name, self.title, table, curves)

    def _undefined_notes(self) -> list[str]:
        """Return why runs have no scores although the preset can score them."""
        first = self.measures[0].name
        rows = self.runs.loc[list(self.judged)]
        sequences = list(dict.fromkeys(rows.loc[rows[first].isna(), "sequence"]))
        if not sequences or not self.preset.undefined:
            return []
        more = f" and {len(sequences) - _MAX_NAMES} more" if len(sequences) > _MAX_NAMES else ""
        return [f"{MISSING}: {self.preset.undefined}: {', '.join(sequences[:_MAX_NAMES])}{more}"]

    def _with_means(self, table: Table) -> Table:
        """Return the table with additional first rows over all sequences.

        If the preset has unequal weights of sequences, its own scores come first, without
        intervals, and the means over units follow.
        """
        whole = {name: nan for name, column in self.preset.columns.items() if column.whole}
        runs = self.runs.assign(**whole)
        means = mean_table(runs, self.measures, "", self.name, skip_undefined=True)
        sequences = [str(name) for name in runs["sequence"].unique()]
        units = units_of(sequences)
        label, words = TOGETHER, means_over(sequences, len(units))
        rows, data = list[list[TableCell]](), list[pd.DataFrame]()
        if self.preset.combine is not mean_of_sequences:
            label = MEANS
            words += f"; {TOGETHER}: weighted as the preset defines, without interval"
            if self.together:
                together = self._together_table()
                rows += [[*row[:2], *map(_without_interval, row[2:])] for row in together.rows]
                counts = together.data["tracker"].map(runs["tracker"].value_counts())
                data.append(together.data.assign(runs=counts))
        rows += [[TableCell(label), *row] for row in means.rows]
        data.append(means.data.assign(sequence=label))
        columns = [measure.name for measure in self.measures if measure.name not in whole]
        scores = runs.loc[counted(runs, self.measures[0].name), columns]
        undefined = f"{MISSING}: undefined in a run; the mean over all sequences omits this run"
        meaning = meaning_of_intervals(units)
        return replace(
            table,
            caption=f"{table.caption} {label.capitalize()}: {words}. {meaning}",
            rows=rows + table.rows,
            notes=[*table.notes, *([undefined] if scores.isna().any(axis=None) else [])],
            data=pd.concat([*data, table.data], ignore_index=True)[list(table.data)],
        )

    def _together_table(self) -> Table:
        """Return a table of the preset's own scores over all sequences."""
        frame = pd.DataFrame(
            {"tracker": tracker, "sequence": TOGETHER, "repetition": 0, **run.scores}
            for tracker, run in self.together.items()
        ).assign(status="finished", failure="")
        return sequence_table(frame, self.measures, "", self.name)


def measures_of(preset: str) -> list[ScoreMeasure]:
    """Return the scores of a preset that have a mean over sequences."""
    if preset == PRESET:
        return list(SUMMARY)
    columns = metrics_preset(preset).columns
    return [_measure(name, column) for name, column in columns.items() if not column.whole]


def _measure(name: str, column: Column) -> ScoreMeasure:
    """Return a score of a preset as a column; scores of which higher is better are shares."""
    share = column.better == "higher"
    return ScoreMeasure(
        name,
        heading(name),
        direction=column.better,
        decimals=3 if column.better else 0,
        least=0.0,
        most=1.0 if share else inf,
        margin=MARGIN if share else 0.0,
    )


def _without_interval(cell: TableCell) -> TableCell:
    """Return the cell with a dash in place of an interval."""
    return cell if cell.text == MISSING else replace(cell, text=f"{cell.text} –")
