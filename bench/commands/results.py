"""Look after stored results: list, log, remove, check, merge, import, export."""

import json
from collections import Counter, defaultdict
from collections.abc import Mapping
from fnmatch import fnmatchcase
from pathlib import Path
from textwrap import indent
from typing import Any

import click

from trackmark.bench.commands import EXIT_ANSWER_IS_NO
from trackmark.bench.commands._imported_results import guests_of, imported
from trackmark.bench.commands._options import (
    DEFAULT_OUTPUT,
    json_option,
    output_option,
    progress_bar,
    protocol_option,
    say,
    trace_option,
)

folder_argument = click.argument(
    "folder", type=click.Path(path_type=Path), default=DEFAULT_OUTPUT, required=False
)


@click.group("results")
def command() -> None:
    """Look after stored results."""


@command.command("list")
@folder_argument
@json_option
def list_results(folder: Path, as_json: bool) -> None:
    """List the runs in FOLDER, counted by tracker and sequence.

    With --json a line a run, with its scores.
    """
    from trackmark.bench.store.index import for_json, read_index
    from trackmark.bench.store.layout import experiment_folders
    from trackmark.bench.store.results import Results

    for experiment in experiment_folders(folder):
        with progress_bar(None, "run") as progress:
            rows = read_index(Results(experiment), progress)
        if as_json:
            for row in rows:
                click.echo(json.dumps({"experiment": experiment.name, **for_json(row)}))
            continue
        click.echo(f"{experiment}: {len(rows)} runs")
        counts: defaultdict[tuple[str, ...], Counter[str]] = defaultdict(Counter)
        for row in rows:
            counts[row["tracker"], row["sequence"], row["protocol"]][row["status"]] += 1
        for (tracker, sequence, protocol), number in sorted(counts.items()):
            how = "" if protocol == "accuracy" else f" ({protocol})"
            failed = f", {number['failed']} failed" if number["failed"] else ""
            click.echo(f"  {tracker} on {sequence}{how}: {number.total()}{failed}")


@command.command("failures")
@folder_argument
@json_option
def failures(folder: Path, as_json: bool) -> None:
    """Print why runs in FOLDER failed, where they got to, and what they printed last.

    With --json a line a failed run.
    """
    import numpy as np

    from trackmark.bench.store.index import list_runs
    from trackmark.bench.store.layout import cell_of, experiment_folders
    from trackmark.bench.store.results import Results

    for experiment in experiment_folders(folder):
        results = Results(experiment)
        for row in list_runs(results):
            if row["status"] != "failed":
                continue
            run = results.read(cell_of(row))
            reached = int(np.isfinite(run.boxes[:, 0]).sum())
            if as_json:
                told = {key: row[key] for key in ("tracker", "sequence", "repetition", "failure")}
                more = {"frames": len(run.boxes), "reached": reached, "output": run.output}
                click.echo(json.dumps({"experiment": experiment.name, **told, **more}))
                continue
            click.echo(
                f"{row['tracker']} on {row['sequence']}, repetition {row['repetition']}: boxes of "
                f"{reached} of {len(run.boxes)} frames ({experiment})"
            )
            click.echo(indent(run.failure.strip(), "  "))
            if run.output:
                click.echo("  It printed last:")
                click.echo(indent(run.output.rstrip(), "  | "))


@command.command("log")
@folder_argument
@json_option
def log(folder: Path, as_json: bool) -> None:
    """Print what was done in FOLDER, when, where, and what it cost.

    With --json a line an event.
    """
    from trackmark.bench.store.layout import experiment_folders
    from trackmark.bench.store.log import read_logs

    for experiment in experiment_folders(folder):
        for name, events in read_logs(experiment).items():
            if not as_json:
                click.echo(name)
            for event in events:
                if as_json:
                    click.echo(json.dumps({"log": name, **event}))
                else:
                    for line in _event_lines(event):
                        click.echo(line)


def _event_lines(event: Mapping[str, Any]) -> list[str]:
    """An event for people."""
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
@click.option("--tracker", default="*", help="Only trackers that match; * and ? are wild.")
@click.option("--sequence", default="*", help="Only sequences that match; * and ? are wild.")
@click.option("--failed", is_flag=True, help="Only runs that failed.")
@click.option("--yes", is_flag=True, help="Do not ask.")
def remove(folder: Path, tracker: str, sequence: str, failed: bool, yes: bool) -> None:
    """Remove runs from FOLDER."""
    from trackmark.bench.store.index import list_runs
    from trackmark.bench.store.layout import Cell, cell_of, experiment_folders
    from trackmark.bench.store.results import Results

    chosen: dict[Path, list[Cell]] = {}
    for experiment in experiment_folders(folder):
        results = Results(experiment)
        # By keys alone: damaged runs can be removed, too.
        cells = [
            cell
            for cell in results.cells()
            if fnmatchcase(cell[0], tracker) and fnmatchcase(cell[1], sequence)
        ]
        if failed:
            ended = {cell_of(row) for row in list_runs(results) if row["status"] == "failed"}
            cells = [cell for cell in cells if cell in ended]
        chosen[experiment] = cells
    number = sum(len(cells) for cells in chosen.values())
    if not number:
        click.echo("No run matches; nothing was removed.")
        return
    if not yes:
        click.confirm(f"Remove {number} runs from {folder}?", abort=True)
    for experiment, gone in chosen.items():
        Results(experiment).remove(gone)
    click.echo(f"Removed {number} runs.")


@command.command("check")
@folder_argument
@json_option
def check_results(folder: Path, as_json: bool) -> int:
    """Read all results in FOLDER, and report what is not what was written.

    Exit status 1 if there is damage. With --json a line an experiment.
    """
    from trackmark.bench.store.layout import experiment_folders
    from trackmark.bench.store.results import Results
    from trackmark.bench.store.upkeep import damages

    found = 0
    for experiment in experiment_folders(folder):
        said = damages(experiment)
        found += len(said)
        runs = 0 if said else len(Results(experiment).cells())
        if as_json:
            answer = {"experiment": experiment.name, "runs": runs, "damages": said}
            click.echo(json.dumps(answer))
            continue
        for sentence in said:
            click.echo(sentence, err=True)
        click.echo(f"{experiment}: damaged" if said else f"{experiment}: {runs} runs, undamaged")
    return EXIT_ANSWER_IS_NO if found else 0


@command.command("convert")
@click.argument("folders", nargs=-1, required=True, type=click.Path(path_type=Path, exists=True))
def convert(folders: tuple[Path, ...]) -> None:
    """Convert results of an older trackmark, which are Parquet files, to runs.db.

    FOLDERS are folders of experiments. The old files stay. Needs the extra `parquet`.
    """
    from trackmark.bench.store.parquet_layout import convert_results

    for folder in folders:
        with progress_bar(None, "run") as progress:
            number = convert_results(folder, progress)
        click.echo(
            f"{folder}: converted {number} runs. The old files are no longer needed: plan.json, "
            "index.arrow, _truth, _log, and the folders of trackers."
        )


@command.command("merge")
@click.argument("sources", nargs=-1, required=True, type=click.Path(path_type=Path, exists=True))
@click.argument("target", type=click.Path(path_type=Path))
def merge(sources: tuple[Path, ...], target: Path) -> int:
    """Copy the runs of the experiments SOURCES into the experiment TARGET.

    A run that is there already, with the same identity, is left alone. One that is there
    with another identity (another version of its tracker, say) is a conflict: nothing is
    copied then, and the conflicts are listed.
    """
    from trackmark.bench.store.upkeep import merge_results

    copied, conflicts = merge_results(list(sources), target)
    for conflict in conflicts:
        click.echo(f"conflict: {conflict}", err=True)
    if conflicts:
        click.echo(f"{len(conflicts)} conflicts; nothing was copied.", err=True)
        return 1
    click.echo(f"Copied {copied} runs to {target}.")
    return 0


@command.command("import")
@click.argument("guests", nargs=-1, required=True, metavar="NAME=PATH...")
@click.option("--sequences", required=True, help="Comma-separated names or paths, as for `run`.")
@click.option("--name", default="published", show_default=True, help="Of the results' folder.")
@output_option
def import_others(guests: tuple[str, ...], sequences: str, name: str, output: Path) -> None:
    """Keep others' results of trackers, NAME=PATH or NAME=LAYOUT:PATH, as runs.

    PATH is a tracker's folder, in the layout of OTB, GOT-10k, VOT, pysot or pytracking. Any preset
    scores them on --sequences, on all of which there must be results.
    """
    number = imported(guests_of(guests), sequences, output / name)
    click.echo(f"{number} runs are in {output / name}.")


@command.command("export")
@click.argument("experiment", type=click.Path(path_type=Path))
@click.argument("folder", type=click.Path(path_type=Path))
@click.option(
    "--as", "layout", required=True, help="otb, otb-json, got10k, vot, pysot, pytracking."
)
@click.option("--tracker", default="*", help="Only trackers that match; * and ? are wild.")
@click.option("--sequence", default="*", help="Only sequences that match; * and ? are wild.")
@click.option(
    "--from",
    "origin",
    type=click.IntRange(0, 1),
    help="Number of the first pixel.  [default: the layout's]",
)
@click.option("--force", is_flag=True, help="Replace files that are there.")
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
    """Write the runs of EXPERIMENT into FOLDER, for others' tools: a folder a tracker."""
    from trackmark.bench.exchange.exporting import export_results
    from trackmark.bench.store.layout import experiment_folders

    found = experiment_folders(experiment)
    if len(found) > 1:
        names = ", ".join(path.name for path in found)
        raise click.UsageError(f"{experiment} holds several experiments ({names}): name one.")
    written = export_results(
        found[0],
        layout,
        folder,
        say,
        tracker=tracker,
        sequence=sequence,
        origin=origin,
        force=force,
        trace=trace,
        protocol=protocol or "one-pass",
    )
    click.echo(f"{len(written)} files are in {folder}.")
