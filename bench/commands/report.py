"""Make tables and plots of stored results."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from bench.commands._options import refresh_index

if TYPE_CHECKING:
    from datasets import Sequence

__all__ = ["command", "write_report"]

FORMATS = ("text", "markdown", "csv", "latex")


@click.command("report")
@click.argument("results", type=click.Path(path_type=Path))
@click.option("--format", "form", type=click.Choice(FORMATS), help="Print in this format alone.")
@click.option(
    "--folder",
    type=click.Path(path_type=Path),
    help="Write tables in every format, plots and film strips into this folder.",
)
@click.option("--no-pictures", is_flag=True, help="Write tables alone.")
def command(results: Path, form: str | None, folder: Path | None, no_pictures: bool) -> None:
    """Report on RESULTS (the folder of an experiment, or one that holds several).

    Only that folder is read; film strips alone open the sequences, for their pixels.
    """
    from bench.reporting import tables
    from bench.store.index import experiment_folders
    from reports.renderers import FORMATS as RENDERERS

    experiments = experiment_folders(results)
    for experiment in experiments:
        refresh_index(experiment)
        _, render = RENDERERS[form or "text"]
        click.echo("\n".join(render(table) for table in tables(experiment)))
        if folder is not None:
            target = folder if len(experiments) == 1 else folder / experiment.name
            for path in write_report(experiment, target, pictures=not no_pictures):
                click.echo(str(path), err=True)


def write_report(experiment: Path, folder: Path, *, pictures: bool = True) -> list[Path]:
    """Write a report of one experiment and give the files.

    Raises
    ------
    ResultsError
        Where results can't be read or the report can't be written.
    """
    from bench.reporting import frame_table, tables, timing_runs, title_of
    from bench.store.files import ResultsError
    from bench.store.loading import load_results
    from reports.tables import complete
    from reports.write import write_plots, write_tables

    try:
        paths = write_tables(folder, tables(experiment))
        if pictures:
            runs = load_results(experiment)
            scored = complete(runs[runs["protocol"] == "accuracy"])
            paths += write_plots(
                folder,
                frame_table(experiment),
                timing_runs(runs),
                title_of(experiment),
                trackers=list(scored["tracker"].unique()),
                incomplete=set(scored[scored["status"] != "finished"]["tracker"]),
            )
            paths += _film_strips(experiment, folder)
    except OSError as error:
        raise ResultsError(str(error.strerror or error)) from error
    return paths


def _film_strips(experiment: Path, folder: Path) -> list[Path]:
    """A strip of every sequence whose pixels can be had here as they were."""
    from bench.reporting import boxes_of
    from bench.store.index import read_index
    from bench.store.results import Results
    from reports.film_strip import evenly_spaced, film_strip, write_film_strip
    from reports.write import file_name

    paths = []
    rows = {str(row["sequence"]): row for row in read_index(Results(experiment))}
    for name, row in sorted(rows.items()):
        sequence = _opened(row)
        if sequence is None:
            click.echo(f"{name}: no film strip: it is not at {row['source']} as it was.", err=True)
            continue
        numbers = evenly_spaced(sequence.first_frame, len(sequence) - 1, 10)
        strip = film_strip(sequence.__getitem__, numbers, boxes_of(experiment, name), name)
        paths.append(write_film_strip(folder / f"strip-{file_name(name)}.png", strip))
    return paths


def _opened(row: dict[str, Any]) -> "Sequence | None":
    """The sequence of a run, where it is still there and the same."""
    import datasets

    try:
        sequence = datasets.load(row["source"], truth=row["truth"] or None)
    except datasets.SequenceError:
        return None
    return sequence if sequence.fingerprint == row["fingerprint"] else None
