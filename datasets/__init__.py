"""Image sequences with ground truth: recorded data and synthetic scenes."""

if __name__ != "trackmark.datasets":
    raise ImportError("Import `trackmark.datasets` instead of `datasets`.")

from trackmark.datasets.catalogue import (
    describe,
    identity,
    load,
    matching,
    names,
    options,
    path_format,
    summary,
)
from trackmark.datasets.interface import Origin, Sequence, SequenceError, Summary
from trackmark.datasets.metadata import SequenceMetadata

__all__ = [
    "Origin",
    "Sequence",
    "SequenceError",
    "SequenceMetadata",
    "Summary",
    "describe",
    "identity",
    "load",
    "matching",
    "names",
    "options",
    "path_format",
    "summary",
]
