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

from bench.evaluation.scoring import can_judge, judge
from bench.metrics import preset as metrics_preset
from bench.metrics.preset import Column, Judged, Preset, heading, mean_of_sequences
from bench.protocols import STORED_ONCE, TIMING, ProtocolError, protocol
from bench.protocols import title as title_of_protocol
from bench.reporting.failed_runs import failed_runs, judge_failed
from bench.reporting.tables import PRESET, SUMMARY, mean_table, tables, title_of
from bench.statistics.rules import MARGIN
from bench.store.files import ResultsError
from bench.store.layout import Cell, run_path
from bench.store.loading import load_results
from bench.store.results import Results
from bench.store.truth import read_truth
from reports.fitting import on_terminal
from reports.notes import counted
from reports.renderers import to_text
from reports.tables import MISSING, Measure, Table, complete, sequence_table
from reports.tables import Cell as TableCell

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
    """Protocols of an experiment's runs, as these are filed under them, one pass first.

    Parameters as of `by_presets`. Timing runs are left out.
    """
    there = set(map(str, load_results(folder, cells)["protocol"].unique()))
    return sorted(there - {TIMING}, key=lambda name: (name != STORED_ONCE, name))


def fitting(names: Sequence[str], stored: str) -> list[str]:
    """Presets for runs by a protocol: for `native` its own stands, and `native` too, if it can.

    `names`: of those that are asked for. `stored`: what runs by the protocol are filed under.
    """
    if stored in (STORED_ONCE, TIMING):
        return list(names)
    try:
        own = [protocol(stored).preset]
    except ProtocolError:  # of a later trackmark, which knows by what to judge it
        return list(names)
    own += [PRESET] if can_judge(PRESET, stored) else []
    found = [one for name in names for one in (own if name == PRESET else [name])]
    return list(dict.fromkeys(found))


def beside_native(
    folder: Path, names: Sequence[str], cells: Collection[Cell] | None = None, title: str = ""
) -> list[Scored]:
    """All that `bench.reporting.tables` has no tables of: other presets, other protocols.

    Parameters and errors as of `by_presets`; see `fitting` for runs by other protocols.
    """
    there = protocols_in(folder, cells)
    scored: list[Scored] = []
    for stored in there:
        found = fitting(names, stored)
        if stored == STORED_ONCE:
            found = [name for name in found if name != PRESET]
        headed = _headed(title or title_of(folder), stored, there)
        scored += by_presets(folder, found, cells, headed, stored) if found else []
    return scored


def _headed(text: str, stored: str, there: Sequence[str]) -> str:
    """A title that says the protocol, unless all there is was run in one pass."""
    return text if set(there) <= {STORED_ONCE} else f"{text}, protocol {title_of_protocol(stored)}"


def by_presets(
    folder: Path,
    names: Sequence[str],
    cells: Collection[Cell] | None = None,
    title: str = "",
    stored: str = STORED_ONCE,
) -> list[Scored]:
    """Score the runs of an experiment that were made by one protocol, by presets.

    `folder`: of its results. `names`: of the presets. `cells`: the runs that are meant, all by
    default. `title`: what captions begin with. `stored`: what runs by the protocol are filed under.
    Raises `ResultsError` for a file that can't be read.
    """
    runs = load_results(folder, cells)
    runs = complete(runs[runs["protocol"] == stored]).reset_index(drop=True)
    runs = runs.astype(dict.fromkeys(["tracker", "sequence", "status"], str))
    if runs.empty:
        return []
    judged = _judged(folder, names, runs)
    made = [_scored(name, runs, judged[name], title or title_of(folder)) for name in names]
    if stored == STORED_ONCE:
        return made
    prefix = table_prefix(stored)
    return [
        replace(one, table=replace(one.table, name=f"{prefix}{one.table.name}")) for one in made
    ]


def table_prefix(stored: str) -> str:
    """What names of tables begin with whose runs, by another protocol, are filed under a text."""
    return re.sub(r"[^a-z0-9.]+", "-", stored) + "-"


def runs_by(folder: Path, name: str, runs: pd.DataFrame, stored: str = STORED_ONCE) -> pd.DataFrame:
    """Runs with a preset's scores as columns, in the place of those that are called alike.

    `runs`: as `load_results` gives them, of which those by one protocol are scored. Raises
    `ResultsError` for a run that the preset can't judge, too.
    """
    scored = runs[(runs["protocol"] == stored) & (runs["status"] == "finished")]
    (judged,) = _judged(folder, [name], scored).values()
    scores = {row: dict(one.scores) for row, one in judged.items() if isinstance(one, Judged)}
    if len(scores) < len(judged):
        raise ResultsError(next(one for one in judged.values() if isinstance(one, str)))
    columns = list(metrics_preset(name).columns)
    told = pd.DataFrame.from_dict(scores, "index", columns=columns)
    return runs.drop(columns=columns, errors="ignore").join(told)


def scores_by(folder: Path, row: Mapping[str, Any], names: Sequence[str]) -> dict[str, Any]:
    """Scores of a run by presets: by name, None for a preset that can't judge it.

    `row`: of the run, as `bench.store.index` has it.
    """
    if row["status"] != "finished" or row["protocol"] == TIMING:
        return dict.fromkeys(names)
    judged = _judged(folder, names, pd.DataFrame([dict(row)]))
    return {
        name: {key: value if isfinite(value) else None for key, value in one.scores.items()}
        if isinstance(one := found[0], Judged)
        else None
        for name, found in judged.items()
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
        path = run_path(row["tracker"], row["sequence"], int(row["repetition"]), row["protocol"])
        run = results.read(folder / path)
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
    from reports.figures import write_for_papers  # brings what draws
    from reports.plots import curve_plot

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
    name: str, runs: pd.DataFrame, judged: Mapping[int, Judged | str], title: str
) -> Scored:
    preset = metrics_preset(name)
    scores = {row: dict(one.scores) for row, one in judged.items() if isinstance(one, Judged)}
    shown = runs[["tracker", "sequence", "repetition", "status", "failure"]].copy()
    refused = [row for row, one in judged.items() if isinstance(one, str)]
    shown.loc[refused, "status"] = NOT_SCORED
    late = [LATE.name] if any(LATE.name in one for one in scores.values()) else []
    columns = [*preset.columns, *late]
    shown = shown.join(pd.DataFrame.from_dict(scores, "index", columns=columns))
    measures = [_measure(key, column) for key, column in preset.columns.items()]
    measures = [*(SUMMARY if name == PRESET else measures), *([LATE] if late else [])]
    table = replace(sequence_table(shown, measures, title, name), name=f"metrics-{name}")
    together = {
        str(tracker): _together(preset, of, judged)
        for tracker, of in shown.groupby("tracker", sort=False)
        if counted(of, measures[0].name).all()
    }
    if len(shown["sequence"].unique()) > 1:
        table = _with_means(table, name, shown, measures, together)
    curves = {
        curve: {name: one.curves[curve] for name, one in together.items() if curve in one.curves}
        for curve in preset.curves
    }
    why = list(dict.fromkeys(f"{NOT_SCORED}: {judged[row]}" for row in refused))[:_MOST_NOTES]
    if why and not scores:  # rows of dashes would say no more
        caption = f"{title}; metrics preset {name}: nothing scored."
        return Scored(name, title, replace(table, rows=[], caption=caption, notes=why), curves)
    return Scored(name, title, replace(table, notes=[*table.notes, *why]), curves)


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
            {"tracker": tracker, "sequence": TOGETHER, "repetition": 0, **one.scores}
            for tracker, one in together.items()
        ).assign(status="finished", failure="")
        if len(frame):
            own = sequence_table(frame, measures, "", preset_name)
            rows += [[*row[:2], *map(_without_interval, row[2:])] for row in own.rows]
            counts = own.data["tracker"].map(shown["tracker"].value_counts())
            data.append(own.data.assign(runs=counts))
    rows += [[TableCell(label), *row] for row in means.rows]
    data.append(means.data.assign(sequence=label))
    return replace(
        table,
        caption=f"{table.caption} {label.capitalize()}: {words}{meaning}",
        rows=rows + table.rows,
        data=pd.concat([*data, table.data], ignore_index=True)[list(table.data)],
    )


def _without_interval(cell: TableCell) -> TableCell:
    """Return a figure of all sequences together, which has no interval."""
    return cell if cell.text == MISSING else replace(cell, text=f"{cell.text} –")


def _together(preset: Preset, of: pd.DataFrame, judged: Mapping[int, Judged | str]) -> Judged:
    """Return what a preset makes of all runs of a tracker."""
    runs = [
        [one for row in rows.index if isinstance(one := judged[row], Judged)]
        for _, rows in of.groupby("sequence", sort=False)
    ]
    return preset.overall(runs)
