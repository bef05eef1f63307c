"""Readers of recorded data: `rows` reads what a layout describes, the other modules one format."""

import importlib
import os
import re
import time
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from copy import copy
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from glob import escape
from pathlib import Path
from typing import Any, NamedTuple, Protocol, cast

from trackmark.datasets.decoding import PIXEL_LIMIT_VARIABLE, quote
from trackmark.datasets.file_digest import TICK_NS, file_stamp
from trackmark.datasets.image_files import ImageFiles
from trackmark.datasets.interface import Sequence, SequenceError
from trackmark.datasets.layouts import LAYOUT_VARIABLE, Layout, layouts
from trackmark.datasets.readers.rows import RowsReader
from trackmark.datasets.recorded import Choice
from trackmark.datasets.spec_string import natural_order
from trackmark.datasets.truth_file import read_text

__all__ = [
    "Reader",
    "formats",
    "is_mask_path",
    "options",
    "path_format",
    "read",
    "sequence_paths",
    "sequences_in",
]

# file in a dataset's folder that lists the names of its sequences, as in VOT and GOT-10k
LIST = "list.txt"

# Names of files with flags per frame, whose meaning (1 for absent, or for present) differs.
_FLAG_NAME = re.compile(
    r"(^|[^a-z])(absent|absence|present|presence|occlusions?|occluded|(in)?visible|visibility|"
    r"out_?of_?view|exists?|lost|cover)([^a-z]|$)"
)
_FLAG_SUFFIXES = (".txt", ".csv", ".json", ".label", ".tag", ".npy", ".mat")

_ADD_FILES = "Add the missing files, or move the sequence to another folder."

_MAX_DEPTH = 3  # levels of folders that are searched; LaSOT has two: `LaSOT/dog/dog-1`
_MAX_LISTED = 4  # maximum number of entries of an unknown folder in a message
_MAX_CACHED = 64  # maximum number of cached sequences


class Reader(Protocol):
    """Functions of each module in this folder that reads a layout.

    Modules can have more functions. `choice(path)` returns the option of data with several targets
    or frame rates. `list_members(folder)` returns the sequences of a dataset that are not its
    subfolders, even incomplete ones. The constant `PATH_IS_ONE_TARGET` states that a path selects
    one target of many, and a folder or a pattern all of them.
    """

    def recognises(self, path: Path) -> bool:
        """Return whether the path has this format, without reading an image."""
        ...

    def read(self, path: Path, truth: Path | None, value: str) -> Sequence:
        """Open the sequence with the given ground-truth file, or its own; read no image.

        `value` is a value of the option, or "" for the default.
        """
        ...


def formats() -> dict[str, str]:
    """Return the layouts in words by name."""
    return {name: layout.in_words for name, layout in layouts().items()}


def path_format(path: Path) -> str:
    """Return the layout that the reader of a path expects, or "" if no reader recognises it.

    In some formats, a path is only a name and does not exist.
    """
    layout = _find_layout(path)
    return "" if layout is None else layout.in_words


def sequence_paths(path: Path, *, is_named: bool = False) -> list[Path]:
    """Return the path itself or one path per target; empty if no reader recognises the path.

    `is_named`: the user gave this path, and not a folder or a pattern that selects it.
    """
    layout = _find_layout(path)
    with _named_errors(path):
        if layout is None:
            return []
        reader = _reader(layout)
        if is_named and getattr(reader, "PATH_IS_ONE_TARGET", False):
            return [path]
        with suppress(SequenceError):  # the error is raised when the sequence is opened
            return [*_choice(path, reader).targets(path).values()] or [path]
        return [path]


def sequences_in(
    folder: Path, pattern: str = "*", excluded: Collection[str] = ()
) -> tuple[list[Path], dict[str, str]]:
    """Return the sequences in a folder and its subfolders, in natural order of their names.

    The second value has the messages on sequences that are incomplete, or missing although
    `list.txt` names them, by name.

    Folders inside a sequence and names that start with a dot are skipped. If there is a `list.txt`,
    only the sequences that it lists are returned.

    `pattern` is a pattern of sequence names with `*` and `?`; `excluded` are patterns of names that
    are left out, even if the sequences are incomplete.

    Raises `SequenceError` for an unreadable folder.
    """
    search = _Search(pattern, excluded)
    with _named_errors(folder):
        if _all_marks(folder):
            raise SequenceError(f"{_not_recognised(folder)} {_ADD_FILES}")
        return list(_walk(folder, search, _MAX_DEPTH)), search.problems


@dataclass(frozen=True)
class _Search:
    """Names that are searched in a folder, and the problems that were found."""

    pattern: str
    excluded: Collection[str]
    problems: dict[str, str] = field(default_factory=dict)  # message by name of the sequence

    def selects(self, name: str) -> bool:
        """Return whether a sequence of this name is searched."""
        return fnmatchcase(name, self.pattern) and not any(
            fnmatchcase(name, pattern) for pattern in self.excluded
        )


def is_mask_path(path: Path) -> bool:
    """Return whether a path leads into the masks of DAVIS, which are not images of a sequence."""
    folders = (folder for folder in (path, *path.parents) if folder.name == "Annotations")
    return any(folder.with_name("JPEGImages").is_dir() for folder in folders)


def _walk(folder: Path, search: _Search, depth: int) -> Iterator[Path]:
    members, expected = _list_members(folder)
    if not members:
        members, expected = _listed_members(folder, search), f"the sequences of {folder / LIST}"
    for path in members or _visible_paths(folder):
        sequences = sequence_paths(path)
        has_marks = not sequences and _all_marks(path)
        if not (sequences or members or has_marks):
            if depth > 1 and path.is_dir():
                yield from _walk(path, search, depth - 1)
        elif search.selects(path.name):
            if not sequences:
                missing = f"{path}: images or ground truth are missing. Expected: {expected}."
                problem = _not_recognised(path) if has_marks else missing
                search.problems[path.name] = f"{problem} {_ADD_FILES}"
            yield from sequences


def _list_members(folder: Path) -> tuple[list[Path], str]:
    """Return the sequences of a dataset with its own folder layout, and the expected layout."""
    for layout in layouts().values():
        reader = _reader(layout)
        if hasattr(reader, "list_members") and (members := reader.list_members(folder)):
            return members, layout.in_words
    return [], ""


def _listed_members(folder: Path, search: _Search) -> list[Path]:
    """Return the sequences that `list.txt` names; empty if there is no list."""
    names = folder / LIST
    members = {path.name: path for path in _visible_paths(folder)} if names.is_file() else {}
    if not any(map(path_format, members.values())):
        return []
    listed = [line.strip() for line in read_text(names).splitlines() if line.strip()]
    for line, name in enumerate(listed, 1):
        if name not in members and search.selects(name):
            search.problems[name] = (
                f"{names}: line {line}: {quote(name)} is not in this folder. Add it, or remove the "
                "line."
            )
    return [path for name, path in members.items() if name in set(listed)]


def _all_marks(path: Path) -> list[str]:
    """Return the entries of a folder that match a mark of any layout."""
    return sorted({mark for layout in layouts().values() for mark in _marks(path, layout)})


def _marks(path: Path, layout: Layout) -> list[str]:
    """Return the entries of a folder that match a mark of a layout; folders end with `/`."""
    matches = [
        (entry, mark.endswith("/"))
        for mark in layout.all_marks
        for entry in path.glob(mark.replace("NAME", escape(path.name)))
    ]
    return [
        entry.relative_to(path).as_posix() + "/" * is_folder
        for entry, is_folder in matches
        if entry.is_dir() == is_folder
    ]


def _visible_paths(folder: Path) -> list[Path]:
    """Return the visible entries of a folder in natural order, without masks; empty for a file."""
    with _named_errors(folder):
        visible = [
            path
            for path in (folder.iterdir() if folder.is_dir() else ())
            if not path.name.startswith(".") and not is_mask_path(path)
        ]
        return sorted(visible, key=lambda path: natural_order(path.name))


def options(path: Path) -> list[dict[str, Any]]:
    """Return the options of recorded data; see `datasets.options`.

    Raises `SequenceError` if the data cannot be read.
    """
    layout = _find_layout(path)
    with _named_errors(path):
        choice = Choice() if layout is None else _choice(path, _reader(layout))
        return [choice.description()] if choice.values else []


def read(
    path: Path, truth: Path | None = None, option_values: Mapping[str, str] | None = None
) -> Sequence:
    """Open recorded data with the reader that recognises the path.

    Opened sequences are cached while their files do not change.

    `path` is a file, a folder, or a name that a reader recognises. `truth` is a ground-truth file
    (CSV) that replaces the ground truth of the data. `option_values` contains values of `options`
    by name.

    Raises `SequenceError` if no reader recognises the path or an option, or if reading fails.
    """
    items = tuple(sorted((option_values or {}).items()))
    variables = map(os.environ.get, (PIXEL_LIMIT_VARIABLE, LAYOUT_VARIABLE))
    key = (Path.cwd(), path, truth, items, *variables)
    cached = _cache.get(key)
    if cached is None or cached.stamps != _stamps(cached.sequence, path):
        _cache.pop(key, None)
        started = time.time_ns()
        sequence = _read(path, truth, option_values or {})
        cached = _CachedSequence(sequence, _stamps(sequence, path))
        # A second change within a step of modification times would not be noticed.
        if max(changed for _, changed in cached.stamps.values()) < started - TICK_NS:
            _cache[key] = cached
            if len(_cache) > _MAX_CACHED:
                del _cache[next(iter(_cache))]
    # Callers must not share frames: the frames of a video have a decoding position.
    sequence = copy(cached.sequence)
    sequence.frames = copy(sequence.frames)
    return sequence


class _CachedSequence(NamedTuple):
    """Opened sequence, with size and modification time of its files when it was opened."""

    sequence: Sequence
    stamps: dict[str, tuple[int, int]]  # size [bytes] and modification time [ns] by path


_cache: dict[tuple[object, ...], _CachedSequence] = {}


def _stamps(sequence: Sequence, path: Path) -> dict[str, tuple[int, int]]:
    """Return size and modification time of all files and folders of a sequence."""
    roots = [path, Path(sequence.truth_source)]
    if path.is_file():
        roots += list(path.parent.glob(f"{escape(path.stem)}.*"))
    if isinstance(sequence.frames, ImageFiles):
        roots.append(sequence.frames.files[0].parent)
    stamps = {}
    with _named_errors(path):
        for root in {root for root in roots if root.exists()}:
            for file in [root, *(os.scandir(root) if root.is_dir() else ())]:
                stamps[os.fspath(file)] = file_stamp(file)
    return stamps


def _read(path: Path, truth: Path | None, option_values: Mapping[str, str]) -> Sequence:
    layout = _find_layout(path)
    if layout is None:
        raise SequenceError(_not_recognised(path))
    reader = _reader(layout)
    with _named_errors(path):
        value = _choice(path, reader).selected(path, option_values) if option_values else ""
        sequence = reader.read(path, truth, value)
        sequence.origin = replace(
            sequence.origin,
            format=layout.in_words,
            licence=_licence(path) or layout.licence,
            citation=layout.citation,
            unread_files=_unread_flags(path, layout),
            other_targets=() if option_values or truth else _other_targets(path, reader),
            first_pixel=layout.first_pixel,
        )
    return sequence


def _choice(path: Path, reader: Reader) -> Choice:
    """Return the option of recorded data; without values if there is none."""
    choice: Choice = reader.choice(path) if hasattr(reader, "choice") else Choice()
    return choice


def _other_targets(path: Path, reader: Reader) -> tuple[str, ...]:
    """Return the names of all targets of a recording but the one that is read by default."""
    choice = _choice(path, reader)
    targets = choice.targets(path).items()
    return tuple(target.name for value, target in targets if value != choice.default)


def _unread_flags(path: Path, layout: Layout) -> tuple[str, ...]:
    """Return the names of files with flags per frame in a sequence's folder that are not read."""
    read = [file.rpartition("/")[2] for file in (*layout.flags, layout.visibility)]
    return tuple(
        file.name
        for file in (_visible_paths(path) if path.is_dir() else ())
        if _FLAG_NAME.search(file.stem.lower())
        and file.suffix.lower() in _FLAG_SUFFIXES
        and not any(fnmatchcase(file.name, pattern) for pattern in read)
    )


def _not_recognised(path: Path) -> str:
    """Return the message for a path that no reader recognises, with similar layouts."""
    contained = ""
    with _named_errors(path):
        if path.is_dir():
            names = sorted(file.name + "/" * file.is_dir() for file in path.iterdir())
            listed = quote(", ".join(names[:_MAX_LISTED])) if names else "nothing"
            further = f" and {len(names) - _MAX_LISTED} more" if len(names) > _MAX_LISTED else ""
            contained = f" It contains {listed}{further}."
        similar = [layout.in_words for layout in layouts().values() if _marks(path, layout)]
    expected = "; ".join(similar or formats().values())
    if path.is_dir() and not similar:
        expected = "images with a ground-truth file, or a layout of `trackmark list formats`"
    problem = "an incomplete sequence" if similar else "not in a format that a reader recognises"
    return f"{path}: this is {problem}.{contained} Expected: {expected}."


def _licence(path: Path) -> str:
    """Return a reference to a licence file in a sequence's folder, or next to a video."""
    folder = path if path.is_dir() else path.parent
    names = sorted(file.name for file in folder.iterdir()) if folder.is_dir() else []
    licences = [
        name for name in names if name.upper().startswith(("LICENSE", "LICENCE", "COPYING"))
    ]
    return f"see {folder / licences[0]}" if licences else ""


def _find_layout(path: Path) -> Layout | None:
    """Return the layout of a path."""
    with _named_errors(path):
        full = path.resolve()
        for layout in layouts().values():
            # Resolving a path takes as long as all other work of a layout.
            if _reader(layout).recognises(path if layout.reader else full):
                return layout
        return None


@contextmanager
def _named_errors(path: Path) -> Iterator[None]:
    """Turn an `OSError` into a `SequenceError` that names the path."""
    try:
        yield
    except OSError as error:
        file = error.filename or path
        raise SequenceError(f"{quote(str(file))}: cannot be read ({error.strerror}).") from None


def _reader(layout: Layout) -> Reader:
    """Return the reader of a layout."""
    if not layout.reader:
        return RowsReader(layout)
    return cast(Reader, importlib.import_module(f"{__name__}.{layout.reader}"))
