"""Reproduce a paper: main table, figures and a verdict on each claim."""

import json
import time
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from trackmark.bench.commands import EXIT_NEGATIVE
from trackmark.bench.commands._execution import execute_runs, plan_experiment
from trackmark.bench.commands._options import (
    Command,
    ExecutionOptions,
    ScreenOptions,
    argument,
    option,
    output_option,
    with_options,
)
from trackmark.bench.commands._output_files import check_outputs
from trackmark.bench.commands._progress import RunProgress, print_hint, print_message, progress_bar

if TYPE_CHECKING:
    from trackmark.bench.execution.plan import OpenedSequences
    from trackmark.bench.papers import ReproductionOptions
    from trackmark.bench.papers.paper import Paper
    from trackmark.bench.papers.reproduction import Report
    from trackmark.bench.store.keys import RunKey


@dataclass(frozen=True, kw_only=True)
class ReproduceOptions(ScreenOptions, ExecutionOptions):
    """Options of the command."""

    paper: str | None = argument(required=False)
    all_papers: bool = option("Reproduce every paper, and write a page that lists all of them.")
    quick: bool = option("Main table and figure strips in a minute, without verdicts.")
    with_sensitivity: bool = option("Add the sensitivity table.", "--all")
    page: Path | None = output_option(
        "Markdown file for the page of the paper; `-details` is added for its details. Film "
        "strips go to ../pictures/papers.",
        type=click.Path(path_type=Path, dir_okay=False),
    )
    strict: bool = option("Exit with code 1 if a claim does not hold in the setting `recommended`.")


@click.command("reproduce", cls=Command)
@with_options(ReproduceOptions)
def command(options: ReproduceOptions) -> int:
    """Reproduce a paper: main table, figures and a verdict on each claim.

    Every claim is tested on synthetic sequences in two settings: `as-written` takes the paper
    literally, `recommended` differs in values that the report lists. Runs are stored in folders in
    --results-root, the report in its folder PAPER. Stored runs are not repeated.

    For example:
      trackmark reproduce wang2010 --quick
      trackmark reproduce --all-papers --strict

    Exit codes: 0 success; 1 a claim does not hold (only with --strict); 2 invalid usage or input;
    130 interrupted.
    """
    from trackmark.bench.papers import ReproductionOptions, paper_names
    from trackmark.bench.papers.markdown_page import write_markdown_pages
    from trackmark.bench.papers.paper import read_paper

    page, quick = options.page, options.quick
    if (options.paper is None) != options.all_papers:
        names = ", ".join(paper_names())
        raise click.UsageError(f"Give one PAPER ({names}) or --all-papers.")
    if page is not None and options.all_papers:
        raise click.UsageError("--page requires one PAPER. Omit --all-papers.")
    if quick and options.with_sensitivity:
        raise click.UsageError("Give either --quick or --all.")
    if page is not None:
        folder = options.results_root / str(options.paper)
        reports = {str(folder / name): folder / name for name in ("report.html", "report.json")}
        check_outputs({"--page": page, **reports})
    reproduced = ReproductionOptions(
        quick=quick,
        with_sensitivity=options.with_sensitivity,
        jobs=options.jobs,
    )
    fails = False
    for name in paper_names() if options.paper is None else [options.paper]:
        report = _reproduce(read_paper(name), reproduced, options)
        if page is not None:
            pictures = page.absolute().parent.parent / "pictures" / "papers"
            write_markdown_pages(page.absolute(), pictures, report)
        if options.all_papers:
            from trackmark.bench.papers.index_page import write_front_page

            print_message(f"All papers: {write_front_page(options.results_root)}")
        verdicts = [row.verdicts["recommended"].verdict for row in report.verdicts]
        fails |= "does not hold" in verdicts
    return EXIT_NEGATIVE if options.strict and fails else 0


def _reproduce(
    paper: "Paper", reproduced: "ReproductionOptions", options: ReproduceOptions
) -> "Report":
    """Run the reproduction of a paper; write and print its report."""
    from trackmark.bench.papers.plan import experiments
    from trackmark.bench.papers.reproduction import make_report, report_data
    from trackmark.bench.papers.terminal_report import report_lines

    started_at, folder = time.monotonic(), options.results_root / paper.name
    requested: dict[str, Collection[RunKey]] = {}
    opened_sequences: OpenedSequences = {}
    executions = [
        plan_experiment(experiment, options, opened_sequences=opened_sequences)
        for experiment in experiments(paper, reproduced)
    ]
    runs = sum(execution.tasks.n_runs for execution in executions)
    quick = ", quick look without verdicts" if reproduced.quick else ""
    with RunProgress(f"{paper.name}{quick}: {runs} runs", folder) as progress:
        progress.expect(*executions)
        for execution in executions:
            execute_runs(execution, progress=progress)
            requested[execution.experiment.name] = execution.plan.requested_runs().versions
    with progress_bar("Drawing figures and judging claims", None, "claim") as progress:
        report = make_report(paper, options.results_root, folder, reproduced, requested, progress)
    json_object = report_data(report, time.monotonic() - started_at)
    _write(report, json_object, folder)
    if options.as_json:
        click.echo(json.dumps(json_object, allow_nan=False))
        return report
    lines = report_lines(report, folder, verbose=options.verbose, quiet=options.quiet)
    click.echo("\n".join(lines))
    if reproduced.quick:
        n_claims = len(paper.claims)
        print_hint(f"Verdicts on its {n_claims} claims  trackmark reproduce {paper.name}")
    return report


def _write(report: "Report", json_object: Mapping[str, object], folder: Path) -> None:
    """Write the report as HTML and Markdown pages, tables in every format, and JSON."""
    from trackmark.bench.commands._table_files import write_tables
    from trackmark.bench.output_files import write_file
    from trackmark.bench.papers.html_page import write_html_page
    from trackmark.bench.papers.markdown_page import write_markdown_pages

    write_tables(folder, report.tables)
    write_markdown_pages(folder / "report.md", folder, report)
    write_file(folder / "report.json", json.dumps(json_object, indent=1, allow_nan=False))
    with progress_bar("Drawing the report", None, "frame") as progress:
        write_html_page(folder / "report.html", report, progress)
