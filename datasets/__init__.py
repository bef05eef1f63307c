"""Image sequences with ground truth: recorded data and synthetic scenes."""

if __name__ != "trackmark.datasets":
    raise ImportError("Import `trackmark.datasets` instead of `datasets`.")

from trackmark.datasets.catalogue import (
    describe,
    load,
    matching,
    name_and_fingerprint,
    names,
    options,
    path_format,
    sequence_size,
)
from trackmark.datasets.interface import (
    Origin,
    Sequence,
    SequenceError,
    SequenceMetadata,
    SequenceSize,
)

__all__ = [
    "Origin",
    "Sequence",
    "SequenceError",
    "SequenceMetadata",
    "SequenceSize",
    "describe",
    "load",
    "matching",
    "name_and_fingerprint",
    "names",
    "options",
    "path_format",
    "sequence_size",
]
