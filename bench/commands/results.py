"""Manage stored results: list, log, remove, check, merge, import, export."""

import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from textwrap import indent
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote

import click

from trackmark.bench.commands import EXIT_ANSWER_IS_NO
from trackmark.bench.commands._imported_results import guests_of, import_guests
from trackmark.bench.commands._options import (
    JsonOptions,
    argument,
    only_experiment,
    option,
    protocol_option,
    trace_option,
    with_options,
)
from trackmark.bench.commands._progress import print_message, progress_bar

if TYPE_CHECKING:
    from trackmark.bench.evaluation.run_record import Trace


@dataclass(frozen=True, kw_only=True)
class FolderOptions(JsonOptions):
    """Options of commands that read a results folder."""

    folder: Path = argument(default=Path("results"), required=False)


@click.group("results")
def command() -> None:
    """Manage stored results."""


@command.command("list")
@with_options(FolderOptions)
def list_results(options: FolderOptions) -> None:
    """List the runs in FOLDER, counted by tracker and sequence.

    Unfinished runs are listed after them. With --json, one line per run with its scores.
    """
    from trackmark.bench.store.index import for_json, index_rows, read_table
    from trackmark.bench.store.layout import experiment_folders
    from trackmark.bench.store.results import Results
    from trackmark.bench.store.unfinished import unfinished_runs

    for experiment in experiment_folders(options.folder):
        with progress_bar(None, "file") as progress:
            table = read_table(Results(experiment), progress)
        if options.as_json:
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
@with_options(FolderOptions)
def failures(options: FolderOptions) -> None:
    """Print why runs in FOLDER failed, at which frame, and their last output.

    With --json, one line per failed run.
    """
    import numpy as np

    from trackmark.bench.store.index import read_index
    from trackmark.bench.store.layout import experiment_folders
    from trackmark.bench.store.results import Results

    for experiment in experiment_folders(options.folder):
        results = Results(experiment)
        for row in read_index(results):
            if row["status"] != "failed":
                continue
            run = results.read(experiment / row["path"])
            reached = int(np.isfinite(run.boxes[:, 0]).sum())
            if options.as_json:
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
@with_options(FolderOptions)
def log(options: FolderOptions) -> None:
    """Print the executions in FOLDER: when, where, and at what cost.

    With --json, one line per event.
    """
    from trackmark.bench.store.layout import experiment_folders
    from trackmark.bench.store.log import log_files, read_log

    for experiment in experiment_folders(options.folder):
        for file in log_files(experiment):
            if not options.as_json:
                click.echo(file.stem)
            for event in read_log(file):
                if options.as_json:
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
        ]
    if event["event"] == "error":
        return [f"{moment}  {event['sequence']}: {event['error']}"]
    return [f"{moment}  {event['outcome']} after {event['seconds']:.1f} s"]


@dataclass(frozen=True, kw_only=True)
class RemoveOptions:
    """Options of `remove`."""

    folder: Path = argument(default=Path("results"), required=False)
    tracker: str = option("Only trackers that match this pattern.", default="*")
    sequence: str = option("Only sequences that match this pattern.", default="*")
    failed: bool = option("Only runs that failed.")
    yes: bool = option("Do not ask for confirmation.")


@command.command("remove")
@with_options(RemoveOptions)
def remove(options: RemoveOptions) -> None:
    """Remove runs from FOLDER, and unfinished runs."""
    from trackmark.bench.store.index import read_index
    from trackmark.bench.store.layout import experiment_folders, run_of
    from trackmark.bench.store.results import Results
    from trackmark.bench.store.unfinished import unfinished_runs

    def matches(file: Path) -> bool:
        run_tracker, run_sequence = map(unquote, file.parts[-3:-1])
        label = run_tracker.partition(":protocol=")[0]
        return fnmatchcase(label, options.tracker) and fnmatchcase(run_sequence, options.sequence)

    selected: dict[Path, list[str]] = {}
    for experiment in experiment_folders(options.folder):
        results = Results(experiment)
        # Selected by folder names, so that damaged files can be removed, too.
        files = [*results.files(), *(file for file, _, _ in unfinished_runs(experiment))]
        paths = {str(run_of(file.relative_to(experiment))) for file in files if matches(file)}
        if options.failed:
            paths &= {row["path"] for row in read_index(results) if row["status"] == "failed"}
        selected[experiment] = sorted(paths)
    number = sum(len(paths) for paths in selected.values())
    if not number:
        click.echo("No run matches; nothing was removed.")
        return
    if not options.yes:
        click.confirm(f"Remove {number} runs from {options.folder}?", abort=True)
    for experiment, run_paths in selected.items():
        Results(experiment).remove(run_paths)
    click.echo(f"Removed {number} runs.")


@command.command("check")
@with_options(FolderOptions)
def check_results(options: FolderOptions) -> int:
    """Read every file in FOLDER, and name the files that are damaged or missing.

    With --json, one line per experiment. Exit codes: 0 success; 1 a file is damaged or missing.
    """
    from trackmark.bench.store.layout import experiment_folders
    from trackmark.bench.store.upkeep import checks, damage

    total = 0
    for experiment in experiment_folders(options.folder):
        todo = checks(experiment)
        damages: dict[str, None] = {}
        with progress_bar(len(todo), "file") as progress:
            for number, check in enumerate(todo, 1):
                damages |= dict.fromkeys(filter(None, [damage(check)]))
                progress(number)
        total += len(damages)
        if options.as_json:
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


@dataclass(frozen=True, kw_only=True)
class ImportOptions:
    """Options of `import`."""

    guests: tuple[str, ...] = argument(nargs=-1, metavar="NAME=PATH...")
    sequences: str = option("Comma-separated names or paths, as for `run`.")
    name: str = option("Name of the results folder.", default="published")
    output: Path = option("Folder of the results folder.", default=Path("results"))


@command.command("import")
@with_options(ImportOptions)
def import_results(options: ImportOptions) -> None:
    """Store results of other toolkits, NAME=PATH or NAME=FORMAT:PATH, as runs.

    PATH is a tracker's folder in the format of OTB, GOT-10k, VOT, pysot or pytracking. It must have
    results on all --sequences.
    """
    folder = options.output / options.name
    number = import_guests(guests_of(options.guests), options.sequences, folder)
    click.echo(f"{number} runs are in {folder}.")


@dataclass(frozen=True, kw_only=True)
class ExportOptions:
    """Options of `export`."""

    experiment: Path = argument()
    folder: Path = argument()
    format: str = option("otb, otb-json, got10k, vot, pysot, pytracking.", "--as")
    tracker: str = option("Only trackers that match this pattern.", default="*")
    sequence: str = option("Only sequences that match this pattern.", default="*")
    origin: int | None = option(
        "Number of the first pixel.  [default: that of the format]",
        "--from",
        type=click.IntRange(0, 1),
    )
    force: bool = option("Replace existing files.")
    protocol: str | None = protocol_option()
    trace: "Trace" = trace_option()


@command.command("export")
@with_options(ExportOptions)
def export(options: ExportOptions) -> None:
    """Write the runs of EXPERIMENT to FOLDER for other toolkits, one folder per tracker."""
    from trackmark.bench.exchange.exporting import export_results

    files = export_results(
        only_experiment(options.experiment),
        options.format,
        options.folder,
        print_message,
        tracker=options.tracker,
        sequence=options.sequence,
        origin=options.origin,
        force=options.force,
        trace=options.trace,
        protocol=options.protocol or "one-pass",
    )
    click.echo(f"{len(files)} files are in {options.folder}.")
