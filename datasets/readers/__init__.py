"""Readers of recorded data: a file here is a format."""

import importlib
from functools import cache
from pathlib import Path
from typing import Protocol, cast

from datasets.interface import Sequence, SequenceError

__all__ = ["Reader", "read"]


class Reader(Protocol):
    """What a module in this folder defines.

    Attributes
    ----------
    EXPECTS : str
        What the format looks like on disk, for messages.
    GENERAL : bool
        Whether the reader takes what others know better; such readers are asked last.
    """

    EXPECTS: str
    GENERAL: bool

    def recognises(self, path: Path) -> bool:
        """Whether what lies there looks like this format; reads no image."""
        ...

    def read(self, path: Path, truth: Path | None) -> Sequence:
        """Open the sequence, with an explicit truth file or its own. Reads no image."""
        ...


def read(path: Path, truth: Path | None = None) -> Sequence:
    """Open recorded data with the reader that knows it.

    Parameters
    ----------
    path : Path
        An existing file or folder.
    truth : Path, optional
        Truth file (CSV) that wins over the data's own truth.

    Raises
    ------
    SequenceError
        Where no reader knows the path, or the one that does can't read it.
    """
    for reader in _readers():
        if reader.recognises(path):
            return reader.read(path, truth)
    expected = "; ".join(reader.EXPECTS for reader in _readers())
    raise SequenceError(f"{path}: this is nothing that a reader knows. Expected is {expected}.")


@cache
def _readers() -> tuple[Reader, ...]:
    stems = sorted(file.stem for file in Path(__file__).parent.glob("*.py"))
    modules = [
        cast(Reader, importlib.import_module(f"datasets.readers.{stem}"))
        for stem in stems
        if stem != "__init__"
    ]
    return tuple(sorted(modules, key=lambda reader: reader.GENERAL))
