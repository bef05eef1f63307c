"""Run four trackers on a synthetic and two recorded sequences, with tables and pictures."""

import functools
import os
import sys
from dataclasses import replace
from pathlib import Path

import click

from bench.commands._options import jobs_option
from bench.commands.run import execute
from bench.experiments.experiment import read_experiment

__all__ = ["command"]


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
    from bench.reporting.report import write_report
    from bench.reporting.tables import tables

    experiment = read_experiment("demo")
    click.echo(
        f"Running {len(experiment.trackers)} trackers on {len(experiment.sequences)} sequences, "
        "timing them, then\ndrawing tables, plots and film strips: about a minute on two idle "
        "cores, half a minute more\nthe first time, when kernels are compiled."
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
    tell = functools.partial(click.echo, err=True)
    paths = write_report(results, folder, tell, tables(results))
    click.echo(f"\nTables, plots and film strips are in {folder}:")
    for path in paths:
        if path.suffix == ".png":
            click.echo(f"  {path}")
    command_path = os.path.relpath(sys.argv[0])
    click.echo(
        f"\nNext: `{command_path} list`, `{command_path} describe camshift`,\nor your own video: "
        f"`{command_path} annotate --help`."
    )
    return 0
