"""Show what trackmark does: run seven trackers and write a page."""

import os
import sys
from dataclasses import dataclass
from pathlib import Path

import click

from trackmark.bench.commands import EXIT_NEGATIVE
from trackmark.bench.commands._execution import execute_runs, plan_experiment
from trackmark.bench.commands._options import (
    Command,
    ExecutionOptions,
    execution_option,
    output_option,
    with_options,
)
from trackmark.bench.commands._progress import (
    open_runs,
    print_hint,
    print_message,
    progress_bar,
)
from trackmark.bench.commands._terminal import print_result
from trackmark.bench.experiments.experiment import read_experiment


@dataclass(frozen=True, kw_only=True)
class DemoOptions:
    """Options of the command."""

    output: Path = output_option("Folder for results and report.", default=Path("out"))
    jobs: int | None = execution_option(
        "Number of worker processes.  [default: number of cores]", minimum=1
    )


@click.command("demo", cls=Command)
@with_options(DemoOptions)
def command(options: DemoOptions) -> int:
    """Show what trackmark does: run seven trackers and write a page.

    The command runs the built-in experiment `demo` in about a minute, without a download.

    For example:
      trackmark demo

    Exit codes: 0 success; 1 at least one run failed; 2 invalid usage or input; 130 interrupted.
    """
    from trackmark.bench.analysis.run_summary import summarise
    from trackmark.bench.analysis.run_tables import tables
    from trackmark.bench.commands._table_files import write_tables
    from trackmark.bench.pages.report import ReportPage
    from trackmark.bench.pages.report_figures import write_figures

    experiment = read_experiment("demo")
    results = options.output / "results" / experiment.name
    execution_options = ExecutionOptions(results_root=results.parent, jobs=options.jobs)
    execute_runs(plan_experiment(experiment, execution_options))
    runs = open_runs(results)
    summary = summarise(runs)
    assert summary is not None
    print_result(summary.lines())
    if summary.failures:
        return EXIT_NEGATIVE
    folder = options.output / "demo"
    report_tables = tables(runs)
    write_tables(folder, report_tables)
    path = folder / "report.html"
    with progress_bar("Drawing the report", None, "frame") as progress:
        page = ReportPage(runs, report_tables)
        page.write(path, runs.title, progress)
        write_figures(page, folder, runs.title, ".png", print_message)
    program = os.path.relpath(sys.argv[0])
    click.echo(f"\nReport  {path}  (open it in a browser; tables and plots are in the same folder)")
    print_hint(
        "Next    try your own tracker or video, as README.md shows:\n"
        f"        {program} run --trackers matcher.py,camshift --sequences 'samples/*'\n"
        f"        {program} annotate cup.mp4 --draw"
    )
    return 0
