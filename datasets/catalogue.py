"""Catalogue of sequences: built-in names, paths of recorded data, patterns and options."""

from collections.abc import Collection, Iterable, Mapping
from contextlib import suppress
from difflib import get_close_matches
from fnmatch import fnmatchcase
from functools import cache
from glob import glob
from pathlib import Path
from pkgutil import resolve_name
from typing import Any, Protocol

from trackmark.datasets.decoding import check_name, quote
from trackmark.datasets.interface import (
    Sequence,
    SequenceError,
    SequenceMetadata,
    SequenceSize,
    UnusableSequencesError,
    sequence_metadata,
)
from trackmark.datasets.spec_string import close_match, natural_order, parse_text

SUITES = {
    "moreno2005": "trackmark.datasets.synthetic.moreno2005:SUITE",
    "multipart": "trackmark.datasets.synthetic.multipart:SUITE",
    "nguyen2002": "trackmark.datasets.synthetic.nguyen2002:SUITE",
    "nummiaro2003": "trackmark.datasets.synthetic.nummiaro2003:SUITE",
    "plain": "trackmark.datasets.synthetic.plain:SUITE",
    "samples": "trackmark.datasets.samples:SUITE",
    "stress": "trackmark.datasets.synthetic.multipart:SUITE",
    "wang2010": "trackmark.datasets.synthetic.wang2010:SUITE",
}
"""Suites by the first part of their names; a suite is imported when one of its names is used."""


class Suite(Protocol):
    """Source of built-in sequences: the samples, or synthetic sequences."""

    def names(self) -> list[str]:
        """Return the full names, `suite/sequence`."""
        ...

    def options(self, name: str) -> list[dict[str, Any]]:
        """Return the options of a sequence: dicts with `name`, `default` and `meaning`."""
        ...

    def sequence_size(self, name: str) -> SequenceSize:
        """Return the length and image size of a sequence with default options."""
        ...

    def describe(self, name: str) -> SequenceMetadata:
        """Return the metadata of a sequence with default options."""
        ...

    def name_and_fingerprint(self, name: str, options: Mapping[str, str]) -> tuple[str, str]:
        """Return name and fingerprint of the sequence that `load` opens; exceptions are equal."""
        ...

    def load(self, name: str, options: Mapping[str, str]) -> Sequence:
        """Open a sequence with these options."""
        ...


def names() -> list[str]:
    """List the built-in sequences, sorted."""
    return sorted(name for suite in suites() for name in suite.names())


def suites() -> list[Suite]:
    """Import all suites and return each of them once; no renderer is loaded."""
    return [resolve_name(path) for path in dict.fromkeys(SUITES.values())]


def sequence_size(name: str) -> SequenceSize:
    """Return the length and image size of a built-in sequence without opening it.

    Raises
    ------
    SequenceError
        If the name is not one of `names()`.
    """
    suite = _find_suite(name)
    if suite is None:
        raise _unknown_sequence(name, _checked_path(name))
    return suite.sequence_size(name)


def describe(name_or_path: str | Path, truth: str | Path | None = None) -> SequenceMetadata:
    """Return the metadata of a sequence; parameters and exceptions are as in `load`.

    Metadata of synthetic sequences with default options are stored. Other sequences are opened.
    """
    spec = str(name_or_path)
    suite = _find_suite(spec) if isinstance(name_or_path, str) and truth is None else None
    if suite is not None:
        return suite.describe(spec)
    return sequence_metadata(load(name_or_path, truth))


def name_and_fingerprint(spec: str) -> tuple[str, str]:
    """Return name and fingerprint of the sequence that `load` opens; exceptions are as in `load`.

    Synthetic sequences without filters are not opened, because opening can take a second.
    """
    name = spec.partition(":")[0]
    suite = _find_suite(name)
    if suite is not None and not _split_filters(spec)[1]:
        return suite.name_and_fingerprint(name, _options_in(spec))
    sequence = load(spec)
    return sequence.name, sequence.fingerprint


def options(name: str) -> list[dict[str, Any]]:
    """Return the options of a sequence, which are set by `name:key=value`.

    Returns
    -------
    list of dict
        `name`, `default` and `meaning` (unit in brackets); empty without options.
    """
    bare = name.partition(":")[0]
    suite = _find_suite(bare)
    if suite is not None:
        return suite.options(bare)
    from trackmark.datasets import readers

    return readers.options(_split_path(name)[0])


def is_built_in(spec: str) -> bool:
    """Return whether `load` reads a specification as a built-in sequence, not as a path."""
    return _find_suite(spec.partition(":")[0]) is not None


def path_format(spec: str) -> str:
    """Return the file layout of a path in words; empty for a built-in name or an unknown layout.

    Raises `SequenceError` if the path cannot be read.
    """
    spec, _ = _split_filters(spec)
    if is_built_in(spec):
        return ""
    from trackmark.datasets import readers

    return readers.path_format(_split_path(spec)[0])


def matching(spec: str, excluded: Collection[str] = ()) -> list[str]:
    """Return the sequences that a name, path, pattern, suite or folder selects.

    Parameters
    ----------
    spec : str
        Name or path as for `load`; a pattern with `*` and `?` of built-in names (also with
        options) or of paths; or a suite or folder, for all sequences in it.
    excluded : collection of str
        Patterns of the names of recorded sequences that are left out, even if they are incomplete:
        names of folders or files, such as `car1`.

    Returns
    -------
    list of str
        At least one sequence, sorted by name.

    Raises
    ------
    SequenceError
        For a pattern that matches no sequence, and for incomplete sequences in a folder, of which
        the message names all.
    """
    bare, filters = _split_filters(spec)
    if filters:
        from trackmark.datasets.filters import with_filters

        return [with_filters(name, filters) for name in matching(bare, excluded)]
    if is_built_in(spec):
        return [spec]
    pattern, colon, options = spec.partition(":")
    if not any(sign in spec for sign in "*?"):
        pattern = f"{pattern.rstrip('/')}/*"
    built_in = [f"{name}{colon}{options}" for name in names() if fnmatchcase(name, pattern)]
    return built_in or _paths_matching(spec, excluded)


def _paths_matching(spec: str, excluded: Collection[str]) -> list[str]:
    """Return the paths of recorded data that a specification selects; see `matching`."""
    from trackmark.datasets import readers

    path, options = _split_path(spec)
    is_pattern = any(sign in spec for sign in "*?") and not path.exists()
    # For a name that is too long, Path.glob raises an error, but glob.glob returns no match.
    matches = [Path(name) for name in glob(str(path))] if is_pattern else [path]  # noqa: PTH207
    if is_pattern:
        matches = [
            match
            for match in matches
            if not readers.is_mask_path(match)
            and not any(fnmatchcase(match.name, name) for name in excluded)
        ]
    paths: list[str] = []
    errors: dict[str, str] = {}
    for match in sorted(matches, key=lambda match: natural_order(str(match))):
        try:
            sequences = readers.sequence_paths(match, is_named=not is_pattern)
            if not sequences:
                sequences, problems = readers.sequences_in(match, excluded=excluded)
                errors |= problems
            paths += map(str, sequences)
        except SequenceError as error:
            if not is_pattern:
                raise
            errors[match.name] = str(error)
    if is_pattern and not (paths or errors):  # the sequences can be in subfolders
        sequences, errors = readers.sequences_in(path.parent, path.name, excluded)
        paths += map(str, sequences)
    if errors:
        n = len(errors) + len(paths)
        errors |= _errors_of(paths)
        raise UnusableSequencesError(errors, n)
    if paths and not options:
        return paths
    if not is_pattern:
        return [spec]  # `load` raises an error with the reason
    if paths:
        raise SequenceError(
            f"{quote(spec)}: a pattern of paths takes no options. Name each sequence with its "
            "options."
        )
    similar = ", ".join(get_close_matches(spec, names(), n=3, cutoff=0.5)) or "none"
    raise SequenceError(
        f"{quote(spec)} matches no sequence, and no file or folder that a reader recognises. "
        f"Similar built-in names: {similar} (`trackmark list sequences` lists all)."
    )


def _errors_of(paths: list[str]) -> dict[str, str]:
    """Return the errors of sequences that cannot be opened or run, by path."""
    errors = {}
    for path in paths:
        try:
            load(path).check_runnable()
        except SequenceError as error:
            errors[path] = str(error)
    return errors


def load(name_or_path: str | Path, truth: str | Path | None = None) -> Sequence:
    """Open a sequence; images are read or rendered on access.

    Parameters
    ----------
    name_or_path : str or Path
        One of `names()` with options after colons (`multipart/1:scene=2:light=even`), or the
        path of recorded data, also with options (`davis/bmx-trees:object=2`). Filters can follow
        (`:filter.noise=20`, see `datasets.filters`). A built-in name has priority over a path of
        the same text, unless the path is a `Path` or starts with `/`, `./` or `../`.
    truth : str or Path, optional
        CSV file `frame,x,y,width,height` that replaces the ground truth of recorded data.

    Raises
    ------
    SequenceError
        For an unknown name, option or path, and for data that cannot be read.

    Examples
    --------
    >>> load("samples/bow-tie")
    <Sequence samples/bow-tie: 120 frames>
    """
    spec = str(name_or_path)
    bare, filters = _split_filters(spec)
    if filters:
        from trackmark.datasets.filters import filtered  # imported here, because it loads OpenCV

        return filtered(load(type(name_or_path)(bare), truth), filters)
    name = spec.partition(":")[0]
    suite = _find_suite(name) if isinstance(name_or_path, str) else None
    if suite is not None:
        if truth is not None:
            raise SequenceError(
                f"{name}: built-in sequences have their own ground truth. Omit {truth}."
            )
        return suite.load(name, _options_in(spec))
    from trackmark.datasets import readers  # imported here, because it loads decoders

    path, options = _split_path(spec)
    if not path.exists() and not readers.path_format(path):
        raise _unknown_sequence(spec, Path(spec).expanduser())
    truth_file = None if truth is None else _checked_path(str(truth))
    if truth_file is not None and not truth_file.is_file():
        raise SequenceError(f"{truth_file}: this ground-truth file does not exist.")
    return readers.read(path, truth_file, options)


def _options_in(spec: str) -> dict[str, str]:
    """Return the options in the specification of a built-in sequence."""
    try:
        return parse_text(spec)[1]
    except ValueError as error:
        raise SequenceError(f"sequence {error}") from None


def _split_filters(spec: str) -> tuple[str, dict[str, float]]:
    """Split a specification into sequence and filters; an existing path has no filters."""
    if ":filter." not in spec or _checked_path(spec).exists():
        return spec, {}
    from trackmark.datasets.filters import split_filters

    return split_filters(spec)


def _split_path(spec: str) -> tuple[Path, dict[str, str]]:
    """Split a specification into path and options of recorded data; a path can contain colons."""
    path = _checked_path(spec)
    if path.exists() or ":" not in path.name:
        return path, {}
    try:
        name, options = parse_text(path.name)
    except ValueError:  # the colon is a part of the name
        return path, {}
    return path.parent / name, options


def _checked_path(spec: str) -> Path:
    """Convert a specification to a path, and check that its name is valid."""
    try:
        path = Path(spec).expanduser()
        check_name(path.absolute())
        path.resolve()
        path.exists()
    except RuntimeError as error:  # unknown home folder, or a loop of links
        raise SequenceError(f"{quote(spec)}: {error}") from None
    except OSError as error:
        raise SequenceError(f"{quote(spec)}: cannot be read ({error.strerror}).") from None
    return path


def _unknown_sequence(spec: str, path: Path) -> SequenceError:
    """Return the error for an unknown name or path, with the closest match."""
    siblings = path.parent.iterdir() if path.parent.is_dir() else ()
    candidates = [*names(), *map(str, siblings)]
    hint = close_match(spec.partition(":")[0], candidates)
    return SequenceError(
        f"unknown sequence {quote(spec)}.{hint} It is not a built-in name (`trackmark list` shows "
        f"them), and there is no file or folder {quote(str(path.absolute()))}."
    )


@cache
def _find_suite(name: str) -> Suite | None:
    """Return the suite of a built-in sequence, or None for other names."""
    path = SUITES.get(name.partition("/")[0])
    suite: Suite | None = resolve_name(path) if path else None
    return suite if suite is not None and name in suite.names() else None


EXCLUDES = "!"
"""First character of an item that excludes sequences."""


def select_sequences(items: Iterable[str]) -> list[str]:
    """Return the distinct sequences that a list selects.

    Parameters
    ----------
    items : iterable of str
        Specifications for `matching`. A specification after `!` is a name, path or pattern of
        sequences that are left out, also of sequences that are incomplete.

    Returns
    -------
    list of str
        At least one sequence, in the order of the items.

    Raises
    ------
    SequenceError
        As `matching`; also if an item excludes nothing, or if all sequences are excluded.

    Examples
    --------
    >>> select_sequences(["samples", "!bow*"])
    ['samples/face']
    """
    items = list(items)
    excluded = [item.removeprefix(EXCLUDES) for item in items if item.startswith(EXCLUDES)]
    selecting = [item for item in items if not item.startswith(EXCLUDES)]
    specs = [spec for item in selecting for spec in matching(item, excluded)]
    if not excluded:
        return list(dict.fromkeys(specs))
    names = {spec: _names(spec) for spec in specs}
    for pattern in excluded:
        if not any(_matches(pattern, names[spec]) for spec in names):
            # Names inside the data, such as Jogging.1, need the sequence.
            names = {spec: spellings | _canonical_name(spec) for spec, spellings in names.items()}
        _check_pattern(pattern, selecting, names)
    selected = [
        spec
        for spec, spellings in names.items()
        if not any(_matches(pattern, spellings) for pattern in excluded)
    ]
    if not selected:
        raise SequenceError(
            f"{', '.join(items)}: all sequences are excluded. Select at least one sequence."
        )
    return selected


def _matches(pattern: str, names: Iterable[str]) -> bool:
    whole = str(Path(pattern).expanduser())
    return any(name == pattern or fnmatchcase(name, whole) for name in names)


def _names(spec: str) -> set[str]:
    """Return the specification of a sequence, also without its folders and without its options."""
    last = spec.rstrip("/").rpartition("/")[2]
    return {spec, last, spec.partition(":")[0], last.partition(":")[0]}


def _canonical_name(spec: str) -> set[str]:
    """Return the name of a sequence; none if it cannot be opened."""
    with suppress(SequenceError):
        return {load(spec).name}
    return set()


def _check_pattern(pattern: str, selecting: Iterable[str], names: dict[str, set[str]]) -> None:
    """Raise `SequenceError` if a pattern excludes nothing."""
    if any(_matches(pattern, spellings) for spellings in names.values()):
        return
    try:
        everything = {spec for item in selecting for spec in matching(item)}
    except SequenceError:  # the pattern can exclude a sequence that is incomplete
        return
    if not any(_matches(pattern, _names(spec)) for spec in everything):
        valid = sorted({name for spec in everything for name in _names(spec)})
        raise SequenceError(
            f"{quote(EXCLUDES + pattern)} excludes no sequence.{close_match(pattern, valid)}"
        )
