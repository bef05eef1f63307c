"""Look after stored results: list, remove, merge."""

import json
from collections import Counter
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import click

from bench.cli import EXIT_ANSWER_IS_NO
from bench.commands._options import DEFAULT_OUTPUT, json_option, progress_bar

__all__ = ["command"]

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
    from bench.store.index import experiment_folders, for_json, read_index
    from bench.store.results import Results

    for experiment in experiment_folders(folder):
        rows = read_index(Results(experiment))
        if as_json:
            for row in rows:
                click.echo(json.dumps({"experiment": experiment.name, **for_json(row)}))
            continue
        click.echo(f"{experiment}: {len(rows)} runs")
        counts = Counter(_key(row) for row in rows)
        failed = Counter(_key(row) for row in rows if row["status"] == "failed")
        for (tracker, sequence, protocol), count in sorted(counts.items()):
            marks = (
                f", {failed[tracker, sequence, protocol]} failed"
                if failed[tracker, sequence, protocol]
                else ""
            )
            timing = " (timing)" if protocol == "timing" else ""
            click.echo(f"  {tracker} on {sequence}{timing}: {count}{marks}")


@command.command("remove")
@folder_argument
@click.option("--tracker", default="*", help="Only trackers that match; * and ? are wild.")
@click.option("--sequence", default="*", help="Only sequences that match; * and ? are wild.")
@click.option("--failed", is_flag=True, help="Only runs that failed.")
@click.option("--yes", is_flag=True, help="Do not ask.")
def remove(folder: Path, tracker: str, sequence: str, failed: bool, yes: bool) -> None:
    """Remove runs from FOLDER."""
    from bench.store.index import experiment_folders, read_index
    from bench.store.results import Results

    chosen: list[tuple[Results, dict[str, Any]]] = []
    for experiment in experiment_folders(folder):
        results = Results(experiment)
        chosen += [
            (results, row)
            for row in read_index(results)
            if fnmatchcase(row["tracker"], tracker)
            and fnmatchcase(row["sequence"], sequence)
            and (not failed or row["status"] == "failed")
        ]
    if not chosen:
        click.echo("No run matches; nothing was removed.")
        return
    if not yes:
        click.confirm(f"Remove {len(chosen)} runs from {folder}?", abort=True)
    for experiment in experiment_folders(folder):
        results = Results(experiment)
        results.remove([row["path"] for place, row in chosen if place.folder == experiment])
        read_index(results)
    click.echo(f"Removed {len(chosen)} runs.")


@command.command("check")
@folder_argument
@json_option
def check_results(folder: Path, as_json: bool) -> int:
    """Read every file in FOLDER, and tell which is not what was written.

    Exit status 1 where there is one. With --json a line an experiment.
    """
    from bench.store.checking import checks, damage
    from bench.store.index import experiment_folders

    found = 0
    for experiment in experiment_folders(folder):
        todo = checks(experiment)
        told: dict[str, None] = {}
        with progress_bar(len(todo), "file") as progress:
            for number, check in enumerate(todo, 1):
                told |= dict.fromkeys(filter(None, [damage(check)]))
                progress(number)
        found += len(told)
        if as_json:
            told_of = {"experiment": experiment.name, "files": len(todo), "damages": list(told)}
            click.echo(json.dumps(told_of))
            continue
        for sentence in told:
            click.echo(sentence, err=True)
        click.echo(f"{experiment}: {len(todo)} files, {len(told) or 'none'} damaged or missing")
    return EXIT_ANSWER_IS_NO if found else 0


@command.command("merge")
@click.argument("sources", nargs=-1, required=True, type=click.Path(path_type=Path, exists=True))
@click.argument("target", type=click.Path(path_type=Path))
def merge(sources: tuple[Path, ...], target: Path) -> int:
    """Copy the runs of the experiments SOURCES into the experiment TARGET.

    A run that is there already, with the same identity, is left alone. One that is there
    with another identity (another version of its tracker, say) is a conflict: nothing is
    copied then, and the conflicts are listed.
    """
    from bench.store.merging import merge_results

    copied, conflicts = merge_results(list(sources), target)
    for conflict in conflicts:
        click.echo(f"conflict: {conflict}", err=True)
    if conflicts:
        click.echo(f"{len(conflicts)} conflicts; nothing was copied.", err=True)
        return 1
    click.echo(f"Copied {copied} runs to {target}.")
    return 0


def _key(row: dict[str, Any]) -> tuple[str, str, str]:
    return row["tracker"], row["sequence"], row["protocol"]
