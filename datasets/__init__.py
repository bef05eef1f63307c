"""Sequences: recorded ones behind readers, synthetic ones behind a renderer."""

if __name__ != "trackmark.datasets":
    raise ImportError("Import `trackmark.datasets` instead of `datasets`.")

from trackmark.datasets.catalogue import (
    identity,
    load,
    matching,
    names,
    options,
    outline,
    summary,
    taken_for,
)
from trackmark.datasets.interface import Origin, Sequence, SequenceError, Summary
from trackmark.datasets.metadata import Outline

__all__ = [
    "Origin",
    "Outline",
    "Sequence",
    "SequenceError",
    "Summary",
    "identity",
    "load",
    "matching",
    "names",
    "options",
    "outline",
    "summary",
    "taken_for",
]
