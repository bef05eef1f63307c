"""Reproduce a paper: its tables and figures, and a verdict on each of its claims."""

import json
import time
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
@click.argument("paper", required=False)
@click.option("--all-papers", is_flag=True, help="Every paper, and one page for all of them.")
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
    paper: str | None,
    all_papers: bool,
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
    paper's name there, as a page (report.html) and as tables; with --all-papers one page in
    --output leads to all. What is done already is not done again. Nothing is tuned to a wanted
    number: what comes out is what is printed.
    """
    from bench.papers import Effort, load_paper, paper_names
    from bench.papers.page import write_page

    known = ", ".join(paper_names())
    if (paper is None) != all_papers:
        raise click.UsageError(f"Give either --all-papers or one PAPER ({known}).")
    if all_papers and page is not None:
        raise click.UsageError("--page goes with one PAPER, not with --all-papers.")
    effort = Effort(
        quick=quick,
        everything=everything,
        seeds=seeds,
        jobs=means["jobs"],
        recorded=chosen_sequences(recorded, None) if recorded else (),
        published=published,
    )
    fails = False
    for name in paper_names() if paper is None else [paper]:
        report = _reproduce(load_paper(name), effort, output, means, as_json=as_json)
        if report is None:
            return EXIT_INTERRUPTED
        if page is not None:
            write_page(page, report, name, effort)
        if all_papers:
            _write_front_page(output)
        ours = [one for one in report.claims if not one["evidence"]["ours"]]
        fails |= any(claim["verdict"] == "does not hold" for claim in ours)
    return EXIT_ANSWER_IS_NO if strict and fails else 0


def _reproduce(
    module: "Paper", effort: "Effort", output: Path, means: Mapping[str, Any], *, as_json: bool
) -> "Report | None":
    """Run, report and print a paper; None where the user stopped it."""
    from bench.papers.screen import screen

    began, paper = time.monotonic(), module.description.name
    folder = output / paper
    experiments = module.experiments(effort)
    module.prepare(folder, effort)
    asked: dict[str, Collection[Cell]] = {}
    known: KnownSequences = {}
    for experiment in experiments:
        cells = _run(experiment, output, known, means)
        if cells is None:
            return None
        asked[experiment.name] = cells
    report = module.report(output, folder, effort, asked)
    _write_page(report, module, folder, effort)
    document = _document(report, paper, effort, time.monotonic() - began)
    _write(report, document, folder)
    if as_json:
        click.echo(json.dumps(document, allow_nan=False))
    else:
        click.echo(screen(report, paper, effort, folder))
    return report


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


def _write(report: "Report", document: Mapping[str, object], folder: Path) -> None:
    """Write the report as pages, tables in every format, and JSON."""
    from reports.files import write_file
    from reports.write import report_page, write_tables

    text = json.dumps(document, indent=1, allow_nan=False)
    page = report_page(report.title, report.remarks, report.tables, report.pictures)

    write_tables(folder, report.tables)
    write_file(folder / "report.md", lambda path: path.write_text(page, "utf-8"))
    write_file(folder / "report.json", lambda path: path.write_text(text, "utf-8"))


def _write_page(report: "Report", paper: "Paper", folder: Path, effort: "Effort") -> None:
    """Write the report as a page that shows what its numbers rest on."""
    from bench.papers.html_page import write_html_page

    readings = next(iter(paper.claims.values())).readings
    with progress_bar(None, "frame") as progress:
        name = paper.description.name
        write_html_page(folder / "report.html", report, readings, name, effort, progress)


def _write_front_page(output: Path) -> None:
    """Write the page that leads to those of all papers."""
    from bench.papers.front_page import write_front_page

    click.echo(f"All papers: {write_front_page(output)}", err=True)


def _document(report: "Report", paper: str, effort: "Effort", seconds: float) -> dict[str, object]:
    """What a script reads."""
    from bench.papers.html_page import command_of

    names = dict.fromkeys(row["table"] for row in report.rows)
    return {
        "title": report.title,
        "paper": paper,
        "command": command_of(paper, effort),
        "quick": effort.quick,
        "seconds": round(seconds, 1),
        "tracking_seconds": round(report.tracking_seconds, 1),
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
