"""Files of a report: tables in every format, file names, and a list of the files."""

import hashlib
from collections import Counter
from collections.abc import Collection, Iterable
from functools import partial
from pathlib import Path

from trackmark.reports.files import write_file
from trackmark.reports.renderers import FORMATS
from trackmark.reports.tables import Table

_MAX_NAME_LENGTH = 200  # bytes, up to four per character; file systems allow 255


def write_tables(folder: Path, tables: Iterable[Table]) -> list[Path]:
    """Write tables into a folder, one file per table and format; return the files.

    Raises `OSError` if a file cannot be written.
    """
    return [
        write_file(
            folder / f"{table.name}{suffix}",
            partial(Path.write_text, data=render(table), encoding="utf-8"),
        )
        for table in tables
        for suffix, render in FORMATS.values()
    ]


def file_names(labels: Iterable[str]) -> dict[str, str]:
    """Return file names by label: characters except letters, digits, dots and dashes become dashes.

    Names that are too long, or equal except for case, end in a digest.
    """
    names = {
        label: "".join(sign if sign.isalnum() or sign in ".-" else "-" for sign in label)
        for label in labels
    }
    equal = Counter(name.casefold() for name in names.values())
    for label, name in names.items():
        if equal[name.casefold()] > 1 or len(name.encode()) > _MAX_NAME_LENGTH:
            digest = hashlib.sha256(label.encode("utf-8", "surrogateescape")).hexdigest()[:6]
            names[label] = f"{name[: _MAX_NAME_LENGTH // 4]}-{digest}"
    return names


def list_written_files(paths: Collection[Path], first: str = "report.html") -> list[str]:
    """Return lines that name the file to open first and count the other files by suffix.

    >>> list_written_files([Path("a/b.csv"), Path("a/c.png"), Path("a/c.txt")], "c.txt")
    ['a/c.txt', 'In its folder: 1 .csv, 1 .png.']
    """
    opened = [path for path in paths if path.name == first]
    others = [path for path in paths if path.name != first]
    counts = Counter(path.suffix for path in others)
    where = "In its folder" if opened else others and others[0].parent
    texts = ", ".join(f"{number} {suffix}" for suffix, number in counts.items())
    return [*map(str, opened), *([f"{where}: {texts}."] if others else [])]
