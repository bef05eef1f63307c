"""Attributes of a sequence: one pass through its frames, kept by its fingerprint."""

import hashlib
import io
import zipfile
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from tempfile import NamedTemporaryFile

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.attributes import definitions
from trackmark.datasets.attributes.attribute import Attribute
from trackmark.datasets.attributes.view import View
from trackmark.datasets.file_digest import cache_folder
from trackmark.datasets.interface import Sequence
from trackmark.datasets.source_digest import tree_digest
from trackmark.datasets.spec_string import close_match

# Values by attribute, (n,): a number a frame, NaN where there is none.
Series = dict[str, NDArray[np.float64]]


@cache
def _known() -> dict[str, Attribute]:
    found = vars(definitions).values()
    return {one.name: one for one in found if isinstance(one, Attribute)}


def names() -> list[str]:
    """Names of the attributes, in the order in which they are defined."""
    return list(_known())


def find(name: str) -> Attribute:
    """The attribute of a name; raises `ValueError` for an unknown one, with those there are."""
    if name not in _known():
        hint = close_match(name, names())
        raise ValueError(f"unknown attribute {name!r}.{hint} Known: {', '.join(names())}.")
    return _known()[name]


def _silent(done: int, total: int) -> None:
    """Tell nobody."""


def measure(sequence: Sequence, progress: Callable[[int, int], object] = _silent) -> Series:
    """Attributes of every frame of a sequence, by name.

    Its frames are read once, in order, those with the target alone; what was measured is kept in
    the user's cache, and looked up there as long as neither pixels, truth nor definitions change.

    `sequence`: With truth. `progress`: Is told the frames that are done, and of how many. Raises
    `SequenceError` for a sequence without truth, and for an image that can't be read.
    """
    sequence.first_frame  # noqa: B018  # raises where there is no truth, and says what to do
    series = cached_values(sequence.fingerprint)
    if series is None:
        series = _measured(sequence, progress)
        _keep(_file(sequence.fingerprint), series)
    return series


def cached_values(fingerprint: str) -> Series | None:
    """Attributes of a sequence with this fingerprint, if they were measured before."""
    try:
        content = io.BytesIO(_file(fingerprint).read_bytes())
        with np.load(content, allow_pickle=False) as file:
            series = {name: np.asarray(file[name], np.float64) for name in names()}
    except (OSError, EOFError, KeyError, ValueError, zipfile.BadZipFile):  # none, or damaged
        return None
    return series if len({values.shape for values in series.values()}) == 1 else None


def overall(series: Mapping[str, ArrayLike]) -> dict[str, float]:
    """A sequence's value of every attribute, from those of its frames; see `Attribute.over`."""
    return {name: find(name).overall(values) for name, values in series.items()}


def _measured(sequence: Sequence, progress: Callable[[int, int], object]) -> Series:
    series = {name: np.full(len(sequence), np.nan) for name in names()}
    there = sequence.present & (sequence.boxes[:, 2:] > 0).all(axis=1)
    first: View | None = None
    before: View | None = None
    for frame in range(len(sequence)):
        if not there[frame]:
            before = None
            progress(frame + 1, len(sequence))
            continue
        now = View(
            sequence[frame], sequence.boxes[frame], float(sequence.visibility[frame]), before, first
        )
        for name, one in _known().items():
            series[name][frame] = one.measure(now)
        now.before = None  # or all frames so far would stay in memory
        first, before = first or now, now
        progress(frame + 1, len(sequence))
    return series


@cache
def _digest() -> str:
    """Of the source of all definitions: what they say of a sequence depends on nothing else."""
    here = Path(__file__)
    return tree_digest(here, here.parent)


def _file(fingerprint: str) -> Path:
    name = hashlib.sha256(fingerprint.encode()).hexdigest()[:32]
    return cache_folder() / "attributes" / f"{name}-{_digest()}.npz"


def _keep(path: Path, series: Series) -> None:
    """Keep what was measured; where it can't be, that costs time alone."""
    content = io.BytesIO()
    np.savez_compressed(content, allow_pickle=False, **series)
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        with NamedTemporaryFile(dir=path.parent, delete=False) as file:
            file.write(content.getvalue())
        Path(file.name).replace(path)
