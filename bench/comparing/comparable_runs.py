"""Runs that can be compared, stored or published: of one protocol, with all scores."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from math import isfinite, nan
from pathlib import Path

import numpy as np
import pandas as pd

from trackmark.bench.protocols import STORED_ONCE, TIMING, title
from trackmark.bench.store.files import ResultsError
from trackmark.reports.tables import Measure


class ComparisonError(ResultsError):
    """Runs that cannot be compared; the message names them and the remedy."""


class AllFailedError(ComparisonError):
    """Every run of every tracker failed."""


def of_protocol(runs: pd.DataFrame, stored: str, measure: Measure) -> tuple[pd.DataFrame, Measure]:
    """Return runs by one protocol, filed as one-pass, and the measure with the protocol's title.

    `runs`: as `bench.load_results` returns them. `stored`: name under which runs by the protocol
    are filed. Timing runs stay. Only one-pass runs have a first loss. The title names one-pass only
    if runs by other protocols exist. Raises `ComparisonError` if no run is by the protocol.
    """
    protocols = runs["protocol"].astype(str)
    others = [title(name) for name in protocols.unique() if name not in (stored, TIMING)]
    if stored not in protocols.unique():
        remedy = f" Stored are runs by {', '.join(others)}; choose with --protocol." * bool(others)
        raise ComparisonError(f"no stored run is by the protocol {title(stored)}.{remedy}")
    if others or stored != STORED_ONCE:
        measure = replace(measure, title=f"{measure.title}, protocol {title(stored)}")
    if stored == STORED_ONCE:
        return runs, measure
    chosen = protocols.isin([stored, TIMING])
    renamed = protocols[chosen].replace(stored, STORED_ONCE)
    return runs[chosen].assign(protocol=renamed, first_loss=nan), measure


def with_published(
    runs: pd.DataFrame, file: Path, measure: Measure
) -> tuple[pd.DataFrame, list[str]]:
    """Return the runs with a row per published score, and the labels of these trackers.

    `runs`: as `bench.load_results` returns them. `file`: CSV with the columns `tracker`, `sequence`
    and the measure's name; other sequences than those of the runs are left out. Labels end in
    `(published)`. Raises `ComparisonError` if a column, a name, a number or a sequence is missing,
    a score is impossible, or a row occurs twice.
    """
    published = _read_published_scores(file, measure)
    sequences = set(runs["sequence"].astype(str))
    published = published[published["sequence"].isin(sequences)]
    if published.empty:
        raise ComparisonError(f"{file}: no row is about a sequence that was run.")
    for tracker, names in published.groupby("tracker")["sequence"]:
        if missing := sorted(sequences - set(names)):
            raise ComparisonError(f"{file}: tracker {tracker} has no score on {missing[0]}.")
    published = published.assign(
        tracker=published["tracker"] + " (published)",
        repetition=0,
        protocol=STORED_ONCE,
        status="finished",
    )
    plain = runs.astype(dict.fromkeys(runs.columns[runs.dtypes == "category"], object))
    whole = pd.concat([plain, published], ignore_index=True)
    return whole, list(published["tracker"].unique())


def chosen_trackers(
    scored: pd.DataFrame, trackers: Sequence[str] | None, against: str | None
) -> list[str]:
    """Return the labels of the compared trackers; raise `ComparisonError` if there are too few."""
    stored = [str(name) for name in scored["tracker"].unique()]
    chosen = list(stored if trackers is None else trackers)
    if against is not None and against not in chosen:
        chosen.insert(0, against)
    for name in chosen:
        if name not in stored:
            raise ComparisonError(
                f"{name!r}: no stored runs of this tracker. Stored are {', '.join(stored)}."
            )
        if chosen.count(name) > 1:
            raise ComparisonError(
                f"{name!r} is named twice. Name each tracker once; a tracker is not compared with "
                "itself."
            )
    if len(chosen) < 2:
        raise ComparisonError(f"{len(chosen)} tracker to compare. Name two or more.")
    return chosen


def check_runs(
    scored: pd.DataFrame, chosen: Sequence[str], sequences: Sequence[str], measure: Measure
) -> None:
    """Raise `ComparisonError` unless all runs can be compared."""
    remedy = "with `trackmark run` or with --sequences, or name other trackers."
    for status in ("missing", "stale"):
        rows = scored[scored["status"] == status]
        if len(rows):
            row = rows.iloc[0]
            raise ComparisonError(
                f"tracker {row['tracker']}, sequence {row['sequence']}, repetition "
                f"{row['repetition']}: the run is {status} ({len(rows)} of {len(scored)} runs "
                f"are). All runs are needed. Execute them {remedy}"
            )
    present = set(zip(scored["tracker"].astype(str), scored["sequence"].astype(str), strict=True))
    for name, sequence in product(chosen, sequences):
        if (name, sequence) not in present:
            raise ComparisonError(
                f"tracker {name}, sequence {sequence}: the run is missing. Execute it {remedy}"
            )
    versions = scored.dropna(subset="fingerprint").groupby("sequence", observed=True)["fingerprint"]
    counts = versions.nunique()
    if changed := counts[counts > 1].index.tolist():
        raise ComparisonError(
            f"sequence {changed[0]}: its images or its ground truth changed between stored runs. "
            "Run all trackers on it again."
        )
    if measure.name not in scored:
        raise ComparisonError(f"the runs have no score {measure.name!r}.")
    undefined = scored[~np.isfinite(scored[measure.name])]
    if len(undefined):
        row = undefined.iloc[0]
        raise ComparisonError(
            f"tracker {row['tracker']}, sequence {row['sequence']}: {measure.title} is "
            f"{row[measure.name]}. Choose another --metric, or omit the sequence."
        )


def _read_published_scores(file: Path, measure: Measure) -> pd.DataFrame:
    """Read tracker, sequence and score of every row; the index holds the line in the file."""
    columns = ["tracker", "sequence", measure.name]
    try:
        table = pd.read_csv(
            file, dtype=str, index_col=False, keep_default_na=False, skip_blank_lines=False
        )
    except (UnicodeDecodeError, pd.errors.ParserError, pd.errors.EmptyDataError) as error:
        raise ComparisonError(f"{file}: not a CSV file ({error}).") from error
    if missing := [name for name in columns if name not in table]:
        raise ComparisonError(
            f"{file}: missing columns {', '.join(missing)}. Needed are {', '.join(columns)}."
        )
    table.index += 2  # the first line holds the columns' names
    table = table.loc[(table != "").any(axis=1), columns].copy()
    for column in columns[:2]:
        empty = table[column].str.strip() == ""
        if empty.any():
            place = f"{file}, line {empty.idxmax()}"
            raise ComparisonError(f"{place}: the {column} has no name. Add it, or remove the row.")
    scores = [
        _parse_score(text, f"{file}, line {line}", measure)
        for line, text in table[measure.name].items()
    ]
    twice = table.duplicated(["tracker", "sequence"])
    if twice.any():
        place = f"{file}, line {twice.idxmax()}"
        raise ComparisonError(f"{place}: an earlier line has the same tracker and sequence.")
    return table.assign(**{measure.name: np.array(scores, np.float64)})


def _parse_score(text: str, place: str, measure: Measure) -> float:
    """Return the score in a text; raise `ComparisonError` if it is impossible or not a number."""
    try:
        score = float(text)
    except ValueError:
        score = nan
    if not isfinite(score) or "_" in text:  # Python reads 1_0 as 10
        raise ComparisonError(f"{place}: {text!r} is not a number.")
    if score < 0 or (score > 1 and measure.unit != "px"):
        raise ComparisonError(
            f"{place}: {score:g} is not a {measure.name}. Expected is a number "
            f"{'of pixels, 0 or more' if measure.unit == 'px' else 'from 0 to 1'}."
        )
    return score
