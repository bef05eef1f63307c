"""Files of a report in a folder: tables in every format, and names of files."""

import hashlib
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Sequence
from pathlib import Path

from trackmark.reports.files import write_file
from trackmark.reports.renderers import FORMATS
from trackmark.reports.tables import Table

_FIGURES = {".png", ".svg", ".pdf"}

_LONGEST_NAME = 200  # bytes, of which a sign takes four at most; file systems take 255


def write_tables(
    folder: Path, tables: Sequence[Table], formats: Iterable[str] = FORMATS
) -> list[Path]:
    """Write tables into a folder, one file a table and format.

    Raises
    ------
    OSError
        Where a file can't be written.
    """

    def write(table: Table, suffix: str, render: Callable[[Table], str]) -> Path:
        text = render(table)
        path = folder / f"{table.name}{suffix}"
        return write_file(path, lambda file: file.write_text(text, encoding="utf-8"))

    return [write(table, *FORMATS[name]) for table in tables for name in formats]


def file_names(labels: Iterable[str]) -> dict[str, str]:
    """Labels as names of files: what is no letter, digit, dot or dash becomes a dash.

    Those that would be equal then, if only but for capitals, or too long, end in a digest.
    """
    names = {
        label: "".join(sign if sign.isalnum() or sign in ".-" else "-" for sign in label)
        for label in labels
    }
    equal = Counter(name.casefold() for name in names.values())
    for label, name in names.items():
        if equal[name.casefold()] > 1 or len(name.encode()) > _LONGEST_NAME:
            digest = hashlib.sha256(label.encode("utf-8", "surrogateescape")).hexdigest()[:6]
            names[label] = f"{name[: _LONGEST_NAME // 4]}-{digest}"
    return names


def what_was_written(paths: Collection[Path], first: str = "report.html") -> list[str]:
    """Say which file is to be opened first, and how many of which kind lie beside it.

    >>> what_was_written([Path("a/b.csv"), Path("a/c.png"), Path("a/c.txt")], "c.txt")
    ['a/c.txt', 'Beside it: 1 table as .txt, .md, .csv and .tex, 1 picture (.png).']
    """
    if not paths:
        return []
    opened = next((path for path in paths if path.name == first), None)
    tables = {path.stem for path in paths if path.suffix == ".csv"}
    pictures = Counter(path.suffix for path in paths if path.suffix in _FIGURES)
    parts = [f"{_counted(len(tables), 'table')} as .txt, .md, .csv and .tex"] if tables else []
    parts += [f"{_counted(number, 'picture')} ({kind})" for kind, number in pictures.items()]
    frames = [path for path in paths if path.suffix == ".js"]
    parts += [f"{_counted(len(frames), 'file')} of frames"] if frames else []
    parts += [
        path.name
        for path in paths
        if path not in (opened, *frames) and not (path.stem in tables or path.suffix in _FIGURES)
    ]
    where = "Beside it" if opened else next(iter(paths)).parent
    lines = [str(opened)] if opened else []
    return [*lines, *([f"{where}: {', '.join(parts)}."] if parts else [])]


def _counted(count: int, thing: str) -> str:
    return f"{count} {thing}{'s' * (count != 1)}"
