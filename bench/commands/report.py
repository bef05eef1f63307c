"""Make tables and plots of stored results."""

import functools
from pathlib import Path

import click

from bench.commands._guests import guests_of, guests_option, together
from bench.commands._options import (
    by_attribute_option,
    measured_attributes,
    metrics_option,
    patience,
)

__all__ = ["command"]

FORMATS = ("text", "markdown", "csv", "latex")


@click.command("report")
@click.argument("results", type=click.Path(path_type=Path), required=False)
@click.option("--format", "form", type=click.Choice(FORMATS), help="Print in this format alone.")
@click.option(
    "--folder",
    type=click.Path(path_type=Path),
    help="Write tables in every format, plots and film strips into this folder.",
)
@guests_option
@click.option("--sequences", help="Of --results-of, where there are no RESULTS; as for `run`.")
@metrics_option
@by_attribute_option
@click.option("--wide", is_flag=True, help="Print all columns, however wide the tables are.")
@click.option("--no-pictures", is_flag=True, help="Write tables alone.")
def command(
    results: Path | None,
    form: str | None,
    folder: Path | None,
    results_of: tuple[str, ...],
    sequences: str | None,
    metrics: list[str],
    by_attribute: bool,
    wide: bool,
    no_pictures: bool,
) -> None:
    """Report on RESULTS (the folder of an experiment, or one that holds several).

    Only that folder is read; film strips and --by-attribute alone open the sequences, for their
    pixels. With --metrics stored runs are scored by other definitions; nothing is run again. With
    --results-of others' results on the same sequences stand in the same tables.
    """
    from bench.store.layout import experiment_folders

    if results is None and not (results_of and sequences):
        raise click.UsageError("Give RESULTS, or --results-of and --sequences.")
    if results is not None and sequences is not None:
        raise click.UsageError("--sequences goes without RESULTS, whose sequences are known.")
    experiments = [] if results is None else experiment_folders(results)
    with together(experiments, guests_of(results_of), sequences) as shown:
        for experiment in shown:
            target = folder
            if folder is not None and len(shown) > 1:
                target = folder / experiment.name
            _report(
                experiment,
                target,
                form,
                metrics,
                named=len(shown) > 1,
                by_attribute=by_attribute,
                wide=wide,
                pictures=not no_pictures,
            )


def _report(
    experiment: Path,
    folder: Path | None,
    form: str | None,
    metrics: list[str],
    *,
    named: bool,
    by_attribute: bool,
    wide: bool,
    pictures: bool,
) -> None:
    """Print the tables of an experiment, and write them and its pictures into a folder."""
    from bench.reporting.by_preset import beside_native, tables_by
    from bench.reporting.report import write_report
    from bench.reporting.tables import title_of
    from reports.fitting import on_terminal
    from reports.renderers import FORMATS as RENDERERS

    _, render = RENDERERS[form or "text"]
    title = title_of(experiment, named=named)
    with patience("Scoring runs"):
        scored = beside_native(experiment, metrics, title=title)
    made = tables_by(experiment, metrics, title=title, scored=scored)
    against = []
    if by_attribute:
        from bench.reporting.by_attribute import attribute_report

        against = attribute_report(experiment, metrics, measured_attributes)
        made += [one.table for one in against]
    if form is None and not wide:
        render = functools.partial(on_terminal, render=render, more=" (--wide)")
    click.echo("\n".join(map(render, made)))
    if folder is not None:
        tell = functools.partial(click.echo, err=True)
        for path in write_report(
            experiment,
            folder,
            tell,
            made,
            title=title,
            pictures=pictures,
            scored=scored,
            against=against,
        ):
            click.echo(str(path), err=True)
