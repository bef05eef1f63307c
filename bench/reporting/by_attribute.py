"""Attributes of the sequences that stored runs are of, and scores against them."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.metrics import preset as metrics_preset
from bench.metrics.preset import heading
from bench.reporting.against import Curve, against, attribute_table
from bench.reporting.by_preset import runs_by
from bench.reporting.failed_runs import with_worst_scores
from bench.reporting.opening import opened
from bench.reporting.tables import PRESET, SUMMARY
from bench.reporting.uncertainty import bounded_score
from bench.store.files import ResultsError
from bench.store.loading import load_results
from datasets import attributes
from reports.notes import counted
from reports.tables import Measure, Table, complete

__all__ = [
    "Shown",
    "attribute_report",
    "attributes_of",
    "by_attribute",
    "means_by_sequence",
    "scored_runs",
]

Progress = Callable[[int, int], object]
"""Is told how many frames are done, and of how many."""

Measured = Callable[[pd.DataFrame, Sequence[str]], Mapping[str, NDArray[np.float64]]]
"""Gives attributes by sequence, of runs and the names of their sequences; see `attributes_of`."""


def _silent(done: int, total: int) -> None:
    """Tell nobody."""


def by_attribute(folder: str | Path, metrics: str = PRESET) -> pd.DataFrame:
    """Scores of an experiment's runs against attributes of their sequences.

    Parameters
    ----------
    folder : str or Path
        `results/<experiment>`. Sequences are opened where they were not measured before.
    metrics : str
        Preset by whose first score; the mean overlap by default.

    Returns
    -------
    DataFrame
        A row for every tracker, attribute and bin, of trackers whose runs all have a score:
        `tracker`, `attribute`, `sequences`, rank `correlation` and its interval (`low`, `high`),
        corrected for all curves; of the bin `bin_from` and `bin_to` in the unit of the attribute,
        `bin_sequences`, `bin_mean` of the scores and its interval. Failed runs count as worst.

    Raises
    ------
    ResultsError
        Where there are no results, or a file is damaged.
    """
    measure, runs = scored_runs(Path(folder), metrics)
    measured = attributes_of(runs, _names(runs), _silent, _refuse)
    curves = against(means_by_sequence(runs, measure), measured, partial(bounded_score, measure))
    return attribute_table(curves, measure).data


def _refuse(sentence: str) -> None:
    raise ResultsError(sentence)


def scored_runs(folder: Path, metrics: str) -> tuple[Measure, pd.DataFrame]:
    """Return the first score of a preset, and an experiment's runs with it.

    Failed runs have the worst score.
    """
    runs = load_results(folder)
    runs = runs[runs["protocol"] == "accuracy"]
    if metrics == PRESET:
        return SUMMARY[0], with_worst_scores(folder, runs)
    name, column = next(
        (k, one) for k, one in metrics_preset(metrics).columns.items() if one.better
    )
    title = f"{heading(name)} ({metrics})"
    measure = Measure(name, title, direction=column.better, decimals=3)
    return measure, with_worst_scores(folder, runs_by(folder, metrics, runs), [metrics])


def attributes_of(
    runs: pd.DataFrame,
    sequences: Sequence[str],
    progress: Progress,
    tell: Callable[[str], None],
) -> dict[str, NDArray[np.float64]]:
    """Values of every attribute by sequence, (n,), NaN where a sequence has none.

    What was measured before is looked up, so that the sequence need not be there.

    Parameters
    ----------
    runs : DataFrame
        As `load_results` gives them.
    sequences : sequence of str
        Names of the n sequences.
    progress : callable
        Is told the frames that are measured, over all sequences.
    tell : callable
        Is given a sentence on each sequence that can't be measured.
    """
    whole = runs[(runs["status"] == "finished") & runs["fingerprint"].notna()]
    whole = whole.drop_duplicates("sequence")
    rows = {str(row["sequence"]): row for row in whole.to_dict("records")}
    known = {name: attributes.kept(rows[name]["fingerprint"]) for name in sequences if name in rows}
    there = {name: opened(rows[name]) for name, series in known.items() if series is None}
    total = sum(len(sequence) for sequence in there.values() if sequence is not None)
    done = 0
    for name, sequence in there.items():
        if sequence is None:
            where = rows[name]["source"]
            tell(f"{name}: its attributes are not known, as it is not at {where} as it was.")
            continue
        known[name] = attributes.measured(sequence, partial(_shifted, progress, done, total))
        done += len(sequence)
    found = {name: attributes.overall(series) for name, series in known.items() if series}
    return {
        one: np.array([found.get(name, {}).get(one, np.nan) for name in sequences])
        for one in attributes.names()
    }


def _shifted(progress: Progress, before: int, total: int, done: int, _: int) -> None:
    """Tell of frames of one sequence among those of all."""
    progress(before + done, total)


def means_by_sequence(runs: pd.DataFrame, measure: Measure) -> dict[str, NDArray[np.float64]]:
    """Return mean scores, (n,) in the order of the sequences, of trackers with all scores."""
    runs = complete(runs).astype(dict.fromkeys(["tracker", "sequence", "status"], str))
    names = _names(runs)
    return {
        str(tracker): of.groupby("sequence")[measure.name].mean().reindex(names).to_numpy()
        for tracker, of in runs.groupby("tracker", sort=False)
        if counted(of, measure.name).all()
    }


@dataclass(frozen=True)
class Shown:
    """Scores by a preset against attributes."""

    table: Table
    measure: Measure
    curves: Sequence[Curve]

    def drawn(self, path: Path, title: str) -> list[Path]:
        """Draw a panel per attribute into a file; return the files, none if there are no curves."""
        from reports.attributes import Against, attribute_plot
        from reports.figures import write_for_papers

        if not self.curves:
            return []
        panels: dict[str, list[Against]] = {}
        for curve in self.curves:
            points = np.array(
                [(one.centre, one.mean, *(one.interval or (np.nan, np.nan))) for one in curve.bins]
            )
            centres, *scores = points.reshape(-1, 4).T
            dots, *bins = (part * self.measure.scale for part in (curve.scores, *scores))
            drawn = Against(curve.label, curve.places, dots, centres, *bins)
            panels.setdefault(attributes.of_name(curve.attribute).head, []).append(drawn)
        return write_for_papers(path, attribute_plot(panels, self.measure.head, title))


def attribute_report(experiment: Path, presets: Collection[str], measured: Measured) -> list[Shown]:
    """What is shown by every preset.

    `measured`: gives attributes of runs' sequences, see `attributes_of`.
    """
    made = []
    for preset in presets:
        measure, runs = scored_runs(experiment, preset)
        means = means_by_sequence(runs, measure)
        curves = against(means, measured(runs, _names(runs)), partial(bounded_score, measure))
        name = "attributes" if preset == PRESET else f"attributes-{preset}"
        table = attribute_table(curves, measure, name)
        for tracker in sorted(set(runs["tracker"].astype(str)) - set(means)):
            table.notes.append(f"{tracker} is not shown: not all of its runs have a score.")
        made.append(Shown(table, measure, curves))
    return made


def _names(runs: pd.DataFrame) -> list[str]:
    return [str(name) for name in runs["sequence"].unique()]
