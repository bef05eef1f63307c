"""Names of sequences and of their result files: which file belongs to which sequence.

Toolkits spell names differently: `Jogging.1`, `jogging-1`, `uav_bird1_1`. Spellings are compared
without removing a character, so that `car1_1` and `car11` remain two names. A file belongs to at
most one sequence.
"""

import re
import unicodedata
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping

from trackmark.datasets.layouts import layouts

PREFIXES = tuple(layout.prefix for layout in layouts().values() if layout.prefix)
"""Texts that toolkits write before the names of sequences of a data set."""

_SEPARATORS = re.compile(r"[\s./:\\-]")


def file_name(name: str) -> str:
    """Convert the name of a sequence or tracker to a file name; letters of any script remain."""
    return "".join(
        sign if sign.isalnum() or sign in "_.+=-" or unicodedata.category(sign)[0] == "M" else "_"
        for sign in name
    )


def is_same_name(sequence: str, spelling: str) -> bool:
    """Return whether a toolkit's spelling can be the name of a sequence.

    It can differ in case, in the kind of separators and by a prefix of `PREFIXES`.

    >>> is_same_name("Jogging.1", "jogging-1"), is_same_name("car1_1", "car11")
    (True, False)
    """
    return _folded(sequence) in (_folded(spelling), _without_prefix(spelling))


def files_of_sequences(sequences: Iterable[str], files: Iterable[str]) -> Mapping[str, str]:
    """Return the name of the result file of each sequence that has exactly one.

    An equal name is preferred to another spelling, and a spelling without prefix to one with
    prefix. If a file could belong to two sequences, or a sequence to two files, none is chosen.
    """
    file_of_sequence: dict[str, str] = {}
    for name_key, file_key in _SPELLINGS:
        matching: defaultdict[str, tuple[list[str], list[str]]] = defaultdict(lambda: ([], []))
        for name in set(sequences) - file_of_sequence.keys():
            matching[name_key(name)][0].append(name)
        for file in set(files) - set(file_of_sequence.values()):
            matching[file_key(file)][1].append(file)
        file_of_sequence |= {
            names[0]: candidates[0]
            for names, candidates in matching.values()
            if len(names) == len(candidates) == 1
        }
    return file_of_sequence


def _folded(name: str) -> str:
    """Return a name in lower case with one kind of separator; no character is removed."""
    return _SEPARATORS.sub("_", unicodedata.normalize("NFC", name).lower())


def _without_prefix(name: str) -> str:
    """Return the folded name of a file without the prefix of a data set."""
    folded = _folded(name)
    prefix = next(filter(folded.startswith, PREFIXES), "")
    return folded.removeprefix(prefix)


def _unchanged(name: str) -> str:
    return name


# Functions that return equal texts for a sequence and its file, the closest spelling first.
_SPELLINGS: tuple[tuple[Callable[[str], str], Callable[[str], str]], ...] = (
    (_unchanged, _unchanged),
    (file_name, _unchanged),
    (_folded, _folded),
    (_folded, _without_prefix),
)
