"""Sequences: recorded ones behind readers, synthetic ones behind a renderer."""

from datasets.catalogue import identity, load, matching, names, options, outline, summary, taken_for
from datasets.interface import Origin, Sequence, SequenceError, Summary
from datasets.outline import Outline

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
