"""Scores that others published, beside ours: one number a sequence, and no repetitions."""

from pathlib import Path

import pandas as pd

from bench.comparing.comparable_runs import ComparisonError
from reports.tables import Measure

__all__ = ["with_published"]


def with_published(
    runs: pd.DataFrame, file: Path, measure: Measure
) -> tuple[pd.DataFrame, list[str]]:
    """Runs with a row a published score, and the labels of their trackers.

    Parameters
    ----------
    runs : DataFrame
        As `bench.load_results` gives them.
    file : Path
        CSV with the columns `tracker`, `sequence` and the measure's name. Sequences that were not
        run are left out; labels get the word `published`.
    measure : Measure
        What was published.

    Raises
    ------
    ComparisonError
        For a file without these columns, a score that is no number or none of the measure, a row
        that comes twice, or one that lacks.
    """
    told = _told(file, measure)
    told = told[told["sequence"].isin(runs["sequence"].astype(str).unique())]
    if told.empty:
        raise ComparisonError(f"{file} has none of the sequences that were run.")
    for tracker, found in told.groupby("tracker")["sequence"]:
        if lacking := sorted(set(runs["sequence"].astype(str)) - set(found)):
            raise ComparisonError(f"{file} has no score of {tracker} on {lacking[0]}.")
    told = told.assign(tracker=told["tracker"] + " (published)")
    told = told.assign(repetition=0, protocol="accuracy", status="finished")
    plain = runs.copy()
    for name in runs.columns[runs.dtypes == "category"]:
        plain[name] = plain[name].astype(object)
    whole = pd.concat([plain, told], ignore_index=True)
    return whole, list(told["tracker"].unique())


def _told(file: Path, measure: Measure) -> pd.DataFrame:
    """Tracker, sequence and score of every row."""
    columns = ["tracker", "sequence", measure.name]
    try:
        told = pd.read_csv(file, dtype={"tracker": str, "sequence": str})
    except (UnicodeDecodeError, pd.errors.ParserError, pd.errors.EmptyDataError) as error:
        raise ComparisonError(f"{file} is no CSV: {error}.") from error
    if missing := [name for name in columns if name not in told]:
        raise ComparisonError(
            f"{file} has no column {', '.join(missing)}; it needs {', '.join(columns)}."
        )
    told = told[columns].copy()
    scores = pd.to_numeric(told[measure.name], errors="coerce")
    if scores.isna().any():
        line = int(scores.isna().to_numpy().argmax())
        raise ComparisonError(
            f"{file}, line {line + 2}: {told[measure.name].iloc[line]!r} is no number."
        )
    outside = (scores < 0) | (scores > 1 if measure.unit != "px" else False)
    if outside.any():
        line = int(outside.to_numpy().argmax())
        raise ComparisonError(
            f"{file}, line {line + 2}: {scores.iloc[line]:g} is no {measure.name}; it is given in "
            f"{'pixels' if measure.unit == 'px' else '0 to 1'}."
        )
    twice = told.duplicated(["tracker", "sequence"])
    if twice.any():
        raise ComparisonError(f"{file}, line {int(twice.to_numpy().argmax()) + 2} comes twice.")
    told[measure.name] = scores
    return told
