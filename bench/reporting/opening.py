"""Sequences of stored runs, for what results don't hold: their pixels."""

from collections.abc import Mapping
from typing import Any

import datasets


def opened(row: Mapping[Any, Any]) -> datasets.Sequence | None:
    """The sequence of a run, where it is still there and the same; `row`: as the index has it."""
    found = opened_or_why(row)
    return None if isinstance(found, str) else found


def opened_or_why(row: Mapping[Any, Any]) -> datasets.Sequence | str:
    """The sequence of a run, or a sentence on why there is none: it is gone, or it has changed."""
    name, source = row["sequence"], row["source"]
    try:
        sequence = datasets.load(source, truth=row["truth"] or None)
    except datasets.SequenceError:
        return f"{name} can't be opened at {source} any more."
    if sequence.fingerprint != row["fingerprint"]:
        return f"{name} at {source} has changed since it was run."
    return sequence
