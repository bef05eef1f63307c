"""Scores of stored runs by attributes of their sequences, and the sequences themselves."""

from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

import datasets
from bench.metrics import preset as metrics_preset
from bench.metrics.preset import heading
from bench.reporting.against import Curve, against, attribute_table
from bench.reporting.by_preset import runs_by
from bench.reporting.failed_runs import with_worst_scores
from bench.reporting.tables import PRESET, SUMMARY
from bench.store.files import ResultsError
from bench.store.loading import load_results
from datasets import attributes
from reports.notes import counted
from reports.tables import Measure, Table, complete

Progress = Callable[[int, int], object]
"""Receives the number of measured frames and the number of all frames."""

Measured = Callable[[pd.DataFrame, Sequence[str]], Mapping[str, NDArray[np.float64]]]
"""Returns attributes by sequence, given runs and names of sequences; see `attributes_of`."""


class Shown(NamedTuple):
    """Scores of a preset by attributes."""

    table: Table
    measure: Measure
    curves: Sequence[Curve]


def by_attribute(folder: str | Path, metrics: str = PRESET) -> pd.DataFrame:
    """Return scores of an experiment's runs by attributes of their sequences.

    Parameters
    ----------
    folder : str or Path
        `results/<experiment>`. Sequences that were not measured before are opened.
    metrics : str
        Preset, of which the first score is used; the mean overlap by default.

    Returns
    -------
    DataFrame
        One row per tracker, attribute and bin, of trackers whose runs all have a score:
        `tracker`, `attribute`, `sequences`, rank `correlation` and its interval (`low`, `high`),
        corrected for all curves; of the bin `bin_from` and `bin_to` in the unit of the attribute,
        `bin_sequences`, `bin_mean` of the scores and its interval. Failed runs have the worst
        score.

    Raises
    ------
    ResultsError
        If there are no results, a file is damaged or a sequence cannot be opened.
    """

    def refuse(message: str) -> None:
        raise ResultsError(message)

    measured = partial(attributes_of, progress=lambda *_: None, tell=refuse)
    (shown,) = attribute_report(Path(folder), [metrics], measured)
    return shown.table.data


def attribute_report(experiment: Path, presets: Collection[str], measured: Measured) -> list[Shown]:
    """Return the scores of every preset by attributes of the sequences."""
    reports = []
    for preset in presets:
        measure, runs = _scored_runs(experiment, preset)
        names = [str(name) for name in runs["sequence"].unique()]
        means = _means_by_sequence(runs, measure)
        curves = against(means, measured(runs, names), measure.least, measure.most)
        name = "attributes" if preset == PRESET else f"attributes-{preset}"
        table = attribute_table(curves, measure, "tracker", name)
        for tracker in sorted(set(runs["tracker"].astype(str)) - set(means)):
            table.notes.append(f"{tracker} is not shown: not all of its runs have a score.")
        reports.append(Shown(table, measure, curves))
    return reports


def _scored_runs(folder: Path, metrics: str) -> tuple[Measure, pd.DataFrame]:
    """Return the first score of a preset, and an experiment's one-pass runs with this score."""
    runs = load_results(folder)
    runs = runs[runs["protocol"] == "accuracy"]
    if metrics == PRESET:
        return SUMMARY[0], with_worst_scores(folder, runs)
    columns = metrics_preset(metrics).columns
    name = next(name for name, column in columns.items() if column.better)
    title = f"{heading(name)} ({metrics})"
    measure = Measure(name, title, direction=columns[name].better, decimals=3)
    return measure, with_worst_scores(folder, runs_by(folder, metrics, runs), [metrics])


def _means_by_sequence(runs: pd.DataFrame, measure: Measure) -> dict[str, NDArray[np.float64]]:
    """Return mean scores by sequence, (n,), of trackers all of whose runs have a score."""
    runs = complete(runs).astype(dict.fromkeys(["tracker", "sequence", "status"], str))
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
    tell: Callable[[str], None],
) -> dict[str, NDArray[np.float64]]:
    """Return values of every attribute by sequence, (n,), NaN if a sequence does not have it.

    Sequences that were measured before are not opened. `runs`: as `load_results` returns them.
    `sequences`: names. `progress` receives the number of measured frames over all sequences, and
    `tell` a message on each sequence that cannot be measured.
    """
    whole = runs[(runs["status"] == "finished") & runs["fingerprint"].notna()]
    rows = {
        str(row["sequence"]): row for row in whole.drop_duplicates("sequence").to_dict("records")
    }
    series = {
        name: attributes.kept(rows[name]["fingerprint"]) for name in sequences if name in rows
    }
    unmeasured = [name for name, kept in series.items() if kept is None]
    opened = {name: open_sequence(rows[name]) for name in unmeasured}
    total = sum(len(sequence) for sequence in opened.values() if not isinstance(sequence, str))
    done = 0
    for name, sequence in opened.items():
        if isinstance(sequence, str):
            source = rows[name]["source"]
            tell(f"{name}: its attributes are not known, as it is not at {source} as it was.")
            continue
        watch = partial(lambda before, frames, _: progress(before + frames, total), done)
        series[name] = attributes.measured(sequence, watch)
        done += len(sequence)
    means = {name: attributes.overall(measured) for name, measured in series.items() if measured}
    return {
        attribute: np.array([means.get(name, {}).get(attribute, np.nan) for name in sequences])
        for attribute in attributes.names()
    }


def open_sequence(row: Mapping[Any, Any]) -> datasets.Sequence | str:
    """Return the sequence of a run as the index has it, or a message why it cannot be used."""
    name, source = row["sequence"], row["source"]
    try:
        sequence = datasets.load(source, truth=row["truth"] or None)
    except datasets.SequenceError:
        return f"{name} can't be opened at {source} any more."
    if sequence.fingerprint != row["fingerprint"]:
        return f"{name} at {source} has changed since it was run."
    return sequence


def write_plot(
    path: Path, curves: Sequence[Curve], measure: Measure, title: str, quantity: str = ""
) -> list[Path]:
    """Draw curves into a file with a panel per attribute; return the files, none without curves."""
    from reports.attributes import Against, attribute_plot
    from reports.figures import write_for_papers

    if not curves:
        return []
    panels: dict[str, list[Against]] = {}
    for curve in curves:
        points = [(bin_.centre, bin_.mean, bin_.low, bin_.high) for bin_ in curve.bins]
        centres, *scores = np.array(points).reshape(-1, 4).T
        dots, means, low, high = (part * measure.scale for part in (curve.scores, *scores))
        drawn = Against(curve.label, curve.places, dots, centres, means, low, high)
        panels.setdefault(attributes.of_name(curve.attribute).head, []).append(drawn)
    return write_for_papers(path, attribute_plot(panels, quantity or measure.head, title))
