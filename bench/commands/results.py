"""List, check, remove, merge, import and export stored results."""

import json
from collections import Counter, defaultdict
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from trackmark.bench.commands import EXIT_NEGATIVE, EXIT_WRONG_INPUT
from trackmark.bench.commands._imported_results import parse_imported
from trackmark.bench.commands._options import (
    PATH,
    SPECIFICATION,
    Command,
    execution_option,
    json_option,
    matching_sequences,
    name_option,
    output_option,
    protocol_option,
    selection_option,
    sequences_option,
    trajectory_option,
)
from trackmark.bench.commands._progress import (
    open_runs,
    print_hint,
    print_message,
    report_slow_work,
)
from trackmark.bench.commands._terminal import confirm

if TYPE_CHECKING:
    from trackmark.bench.evaluation.run_record import Trajectory

folder_argument = click.argument("folder", required=False, type=PATH, default="results")
tracker_option = selection_option(
    "--tracker", default="*", help="Only trackers that match this pattern."
)
sequence_option = selection_option(
    "--sequence", default="*", help="Only sequences that match this pattern."
)


@click.group("results")
def command() -> None:
    """List, check, remove, merge, import and export stored results."""


command.command_class = Command


@command.command("list")
@folder_argument
@json_option
def list_results(folder: Path, as_json: bool) -> None:
    """List stored runs by tracker and sequence.

    FOLDER is a results folder, or a folder that contains several. With --json, the command prints
    one line per run with its scores.

    For example:
      trackmark results list results/windows --json

    Exit codes: 0 success; 2 invalid usage or input.
    """
    from trackmark.bench.store.database import experiment_folders
    from trackmark.bench.store.run_rows import json_row

    for experiment in experiment_folders(folder):
        rows = [row for row in open_runs(experiment).rows if row["status"] != "missing"]
        if as_json:
            for row in rows:
                click.echo(json.dumps({"experiment": experiment.name, **json_row(row)}))
            continue
        click.echo(f"{experiment}: {len(rows)} runs")
        counts: defaultdict[tuple[str, ...], Counter[str]] = defaultdict(Counter)
        for row in rows:
            counts[row["tracker"], row["sequence"], row["protocol"]][row["status"]] += 1
        for (tracker, sequence, protocol), by_status in sorted(counts.items()):
            suffix = "" if protocol == "one-pass" else f" ({protocol})"
            failed_and_stale = [
                f", {by_status[word]} {word}" for word in ("failed", "stale") if by_status[word]
            ]
            click.echo(
                f"  {tracker} on {sequence}{suffix}: {by_status.total()}{''.join(failed_and_stale)}"
            )


@command.command("failures")
@folder_argument
@output_option(
    "--verbose", is_flag=True, help="Also print tracebacks and the last output of the trackers."
)
@json_option
def failures(folder: Path, verbose: bool, as_json: bool) -> None:
    """Print reason and frame of failed runs.

    FOLDER is a results folder, or a folder that contains several. With --json, the command prints
    one line per failed run with the whole text of the failure and the tracker's last output.

    For example:
      trackmark results failures results/windows

    Exit codes: 0 success; 2 invalid usage or input.
    """
    import numpy as np

    from trackmark.bench.analysis.run_summary import tracker_line
    from trackmark.bench.store.database import experiment_folders, run_key
    from trackmark.bench.store.run_store import RunStore
    from trackmark.bench.store.runs import list_runs

    failed = [
        (experiment, row)
        for experiment in experiment_folders(folder)
        for row in list_runs(experiment)
        if row["status"] == "failed"
    ]
    for experiment, row in failed:
        run = RunStore(experiment).read(run_key(row))
        reached = int(np.isfinite(run.boxes[:, 0]).sum())
        if as_json:
            json_object = {
                key: row[key] for key in ("tracker", "sequence", "repetition", "failure")
            }
            json_object |= {
                "frames": len(run.boxes),
                "reached": reached,
                "output": run.tracker_output,
            }
            click.echo(json.dumps({"experiment": experiment.name, **json_object}))
        else:
            click.echo(
                f"{row['tracker']} on {row['sequence']}, repetition {row['repetition']}: boxes of "
                f"{reached} of {len(run.boxes)} frames ({experiment})"
            )
            reason, _, stack_trace = run.failure.partition("\n")
            lines = [reason, tracker_line(run.failure)]
            if verbose:
                lines = [reason, *stack_trace.splitlines(), *run.tracker_output.splitlines()]
            click.echo("\n".join(f"  {line}" for line in lines if line))
    if failed and not (as_json or verbose):
        print_hint("Tracebacks and last outputs of the trackers: add --verbose")


@command.command("remove")
@folder_argument
@tracker_option
@sequence_option
@selection_option(
    "--protocol",
    metavar="NAME[:PARAMETER=VALUE]…",
    help="Only runs of this protocol: timing, one-pass, ….",
)
@selection_option("--failed", "only_failed", is_flag=True, help="Only runs that failed.")
@execution_option("--yes", "confirmed", is_flag=True, help="Do not ask for confirmation.")
def remove(
    folder: Path,
    tracker: str,
    sequence: str,
    protocol: str | None,
    only_failed: bool,
    confirmed: bool,
) -> None:
    """Remove stored runs.

    FOLDER is a results folder, or a folder that contains several. The command asks before it
    removes runs.

    For example:
      trackmark results remove results/windows --tracker 'camshift*' --failed

    Exit codes: 0 success; 2 invalid usage or input; 130 not confirmed, or interrupted.
    """
    from trackmark.bench.protocols import TIMING, parse_protocol
    from trackmark.bench.store.database import RunKey, experiment_folders, run_key
    from trackmark.bench.store.run_store import RunStore
    from trackmark.bench.store.runs import list_runs

    selected: dict[Path, list[RunKey]] = {}
    protocol_key = protocol
    if protocol not in (None, TIMING):
        protocol_key = parse_protocol(str(protocol)).key
    for experiment in experiment_folders(folder):
        store = RunStore(experiment)
        # Keys suffice: damaged runs can be removed, too.
        keys = [
            key
            for key in store.list_keys()
            if fnmatchcase(key[0], tracker)
            and fnmatchcase(key[1], sequence)
            and protocol_key in (None, key[3])
        ]
        if only_failed:
            failed = {run_key(row) for row in list_runs(experiment) if row["status"] == "failed"}
            keys = [key for key in keys if key in failed]
        selected[experiment] = keys
    n_runs = sum(len(keys) for keys in selected.values())
    if not n_runs:
        click.echo("No run matches; nothing was removed.")
        return
    if not confirmed:
        confirm(f"Remove {n_runs} run{'s' * (n_runs != 1)} from {folder}?")
    for experiment, keys in selected.items():
        RunStore(experiment).remove(keys)
    click.echo(f"Removed {n_runs} run{'s' * (n_runs != 1)}.")


@command.command("check")
@folder_argument
@json_option
def check_results(folder: Path, as_json: bool) -> int:
    """Read all stored results and report damage.

    FOLDER is a results folder, or a folder that contains several. With --json, the command prints
    one line per experiment. `results merge` copies the undamaged runs to another folder.

    For example:
      trackmark results check results

    Exit codes: 0 no damage; 1 results are damaged; 2 invalid usage or input.
    """
    from trackmark.bench.store.database import ResultsError, experiment_folders

    status = 0
    for experiment in experiment_folders(folder, damaged=True):
        try:
            state, json_object = _check_experiment(experiment)
            status = max(status, EXIT_NEGATIVE if json_object["damages"] else 0)
        except ResultsError as error:  # no damage, for example a newer schema
            state, json_object = "not checked", {"runs": 0, "damages": [], "error": str(error)}
            status = EXIT_WRONG_INPUT
            print_message(str(error))
        if as_json:
            click.echo(json.dumps({"experiment": experiment.name, **json_object}))
            continue
        for message in json_object["damages"]:
            print_message(message)
        click.echo(f"{experiment}: {state}")
    return status


def _check_experiment(experiment: Path) -> tuple[str, dict[str, Any]]:
    """Return the state of an experiment's file in words, and its data for --json."""
    from trackmark.bench.store.maintenance import find_damage
    from trackmark.bench.store.run_store import RunStore

    messages = find_damage(experiment)
    runs = 0 if messages else len(RunStore(experiment).list_keys())
    state = "damaged" if messages else f"{runs} runs, undamaged"
    return state, {"runs": runs, "damages": messages}


@command.command("merge")
@click.argument("sources", nargs=-1, required=True, type=click.Path(path_type=Path, exists=True))
@click.argument("target", type=click.Path(path_type=Path))
def merge(sources: tuple[Path, ...], target: Path) -> int:
    """Copy runs of several results folders into one.

    SOURCES and TARGET are results folders. Runs that TARGET already contains are kept. If
    TARGET contains runs of another version of a tracker or sequence, the command lists this
    conflict and copies nothing.

    For example:
      trackmark results merge results/laptop results/server results/both

    Exit codes: 0 success; 1 conflicts, nothing is copied; 2 invalid usage or input.
    """
    from trackmark.bench.store.maintenance import merge_results

    copied, conflicts = merge_results(list(sources), target)
    for conflict in conflicts:
        print_message(f"conflict: {conflict}")
    if conflicts:
        print_message(f"{len(conflicts)} conflicts; nothing was copied.")
        return EXIT_NEGATIVE
    click.echo(f"Copied {copied} runs to {target}.")
    return 0


@command.command("import")
@click.argument("results", nargs=-1, required=True, metavar="NAME=PATH...", type=SPECIFICATION)
@sequences_option(
    required=True,
    help="Comma-separated names, paths or patterns, as for `run`.",
)
@name_option(default="published")
@output_option(
    "--results-root",
    type=PATH,
    default="results",
    help="Folder that contains the results folder.",
)
def import_command(results: tuple[str, ...], sequences: str, name: str, results_root: Path) -> None:
    """Store results of other toolkits as runs.

    PATH is the folder of a tracker in the format of OTB, GOT-10k, VOT, pysot or pytracking, given
    as NAME=PATH or NAME=FORMAT:PATH. It must have results on all --sequences.

    For example:
      trackmark results import STRUCK=boxes/STRUCK --sequences 'OTB100/*'

    Exit codes: 0 success; 2 invalid usage or input.
    """
    from trackmark.bench.exchange.importing import import_results, open_sequences

    folder = results_root / name
    imported = parse_imported(results)
    opened = open_sequences(matching_sequences(sequences), print_message)
    with report_slow_work("Importing results"):
        n_runs = import_results(imported, opened, folder, print_message)
    click.echo(f"{n_runs} {'run is' if n_runs == 1 else 'runs are'} in {folder}.")


@command.command("export")
@click.argument("experiment", type=PATH)
@click.argument("folder", type=PATH)
@output_option(
    "--as",
    "result_format",
    required=True,
    metavar="FORMAT",
    help="Result format: otb, otb-json, got10k, vot, pysot or pytracking.",
)
@tracker_option
@sequence_option
@output_option(
    "--from",
    "origin",
    metavar="INTEGER",
    type=click.IntRange(0, 1),
    help="Coordinate of the first pixel, 0 or 1.  [default: as in the files of the data set]",
)
@output_option("--force", is_flag=True, help="Replace existing files.")
@protocol_option
@trajectory_option
def export(
    experiment: Path,
    folder: Path,
    result_format: str,
    tracker: str,
    sequence: str,
    origin: int | None,
    force: bool,
    protocol: str | None,
    trajectory: "Trajectory",
) -> None:
    """Write stored runs as result files of other toolkits.

    EXPERIMENT is a results folder. The command writes one folder per tracker to FOLDER.

    For example:
      trackmark results export results/windows exported --as otb

    Exit codes: 0 success; 2 invalid usage or input.
    """
    from trackmark.bench.exchange.exporting import export_results
    from trackmark.bench.store.database import single_experiment

    files = export_results(
        single_experiment(experiment),
        result_format,
        folder,
        print_message,
        tracker=tracker,
        sequence=sequence,
        origin=origin,
        force=force,
        trajectory=trajectory,
        protocol=protocol or "one-pass",
    )
    click.echo(f"{len(files)} files are in {folder}.")
