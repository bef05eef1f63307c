"""Running an experiment: plan, perform what is left, keep the index."""

import math
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bench.engine import Job, engine
from bench.experiment import Experiment, read_experiment
from bench.plan import Plan, make_plan
from bench.store.files import ResultsError
from bench.store.index import read_index, write_index
from bench.store.results import Results
from datasets import SequenceError

__all__ = ["Execution", "run"]

_INDEX_SECONDS = 5.0


def run(
    experiment: Experiment | str | Path,
    output: str | Path = "results",
    jobs: int | None = None,
    *,
    retry_failed: bool = False,
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
    execution = Execution(experiment, Path(output), jobs, retry_failed=retry_failed)
    for _ in execution.rows():
        pass
    if execution.errors:
        raise SequenceError("\n".join(execution.errors))
    return execution.folder


@dataclass
class Execution:
    """One go at an experiment.

    Attributes
    ----------
    folder : Path
        The experiment's results.
    plan : Plan
        What was there and what was left when it began.
    errors : list of str
        Sequences that could not be read to their end; the other runs went on.
    overhead : float
        The harness's own seconds per frame and tracker, over all passes so far; NaN where
        there was none.
    """

    experiment: Experiment
    output: Path
    jobs: int | None = None
    retry_failed: bool = False
    errors: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.folder = self.output / self.experiment.name
        self._results = Results(self.folder)
        self.plan: Plan = make_plan(self.experiment, self._results)
        self.units = self.plan.units(retry_failed=self.retry_failed)
        self.work = sum(unit.work for unit in self.units)
        self._own_seconds = 0.0
        self._shown_frames = 0

    @property
    def overhead(self) -> float:
        """See the class."""
        return self._own_seconds / self._shown_frames if self._shown_frames else math.nan

    def rows(self, progress: Callable[[int], None] | None = None) -> Iterator[dict[str, Any]]:
        """Perform what is left; give the index's row of every run as it is finished.

        Raises
        ------
        ResultsError
            Where results can't be written.
        """
        self._results.prepare(self.plan.asked())
        index = {row["path"]: row for row in read_index(self._results)}
        jobs = 1 if self.experiment.timing else self.jobs or os.cpu_count() or 1
        written = time.monotonic()
        try:
            performer = engine(jobs=jobs)
            job = Job(self.folder.absolute())
            told = progress or (lambda _: None)
            for unit, outcome in performer.perform(self.units, job, told):
                if isinstance(outcome, ResultsError):
                    raise outcome
                if isinstance(outcome, SequenceError):
                    if str(outcome) not in self.errors:
                        self.errors.append(str(outcome))
                    continue
                if isinstance(outcome, Exception):
                    raise outcome
                if math.isfinite(outcome.overhead):
                    self._own_seconds += outcome.overhead * unit.work
                    self._shown_frames += unit.work
                index |= {row["path"]: row for row in outcome.rows}
                yield from outcome.rows
                if time.monotonic() - written > _INDEX_SECONDS:
                    write_index(self._results, [index[key] for key in sorted(index)])
                    written = time.monotonic()
        finally:
            # Files first, index after: what a kill leaves out is found by the next reader.
            write_index(self._results, [index[key] for key in sorted(index)])
