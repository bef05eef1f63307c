"""Execution of the missing runs of an experiment, with progress and messages."""

from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from trackmark.bench.commands._options import ExecutionOptions
from trackmark.bench.commands._progress import (
    RunProgress,
    print_event,
    print_message,
    print_progress,
    report_slow_work,
)
from trackmark.bench.experiments.experiment import Experiment

if TYPE_CHECKING:
    from trackmark.bench.execution.executor import Execution
    from trackmark.bench.execution.plan import OpenedSequences, Plan


def plan_experiment(
    experiment: Experiment,
    options: ExecutionOptions,
    *,
    retry_failed: bool = False,
    opened_sequences: "OpenedSequences | None" = None,
) -> "Execution":
    """Plan an experiment in the results folder of the options.

    `opened_sequences`: sequences that are already open; newly opened ones are added.
    """
    from trackmark.bench.execution.executor import Execution

    with report_slow_work("Opening trackers and sequences") as opened:
        return Execution(
            experiment,
            **vars(options),
            retry_failed=retry_failed,
            opened_sequences={} if opened_sequences is None else opened_sequences,
            progress=opened,
        )


def execute_runs(
    execution: "Execution",
    on_row: Callable[[Mapping[str, Any]], None] = lambda _: None,
    *,
    progress: RunProgress | None = None,
    keep_errors: bool = False,
) -> None:
    """Execute the missing runs of a plan; Ctrl-C prints how many runs are stored and where.

    `on_row` is called with the row of each run. `progress` is that of several executions, and
    expects the runs of this execution. Raises `SequenceError` if a sequence cannot be read. With
    `keep_errors`, the message is only added to `execution.errors`.
    """
    try:
        with ExitStack() as stack:
            if progress is None:
                run_progress = RunProgress(run_title(execution), execution.folder)
                progress = stack.enter_context(run_progress)
                progress.expect(execution)
            progress.begin()
            execution.on_error = partial(print_progress, "ERROR")
            tasks = execution.tasks
            for row in execution.rows(progress.update):
                if execution.tasks is not tasks:  # a tracker has turned out to be stochastic
                    tasks = execution.tasks
                    progress.expect(execution)
                progress.add(row)
                on_row(row)
    except KeyboardInterrupt:
        if progress is None or progress.folder is not None:  # the caller keeps the runs
            from trackmark.bench.store.runs import list_runs

            _, message = progress_since(execution, list_runs(execution.folder))
            print_message(f"Stopped: {message} The same command continues from there.")
        raise click.Abort from None  # click prints an empty line for KeyboardInterrupt
    if not keep_errors:
        execution.raise_errors()


def run_title(execution: "Execution") -> str:
    """Return the numbers of trackers, sequences and runs of an execution."""
    from trackmark.bench.execution.plan import RunStatus

    plan, missing = execution.plan, execution.tasks.n_runs
    stored_count = f", {len(plan) - missing} stored" if missing < len(plan) else ""
    stale = plan.count(RunStatus.STALE)
    replaced = f" (replacing stale runs: {stale})" if stale else ""
    counts = (len(plan.trackers), "tracker"), (len(plan.sequences), "sequence"), (missing, "run")
    trackers, sequences, runs = (f"{n} {noun}{'s' * (n != 1)}" for n, noun in counts)
    return f"{execution.experiment.name}: {trackers} on {sequences}, {runs}{replaced}{stored_count}"


def print_remarks(*executions: "Execution") -> None:
    """Print once which images, frames and files of the sequences are not read or not scored."""
    from trackmark.datasets.interface import group_remarks

    remarks = {
        sequence.name: sequence.remarks
        for execution in executions
        for sequence in execution.plan.sequences
    }
    for remark in group_remarks(remarks.items()):
        print_event("warning", remark)


def progress_since(
    execution: "Execution", rows: "Iterable[Mapping[str, Any]]"
) -> "tuple[Plan, str]":
    """Return the plan with the statuses of stored runs, and a sentence with their numbers.

    The rows must have been read after the execution: another command may have stored runs in the
    meantime.
    """
    from trackmark.bench.execution.plan import RunStatus

    plan = execution.plan.with_stored(rows)
    failed = plan.count(RunStatus.FAILED)
    disturbed = plan.count(RunStatus.DISTURBED)
    end = f", {failed} failed" if failed else ""
    end += f", {disturbed} disturbed by other load" if disturbed else ""
    n_finished = plan.count(RunStatus.FINISHED) + disturbed
    return plan, f"{n_finished} of {len(plan)} runs are in {execution.folder}{end}."
