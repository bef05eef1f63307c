"""Download a data set from its public addresses."""

from dataclasses import dataclass
from pathlib import Path

import click

from trackmark.bench.commands import EXIT_WRONG_INPUT
from trackmark.bench.commands._options import Command, argument, option, with_options
from trackmark.bench.commands._progress import progress_bar
from trackmark.bench.commands._terminal import print_error
from trackmark.reports.printable import wrap


@dataclass(frozen=True, kw_only=True)
class DownloadOptions:
    """Options of the command."""

    set_name: str = argument(metavar="SET")
    names: tuple[str, ...] = argument(nargs=-1, required=False, metavar="[NAMES]…")
    to: Path | None = option(
        "Folder to which the sequences are written; it is created if necessary.",
        metavar="FOLDER",
        type=click.Path(path_type=Path, file_okay=False),
    )


@click.command("download", cls=Command)
@with_options(DownloadOptions)
def command(options: DownloadOptions) -> int:
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
    if (source := sources.get(options.set_name)) is None:
        hint = name_hint(options.set_name, sources)
        raise click.UsageError(f"unknown data set {options.set_name!r}.{hint}")
    if source.steps:
        click.echo(wrap(f"page   {source.page}\nsize   {source.size}\nsteps  {source.steps}"))
        return 0
    if options.to is None:
        raise click.UsageError(f"--to is missing ({options.set_name}: {source.size}).")
    options.to.mkdir(parents=True, exist_ok=True)
    failed = 0
    for item in find_items(source, options.names, options.to):
        try:
            with progress_bar(item.name, None, "byte") as progress:
                is_new = download(source, item, options.to, progress)
            click.echo(f"{item.name}  {'downloaded' if is_new else 'exists'}")
        except BrokenConnectionError:
            raise
        except DownloadError as error:
            print_error(str(error))
            failed += 1
    return EXIT_WRONG_INPUT if failed else 0
