"""Results: runs of trackers on sequences, in memory or in a folder, as tables and as HTML."""

from collections import UserDict
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import cached_property
from html import escape
from math import nan
from pathlib import Path
from typing import Any, TypeAlias

import pandas as pd

from trackmark.bench.analysis.by_metrics import measures_of, presets_for, runs_by
from trackmark.bench.analysis.comparable_runs import compared_measure, same_boxes, scored_runs
from trackmark.bench.analysis.comparison import Comparison
from trackmark.bench.analysis.comparison import compare as compare_runs
from trackmark.bench.analysis.comparison_tables import pair_table, screen_lines
from trackmark.bench.analysis.corner_boxes import corner_boxes
from trackmark.bench.analysis.failed_runs import with_worst_scores
from trackmark.bench.analysis.families import Families, read_families
from trackmark.bench.analysis.run_tables import (
    PRESET,
    mean_table,
    not_repeatable,
    undefined_notes,
    without_undefined,
)
from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.metrics import canonical_name
from trackmark.bench.pages.notebook import complete_name
from trackmark.bench.protocols import STORED_ONE_PASS, TIMING, parse_protocol, title
from trackmark.bench.store.data_frames import load_runs
from trackmark.bench.store.files import ResultsError
from trackmark.bench.store.layout import DATABASE, experiment_folders, run_key
from trackmark.bench.store.manifest import Manifest
from trackmark.bench.store.results import Results as Store
from trackmark.bench.store.run_rows import NUMBER_FIELDS, TEXT_FIELDS
from trackmark.bench.store.truth import find_attributes, write_truth
from trackmark.datasets import Sequence
from trackmark.reports.printable import wrap
from trackmark.reports.renderers import terminal_lines, to_html
from trackmark.reports.tables import Table, sequence_table
from trackmark.reports.temporary_paths import TemporaryPath

RunName: TypeAlias = tuple[str, str, int]
"""Tracker, sequence and repetition of a run."""

_FIELDS = {*TEXT_FIELDS, *NUMBER_FIELDS, "experiment"}
_LABELS = ["tracker", "sequence", "repetition", "status"]


class Results:
    """Runs of trackers on sequences by one protocol, in memory or in a folder.

    `results["camshift", "samples/face"]` is the run of repetition 0; a third value selects another
    repetition. The last part of a sequence's name suffices if it is unique.

    Parameters
    ----------
    runs : mapping of (str, str, int) to Run
        Runs by tracker, sequence and repetition.
    protocol : str
        Stored name of the protocol.
    metrics : str
        Metrics of `table` and `means` by default.
    sequences : iterable of Sequence
        Sequences of runs in memory.
    in_memory : mapping of str to str, optional
        Reason why a tracker's runs cannot be saved, empty if they can, by tracker.
    folder : Path, optional
        Folder that contains the runs; None for runs in memory.
    """

    def __init__(
        self,
        runs: Mapping[RunName, Run],
        protocol: str,
        metrics: str = PRESET,
        sequences: Iterable[Sequence] = (),
        in_memory: Mapping[str, str] | None = None,
        folder: Path | None = None,
    ) -> None:
        self.runs, self.protocol, self.folder = runs, protocol, folder
        self.metrics = preset_for(metrics, protocol)
        self._sequences, self._in_memory = list(sequences), in_memory or {}

    def __getitem__(self, key: tuple[str, str] | RunName) -> Run:
        if not (isinstance(key, tuple) and len(key) in (2, 3)):
            raise TypeError(
                f"results[{key!r}]: expected tracker and sequence, for example "
                "results['camshift', 'face']; the attribute `runs` has all names."
            )
        tracker, name, repetition = (*key, 0)[:3]
        sequence = complete_name(name, {sequence for _, sequence, _ in self.runs})
        if (tracker, sequence, repetition) not in self.runs:
            names = [str(other) for other in self.runs]
            wanted = str((tracker, sequence, repetition))
            close = get_close_matches(wanted, names, n=3, cutoff=0) or ["none"]
            raise KeyError(f"no run {wanted}. The nearest ones are {', '.join(close)}.")
        return self.runs[tracker, sequence, repetition]

    def table(self, metrics: str | None = None) -> pd.DataFrame:
        """Return one row per run: tracker, sequence, repetition, status, scores and failure.

        Requested runs that are not stored have the status `missing`. Runs of an older version of a
        tracker or sequence have the status `stale`. Scores of failed, missing and stale runs are
        NaN. Scores are those of `trackmark.score`; `metrics` selects other metrics.
        """
        preset, runs = self._scored(metrics)
        names = [name for name in runs if name not in _FIELDS]
        if preset != PRESET:
            names = [measure.name for measure in measures_of(preset)]
        texts = {name: runs[name].astype(str) for name in ("tracker", "sequence", "status")}
        failure = runs["failure"].astype(str).str.split("\n").str[0]
        return runs.assign(**texts, failure=failure)[[*_LABELS, *names, "failure"]]

    def means(self, by: str = "tracker", metrics: str | None = None) -> pd.DataFrame:
        """Return mean scores.

        Parameters
        ----------
        by : {'tracker', 'sequence'}
            `tracker`: mean over repetitions, then over sequences; families of scenes count as one
            sequence. `sequence`: mean over repetitions for each sequence and tracker.
        metrics : str, optional
            Metrics preset; that of the results by default.

        Returns
        -------
        DataFrame
            One column per score. By tracker, `<score>_low` and `<score>_high` are the ends of the
            95 % interval, which are NaN for fewer than 6 sequences. Failed runs have the worst
            scores. Sequences on which no run has a score, such as those of one frame, are left out.
            A mean is NaN if a run is missing, or if all runs of a tracker failed.
        """
        if by not in ("tracker", "sequence"):
            raise ValueError(f"by is {by!r}. Expected: 'tracker' or 'sequence'.")
        preset, runs = self._with_worst_scores(metrics)
        if by == "sequence":
            data = sequence_table(runs, measures_of(preset), "", preset).data
            index, columns = ["sequence", "tracker"], {"": "mean"}
        else:
            data = self._mean_table(preset, runs).data
            index, columns = ["tracker"], {"": "mean", "_low": "low", "_high": "high"}
        # `pivot_table` would omit rows of which all scores are NaN.
        wide = data.set_index([*index, "measure"])[list(columns.values())].unstack("measure")  # noqa: PD010
        order = data.drop_duplicates(index).set_index(index).index
        return pd.DataFrame(
            {
                f"{measure.name}{end}": wide[column, measure.name]
                for measure in measures_of(preset)
                for end, column in columns.items()
            }
        ).loc[order]

    @property
    def failures(self) -> pd.DataFrame:
        """Failed runs: tracker, sequence, frame (missing if it is unknown), error, repetition."""
        rows = []
        for (tracker, sequence, repetition), run in self.runs.items():
            if run.failure:
                name, _, error = run.failure.splitlines()[0].partition(": ")
                frame = None
                with suppress(ValueError):  # no frame, or the sequence cannot be opened
                    opened = run.open_sequence()
                    frame = list(map(opened.frame_name, range(len(opened)))).index(name)
                rows.append([tracker, sequence, frame, error, repetition])
        names = ["tracker", "sequence", "frame", "error", "repetition"]
        return pd.DataFrame(rows, columns=names).astype({"frame": "Int64"})

    def save(self, folder: str | Path) -> Path:
        """Store runs in memory in a new folder, as `trackmark run` does; return the folder.

        Raises `ResultsError` for runs that are already stored, a folder with results, and runs
        whose identity is unknown: of objects, functions and classes without source file, and runs
        with another seed.
        """
        folder = Path(folder).expanduser()
        if self.folder is not None:
            raise ResultsError(f"these results are already stored in {self.folder}.")
        for tracker, reason in self._in_memory.items():
            if reason:
                raise ResultsError(
                    f"tracker {tracker!r} {reason}: its runs are in memory only. Write the class "
                    "to a file, give the file to evaluate, restart Python after an edit, and use "
                    "the default seed."
                )
        if (folder / DATABASE).exists():
            raise ResultsError(f"{folder} already contains results. Choose another folder.")
        self._write(folder)
        return folder

    @cached_property
    def stored_folder(self) -> Path:
        """Folder of the runs; runs in memory are copied to a temporary folder."""
        if self.folder is not None:
            return self.folder
        self._temporary = TemporaryPath()  # removed with these results
        folder = self._temporary.path / "results"
        self._write(folder)
        return folder

    def _write(self, folder: Path) -> None:
        store, runs = Store(folder), list(self.runs.values())
        versions = {run_key(run.identity): run.identity.version for run in runs}
        store.prepare(Manifest(folder.name, versions))
        for sequence in self._sequences:
            write_truth(folder, sequence)
        store.write_all((run, "") for run in runs)

    def _scored(self, metrics: str | None) -> tuple[str, pd.DataFrame]:
        """Return the metrics preset, and the runs with its scores."""
        preset = self.metrics if metrics is None else preset_for(metrics, self.protocol)
        runs = load_runs(self.stored_folder)
        runs = runs[runs["protocol"] == self.protocol].reset_index(drop=True)
        scores = [name for name in runs if name not in _FIELDS]
        runs.loc[runs["status"] == "stale", scores] = nan  # of another version
        if preset != PRESET:
            runs = runs_by(self.stored_folder, preset, runs, self.protocol, strict=False)
        return preset, runs

    def _with_worst_scores(self, metrics: str | None = None) -> tuple[str, pd.DataFrame]:
        preset, runs = self._scored(metrics)
        return preset, with_worst_scores(self.stored_folder, runs, preset)

    def _mean_table(self, preset: str, runs: pd.DataFrame) -> Table:
        undefined = preset != PRESET  # scores that are undefined in some runs, as in `report`
        measures, score = measures_of(preset), measures_of(preset)[0].name
        if undefined:  # a sequence counts if any of its scores is defined
            names, score = [measure.name for measure in measures], "any score"
            runs = runs.assign(**{score: runs.reindex(columns=names).max(axis=1)})
        runs, left_out = without_undefined(runs, score)
        table = mean_table(runs, measures, "Means", preset, skip_undefined=undefined)
        return replace(table, notes=[*table.notes, *undefined_notes(left_out, measures[0])])

    def __str__(self) -> str:
        """Return the means as a table in the width of the terminal."""
        preset, runs = self._with_worst_scores()
        lines = terminal_lines(self._mean_table(preset, runs))
        return "\n".join([*lines, *map(wrap, self._corner_hints)])

    @cached_property
    def _corner_hints(self) -> list[str]:
        """Hint on each tracker whose boxes seem to be corners `[x1, y1, x2, y2]`."""
        runs = load_runs(self.stored_folder)
        return corner_boxes(self.stored_folder, runs[runs["protocol"] == self.protocol])

    def __repr__(self) -> str:
        place = "in memory" if self.folder is None else f"in {self.folder}"
        trackers, sequences, _ = map(set, zip(*self.runs, strict=True)) if self.runs else [()] * 3
        counts = {"tracker": trackers, "sequence": sequences, "run": self.runs}
        words = [f"{len(names)} {word}{'s' * (len(names) != 1)}" for word, names in counts.items()]
        return f"<Results of {', '.join(words)} {place}>"

    def _repr_html_(self) -> str:
        """Return the means, and the numbers of runs."""
        preset, runs = self._with_worst_scores()
        failed, missing = (int((runs["status"] == word).sum()) for word in ("failed", "missing"))
        table = to_html(self._mean_table(preset, runs))
        hints = "".join(f"<p>{escape(hint)}</p>" for hint in self._corner_hints)
        return f"{table}<p>{len(runs)} runs, {failed} failed, {missing} missing.</p>{hints}"


class _StoredRuns(UserDict[RunName, Any]):
    """Runs in a folder, which are read when they are used."""

    def __init__(self, store: Store, protocol: str) -> None:
        super().__init__({key[:3]: key for key in store.list_keys() if key[3] == protocol})
        self._store = store

    def __getitem__(self, name: RunName) -> Run:
        return self._store.read(self.data[name])


def load_results(
    folder: str | Path, *, metrics: str = PRESET, protocol: str | None = None
) -> Results:
    """Return the results that `trackmark run`, `trackmark.run` or `Results.save` stored.

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
    Results
        Runs are read when they are used.

    Raises
    ------
    ResultsError
        If there are no results, several experiments, or no runs by the protocol.
    """
    experiments = experiment_folders(Path(folder).expanduser().absolute())
    if len(experiments) > 1:
        names = ", ".join(map(str, experiments))
        raise ResultsError(f"{folder} contains several experiments. Choose one of {names}.")
    return load_experiment(experiments[0], metrics, protocol)


def load_experiment(folder: Path, metrics: str, protocol: str | None) -> Results:
    """Return the results of the experiment in an absolute path; see `load_results`."""
    store = Store(folder)
    stored = list(dict.fromkeys(key[3] for key in store.list_keys()))
    untimed = [name for name in stored if name != TIMING]
    selected = STORED_ONE_PASS if protocol is None else parse_protocol(protocol).text
    if protocol is None and len(untimed) == 1:
        selected = untimed[0]
    if selected not in stored:
        others = ", ".join(map(title, untimed)) or "none"
        raise ResultsError(
            f"{folder}: no run used the protocol {title(selected)}. Stored protocols: {others}."
        )
    return Results(_StoredRuns(store, selected), selected, metrics, folder=folder)


def preset_for(metrics: str, protocol: str) -> str:
    """Return the preset of metrics for runs by a protocol, which is given by its stored name."""
    return presets_for([canonical_name(metrics)], protocol)[0]


@dataclass(frozen=True, repr=False)
class PrintedComparison(Comparison):
    """Comparison that prints like `trackmark compare`: answer, standings, pairs and hints."""

    hints: tuple[str, ...] = ()

    def __str__(self) -> str:
        return "\n".join([*screen_lines(self), *map(wrap, self.hints)])

    def _repr_html_(self) -> str:
        """Return the table of pairs and hints, for a notebook."""
        hints = "".join(f"<p>{escape(hint)}</p>" for hint in self.hints)
        return f"{to_html(pair_table(self))}{hints}"


def compare(
    results: Results,
    baseline: str | None = None,
    metric: str | None = None,
    *,
    metrics: str | None = None,
    margin: float | None = None,
    families: Mapping[str, str] | str | Path | None = None,
) -> Comparison:
    """Compare trackers pairwise on the same sequences, as `trackmark compare` does.

    Parameters
    ----------
    results : Results
        Runs of two trackers or more on the same sequences.
    baseline : str, optional
        Tracker that is compared with each other tracker; all pairs by default.
    metric : str, optional
        Score of the metrics; the first one by default.
    metrics : str, optional
        One of `trackmark.metrics.names()`; the metrics of `results` by default.
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
    if not isinstance(results, Results):
        raise TypeError(f"{results!r} is not Results. For a folder, give load_results(folder).")
    folder, stored = results.stored_folder, results.protocol
    preset = results.metrics if metrics is None else preset_for(metrics, stored)
    runs = load_runs(folder)
    measure = compared_measure(preset, metric, margin)
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
    table, measure = scored_runs(folder, runs, stored, preset, measure)
    comparison = compare_runs(
        table,
        measure,
        against=baseline,
        families=declared,
        attributes=find_attributes(folder, runs[runs["status"] == "finished"]),
        same_boxes=same_boxes(folder, runs, stored),
        not_repeatable=not_repeatable(runs),
    )
    return PrintedComparison(**vars(comparison), hints=tuple(results._corner_hints))
