"""Download a data set from its public addresses."""

from pathlib import Path

import click

from trackmark.bench.commands import EXIT_WRONG_INPUT
from trackmark.bench.commands._options import Command, input_option
from trackmark.bench.commands._progress import progress_bar
from trackmark.bench.commands._terminal import print_error
from trackmark.reports.printable import wrap


@click.command("download", cls=Command)
@click.argument("set_name", metavar="SET")
@click.argument("names", nargs=-1, metavar="[NAMES]…")
@input_option(
    "--to",
    "folder",
    metavar="FOLDER",
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder to which the sequences are written; it is created if necessary.",
)
def command(set_name: str, names: tuple[str, ...], folder: Path | None) -> int:
    """Download a data set from its public addresses.

    SET is otb, davis2016, davis2017, vot2013 to vot2022, vot-lt2018, vot-lt2019 or vot-lt2022;
    NAMES are sequences of it, by default all. The same command continues an interrupted download
    and leaves out sequences whose folder exists. For other data sets (got10k, lasot, trackingnet,
    uav123, nfs, tcolor128, tlp, mot17) it prints page, size and steps.

    For example:
      trackmark download otb Basketball Bird1 --to OTB100
      trackmark download vot2018 --to vot2018

    Exit codes: 0 success; 2 invalid usage, or a sequence could not be downloaded.
    """
    from trackmark.datasets.download import (
        BrokenConnectionError,
        DownloadError,
        download,
        find_items,
        read_sources,
    )
    from trackmark.datasets.spec_string import name_hint

    sources = read_sources()
    if (source := sources.get(set_name)) is None:
        hint = name_hint(set_name, sources)
        raise click.UsageError(f"unknown data set {set_name!r}.{hint}")
    if source.steps:
        click.echo(wrap(f"page   {source.page}\nsize   {source.size}\nsteps  {source.steps}"))
        return 0
    if folder is None:
        raise click.UsageError(f"--to is missing ({set_name}: {source.size}).")
    folder.mkdir(parents=True, exist_ok=True)
    failed = 0
    for item in find_items(source, names, folder):
        try:
            with progress_bar(item.name, None, "byte") as progress:
                is_new = download(source, item, folder, progress)
            click.echo(f"{item.name}  {'downloaded' if is_new else 'exists'}")
        except BrokenConnectionError:
            raise
        except DownloadError as error:
            print_error(str(error))
            failed += 1
    return EXIT_WRONG_INPUT if failed else 0
