"""Show what trackmark does: run seven trackers and write a page."""

import os
import shutil
import sys
from pathlib import Path

import click

from trackmark.bench.commands import EXIT_NEGATIVE
from trackmark.bench.commands._execution import execute_runs, plan_experiment
from trackmark.bench.commands._options import (
    PATH,
    Command,
    ExecutionOptions,
    jobs_option,
    output_option,
)
from trackmark.bench.commands._progress import (
    open_runs,
    print_hint,
    print_message,
    progress_bar,
)
from trackmark.bench.commands._terminal import print_result
from trackmark.bench.experiments.experiment import read_experiment


@click.command("demo", cls=Command)
@output_option("--output", type=PATH, default="out", help="Folder for results and report.")
@jobs_option
def command(output: Path, jobs: int | None) -> int:
    """Show what trackmark does: run seven trackers and write a page.

    The command runs the built-in experiment `demo` in about a minute, without a download.

    For example:
      trackmark demo

    Exit codes: 0 success; 1 at least one run failed; 2 invalid usage or input; 130 interrupted.
    """
    from trackmark.bench.analysis.run_summary import summarise
    from trackmark.bench.analysis.run_tables import tables
    from trackmark.bench.commands._table_files import write_tables
    from trackmark.bench.execution.task import Limits
    from trackmark.bench.pages.report import ReportPage
    from trackmark.bench.pages.report_figures import write_figures

    experiment = read_experiment("demo")
    results = output / "results" / experiment.name
    options = ExecutionOptions(results.parent, jobs, Limits())
    execute_runs(plan_experiment(experiment, options))
    runs = open_runs(results)
    summary = summarise(runs)
    assert summary is not None
    print_result(summary.lines())
    if summary.failures:
        return EXIT_NEGATIVE
    folder = output / "demo"
    report_tables = tables(runs)
    write_tables(folder, report_tables)
    path = folder / "report.html"
    with progress_bar("Drawing the report", None, "frame") as progress:
        page = ReportPage(runs, report_tables)
        page.write(path, runs.title, progress)
        write_figures(page, folder, runs.title, ".png", print_message)
    program = _program()
    click.echo(f"\nReport  {path}  (open it in a browser; tables are next to it)")
    print_hint(
        "Next    try your own tracker or video, as README.md shows:\n"
        f"        {program} run --trackers matcher.py,camshift --sequences 'samples/*'\n"
        f"        {program} annotate cup.mp4 --draw"
    )
    return 0


def _program() -> str:
    """Return how this command was started, for commands to copy."""
    if Path(sys.argv[0]).name == "__main__.py":
        return "python -m trackmark"
    on_path = shutil.which("trackmark")
    is_on_path = on_path is not None and os.path.realpath(on_path) == os.path.realpath(sys.argv[0])
    return "trackmark" if is_on_path else os.path.relpath(sys.argv[0])
