"""Sequences: recorded ones behind readers, synthetic ones behind a renderer."""

from datasets.catalogue import load, names, options, summary
from datasets.interface import Sequence, SequenceError, Summary

__all__ = ["Sequence", "SequenceError", "Summary", "load", "names", "options", "summary"]
