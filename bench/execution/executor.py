"""Running an experiment: plan, perform what is left, keep index and log."""

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
from trackmark.bench.execution.scheduling import Units, left_of
from trackmark.bench.experiments.experiment import Experiment, SequenceSource, read_experiment
from trackmark.bench.store.index import add_scores, index_row
from trackmark.bench.store.layout import cell_of
from trackmark.bench.store.log import RunLog
from trackmark.bench.store.results import Results
from trackmark.bench.store.truth import read_truth, write_truth
from trackmark.datasets import SequenceError


def run(
    experiment: Experiment | str | Path,
    output: str | Path = "results",
    jobs: int | None = None,
    *,
    retry_failed: bool = False,
    engine: str = "local",
    address: str | None = None,
    limits: Limits | None = None,
) -> Path:
    """Run what an experiment asks for and is not there yet.

    Parameters
    ----------
    experiment : Experiment, str or Path
        What to run; a name or a TOML file is read by `read_experiment`.
    output : str or Path
        Folder of results; the experiment gets a folder of its name in it.
    jobs : int, optional
        Worker processes; as many as there are cores by default.
    retry_failed : bool
        Also repeat runs that failed.
    engine : {'local', 'dask'}
        Run on this machine, or on a Dask cluster.
    address : str, optional
        Scheduler of a running Dask cluster.
    limits : Limits, optional
        What a tracker may take before it counts as failed.

    Returns
    -------
    Path
        The experiment's folder, for `load_results`.

    Raises
    ------
    TrackerError, SequenceError, ExperimentError, ResultsError
        For what can't be run. What had finished stays, and is not run again.
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
    """One go at an experiment.

    `folder` holds the experiment's results; `plan` says what was there and what was left when it
    began.
    """

    experiment: Experiment  # as `run` has them
    output: Path
    jobs: int | None = None
    retry_failed: bool = False
    engine: str = "local"
    address: str | None = None
    limits: Limits = field(default_factory=Limits)
    # Sequences that were opened for another execution, and need not be again.
    known: KnownSequences = field(default_factory=dict)
    # Told how many sequences have been opened, and of how many.
    opened: Callable[[int, int], None] = lambda *_: None
    # Sequences that could not be read to their end; the other runs went on.
    errors: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.folder = self.output / self.experiment.name
        self._results = Results(self.folder)
        jobs = self.jobs or os.cpu_count() or 1
        self.plan: Plan = make_plan(self.experiment, self._results, self.known, self.opened, jobs)
        self._own_seconds = 0.0
        self._shown_frames = 0
        self._truths: set[tuple[SequenceSource, str]] = set()  # stored, with fingerprints

    @cached_property
    def performer(self) -> Engine:
        """The engine; runs that depend on how long trackers take go one by one."""
        jobs = 1 if self.experiment.clocked else self.jobs
        return engine(self.engine, jobs=jobs, address=self.address)

    @cached_property
    def units(self) -> Units:
        """What is left to do."""
        workers = self.performer.workers
        return left_of(self.plan, workers=workers, retry_failed=self.retry_failed)

    @property
    def work(self) -> int:
        """How much that is: frames times trackers."""
        return self.units.work

    @property
    def overhead(self) -> float:
        """The harness's own seconds per frame and tracker so far; NaN where nothing was run."""
        return self._own_seconds / self._shown_frames if self._shown_frames else math.nan

    def rows(self, progress: Callable[[int], None] | None = None) -> Iterator[dict[str, Any]]:
        """Perform what is left; give the index's row of every run as it is finished.

        Raises `ResultsError` where results can't be written.
        """
        units = self.units
        self._results.prepare(self.plan.asked())
        if not units.runs:
            return
        log = RunLog(self.folder)
        log.write("start", **self._told())
        began = time.monotonic()
        ended = "stopped"
        scored: list[dict[str, Any]] = []
        try:
            report = progress or (lambda _: None)
            for unit, outcome in self.performer.perform(units, self.limits, report):
                try:
                    if isinstance(outcome, Exception):
                        raise outcome
                    rows = self._store(unit, outcome)
                except SequenceError as error:
                    log.write("error", **_named(unit), error=str(error))
                    if str(error) not in self.errors:
                        self.errors.append(str(error))
                    continue
                log.write("unit", **_named(unit), **_spent(outcome, rows))
                if math.isfinite(outcome.overhead):
                    self._own_seconds += outcome.overhead * unit.work
                    self._shown_frames += unit.work
                scored += rows
                yield from rows
            ended = "finished"
        finally:
            add_scores(self._results, scored)  # after a kill, the next reader computes them again
            log.write("end", outcome=ended, seconds=round(time.monotonic() - began, 3))

    def _store(self, unit: Unit, outcome: Outcome) -> list[dict[str, Any]]:
        """Store and score the runs of a unit; return their rows of the index."""
        source = unit.source.absolute()
        if (unit.source, unit.truth) not in self._truths:
            sequence = datasets.load(source.text, truth=source.truth)
            write_truth(self.folder, sequence)
            self._truths.add((unit.source, sequence.fingerprint))
        if (unit.source, unit.truth) not in self._truths:
            raise SequenceError(
                f"{unit.source.text}: the sequence changed while it ran, so nothing was kept. Run "
                "the same command again."
            )
        origin = {"source": source.text, "truth": str(source.truth or ""), "host": outcome.host}
        # If another process has stored a run meanwhile, that one stays.
        self._results.write_all(
            (replace(run, circumstances={**run.circumstances, **origin}), entry.replaces)
            for entry, run in zip(outcome.entries, outcome.runs, strict=True)
        )
        stored = [self._results.read(cell_of(run.identity)) for run in outcome.runs]
        truth = cache(partial(read_truth, self.folder))
        return [index_row(r, truth(r.identity.sequence, r.identity.fingerprint)) for r in stored]

    def _told(self) -> dict[str, Any]:
        """What a log begins with."""
        limits = self.limits
        return {
            "trackmark": version("trackmark"),
            "experiment": self.experiment.name,
            "protocol": self.plan.protocol,
            "trackers": [chosen.label for chosen in self.plan.trackers.values()],
            "sequences": len(self.plan.sequences),
            "runs": len(self.plan),
            **{state.name.lower(): self.plan.count(state) for state in State},
            "units": len(self.units),
            "engine": self.engine,
            "workers": self.performer.workers,
            "limits": {**vars(limits)},
        }


def _named(unit: Unit) -> dict[str, Any]:
    """A unit as a log tells it."""
    runs: dict[str, list[int]] = {}
    for entry in unit.entries:
        runs.setdefault(entry.tracker, []).append(entry.repetition)
    return {"sequence": unit.source.text, "frames": unit.frames, "runs": runs}


def _spent(outcome: Outcome, rows: list[dict[str, Any]]) -> dict[str, Any]:
    """What a unit cost, and which of its runs failed."""
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
