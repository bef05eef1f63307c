"""Check whether trackers score worse than a baseline says."""

import json
from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from bench.commands import EXIT_ANSWER_IS_NO
from bench.commands._design import Bench, budget_option
from bench.commands._options import (
    engine_options,
    json_option,
    metrics_option,
    output_option,
    utf8_text,
)

if TYPE_CHECKING:
    from bench.comparing.baseline import Baseline
    from bench.comparing.checking import Check
    from bench.comparing.clocking import Clocked
    from reports.tables import Table

__all__ = ["command"]

EXIT_CANNOT_TELL = 3


@click.command("check")
@click.argument("name")
@click.option("--trackers", default="*", help="Check those alone whose label this pattern fits.")
@click.option("--sequences", default="*", help="Check those alone whose name this pattern fits.")
@click.option("--strict", is_flag=True, help="Exit status 3 where it can't be told.")
@click.option("--accept", metavar="TRACKER", help="Move the baseline on to its new scores.")
@click.option("--because", callback=utf8_text, help="Why; written into the baseline.")
@click.option("--whole", is_flag=True, help="Show identical cells, too.")
@click.option(
    "--markdown", type=click.Path(path_type=Path, dir_okay=False), help="For a pull request."
)
@click.option("--junit", type=click.Path(path_type=Path, dir_okay=False), help="JUnit's XML.")
@click.option("--time", "timed", is_flag=True, help="Check the trackers' speed, too.")
@click.option(
    "--against",
    metavar="REVISION",
    help="With --time: beside this git revision of them, not by the baseline's speeds.",
)
@metrics_option
@budget_option
@output_option
@engine_options
@json_option
def command(
    name: str,
    trackers: str,
    sequences: str,
    strict: bool,
    accept: str | None,
    because: str | None,
    whole: bool,
    markdown: Path | None,
    junit: Path | None,
    timed: bool,
    against: str | None,
    metrics: list[str],
    budget: float,
    output: Path,
    means: dict[str, Any],
    as_json: bool,
) -> int:
    """Compare what trackers score now with the baseline NAME.

    Runs what is needed, and adds repetitions where it can't be told. Exit status 1 where a tracker
    got worse, or slower. With --metrics what it scores now is shown by other definitions, too; it
    is judged by native.
    """
    from bench.comparing.baseline import baseline_path, read_baseline, write_baseline
    from bench.comparing.checking import check
    from bench.comparing.clocking import Clock

    path = baseline_path(name)
    kept = read_baseline(path)
    if (accept is None) != (not (because or "").strip()):
        raise click.UsageError("--accept TRACKER goes with --because TEXT.")
    if accept is not None and accept not in kept.cells:
        raise click.UsageError(f"{path} has no {accept!r}; it has {', '.join(kept.cells)}.")
    if against is not None and (not timed or accept is not None):
        raise click.UsageError("--against REVISION goes with --time, and not with --accept.")
    before = _part(kept, accept or trackers, sequences if accept is None else "*")
    clocked, speeds = {}, {}
    if timed:
        # The whole baseline: whatever is checked of it, the same sequences are clocked.
        clock = Clock(kept, list(before.cells), budget, partial(click.echo, err=True))
        if accept is None:
            clocked = clock.check(against)
        else:
            speeds = clock.speeds()
    found = check(before, _measured(before, f"check-{path.stem}", output, means, budget))
    _show(found, clocked, as_json=as_json, whole=whole, markdown=markdown, junit=junit)
    if others := [one for one in metrics if one != "native"]:
        click.echo(_by_others(found, output / f"check-{path.stem}", others), err=as_json)
    if accept is not None and because is not None:
        today = datetime.now(UTC).date().isoformat()
        moved = kept.moved_on(accept, replace(found.now, speeds=speeds), because, today)
        write_baseline(moved, path)
        click.echo(f"{path}: moved on to the new scores of {accept}.", err=True)
        return 0
    states = {found.judgement.state, *(entry.state for entry in clocked.values())}
    if states & {"worse", "slower"}:
        return EXIT_ANSWER_IS_NO
    return EXIT_CANNOT_TELL if strict and "cannot tell" in states else 0


def _show(
    found: "Check",
    clocked: Mapping[str, "Clocked"],
    *,
    as_json: bool,
    whole: bool,
    markdown: Path | None,
    junit: Path | None,
) -> None:
    """Print what became of cells and speeds, and write it into files."""
    from bench.comparing.checking import as_data, as_junit, table
    from bench.comparing.speeds import speeds_as_cases, speeds_as_data, speeds_table
    from reports.renderers import to_markdown

    tables = [table(found, whole=whole), *([speeds_table(clocked)] if clocked else [])]
    if as_json:
        data = as_data(found)
        if clocked:
            data["times"] = speeds_as_data(clocked)
            states = {entry.state for entry in clocked.values()}
            if "slower" in states:
                data["verdict"] = "regression"
            elif "cannot tell" in states and data["verdict"] == "pass":
                data["verdict"] = "cannot tell"
        click.echo(json.dumps(data, allow_nan=False))
    else:
        click.echo("\n".join(map(_text, tables)), nl=False)
    if markdown is not None:
        _write(
            markdown,
            "\n".join(
                to_markdown(one) if one.rows else "".join(f"{note}\n" for note in one.notes)
                for one in tables
            ),
        )
    if junit is not None:
        _write(junit, as_junit(found, speeds_as_cases(clocked)))


def _by_others(found: "Check", folder: Path, metrics: list[str]) -> str:
    """Tables of what was run, by other presets."""
    from bench.comparing.baseline import DECISIVE
    from bench.reporting.by_preset import summary_text

    cells = [
        (tracker, sequence, repetition, "accuracy")
        for tracker, sequence in found.names
        for repetition in range(found.now.cells[tracker][sequence].scores[DECISIVE].n)
    ]
    return summary_text(folder, cells, metrics)


def _text(made: "Table") -> str:
    """The table, or its notes alone where nothing changed."""
    from reports.fitting import on_terminal
    from reports.printable import wrapped
    from reports.renderers import to_text

    notes = "\n".join(wrapped(note) for note in made.notes)
    table = on_terminal(replace(made, notes=[]), to_text) if made.rows else ""
    return f"{table}{notes}\n"


def _write(file: Path, text: str) -> None:
    from reports.files import write_file
    from reports.printable import printable

    write_file(file, lambda temporary: temporary.write_text(printable(text), encoding="utf-8"))


def _part(baseline: "Baseline", trackers: str, sequences: str) -> "Baseline":
    """Cells that two patterns fit; a tracker's label fits itself."""
    cells = {
        tracker: {name: cell for name, cell in found.items() if fnmatchcase(name, sequences)}
        for tracker, found in baseline.cells.items()
        if tracker == trackers or fnmatchcase(tracker, trackers)
    }
    cells = {tracker: found for tracker, found in cells.items() if found}
    if not cells:
        raise click.UsageError(f"nothing in the baseline fits {trackers!r} and {sequences!r}.")
    return replace(baseline, cells=cells)


def _measured(
    before: "Baseline", name: str, output: Path, means: Mapping[str, Any], budget: float
) -> "Baseline":
    """What the baseline's cells score now, with as many repetitions as it takes."""
    from bench.comparing.baseline import DECISIVE
    from bench.comparing.checking import check, wanted

    cells = {
        (tracker, sequence): cell
        for tracker, found in before.cells.items()
        for sequence, cell in found.items()
    }
    sources = {sequence: cell.source for (_, sequence), cell in cells.items()}
    # Two, for trackers that draw random numbers now and did not: one would pass for a fact.
    design = {names: max(2, cell.scores[DECISIVE].n) for names, cell in cells.items()}
    bench = Bench(name, before.texts, sources, output, means, budget, may_fail=True)
    now = bench.run(design, before.detect)
    return bench.extend(design, lambda now: wanted(check(before, now)), now, before.detect)
