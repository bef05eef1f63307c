"""What stands beneath a table of scores: failures, what is missing or malformed."""

import pandas as pd

__all__ = ["NOT_RUN", "notes_of"]

NOT_RUN = "not run"
_WORDS = {
    "missing": "of the runs that were asked for",
    "stale": "by another version of the tracker or the sequence",
    NOT_RUN: "of the sequences",
}


def notes_of(runs: pd.DataFrame) -> list[str]:
    """Every failure with its reason, then what is missing or malformed by tracker."""
    failed = runs[runs["status"] == "failed"]
    notes = [
        f"failed: {run.tracker} on {run.sequence}, repetition {run.repetition}: "
        + str(run.failure).partition("\n")[0]
        for run in failed.itertuples()
    ]
    for status in ("missing", "stale", NOT_RUN):
        here = runs[runs["status"] == status]
        counts = here.groupby("tracker", sort=False, observed=True).size()
        notes += [
            f"{status}: {tracker}, {count} {_WORDS[status]}" for tracker, count in counts.items()
        ]
    if "malformed" in runs:
        sums = runs.groupby("tracker", sort=False, observed=True)["malformed"].sum()
        notes += [
            f"malformed: {tracker}, {count:.0f} boxes not finite with a positive size: misses"
            for tracker, count in sums[sums > 0].items()
        ]
    return notes
