"""Boxes of stored runs: which trackers gave the same ones."""

from collections.abc import Hashable
from functools import cache
from itertools import combinations
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.protocols import STORED_ONCE
from bench.store.layout import run_path
from bench.store.results import Results

__all__ = ["same_boxes"]

DECIMALS = 3
"""Boxes are compared in thousandths of a pixel."""

SCORES = ("mean_overlap", "centre_error")
"""Equal boxes have equal scores, so that only runs with equal scores are opened."""


def same_boxes(
    folder: Path, runs: pd.DataFrame, stored: str = STORED_ONCE
) -> dict[tuple[str, str], int]:
    """Return on how many sequences two trackers gave the same boxes in all runs, if on any.

    `folder`: of the experiment. `runs`: as `load_results` gives them. `stored`: what runs by the
    protocol are filed under. Raises `ResultsError` if a file is damaged.
    """
    results = Results(folder)

    @cache
    def boxes(tracker: str, sequence: str, seed: int) -> NDArray[np.float64]:
        run = results.read(folder / run_path(tracker, sequence, seed, stored))
        return np.round(run.boxes, DECIMALS)

    by_sequence = _scores(runs[(runs["protocol"] == stored) & (runs["status"] == "finished")])
    same: dict[tuple[str, str], int] = {}
    for sequence, scores in by_sequence.items():
        for pair in combinations(scores, 2):
            first, second = pair
            if scores[first] == scores[second] and all(
                np.array_equal(
                    boxes(first, sequence, seed), boxes(second, sequence, seed), equal_nan=True
                )
                for seed in scores[first]
            ):
                same[pair] = same.get(pair, 0) + 1
    return same


def _scores(runs: pd.DataFrame) -> dict[str, dict[str, dict[int, Hashable]]]:
    """Return the scores of runs, by sequence, tracker and seed."""
    scores: dict[str, dict[str, dict[int, Hashable]]] = {}
    keys = runs[["sequence", "tracker", "repetition"]].astype({"sequence": str, "tracker": str})
    values = runs.reindex(columns=list(SCORES)).round(9).fillna(-1.0)
    for (sequence, tracker, seed), score in zip(
        keys.itertuples(index=False, name=None),
        values.itertuples(index=False, name=None),
        strict=True,
    ):
        scores.setdefault(sequence, {}).setdefault(tracker, {})[seed] = score
    return scores
