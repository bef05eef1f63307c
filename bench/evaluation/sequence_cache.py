"""Cache of the sequences that were opened last, so that scores of many runs open each one once."""

import os
from collections import OrderedDict
from pathlib import Path
from threading import Lock
from typing import TypeAlias
from weakref import WeakValueDictionary

from trackmark import datasets
from trackmark.datasets import Sequence
from trackmark.datasets.catalogue import is_built_in

MAX_OPEN = 64
"""Maximum number of sequences in the cache."""

Stamp: TypeAlias = tuple[tuple[str, int], ...]
"""Files and folders of a sequence with their modification times [ns]."""

evaluated_sequences: WeakValueDictionary[str, Sequence] = WeakValueDictionary()
"""Sequences of runs that were made in this process, by fingerprint."""

_opened: OrderedDict[tuple[str, ...], tuple[Sequence, Stamp]] = OrderedDict()
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
    key = (type(name_or_path).__name__, str(name_or_path), str(truth or ""), str(Path.cwd()))
    with _lock:
        if key in _opened:
            sequence, stamp = _opened[key]
            if stamp == _stamp([file for file, _ in stamp]):
                _opened.move_to_end(key)
                return sequence
        sequence = datasets.load(name_or_path, truth)
        files = [str(name_or_path), str(truth or ""), sequence.truth_source]
        built_in = isinstance(name_or_path, str) and is_built_in(name_or_path)
        _opened[key] = sequence, _stamp([] if built_in else files)
        if len(_opened) > MAX_OPEN:
            _opened.popitem(last=False)
        return sequence


def _stamp(files: list[str]) -> Stamp:
    """Return the modification times of files and folders; -1 for those that do not exist."""
    paths = [(file, os.path.expanduser(file)) for file in files]  # noqa: PTH111  # any text
    return tuple(
        (file, os.stat(path).st_mtime_ns if os.path.exists(path) else -1)  # noqa: PTH110, PTH116
        for file, path in paths
    )
