"""Cache of the sequences that were opened last, so that scores of many runs open each one once."""

from collections import OrderedDict
from pathlib import Path
from threading import Lock
from weakref import WeakValueDictionary

import numpy as np

from trackmark import datasets
from trackmark.bench.operating_system import working_directory
from trackmark.datasets import Sequence, SequenceError
from trackmark.datasets.catalogue import is_built_in

MAX_OPEN = 64
"""Maximum number of sequences in the cache."""

evaluated_sequences: WeakValueDictionary[str, Sequence] = WeakValueDictionary()
"""Sequences of runs that were made in this process, by fingerprint."""


def remember_evaluated(sequence: Sequence) -> None:
    """Add a sequence to `evaluated_sequences`, from which its runs get their images.

    Raises `SequenceError` if runs of another sequence with this fingerprint exist.
    """
    other = evaluated_sequences.setdefault(sequence.fingerprint, sequence)
    if not are_equal(other, sequence):
        raise SequenceError(
            f"{sequence.name}: another sequence with the fingerprint {sequence.fingerprint!r} was "
            "evaluated before, with other images or ground truth. Give each its own fingerprint."
        )


def are_equal(first: Sequence, second: Sequence) -> bool:
    """Return whether two sequences have equal fingerprints, ground truth and end images.

    The fingerprint of a sequence in memory is chosen by the user, who can forget to change it.
    """
    if first is second:
        return True
    if first.fingerprint != second.fingerprint or first.regions.keys() != second.regions.keys():
        return False
    names = "boxes", "visibility", "annotated"
    pairs = [(getattr(first, name), getattr(second, name)) for name in names]
    pairs += [(boxes, second.regions[name]) for name, boxes in first.regions.items()]
    if not all(np.array_equal(a, b, equal_nan=True) for a, b in pairs):
        return False
    return all(np.array_equal(first[frame], second[frame]) for frame in {0, len(first) - 1})


_opened: OrderedDict[tuple[str, ...], tuple[Sequence, dict[str, int]]] = OrderedDict()
_lock = Lock()


def load_sequence(name_or_path: str | Path, truth: str | Path | None = None) -> Sequence:
    """Open a sequence, or return it from a cache of the 64 sequences that were used last.

    Parameters
    ----------
    name_or_path : str or Path
        Built-in name with options, or path of recorded data; see `datasets.load`.
    truth : str or Path, optional
        CSV file `frame,x,y,width,height` that replaces the ground truth of recorded data.

    Returns
    -------
    Sequence
        Data from a path are opened again if their folder or their ground-truth file has changed.

    Raises
    ------
    SequenceError
        For an unknown name, option or path, and for data that cannot be read.

    Examples
    --------
    >>> load_sequence("samples/face") is load_sequence("samples/face")
    True
    """
    key = (type(name_or_path).__name__, str(name_or_path), str(truth or ""), working_directory())
    with _lock:
        if key in _opened and _opened[key][1] == {file: _time(file) for file in _opened[key][1]}:
            _opened.move_to_end(key)
            return _opened[key][0]
        sequence = datasets.load(name_or_path, truth)
        files = [str(name_or_path), str(truth or ""), sequence.truth_source]
        if isinstance(name_or_path, str) and is_built_in(name_or_path):
            files = []
        _opened[key] = sequence, {file: _time(file) for file in files}
        if len(_opened) > MAX_OPEN:
            _opened.popitem(last=False)
        return sequence


def _time(file: str) -> int:
    """Return the modification time of a file or folder [ns]; -1 if there is none."""
    try:
        return Path(file).expanduser().stat().st_mtime_ns
    except (OSError, ValueError, RuntimeError):  # the text is no path
        return -1
