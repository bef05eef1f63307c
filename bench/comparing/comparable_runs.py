"""Runs that can be compared: of one protocol, of all trackers on all sequences, with scores."""

from collections.abc import Sequence
from dataclasses import replace
from math import nan

import numpy as np
import pandas as pd

from bench.protocols import STORED_ONCE, TIMING, title
from bench.store.files import ResultsError
from reports.tables import Measure

__all__ = ["AllFailedError", "ComparisonError", "check_runs", "chosen_trackers", "of_protocol"]


class ComparisonError(ResultsError):
    """Runs that cannot be compared; the message names them and the remedy."""


class AllFailedError(ComparisonError):
    """Every run of every tracker failed."""


def of_protocol(runs: pd.DataFrame, stored: str, measure: Measure) -> tuple[pd.DataFrame, Measure]:
    """Runs by one protocol as `compare` takes them, and the measure, whose title says which.

    `runs`: as `bench.load_results` gives them. `stored`: what those by the protocol are filed
    under. Timing runs stay beside them. When a target was lost is told of one pass alone; and its
    title says nothing, where nothing else is there.

    Raises `ComparisonError` where there are none.
    """
    there = list(map(str, runs["protocol"].unique()))
    others = [title(name) for name in there if name not in (stored, TIMING)]
    if stored not in there:
        known = f"; there are some by {', '.join(others)} (--protocol)" if others else ""
        raise ComparisonError(f"there are no runs by the protocol {title(stored)}{known}.")
    if others or stored != STORED_ONCE:
        measure = replace(measure, title=f"{measure.title}, protocol {title(stored)}")
    if stored == STORED_ONCE:
        return runs, measure
    protocols = runs["protocol"].astype(str)
    chosen = runs[protocols.isin([stored, TIMING])]
    known_as = protocols[chosen.index].replace(stored, STORED_ONCE)
    return chosen.assign(protocol=known_as, first_loss=nan), measure


def chosen_trackers(
    scored: pd.DataFrame, trackers: Sequence[str] | None, against: str | None
) -> list[str]:
    """Return the labels of the compared trackers; raise `ComparisonError` if there are too few."""
    stored = [str(name) for name in scored["tracker"].unique()]
    chosen = list(stored if trackers is None else trackers)
    if against is not None and against not in chosen:
        chosen.insert(0, against)
    for name in chosen:
        if name not in stored:
            raise ComparisonError(
                f"{name!r}: no stored runs of this tracker. Stored are {', '.join(stored)}."
            )
        if chosen.count(name) > 1:
            raise ComparisonError(
                f"{name!r} is named twice. Name each tracker once; a tracker is not compared with "
                "itself."
            )
    if len(chosen) < 2:
        raise ComparisonError(f"{len(chosen)} tracker to compare. Name two or more.")
    return chosen


def check_runs(
    scored: pd.DataFrame, chosen: Sequence[str], sequences: Sequence[str], measure: Measure
) -> None:
    """Raise `ComparisonError` unless all runs can be compared."""
    for status in ("missing", "stale"):
        here = scored[scored["status"] == status]
        if len(here):
            row = here.iloc[0]
            raise ComparisonError(
                f"tracker {row['tracker']}, sequence {row['sequence']}, repetition "
                f"{row['repetition']}: the run is {status} ({len(here)} of {len(scored)} runs "
                "are). All runs are needed. Execute them with `trackmark run` or with "
                "--sequences, or name other trackers."
            )
    present = set(zip(scored["tracker"].astype(str), scored["sequence"].astype(str), strict=True))
    for name in chosen:
        for sequence in sequences:
            if (name, sequence) not in present:
                raise ComparisonError(
                    f"tracker {name}, sequence {sequence}: the run is missing. Execute it with "
                    "`trackmark run` or with --sequences, or name other trackers."
                )
    kinds = scored.dropna(subset="fingerprint").groupby("sequence", observed=True)["fingerprint"]
    counts = kinds.nunique()
    if several := counts[counts > 1].index.tolist():
        raise ComparisonError(
            f"sequence {several[0]}: its images or its ground truth changed between stored runs. "
            "Run all trackers on it again."
        )
    if measure.name not in scored:
        raise ComparisonError(f"the runs have no score {measure.name!r}.")
    undefined = scored[~np.isfinite(scored[measure.name])]
    if len(undefined):
        row = undefined.iloc[0]
        raise ComparisonError(
            f"tracker {row['tracker']}, sequence {row['sequence']}: {measure.title} is "
            f"{row[measure.name]}. Choose another --metric, or omit the sequence."
        )
