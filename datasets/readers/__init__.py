"""Readers of recorded data: a file here is a format."""

import importlib
import os
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from copy import copy
from dataclasses import replace
from fnmatch import fnmatchcase
from functools import cache
from glob import escape
from pathlib import Path
from typing import Any, NamedTuple, Protocol, cast, runtime_checkable

from trackmark.datasets.decoding import LIMIT, quote
from trackmark.datasets.file_digest import TICK_NS
from trackmark.datasets.image_files import ImageFiles
from trackmark.datasets.interface import Sequence, SequenceError
from trackmark.datasets.spec_string import natural_order
from trackmark.datasets.truth_file import read_text

__all__ = [
    "Choosing",
    "Collecting",
    "Reader",
    "Splitting",
    "formats",
    "holds_masks",
    "knows",
    "options",
    "path_format",
    "read",
    "sequence_paths",
    "sequences_in",
]

# Names of the sequences that belong to a data set, as VOT and GOT-10k have it in its folder.
LIST = "list.txt"
_DEPTH = 3  # levels of folders in which sequences are looked for: of `LaSOT/dog/dog-1` two
_NAMED = 4  # files of an unknown layout that are named


class Reader(Protocol):
    """What a module in this folder defines."""

    EXPECTS: str  # what the format looks like on disk, for messages
    GENERAL: bool  # whether the reader takes what others know better; such readers are asked last
    # patterns of what lies in a sequence's folder and shows this format, those of folders with a
    # `/` behind them; `NAME` is the folder's own name. A folder that has any, and that no reader
    # knows, is a sequence that isn't whole
    MARKS: tuple[str, ...]

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

    def list_members(self, folder: Path) -> list[Path]:
        """Paths of the sequences in a folder of this format; none where it is of another.

        Those whose images or truth are missing are among them.
        """
        ...


@runtime_checkable
class Splitting(Protocol):
    """What a reader offers besides, of whose paths one may be several sequences."""

    def list_sequences(self, path: Path) -> list[Path]:
        """Paths of all sequences that lie there, options behind them."""
        ...


def formats() -> dict[str, str]:
    """What each reader looks for, by its name, sorted."""
    return {stem: importlib.import_module(f"{__name__}.{stem}").EXPECTS for stem in _stems()}


def knows(path: Path) -> bool:
    """Whether a reader knows the path; some know names of what lies elsewhere."""
    return _reader(path) is not None


def path_format(path: Path) -> str:
    """What a path is taken for: its reader's `EXPECTS`; empty where no reader knows it."""
    reader = _reader(path)
    return "" if reader is None else reader.EXPECTS


def sequence_paths(path: Path) -> list[Path]:
    """Paths of the sequences that lie at a path: itself, or several targets; none if unknown."""
    reader = _reader(path)
    with _looking(path):
        return (
            []
            if reader is None
            else reader.list_sequences(path)
            if isinstance(reader, Splitting)
            else [path]
        )


def sequences_in(folder: Path, pattern: str = "*") -> list[Path]:
    """Paths of the sequences in a folder and its folders, down to `_DEPTH`, in natural order.

    There are none within a sequence, nor where names begin with a dot. Where sequences lie beside a
    `list.txt`, only those that it names belong.

    `folder`: What is no sequence itself; in a file there are none. `pattern`: Of names, with `*`
    and `?`: other sequences are left out. Raises `SequenceError` for what can't be read, for a
    sequence that isn't whole, and where `list.txt` names one that isn't there: none is left out in
    silence.
    """
    with _looking(folder):
        if _marked(folder):
            raise _not_whole(_unknown(folder))
        return list(_walk(folder, pattern, _DEPTH))


def holds_masks(path: Path) -> bool:
    """Whether a path leads into the masks of a copy of DAVIS, which are no images of a sequence."""
    folders = (place for place in (path, *path.parents) if place.name == "Annotations")
    return any(place.with_name("JPEGImages").is_dir() for place in folders)


def _walk(folder: Path, pattern: str, depth: int) -> Iterator[Path]:
    belonging, expected = _members(folder)
    if not belonging:
        belonging, expected = _listed(folder), f"what {folder / LIST} names"
    for place in belonging or _inside(folder):
        found = sequence_paths(place)
        marked = not found and _marked(place)
        if not (found or belonging or marked):
            if depth > 1 and place.is_dir():
                yield from _walk(place, pattern, depth - 1)
        elif fnmatchcase(place.name, pattern):
            if not found:
                missing = f"{place}: its images or its truth are missing. Expected is {expected}."
                raise _not_whole(_unknown(place) if marked else missing)
            yield from found


def _members(folder: Path) -> tuple[list[Path], str]:
    """Sequences of a format that lie elsewhere than in their folder, and what it expects."""
    for reader in _readers():
        if isinstance(reader, Collecting) and (members := reader.list_members(folder)):
            return members, reader.EXPECTS
    return [], ""


def _listed(folder: Path) -> list[Path]:
    """What a data set's own list names; nothing where it has none, or holds no sequence itself."""
    names = folder / LIST
    inside = {path.name: path for path in _inside(folder)} if names.is_file() else {}
    if not any(map(knows, inside.values())):
        return []
    listed = [line.strip() for line in read_text(names).splitlines() if line.strip()]
    for line, name in enumerate(listed, 1):
        if name not in inside:
            raise SequenceError(
                f"{names}: line {line}: {quote(name)} is not in this folder. Get it, or remove the "
                "line, or name the sequences that you want (a pattern will do)."
            )
    return [path for name, path in inside.items() if name in set(listed)]


def _not_whole(wrong: str) -> SequenceError:
    """The refusal of a sequence that lacks something, where all of a folder are asked for."""
    return SequenceError(
        f"{wrong} Supply what is missing, or move it away, or name the other sequences (a pattern "
        "will do)."
    )


def _marked(path: Path) -> list[str]:
    """What there is in a folder that shows formats of sequences."""
    return sorted({mark for reader in _readers() for mark in _marks(path, reader)})


def _marks(path: Path, reader: Reader) -> list[str]:
    """What there is of a format's marks in a folder: names, of folders with a `/`."""
    found = [
        (place, mark.endswith("/"))
        for mark in reader.MARKS
        for place in path.glob(mark.replace("NAME", escape(path.name)))
    ]
    return [
        place.relative_to(path).as_posix() + "/" * is_folder
        for place, is_folder in found
        if place.is_dir() == is_folder
    ]


def _inside(folder: Path) -> list[Path]:
    """What is in a folder but for what is hidden and masks, in natural order; nothing in a file."""
    with _looking(folder):
        inside = [
            path
            for path in (folder.iterdir() if folder.is_dir() else ())
            if not path.name.startswith(".") and not holds_masks(path)
        ]
        return sorted(inside, key=lambda path: natural_order(path.name))


def options(path: Path) -> list[dict[str, Any]]:
    """What can be chosen of recorded data, as `datasets.options` tells it.

    Raises `SequenceError` where the data can't be read.
    """
    reader = _reader(path)
    with _looking(path):
        return reader.options(path) if isinstance(reader, Choosing) else []


def read(
    path: Path, truth: Path | None = None, chosen: Mapping[str, str] | None = None
) -> Sequence:
    """Open recorded data with the reader that knows it; once while its files do not change.

    `path`: A file or folder, or what a reader knows as a name. `truth`: Truth file (CSV) that wins
    over the data's own truth. `chosen`: Some of the `options` and their values. Raises
    `SequenceError` where no reader knows the path or an option, or the one that does can't read it.
    """
    options = tuple(sorted((chosen or {}).items()))
    key = (Path.cwd(), path, truth, options, os.environ.get(LIMIT))
    kept = _KEPT.get(key)
    if kept is None or kept.stamps != _stamps(kept.sequence, path):
        _KEPT.pop(key, None)
        started = time.time_ns()
        sequence = _read(path, truth, chosen)
        kept = _Kept(sequence, _stamps(sequence, path))
        if max(changed for _, changed in kept.stamps.values()) < started - TICK_NS:
            _KEPT[key] = kept
            if len(_KEPT) > _MOST_KEPT:
                del _KEPT[next(iter(_KEPT))]
    sequence = copy(kept.sequence)  # callers replace frames, and a video's frames hold a position
    sequence.frames = copy(sequence.frames)
    return sequence


class _Kept(NamedTuple):
    """Sequence that was opened, and what its files were like then."""

    sequence: Sequence
    stamps: dict[str, tuple[int, int]]  # size and time of change [ns] by path


_KEPT: dict[tuple[object, ...], _Kept] = {}
_MOST_KEPT = 64


def _stamps(sequence: Sequence, path: Path) -> dict[str, tuple[int, int]]:
    """Return size and time of change of all that a sequence was read from, folders' entries too."""
    places = [path, Path(sequence.truth_source)]
    if path.is_file():
        places += list(path.parent.glob(f"{escape(path.stem)}.*"))
    if isinstance(sequence.frames, ImageFiles):
        places.append(sequence.frames.files[0].parent)
    stamps = {}
    with _looking(path):
        for place in {place for place in places if place.exists()}:
            found = [place, *(os.scandir(place) if place.is_dir() else ())]
            for entry in found:
                status = entry.stat()
                stamps[os.fspath(entry)] = status.st_size, status.st_mtime_ns
    return stamps


def _read(path: Path, truth: Path | None, chosen: Mapping[str, str] | None) -> Sequence:
    reader = _reader(path)
    if reader is None:
        raise SequenceError(_unknown(path))
    known = [option["name"] for option in options(path)] if chosen else []
    unknown = sorted((chosen or {}).keys() - known)
    if unknown:
        raise SequenceError(
            f"{path}: unknown option {quote(unknown[0])}. Known: {', '.join(known) or 'none'}."
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
    with _looking(path):
        if path.is_dir():
            there = sorted(file.name + "/" * file.is_dir() for file in path.iterdir())
        near = [reader.EXPECTS for reader in _readers() if _marks(path, reader)]
    expected = [reader.EXPECTS for reader in _readers()]
    named = quote(", ".join(there[:_NAMED])) if there else "nothing in it"
    more = f" and {len(there) - _NAMED} more" if len(there) > _NAMED else ""
    what = "no whole sequence" if near else "nothing that a reader knows"
    return (
        f"{path}: this is {what}: there is {named}{more}. "
        f"Expected is {'; '.join(near or expected)}."
    )


def _licence(path: Path) -> str:
    """A licence's file in a sequence's folder, or beside a video; empty where there is none."""
    folder = path if path.is_dir() else path.parent
    names = sorted(file.name for file in folder.iterdir()) if folder.is_dir() else []
    found = (name for name in names if name.upper().startswith(("LICENSE", "LICENCE", "COPYING")))
    return next((f"see {folder / name}" for name in found), "")


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
            f"{quote(str(where))}: this can't be read ({error.strerror})."
        ) from None


@cache
def _readers() -> tuple[Reader, ...]:
    """All readers, in the order in which they are asked."""
    modules = [cast(Reader, importlib.import_module(f"{__name__}.{stem}")) for stem in _stems()]
    return tuple(sorted(modules, key=lambda reader: reader.GENERAL))


def _stems() -> list[str]:
    return sorted(file.stem for file in Path(__file__).parent.glob("[a-z]*.py"))
