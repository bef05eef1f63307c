"""Boxes of stored runs: which trackers gave the same ones."""

from collections import Counter, defaultdict
from functools import cache
from itertools import combinations
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from trackmark.bench.protocols import STORED_ONCE
from trackmark.bench.store.results import Results

DECIMALS = 3
"""Boxes are compared in thousandths of a pixel."""


def same_boxes(
    folder: Path, runs: pd.DataFrame, stored: str = STORED_ONCE
) -> Counter[tuple[str, str]]:
    """Return on how many sequences two trackers gave the same boxes in all runs, if on any.

    `folder`: of the experiment. `runs`: as `load_results` gives them. `stored`: protocol under
    which the runs are filed. Raises `ResultsError` if a file is damaged.
    """
    results = Results(folder)

    @cache
    def boxes(tracker: str, sequence: str, seed: int) -> NDArray[np.float64]:
        run = results.read((tracker, sequence, seed, stored))
        return np.round(run.boxes, DECIMALS)

    columns = ["sequence", "tracker", "repetition", "mean_overlap", "centre_error"]
    finished = runs[(runs["protocol"] == stored) & (runs["status"] == "finished")]
    rows = finished.reindex(columns=columns).astype({"sequence": str, "tracker": str}).round(9)
    scores: defaultdict[str, dict[str, dict[int, list[float]]]] = defaultdict(dict)
    for sequence, tracker, seed, *own in rows.fillna(-1.0).itertuples(index=False, name=None):
        scores[sequence].setdefault(tracker, {})[seed] = own
    same: Counter[tuple[str, str]] = Counter()
    for sequence, by_tracker in scores.items():
        for first, second in combinations(by_tracker, 2):
            # Equal boxes have equal scores: files of other runs are not opened.
            same[first, second] += by_tracker[first] == by_tracker[second] and all(
                np.array_equal(
                    boxes(first, sequence, seed), boxes(second, sequence, seed), equal_nan=True
                )
                for seed in by_tracker[first]
            )
    return +same
