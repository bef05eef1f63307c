"""From scores to findings: the generic tests of the ledger, and the way to the checks.

judge(claim, scores, tables={}) -> list[Finding]
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import nan

import pandas as pd

from bench.claims.checks import CHECKS
from bench.claims.findings import Evidence, Finding
from bench.claims.kinds import (
    SCORES,
    BoundTest,
    CellTest,
    CheckTest,
    InteractionTest,
    Limits,
    LostTest,
    NoTest,
    PartsTest,
    PartTest,
    RatioTest,
)
from bench.claims.ledger import Claim
from bench.claims.measuring import limited, matching, named_columns, selections, verdict_of
from bench.claims.readings import readings_among, rows_under
from bench.statistics.verdicts import (
    LEAST_CELLS,
    NOWHERE,
    Verdict,
    check,
    conjunction,
    undecided,
)

__all__ = ["COLUMNS", "NOT_RUN", "judge"]

COLUMNS = ("sequence", "scene", "light", "repetition", "frames", "kept_scene")
"""Columns of every table of scores, whatever the paper."""

_DEFAULTS: Mapping[str, int | bool] = {"repetition": 0, "frames": 1, "kept_scene": True}
"""What tables beside the scores need not have."""

NOT_RUN = "nothing was run that tests it; give --all"
"""Why a claim is undecided that waits for more to be run."""


def judge(
    claim: Claim, scores: pd.DataFrame, tables: Mapping[str, pd.DataFrame] | None = None
) -> list[Finding]:
    """Judge a claim under every reading that was run.

    Parameters
    ----------
    claim : Claim
        An entry of the ledger.
    scores : DataFrame
        One row a run: `sequence` (without variant), `scene`, `light`, `repetition`, `frames`
        (length with the given first frame), `kept_scene` (bool), and counts that include the
        given frame: `success_frames`, `frames_inside`, `first_loss` (`frames` for never). Of
        the ledger's readings, and of the claim's test, the columns that they name. Rows of
        readings that the ledger does not list are ignored.
    tables : mapping of str to DataFrame, optional
        What tests and checks read besides, by name; `sequence` and `scene` in those that are
        judged by cells, and columns like those of the scores.

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
    evidence = Evidence(claim, scores, tables or {})
    if isinstance(test, NoTest):
        return [Finding(claim.id, Verdict("not-testable", nan, NOWHERE, 0, test.reason))]
    if isinstance(test, CheckTest):
        found = CHECKS[test.check](evidence)
    else:
        parts = test.parts if isinstance(test, PartsTest) else {"": test}
        frames = {name: _frame(evidence, part) for name, part in parts.items()}
        found = list(_judged(claim, parts, frames)) if all(map(_is_there, frames.values())) else []
    return found or [Finding(claim.id, undecided(NOT_RUN + "."))]


def _is_there(frame: pd.DataFrame | None) -> bool:
    return frame is not None


def _frame(evidence: Evidence, test: PartTest) -> pd.DataFrame | None:
    """The rows that a test is about, of whatever reading; None where its table was not made."""
    table = evidence.scores if test.table == SCORES else evidence.tables.get(test.table)
    if table is None:
        return None
    if test.table != SCORES:
        table = table.copy(deep=False)
        for column, value in _DEFAULTS.items():
            if column not in table:
                table[column] = value
    general, named = [*COLUMNS, *evidence.claim.readings.columns], named_columns(test)
    for column in (*(general if test.table == SCORES else ()), *named):
        if column not in table:
            words = f"the {'scores have' if test.table == SCORES else f'table {test.table} has'}"
            raise ValueError(f"claim {evidence.claim.id}: {words} no column {column!r}.")
    table = table[[column for column in table if column in {*general, *named}]]
    if isinstance(test, BoundTest | RatioTest):
        return limited(table, test.where)
    sequences: list[object] = [*test.sequences]
    if isinstance(test, InteractionTest):
        sequences += test.against.get("sequence", [])
    table = table[table["sequence"].isin(sequences)]
    # Rows that it does not compare have readings, too, but these are not the claim's.
    compared = set[object]()
    for rows in selections(test):
        for limits in _limits(test):
            compared.update(matching(limited(table, limits), rows).index)
    return table[table.index.isin(compared)]


def _limits(test: CellTest) -> list[Limits]:
    """Where rows lie that a test looks at; its own groups are judged beside `where`."""
    if isinstance(test, InteractionTest):
        return [test.where, test.against]
    return [{}] if test.groups else [test.where]


@dataclass(frozen=True)
class _Part:
    """A test with the rows of one reading."""

    name: str
    test: PartTest
    rows: pd.DataFrame

    @property
    def is_run(self) -> bool:
        """Whether there are rows of all that the test compares."""
        if isinstance(self.test, BoundTest | RatioTest):
            return len(self.rows) > 0
        return not any(matching(self.rows, rows).empty for rows in selections(self.test))

    @property
    def n_metrics(self) -> int:
        """In how many ways it is judged."""
        return 1 if isinstance(self.test, BoundTest | RatioTest) else len(self.test.metrics)

    @property
    def lights(self) -> set[str]:
        """Lights of the scenes; none of what has no scenes."""
        return set(self.rows["light"].unique()) if "light" in self.rows else set()

    def limited(self, limits: Limits) -> "_Part":
        """The same on fewer rows, where it has such a column at all."""
        known = {column: values for column, values in limits.items() if column in self.rows}
        return replace(self, rows=limited(self.rows, known))


def _judged(
    claim: Claim, tests: Mapping[str, PartTest], frames: Mapping[str, pd.DataFrame | None]
) -> Iterator[Finding]:
    """Findings by reading, light, and scenes."""
    tables = {name: frame for name, frame in frames.items() if frame is not None}
    named = {column for test in tests.values() for column in named_columns(test)}
    for reading in readings_among(claim.readings, list(tables.values()), named):
        parts = [
            _Part(
                name, test, rows_under(claim.readings, tables[name], reading, named_columns(test))
            )
            for name, test in tests.items()
        ]
        lights = sorted(set[str]().union(*(part.lights for part in parts)))
        for light in ("both", *(lights if len(lights) > 1 else ())):
            here = parts if light == "both" else [p.limited({"light": [light]}) for p in parts]
            if not all(part.is_run for part in here):
                continue
            kept = [part.limited({"kept_scene": [True]}) for part in here]
            found = {"kept": list(_verdicts(claim, kept))}
            are_all = all(len(k.rows) == len(h.rows) for k, h in zip(kept, here, strict=True))
            found["drawn"] = found["kept"] if are_all else list(_verdicts(claim, here))
            for scenes, verdicts in found.items():
                for metric, group, verdict in verdicts:
                    yield Finding(
                        claim.id,
                        verdict,
                        metric,
                        reading=reading,
                        light=light,
                        scenes=scenes,
                        group=group,
                        post_hoc=claim.readings.is_post_hoc(reading),
                    )


def _verdicts(claim: Claim, parts: list[_Part]) -> Iterator[tuple[str, str, Verdict]]:
    """Metric, group ('' for the whole) and verdict; a claim with parts holds where all do."""
    if len(parts) == 1:
        yield from _whole_and_groups(claim, parts[0])
        return
    said = {
        f"{part.name}, {metric.replace('_', ' ')}" if part.n_metrics > 1 else part.name: verdict
        for part in parts
        for metric, group, verdict in _whole_and_groups(claim, part)
        if not group
    }
    whole = conjunction(list(said.values()), list(said))
    reasons = [f"{name}: {v.verdict.replace('-', ' ')}, {v.reason}" for name, v in said.items()]
    yield "", "", replace(whole, reason=" ".join(reasons))
    for name, verdict in said.items():
        yield "", name, verdict


def _whole_and_groups(claim: Claim, part: _Part) -> Iterator[tuple[str, str, Verdict]]:
    test = part.test
    if isinstance(test, BoundTest | RatioTest):
        yield "", "", verdict_of(claim.id, test, part.rows, "")
        return
    groups = test.groups
    if not groups and len(test.sequences) > 1:
        groups = {name: {**test.where, "sequence": [name]} for name in test.sequences}
    for metric in test.metrics:
        by_group = {
            name: verdict_of(claim.id, test, limited(part.rows, limits), metric)
            for name, limits in groups.items()
            if not isinstance(test, InteractionTest)
        }
        if isinstance(test, LostTest):
            whole = _lost_verdict(test, by_group)
        elif test.every:
            whole = conjunction(list(by_group.values()), list(by_group))
        else:
            is_one_side = isinstance(test, InteractionTest)
            rows = part.rows if is_one_side else limited(part.rows, test.where)
            whole = verdict_of(claim.id, test, rows, metric)
        yield metric, "", whole
        for name, verdict in by_group.items():
            yield metric, name, verdict


def _lost_verdict(test: LostTest, parts: Mapping[str, Verdict]) -> Verdict:
    """Counts sequences: the claim is of each one's share, not of its interval."""
    lost = [name for name, part in parts.items() if part.statistic >= test.share]
    fewest = min(part.cells for part in parts.values())
    words = f"lost in {100 * test.share:.0f} % of the runs or more: {', '.join(lost) or 'none'}"
    if fewest < LEAST_CELLS:
        return undecided(f"{words}; {LEAST_CELLS} cells of each sequence are needed.")
    return check(len(lost) >= test.least, float(len(lost)), f"{words}.", fewest)
