"""Readers of recorded data: a file here is a format."""

import importlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, Protocol, cast, runtime_checkable

from datasets.decoding import brief
from datasets.interface import Sequence, SequenceError
from datasets.text_form import natural_order

__all__ = [
    "Choosing",
    "Collecting",
    "Reader",
    "Splitting",
    "each",
    "knows",
    "options",
    "read",
    "sequences_in",
    "taken_for",
]

_NAMED = 4
"""Files of an unknown layout that are named."""


class Reader(Protocol):
    """What a module in this folder defines.

    Attributes
    ----------
    EXPECTS : str
        What the format looks like on disk, for messages.
    GENERAL : bool
        Whether the reader takes what others know better; such readers are asked last.

    A module may also have `CITATION`, the paper of a benchmark, and `LICENCE`, what its makers say
    of its use: both become fields of the sequences (`Origin`).
    """

    EXPECTS: str
    GENERAL: bool

    def recognises(self, path: Path) -> bool:
        """Whether what lies there looks like this format; reads no image."""
        ...

    def read(self, path: Path, truth: Path | None) -> Sequence:
        """Open the sequence, with an explicit truth file or its own. Reads no image."""
        ...


@runtime_checkable
class Choosing(Protocol):
    """What a reader offers besides, whose data hold several targets."""

    def options(self, path: Path) -> list[dict[str, Any]]:
        """What can be chosen of what lies there; see `datasets.options`."""
        ...

    def read(
        self, path: Path, truth: Path | None, chosen: Mapping[str, str] | None = None
    ) -> Sequence:
        """Open the sequence of what is chosen; see `Reader.read`."""
        ...


@runtime_checkable
class Collecting(Protocol):
    """What a reader offers besides, whose sequences don't lie directly in their folder."""

    def members(self, folder: Path) -> list[Path]:
        """Paths of the sequences in a folder of this format; none where it is of another."""
        ...


@runtime_checkable
class Splitting(Protocol):
    """What a reader offers besides, of whose paths one may be several sequences."""

    def each(self, path: Path) -> list[Path]:
        """Paths of all sequences that lie there, options behind them."""
        ...


def knows(path: Path) -> bool:
    """Whether a reader knows the path; some know names of what lies elsewhere."""
    return _reader(path) is not None


def taken_for(path: Path) -> str:
    """What a path is taken for: its reader's `EXPECTS`; empty where no reader knows it."""
    reader = _reader(path)
    return "" if reader is None else reader.EXPECTS


def each(path: Path) -> list[Path]:
    """Paths of the sequences that lie at a path: itself, or several targets; none if unknown."""
    reader = _reader(path)
    with _looking(path):
        return (
            [] if reader is None else reader.each(path) if isinstance(reader, Splitting) else [path]
        )


def sequences_in(folder: Path) -> list[Path]:
    """Paths of the sequences that lie in a folder, in natural order of their names.

    Where none does, those in its folders: of GOT-10k's `val` and `test`, of one's own data sets.

    Raises
    ------
    SequenceError
        For a folder that can't be read.
    """
    return _directly_in(folder) or [
        path for place in _inside(folder) for path in _directly_in(place)
    ]


def _directly_in(folder: Path) -> list[Path]:
    for reader in _readers():
        if isinstance(reader, Collecting) and (members := reader.members(folder)):
            return members
    return [sequence for path in _inside(folder) for sequence in each(path)]


def _inside(folder: Path) -> list[Path]:
    """What is in a folder, in natural order of names; nothing in a file."""
    with _looking(folder):
        inside = folder.iterdir() if folder.is_dir() else ()
        return sorted(inside, key=lambda path: natural_order(path.name))


def options(path: Path) -> list[dict[str, Any]]:
    """What can be chosen of recorded data, as `datasets.options` tells it.

    Raises
    ------
    SequenceError
        Where the data can't be read.
    """
    reader = _reader(path)
    with _looking(path):
        return reader.options(path) if isinstance(reader, Choosing) else []


def read(
    path: Path, truth: Path | None = None, chosen: Mapping[str, str] | None = None
) -> Sequence:
    """Open recorded data with the reader that knows it.

    Parameters
    ----------
    path : Path
        A file or folder, or what a reader knows as a name.
    truth : Path, optional
        Truth file (CSV) that wins over the data's own truth.
    chosen : mapping of str to str, optional
        Some of the `options` and their values.

    Raises
    ------
    SequenceError
        Where no reader knows the path or an option, or the one that does can't read it.
    """
    reader = _reader(path)
    if reader is None:
        raise SequenceError(_unknown(path))
    known = [option["name"] for option in options(path)] if chosen else []
    unknown = sorted((chosen or {}).keys() - known)
    if unknown:
        raise SequenceError(
            f"{path}: unknown option {brief(unknown[0])}. Known: {', '.join(known) or 'none'}."
        )
    with _looking(path):
        if chosen and isinstance(reader, Choosing):
            sequence = reader.read(path, truth, chosen)
        else:
            sequence = reader.read(path, truth)
        sequence.origin = replace(
            sequence.origin,
            format=reader.EXPECTS,
            licence=_licence(path) or getattr(reader, "LICENCE", ""),
            citation=getattr(reader, "CITATION", ""),
        )
    return sequence


def _unknown(path: Path) -> str:
    """What lies at a path that no reader knows, and what was looked for: the nearest, if any."""
    there = [f"a file {path.suffix}".rstrip()]
    if path.is_dir():
        with _looking(path):
            there = sorted(file.name + "/" * file.is_dir() for file in path.iterdir())
    expected = [reader.EXPECTS for reader in _readers()]
    near = [text for text in expected if set(there) & set(text.replace(",", "").split())]
    named = ", ".join(there[:_NAMED]) or "nothing in it"
    more = f" and {len(there) - _NAMED} more" if len(there) > _NAMED else ""
    return (
        f"{path}: this is nothing that a reader knows: there is {brief(named)}{more}. "
        f"Expected is {'; '.join(near or expected)}."
    )


def _licence(path: Path) -> str:
    """Name of a licence's file in the folder of a sequence; empty where there is none."""
    names = sorted(file.name for file in path.iterdir()) if path.is_dir() else []
    found = (name for name in names if name.upper().startswith(("LICENSE", "LICENCE", "COPYING")))
    return next((f"see {path / name}" for name in found), "")


def _reader(path: Path) -> Reader | None:
    """The reader that knows a path."""
    with _looking(path):
        return next((reader for reader in _readers() if reader.recognises(path)), None)


@contextmanager
def _looking(path: Path) -> Iterator[None]:
    """Tell what can't be looked at, or goes away meanwhile, in the path's name."""
    try:
        yield
    except OSError as error:
        where = error.filename or path
        raise SequenceError(
            f"{brief(str(where))}: this can't be read ({error.strerror})."
        ) from None


@cache
def _readers() -> tuple[Reader, ...]:
    stems = sorted(file.stem for file in Path(__file__).parent.glob("*.py"))
    modules = [
        cast(Reader, importlib.import_module(f"datasets.readers.{stem}"))
        for stem in stems
        if stem != "__init__"
    ]
    return tuple(sorted(modules, key=lambda reader: reader.GENERAL))
