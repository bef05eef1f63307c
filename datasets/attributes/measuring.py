"""Measurement of all attributes in one pass through a sequence, cached by its fingerprint."""

import hashlib
import io
import zipfile
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.attributes import definitions
from trackmark.datasets.attributes.attribute import Attribute
from trackmark.datasets.attributes.view import TargetView
from trackmark.datasets.file_digest import cache_folder, write_cache
from trackmark.datasets.interface import Sequence
from trackmark.datasets.source_digest import tree_digest

# Values of each attribute by its name, shape (n,): one per frame, NaN if undefined.
Series = dict[str, NDArray[np.float64]]


ATTRIBUTES = {
    value.name: value for value in vars(definitions).values() if isinstance(value, Attribute)
}
"""Attributes by name, in the order of their definition."""


def measure(sequence: Sequence, progress: Callable[[int, int], object] = lambda *_: None) -> Series:
    """Measure all attributes of all frames of a sequence.

    Frames with the target are read once, in order. The result is stored in the user's cache, and
    used until pixels, ground truth or definitions change.

    Parameters
    ----------
    sequence : Sequence
        Sequence with ground truth.
    progress : callable
        Function that is called with the number of finished frames and the number of all frames.

    Returns
    -------
    dict of str to array of shape (n,)
        Values by attribute; NaN if undefined.

    Raises
    ------
    SequenceError
        If there is no ground truth, or an image cannot be read.
    """
    sequence.first_frame  # noqa: B018  # raises SequenceError without ground truth
    series = cached_values(sequence.fingerprint)
    if series is None:
        series = _measure(sequence, progress)
        buffer = io.BytesIO()
        np.savez_compressed(buffer, allow_pickle=False, **series)
        write_cache(_cache_file(sequence.fingerprint), buffer.getvalue())
    return series


def cached_values(fingerprint: str) -> Series | None:
    """Return the cached attributes of a sequence with this fingerprint, or None."""
    try:
        cached = io.BytesIO(_cache_file(fingerprint).read_bytes())
        with np.load(cached, allow_pickle=False) as file:
            series = {name: np.asarray(file[name], np.float64) for name in ATTRIBUTES}
    except (OSError, EOFError, KeyError, ValueError, zipfile.BadZipFile):  # missing or damaged
        return None
    return series if len({values.shape for values in series.values()}) == 1 else None


def overall(series: Mapping[str, ArrayLike]) -> dict[str, float]:
    """Return the sequence's value of each attribute from the values of its frames."""
    return {name: ATTRIBUTES[name].overall(values) for name, values in series.items()}


def _measure(sequence: Sequence, progress: Callable[[int, int], object]) -> Series:
    """Measure all attributes without the cache."""
    series = {name: np.full(len(sequence), np.nan) for name in ATTRIBUTES}
    has_target = sequence.present & (sequence.boxes[:, 2:] > 0).all(axis=1)
    first: TargetView | None = None
    previous: TargetView | None = None
    for frame, (box, visibility) in enumerate(
        zip(sequence.boxes, sequence.visibility.tolist(), strict=True)
    ):
        if has_target[frame]:
            view = TargetView(sequence[frame], box, visibility, previous, first)
            for name, attribute in ATTRIBUTES.items():
                series[name][frame] = attribute.measure(view)
            view.previous = None  # Otherwise all earlier frames would remain in memory.
            first, previous = first or view, view
        else:
            previous = None
        progress(frame + 1, len(sequence))
    return series


@cache
def _digest() -> str:
    """Return the digest of the source of all definitions, which determines the values."""
    file = Path(__file__)
    return tree_digest(file, file.parent)


def _cache_file(fingerprint: str) -> Path:
    """Return the cache file of a fingerprint and of the current definitions."""
    name = hashlib.sha256(fingerprint.encode()).hexdigest()[:32]
    return cache_folder() / "attributes" / f"{name}-{_digest()}.npz"
