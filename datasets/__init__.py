"""Sequences: recorded ones behind readers, synthetic ones behind a renderer."""

from datasets.catalogue import load, names, options
from datasets.interface import Sequence, SequenceError

__all__ = ["Sequence", "SequenceError", "load", "names", "options"]
