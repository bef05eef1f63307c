"""Data frames of runs, as `Runs.scored` returns them."""

import numpy as np
import pandas as pd
import pytest

from trackmark.bench.analysis.comparison import compare_trackers


def compare(runs, *arguments, **options):
    """Compare the trackers of a data frame of one-pass runs and timing runs."""
    is_timed = runs["protocol"] == "timing"
    return compare_trackers(runs[~is_timed], runs[is_timed], *arguments, **options)


@pytest.fixture
def make_runs():
    def make(scores, frames=100, lost_at=None, **columns):
        """Return runs; `scores` has an array (sequences, repetitions) for each tracker."""
        rows = [
            {
                "tracker": tracker,
                "sequence": names[sequence],
                "repetition": repetition,
                "protocol": "one-pass",
                "status": "finished",
                "failure": "",
                "mean_overlap": score,
                "centre_error": 10 * (1 - score),
                "fingerprint": f"of {names[sequence]}",
                "first_loss": frames if lost_at is None else lost_at[tracker],
                "frames": frames,
                "seconds": 0.9,
                "ms_per_frame": 2.0,
            }
            for tracker, table in scores.items()
            for names in [columns.get("names") or [f"s{n}" for n in range(len(table))]]
            for sequence, values in enumerate(np.atleast_2d(table))
            for repetition, score in enumerate(values)
        ]
        return pd.DataFrame(rows)

    return make
