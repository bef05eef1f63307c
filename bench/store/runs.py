"""Runs of an experiment with their scores and ground truths, from a results folder or in memory."""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from difflib import get_close_matches
from functools import cached_property
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Self, TypeAlias

from trackmark import datasets
from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.evaluation.scoring import MetricOutcome, outcome_of
from trackmark.bench.metrics import find_metrics
from trackmark.bench.metrics.interface import MetricResult
from trackmark.bench.protocols import ONE_PASS, TIMING
from trackmark.bench.store.data_frames import to_data_frame, with_missing, with_one_version
from trackmark.bench.store.keys import FILE_NAME, ResultsError, RunKey, refuse_empty_file, run_key
from trackmark.bench.store.run_rows import NUMBER_FIELDS, TEXT_FIELDS, StoredRuns, run_row
from trackmark.bench.store.truth import StoredTruth
from trackmark.datasets import SequenceError

if TYPE_CHECKING:
    import pandas as pd

RunName: TypeAlias = tuple[str, str, int]
"""Tracker, sequence and repetition of a run."""

DEFAULT_METRICS = "native"

NOT_SCORED = "not scored"
"""Status of finished runs that metrics cannot score."""


class RunWithTruth(NamedTuple):
    """Run with its row in the table of all runs and the ground truth of its sequence."""

    row: Mapping[Any, Any]
    run: Run
    truth: StoredTruth


class Runs(Mapping[RunName, Run]):
    """Runs of an experiment, stored or in memory, with their scores and ground truths.

    As a mapping, the object contains the runs by one protocol: `runs["camshift", "samples/face"]`
    is the run of repetition 0, and a third value selects another repetition. The last part of a
    sequence's name suffices if it is unique. The other attributes and methods concern the runs by
    all protocols, including requested runs that do not exist.

    Attributes
    ----------
    title : str
        Title of the experiment.
    folder : Path or None
        Results folder; None for runs in memory.
    protocol : str
        Key of the protocol of the mapping, which is also the default of `scored`.
    metrics : str
        Default metrics of `scored`.
    stored_rows : list of dict
        Rows of the existing runs, with scores; `rows` also has the missing ones.
    requested : mapping of RunKey to str
        Requested versions of the runs.
    """

    def __init__(
        self,
        rows: Iterable[dict[str, Any]],
        requested: Mapping[RunKey, str],
        source: StoredRuns,
        title: str = "",
        trackers: Collection[str] | None = None,
    ) -> None:
        self.folder, self.title = source.folder, title
        self.protocol, self.metrics = ONE_PASS, DEFAULT_METRICS
        self.stored_rows, self.requested = list(rows), requested
        self._source, self._trackers = source, trackers

    @classmethod
    def open(cls, folder: Path, progress: Callable[[int, int], None] = lambda *_: None) -> Self:
        """Return the runs in the results folder of an experiment; score those without scores.

        `progress` is called with the number of runs scored so far, and the number of runs to score.
        Raises `ResultsError` if there are no results, or if the file is damaged.
        """
        if not (folder / FILE_NAME).is_file():
            raise ResultsError(
                f"{folder}: this folder contains no results. Create results by `trackmark run`."
            )
        refuse_empty_file(folder)
        stored_runs = StoredRuns.read(folder)
        title = stored_runs.requests.title or folder.absolute().name
        return cls(
            stored_runs.scored_rows(progress), stored_runs.requests.versions, stored_runs, title
        )

    @classmethod
    def in_memory(
        cls, runs: Iterable[Run], truths: Mapping[tuple[str, str], StoredTruth], title: str = ""
    ) -> Self:
        """Return runs in memory; `truths` has ground truths by name and fingerprint of sequence."""
        source, runs = StoredRuns(), list(runs)
        source.truths |= truths
        source.runs |= {run_key(run.identity): run for run in runs}
        versions = {run_key(run.identity): run.identity.version for run in runs}
        rows = [
            run_row(run, truths[run.identity.sequence, run.identity.fingerprint]) for run in runs
        ]
        return cls(rows, versions, source, title)

    def __add__(self, later: "Runs") -> Self:
        """Return these runs and others, which take precedence."""
        source = StoredRuns(self.folder)
        source.runs = self._source.runs | later._source.runs
        source.truths = self._source.truths | later._source.truths
        rows = {run_key(row): row for row in (*self.stored_rows, *later.stored_rows)}
        requested = {**self.requested, **later.requested}
        return type(self)(rows.values(), requested, source, self.title)

    def select(self, keys: Collection[RunKey]) -> Self:
        """Return the runs with these keys, and the timing runs of their trackers and sequences.

        Whether a run is stale is decided among these runs only: other runs in the folder can be of
        a later version that is not requested any more.
        """
        selected, pairs = set(keys), {key[:2] for key in keys if key[3] != TIMING}

        def is_wanted(key: RunKey) -> bool:
            return key in selected or (key[3] == TIMING and key[:2] in pairs)

        rows = [row for row in self.stored_rows if is_wanted(run_key(row))]
        requested = {key: text for key, text in self.requested.items() if is_wanted(key)}
        return type(self)(rows, requested, self._source, self.title)

    def of_trackers(self, labels: Collection[str]) -> Self:
        """Return the runs of some trackers; runs that are stale stay stale."""
        return type(self)(self.stored_rows, self.requested, self._source, self.title, labels)

    @cached_property
    def rows(self) -> list[dict[str, Any]]:
        """Rows of `table`; the key `scores` contains the scores."""
        rows = with_one_version(with_missing(self.stored_rows, self.requested))
        chosen = self._trackers
        return rows if chosen is None else [row for row in rows if row["tracker"] in chosen]

    @cached_property
    def table(self) -> "pd.DataFrame":
        """Data frame with one row per requested or stored run, and one column per score.

        The other columns are the fields of `bench.store.run_rows.list_runs`. Requested runs that do
        not exist have the status `missing`. Runs have the status `stale` if another version of the
        tracker or sequence is requested, or if a run that was stored later has another version. A
        damaged run is missing, and a warning names it. Stale runs have no scores, so that no mean
        combines two versions.
        """
        table = to_data_frame(self.rows)
        scores = table.columns.difference([*TEXT_FIELDS, *NUMBER_FIELDS])
        table.loc[table["status"] == "stale", scores] = nan
        return table

    @property
    def timed(self) -> "pd.DataFrame":
        """Rows of `table` of timing runs."""
        return self.table[self.table["protocol"] == TIMING]

    @property
    def protocols(self) -> list[str]:
        """Keys of the protocols of the runs except timing, one-pass first."""
        keys = dict.fromkeys(row["protocol"] for row in self.rows if row["protocol"] != TIMING)
        return sorted(keys, key=lambda name: (name != ONE_PASS, name))

    @cached_property
    def truths(self) -> dict[tuple[str, str], StoredTruth]:
        """Ground truths of all stored runs by name and fingerprint of the sequence.

        Raises `ResultsError`, which names the file, if a ground truth is missing or damaged.
        """
        keys = dict.fromkeys(_truth_key(row) for row in self.rows if row["status"] != "missing")
        return {key: self._source.truth(*key) for key in keys}

    def run(self, key: RunKey) -> Run:
        """Return a run by its whole key.

        Raises `ResultsError`, which names the file, if the run is damaged or was removed.
        """
        return self._source.run(key)

    def evaluated_rows(self, **fields: str) -> list[dict[str, Any]]:
        """Return the rows of runs whose boxes are scored: all but timing, missing and stale runs.

        `fields` selects rows by values, for example `protocol="one-pass"`.
        """
        return [
            row
            for row in self.rows
            if row["protocol"] != TIMING
            and row["status"] in ("finished", "failed")
            and all(row[name] == value for name, value in fields.items())
        ]

    def read(self, rows: Iterable[Mapping[Any, Any]]) -> Iterator[RunWithTruth]:
        """Yield the runs of rows with their ground truths; raises `ResultsError` as `run`."""
        for row in rows:
            yield RunWithTruth(row, self.run(run_key(row)), self._source.truth(*_truth_key(row)))

    def outcomes(self, metrics: str, table: "pd.DataFrame") -> dict[int, MetricOutcome]:
        """Score the finished and failed runs of rows by metrics; return the outcomes by index."""
        ended = table[table["status"].isin(["finished", "failed"])]
        runs = self.read(ended.to_dict("records"))
        return {
            index: outcome_of(run, truth, metrics)
            for index, (_, run, truth) in zip(ended.index.tolist(), runs, strict=True)
        }

    def scored(
        self, metrics: str | None = None, protocol: str | None = None, *, strict: bool = False
    ) -> "pd.DataFrame":
        """Return the runs by a protocol with their scores by metrics.

        Failed runs have the worst scores, except those of a tracker whose runs all failed. Runs
        that the metrics cannot score have the status `not scored`; if `strict`, they raise
        `ResultsError`.

        Parameters
        ----------
        metrics, protocol : str, optional
            Names; by default those of this object.
        strict : bool
            Whether each finished run must have scores.

        Returns
        -------
        DataFrame
            Rows of `table`, with columns of the metrics.
        """
        metrics = metrics or self.metrics
        runs = self.table[self.table["protocol"] == (protocol or self.protocol)]
        if metrics != DEFAULT_METRICS:
            runs = self._with_metrics(runs, metrics, strict)
        return self._with_worst_scores(runs, metrics)

    def _with_metrics(self, runs: "pd.DataFrame", metrics: str, strict: bool) -> "pd.DataFrame":
        """Return runs with the scores of finished runs as columns."""
        outcomes = self.outcomes(metrics, runs[runs["status"] == "finished"])
        refused = {index: text for index, text in outcomes.items() if isinstance(text, str)}
        if refused and strict:
            raise ResultsError(next(iter(refused.values())))
        if refused:
            runs = runs.copy()
            runs.loc[[*refused], "status"] = NOT_SCORED
            runs.loc[[*refused], "failure"] = [*refused.values()]
        columns = list(find_metrics(metrics).metrics)
        return runs.drop(columns=columns, errors="ignore").join(score_columns(outcomes, columns))

    def _with_worst_scores(self, runs: "pd.DataFrame", metrics: str) -> "pd.DataFrame":
        """Return a copy of runs with the worst scores in failed rows, which stay failed."""
        filled, comparable = runs.copy(), without_failed_trackers(runs)
        failed = comparable[comparable["status"] == "failed"]
        for index, outcome in self.outcomes(metrics, failed).items():
            scores = {} if isinstance(outcome, str) else dict(outcome.scores)
            masks = runs.filter(regex="region|contour")[runs["tracker"] == runs["tracker"][index]]
            scores |= dict.fromkeys(masks.columns[masks.notna().any()], 0.0)
            for column, value in scores.items():
                filled.loc[index, column] = value
        return filled

    @cached_property
    def attributes(self) -> dict[str, set[str]]:
        """Names of the attributes that occur in each sequence with runs.

        Raises `ResultsError`, which names the file, if a ground truth is missing or damaged.
        """
        occurring: dict[str, set[str]] = {}
        for row in self.rows:
            if row["status"] in ("finished", "failed"):
                flags = self.truths[_truth_key(row)].attributes
                names = {name for name, in_frames in flags.items() if in_frames.any()}
                occurring.setdefault(row["sequence"], set()).update(names)
        return occurring

    @property
    def failures(self) -> "pd.DataFrame":
        """Failed runs of the mapping: tracker, sequence, frame, error, repetition.

        The frame is missing if it is unknown, or if the sequence cannot be opened.
        """
        import pandas as pd

        rows = [
            [name[0], name[1], *_frame_and_error(run), name[2]]
            for name, run in self.items()
            if run.failure
        ]
        names = ["tracker", "sequence", "frame", "error", "repetition"]
        return pd.DataFrame(rows, columns=names).astype({"frame": "Int64"})

    @cached_property
    def _names(self) -> dict[RunName, RunKey]:
        keys = (run_key(row) for row in self.rows if row["status"] != "missing")
        return {key[:3]: key for key in keys if key[3] == self.protocol}

    def __getitem__(self, name: tuple[str, str] | RunName) -> Run:
        if not (isinstance(name, tuple) and len(name) in (2, 3)):
            raise TypeError(
                f"runs[{name!r}]: expected tracker and sequence, for example "
                "runs['camshift', 'face']; list(runs) has all names."
            )
        tracker, sequence, repetition = (*name, 0)[:3]
        sequence = complete_name(sequence, {sequence for _, sequence, _ in self._names})
        run_name = tracker, sequence, repetition
        if run_name not in self._names:
            names = [str(other) for other in self._names]
            close = get_close_matches(str(run_name), names, n=3, cutoff=0) or ["none"]
            raise KeyError(f"no run {run_name}. The nearest ones are {', '.join(close)}.")
        return self.run(self._names[run_name])

    def __iter__(self) -> Iterator[RunName]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def __repr__(self) -> str:
        where = "in memory" if self.folder is None else f"in {self.folder}"
        trackers, sequences, _ = map(set, zip(*self, strict=True)) if len(self) else [()] * 3
        counts = {"tracker": trackers, "sequence": sequences, "run": self}
        words = [f"{len(names)} {word}{'s' * (len(names) != 1)}" for word, names in counts.items()]
        return f"<Runs of {', '.join(words)} {where}>"


def without_failed_trackers(table: "pd.DataFrame") -> "pd.DataFrame":
    """Return the rows without those of trackers whose runs all failed."""
    return table[table["tracker"].isin(table["tracker"][table["status"] != "failed"])]


def score_columns(
    outcomes: Mapping[int, MetricOutcome], columns: Collection[str]
) -> "pd.DataFrame":
    """Return a data frame of scores with the index of `outcomes`, without runs that have none."""
    import pandas as pd

    scores = {
        index: dict(outcome.scores)
        for index, outcome in outcomes.items()
        if isinstance(outcome, MetricResult)
    }
    return pd.DataFrame.from_dict(scores, "index", columns=list(columns))


def complete_name(sequence: str, names: Iterable[str]) -> str:
    """Return the only name whose last part is `sequence`; `sequence` if it is a name itself."""
    ends = [name for name in names if sequence in (name, name.rpartition("/")[2])]
    return ends[0] if sequence not in ends and len(ends) == 1 else sequence


def reopen_sequence(row: Mapping[Any, Any]) -> datasets.Sequence:
    """Open the sequence on which the run of a row was made.

    Raises `SequenceError` if it cannot be opened, or if it has changed since the run.
    """
    name, source = row["sequence"], row["source"]
    try:
        sequence = datasets.load(source, truth=row["truth"] or None)
    except SequenceError as error:
        raise SequenceError(f"{name} cannot be opened at {source}.") from error
    if sequence.fingerprint != row["fingerprint"]:
        raise SequenceError(f"{name} at {source} has changed since the run.")
    return sequence


def _truth_key(row: Mapping[Any, Any]) -> tuple[str, str]:
    return row["sequence"], row["fingerprint"]


def _frame_and_error(run: Run) -> tuple[int | None, str]:
    """Return the index of the frame of a failure, if it is known, and the error in one line."""
    name, _, error = run.failure.splitlines()[0].partition(": ")
    try:
        sequence = run.open_sequence()
        return [sequence.frame_name(index) for index in range(len(sequence))].index(name), error
    except ValueError:  # no frame, or the sequence cannot be opened
        return None, error
