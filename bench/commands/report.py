"""Make tables and plots of stored results."""

import functools
from pathlib import Path
from typing import TYPE_CHECKING

import click

from bench.commands._guests import guests_of, guests_option, together
from bench.commands._options import (
    by_attribute_option,
    json_option,
    measured_attributes,
    metrics_option,
    patience,
    progress_bar,
)

if TYPE_CHECKING:
    from bench.reporting.by_attribute import Shown
    from bench.reporting.by_preset import Scored
    from reports.tables import Table

__all__ = ["command"]

FORMATS = ("text", "markdown", "csv", "latex")


@click.command("report")
@click.argument("results", type=click.Path(path_type=Path), required=False)
@click.option("--format", "form", type=click.Choice(FORMATS), help="Print in this format alone.")
@click.option(
    "--folder",
    type=click.Path(path_type=Path),
    help="Write report.html (a page with a player of the frames), tables in every format, plots "
    "and film strips into this folder.",
)
@click.option("--frames", is_flag=True, help="Write frames of their own size beside the page.")
@guests_option
@click.option("--sequences", help="Of --results-of, where there are no RESULTS; as for `run`.")
@metrics_option
@by_attribute_option
@click.option("--wide", is_flag=True, help="Print all columns, however wide the tables are.")
@click.option("--no-pictures", is_flag=True, help="Write tables alone.")
@json_option
def command(
    results: Path | None,
    form: str | None,
    folder: Path | None,
    frames: bool,
    results_of: tuple[str, ...],
    sequences: str | None,
    metrics: list[str],
    by_attribute: bool,
    wide: bool,
    no_pictures: bool,
    as_json: bool,
) -> None:
    """Report on RESULTS (the folder of an experiment, or one that holds several).

    Only that folder is read; film strips, the page and --by-attribute alone open the sequences,
    for their pixels. With --metrics stored runs are scored by other definitions; nothing is run
    again. With --results-of others' results on the same sequences stand in the same tables.
    """
    from bench.reporting.report import write_report
    from bench.reporting.tables import title_of
    from bench.store.layout import experiment_folders

    if results is None and not (results_of and sequences):
        raise click.UsageError("Give RESULTS, or --results-of and --sequences.")
    if results is not None and sequences is not None:
        raise click.UsageError("--sequences goes without RESULTS, whose sequences are known.")
    if frames and (folder is None or no_pictures):
        raise click.UsageError("--frames goes with --folder: frames are written beside the page.")
    if as_json and form is not None:
        raise click.UsageError("--json and --format exclude each other.")
    experiments = [] if results is None else experiment_folders(results)
    others = [text for given in results_of for text in ("--results-of", given)]
    others += [] if sequences is None else ["--sequences", sequences]
    with together(experiments, guests_of(results_of), sequences) as shown:
        for number, experiment in enumerate(shown):
            several = len(shown) > 1
            title = title_of(experiment, named=several)
            made, scored = _tables(experiment, metrics, title)
            against = _against(experiment, metrics, made) if by_attribute else []
            _print(made, form, wide=wide, as_json=as_json)
            if folder is None:
                continue
            target = folder / experiment.name if several else folder
            tell = functools.partial(click.echo, err=True)
            for path in write_report(
                experiment,
                target,
                tell,
                made,
                title=title,
                pictures=not no_pictures,
                scored=scored,
                against=against,
            ):
                tell(str(path))
            if not no_pictures:
                kept = str(experiments[number]) if experiments else ""
                said = kept, others
                _write_page(experiment, target / "report.html", made, title, said, full=frames)


def _against(experiment: Path, metrics: list[str], made: "list[Table]") -> "list[Shown]":
    """Scores against attributes of the sequences, which are measured at need; adds their tables."""
    from bench.reporting.by_attribute import attribute_report

    against = attribute_report(experiment, metrics, measured_attributes)
    made += [one.table for one in against]
    return against


def _tables(experiment: Path, metrics: list[str], title: str) -> "tuple[list[Table], list[Scored]]":
    """Tables of an experiment, and its runs as presets score them."""
    from bench.reporting.by_preset import beside_native, tables_by

    with patience("Scoring runs"):
        scored = beside_native(experiment, metrics, title=title)
    return tables_by(experiment, metrics, title=title, scored=scored), scored


def _print(made: "list[Table]", form: str | None, *, wide: bool, as_json: bool) -> None:
    """Print the tables of an experiment: as JSON one a line."""
    from reports.fitting import on_terminal
    from reports.renderers import FORMATS as RENDERERS
    from reports.renderers import to_json

    _, render = RENDERERS[form or "text"]
    if as_json:
        render = to_json
    elif form is None and not wide:
        render = functools.partial(on_terminal, render=render, more=" (--wide)")
    click.echo("\n".join(map(render, made)))


def _write_page(
    experiment: Path,
    path: Path,
    made: "list[Table]",
    title: str,
    said: tuple[str, list[str]],
    *,
    full: bool,
) -> None:
    """Write the page; `said`: how the results, and others' beside them, are given to commands."""
    from bench.pages.report import Said, write_report_page
    from bench.store.files import ResultsError

    try:
        with progress_bar(None, "frame") as progress:
            paths = write_report_page(
                experiment, path, made, title, Said(*said), progress, full=full
            )
    except OSError as error:
        raise ResultsError(str(error.strerror or error)) from error
    click.echo(str(paths[0]), err=True)
