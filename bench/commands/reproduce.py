"""Reproduce a paper: its tables and figures, and a verdict on each of its claims."""

import json
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from bench.commands import EXIT_ANSWER_IS_NO, EXIT_INTERRUPTED
from bench.commands._options import (
    chosen_sequences,
    engine_options,
    json_option,
    output_option,
    patience,
    progress_bar,
    refresh_index,
    telling_of_replaced,
)

if TYPE_CHECKING:
    from bench.execution.plan import KnownSequences
    from bench.experiments.experiment import Experiment
    from bench.papers import Effort, Report
    from bench.papers.report import Paper
    from bench.store.layout import Cell

__all__ = ["command"]


@click.command("reproduce")
@click.argument("paper")
@click.option("--quick", is_flag=True, help="A look in a minute: few scenes and seeds.")
@click.option("--all", "everything", is_flag=True, help="Also sensitivities and ablations.")
@click.option("--seeds", type=click.IntRange(1), help="Most repetitions of any tracker.")
@click.option("--recorded", help="Comma-separated recorded sequences to run the trackers on, too.")
@click.option(
    "--published",
    type=click.Path(path_type=Path, exists=True, dir_okay=False),
    help="CSV of figures that others published on those, to stand beside ours.",
)
@click.option(
    "--page",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Page (Markdown) to write the main table and the verdicts into.",
)
@click.option("--strict", is_flag=True, help="Exit status 1 where a claim does not hold.")
@output_option
@engine_options
@json_option
def command(
    paper: str,
    quick: bool,
    everything: bool,
    seeds: int | None,
    recorded: str | None,
    published: Path | None,
    page: Path | None,
    strict: bool,
    output: Path,
    means: dict[str, Any],
    as_json: bool,
) -> int:
    """Reproduce PAPER on sequences of ours: its tables beside ours, a verdict on every claim.

    Runs go to the folders of their experiments in --output, the report to a folder of the
    paper's name there. What is done already is not done again. Nothing is tuned to a wanted
    number: what comes out is what is printed.
    """
    from bench.papers import Effort, load_paper
    from bench.papers.page import write_page
    from bench.papers.screen import screen

    module = load_paper(paper)
    effort = Effort(
        quick=quick,
        everything=everything,
        seeds=seeds,
        jobs=means["jobs"],
        recorded=chosen_sequences(recorded, None) if recorded else (),
        published=published,
    )
    folder = output / paper
    experiments = module.experiments(effort)
    module.prepare(folder, effort)
    asked: dict[str, Collection[Cell]] = {}
    known: KnownSequences = {}
    for experiment in experiments:
        cells = _run(experiment, output, known, means)
        if cells is None:
            return EXIT_INTERRUPTED
        asked[experiment.name] = cells
    report = module.report(output, folder, effort, asked)
    _write(report, paper, folder)
    _write_page(report, module, folder, effort)
    if as_json:
        click.echo(json.dumps(_document(report, paper), allow_nan=False))
    else:
        click.echo(screen(report, paper, effort, folder))
    if page is not None:
        write_page(page, report, paper, effort)
    fails = (
        claim["verdict"] == "does-not-hold"
        for claim in report.claims
        if not claim["evidence"]["ours"]
    )
    return EXIT_ANSWER_IS_NO if strict and any(fails) else 0


def _run(
    experiment: "Experiment", output: Path, known: "KnownSequences", means: Mapping[str, Any]
) -> "Collection[Cell] | None":
    """Run what is left of an experiment; its cells, or None where the user stopped it.

    Several experiments have the same sequences, which take long to open: `known` holds them.
    """
    from bench.execution.run import Execution
    from datasets import SequenceError

    refresh_index(output / experiment.name)
    with patience("Opening sequences") as opened:
        execution = Execution(experiment, output, known=known, opened=opened, **means)
    click.echo(f"{experiment.title}: {len(execution.plan)} runs", err=True)
    try:
        with telling_of_replaced(execution), progress_bar(execution.work, "frame") as progress:
            for _ in execution.rows(progress):
                pass
    except KeyboardInterrupt:
        click.echo(
            f"Stopped: what is done is kept in {execution.folder}. The same command goes on "
            "from there.",
            err=True,
        )
        return None
    if execution.errors:
        raise SequenceError("\n".join(execution.errors))
    return execution.plan.asked().cells


def _write(report: "Report", paper: str, folder: Path) -> None:
    """Write the report as pages, tables in every format, and JSON."""
    from bench.store.files import ResultsError
    from reports.files import write_file
    from reports.write import report_page, write_tables

    text = json.dumps(_document(report, paper), indent=1, allow_nan=False)
    page = report_page(report.title, report.remarks, report.tables, report.pictures)

    try:
        write_tables(folder, report.tables)
        write_file(folder / "report.md", lambda path: path.write_text(page, "utf-8"))
        write_file(folder / "report.json", lambda path: path.write_text(text, "utf-8"))
    except OSError as error:
        raise ResultsError(str(error.strerror or error)) from error


def _write_page(report: "Report", paper: "Paper", folder: Path, effort: "Effort") -> None:
    """Write the report as a page that shows what its numbers rest on."""
    from bench.papers.html_page import write_html_page
    from bench.store.files import ResultsError

    readings = next(iter(paper.claims.values())).readings
    try:
        with progress_bar(None, "frame") as progress:
            name = paper.description.name
            write_html_page(folder / "report.html", report, readings, name, effort, progress)
    except OSError as error:
        raise ResultsError(str(error.strerror or error)) from error


def _document(report: "Report", paper: str) -> dict[str, object]:
    """What a script reads."""
    names = dict.fromkeys(row["table"] for row in report.rows)
    return {
        "title": report.title,
        "paper": paper,
        "remarks": report.remarks,
        "tables": [
            {
                "id": name,
                "rows": [
                    {key: value for key, value in row.items() if key != "table"}
                    for row in report.rows
                    if row["table"] == name
                ],
            }
            for name in names
        ],
        "claims": report.claims,
    }
