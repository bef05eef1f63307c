"""Scores of other trackers that were published as numbers, without boxes."""

from pathlib import Path

import numpy as np
import pandas as pd

from trackmark.bench.analysis.comparable_runs import ComparisonError
from trackmark.reports.tables import ScoreMeasure


def with_published(
    runs: pd.DataFrame, file: Path, measure: ScoreMeasure
) -> tuple[pd.DataFrame, list[str]]:
    """Return the runs extended by published scores, and the labels of the published trackers.

    Parameters
    ----------
    runs : DataFrame
        Runs as `Runs.scored` returns them.
    file : Path
        CSV with the columns `tracker`, `sequence` and the measure's name. Sequences without runs
        are ignored.
    measure : ScoreMeasure
        Score that is compared.

    Returns
    -------
    DataFrame, list of str
        The published trackers have one finished run per sequence; their labels end in
        `(published)`.

    Raises
    ------
    ComparisonError
        If a column, a name or a sequence is missing, a score is not valid, or a row occurs twice.
    """
    scores = _read_scores(file, measure)
    sequences = set(runs["sequence"].astype(str))
    scores = scores[scores["sequence"].isin(sequences)]
    if scores.empty:
        raise ComparisonError(f"{file}: no row has a sequence of the experiment.")
    for tracker, names in scores.groupby("tracker")["sequence"]:
        if missing := sorted(sequences - set(names)):
            raise ComparisonError(f"{file}: tracker {tracker} has no score on {missing[0]}.")
    published = scores.assign(
        tracker=scores["tracker"] + " (published)",
        repetition=0,
        status="finished",
    )
    extended = pd.concat([runs, published], ignore_index=True)
    return extended, list(published["tracker"].unique())


def _read_scores(file: Path, measure: ScoreMeasure) -> pd.DataFrame:
    """Return tracker, sequence and score of every row."""
    columns = ["tracker", "sequence", measure.name]
    try:
        # Trackers can be called "NA". Blank lines are kept for the numbers of the lines.
        table = pd.read_csv(
            file, dtype=str, index_col=False, keep_default_na=False, skip_blank_lines=False
        )
    except (UnicodeDecodeError, pd.errors.ParserError, pd.errors.EmptyDataError) as error:
        raise ComparisonError(f"{file}: not a CSV file ({error}).") from error
    if missing := [name for name in columns if name not in table]:
        raise ComparisonError(
            f"{file}: missing columns {', '.join(missing)}. Needed are {', '.join(columns)}."
        )
    table = table[columns].fillna("")
    table = table[(table != "").any(axis="columns")]
    scores = pd.to_numeric(table[measure.name], errors="coerce")
    highest = np.finfo(float).max if measure.unit == "px" else 1.0
    expected = "a number of pixels" if measure.unit == "px" else "a number from 0 to 1"
    problems = {
        "the tracker has no name": table["tracker"].str.strip() == "",
        "the sequence has no name": table["sequence"].str.strip() == "",
        "an earlier line has the same tracker and sequence": table.duplicated(columns[:2]),
        f"{measure.name} is not {expected}": ~scores.between(0.0, highest),
    }
    for problem, is_wrong in problems.items():
        if is_wrong.any():
            row = int(np.flatnonzero(is_wrong)[0])
            line, values = int(table.index[row]) + 2, ",".join(table.iloc[row])
            raise ComparisonError(f"{file}, line {line}: {problem} ({values}).")
    return table.assign(**{measure.name: scores})
