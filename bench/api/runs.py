"""Runs of `import trackmark`: loading, means, comparison, and their forms for a notebook."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from html import escape
from pathlib import Path

import pandas as pd

from trackmark import datasets
from trackmark.bench.analysis.by_metrics import metrics_for
from trackmark.bench.analysis.comparison import Comparison, compare_runs
from trackmark.bench.analysis.comparison_tables import (
    pair_table,
    screen_lines,
    standing_table,
)
from trackmark.bench.analysis.decisions import answer_of
from trackmark.bench.analysis.families import Families, read_families
from trackmark.bench.analysis.run_checks import compared_measure, corner_boxes
from trackmark.bench.analysis.run_tables import measures_of, undefined_notes, without_undefined
from trackmark.bench.analysis.score_tables import mean_table, sequence_table
from trackmark.bench.metrics import canonical_name
from trackmark.bench.protocols import parse_protocol
from trackmark.bench.store.database import FILE_NAME, ResultsError, single_experiment
from trackmark.bench.store.run_store import RunStore
from trackmark.bench.store.runs import DEFAULT_METRICS, Runs
from trackmark.reports.printable import wrap
from trackmark.reports.renderers import terminal_lines, to_html
from trackmark.reports.tables import Table


class PrintedRuns(Runs):
    """Runs with means, which `print` and notebooks show as a table."""

    unsaved_reasons: Mapping[str, str] = {}
    """Reason why a tracker's runs cannot be saved, empty if they can, by tracker."""

    sequences: Sequence[datasets.Sequence] = ()
    """Sequences of runs in memory; as long as they exist, `Run.open_sequence` returns them."""

    def means(self, per: str = "tracker", metrics: str | None = None) -> pd.DataFrame:
        """Return mean scores.

        Parameters
        ----------
        per : {'tracker', 'sequence'}
            `tracker`: mean over repetitions, then over sequences; families of scenes count as one
            sequence. `sequence`: mean over repetitions for each sequence and tracker.
        metrics : str, optional
            One of `trackmark.metrics.names()`; by default those of the runs.

        Returns
        -------
        DataFrame
            One column per score. By tracker, `<score>_low` and `<score>_high` are the ends of the
            95 % interval, which are NaN for fewer than 6 sequences. Failed runs have the worst
            scores. Sequences on which no run has a score, such as those of one frame, are left out.
            A mean is NaN if a run is missing, or if all runs of a tracker failed.
        """
        if per not in ("tracker", "sequence"):
            raise ValueError(f"per is {per!r}. Expected: 'tracker' or 'sequence'.")
        metrics = self.metrics if metrics is None else metrics_by_name(metrics, self.protocol)
        if per == "sequence":
            scores = sequence_table(self.scored(metrics), measures_of(metrics), "", metrics).records
            index, columns = ["sequence", "tracker"], {"": "mean"}
        else:
            scores = self._mean_table(metrics).records
            index, columns = ["tracker"], {"": "mean", "_low": "low", "_high": "high"}
        # `pivot_table` would omit rows of which all scores are NaN.
        wide = scores.set_index([*index, "measure"])[list(columns.values())].unstack("measure")  # noqa: PD010
        order = scores.drop_duplicates(index).set_index(index).index
        return pd.DataFrame(
            {
                f"{measure.name}{end}": wide[column, measure.name]
                for measure in measures_of(metrics)
                for end, column in columns.items()
            }
        ).loc[order]

    def _mean_table(self, metrics: str) -> Table:
        runs, is_native = self.scored(metrics), metrics == DEFAULT_METRICS
        measures, score = measures_of(metrics), measures_of(metrics)[0].name
        if not is_native:  # a sequence counts if any of its scores is defined
            names, score = [measure.name for measure in measures], "any score"
            runs = runs.assign(**{score: runs.reindex(columns=names).max(axis=1)})
        runs, left_out = without_undefined(runs, score)
        table = mean_table(runs, measures, "Means", metrics, skip_undefined=not is_native)
        return replace(table, notes=[*table.notes, *undefined_notes(left_out, measures[0])])

    def save(self, folder: str | Path) -> Path:
        """Store runs in memory in a new folder, as `trackmark run` does; return the folder.

        Raises `ResultsError` for runs that are already stored, a folder with results, and runs
        whose identity is unknown: of objects, functions and classes without source file, and runs
        with another seed.
        """
        folder = Path(folder).expanduser()
        if self.folder is not None:
            raise ResultsError(f"these runs are already stored in {self.folder}.")
        for tracker, reason in self.unsaved_reasons.items():
            if reason:
                raise ResultsError(
                    f"tracker {tracker!r} {reason}: its runs are in memory only. Write the class "
                    "to a file, give the file to evaluate, restart Python after an edit, and use "
                    "the default seed."
                )
        if (folder / FILE_NAME).exists():
            raise ResultsError(f"{folder} already contains results. Choose another folder.")
        store = RunStore(folder)
        store.add_requests(self.requested, folder.name)
        store.add_all([(run, "") for run in self.values()], self.truths.values())
        return folder

    def __str__(self) -> str:
        """Return the means as a table in the width of the terminal."""
        lines = terminal_lines(self._mean_table(self.metrics))
        return "\n".join([*lines, *map(wrap, self.corner_hints)])

    @cached_property
    def corner_hints(self) -> list[str]:
        """Hint on each tracker whose boxes seem to be corners `[x1, y1, x2, y2]`."""
        return corner_boxes(self, self.protocol)

    def _repr_html_(self) -> str:
        """Return the means, and the numbers of runs."""
        status = self.table["status"][self.table["protocol"] == self.protocol]
        failed, missing = (int((status == word).sum()) for word in ("failed", "missing"))
        hints = "".join(f"<p>{escape(hint)}</p>" for hint in self.corner_hints)
        counts = f"<p>{len(status)} runs, {failed} failed, {missing} missing.</p>"
        return f"{to_html(self._mean_table(self.metrics))}{counts}{hints}"


def load_runs(
    folder: str | Path, *, metrics: str = DEFAULT_METRICS, protocol: str | None = None
) -> PrintedRuns:
    """Return the runs that `trackmark run`, `trackmark.run` or `Runs.save` stored.

    Parameters
    ----------
    folder : str or Path
        Folder of an experiment, for example `results/otb`, or a folder with a single experiment.
    metrics : str
        Metrics of the tables by default: one of `trackmark.metrics.names()`.
    protocol : str, optional
        Protocol of the runs; by default one-pass, or the only protocol of the stored runs.

    Returns
    -------
    Runs
        Boxes are read when they are used.

    Raises
    ------
    ResultsError
        If there are no results, several experiments, or no runs by the protocol.
    """
    experiment = single_experiment(Path(folder).expanduser().absolute())
    return load_experiment(experiment, metrics, protocol)


def load_experiment(folder: Path, metrics: str, protocol: str | None) -> PrintedRuns:
    """Return the runs of the experiment in an absolute path; see `load_runs`."""
    runs = PrintedRuns.open(folder)
    if protocol is not None:
        runs.protocol = parse_protocol(protocol).key
    elif len(runs.protocols) == 1:
        runs.protocol = runs.protocols[0]
    if not len(runs):
        protocols = ", ".join(runs.protocols) or "none"
        raise ResultsError(
            f"{folder}: no run used the protocol {runs.protocol}. Stored protocols: {protocols}."
        )
    runs.metrics = metrics_by_name(metrics, runs.protocol)
    return runs


def metrics_by_name(name: str, protocol: str) -> str:
    """Return the name of metrics for runs by a protocol; raise `ValueError` if it is unknown."""
    return metrics_for([canonical_name(name)], protocol)[0]


@dataclass(frozen=True, repr=False)
class PrintedComparison(Comparison):
    """Comparison that prints like `trackmark compare`: answer, standings, pairs and hints."""

    hints: tuple[str, ...] = ()

    def __str__(self) -> str:
        return "\n".join([*screen_lines(self), *map(wrap, self.hints)])

    def _repr_html_(self) -> str:
        """Return answer, means, pairs and hints, for a notebook."""
        answer = answer_of(self)
        paragraphs = [f"<p>{escape(text)}</p>" for text in (*answer.details, *self.hints)]
        tables = [standing_table(self), *([pair_table(self)] if self.pairs else [])]
        heading = f"<p><b>{escape(answer.heading)}</b></p>"
        return "".join([heading, *paragraphs, *map(to_html, tables)])


def compare(
    runs: Runs,
    against: str | None = None,
    metric: str | None = None,
    *,
    metrics: str | None = None,
    margin: float | None = None,
    families: Mapping[str, str] | str | Path | None = None,
) -> Comparison:
    """Compare trackers pairwise on the same sequences, as `trackmark compare` does.

    Parameters
    ----------
    runs : Runs
        Runs of two trackers or more on the same sequences.
    against : str, optional
        Tracker that is compared with each other tracker; all pairs by default.
    metric : str, optional
        Score of the metrics; the first one by default.
    metrics : str, optional
        One of `trackmark.metrics.names()`; the metrics of `runs` by default.
    margin : float, optional
        Largest irrelevant difference, in the unit of the score.
    families : mapping of str to str, or path, optional
        Family of each sequence, such as the video of a clip, or a CSV file with the columns
        `sequence` and `family`. A family counts as one unit.

    Returns
    -------
    Comparison
        Differences with intervals and decisions; `print` and notebooks show them as a table.

    Raises
    ------
    ResultsError, ValueError
        If the runs cannot be compared, or if a name is unknown.
    """
    if not isinstance(runs, Runs):
        raise TypeError(f"{runs!r} is not Runs. For a folder, give load_runs(folder).")
    metrics = runs.metrics if metrics is None else metrics_by_name(metrics, runs.protocol)
    measure = compared_measure(metrics, metric, margin)
    declared = None
    if isinstance(families, str | Path):
        declared = read_families(families)
    elif families is not None:
        try:
            declared = Families(dict(families), "families")
        except (TypeError, ValueError):
            raise TypeError(
                f"families={families!r}: expected a mapping from sequences to families, for "
                "example {'walk-1': 'street'}, or a CSV file."
            ) from None
    comparison = compare_runs(
        runs, metrics, measure, against=against, protocol=runs.protocol, families=declared
    )
    hints = tuple(corner_boxes(runs, runs.protocol))
    return PrintedComparison(**vars(comparison), hints=hints)
