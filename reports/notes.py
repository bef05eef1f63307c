"""Notes beneath a table of scores: failures, missing runs, malformed boxes."""

import re

import pandas as pd

NOT_RUN = "not run"
_WORDS = {
    "missing": "of the runs that were asked for",
    "stale": "by another version of the tracker or the sequence",
    NOT_RUN: "of the sequences",
}
_FRAME = re.compile(r"^(frame \d+|\S+\.(?:png|jpe?g|bmp|tiff?|webp|p[gp]m)): ", re.IGNORECASE)


def counted(runs: pd.DataFrame, score: str) -> "pd.Series[bool]":
    """Return which runs a mean includes: finished ones, and failed ones that have the score."""
    finished = runs["status"] == "finished"
    if score not in runs:
        return finished
    return finished | ((runs["status"] == "failed") & runs[score].notna())


def failure_notes(
    runs: pd.DataFrame, worst: str = "the worst score", every: str = "left out"
) -> dict[str, str]:
    """Return, by tracker with failed runs, how many failed, and where and why the first one did.

    `worst`: score of a failed run; '' if failed runs have none. `every`: treatment of a tracker
    whose every run failed.
    """
    notes = dict[str, str]()
    for tracker, rows in runs.groupby("tracker", sort=False, observed=True):
        failed = rows[rows["status"] == "failed"]
        if failed.empty:
            continue
        treatment = every if len(failed) == len(rows) else worst and f"counted as {worst}"
        first = failed.iloc[0]
        reason = _FRAME.sub("", str(first["failure"]).partition("\n")[0])
        notes[str(tracker)] = (
            f"{len(failed)} of {len(rows)} runs failed{treatment and f' ({treatment})'}: "
            f"sequence {first['sequence']}, {reason}"
        )
    return notes


def notes_of(runs: pd.DataFrame, score: str) -> list[str]:
    """Return failures, missing and malformed runs by tracker.

    `score`: column that failed runs have a value in if they are counted.
    """
    worst = "the worst score" if (counted(runs, score) & (runs["status"] == "failed")).any() else ""
    notes = [f"{tracker}: {note}" for tracker, note in failure_notes(runs, worst).items()]
    for status in ("missing", "stale", NOT_RUN):
        here = runs[runs["status"] == status]
        counts = here.groupby("tracker", sort=False, observed=True).size()
        notes += [
            f"{status}: {tracker}, {count} {_WORDS[status]}" for tracker, count in counts.items()
        ]
    if "malformed" in runs:
        finished = runs[runs["status"] == "finished"]
        sums = finished.groupby("tracker", sort=False, observed=True)["malformed"].sum()
        notes += [
            f"malformed: {tracker}, {count:.0f} boxes not finite with a positive size: misses"
            for tracker, count in sums[sums > 0].items()
        ]
    return notes
