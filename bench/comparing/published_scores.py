"""Scores that others published, beside ours: one number a sequence, and no repetitions."""

from math import isfinite, nan
from pathlib import Path

import numpy as np
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
    told = _read_published_scores(file, measure)
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


def _read_published_scores(file: Path, measure: Measure) -> pd.DataFrame:
    """Read tracker, sequence and score of every row; the index holds the line in the file."""
    columns = ["tracker", "sequence", measure.name]
    try:
        table = pd.read_csv(
            file, dtype=str, index_col=False, keep_default_na=False, skip_blank_lines=False
        )
    except (UnicodeDecodeError, pd.errors.ParserError, pd.errors.EmptyDataError) as error:
        raise ComparisonError(f"{file} is no CSV: {error}.") from error
    if missing := [name for name in columns if name not in table]:
        raise ComparisonError(
            f"{file} has no column {', '.join(missing)}; it needs {', '.join(columns)}."
        )
    table.index += 2  # the first line holds the columns' names
    table = table.loc[(table != "").any(axis=1), columns].copy()
    scores = [
        _parse_score(text, f"{file}, line {line}", measure)
        for line, text in table[measure.name].items()
    ]
    twice = table.duplicated(["tracker", "sequence"])
    if twice.any():
        raise ComparisonError(f"{file}, line {twice.idxmax()} comes twice.")
    return table.assign(**{measure.name: np.array(scores, np.float64)})


def _parse_score(text: str, place: str, measure: Measure) -> float:
    """Return the number of a text; raise `ComparisonError` for others and impossible scores."""
    try:
        score = float(text)
    except ValueError:
        score = nan
    if not isfinite(score) or "_" in text:  # Python takes 1_0 for ten
        raise ComparisonError(f"{place}: {text!r} is no number.")
    if score < 0 or (score > 1 and measure.unit != "px"):
        raise ComparisonError(
            f"{place}: {score:g} is no {measure.name}; it is given in "
            f"{'pixels' if measure.unit == 'px' else '0 to 1'}."
        )
    return score
