"""Execution of the missing runs of an experiment, with progress and messages."""

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

import click

from trackmark.bench.commands._options import EngineOptions
from trackmark.bench.commands._progress import (
    RunProgress,
    patience,
    print_event,
    print_message,
    score_stored_runs,
)
from trackmark.bench.experiments.experiment import Experiment

if TYPE_CHECKING:
    from trackmark.bench.execution.executor import Execution
    from trackmark.bench.execution.plan import KnownSequences, Plan


def plan_experiment(
    experiment: Experiment,
    options: EngineOptions,
    *,
    retry_failed: bool = False,
    opened_sequences: "KnownSequences | None" = None,
) -> "Execution":
    """Plan an experiment in the results folder of the options.

    `opened_sequences`: sequences that are already open; newly opened ones are added.
    """
    from trackmark.bench.execution.executor import Execution

    score_stored_runs(options.output / experiment.name)
    with patience("Opening trackers and sequences") as opened:
        return Execution(
            experiment,
            options.output,
            retry_failed=retry_failed,
            known_sequences={} if opened_sequences is None else opened_sequences,
            on_opened=opened,
            **options.engine_settings,
        )


def execute_runs(
    execution: "Execution",
    on_row: Callable[[Mapping[str, Any]], None] = lambda _: None,
    *,
    progress: RunProgress | None = None,
    temporary: bool = False,
    keep_errors: bool = False,
) -> None:
    """Execute the missing runs of a plan; Ctrl-C prints how many runs are stored and where.

    `on_row`: called with the row of each run. `progress`: progress of several executions,
    which expects the runs of this execution. `temporary`: the caller removes the results folder, so
    Ctrl-C prints nothing. Raises `SequenceError` if a sequence cannot be read. With `keep_errors`,
    the message is only added to `execution.errors`.
    """
    try:
        with ExitStack() as stack:
            if progress is None:
                run_progress = RunProgress(run_title(execution), execution.folder)
                progress = stack.enter_context(run_progress)
                progress.expect(execution)
            progress.begin()
            execution.on_error = progress.warn
            units = execution.units
            for row in execution.rows(progress.update):
                if execution.units is not units:  # a tracker has turned out to be stochastic
                    units = execution.units
                    progress.expect(execution)
                progress.add(row)
                on_row(row)
    except KeyboardInterrupt:
        if not temporary:
            _, _, state = stored_runs(execution)
            print_message(f"Stopped: {state} The same command continues from there.")
        raise click.Abort from None  # click prints an empty line for KeyboardInterrupt
    if not keep_errors:
        execution.raise_errors()


def run_title(execution: "Execution") -> str:
    """Return the numbers of trackers, sequences and runs of an execution."""
    from trackmark.bench.execution.plan import State

    plan, missing = execution.plan, execution.units.runs
    stored = f", {len(plan) - missing} stored" if missing < len(plan) else ""
    stale = plan.count(State.STALE)
    replaced = f" (replacing stale runs: {stale})" if stale else ""
    numbers = (len(plan.trackers), "tracker"), (len(plan.sequences), "sequence"), (missing, "run")
    trackers, sequences, runs = (f"{n} {noun}{'s' * (n != 1)}" for n, noun in numbers)
    return f"{execution.experiment.name}: {trackers} on {sequences}, {runs}{replaced}{stored}"


def run_experiment(
    experiment: Experiment,
    options: EngineOptions,
    opened_sequences: "KnownSequences | None" = None,
    progress: RunProgress | None = None,
) -> "Execution":
    """Plan an experiment and execute its missing runs; see `execute_runs`."""
    execution = plan_experiment(experiment, options, opened_sequences=opened_sequences)
    if progress is None:
        print_remarks(execution)
    else:  # a series of executions, most of them on the same sequences
        progress.expect(execution)
    execute_runs(execution, progress=progress)
    return execution


def print_remarks(*executions: "Execution") -> None:
    """Print once which images, frames and files of the sequences are not read or not scored."""
    from trackmark.datasets.interface import group_remarks

    sequences = {
        sequence.name: sequence for execution in executions for sequence in execution.plan.sequences
    }
    for text in group_remarks(sequences.values()):
        print_event("warning", text)


def stored_runs(execution: "Execution") -> "tuple[list[dict[str, Any]], Plan, str]":
    """Return the stored runs, the plan in its current state, and a sentence with the counts."""
    from trackmark.bench.execution.plan import State
    from trackmark.bench.store.results import Results
    from trackmark.bench.store.run_rows import list_scored_runs

    # Read from disk: another command may have stored runs meanwhile.
    rows = list_scored_runs(Results(execution.folder))
    plan = execution.plan.seen_in(rows)
    failed = plan.count(State.FAILED)
    disturbed = plan.count(State.DISTURBED)
    end = f", {failed} failed" if failed else ""
    end += f", {disturbed} disturbed by other load" if disturbed else ""
    n_finished = plan.count(State.DONE) + disturbed
    return rows, plan, f"{n_finished} of {len(plan)} runs are in {execution.folder}{end}."
