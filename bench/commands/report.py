"""Make tables and plots of stored results."""

import functools
from pathlib import Path

import click

from bench.commands._options import metrics_option, patience, refresh_index

__all__ = ["command"]

FORMATS = ("text", "markdown", "csv", "latex")


@click.command("report")
@click.argument("results", type=click.Path(path_type=Path))
@click.option("--format", "form", type=click.Choice(FORMATS), help="Print in this format alone.")
@click.option(
    "--folder",
    type=click.Path(path_type=Path),
    help="Write tables in every format, plots and film strips into this folder.",
)
@metrics_option
@click.option("--wide", is_flag=True, help="Print all columns, however wide the tables are.")
@click.option("--no-pictures", is_flag=True, help="Write tables alone.")
def command(
    results: Path,
    form: str | None,
    folder: Path | None,
    metrics: list[str],
    wide: bool,
    no_pictures: bool,
) -> None:
    """Report on RESULTS (the folder of an experiment, or one that holds several).

    Only that folder is read; film strips alone open the sequences, for their pixels. With
    --metrics stored runs are scored by other definitions; nothing is run again.
    """
    from bench.reporting.by_preset import by_presets, tables_by
    from bench.reporting.report import write_report
    from bench.reporting.tables import PRESET, title_of
    from bench.store.layout import experiment_folders
    from reports.fitting import on_terminal
    from reports.renderers import FORMATS as RENDERERS

    tell = functools.partial(click.echo, err=True)
    experiments = experiment_folders(results)
    for experiment in experiments:
        refresh_index(experiment)
        _, render = RENDERERS[form or "text"]
        title = title_of(experiment, named=len(experiments) > 1)
        others = [name for name in metrics if name != PRESET]
        with patience("Scoring runs"):
            scored = by_presets(experiment, others, title=title) if others else []
        made = tables_by(experiment, metrics, title=title, scored=scored)
        if form is None and not wide:
            render = functools.partial(on_terminal, render=render, more=" (--wide)")
        click.echo("\n".join(map(render, made)))
        if folder is not None:
            target = folder if len(experiments) == 1 else folder / experiment.name
            for path in write_report(
                experiment,
                target,
                tell,
                made,
                title=title,
                pictures=not no_pictures,
                scored=scored,
            ):
                click.echo(str(path), err=True)
