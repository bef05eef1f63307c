"""Runs of an experiment with their scores and ground truths, from a results folder or in memory."""

import json
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import suppress
from difflib import get_close_matches
from functools import cached_property
from math import nan
from operator import itemgetter
from pathlib import Path
from sqlite3 import Row
from typing import TYPE_CHECKING, Any, NamedTuple, Self, TypeAlias

from trackmark import datasets
from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.evaluation.scoring import MetricOutcome, outcome_of, score_both
from trackmark.bench.metrics import find_metrics
from trackmark.bench.metrics.interface import MetricResult
from trackmark.bench.protocols import ONE_PASS, TIMING
from trackmark.bench.store.database import (
    FILE_NAME,
    RUN_KEY_COLUMNS,
    DamagedError,
    ResultsError,
    RunKey,
    no_results,
    open_database,
    refuse_empty_file,
    run_key,
    warn_of_damage,
)
from trackmark.bench.store.run_rows import (
    NUMBER_FIELDS,
    TEXT_FIELDS,
    identity_fields,
    row_of,
    run_row,
    scorer_version,
)
from trackmark.bench.store.run_store import (
    RUN_KEY,
    RunStore,
    decoded_run,
    identity_of,
    insert_scores,
    read_requests,
    sort_key,
)
from trackmark.bench.store.truth import StoredTruth, missing_truth, read_truth, truth_of_row
from trackmark.datasets import SequenceError

if TYPE_CHECKING:
    import pandas as pd

RunName: TypeAlias = tuple[str, str, int]
"""Tracker, sequence and repetition of a run."""

DEFAULT_METRICS = "native"

NOT_SCORED = "not scored"
"""Status of finished runs that metrics cannot score."""

MAX_KEPT = 1 << 30
"""Maximum size of the packed arrays of runs that stay in memory after they were read [bytes]."""

_BATCH = 1000  # runs whose scores are stored in one transaction


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

    A results folder is read in one transaction. Its whole content is read in any case, because
    digests are compared. Runs therefore stay in memory, packed, and are unpacked when they are
    used. Those that exceed `MAX_KEPT` are read again then.

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
        One row per finished or failed run, in order; `rows` also has the missing ones. The keys are
        `TEXT_FIELDS`, `NUMBER_FIELDS` and `scores`. `parameters` is JSON. `version` depends on
        tracker, parameters and sequence; `tracker_version` depends on the tracker's code and
        libraries. `source` and `truth` are the paths from which the sequence was opened. `seconds`
        is the wall time of all calls of the tracker, and `reading_seconds` the mean time to decode
        or render an image [s]. `bench.metrics.times.time_fields` describes the times per frame and
        `time_note`. `clock` is the clock of these times, and `machine` the machine on which they
        were measured. `date` is the date and time (UTC, ISO 8601) at which the run was stored
        first. `generators` are the global random generators from which the tracker has drawn.
        `scores` are those of `bench.evaluation.score_both`. Damaged runs, and runs whose ground
        truth is damaged or missing, are left out, with a warning on standard error.
    requested : mapping of RunKey to str
        Requested versions of the runs.
    """

    def __init__(
        self,
        rows: Iterable[dict[str, Any]],
        requested: Mapping[RunKey, str],
        folder: Path | None = None,
        title: str = "",
        runs: Mapping[RunKey, Run | Row] | None = None,
        truths: dict[tuple[str, str], StoredTruth | Row] | None = None,
        trackers: Collection[str] | None = None,
    ) -> None:
        self.folder, self.title = folder, title
        self.protocol, self.metrics = ONE_PASS, DEFAULT_METRICS
        self.stored_rows, self.requested = list(rows), requested
        self._runs, self._truths, self._trackers = runs or {}, truths or {}, trackers

    @classmethod
    def open(cls, folder: Path, progress: Callable[[int, int], None] = lambda *_: None) -> Self:
        """Return the runs in the results folder of an experiment; score those without scores.

        `progress` is called with the number of runs scored so far, and the number of runs to score.
        Raises `ResultsError` if there are no results, or if the file is damaged.
        """
        if not (folder / FILE_NAME).is_file():
            raise no_results(folder)
        refuse_empty_file(folder)
        runs = cls.unscored(folder)
        runs.title = runs.title or folder.absolute().name
        runs._score(folder, progress)
        return runs

    @classmethod
    def unscored(cls, folder: Path, *, keeps_runs: bool = True) -> Self:
        """Return the runs in a results folder, with those scores only that are stored.

        `keeps_runs` is false if only rows are needed. A folder without results has no runs. Raises
        `ResultsError` if the file is damaged.
        """
        room = MAX_KEPT if keeps_runs else 0
        rows: list[dict[str, Any]] = []
        runs: dict[RunKey, Run | Row] = {}
        fields_of_version: dict[str, dict[str, Any]] = {}
        with open_database(folder) as database:
            title, requested = read_requests(database)
            named = {
                tuple(row) for row in database.select("SELECT sequence, fingerprint FROM truth")
            }
            truths: dict[tuple[str, str], StoredTruth | Row] = {
                _truth_key(row): row for row in database.rows("truth", on_damage=warn_of_damage)
            }
            # Damaged scores are computed again.
            scored = database.rows(
                "score", "scorer = ?", scorer_version(), on_damage=lambda _: None
            )
            scores = {row["run"]: row["scores"] for row in scored}
            for row in database.rows("run", on_damage=warn_of_damage):
                if (truth := _truth_key(row)) not in truths:
                    if truth not in named:
                        warn_of_damage(missing_truth(database.path, *truth))
                    continue
                if row["version"] not in fields_of_version:
                    fields_of_version[row["version"]] = identity_fields(identity_of(row))
                fields = (row[name] for name in ("repetition", "status", "failure", "frames"))
                shared, metadata = fields_of_version[row["version"]], json.loads(row["metadata"])
                rows.append(row_of(shared, metadata, *fields))
                if row["id"] in scores:
                    rows[-1]["scores"] = json.loads(scores[row["id"]])
                room -= len(row["arrays"])
                if room >= 0:
                    runs[run_key(row)] = row
        rows.sort(key=lambda row: sort_key(run_key(row)))
        return cls(rows, requested, folder, title, runs, truths)

    def _score(self, folder: Path, progress: Callable[[int, int], None]) -> None:
        """Score the runs without scores, and store their scores.

        Runs that were damaged or removed after the rows were read are left out, with a warning.
        """
        unscored = [row for row in self.stored_rows if "scores" not in row]
        for begin in range(0, len(unscored), _BATCH):
            batch = unscored[begin : begin + _BATCH]
            for done, row in enumerate(batch, begin + 1):
                try:
                    row["scores"] = score_both(self.run(run_key(row)), self._truth(_truth_key(row)))
                except DamagedError as error:
                    warn_of_damage(str(error))
                progress(done, len(unscored))
            with suppress(ResultsError):  # in a read-only folder, every reader computes the scores
                store_scores(folder, [row for row in batch if "scores" in row])
        self.stored_rows = [row for row in self.stored_rows if "scores" in row]

    @classmethod
    def in_memory(cls, runs: Iterable[Run], truths: Iterable[StoredTruth], title: str = "") -> Self:
        """Return runs in memory; `truths` are the ground truths of their sequences."""
        truth_of = {(truth.name, truth.fingerprint): truth for truth in truths}
        by_key = {run_key(run.identity): run for run in runs}
        rows = [
            run_row(run, truth_of[run.identity.sequence, run.identity.fingerprint])
            for run in by_key.values()
        ]
        versions = {key: run.identity.version for key, run in by_key.items()}
        return cls(rows, versions, None, title, by_key, {**truth_of})

    def __add__(self, later: "Runs") -> Self:
        """Return these runs and others, which take precedence."""
        rows = {run_key(row): row for row in (*self.stored_rows, *later.stored_rows)}
        return type(self)(
            rows.values(),
            {**self.requested, **later.requested},
            self.folder,
            self.title,
            {**self._runs, **later._runs},
            {**self._truths, **later._truths},
        )

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
        return type(self)(rows, requested, self.folder, self.title, self._runs, self._truths)

    def of_trackers(self, labels: Collection[str]) -> Self:
        """Return the runs of some trackers; runs that are stale stay stale."""
        return type(self)(
            self.stored_rows,
            self.requested,
            self.folder,
            self.title,
            self._runs,
            self._truths,
            labels,
        )

    @cached_property
    def rows(self) -> list[dict[str, Any]]:
        """Rows of `table`; the key `scores` contains the scores."""
        rows = _rows_in_order(self.stored_rows, self.requested)
        labels = self._trackers
        return rows if labels is None else [row for row in rows if row["tracker"] in labels]

    @cached_property
    def table(self) -> "pd.DataFrame":
        """Data frame with one row per requested or stored run, and one column per score.

        The other columns are the fields of `stored_rows`. Requested runs that do not exist have the
        status `missing`. Runs have the status `stale` if another version of the
        tracker or sequence is requested, or if a run that was stored later has another version. A
        damaged run is missing, and a warning names it. Stale runs have no scores, so that no mean
        combines two versions.
        """
        table = _data_frame(self.rows)
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
        return {key: self._truth(key) for key in keys}

    def _truth(self, key: tuple[str, str]) -> StoredTruth:
        """Return a ground truth by name and fingerprint; it is unpacked once."""
        if key not in self._truths and self.folder is not None:
            self._truths[key] = read_truth(self.folder, *key)
        truth = self._truths[key]
        if isinstance(truth, Row):
            truth = self._truths[key] = truth_of_row(truth)
        return truth

    def run(self, key: RunKey) -> Run:
        """Return a run by its whole key.

        Raises `ResultsError`, which names the file, if a run that must be read again is damaged or
        was removed.
        """
        if key not in self._runs and self.folder is not None:
            return RunStore(self.folder).read(key)
        run = self._runs[key]
        return run if isinstance(run, Run) else decoded_run(run)

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
            yield RunWithTruth(row, self.run(run_key(row)), self._truth(_truth_key(row)))

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


def list_runs(folder: Path) -> list[dict[str, Any]]:
    """Return the rows of a results folder, which can lack `scores`; see `Runs.stored_rows`."""
    return Runs.unscored(folder, keeps_runs=False).stored_rows


def store_scores(folder: Path, rows: Iterable[Mapping[str, Any]]) -> None:
    """Store the scores of rows, unless their runs were replaced or removed in the meantime.

    Raises `ResultsError` if they cannot be written.
    """
    query = f"SELECT id FROM run WHERE {RUN_KEY} AND version = ? AND status = ?"
    with open_database(folder, for_writing=True) as database:
        for row in rows:
            for (run_id,) in database.select(query, *run_key(row), row["version"], row["status"]):
                insert_scores(database, run_id, row)


def _rows_in_order(
    rows: Iterable[dict[str, Any]], requested: Mapping[RunKey, str]
) -> list[dict[str, Any]]:
    """Return rows of requested stored runs, of other stored runs, and of missing runs, in order.

    The status of a missing run is `missing`. The status of a stored run is `stale` if another
    version is requested, or if another version of its tracker or sequence was stored later. If only
    a part of the runs was repeated after an edit, scores of both versions must not be averaged.
    """
    row_of_key = {run_key(row): row for row in rows}
    missing = [key for key in requested if key not in row_of_key]
    keys = [key for key in dict.fromkeys([*requested, *row_of_key]) if key in row_of_key]
    trackers, sequences = dict[str, str](), dict[str, str]()
    for row in sorted((row_of_key[key] for key in keys), key=itemgetter("date")):
        trackers[row["tracker"]] = row["tracker_version"]  # the last one remains
        sequences[row["sequence"]] = row["fingerprint"]
    ordered: list[dict[str, Any]] = []
    for key in keys:
        row = row_of_key[key]
        versions = row["version"], row["tracker_version"], row["fingerprint"]
        current = requested.get(key, row["version"]), trackers[key[0]], sequences[key[1]]
        ordered.append(row if versions == current else {**row, "status": "stale"})
    for key in missing:
        fields = dict(zip(RUN_KEY_COLUMNS, key, strict=True))
        ordered.append({**fields, "status": "missing", "failure": ""})
    return ordered


def _data_frame(rows: list[dict[str, Any]]) -> "pd.DataFrame":
    """Convert rows to a data frame with scores as columns."""
    import pandas as pd

    # No categories: pandas cannot reindex groups of more than 127 categories. Objects share equal
    # texts; the type `str` copies them.
    columns: dict[str, Any] = {}
    for name in (*TEXT_FIELDS, *NUMBER_FIELDS):
        columns[name] = pd.Series([row.get(name) for row in rows], dtype=object)
    types = dict.fromkeys(NUMBER_FIELDS, "float64") | {"repetition": "int32"}
    if not (columns["status"] == "missing").any():
        types["frames"] = "int32"
    scores = dict[str, None]()
    for row in rows:
        scores |= dict.fromkeys(row.get("scores", ()))
    for name in scores:
        values = [row.get("scores", {}).get(name) for row in rows]
        columns[name] = pd.Series(values, dtype="float64")
    return pd.DataFrame(columns).astype(types)


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


def _truth_key(row: Mapping[Any, Any] | Row) -> tuple[str, str]:
    return row["sequence"], row["fingerprint"]


def _frame_and_error(run: Run) -> tuple[int | None, str]:
    """Return the index of the frame of a failure, if it is known, and the error in one line."""
    name, _, error = run.failure.splitlines()[0].partition(": ")
    try:
        sequence = run.open_sequence()
        return [sequence.frame_name(index) for index in range(len(sequence))].index(name), error
    except ValueError:  # no frame, or the sequence cannot be opened
        return None, error
