"""Boxes of stored runs: which trackers gave the same ones, and which cannot be repeated."""

from collections.abc import Collection, Hashable
from functools import cache
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.protocols import STORED_ONCE, TIMING
from bench.store.layout import run_path
from bench.store.results import Results

__all__ = ["BoxEvidence", "compare_boxes"]

DECIMALS = 3
"""Boxes are compared in thousandths of a pixel."""

SCORES = ("mean_overlap", "centre_error")
"""Equal boxes have equal scores, so that only runs with equal scores are opened."""

_Key = tuple[str, str, int, str]


class BoxEvidence(NamedTuple):
    """What boxes of stored runs show.

    Attributes
    ----------
    same : dict of pair to int
        Number of sequences on which two trackers gave the same boxes in all runs.
    not_repeatable : frozenset of str
        Trackers whose timing run gave other boxes than the run with the same seed.
    """

    same: dict[tuple[str, str], int]
    not_repeatable: frozenset[str]


def compare_boxes(
    folder: Path, runs: pd.DataFrame, trackers: Collection[str], stored: str = STORED_ONCE
) -> BoxEvidence:
    """Compare the boxes of finished runs in an experiment's folder.

    `runs`: as `load_results` gives them. `stored`: what runs by the protocol are filed under.
    Raises `ResultsError` if a file is damaged.
    """
    results = Results(folder)

    @cache
    def boxes(key: _Key) -> NDArray[np.float64]:
        return np.round(results.read(folder / run_path(*key)).boxes, DECIMALS)

    def equal(first: _Key, second: _Key) -> bool:
        return np.array_equal(boxes(first), boxes(second), equal_nan=True)

    scores = _scores(runs[runs["tracker"].isin(list(trackers))])
    ran = {key: score for key, score in scores.items() if key[3] == stored}
    cells: dict[tuple[str, str], list[_Key]] = {}
    for key in sorted(ran):
        cells.setdefault(key[:2], []).append(key)
    same: dict[tuple[str, str], int] = {}
    for first, second in combinations(trackers, 2):
        for sequence in {name for _, name in cells}:
            ours, theirs = (cells.get((name, sequence), []) for name in (first, second))
            if (
                ours
                and [ran[key] for key in ours] == [ran[key] for key in theirs]
                and all(map(equal, ours, theirs))
            ):
                same[first, second] = same.get((first, second), 0) + 1
    changed = {
        key[0]
        for key in scores
        if key[3] == TIMING and (again := (*key[:3], STORED_ONCE)) in scores
        if scores[key] != scores[again] or not equal(key, again)
    }
    return BoxEvidence(same, frozenset(changed))


def _scores(runs: pd.DataFrame) -> dict[_Key, Hashable]:
    """Return the scores of finished runs, by tracker, sequence, repetition and protocol."""
    finished = runs[runs["status"] == "finished"]
    names = [name for name in SCORES if name in finished]
    keys = finished[["tracker", "sequence", "repetition", "protocol"]]
    values = finished[names].round(9).fillna(-1.0)
    return {
        (str(tracker), str(sequence), int(repetition), str(protocol)): score
        for (tracker, sequence, repetition, protocol), score in zip(
            keys.itertuples(index=False, name=None),
            values.itertuples(index=False, name=None),
            strict=True,
        )
    }
