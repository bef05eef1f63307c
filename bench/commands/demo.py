"""Show what trackmark does: run four trackers and write a page."""

import os
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import click

from trackmark.bench.commands._execution import plan_experiment
from trackmark.bench.commands._options import (
    Command,
    EngineOptions,
    execution_option,
    output_option,
    with_options,
)
from trackmark.bench.commands._progress import print_message, progress_bar
from trackmark.bench.commands.run import execute
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
    """Show what trackmark does: run four trackers and write a page.

    The command runs the built-in experiment `demo` in about a minute, without a download.

    For example:
      trackmark demo

    Exit codes: 0 success; 1 at least one run failed; 2 invalid usage or input; 130 interrupted.
    """
    from trackmark.bench.pages.report import Commands, write_report_page
    from trackmark.bench.pages.report_figures import FigureFiles
    from trackmark.bench.reporting.tables import tables, title_of
    from trackmark.reports.write import write_tables

    experiment = read_experiment("demo")
    click.echo(
        f"Running {len(experiment.trackers)} trackers on {len(experiment.sequences)} sequences, "
        "timing them, then\nwriting a page, tables, plots and film strips: about a minute on two "
        "idle cores, half a\nminute more the first time, when kernels are compiled."
    )
    results = options.output / "results" / experiment.name
    engine_options = EngineOptions(output=results.parent, jobs=options.jobs)
    # Timing runs come first: the table of scores includes their times.
    timed = replace(experiment, timing=True, repetitions=1)
    for runs, metrics in ((timed, []), (experiment, ["native"])):
        if status := execute(plan_experiment(runs, engine_options), metrics):
            return status
    folder = options.output / "demo"
    report_tables = tables(results)
    write_tables(folder, report_tables)
    figures = FigureFiles(".png", print_message)
    page = folder / "report.html"
    with progress_bar("Drawing the report", None, "frame") as progress:
        title, names = title_of(results), Commands(str(results))
        write_report_page(results, page, report_tables, title, names, progress, figures=figures)
    program = os.path.relpath(sys.argv[0])
    click.echo(
        f"\nOpen {page}: every number there leads to the frames behind it.\n"
        "The folder also holds tables, plots and film strips.\n"
        f"\nNext: `{program} list`, `{program} describe camshift`,\nor your own video: "
        f"`{program} annotate --help`."
    )
    return 0
