"""Manage stored results: list, log, remove, check, merge, import, export."""

import json
from collections import Counter
from collections.abc import Mapping
from fnmatch import fnmatchcase
from pathlib import Path
from textwrap import indent
from typing import Any
from urllib.parse import unquote

import click

from trackmark.bench.commands import EXIT_ANSWER_IS_NO
from trackmark.bench.commands._imported_results import guests_of, import_guests
from trackmark.bench.commands._options import (
    json_option,
    only_experiment,
    output_option,
    protocol_option,
    trace_option,
)
from trackmark.bench.commands._progress import print_message, progress_bar

folder_argument = click.argument(
    "folder", type=click.Path(path_type=Path), default=Path("results"), required=False
)


@click.group("results")
def command() -> None:
    """Manage stored results."""


@command.command("list")
@folder_argument
@json_option
def list_results(folder: Path, as_json: bool) -> None:
    """List the runs in FOLDER, counted by tracker and sequence.

    Unfinished runs are listed after them. With --json, one line per run with its scores.
    """
    from trackmark.bench.store.index import for_json, index_rows, read_table
    from trackmark.bench.store.layout import experiment_folders
    from trackmark.bench.store.results import Results
    from trackmark.bench.store.unfinished import unfinished_runs

    for experiment in experiment_folders(folder):
        with progress_bar(None, "file") as progress:
            table = read_table(Results(experiment), progress)
        if as_json:
            for row in index_rows(table):
                click.echo(json.dumps({"experiment": experiment.name, **for_json(row)}))
            continue
        click.echo(f"{experiment}: {len(table)} runs")
        keys = ["tracker", "sequence", "protocol", "status"]
        grouped = table.group_by(keys).aggregate([([], "count_all")]).to_pylist()
        counts: dict[tuple[str, ...], Counter[str]] = {}
        for group in grouped:
            *key, status = (group[name] for name in keys)
            counts.setdefault(tuple(key), Counter())[status] += group["count_all"]
        for (tracker, sequence, protocol), number in sorted(counts.items()):
            suffix = "" if protocol == "accuracy" else f" ({protocol})"
            failed = f", {number['failed']} failed" if number["failed"] else ""
            click.echo(f"  {tracker} on {sequence}{suffix}: {number.total()}{failed}")
        for file, reached, frames in unfinished_runs(experiment):
            click.echo(
                f"  unfinished, {reached} of {frames} frames: {file.relative_to(experiment)}"
            )


@command.command("failures")
@folder_argument
@json_option
def failures(folder: Path, as_json: bool) -> None:
    """Print why runs in FOLDER failed, at which frame, and their last output.

    With --json, one line per failed run.
    """
    import numpy as np

    from trackmark.bench.store.index import read_index
    from trackmark.bench.store.layout import experiment_folders
    from trackmark.bench.store.results import Results

    for experiment in experiment_folders(folder):
        results = Results(experiment)
        for row in read_index(results):
            if row["status"] != "failed":
                continue
            run = results.read(experiment / row["path"])
            reached = int(np.isfinite(run.boxes[:, 0]).sum())
            if as_json:
                data = {key: row[key] for key in ("tracker", "sequence", "repetition", "failure")}
                data |= {"frames": len(run.boxes), "reached": reached, "output": run.output}
                click.echo(json.dumps({"experiment": experiment.name, **data}))
                continue
            click.echo(
                f"{row['tracker']} on {row['sequence']}, repetition {row['repetition']}: boxes of "
                f"{reached} of {len(run.boxes)} frames ({experiment / row['path']})"
            )
            click.echo(indent(run.failure.strip(), "  "))
            if run.output:
                click.echo("  Last output:")
                click.echo(indent(run.output.rstrip(), "  | "))


@command.command("log")
@folder_argument
@json_option
def log(folder: Path, as_json: bool) -> None:
    """Print the executions in FOLDER: when, where, and at what cost.

    With --json, one line per event.
    """
    from trackmark.bench.store.layout import experiment_folders
    from trackmark.bench.store.log import log_files, read_log

    for experiment in experiment_folders(folder):
        for file in log_files(experiment):
            if not as_json:
                click.echo(file.stem)
            for event in read_log(file):
                if as_json:
                    click.echo(json.dumps({"log": file.stem, **event}))
                else:
                    for line in _event_lines(event):
                        click.echo(line)


def _event_lines(event: Mapping[str, Any]) -> list[str]:
    """Return the lines of text on an event."""
    moment = f"  {event['date'][:19].replace('T', ' ')}"
    if event["event"] == "start":
        states = ", ".join(
            f"{event[state]} {state}" for state in ("done", "failed", "stale", "left")
        )
        return [
            f"{moment}  start of {event['experiment']}: {event['runs']} runs ({states}), "
            f"{event['units']} units on {event['workers']} workers ({event['engine']})"
        ]
    if event["event"] == "unit":
        runs = sum(len(repetitions) for repetitions in event["runs"].values())
        return [
            f"{moment}  {event['sequence']}: {runs} runs of {len(event['runs'])} trackers on "
            f"{event['host']} ({event['process']}): {event['seconds']:.1f} s, CPU "
            f"{event['cpu_seconds']:.1f} s, at most {event['peak_memory'] / 1e6:.0f} MB",
            *(
                f"{moment}    failed: {run['tracker']}, repetition {run['repetition']}: "
                + str(run["failure"]).partition("\n")[0]
                for run in event["failed"]
            ),
            *(f"{moment}    {error}" for error in event["errors"]),
        ]
    if event["event"] == "error":
        return [f"{moment}  {event['sequence']}: {event['error']}"]
    return [f"{moment}  {event['outcome']} after {event['seconds']:.1f} s"]


@command.command("remove")
@folder_argument
@click.option("--tracker", default="*", help="Only trackers that match this pattern.")
@click.option("--sequence", default="*", help="Only sequences that match this pattern.")
@click.option("--failed", is_flag=True, help="Only runs that failed.")
@click.option("--yes", is_flag=True, help="Do not ask for confirmation.")
def remove(folder: Path, tracker: str, sequence: str, failed: bool, yes: bool) -> None:
    """Remove runs from FOLDER, and unfinished runs."""
    from trackmark.bench.store.index import read_index
    from trackmark.bench.store.layout import experiment_folders, run_of
    from trackmark.bench.store.results import Results
    from trackmark.bench.store.unfinished import unfinished_runs

    def matches(file: Path) -> bool:
        run_tracker, run_sequence = map(unquote, file.parts[-3:-1])
        label = run_tracker.partition(":protocol=")[0]
        return fnmatchcase(label, tracker) and fnmatchcase(run_sequence, sequence)

    selected: dict[Path, list[str]] = {}
    for experiment in experiment_folders(folder):
        results = Results(experiment)
        # Selected by folder names, so that damaged files can be removed, too.
        files = [*results.files(), *(file for file, _, _ in unfinished_runs(experiment))]
        paths = {str(run_of(file.relative_to(experiment))) for file in files if matches(file)}
        if failed:
            paths &= {row["path"] for row in read_index(results) if row["status"] == "failed"}
        selected[experiment] = sorted(paths)
    number = sum(len(paths) for paths in selected.values())
    if not number:
        click.echo("No run matches; nothing was removed.")
        return
    if not yes:
        click.confirm(f"Remove {number} runs from {folder}?", abort=True)
    for experiment, run_paths in selected.items():
        Results(experiment).remove(run_paths)
    click.echo(f"Removed {number} runs.")


@command.command("check")
@folder_argument
@json_option
def check_results(folder: Path, as_json: bool) -> int:
    """Read every file in FOLDER, and name the files that are damaged or missing.

    With --json, one line per experiment. Exit codes: 0 success; 1 a file is damaged or missing.
    """
    from trackmark.bench.store.layout import experiment_folders
    from trackmark.bench.store.upkeep import checks, damage

    total = 0
    for experiment in experiment_folders(folder):
        todo = checks(experiment)
        damages: dict[str, None] = {}
        with progress_bar(len(todo), "file") as progress:
            for number, check in enumerate(todo, 1):
                damages |= dict.fromkeys(filter(None, [damage(check)]))
                progress(number)
        total += len(damages)
        if as_json:
            data = {"experiment": experiment.name, "files": len(todo), "damages": list(damages)}
            click.echo(json.dumps(data))
            continue
        for message in damages:
            print_message(message)
        click.echo(f"{experiment}: {len(todo)} files, {len(damages) or 'none'} damaged or missing")
    return EXIT_ANSWER_IS_NO if total else 0


@command.command("merge")
@click.argument("sources", nargs=-1, required=True, type=click.Path(path_type=Path, exists=True))
@click.argument("target", type=click.Path(path_type=Path))
def merge(sources: tuple[Path, ...], target: Path) -> int:
    """Copy the runs of the experiments SOURCES into the experiment TARGET.

    Runs that are there already stay. A run that is there by another version of its tracker or
    sequence is a conflict: the conflicts are listed and nothing is copied (exit status 1).
    """
    from trackmark.bench.store.upkeep import merge_results

    copied, conflicts = merge_results(list(sources), target)
    for conflict in conflicts:
        print_message(f"conflict: {conflict}")
    if conflicts:
        print_message(f"{len(conflicts)} conflicts; nothing was copied.")
        return EXIT_ANSWER_IS_NO
    click.echo(f"Copied {copied} runs to {target}.")
    return 0


@command.command("import")
@click.argument("guests", nargs=-1, required=True, metavar="NAME=PATH...")
@click.option("--sequences", required=True, help="Comma-separated names or paths, as for `run`.")
@click.option("--name", default="published", show_default=True, help="Name of the results folder.")
@output_option
def import_results(guests: tuple[str, ...], sequences: str, name: str, output: Path) -> None:
    """Store results of other toolkits, NAME=PATH or NAME=FORMAT:PATH, as runs.

    PATH is a tracker's folder in the format of OTB, GOT-10k, VOT, pysot or pytracking. It must have
    results on all --sequences.
    """
    number = import_guests(guests_of(guests), sequences, output / name)
    click.echo(f"{number} runs are in {output / name}.")


@command.command("export")
@click.argument("experiment", type=click.Path(path_type=Path))
@click.argument("folder", type=click.Path(path_type=Path))
@click.option(
    "--as", "layout", required=True, help="otb, otb-json, got10k, vot, pysot, pytracking."
)
@click.option("--tracker", default="*", help="Only trackers that match this pattern.")
@click.option("--sequence", default="*", help="Only sequences that match this pattern.")
@click.option(
    "--from",
    "origin",
    type=click.IntRange(0, 1),
    help="Number of the first pixel.  [default: that of the format]",
)
@click.option("--force", is_flag=True, help="Replace existing files.")
@protocol_option
@trace_option
def export(
    experiment: Path,
    folder: Path,
    layout: str,
    tracker: str,
    sequence: str,
    origin: int | None,
    force: bool,
    protocol: str | None,
    trace: Any,
) -> None:
    """Write the runs of EXPERIMENT to FOLDER for other toolkits, one folder per tracker."""
    from trackmark.bench.exchange.exporting import export_results

    written = export_results(
        only_experiment(experiment),
        layout,
        folder,
        print_message,
        tracker=tracker,
        sequence=sequence,
        origin=origin,
        force=force,
        trace=trace,
        protocol=protocol or "one-pass",
    )
    click.echo(f"{len(written)} files are in {folder}.")
