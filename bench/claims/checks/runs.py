"""Runs as checks see them: by reading and scenes."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial

import pandas as pd

from bench.claims.findings import Evidence, Finding

__all__ = ["labelled", "runs_by_reading"]


def runs_by_reading(
    evidence: Evidence, table: pd.DataFrame, setting: str
) -> Iterator[tuple[Callable[..., Finding], pd.DataFrame]]:
    """Runs on the sequences that a setting names, and what makes findings of them."""
    for made, (rows,) in evidence.by_reading(table, [{}], evidence.names(setting)):
        yield made, rows


def labelled(evidence: Evidence, reading: Mapping[str, str], scenes: str) -> Callable[..., Finding]:
    """Makes findings under a reading of a single axis."""
    readings = evidence.claim.readings
    post_hoc = any(
        all(reading.get(key) == value for key, value in choice.items())
        for choice in readings.choices
    )
    return partial(Finding, evidence.claim.id, reading=reading, scenes=scenes, post_hoc=post_hoc)
