"""Sequences: recorded ones behind readers, synthetic ones behind a renderer."""

from datasets.catalogue import load, matching, names, options, outline, summary
from datasets.interface import Sequence, SequenceError, Summary
from datasets.outline import Outline

__all__ = [
    "Outline",
    "Sequence",
    "SequenceError",
    "Summary",
    "load",
    "matching",
    "names",
    "options",
    "outline",
    "summary",
]
