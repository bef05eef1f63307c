"""Files of a report: tables in every format, file names, and a list of the files."""

import hashlib
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Sequence
from pathlib import Path

from trackmark.reports.files import write_file
from trackmark.reports.renderers import FORMATS
from trackmark.reports.tables import Table

_FIGURE_SUFFIXES = {".png", ".svg", ".pdf"}

_MAX_NAME_LENGTH = 200  # bytes, up to four per character; file systems allow 255


def write_tables(
    folder: Path, tables: Sequence[Table], formats: Iterable[str] = FORMATS
) -> list[Path]:
    """Write tables into a folder, one file per table and format; return the files.

    Raises `OSError` if a file cannot be written.
    """

    def write(table: Table, suffix: str, render: Callable[[Table], str]) -> Path:
        text = render(table)
        path = folder / f"{table.name}{suffix}"
        return write_file(path, lambda file: file.write_text(text, encoding="utf-8"))

    return [write(table, *FORMATS[name]) for table in tables for name in formats]


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
    """Return lines that name the file to open first and count the other files by kind.

    >>> list_written_files([Path("a/b.csv"), Path("a/c.png"), Path("a/c.txt")], "c.txt")
    ['a/c.txt', 'In its folder: 1 table as .txt, .md, .csv and .tex, 1 picture (.png).']
    """
    if not paths:
        return []
    opened = next((path for path in paths if path.name == first), None)
    tables = {path.stem for path in paths if path.suffix == ".csv"}
    pictures = Counter(path.suffix for path in paths if path.suffix in _FIGURE_SUFFIXES)
    parts = [f"{_count(len(tables), 'table')} as .txt, .md, .csv and .tex"] if tables else []
    parts += [f"{_count(number, 'picture')} ({kind})" for kind, number in pictures.items()]
    frames = [path for path in paths if path.suffix == ".js"]
    parts += [f"{_count(len(frames), 'file')} of frames"] if frames else []
    counted = {path for path in paths if path.stem in tables or path.suffix in _FIGURE_SUFFIXES}
    parts += [path.name for path in paths if path not in {opened, *frames, *counted}]
    where = "In its folder" if opened else next(iter(paths)).parent
    others = [f"{where}: {', '.join(parts)}."] if parts else []
    return [str(opened), *others] if opened else others


def _count(count: int, thing: str) -> str:
    return f"{count} {thing}{'s' * (count != 1)}"
