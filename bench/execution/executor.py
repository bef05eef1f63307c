"""Execution of an experiment: executes, stores and scores missing runs, and writes the log."""

import math
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

from trackmark import datasets
from trackmark.bench.engine import Engine, engine
from trackmark.bench.engine.work_unit import Limits, Outcome, Unit
from trackmark.bench.execution.plan import KnownSequences, Plan, State, make_plan
from trackmark.bench.execution.scheduling import Units, missing_units
from trackmark.bench.experiments.experiment import Experiment, SequenceSource, read_experiment
from trackmark.bench.store.layout import run_key
from trackmark.bench.store.log import RunLog
from trackmark.bench.store.results import Results
from trackmark.bench.store.run_rows import add_scores, run_row
from trackmark.bench.store.truth import read_truth, write_truth
from trackmark.datasets import SequenceError


def run_experiment(
    experiment: Experiment | str | Path,
    output: str | Path = "results",
    jobs: int | None = None,
    *,
    retry_failed: bool = False,
    engine: str = "local",
    address: str | None = None,
    limits: Limits | None = None,
) -> Path:
    """Execute the missing runs of an experiment.

    Parameters
    ----------
    experiment : Experiment, str or Path
        Experiment, or its name or TOML file for `read_experiment`.
    output : str or Path
        Results folder; the experiment gets a subfolder of its name.
    jobs : int, optional
        Number of worker processes; one per core by default.
    retry_failed : bool
        Whether failed runs are repeated.
    engine : {'local', 'dask'}
        Engine that executes the runs: this machine, or a Dask cluster.
    address : str, optional
        Scheduler of a running Dask cluster.
    limits : Limits, optional
        Limits of time and memory of a tracker.

    Returns
    -------
    Path
        The experiment's folder, for `load_runs`.

    Raises
    ------
    TrackerError, SequenceError, ExperimentError, ResultsError
        If a part of the experiment cannot be executed. Finished runs stay stored.
    """
    if not isinstance(experiment, Experiment):
        experiment = read_experiment(experiment)
    execution = Execution(
        experiment,
        Path(output),
        jobs,
        retry_failed=retry_failed,
        engine=engine,
        address=address,
        limits=limits or Limits(),
    )
    for _ in execution.rows():
        pass
    if execution.errors:
        raise SequenceError("\n".join(execution.errors))
    return execution.folder


@dataclass
class Execution:
    """Execution of an experiment.

    `folder` is the folder of the results. `plan` holds the states of the runs before the execution.
    """

    experiment: Experiment  # this field and the next five are parameters of `run_experiment`
    output: Path
    jobs: int | None = None
    retry_failed: bool = False
    engine: str = "local"
    address: str | None = None
    limits: Limits = field(default_factory=Limits)
    known_sequences: KnownSequences = field(default_factory=dict)  # sequences that are already open
    on_opened: Callable[[int, int], None] = lambda *_: None  # see `make_plan`
    errors: list[str] = field(default_factory=list)  # messages on sequences that could not be read

    def __post_init__(self) -> None:
        self.folder = self.output / self.experiment.name
        self._results = Results(self.folder)
        jobs = self.jobs or os.cpu_count() or 1
        self.plan: Plan = make_plan(
            self.experiment, self._results, self.known_sequences, self.on_opened, jobs
        )
        self._harness_seconds = 0.0
        self._frame_count = 0
        self._truths: set[tuple[SequenceSource, str]] = set()  # stored ones

    @cached_property
    def performer(self) -> Engine:
        """Engine for the runs, with a single worker if runs depend on the time of updates."""
        jobs = 1 if self.experiment.time_dependent else self.jobs
        return engine(self.engine, jobs=jobs, address=self.address)

    @cached_property
    def units(self) -> Units:
        """Work units of the missing runs."""
        workers = self.performer.workers
        return missing_units(self.plan, workers=workers, retry_failed=self.retry_failed)

    @property
    def work(self) -> int:
        """Total work of the missing runs: frames times trackers."""
        return self.units.work

    @property
    def overhead(self) -> float:
        """Mean time of the harness per frame and tracker [s]; NaN before the first run."""
        return self._harness_seconds / self._frame_count if self._frame_count else math.nan

    def rows(self, progress: Callable[[int], None] | None = None) -> Iterator[dict[str, Any]]:
        """Execute the missing runs; yield the row of each stored run.

        Raises `ResultsError` if results cannot be written.
        """
        units = self.units
        self._results.prepare(self.plan.manifest())
        if not units.runs:
            return
        log = RunLog(self.folder)
        log.write("start", **self._start_entry())
        started_at = time.monotonic()
        end = "stopped"
        scored: list[dict[str, Any]] = []
        try:
            report = progress or (lambda _: None)
            for unit, outcome in self.performer.perform(units, self.limits, report):
                try:
                    if isinstance(outcome, Exception):
                        raise outcome
                    rows = self._store(unit, outcome)
                except SequenceError as error:
                    log.write("error", **_unit_entry(unit), error=str(error))
                    if str(error) not in self.errors:
                        self.errors.append(str(error))
                    continue
                log.write("unit", **_unit_entry(unit), **_outcome_entry(outcome, rows))
                if math.isfinite(outcome.overhead):
                    self._harness_seconds += outcome.overhead * unit.work
                    self._frame_count += unit.work
                scored += rows
                yield from rows
            end = "finished"
        finally:
            add_scores(self._results, scored)  # otherwise computed by the next reader
            log.write("end", outcome=end, seconds=round(time.monotonic() - started_at, 3))

    def _store(self, unit: Unit, outcome: Outcome) -> list[dict[str, Any]]:
        """Store and score the runs of a unit; return their rows."""
        source = unit.source.absolute()
        if (unit.source, unit.fingerprint) not in self._truths:
            sequence = datasets.load(source.text, truth=source.truth)
            write_truth(self.folder, sequence)
            self._truths.add((unit.source, sequence.fingerprint))
        if (unit.source, unit.fingerprint) not in self._truths:
            raise SequenceError(
                f"{unit.source.text}: the sequence changed during its runs, which were not stored. "
                "Run the same command again."
            )
        origin = {"source": source.text, "truth": str(source.truth or ""), "host": outcome.host}
        # A run that another process has stored in the meantime is kept.
        self._results.write_all(
            (replace(run, circumstances={**run.circumstances, **origin}), entry.replaces)
            for entry, run in zip(outcome.entries, outcome.runs, strict=True)
        )
        stored = [self._results.read(run_key(run.identity)) for run in outcome.runs]
        truth = cache(partial(read_truth, self.folder))
        return [run_row(r, truth(r.identity.sequence, r.identity.fingerprint)) for r in stored]

    def _start_entry(self) -> dict[str, Any]:
        """Return the first entry of the log."""
        limits = self.limits
        return {
            "trackmark": version("trackmark"),
            "experiment": self.experiment.name,
            "protocol": self.plan.protocol,
            "trackers": [spec.label for spec in self.plan.trackers.values()],
            "sequences": len(self.plan.sequences),
            "runs": len(self.plan),
            **{state.name.lower(): self.plan.count(state) for state in State},
            "units": len(self.units),
            "engine": self.engine,
            "workers": self.performer.workers,
            "limits": {**vars(limits)},
        }


def _unit_entry(unit: Unit) -> dict[str, Any]:
    """Return the sequence and the runs of a unit for the log."""
    runs: dict[str, list[int]] = {}
    for entry in unit.entries:
        runs.setdefault(entry.tracker, []).append(entry.repetition)
    return {"sequence": unit.source.text, "frames": unit.frames, "runs": runs}


def _outcome_entry(outcome: Outcome, rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the time and memory of a unit and its failed runs, for the log."""
    failed = [
        {key: row[key] for key in ("tracker", "repetition", "failure")}
        for row in rows
        if row["status"] == "failed"
    ]
    return {
        "host": outcome.host,
        "process": outcome.process,
        "seconds": round(outcome.seconds, 3),
        "cpu_seconds": round(outcome.cpu_seconds, 3),
        "peak_memory": outcome.peak_memory,
        "failed": failed,
    }
