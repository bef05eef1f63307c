"""Run four trackers on a synthetic and two recorded sequences, with a page and tables."""

import functools
import os
import sys
from dataclasses import replace
from pathlib import Path

import click

from trackmark.bench.commands._options import jobs_option, progress_bar
from trackmark.bench.commands.run import execute
from trackmark.bench.experiments.experiment import read_experiment


@click.command("demo")
@click.option(
    "--output",
    type=click.Path(path_type=Path),
    default=Path("out"),
    show_default=True,
    help="Folder for results and report.",
)
@jobs_option
def command(output: Path, jobs: int | None) -> int:
    """Show what trackmark does, in about a minute, without a download.

    What it runs is the experiment `demo`: bench/experiments/demo.toml.
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
    results = output / "results" / experiment.name
    # Times first, so that the table of scores has them.
    timed = replace(experiment, timing=True, repetitions=1)
    status = execute(timed, results.parent, jobs, metrics=()) or execute(
        experiment, results.parent, jobs
    )
    if status:
        return status
    folder = output / "demo"
    made = tables(results)
    write_tables(folder, made)
    figures = FigureFiles(".png", functools.partial(click.echo, err=True))
    page = folder / "report.html"
    with progress_bar(None, "frame") as progress:
        named = Commands(str(results))
        title = title_of(results)
        write_report_page(results, page, made, title, named, progress, figures=figures)
    click.echo(
        f"\nOpen {page}: every number there leads to the frames behind it.\n"
        "Beside it are tables, plots and film strips."
    )
    command_path = os.path.relpath(sys.argv[0])
    click.echo(
        f"\nNext: `{command_path} list`, `{command_path} describe camshift`,\nor your own video: "
        f"`{command_path} annotate --help`."
    )
    return 0
