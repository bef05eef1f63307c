"""Tables and curves of stored runs by any metrics presets: nothing is run again.

Each run is read once and judged by all presets that are asked for, and what a tracker's runs make
together is what the preset says: means of sequences, or of frames, or a curve over lengths.
"""

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from math import inf, isfinite, nan
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from trackmark.bench.evaluation.scoring import can_judge, judge
from trackmark.bench.metrics import preset as metrics_preset
from trackmark.bench.metrics.preset import Column, Judged, heading, mean_of_sequences
from trackmark.bench.protocols import STORED_ONCE, TIMING, ProtocolError, protocol
from trackmark.bench.protocols import title as title_of_protocol
from trackmark.bench.reporting.failed_runs import failed_runs, judge_failed
from trackmark.bench.reporting.tables import PRESET, SUMMARY, mean_table, tables, title_of
from trackmark.bench.statistics.rules import MARGIN
from trackmark.bench.store.files import ResultsError
from trackmark.bench.store.layout import Cell, cell_of
from trackmark.bench.store.loading import load_results
from trackmark.bench.store.results import Results
from trackmark.bench.store.truth import read_truth
from trackmark.reports.renderers import to_text
from trackmark.reports.table_width import on_terminal
from trackmark.reports.tables import MISSING, Measure, Table, complete, counted, sequence_table
from trackmark.reports.tables import Cell as TableCell

TOGETHER = "all sequences"
"""What stands for the sequences in rows of what a preset makes of them together."""

MEANS = "mean of sequences"
"""The same in rows of means over units, of presets that weight sequences otherwise."""

LATE = Measure("late_share", "late answers", "%", None, 1, scale=100, rank=-1)
"""Frames after the first for which an answer to an earlier one stood, in real time."""

NOT_SCORED = "not scored"
"""Status of finished runs that a preset can't judge: of another protocol than it is for."""

_MOST_NOTES = 3  # on runs that can't be judged; the others have reasons alike


@dataclass(frozen=True)
class Scored:
    """An experiment's runs as one preset scores them."""

    preset: str
    title: str
    table: Table
    curves: Mapping[str, Mapping[str, NDArray[Any]]]  # by curve, then tracker; whole ones alone


def protocols_in(folder: Path, cells: Collection[Cell] | None = None) -> list[str]:
    """Return protocols of an experiment's runs except timing runs, one-pass first."""
    stored = set(map(str, load_results(folder, cells)["protocol"].unique()))
    return sorted(stored - {TIMING}, key=lambda name: (name != STORED_ONCE, name))


def fitting(names: Sequence[str], stored: str) -> list[str]:
    """Return the presets for runs that are filed under the protocol `stored`.

    The protocol's own preset replaces `native`, which is kept if it can judge such runs.
    """
    if stored in (STORED_ONCE, TIMING):
        return list(names)
    try:
        own = [protocol(stored).preset]
    except ProtocolError:  # protocol of a later version of trackmark
        return list(names)
    own += [PRESET] if can_judge(PRESET, stored) else []
    return list(dict.fromkeys(fit for name in names for fit in (own if name == PRESET else [name])))


def beside_native(
    folder: Path, names: Sequence[str], cells: Collection[Cell] | None = None, title: str = ""
) -> list[Scored]:
    """Score all runs that `bench.reporting.tables` has no tables of: other presets and protocols.

    Parameters and errors as for `by_presets`; see `fitting` for the presets of other protocols.
    """
    protocols = protocols_in(folder, cells)
    scored: list[Scored] = []
    for stored in protocols:
        presets = fitting(names, stored)
        if stored == STORED_ONCE:
            presets = [name for name in presets if name != PRESET]
        caption = _headed(title or title_of(folder), stored, protocols)
        scored += by_presets(folder, presets, cells, caption, stored) if presets else []
    return scored


def _headed(text: str, stored: str, protocols: Sequence[str]) -> str:
    """Add the protocol to a title unless all runs are one-pass."""
    one_pass = set(protocols) <= {STORED_ONCE}
    return text if one_pass else f"{text}, protocol {title_of_protocol(stored)}"


def by_presets(
    folder: Path,
    names: Sequence[str],
    cells: Collection[Cell] | None = None,
    title: str = "",
    stored: str = STORED_ONCE,
) -> list[Scored]:
    """Score the runs of an experiment by one protocol with presets.

    `folder`: of its results. `names`: of the presets. `cells`: selected runs, all by default.
    `title`: start of captions. `stored`: name that runs by the protocol are filed under. Raises
    `ResultsError` if a file cannot be read.
    """
    runs = load_results(folder, cells)
    runs = complete(runs[runs["protocol"] == stored]).reset_index(drop=True)
    runs = runs.astype(dict.fromkeys(["tracker", "sequence", "status"], str))
    if runs.empty:
        return []
    judged = _judged(folder, names, runs)
    title, prefix = title or title_of(folder), "" if stored == STORED_ONCE else table_prefix(stored)
    return [_scored(name, runs, judged[name], title, prefix) for name in names]


def table_prefix(stored: str) -> str:
    """Return the start of the names of tables of runs by another protocol than one-pass."""
    return re.sub(r"[^a-z0-9.]+", "-", stored) + "-"


def runs_by(folder: Path, name: str, runs: pd.DataFrame, stored: str = STORED_ONCE) -> pd.DataFrame:
    """Return runs with a preset's scores as columns, which replace those of the same name.

    `runs`: as `load_results` returns them, of which those by one protocol are scored. Also raises
    `ResultsError` for a run that the preset cannot judge.
    """
    finished = runs[(runs["protocol"] == stored) & (runs["status"] == "finished")]
    judged = _judged(folder, [name], finished)[name]
    if refused := [message for message in judged.values() if isinstance(message, str)]:
        raise ResultsError(refused[0])
    columns = list(metrics_preset(name).columns)
    return runs.drop(columns=columns, errors="ignore").join(_frame(judged, columns))


def _frame(judged: Mapping[int, Judged | str], columns: list[str]) -> pd.DataFrame:
    """Return the scores of judged runs by row."""
    scores = {row: dict(run.scores) for row, run in judged.items() if isinstance(run, Judged)}
    return pd.DataFrame.from_dict(scores, "index", columns=columns)


def scores_by(folder: Path, row: Mapping[str, Any], names: Sequence[str]) -> dict[str, Any]:
    """Return scores of a run by name of preset, None for a preset that cannot judge it.

    `row`: of the run, as `bench.store.index` has it.
    """
    if row["status"] != "finished" or row["protocol"] == TIMING:
        return dict.fromkeys(names)
    judged = _judged(folder, names, pd.DataFrame([dict(row)]))
    return {
        name: {key: value if isfinite(value) else None for key, value in run.scores.items()}
        if isinstance(run := runs[0], Judged)
        else None
        for name, runs in judged.items()
    }


def _judged(
    folder: Path, names: Sequence[str], runs: pd.DataFrame
) -> dict[str, dict[int, Judged | str]]:
    """What presets make of finished and failed runs, by place in the frame; or why they can't.

    Failed runs have the worst scores; those of trackers whose every run failed are left out.
    """
    results, truth = Results(folder), cache(partial(read_truth, folder))
    judged: dict[str, dict[int, Judged | str]] = {name: {} for name in names}
    left_out = runs["tracker"].isin(failed_runs(runs).left_out)
    ended = runs[runs["status"].isin(["finished", "failed"]) & ~left_out]
    for number, row in zip(ended.index.tolist(), ended.to_dict("records"), strict=True):
        run = results.read(cell_of(row))
        for name in names:
            judges = judge_failed if run.failure else judge
            try:
                found: Judged | str = judges(run, truth(row["sequence"], row["fingerprint"]), name)
                if run.answered is not None and not run.failure and isinstance(found, Judged):
                    found = replace(found, scores={**found.scores, LATE.name: _late(run.answered)})
            except ValueError as error:  # the preset says why it can't judge such a run
                found = str(error)
            judged[name][number] = found
    return judged


def _late(answered: NDArray[np.int32]) -> float:
    """Share of the frames after the first with an answer to an earlier one."""
    asked = np.flatnonzero(answered >= 0)[1:]
    return float(np.mean(answered[asked] != asked)) if len(asked) else nan


def tables_by(
    folder: Path,
    names: Sequence[str],
    cells: Collection[Cell] | None = None,
    title: str = "",
    scored: Sequence[Scored] | None = None,
) -> list[Table]:
    """Tables of an experiment by presets; `native` has those of `bench.reporting.tables`.

    Runs in one pass come first, and of these the presets as they are named.
    `scored`: what `beside_native` gave, where it was asked already.
    """
    scored = beside_native(folder, names, cells, title) if scored is None else scored
    made = [one.table for one in scored]
    if PRESET in names:
        there = protocols_in(folder, cells)
        own = tables(folder, cells, _headed(title or title_of(folder), STORED_ONCE, there))
        place = names.index(PRESET) if STORED_ONCE in there else 0
        made[place:place] = own
    return made


def summary_text(folder: Path, cells: Collection[Cell], metrics: Sequence[str] = (PRESET,)) -> str:
    """Tables of some runs of an experiment for a terminal."""
    given = "" if tuple(metrics) == (PRESET,) else f" --metrics {','.join(metrics)}"
    more = f" (`trackmark report {folder}{given} --wide`)"
    made = tables_by(folder, metrics, cells)
    return "\n".join(on_terminal(table, to_text, more) for table in made)


def write_curves(
    folder: Path,
    scored: Collection[Scored],
    trackers: Sequence[str],
    tell: Callable[[str], None],
    suffix: str = ".png",
) -> list[Path]:
    """Draw the curves of presets into a folder, and give the files.

    `trackers`: all of the report, in the order of their colours. `tell` is given a sentence on
    every preset that has no tracker's curve. `suffix`: of the files, see
    `reports.figures.write_for_papers`. Raises `OSError`.
    """
    from trackmark.reports.figures import write_for_papers  # brings what draws
    from trackmark.reports.plots import curve_plot

    paths = []
    for one in scored:
        if one.curves and not any(one.curves.values()):
            why = f"there is no tracker all of whose runs {one.preset} can judge."
            tell(f"{one.table.name}: no plot: {why}")
            continue
        for name, axes in metrics_preset(one.preset).curves.items():
            title = f"{one.title}: {heading(name)}, metrics preset {one.preset}"
            figure = curve_plot(one.curves.get(name, {}), axes.x, axes.y, title, trackers)
            path = folder / f"{one.table.name}-{name.replace('_', '-')}{suffix}"
            paths += write_for_papers(path, figure)
    return paths


def _scored(
    name: str, runs: pd.DataFrame, judged: Mapping[int, Judged | str], title: str, prefix: str
) -> Scored:
    """Return the table and the curves of one preset."""
    preset = metrics_preset(name)
    refused = {row: run for row, run in judged.items() if isinstance(run, str)}
    late = any(LATE.name in run.scores for run in judged.values() if isinstance(run, Judged))
    shown = runs[["tracker", "sequence", "repetition", "status", "failure"]].copy()
    shown.loc[list(refused), "status"] = NOT_SCORED
    shown = shown.join(_frame(judged, [*preset.columns, *([LATE.name] if late else [])]))
    measures = [_measure(key, column) for key, column in preset.columns.items()]
    measures = [*(SUMMARY if name == PRESET else measures), *([LATE] if late else [])]
    table = sequence_table(shown, measures, title, name)
    together = {
        str(tracker): preset.overall(
            [
                [run for row in rows.index if isinstance(run := judged[row], Judged)]
                for _, rows in of_tracker.groupby("sequence", sort=False)
            ]
        )
        for tracker, of_tracker in shown.groupby("tracker", sort=False)
        if counted(of_tracker, measures[0].name).all()
    }
    if len(shown["sequence"].unique()) > 1:
        table = _with_means(table, name, shown, measures, together)
    curves = {
        curve: {name: one.curves[curve] for name, one in together.items() if curve in one.curves}
        for curve in preset.curves
    }
    reasons = list(dict.fromkeys(f"{NOT_SCORED}: {why}" for why in refused.values()))[:_MOST_NOTES]
    table = replace(table, name=f"{prefix}metrics-{name}", notes=[*table.notes, *reasons])
    if reasons and len(refused) == len(judged):  # all rows would be dashes
        caption = f"{title}; metrics preset {name}: nothing scored."
        table = replace(table, rows=[], caption=caption, notes=reasons)
    return Scored(name, title, table, curves)


def _measure(name: str, column: Column) -> Measure:
    """Return a preset's score as a column: those of which more is better are shares."""
    share = column.better == "higher"
    return Measure(
        name,
        heading(name),
        direction=column.better,
        decimals=3 if column.better else 0,
        least=0.0,
        most=1.0 if share else inf,
        margin=MARGIN if share else 0.0,
    )


def _with_means(
    table: Table,
    preset_name: str,
    shown: pd.DataFrame,
    measures: Sequence[Measure],
    together: Mapping[str, Judged],
) -> Table:
    """Return the table with rows over all sequences before those of each.

    If the preset does not average sequences with equal weight, its own figures come first, without
    intervals, and the means over units follow.
    """
    preset = metrics_preset(preset_name)
    whole = {name: nan for name, column in preset.columns.items() if column.whole}
    means = mean_table(shown.assign(**whole), measures, "", preset_name, skip_undefined=True)
    label = TOGETHER
    words, _, meaning = means.caption.removeprefix(": ").partition(
        f"; metrics preset {preset_name}"
    )
    rows, data = list[list[TableCell]](), list[pd.DataFrame]()
    if preset.combine is not mean_of_sequences:
        label, words = MEANS, f"{words}; {TOGETHER}: as the preset weights them, without interval"
        frame = pd.DataFrame(
            {"tracker": tracker, "sequence": TOGETHER, "repetition": 0, **run.scores}
            for tracker, run in together.items()
        ).assign(status="finished", failure="")
        if len(frame):
            own = sequence_table(frame, measures, "", preset_name)
            rows += [[*row[:2], *map(_without_interval, row[2:])] for row in own.rows]
            counts = own.data["tracker"].map(shown["tracker"].value_counts())
            data.append(own.data.assign(runs=counts))
    rows += [[TableCell(label), *row] for row in means.rows]
    data.append(means.data.assign(sequence=label))
    columns = [measure.name for measure in measures if measure.name not in whole]
    scored = shown.loc[counted(shown, measures[0].name), columns]
    undefined = f"{MISSING}: undefined in a run, which the mean over all sequences leaves out"
    return replace(
        table,
        caption=f"{table.caption} {label.capitalize()}: {words}{meaning}",
        rows=rows + table.rows,
        notes=[*table.notes, *([undefined] if scored.isna().any(axis=None) else [])],
        data=pd.concat([*data, table.data], ignore_index=True)[list(table.data)],
    )


def _without_interval(cell: TableCell) -> TableCell:
    """Return the cell with a dash in place of an interval."""
    return cell if cell.text == MISSING else replace(cell, text=f"{cell.text} –")
