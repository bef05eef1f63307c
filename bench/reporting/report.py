"""A report in a folder: tables in every format, and pictures beside them."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from bench.reporting.by_preset import Scored
from bench.reporting.tables import title_of
from reports.tables import Table
from reports.write import write_tables

if TYPE_CHECKING:
    from bench.reporting.by_attribute import Shown


def write_report(
    experiment: Path,
    folder: Path,
    tell: Callable[[str], None],
    made: Sequence[Table],
    title: str = "",
    pictures: str | None = "png",
    scored: Sequence[Scored] = (),
    against: "Sequence[Shown]" = (),
) -> list[Path]:
    """Write the tables of an experiment into a folder, and pictures beside them; give the files.

    `title` heads plots; it is the experiment's own by default. `pictures`: format of plots, `png`,
    `svg` or `pdf`; None for no pictures (film strips are PNG). `tell` is given a sentence on every
    sequence that can't be drawn. `scored`: runs by other presets, whose curves are drawn;
    `against`: scores against attributes, likewise. Raises `ResultsError` if results cannot
    be read, `OSError` if the report cannot be written.
    """
    paths = write_tables(folder, made)
    if pictures is not None:
        from bench.reporting.pictures import write_pictures  # brings what draws

        suffix = f".{pictures}"
        paths += write_pictures(experiment, folder, tell, title, scored, suffix)
        for one in against:
            path = folder / f"{one.table.name}{suffix}"
            paths += one.drawn(path, title or title_of(experiment))
    return paths
