"""Sequences of stored runs, for what results don't hold: their pixels."""

from collections.abc import Mapping
from typing import Any

import datasets

__all__ = ["opened"]


def opened(row: Mapping[Any, Any]) -> datasets.Sequence | None:
    """The sequence of a run, where it is still there and the same; `row`: as the index has it."""
    try:
        sequence = datasets.load(row["source"], truth=row["truth"] or None)
    except datasets.SequenceError:
        return None
    return sequence if sequence.fingerprint == row["fingerprint"] else None
