"""Run trackers on sequences and store the results."""

import json
import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from trackmark.bench.commands import EXIT_NEGATIVE, EXIT_WRONG_INPUT
from trackmark.bench.commands._execution import (
    execute_runs,
    plan_experiment,
    print_remarks,
    progress_since,
)
from trackmark.bench.commands._options import (
    SPECIFICATION,
    Command,
    ExecutionOptions,
    execution_option,
    execution_options,
    input_option,
    layout_option,
    matching_sequences,
    metrics_option,
    name_option,
    protocol_option,
    repetitions_option,
    screen_options,
    sequences_option,
    split_list,
    truth_option,
)
from trackmark.bench.commands._progress import (
    open_runs,
    print_corner_hints,
    print_event,
    print_hint,
    print_message,
    report_slow_work,
    rough_duration,
)
from trackmark.bench.commands._terminal import print_error, print_result
from trackmark.bench.experiments.experiment import (
    Experiment,
    ExperimentError,
    default_name,
    experiment_names,
    read_experiment,
)

if TYPE_CHECKING:
    from trackmark.bench.execution.executor import Execution
    from trackmark.bench.store.database import RunKey
    from trackmark.bench.store.runs import Runs

_MAX_OUTPUT_LINES = 10  # printed lines of a tracker's output


@click.command("run", cls=Command)
@click.argument("experiments", nargs=-1, metavar="[EXPERIMENT]", type=SPECIFICATION)
@input_option(
    "--trackers",
    metavar="TRACKERS",
    type=SPECIFICATION,
    help="Comma-separated trackers: NAME[:preset=PRESET][:PARAMETER=VALUE]…, FILE.py[:CLASS], or "
    "FILE.toml:NAME of a file of trackers.",
)
@sequences_option(
    help="Comma-separated names, paths, folders or patterns with * and ?; !NAME leaves one out.",
)
@truth_option
@layout_option
@repetitions_option
@protocol_option
@input_option(
    "--timing",
    "is_timing",
    is_flag=True,
    help="Measure the time per frame instead of the accuracy; trackers run one at a time.",
)
@input_option(
    "--arrays",
    "keeps_arrays",
    is_flag=True,
    help="Store masks, contours, particles and maps of new runs for the report's player.",
)
@name_option(help="Name of the results folder.  [default: derived from --trackers and --sequences]")
@execution_option("--retry-failed", is_flag=True, help="Repeat runs that failed.")
@execution_option(
    "--dry-run",
    is_flag=True,
    help="Execute nothing; print the missing runs and the time estimated from stored runs.",
)
@metrics_option()
@execution_options
@screen_options
def command(
    experiments: tuple[str, ...],
    trackers: str | None,
    sequences: str | None,
    truth: Path | None,
    repetitions: int | None,
    protocol: str | None,
    is_timing: bool,
    keeps_arrays: bool,
    name: str | None,
    retry_failed: bool,
    dry_run: bool,
    metrics: list[str],
    options: ExecutionOptions,
    as_json: bool,
    verbose: bool,
    quiet: bool,
) -> int:
    """Run trackers on sequences and store the results.

    EXPERIMENT is the name of a built-in experiment or a .toml file. Without it, give --trackers and
    --sequences. Runs that are already stored are not repeated. The command prints which tracker has
    the best mean overlap and a short table, or one JSON object per requested run with --json.

    For example:
      trackmark run windows.toml
      trackmark run --trackers camshift,matcher.py --sequences 'samples/*'

    Exit codes: 0 success; 1 at least one run failed; 2 invalid usage or input; 130 interrupted.
    """
    experiment = _experiment(
        experiments,
        trackers,
        sequences,
        truth,
        name=name,
        repetitions=repetitions,
        protocol=protocol,
        is_timing=is_timing,
        keeps_arrays=keeps_arrays,
    )
    execution = plan_experiment(experiment, options, retry_failed=retry_failed)
    if dry_run:
        _print_plan(execution, as_json=as_json)
        return 0
    return _execute(execution, metrics, as_json=as_json, verbose=verbose, quiet=quiet)


def _experiment(
    experiments: Sequence[str],
    trackers: str | None,
    sequences: str | None,
    truth: Path | None,
    **options: Any,
) -> Experiment:
    """Return the named experiment with the options applied, or one made of the options alone."""
    if not experiments and not (trackers and sequences):
        raise click.UsageError(
            "Give an experiment, or --trackers and --sequences, for example: "
            "trackmark run --trackers camshift,static --sequences 'samples/*'"
        )
    base = _named_experiment(experiments, has_options=bool(trackers or sequences))
    if base is not None and truth is not None:
        raise ExperimentError("--truth requires --sequences; omit the experiment.")
    specs = split_list(trackers or "")
    selected = matching_sequences(sequences, truth, specs) if sequences else ()
    options |= {"trackers": tuple(specs), "sequences": selected}
    changes = {field: value for field, value in options.items() if value}
    if base is None:
        name = default_name(specs, split_list(sequences or ""), truth)
        return Experiment(**{"name": name} | changes)
    if "repetitions" in changes:
        # --repetitions replaces the numbers of single trackers, too.
        base = replace(base, repetitions_by_tracker={})
    return replace(base, **changes)


def _named_experiment(names: Sequence[str], *, has_options: bool) -> Experiment | None:
    """Return the named experiment; None without a name.

    Raises `ExperimentError` for several names, which can result from an unquoted pattern.
    """
    if not names:
        return None
    built_in = experiment_names()
    paths = [name for name in names if name not in built_in and not name.endswith(".toml")]
    if has_options and paths and Path(paths[0]).exists():
        raise ExperimentError(
            f"{paths[0]} is not an experiment. If it results from a pattern, put the pattern in "
            "quotes, so that the shell does not expand it: --sequences 'folder/*'."
        )
    if len(names) > 1:
        raise ExperimentError(f"{len(names)} experiments are named. Give one experiment.")
    return read_experiment(names[0])


def _execute(
    execution: "Execution", metrics: Sequence[str], *, as_json: bool, verbose: bool, quiet: bool
) -> int:
    """Execute a plan, print its scores by the chosen metrics and return the exit status."""
    from trackmark.bench.execution.plan import RunStatus
    from trackmark.bench.store.database import run_key
    from trackmark.bench.store.runs import Runs
    from trackmark.datasets import SequenceError
    from trackmark.trackers import TrackerError

    print_remarks(execution)
    printed: set[RunKey] = set()

    def print_row(row: Mapping[str, Any]) -> None:
        if as_json:
            _print_row(Runs([dict(row)], {}, execution.folder), row, metrics)
            printed.add(run_key(row))

    if stale := execution.plan.count(RunStatus.STALE):
        print_message(
            f"trackmark: replaces {stale} stale run{'s' * (stale != 1)}, because the tracker or "
            "the sequence has changed. To keep them, stop and add --name."
        )
    execute_runs(execution, print_row, keep_errors=True)
    all_runs = open_runs(execution.folder)
    now, message = progress_since(execution, all_runs.stored_rows)
    requested = execution.plan.requested
    runs = all_runs.select(requested)
    try:
        execution.raise_errors()
    except (SequenceError, TrackerError) as error:
        for line in str(error).splitlines():
            print_error(line)
    if as_json:
        for row in all_runs.stored_rows:
            key = run_key(row)
            if key in now.requested and key not in printed and now.status(key) >= RunStatus.FAILED:
                _print_row(all_runs, row, metrics)
        print_message(message)
    else:
        _print_scores(
            runs, execution.experiment.protocol_key, metrics, verbose=verbose, quiet=quiet
        )
    print_corner_hints(runs)
    if not as_json:
        if not quiet:
            click.echo(f"\n{message}")
            _print_hints(execution)
        if verbose:
            _print_details(runs, requested)
    if execution.errors or execution.tracker_errors:
        return EXIT_WRONG_INPUT
    return EXIT_NEGATIVE if now.count(RunStatus.FAILED) else 0


def _print_row(runs: "Runs", row: Mapping[str, Any], metrics: Sequence[str]) -> None:
    """Print a run as JSON, with scores by other metrics if they are requested."""
    from trackmark.bench.store.run_rows import json_row

    json_object = json_row(row)
    if list(metrics) != ["native"] or row["protocol"] not in ("one-pass", "timing"):
        # Imports the table renderers.
        from trackmark.bench.analysis.by_metrics import metrics_for, scores_by_metrics

        names = metrics_for(metrics, row["protocol"])
        if other_metrics := [name for name in names if name != "native"]:
            json_object["metrics"] = scores_by_metrics(runs, row, other_metrics)
    click.echo(json.dumps(json_object, allow_nan=False))


def _print_scores(
    runs: "Runs", protocol: str, metrics: Sequence[str], *, verbose: bool, quiet: bool
) -> None:
    """Print the answer and a short table, and with --verbose all tables."""
    from trackmark.bench.analysis.run_summary import summarise, summarise_times

    lines: list[str] = []
    warnings: list[str] = []
    with report_slow_work("Scoring runs"):
        if protocol == "timing":
            lines = summarise_times(runs)
            lines = lines[:1] if quiet else lines
        elif "native" in metrics and (summary := summarise(runs)):
            lines, warnings = summary.lines(quiet=quiet), summary.warnings
        other_metrics = [name for name in metrics if not lines or verbose or name != "native"]
        if other_metrics and not (quiet and lines):
            from trackmark.bench.analysis.by_metrics import summary_text

            tables = summary_text(runs, other_metrics, only_means=not verbose).splitlines()
            lines += [*([""] if lines and tables else []), *tables]
    print_result(lines)
    for warning in warnings:
        print_event("warning", warning)


def _print_hints(execution: "Execution") -> None:
    """Print how to repeat stochastic trackers, the formats of sequences, and the next command."""
    from trackmark import datasets
    from trackmark.trackers.base.interface import Randomness

    plan = execution.plan
    once = [
        spec.label
        for spec, repetitions in zip(plan.trackers.values(), plan.repetitions.tolist(), strict=True)
        if repetitions == 1 and spec.randomness != Randomness.NONE
    ]
    if once:
        print_hint(
            f"Stochastic trackers that ran once: {', '.join(once)}. Repeat them: --repetitions 10"
        )
    specs = [source.spec for source in execution.experiment.sequences]
    formats = {spec: datasets.path_format(spec) for spec in specs}
    for name in filter(None, dict.fromkeys(formats.values())):
        first, *other_specs = [spec for spec in specs if formats[spec] == name]
        more = f" and {len(other_specs)} more" if other_specs else ""
        print_hint(f"{first}{more}: read as {name}.")
    print_hint(f"Next  {shlex.join(['trackmark', 'report', str(execution.folder)])}")


def _print_details(runs: "Runs", requested: "Iterable[RunKey]") -> None:
    """Print the end of what each tracker printed in the first run in which it printed anything."""
    from trackmark.bench.store.database import run_key

    stored_keys = {run_key(row) for row in runs.stored_rows}
    keys = [key for key in requested if key in stored_keys]
    has_output = dict.fromkeys((tracker for tracker, *_ in keys), False)
    for key in keys:
        if has_output[key[0]]:
            continue
        if lines := runs.run(key).tracker_output.splitlines():
            has_output[key[0]] = True
            click.echo(f"Output of {key[0]} on {key[1]}:")
            click.echo("\n".join(f"  | {line}" for line in lines[-_MAX_OUTPUT_LINES:]))
    if silent := [label for label, has_any in has_output.items() if not has_any]:
        click.echo(f"Trackers that printed nothing: {', '.join(silent)}.")


def _print_plan(execution: "Execution", *, as_json: bool) -> None:
    """Print the numbers of stored and missing runs, and the estimated time of the missing runs."""
    from trackmark.bench.execution.estimate import estimate_time
    from trackmark.bench.execution.plan import RunStatus
    from trackmark.trackers.base.interface import Randomness

    plan, tasks = execution.plan, execution.tasks
    estimate = estimate_time(tasks, execution.results_root)
    kinds = [RunStatus.FINISHED, RunStatus.FAILED, RunStatus.STALE, RunStatus.MISSING]
    if execution.experiment.is_timing:
        kinds.insert(2, RunStatus.DISTURBED)
    statuses = [status.name.lower() for status in kinds]
    by_tracker = {
        spec.label: {status.name.lower(): counts[status] for status in kinds}
        for spec, counts in zip(plan.trackers.values(), plan.counts().tolist(), strict=True)
    }
    if as_json:
        json_object = {
            "experiment": execution.experiment.name,
            "trackers": by_tracker,
            "sequences": len(plan.sequences),
            "runs": len(plan),
            "to_run": tasks.n_runs,
            "tasks": len(tasks),
            "workers": tasks.n_workers,
            "seconds": estimate.seconds,
            "without_times": estimate.without_times,
        }
        click.echo(json.dumps(json_object))
        return
    total = {status: sum(counts[status] for counts in by_tracker.values()) for status in statuses}
    width = max(len(label) for label in [*by_tracker, "in all"])
    click.echo(f"{'tracker':{width}}" + "".join(f"{status:>10}" for status in statuses))
    for label, counts in [*by_tracker.items(), ("in all", total)]:
        click.echo(f"{label:{width}}" + "".join(f"{counts[status]:10}" for status in statuses))
    randomness = {spec.randomness for spec in plan.trackers.values()}
    if execution.experiment.repetitions > 1 and Randomness.NONE in randomness:
        click.echo("\nDeterministic trackers run once on each sequence.")
    nouns = (tasks.n_runs, "missing run"), (len(plan.sequences), "sequence")
    runs, sequences = (f"{n} {noun}{'s' * (n != 1)}" for n, noun in nouns)
    workers = f"{tasks.n_workers} worker{'s' * (tasks.n_workers != 1)}"
    time = f", about {rough_duration(estimate.seconds)} on {workers}" if estimate.seconds else ""
    click.echo(f"\n{runs} on {sequences}{time}.\nRuns go to {execution.folder}.")
    if estimate.without_times:
        labels = ", ".join(estimate.without_times)
        click.echo(
            f"Not estimated, because they have no finished runs: {labels}. "
            "`run` prints the time left while it works; Ctrl-C keeps finished runs."
        )
