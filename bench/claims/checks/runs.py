"""Runs as checks see them: by reading and scenes."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial

import pandas as pd

from bench.claims.findings import Evidence, Finding
from bench.claims.readings import readings_among, rows_under

__all__ = ["labelled", "runs_by_reading"]


def runs_by_reading(
    evidence: Evidence, table: pd.DataFrame, setting: str
) -> Iterator[tuple[Callable[..., Finding], pd.DataFrame]]:
    """Runs on the sequences that a setting names, and what makes findings of them.

    Parameters
    ----------
    evidence : Evidence
        What the check is given.
    table : DataFrame
        A row a run, columns of the scores.
    setting : str
        Name of the setting that lists the sequences.
    """
    tested = table[table["sequence"].isin(evidence.names(setting))]
    readings = evidence.claim.readings
    for reading in readings_among(readings, [tested]):
        part = rows_under(readings, tested, reading)
        if len(part):
            yield labelled(evidence, reading, "drawn"), part
            yield labelled(evidence, reading, "kept"), part[part["kept_scene"]]


def labelled(evidence: Evidence, reading: Mapping[str, str], scenes: str) -> Callable[..., Finding]:
    """Makes findings under a reading."""
    claim = evidence.claim
    post_hoc = claim.readings.is_post_hoc(reading)
    return partial(Finding, claim.id, reading=reading, scenes=scenes, post_hoc=post_hoc)
