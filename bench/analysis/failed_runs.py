"""Notes on failed runs. `bench.evaluation.outcomes` defines their scores, which are the worst."""

from typing import NamedTuple

import pandas as pd

from trackmark.bench.analysis.score_tables import failure_notes


class FailedRuns(NamedTuple):
    """Failed runs of a comparison or table."""

    notes: dict[str, str]  # by tracker: number of failed runs, and reason of the first failure
    left_out: list[str]  # trackers whose runs all failed


def failed_runs(runs: pd.DataFrame, counted: str = "the worst score") -> FailedRuns:
    """Return notes on the trackers with failed runs, for runs by one protocol.

    `counted`: score of a failed run in the notes, for example `0` for an overlap.

    >>> runs = pd.DataFrame({"tracker": ["a", "a"], "sequence": ["cup", "box"]})
    >>> runs = runs.assign(status=["failed", "finished"], failure=["frame 3: ValueError: no", ""])
    >>> failed_runs(runs, "0").notes
    {'a': '1 of 2 runs failed (counted as 0): sequence cup, ValueError: no'}
    """
    notes = failure_notes(runs, counted)
    succeeded = set(runs["tracker"][runs["status"] != "failed"])
    return FailedRuns(notes, [tracker for tracker in notes if tracker not in succeeded])
