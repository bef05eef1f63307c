"""Tables of a command as files in every format, and the list of files that it prints."""

from collections import Counter
from collections.abc import Collection, Iterable
from pathlib import Path

from trackmark.bench.output_files import write_file
from trackmark.reports.renderers import FORMATS
from trackmark.reports.tables import Table


def write_tables(folder: Path, tables: Iterable[Table]) -> list[Path]:
    """Write tables into a folder, one file per table and format; return the files.

    Raises `OSError` if a file cannot be written.
    """
    return [
        write_file(folder / f"{table.name}{suffix}", render(table))
        for table in tables
        for suffix, render in FORMATS.values()
    ]


def list_written_files(paths: Collection[Path], first: str = "report.html") -> list[str]:
    """Return lines that name the file to open first and count the other files by suffix.

    >>> list_written_files([Path("a/b.csv"), Path("a/c.png"), Path("a/c.txt")], "c.txt")
    ['a/c.txt', 'In its folder: 1 .csv, 1 .png.']
    """
    opened = [path for path in paths if path.name == first]
    other_files = [path for path in paths if path.name != first]
    counts = Counter(path.suffix for path in other_files)
    where = "In its folder" if opened else other_files and other_files[0].parent
    counted = ", ".join(f"{n} {suffix}" for suffix, n in counts.items())
    return [*map(str, opened), *([f"{where}: {counted}."] if other_files else [])]
