"""From scores to findings: the generic tests of the ledger, and the way to the checks.

judge(claim, scores, tables={}) -> list[Finding]
"""

from collections.abc import Iterator, Mapping
from zlib import crc32

import numpy as np
import pandas as pd

from bench.claims.checks import CHECKS
from bench.claims.findings import Evidence, Finding
from bench.claims.ledger import (
    AllTest,
    BestTest,
    CheckTest,
    Claim,
    EqualTest,
    InteractionTest,
    Limits,
    LostTest,
    NumberTest,
    OrderTest,
    Rows,
)
from bench.statistics.verdicts import (
    LEAST_CELLS,
    Verdict,
    all_kept,
    check,
    conjunction,
    equal,
    number,
    order,
    order_of_groups,
    share_at_least,
    undecided,
)

__all__ = ["COLUMNS", "judge"]

COLUMNS = (
    "representation",
    "sequence",
    "scene",
    "light",
    "initial",
    "variant",
    "repetition",
    "frames",
    "kept_scene",
)
CELL = ["sequence", "scene"]

NOT_RUN = "nothing was run that tests it; give --all"

CellTest = OrderTest | EqualTest | InteractionTest | AllTest | LostTest | BestTest | NumberTest


def judge(
    claim: Claim, scores: pd.DataFrame, tables: Mapping[str, pd.DataFrame] | None = None
) -> list[Finding]:
    """Judge a claim under every reading that was run.

    Parameters
    ----------
    claim : Claim
        An entry of the ledger.
    scores : DataFrame
        One row a run: `representation`, `sequence` (without variant), `scene`, `light`,
        `initial`, `variant` ('' for as written), `repetition`, `frames` (length with the given
        first frame), `kept_scene` (bool), and counts that include the given frame:
        `success_frames`, `frames_inside`, `first_loss` (`frames` for never). Columns that the
        claim's test names besides. Rows of readings that the ledger does not list are ignored.
    tables : mapping of str to DataFrame, optional
        What the checks need, by the names that `bench.claims.checks` gives.

    Returns
    -------
    list of Finding
        By reading, light, scenes (kept and all drawn), metric, and group; one undecided where
        nothing was run.

    Raises
    ------
    ValueError
        For a column that is missing, naming it and the claim.
    """
    test = claim.test
    if isinstance(test, CheckTest):
        found = CHECKS[test.check](Evidence(claim, scores, tables or {}))
    else:
        _require(claim, test, scores)
        found = [
            finding
            for labels, rows in _readings(claim, test, scores)
            for finding in _judge_reading(claim, test, labels, rows)
        ]
    return found or [Finding(claim.id, undecided(NOT_RUN + "."))]


def _require(claim: Claim, test: CellTest, scores: pd.DataFrame) -> None:
    named = {column for rows in _selections(test) for column in rows}
    named |= {column for limits in (test.where, *test.groups.values()) for column in limits}
    for column in (*COLUMNS, *test.metrics, *sorted(named)):
        if column not in scores:
            raise ValueError(f"claim {claim.id}: the scores have no column {column!r}.")


def _selections(test: CellTest) -> list[Rows]:
    """The rows that a test compares."""
    if isinstance(test, OrderTest | EqualTest | InteractionTest):
        return [test.better, test.worse]
    if isinstance(test, BestTest):
        return [test.rows, *test.others]
    return [test.rows]


def _readings(
    claim: Claim, test: CellTest, scores: pd.DataFrame
) -> Iterator[tuple[dict[str, str], pd.DataFrame]]:
    """Labels and rows of each reading; what the test itself names is no reading."""
    named = {column for rows in _selections(test) for column in rows}
    sequences = [*test.sequences, *(test.against if isinstance(test, InteractionTest) else ())]
    tested = scores[scores["sequence"].isin(sequences)]
    for initial in claim.readings.initial[: 1 if "initial" in named else None]:
        for variant in claim.readings.variant[: 1 if "variant" in named else None]:
            rows = tested
            if "initial" not in named:
                rows = rows[rows["initial"] == initial]
            if "variant" not in named:
                rows = rows[rows["variant"] == variant]
            lights = sorted(rows["light"].unique())
            for light in ("both", *(lights if len(lights) > 1 else ())):
                part = rows if light == "both" else rows[rows["light"] == light]
                if any(_matching(part, selection).empty for selection in _selections(test)):
                    continue
                for scenes, chosen in (("kept", part[part["kept_scene"]]), ("drawn", part)):
                    labels = {"initial": initial, "variant": variant, "light": light}
                    yield {**labels, "scenes": scenes}, chosen


def _judge_reading(
    claim: Claim, test: CellTest, labels: Mapping[str, str], rows: pd.DataFrame
) -> Iterator[Finding]:
    """The groups first, then what is made of all."""
    post_hoc = claim.readings.is_post_hoc(labels["initial"], labels["variant"])
    groups: dict[str, Limits] = test.groups
    if not groups and len(test.sequences) > 1:
        groups = {sequence: {"sequence": [sequence]} for sequence in test.sequences}
    for metric in test.metrics:
        parts = {
            name: _verdict(claim, test, _limited(rows, limits), metric)
            for name, limits in groups.items()
            if not isinstance(test, InteractionTest)
        }
        if isinstance(test, LostTest):
            whole = _lost_verdict(test, parts)
        elif test.every:
            whole = conjunction(list(parts.values()), list(parts))
        else:
            whole = _verdict(claim, test, _limited(rows, test.where), metric)
        for name, verdict in {"": whole, **parts}.items():
            yield Finding(claim.id, verdict, metric, group=name, post_hoc=post_hoc, **dict(labels))


def _verdict(claim: Claim, test: CellTest, rows: pd.DataFrame, metric: str) -> Verdict:
    """Verdict on the cells of these rows."""
    if isinstance(test, OrderTest):
        return order(_differences(rows, test, metric), test.margin)
    if isinstance(test, EqualTest):
        return equal(_differences(rows, test, metric), test.margin)
    if isinstance(test, InteractionTest):
        theirs = rows["sequence"].isin(test.against)
        # Resamples depend on the claim alone, so that the same scores give the same verdict.
        generator = np.random.default_rng(crc32(claim.id.encode()))
        groups = [_differences(part, test, metric) for part in (rows[~theirs], rows[theirs])]
        return order_of_groups(groups[0], groups[1], generator, test.margin)
    if isinstance(test, BestTest):
        others = [_shares(rows, test, selection, metric) for selection in test.others]
        best = pd.concat(others, axis=1, join="inner").max(axis=1)
        near = (_shares(rows, test, test.rows, metric) - best).dropna() >= -test.margin
        near = near.groupby(CELL).mean() == 1.0
        return share_at_least(near, np.ones(len(near)), test.least, test.lower)
    runs = _matching(rows, test.rows)
    if isinstance(test, NumberTest):
        shares = (runs[metric] / runs["frames"]).to_numpy(np.float64)
        return number(shares) if len(shares) > 1 else undecided("fewer than two runs.")
    kept = (runs["first_loss"] >= runs["frames"]).groupby([runs[key] for key in CELL])
    if isinstance(test, LostTest):
        return share_at_least(kept.size() - kept.sum(), kept.size(), test.share)
    return all_kept(kept.sum(), kept.size())


def _lost_verdict(test: LostTest, parts: Mapping[str, Verdict]) -> Verdict:
    """Counts sequences: the claim is of each one's share, not of its interval."""
    lost = [name for name, part in parts.items() if part.statistic >= test.share]
    fewest = min(part.cells for part in parts.values())
    words = f"lost in {100 * test.share:.0f} % of the runs or more: {', '.join(lost) or 'none'}"
    if fewest < LEAST_CELLS:
        return undecided(f"{words}; {LEAST_CELLS} cells of each sequence are needed.")
    return check(len(lost) >= test.least, float(len(lost)), f"{words}.", fewest)


def _differences(
    rows: pd.DataFrame, test: OrderTest | EqualTest | InteractionTest, metric: str
) -> "pd.Series[float]":
    """Better less worse by cell; lights and the like of a cell are compared one by one."""
    better = _shares(rows, test, test.better, metric)
    pairs = better - _shares(rows, test, test.worse, metric)
    return pairs.dropna().groupby(CELL).mean()


def _shares(rows: pd.DataFrame, test: CellTest, selection: Rows, metric: str) -> "pd.Series[float]":
    """Share of the length, averaged over repetitions, by cell and what else tells runs apart."""
    runs = _matching(rows, selection)
    named = {column for limits in (test.where, *test.groups.values()) for column in limits}
    keys = [*CELL, "light", *sorted(named.difference(CELL, ["light"]))]
    return (runs[metric] / runs["frames"]).groupby([runs[key] for key in keys]).mean()


def _matching(rows: pd.DataFrame, selection: Rows) -> pd.DataFrame:
    return _limited(rows, {column: [value] for column, value in selection.items()})


def _limited(rows: pd.DataFrame, limits: Limits) -> pd.DataFrame:
    for column, values in limits.items():
        rows = rows[rows[column].isin(values)]
    return rows
