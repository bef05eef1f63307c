"""Run trackers on sequences and keep the results."""

import json
import math
from pathlib import Path

import click

from bench.cli import EXIT_ANSWER_IS_NO, EXIT_INTERRUPTED, EXIT_WRONG_INPUT
from bench.commands._options import (
    chosen_sequences,
    jobs_option,
    json_option,
    output_option,
    progress_bar,
    split_list,
    truth_option,
)
from bench.experiment import Experiment, ExperimentError, read_experiment

__all__ = ["command", "execute"]

DEFAULT_NAME = "adhoc"


@click.command("run")
@click.argument("experiment", required=False)
@click.option(
    "--trackers",
    help="Comma-separated: NAME[:preset=PRESET][:PARAMETER=VALUE]…, or path/to/file.py:Class.",
)
@click.option("--sequences", help="Comma-separated names (with * and ?) or paths.")
@truth_option
@click.option("--seeds", type=click.IntRange(1), help="Repetitions of trackers that draw.")
@click.option("--timing", is_flag=True, help="Time the trackers, one by one, instead.")
@click.option("--name", help=f"Name of the results' folder.  [default: {DEFAULT_NAME}]")
@click.option("--retry-failed", is_flag=True, help="Also repeat runs that failed.")
@output_option
@jobs_option
@json_option
def command(
    experiment: str | None,
    trackers: str | None,
    sequences: str | None,
    truth: Path | None,
    seeds: int | None,
    timing: bool,
    name: str | None,
    retry_failed: bool,
    output: Path,
    jobs: int | None,
    as_json: bool,
) -> int:
    """Run EXPERIMENT (a name or a .toml file), or --trackers on --sequences.

    What is done already is not done again. With --json a line with its scores for every run
    asked for; else tables of them. Exit status 1 where runs failed.
    """
    if experiment is None and not (trackers and sequences):
        raise click.UsageError("Give an experiment, or --trackers and --sequences.")
    base = None if experiment is None else read_experiment(experiment)
    if base is not None and truth is not None:
        raise ExperimentError("--truth goes with --sequences.")
    chosen = Experiment(
        name=name or (base.name if base else DEFAULT_NAME),
        title=base.title if base else "",
        trackers=tuple(split_list(trackers)) if trackers else base.trackers if base else (),
        sequences=chosen_sequences(sequences, truth)
        if sequences
        else base.sequences
        if base
        else (),
        repetitions=seeds or (base.repetitions if base else 1),
        timing=timing or bool(base and base.timing),
    )
    return execute(chosen, output, jobs, retry_failed=retry_failed, as_json=as_json)


def execute(
    experiment: Experiment,
    output: Path,
    jobs: int | None,
    *,
    retry_failed: bool = False,
    as_json: bool = False,
) -> int:
    """Run an experiment, say what came of it, and give the exit status."""
    import numpy as np
    import pyarrow as pa

    from bench.plan import State
    from bench.runner import Execution
    from bench.store.index import for_json, index_rows, index_table, read_table
    from bench.store.results import Results

    execution = Execution(experiment, output, jobs, retry_failed=retry_failed)
    for sequence in execution.plan.sequences:
        if sequence.images_beyond_truth:
            click.echo(
                f"{sequence.name}: {sequence.images_beyond_truth} images beyond the last truth "
                "row are not read.",
                err=True,
            )
    stale = execution.plan.count(State.STALE)
    if stale:
        click.echo(
            f"{stale} stored runs were made with another version of their tracker or sequence "
            "and are done again.",
            err=True,
        )
    plan = execution.plan
    stopped = False
    printed = np.zeros(len(plan), bool)
    try:
        with progress_bar(execution.work, "frame") as progress:
            for row in execution.rows(progress):
                if as_json:
                    click.echo(json.dumps(for_json(row), allow_nan=False))
                    printed[plan.runs(index_table([row]))] = True
    except KeyboardInterrupt:
        stopped = True
    # Counted on disk: a worker may have finished a run that nobody heard of any more.
    index = read_table(Results(execution.folder))
    now = plan.seen_in(index)
    done, failed = now.count(State.DONE), now.count(State.FAILED)
    if stopped:
        click.echo(
            f"Stopped: {done + failed} of {len(plan)} runs are done and kept in "
            f"{execution.folder}. The same command goes on from there.",
            err=True,
        )
        return EXIT_INTERRUPTED
    for error in execution.errors:
        click.echo(f"trackmark: {error}", err=True)
    if as_json:
        # What was done before is an answer too.
        printed |= now.states.ravel() < State.FAILED
        runs = now.runs(index)
        others = (runs >= 0) & ~printed[runs]
        for row in index_rows(index.filter(pa.array(others))):
            click.echo(json.dumps(for_json(row), allow_nan=False))
    else:
        from bench.reporting import summary_text

        click.echo(summary_text(execution.folder, plan.asked().cells))
        click.echo(f"{done + failed} of {len(plan)} runs are in {execution.folder}.")
        if math.isfinite(execution.overhead):
            microseconds = execution.overhead * 1e6
            click.echo(f"The harness itself took {microseconds:.1f} µs a frame and tracker.")
    if execution.errors:
        return EXIT_WRONG_INPUT
    return EXIT_ANSWER_IS_NO if failed else 0
