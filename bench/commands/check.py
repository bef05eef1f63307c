"""Check whether trackers score worse than a baseline."""

import json
import re
from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from trackmark.bench.commands import EXIT_ANSWER_IS_NO
from trackmark.bench.commands._baseline_runs import (
    CellRunner,
    differing,
    failure_lines,
    first_cells,
    with_failures,
)
from trackmark.bench.commands._options import (
    engine_options,
    json_option,
    metrics_option,
    output_option,
    utf8_text,
)
from trackmark.bench.commands.baseline import refuse_hidden_randomness

if TYPE_CHECKING:
    from trackmark.bench.comparing.baseline import Baseline
    from trackmark.bench.comparing.regression_check import Check
    from trackmark.bench.statistics.speed import Pace
    from trackmark.reports.tables import Table

EXIT_INCONCLUSIVE = 3


def _seconds(context: click.Context, parameter: click.Parameter, text: str) -> float:
    match = re.fullmatch(r"(\d+(?:\.\d+)?) ?(s|min|h)", text.strip())
    if match is None:
        raise click.BadParameter(
            f"{text!r} is not a valid duration. Use, for example, 90s, 10min or 2h."
        )
    return float(match[1]) * {"s": 1, "min": 60, "h": 3600}[match[2]]


@click.command("check")
@click.argument("name")
@click.option("--trackers", default="*", help="Check only trackers whose label fits this pattern.")
@click.option("--sequences", default="*", help="Check only sequences whose name fits this pattern.")
@click.option(
    "--seeds",
    type=click.IntRange(6),
    help="Use only the first seeds of the baseline.  [default: all]",
)
@click.option("--strict", is_flag=True, help="Exit status 3 if an answer is inconclusive.")
@click.option("--accept", metavar="TRACKER", help="Replace its scores in the baseline by new ones.")
@click.option(
    "--because", callback=utf8_text, help="Reason for --accept; written into the baseline."
)
@click.option("--whole", is_flag=True, help="Show identical sequences, too.")
@click.option(
    "--markdown", type=click.Path(path_type=Path, dir_okay=False), help="For a pull request."
)
@click.option("--junit", type=click.Path(path_type=Path, dir_okay=False), help="JUnit's XML.")
@click.option("--time", "timed", is_flag=True, help="Check the trackers' speed, too.")
@click.option("--against", metavar="REVISION", help="With --time: git revision to compare with.")
@click.option(
    "--budget",
    callback=_seconds,
    metavar="TIME",
    default="10min",
    show_default=True,
    help="With --time: time after which no sessions are added, as 90s, 10min or 2h.",
)
@metrics_option
@output_option
@engine_options
@json_option
def command(
    name: str,
    trackers: str,
    sequences: str,
    seeds: int | None,
    strict: bool,
    accept: str | None,
    because: str | None,
    whole: bool,
    markdown: Path | None,
    junit: Path | None,
    timed: bool,
    against: str | None,
    budget: float,
    metrics: list[str],
    output: Path,
    means: dict[str, Any],
    as_json: bool,
) -> int:
    """Compare what trackers score now with the baseline NAME.

    Runs what is missing. Exit status 1 if a tracker is worse or slower, or a run failed; 2 if the
    baseline or a sequence cannot be used; 3 with --strict if an answer is inconclusive. --metrics
    shows the current scores by other definitions, too; native decides.
    """
    from trackmark.bench.comparing.baseline import baseline_path, read_baseline
    from trackmark.bench.comparing.speed_check import check_speeds

    path = baseline_path(name)
    stored = read_baseline(path)
    _check_usage(stored, accept, because, seeds, against, timed=timed)
    before = _part(stored, accept or trackers, sequences if accept is None else "*")
    before = before.with_seeds(seeds or stored.seeds)
    speeds: dict[str, Pace] = {}
    if against is not None:
        # The whole baseline: whatever part of it is checked, the same sequences are timed.
        report = partial(click.echo, err=True)
        speeds = check_speeds(stored, list(before.cells), against, budget, report)
    runner = _runner(before, f"check-{path.stem}", output, means)
    result = _checked(before, runner)
    _show(result, speeds, as_json=as_json, whole=whole, markdown=markdown, junit=junit)
    if others := [preset for preset in metrics if preset != "native"]:
        click.echo(_by_others(result, runner.folder, others), err=as_json)
    if accept is not None and because is not None:
        return _accept(stored, path, accept, because, result, runner)
    return _status(result, speeds, strict=strict)


def _check_usage(
    stored: "Baseline",
    accept: str | None,
    because: str | None,
    seeds: int | None,
    against: str | None,
    *,
    timed: bool,
) -> None:
    """Raise `UsageError` for options that do not go together or do not fit the baseline."""
    if (accept is None) != (not (because or "").strip()):
        raise click.UsageError("--accept TRACKER goes with --because TEXT.")
    if accept is not None and accept not in stored.cells:
        raise click.UsageError(
            f"--accept: the baseline has no {accept!r}; it has {', '.join(stored.cells)}."
        )
    if accept is not None and (timed or seeds is not None):
        raise click.UsageError("--accept does not go with --time or --seeds.")
    if timed != (against is not None):
        raise click.UsageError(
            "--time goes with --against REVISION: speeds are compared with those of a git revision."
        )
    if seeds is not None and seeds > stored.seeds:
        raise click.UsageError(
            f"--seeds: the baseline has {stored.seeds} seeds ({seeds}). Give at most so many, or "
            "make the baseline again with more."
        )


def _runner(before: "Baseline", name: str, output: Path, means: Mapping[str, Any]) -> CellRunner:
    cells = {sequence: cell for row in before.cells.values() for sequence, cell in row.items()}
    sources = {sequence: cell.source for sequence, cell in cells.items()}
    digests = {sequence: cell.sequence for sequence, cell in cells.items()}
    return CellRunner(name, before.texts, sources, output, means, digests)


def _checked(before: "Baseline", runner: CellRunner) -> "Check":
    """Run the trackers of a baseline and compare them with it."""
    from trackmark.bench.comparing.baseline import surroundings
    from trackmark.bench.comparing.regression_check import changed_facts, check

    now = runner.run({tracker: list(row) for tracker, row in before.cells.items()}, before.seeds)
    repeated = runner.repeat(changed_facts(before.cells, now))
    not_repeatable = differing(now, repeated)
    return check(before, with_failures(now, repeated), surroundings(), not_repeatable)


def _status(result: "Check", speeds: "Mapping[str, Pace]", *, strict: bool) -> int:
    states = {result.verdict, *(check.state for check in speeds.values())}
    if states & {"regression", "slower"}:
        return EXIT_ANSWER_IS_NO
    return EXIT_INCONCLUSIVE if strict and "inconclusive" in states else 0


def _accept(
    stored: "Baseline", path: Path, tracker: str, reason: str, result: "Check", runner: CellRunner
) -> int:
    """Replace a tracker's scores in the baseline, unless a run failed."""
    from trackmark.bench.comparing.baseline import write_baseline

    repeated = runner.repeat(first_cells({tracker: list(result.now[tracker])}))
    if lines := failure_lines(with_failures(result.now, repeated)):
        click.echo("\n".join([*lines, f"{path} is not changed: runs failed."]), err=True)
        return EXIT_ANSWER_IS_NO
    refuse_hidden_randomness(result.now, repeated)
    today = datetime.now(UTC).date().isoformat()
    write_baseline(stored.moved_on(tracker, result.now, reason, today), path)
    click.echo(f"{path}: the scores of {tracker} are replaced.", err=True)
    return 0


def _show(
    result: "Check",
    speeds: Mapping[str, "Pace"],
    *,
    as_json: bool,
    whole: bool,
    markdown: Path | None,
    junit: Path | None,
) -> None:
    """Print the changes of scores and speeds, and write them into files."""
    from trackmark.bench.comparing.regression_check import as_data, as_junit, table
    from trackmark.bench.comparing.speed_check import speed_cases, speed_data, speed_table
    from trackmark.reports.renderers import to_markdown

    tables = [table(result, whole=whole), *([speed_table(speeds)] if speeds else [])]
    if as_json:
        data = as_data(result)
        if speeds:
            data["times"] = speed_data(speeds)
            states = {check.state for check in speeds.values()}
            if "slower" in states:
                data["verdict"] = "regression"
            elif "inconclusive" in states and data["verdict"] == "pass":
                data["verdict"] = "inconclusive"
        click.echo(json.dumps(data, allow_nan=False))
    else:
        click.echo("\n".join(map(_text, tables)), nl=False)
    if markdown is not None:
        _write(
            markdown,
            "\n".join(
                to_markdown(shown) if shown.rows else "".join(f"{note}\n" for note in shown.notes)
                for shown in tables
            ),
        )
    if junit is not None:
        _write(junit, as_junit(result, speed_cases(speeds)))


def _by_others(result: "Check", folder: Path, metrics: list[str]) -> str:
    """Return tables of the current scores by other presets."""
    from trackmark.bench.reporting.by_preset import summary_text

    cells = [
        (tracker, sequence, repetition, "accuracy")
        for tracker, row in result.now.items()
        for sequence, cell in row.items()
        for repetition in range(len(cell.overlap))
    ]
    return summary_text(folder, cells, metrics)


def _text(shown: "Table") -> str:
    """Return the table, or only its notes if nothing changed."""
    from trackmark.reports.printable import wrapped
    from trackmark.reports.renderers import to_text
    from trackmark.reports.table_width import on_terminal

    notes = "\n".join(wrapped(note) for note in shown.notes)
    table = on_terminal(replace(shown, notes=[]), to_text) if shown.rows else ""
    return f"{table}{notes}\n"


def _write(file: Path, text: str) -> None:
    from trackmark.reports.files import write_file
    from trackmark.reports.printable import printable

    write_file(file, lambda temporary: temporary.write_text(printable(text), encoding="utf-8"))


def _part(baseline: "Baseline", trackers: str, sequences: str) -> "Baseline":
    """Return the cells that two patterns fit; a tracker's label fits itself."""
    cells = {
        tracker: {name: cell for name, cell in row.items() if fnmatchcase(name, sequences)}
        for tracker, row in baseline.cells.items()
        if tracker == trackers or fnmatchcase(tracker, trackers)
    }
    cells = {tracker: row for tracker, row in cells.items() if row}
    if not cells:
        raise click.UsageError(f"nothing in the baseline fits {trackers!r} and {sequences!r}.")
    return replace(baseline, cells=cells)
