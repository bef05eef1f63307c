"""Reproduce a paper: main table, figures and a verdict on each claim."""

import json
import time
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from trackmark.bench.commands import EXIT_NEGATIVE
from trackmark.bench.commands._execution import execute_runs, plan_experiment
from trackmark.bench.commands._options import (
    OUTPUT_FILE,
    Command,
    ExecutionOptions,
    execution_options,
    input_option,
    output_option,
    screen_options,
)
from trackmark.bench.commands._output_files import check_outputs
from trackmark.bench.commands._progress import RunProgress, print_hint, print_message, progress_bar

if TYPE_CHECKING:
    from trackmark.bench.execution.plan import OpenedSequences
    from trackmark.bench.papers import ReproductionOptions
    from trackmark.bench.papers.paper import Paper
    from trackmark.bench.papers.reproduction import Report
    from trackmark.bench.store.database import RunKey


@click.command("reproduce", cls=Command)
@click.argument("paper", required=False)
@input_option(
    "--all-papers",
    is_flag=True,
    help="Reproduce every paper, and write a page that lists all of them.",
)
@input_option(
    "--quick", is_flag=True, help="Main table and figure strips in a minute, without verdicts."
)
@input_option("--all", "with_sensitivity", is_flag=True, help="Add the sensitivity table.")
@output_option(
    "--page",
    type=OUTPUT_FILE,
    help="Markdown file for the page of the paper; `-details` is added for its details. Film "
    "strips go to ../pictures/papers.",
)
@input_option(
    "--strict",
    is_flag=True,
    help="Exit with code 1 if a claim does not hold in the setting `recommended`.",
)
@execution_options
@screen_options
def command(
    paper: str | None,
    all_papers: bool,
    quick: bool,
    with_sensitivity: bool,
    page: Path | None,
    strict: bool,
    options: ExecutionOptions,
    as_json: bool,
    verbose: bool,
    quiet: bool,
) -> int:
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
    from trackmark.bench.papers.terminal_report import report_lines

    if (paper is None) != all_papers:
        names = ", ".join(paper_names())
        raise click.UsageError(f"Give one PAPER ({names}) or --all-papers.")
    if page is not None and all_papers:
        raise click.UsageError("--page requires one PAPER. Omit --all-papers.")
    if quick and with_sensitivity:
        raise click.UsageError("Give either --quick or --all.")
    if page is not None:
        folder = options.results_root / str(paper)
        reports = {str(folder / name): folder / name for name in ("report.html", "report.json")}
        check_outputs({"--page": page, **reports})
    reproduced = ReproductionOptions(
        quick=quick,
        with_sensitivity=with_sensitivity,
        jobs=options.jobs,
    )
    fails = False
    for name in paper_names() if paper is None else [paper]:
        report, json_object = _reproduce(read_paper(name), reproduced, options)
        if as_json:
            click.echo(json.dumps(json_object, allow_nan=False))
        else:
            folder = options.results_root / name
            click.echo("\n".join(report_lines(report, folder, verbose=verbose, quiet=quiet)))
            if quick:
                n_claims = len(report.paper.claims)
                print_hint(f"Verdicts on its {n_claims} claims  trackmark reproduce {name}")
        if page is not None:
            pictures = page.absolute().parent.parent / "pictures" / "papers"
            write_markdown_pages(page.absolute(), pictures, report)
        if all_papers:
            from trackmark.bench.papers.index_page import write_front_page

            print_message(f"All papers: {write_front_page(options.results_root)}")
        verdicts = [row.verdicts["recommended"].verdict for row in report.verdicts]
        fails |= "does not hold" in verdicts
    return EXIT_NEGATIVE if strict and fails else 0


def _reproduce(
    paper: "Paper", reproduced: "ReproductionOptions", options: ExecutionOptions
) -> "tuple[Report, dict[str, Any]]":
    """Run the reproduction of a paper; write and return its report, also as data for JSON."""
    from trackmark.bench.papers.plan import experiments
    from trackmark.bench.papers.reproduction import make_report, report_data

    started_at, name = time.monotonic(), paper.name
    folder = options.results_root / name
    requested: dict[str, Collection[RunKey]] = {}
    opened_sequences: OpenedSequences = {}
    executions = [
        plan_experiment(experiment, options, opened_sequences=opened_sequences)
        for experiment in experiments(paper, reproduced)
    ]
    runs = sum(execution.tasks.n_runs for execution in executions)
    quick = ", quick look without verdicts" if reproduced.quick else ""
    with RunProgress(f"{name}{quick}: {runs} runs", folder) as progress:
        progress.expect(*executions)
        for execution in executions:
            execute_runs(execution, progress=progress)
            requested[execution.experiment.name] = execution.plan.requested
    with progress_bar("Drawing figures and judging claims", None, "claim") as progress:
        report = make_report(paper, options.results_root, folder, reproduced, requested, progress)
    json_object = report_data(report, time.monotonic() - started_at)
    _write(report, json_object, folder)
    return report, json_object


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
