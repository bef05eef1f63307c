"""Selection of sequences by a list of names, paths and patterns; `!NAME` excludes sequences."""

from collections.abc import Iterable
from contextlib import suppress
from fnmatch import fnmatchcase
from pathlib import Path

from trackmark.datasets.catalogue import load, matching
from trackmark.datasets.decoding import quote
from trackmark.datasets.interface import SequenceError
from trackmark.datasets.spec_string import close_match

__all__ = ["select_sequences"]

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
