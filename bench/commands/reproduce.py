"""Reproduce a paper: its main table and figures, and a verdict on each of its claims."""

import json
import time
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from trackmark.bench.commands import EXIT_ANSWER_IS_NO, EXIT_INTERRUPTED
from trackmark.bench.commands._options import (
    engine_options,
    json_option,
    output_option,
    patience,
    progress_bar,
    refresh_index,
    telling_of_replaced,
)

if TYPE_CHECKING:
    from trackmark.bench.execution.plan import KnownSequences
    from trackmark.bench.experiments.experiment import Experiment
    from trackmark.bench.papers import Effort
    from trackmark.bench.papers.reproduction import Report, Reproduction
    from trackmark.bench.store.layout import Cell


@click.command("reproduce")
@click.argument("paper", required=False)
@click.option("--all-papers", is_flag=True, help="Every paper, and one page for all of them.")
@click.option(
    "--quick", is_flag=True, help="Main table and figure strips in a minute; no verdicts."
)
@click.option("--all", "everything", is_flag=True, help="Also the sensitivity table.")
@click.option("--seeds", type=click.IntRange(1), help="Largest number of repetitions.")
@click.option(
    "--page",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Markdown file to write the paper's page to.",
)
@click.option("--strict", is_flag=True, help="Exit with 1 if a claim does not hold as recommended.")
@output_option
@engine_options
@json_option
def command(
    paper: str | None,
    all_papers: bool,
    quick: bool,
    everything: bool,
    seeds: int | None,
    page: Path | None,
    strict: bool,
    output: Path,
    means: dict[str, Any],
    as_json: bool,
) -> int:
    """Reproduce PAPER on synthetic sequences: its main table beside ours, and verdicts.

    Every claim is judged in two settings: `as-written` takes the paper literally, `recommended`
    differs in a few values that the paper leaves open. Runs go to folders in --output, the report
    to a folder of the paper's name there. Runs that are there already are not repeated.
    """
    from trackmark.bench.papers import Effort, paper_names
    from trackmark.bench.papers.markdown_page import write_page
    from trackmark.bench.papers.reproduction import Reproduction

    known = ", ".join(paper_names())
    if (paper is None) != all_papers:
        raise click.UsageError(f"Give one PAPER ({known}) or --all-papers.")
    if page is not None and (all_papers or quick):
        raise click.UsageError("--page needs one PAPER, and a report with verdicts (no --quick).")
    if quick and everything:
        raise click.UsageError("Give --quick or --all, not both.")
    effort = Effort(quick=quick, everything=everything, seeds=seeds, jobs=means["jobs"])
    fails = False
    for name in paper_names() if paper is None else [paper]:
        report = _reproduce(Reproduction(name), effort, output, means, as_json=as_json)
        if report is None:
            return EXIT_INTERRUPTED
        if page is not None:
            write_page(page, report)
        if all_papers:
            _write_front_page(output)
        verdicts = [row.verdicts["recommended"].verdict for row in report.verdicts]
        fails |= "does not hold" in verdicts
    return EXIT_ANSWER_IS_NO if strict and fails else 0


def _reproduce(
    paper: "Reproduction",
    effort: "Effort",
    output: Path,
    means: Mapping[str, Any],
    *,
    as_json: bool,
) -> "Report | None":
    """Run, report and print a paper; return None if the user stopped it."""
    from trackmark.bench.papers.reproduction import document
    from trackmark.bench.papers.terminal_report import screen

    began, folder = time.monotonic(), output / paper.name
    asked: dict[str, Collection[Cell]] = {}
    known: KnownSequences = {}
    for experiment in paper.experiments(effort):
        cells = _run(experiment, output, known, means)
        if cells is None:
            return None
        asked[experiment.name] = cells
    report = paper.report(output, folder, effort, asked)
    found = document(report, time.monotonic() - began)
    _write(report, found, folder)
    if as_json:
        click.echo(json.dumps(found, allow_nan=False))
    else:
        click.echo(screen(report, folder))
    return report


def _run(
    experiment: "Experiment", output: Path, known: "KnownSequences", means: Mapping[str, Any]
) -> "Collection[Cell] | None":
    """Run what is left of an experiment; return its cells, or None if the user stopped it.

    `known` holds opened sequences, as several experiments share some.
    """
    from trackmark.bench.execution.executor import Execution
    from trackmark.datasets import SequenceError

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
            f"Stopped. Finished runs are kept in {execution.folder}; the same command "
            "continues from there.",
            err=True,
        )
        return None
    if execution.errors:
        raise SequenceError("\n".join(execution.errors))
    return execution.plan.asked().cells


def _write(report: "Report", found: Mapping[str, object], folder: Path) -> None:
    """Write the report as HTML and Markdown pages, tables in every format, and JSON."""
    from trackmark.bench.papers.html_page import write_html_page
    from trackmark.bench.papers.markdown_page import write_page
    from trackmark.reports.files import write_file
    from trackmark.reports.write import write_tables

    text = json.dumps(found, indent=1, allow_nan=False)
    write_tables(folder, report.tables)
    write_page(folder / "report.md", report)
    write_file(folder / "report.json", lambda path: path.write_text(text, "utf-8"))
    with progress_bar(None, "frame") as progress:
        write_html_page(folder / "report.html", report, progress)


def _write_front_page(output: Path) -> None:
    """Write the page that leads to those of all papers."""
    from trackmark.bench.papers.index_page import write_front_page

    click.echo(f"All papers: {write_front_page(output)}", err=True)
