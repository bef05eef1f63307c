"""Tables and curves of stored runs by any metrics presets; nothing is run again.

Each run is judged by all requested presets. A preset defines what a tracker's runs make together:
means over sequences or frames, or a curve over lengths.
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

from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.evaluation.scoring import can_judge, judge
from trackmark.bench.metrics import preset as metrics_preset
from trackmark.bench.metrics.preset import Column, Preset, PresetResult, heading, mean_of_sequences
from trackmark.bench.protocols import STORED_ONE_PASS, TIMING, ProtocolError, parse_protocol
from trackmark.bench.protocols import title as title_of_protocol
from trackmark.bench.reporting.failed_runs import failed_runs, judge_failed
from trackmark.bench.reporting.tables import (
    PRESET,
    SUMMARY,
    mean_table,
    meaning_of_intervals,
    tables,
    title_of,
)
from trackmark.bench.statistics.rules import MARGIN
from trackmark.bench.statistics.units import units_of
from trackmark.bench.store.data_frames import load_results
from trackmark.bench.store.files import ResultsError
from trackmark.bench.store.layout import RunKey, run_key
from trackmark.bench.store.results import Results
from trackmark.bench.store.truth import StoredTruth, read_truth
from trackmark.reports.renderers import to_text
from trackmark.reports.table_width import on_terminal
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
"""Label of rows with a preset's figures over all sequences."""

MEANS = "mean of sequences"
"""Label of rows with means over units, if the preset weights sequences in another way."""

LATE = ScoreMeasure("late_share", "late answers", "%", None, 1, scale=100, rank=-1)
"""Frames after the first that have an estimate of an earlier frame, in real-time evaluation."""

NOT_SCORED = "not scored"
"""Status of finished runs that a preset cannot judge."""

_MOST_NOTES = 3
"""Maximum number of notes on runs that cannot be judged."""

Verdict = PresetResult | str
"""Judgement of a run by a preset, or the reason why the preset cannot judge it."""


@dataclass(frozen=True)
class Scored:
    """Runs of an experiment by one protocol as one preset scores them."""

    preset: str
    title: str
    table: Table
    curves: Mapping[str, Mapping[str, NDArray[Any]]]  # by curve and tracker; complete ones only


class PresetReport(NamedTuple):
    """Tables of an experiment, and the scores behind those that are not `native`."""

    tables: list[Table]
    scored: list[Scored]


def preset_report(
    folder: Path, names: Sequence[str], cells: Collection[RunKey] | None = None, title: str = ""
) -> PresetReport:
    """Score the runs of an experiment by presets.

    One-pass runs come first, and their presets in the order of `names`; `native` has the tables of
    `bench.reporting.tables`. `folder`: of the results. `cells`: selected runs, all by default.
    `title`: start of captions. Raises `ResultsError` if a file cannot be read.
    """
    runs = load_results(folder, cells)
    stored_names = sorted(
        set(map(str, runs["protocol"].unique())) - {TIMING},
        key=lambda name: (name != STORED_ONE_PASS, name),
    )
    title = title or title_of(folder)
    named = not set(stored_names) <= {STORED_ONE_PASS}  # captions name the protocol
    scored: list[Scored] = []
    for stored in stored_names:
        presets = presets_for(names, stored)
        if stored == STORED_ONE_PASS:
            presets = [name for name in presets if name != PRESET]
        scored += score_runs(folder, presets, runs, _headed(title, stored, named), stored)
    made = [one.table for one in scored]
    if PRESET in names:
        place = names.index(PRESET) if STORED_ONE_PASS in stored_names else 0
        made[place:place] = tables(folder, cells, _headed(title, STORED_ONE_PASS, named))
    return PresetReport(made, scored)


def _headed(title: str, stored: str, named: bool) -> str:
    return f"{title}, protocol {title_of_protocol(stored)}" if named else title


def presets_for(names: Sequence[str], stored: str) -> list[str]:
    """Return the presets for runs that are filed under the protocol `stored`.

    The protocol's own preset replaces `native`, which is kept if it can judge such runs.
    """
    if stored in (STORED_ONE_PASS, TIMING):
        return list(names)
    try:
        own = [parse_protocol(stored).preset]
    except ProtocolError:  # protocol of a later version of trackmark
        return list(names)
    own += [PRESET] if can_judge(PRESET, stored) else []
    return list(dict.fromkeys(fit for name in names for fit in (own if name == PRESET else [name])))


def table_prefix(stored: str) -> str:
    """Return the start of the names of tables of runs by another protocol than one-pass."""
    return "" if stored == STORED_ONE_PASS else re.sub(r"[^a-z0-9.]+", "-", stored) + "-"


def score_runs(
    folder: Path,
    names: Sequence[str],
    runs: pd.DataFrame,
    title: str,
    stored: str = STORED_ONE_PASS,
) -> list[Scored]:
    """Score the runs by the protocol `stored` with presets.

    `runs`: as `load_results` returns them. `title`: start of captions.
    """
    own = complete(runs[runs["protocol"] == stored]).reset_index(drop=True)
    own = own.astype(dict.fromkeys(["tracker", "sequence", "status"], str))
    if own.empty or not names:
        return []
    verdicts = _judge_runs(folder, names, own)
    prefix = table_prefix(stored)
    return [_PresetTable(name, own, verdicts[name], title).scored(prefix) for name in names]


def runs_by(
    folder: Path, name: str, runs: pd.DataFrame, stored: str = STORED_ONE_PASS
) -> pd.DataFrame:
    """Return runs with a preset's scores as columns, which replace those of the same name.

    `runs`: as `load_results` returns them, of which those by one protocol are scored. Also raises
    `ResultsError` for a run that the preset cannot judge.
    """
    finished = runs[(runs["protocol"] == stored) & (runs["status"] == "finished")]
    verdicts = _judge_runs(folder, [name], finished)[name]
    if refused := [message for message in verdicts.values() if isinstance(message, str)]:
        raise ResultsError(refused[0])
    columns = list(metrics_preset(name).columns)
    return runs.drop(columns=columns, errors="ignore").join(_scores(verdicts, columns))


def scores_by(folder: Path, row: Mapping[str, Any], names: Sequence[str]) -> dict[str, Any]:
    """Return scores of a run by name of preset, None for a preset that cannot judge it.

    `row`: of the run, as `bench.store.run_rows` has it.
    """
    if row["status"] != "finished" or row["protocol"] == TIMING:
        return dict.fromkeys(names)
    found: dict[str, Any] = {}
    for name, verdicts in _judge_runs(folder, names, pd.DataFrame([dict(row)])).items():
        run = verdicts[0]
        known = run.scores if isinstance(run, PresetResult) else None
        found[name] = known and {key: v if isfinite(v) else None for key, v in known.items()}
    return found


def summary_text(
    folder: Path, cells: Collection[RunKey], metrics: Sequence[str] = (PRESET,)
) -> str:
    """Return tables of some runs of an experiment for a terminal."""
    option = "" if tuple(metrics) == (PRESET,) else f" --metrics {','.join(metrics)}"
    more = f" (`trackmark report {folder}{option} --wide`)"
    made = preset_report(folder, metrics, cells).tables
    return "\n".join(on_terminal(table, to_text, more) for table in made)


def _judge_runs(
    folder: Path, names: Sequence[str], runs: pd.DataFrame
) -> dict[str, dict[int, Verdict]]:
    """Judge finished and failed runs by presets; return verdicts by preset and row.

    Failed runs have the worst scores; those of trackers whose every run failed are left out.
    """
    results, truth = Results(folder), cache(partial(read_truth, folder))
    verdicts: dict[str, dict[int, Verdict]] = {name: {} for name in names}
    left_out = runs["tracker"].isin(failed_runs(runs).left_out)
    ended = runs[runs["status"].isin(["finished", "failed"]) & ~left_out]
    for number, row in zip(ended.index.tolist(), ended.to_dict("records"), strict=True):
        run = results.read(run_key(row))
        for name in names:
            verdicts[name][number] = _judge_run(
                run, truth(row["sequence"], row["fingerprint"]), name
            )
    return verdicts


def _judge_run(run: Run, truth: StoredTruth, name: str) -> Verdict:
    """Return what a preset makes of a run, with late answers, or why it cannot judge the run."""
    try:
        if run.failure:
            return judge_failed(run, truth, name)
        judged = judge(run, truth, name)
    except ValueError as error:  # the preset states why it cannot judge such a run
        return str(error)
    if run.answered is None:
        return judged
    frames = np.flatnonzero(run.answered >= 0)[1:]
    late = float(np.mean(run.answered[frames] != frames)) if len(frames) else nan
    return replace(judged, scores={**judged.scores, LATE.name: late})


def _scores(verdicts: Mapping[int, Verdict], columns: list[str]) -> pd.DataFrame:
    """Return the scores of judged runs by row."""
    scores = {
        row: dict(run.scores) for row, run in verdicts.items() if isinstance(run, PresetResult)
    }
    return pd.DataFrame.from_dict(scores, "index", columns=columns)


class _PresetTable:
    """Runs by one protocol with a preset's scores, and their table."""

    def __init__(
        self, name: str, runs: pd.DataFrame, verdicts: Mapping[int, Verdict], title: str
    ) -> None:
        self.name, self.title, self.preset = name, title, metrics_preset(name)
        self.judged = {row: run for row, run in verdicts.items() if isinstance(run, PresetResult)}
        self.refused = {row: run for row, run in verdicts.items() if isinstance(run, str)}
        late = [LATE] if any(LATE.name in run.scores for run in self.judged.values()) else []
        own = [_measure(key, column) for key, column in self.preset.columns.items()]
        self.measures = [*(SUMMARY if name == PRESET else own), *late]
        shown = runs[["tracker", "sequence", "repetition", "status", "failure"]].copy()
        shown.loc[list(self.refused), "status"] = NOT_SCORED
        names = [*self.preset.columns, *(measure.name for measure in late)]
        self.runs = shown.join(_scores(verdicts, names))
        self.together = {
            str(tracker): _overall(self.preset, rows, self.judged)
            for tracker, rows in self.runs.groupby("tracker", sort=False)
            if counted(rows, self.measures[0].name).all()
        }

    def scored(self, prefix: str) -> Scored:
        """Return the table, whose name starts with `prefix`, and the curves."""
        table = sequence_table(self.runs, self.measures, self.title, self.name)
        if len(self.runs["sequence"].unique()) > 1:
            table = self._with_means(table)
        reasons = dict.fromkeys(f"{NOT_SCORED}: {why}" for why in self.refused.values())
        notes = list(reasons)[:_MOST_NOTES]
        table = replace(table, name=f"{prefix}metrics-{self.name}", notes=[*table.notes, *notes])
        if notes and not self.judged:  # all cells would be dashes
            caption = f"{self.title}; metrics preset {self.name}: nothing scored."
            table = replace(table, rows=[], caption=caption, notes=notes)
        curves = {
            curve: {k: one.curves[curve] for k, one in self.together.items() if curve in one.curves}
            for curve in self.preset.curves
        }
        return Scored(self.name, self.title, table, curves)

    def _with_means(self, table: Table) -> Table:
        """Return the table with rows over all sequences before those of each.

        If the preset does not average sequences with equal weight, its own figures come first,
        without intervals, and the means over units follow.
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
            words += f"; {TOGETHER}: as the preset weights them, without interval"
            if self.together:
                own = self._together_table()
                rows += [[*row[:2], *map(_without_interval, row[2:])] for row in own.rows]
                counts = own.data["tracker"].map(runs["tracker"].value_counts())
                data.append(own.data.assign(runs=counts))
        rows += [[TableCell(label), *row] for row in means.rows]
        data.append(means.data.assign(sequence=label))
        columns = [measure.name for measure in self.measures if measure.name not in whole]
        scores = runs.loc[counted(runs, self.measures[0].name), columns]
        undefined = f"{MISSING}: undefined in a run, which the mean over all sequences leaves out"
        meaning = meaning_of_intervals(units)
        return replace(
            table,
            caption=f"{table.caption} {label.capitalize()}: {words}. {meaning}",
            rows=rows + table.rows,
            notes=[*table.notes, *([undefined] if scores.isna().any(axis=None) else [])],
            data=pd.concat([*data, table.data], ignore_index=True)[list(table.data)],
        )

    def _together_table(self) -> Table:
        """Return a table of the preset's own figures over all sequences."""
        frame = pd.DataFrame(
            {"tracker": tracker, "sequence": TOGETHER, "repetition": 0, **run.scores}
            for tracker, run in self.together.items()
        ).assign(status="finished", failure="")
        return sequence_table(frame, self.measures, "", self.name)


def _overall(
    preset: Preset, rows: pd.DataFrame, judged: Mapping[int, PresetResult]
) -> PresetResult:
    """Return what the runs of a tracker make together."""
    by_sequence = [
        [judged[row] for row in its.index if row in judged]
        for _, its in rows.groupby("sequence", sort=False)
    ]
    return preset.overall(by_sequence)


def _measure(name: str, column: Column) -> ScoreMeasure:
    """Return a preset's score as a column; scores of which more is better are shares."""
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
