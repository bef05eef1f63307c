"""Reproduce a paper: its main table and figures, and a verdict on each of its claims."""

import json
import time
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click

from trackmark.bench.commands import EXIT_ANSWER_IS_NO
from trackmark.bench.commands._execution import execute_runs, plan_experiment
from trackmark.bench.commands._options import Engine, engine_options, json_option, output_option
from trackmark.bench.commands._progress import print_message, progress_bar

if TYPE_CHECKING:
    from trackmark.bench.execution.plan import KnownSequences
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
    engine: Engine,
    as_json: bool,
) -> int:
    """Reproduce PAPER on synthetic sequences: its main table next to ours, and verdicts.

    Every claim is judged in two settings: `as-written` takes the paper literally, `recommended`
    differs in a few values that the paper leaves open. Runs go to folders in --output, the report
    to a folder of the paper's name there. Stored runs are not repeated.
    """
    from trackmark.bench.papers import Effort, paper_names
    from trackmark.bench.papers.markdown_page import write_page
    from trackmark.bench.papers.reproduction import Reproduction

    if (paper is None) != all_papers:
        names = ", ".join(paper_names())
        raise click.UsageError(f"Give one PAPER ({names}) or --all-papers.")
    if page is not None and (all_papers or quick):
        raise click.UsageError("--page needs one PAPER, and a report with verdicts (no --quick).")
    if quick and everything:
        raise click.UsageError("Give --quick or --all, not both.")
    effort = Effort(quick=quick, everything=everything, seeds=seeds, jobs=engine.jobs)
    fails = False
    for name in paper_names() if paper is None else [paper]:
        report = _reproduce(Reproduction(name), effort, output, engine, as_json=as_json)
        if page is not None:
            write_page(page, report)
        if all_papers:
            from trackmark.bench.papers.index_page import write_front_page

            print_message(f"All papers: {write_front_page(output)}")
        verdicts = [row.verdicts["recommended"].verdict for row in report.verdicts]
        fails |= "does not hold" in verdicts
    if quick:
        print_message("--quick judges no claims. Omit it to get verdicts.")
    return EXIT_ANSWER_IS_NO if strict and fails else 0


def _reproduce(
    paper: "Reproduction", effort: "Effort", output: Path, engine: Engine, *, as_json: bool
) -> "Report":
    """Run, report and print a paper."""
    from trackmark.bench.papers.reproduction import document
    from trackmark.bench.papers.terminal_report import screen

    started_at, folder = time.monotonic(), output / paper.name
    requested: dict[str, Collection[Cell]] = {}
    known: KnownSequences = {}
    for experiment in paper.experiments(effort):
        execution = plan_experiment(experiment, output, engine, known=known)
        print_message(f"{experiment.title}: {len(execution.plan)} runs")
        execute_runs(execution)
        requested[experiment.name] = execution.plan.asked().cells
    report = paper.report(output, folder, effort, requested)
    content = document(report, time.monotonic() - started_at)
    _write(report, content, folder)
    click.echo(json.dumps(content, allow_nan=False) if as_json else screen(report, folder))
    return report


def _write(report: "Report", content: Mapping[str, object], folder: Path) -> None:
    """Write the report as HTML and Markdown pages, tables in every format, and JSON."""
    from trackmark.bench.papers.html_page import write_html_page
    from trackmark.bench.papers.markdown_page import write_page
    from trackmark.reports.files import write_file
    from trackmark.reports.write import write_tables

    text = json.dumps(content, indent=1, allow_nan=False)
    write_tables(folder, report.tables)
    write_page(folder / "report.md", report)
    write_file(folder / "report.json", lambda path: path.write_text(text, "utf-8"))
    with progress_bar(None, "frame") as progress:
        write_html_page(folder / "report.html", report, progress)
