"""From scores to findings: the generic tests of the ledger, and the way to a paper's own checks.

judge(claim, scores, tables={}, checks={}) -> list[Finding]
judge_all(claims, scores, tables={}, checks={}) -> list[Conclusion]
"""

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache

import pandas as pd

from bench.claims import kinds
from bench.claims.conclusion import Conclusion, conclude
from bench.claims.failures import all_failed, failure_note, with_worst_scores
from bench.claims.findings import Check, Evidence, Finding
from bench.claims.ledger import Claim
from bench.claims.readings import NO_MATTER, Option, Reading, Readings, in_words
from bench.claims.sides import (
    SETTLED,
    Compared,
    Table,
    headline_rows,
    light_rows,
    limited,
    rows_by_reading,
)
from bench.claims.verdicts import verdict_of
from bench.statistics.verdict_rules import Judge, Verdict, conjunction, inconclusive

__all__ = ["COLUMNS", "NOT_RUN", "headline_sides", "is_tested", "judge", "judge_all"]

COLUMNS = ("sequence", "scene", "light", "repetition", "frames", "kept_scene")
"""Columns of every table of scores, whatever the paper."""

_DEFAULTS: Mapping[str, int | bool] = {"repetition": 0, "frames": 1, "kept_scene": True}
"""What tables beside the scores need not have."""

NOT_RUN = "not run"
"""Beginning of the reason of a claim that waits for an experiment."""

Tables = Mapping[str, pd.DataFrame]
Checks = Mapping[str, Check]


def judge_all(
    claims: Mapping[str, Claim],
    scores: pd.DataFrame,
    tables: Tables | None = None,
    checks: Checks | None = None,
    asked: Collection[str] | None = None,
) -> list[Conclusion]:
    """Judge all claims of a ledger, and conclude; summaries of others come after these.

    Parameters are those of `judge`; a claim that sums up another one names it by its id. Of the
    experiments that are named there only those in `asked` were run, all by default: a claim that
    none of them tests isn't judged on the runs of others.
    """

    @cache
    def concluded(name: str, comparisons: int) -> Conclusion:
        claim, findings = claims[name], list[Finding]()
        if is_tested(claim, asked):
            findings = judge(claim, scores, tables, checks, comparisons)
        if not findings or findings[0].verdict.reason.startswith(NOT_RUN):
            findings = [_not_run(claim, asked)]
        return conclude(claim, findings)

    return [
        conclude(claim, _summary(claim, concluded))
        if isinstance(claim.test, kinds.SummaryTest)
        else concluded(name, 1)
        for name, claim in claims.items()
    ]


def _not_run(claim: Claim, asked: Collection[str] | None = None) -> Finding:
    """Return the finding on a claim that no run tests; it names the experiments not `asked`."""
    missing = [name for name in claim.experiment if name not in (asked or ())]
    experiments = ", ".join(missing or claim.experiment)
    reason = f"{NOT_RUN}: experiment {experiments}" if experiments else NOT_RUN
    return Finding(claim.id, inconclusive(reason))


def is_tested(claim: Claim, asked: Collection[str] | None) -> bool:
    """Whether one of the experiments `asked` tests a claim, or it needs none."""
    return asked is None or not claim.experiment or bool({*claim.experiment} & {*asked})


def judge(
    claim: Claim,
    scores: pd.DataFrame,
    tables: Tables | None = None,
    checks: Checks | None = None,
    comparisons: int = 1,
) -> list[Finding]:
    """Judge a claim, that is no summary of others, under every reading that was run.

    Parameters
    ----------
    claim : Claim
        An entry of the ledger.
    scores : DataFrame
        One row a run: `sequence` (without variant), `scene`, `light`, `repetition`, `frames`
        (length with the given first frame), `kept_scene` (bool), and counts that include the
        given frame: `success_frames`, `frames_inside`, `first_loss` (`frames` for never).
        `settled`, what `bench.claims.sides.run_key` gives of its tracker; `failure`, empty for a
        run that has scores. Of the claim's test, the columns that it names.
    tables : mapping of str to DataFrame, optional
        What tests and checks read besides, by name; `sequence` and `scene` in those that are
        judged by cells, and columns like those of the scores.
    checks : mapping of str to callable, optional
        The paper's own, by the name that the ledger gives.
    comparisons : int
        Number of claims that share the 5 % of false answers, in a summary of several.

    Returns
    -------
    list of Finding
        By reading, light, scenes (kept and all drawn), metric, and group; one that is
        inconclusive if nothing was run.

    Raises
    ------
    ValueError
        For a column or a check that is missing, naming it and the claim.
    """
    test = claim.test
    if isinstance(test, kinds.NoTest):
        return [Finding(claim.id, Verdict("not testable", reason=test.reason))]
    if isinstance(test, kinds.SummaryTest):
        words = "a summary can't be judged without what it sums up."
        raise ValueError(f"claim {claim.id}: {words}")  # noqa: TRY004 - of the ledger, no type
    if isinstance(test, kinds.CheckTest):
        if test.check not in (checks or {}):
            raise ValueError(f"claim {claim.id}: there is no check {test.check!r}.")
        scores = with_worst_scores(scores, kinds.COUNTS)
        evidence = Evidence(claim, scores, tables or {}, comparisons)
        found = [
            replace(one, verdict=replace(one.verdict, unit=one.verdict.unit or test.unit))
            for one in (checks or {})[test.check](evidence)
        ]
    else:
        parts = test.parts if isinstance(test, kinds.PartsTest) else {"": test}
        frames = {name: _frame(claim, part, scores, tables or {}) for name, part in parts.items()}
        there = {name: frame for name, frame in frames.items() if frame is not None}
        complete = len(there) == len(parts)
        found = list(_judged(claim, parts, there, comparisons)) if complete else []
    return found or [_not_run(claim)]


def _frame(
    claim: Claim, test: kinds.PartTest, scores: pd.DataFrame, tables: Tables
) -> pd.DataFrame | None:
    """The table that a test is about; None where it was not made."""
    table = scores if test.table == kinds.SCORES else tables.get(test.table)
    if table is None:
        return None
    if test.table != kinds.SCORES:
        table = table.copy(deep=False)
        for column, value in _DEFAULTS.items():
            if column not in table:
                table[column] = value
    general = COLUMNS if test.table == kinds.SCORES else ()
    for column in (*general, *sorted(test.columns)):
        if column not in table:
            words = (
                f"the {'scores have' if test.table == kinds.SCORES else f'table {test.table} has'}"
            )
            raise ValueError(f"claim {claim.id}: {words} no column {column!r}.")
    needed = {*COLUMNS, *test.columns, *claim.readings.limits, SETTLED, "failure", "tracker"}
    rows = light_rows(table, {*needed, "text", "centre_error"})
    return with_worst_scores(rows, _metrics(test))


@dataclass(frozen=True)
class _Part:
    """A test with the rows of its sides under one reading."""

    name: str
    test: kinds.PartTest
    sides: tuple[pd.DataFrame, ...]

    @property
    def is_run(self) -> bool:
        """Whether there are rows of all that the test compares."""
        return not any(side.empty for side in self.sides)

    @property
    def n_rows(self) -> int:
        """Rows of all sides."""
        return sum(map(len, self.sides))

    @property
    def lights(self) -> set[str]:
        """Lights of the scenes; none of what has no scenes."""
        return {light for side in self.sides if "light" in side for light in side["light"].unique()}

    def limited(self, limits: kinds.Limits) -> "_Part":
        """The same on fewer rows, where it has such a column at all."""
        known = {column: values for column, values in limits.items() if column in self.sides[0]}
        return replace(self, sides=tuple(limited(side, known) for side in self.sides))


def _metrics(test: kinds.PartTest) -> tuple[str, ...]:
    """Return the metrics by which a test is judged, one by one; an empty name for tables' tests."""
    return ("",) if isinstance(test, kinds.BoundTest | kinds.RatioTest) else test.by


def _parts_by_reading(
    readings: Readings, tests: Mapping[str, kinds.PartTest], frames: Tables
) -> Iterator[tuple[Reading, frozenset[tuple[str, ...]], list[_Part]]]:
    """Readings that ask for different rows, what others ask for the same, and these rows."""
    named = {column for test in tests.values() for column in test.columns}
    tables = {id(frame): Table(frame, readings) for frame in frames.values()}
    sides = {name: _sides(test, tables[id(frames[name])], named) for name, test in tests.items()}
    every = [side for found in sides.values() for side in found]
    for reading, same, rows in rows_by_reading(every, readings):
        left = iter(rows)
        parts = [
            _Part(name, test, tuple(next(left) for _ in sides[name]))
            for name, test in tests.items()
        ]
        yield reading, same, parts


def _sides(test: kinds.PartTest, table: Table, named: set[str]) -> list[Compared]:
    return [
        Compared(
            table,
            side,
            test.sequences,
            test.limits,
            named,
            any_will_do=isinstance(test, kinds.NumberTest),
        )
        for side in test.sides
    ]


def headline_sides(
    claim: Claim, scores: pd.DataFrame, tables: Tables
) -> Iterator[tuple[str, kinds.PartTest, list[pd.DataFrame]]]:
    """Tests of a claim by the names of its parts, with the rows of each side, index and all.

    Rows are those of the headline reading, of rival ones together, on the scenes kept. A test of
    which nothing was run, and a claim without generic tests, gives none.
    """
    if isinstance(claim.test, kinds.NoTest | kinds.SummaryTest | kinds.CheckTest):
        return
    parts = claim.test.parts if isinstance(claim.test, kinds.PartsTest) else {"": claim.test}
    named = {column for test in parts.values() for column in test.columns}
    for name, test in parts.items():
        frame = _frame(claim, test, scores, tables)
        if frame is None:
            continue
        sides = _sides(test, Table(frame, claim.readings), named)
        found = [*zip(*headline_rows(sides, claim.readings), strict=True)]
        rows = tuple(pd.concat(one).loc[lambda one: ~one.index.duplicated()] for one in found)
        if not rows:
            continue
        part = _Part(name, test, rows).limited({"kept_scene": [True]})
        whole = part if isinstance(test, kinds.InteractionTest) else part.limited(test.where)
        if whole.is_run:
            yield name, test, list(whole.sides)


def _judged(
    claim: Claim, tests: Mapping[str, kinds.PartTest], frames: Tables, comparisons: int
) -> Iterator[Finding]:
    """Findings by reading, light, and scenes."""
    for reading, same, parts in _parts_by_reading(claim.readings, tests, frames):
        lights = sorted(set[str]().union(*(part.lights for part in parts)))
        for light in ("both", *(lights if len(lights) > 1 else ())):
            here = parts if light == "both" else [p.limited({"light": [light]}) for p in parts]
            if not all(part.is_run for part in here):
                continue
            kept = [part.limited({"kept_scene": [True]}) for part in here]
            found = {"kept": list(_verdicts(claim, kept, comparisons))}
            are_all = all(k.n_rows == h.n_rows for k, h in zip(kept, here, strict=True))
            found["drawn"] = found["kept"] if are_all else list(_verdicts(claim, here, comparisons))
            for scenes, verdicts in found.items():
                for metric, group, verdict in verdicts:
                    yield Finding(
                        claim.id,
                        verdict,
                        metric,
                        reading=reading.names,
                        same=same,
                        light=light,
                        scenes=scenes,
                        group=group,
                        post_hoc=reading.post_hoc,
                    )


def _verdicts(
    claim: Claim, parts: list[_Part], comparisons: int
) -> Iterator[tuple[str, str, Verdict]]:
    """Metric, group ('' for the whole) and verdict; a claim with parts holds where all do."""
    if len(parts) == 1:
        for metric in _metrics(parts[0].test):
            yield from _whole_and_groups(claim, parts[0], metric, comparisons)
        return
    judges: dict[str, Judge] = {}
    for part in parts:
        metrics = _metrics(part.test)
        for metric in metrics:
            name = f"{part.name}, {in_words(metric)}" if len(metrics) > 1 else part.name
            judges[name] = _whole_judge(claim, part, metric, _group_judges(claim, part, metric))
    yield "", "", conjunction(judges, comparisons)
    for name, judge_part in judges.items():
        yield "", name, judge_part(1)


def _whole_and_groups(
    claim: Claim, part: _Part, metric: str, comparisons: int
) -> Iterator[tuple[str, str, Verdict]]:
    groups = _group_judges(claim, part, metric)
    yield metric, "", _whole_judge(claim, part, metric, groups)(comparisons)
    for name, judge_group in groups.items():
        yield metric, name, judge_group(1)


def _group_judges(claim: Claim, part: _Part, metric: str) -> dict[str, Judge]:
    """Return what judges each group of a part's rows, by the group's name."""
    test = part.test
    if isinstance(test, kinds.BoundTest | kinds.RatioTest | kinds.InteractionTest):
        return {}
    groups = test.groups
    if not groups and len(test.on) > 1:
        groups = {name: {**test.where, "sequence": [name]} for name in test.on}
    return {name: _judge(claim, part.limited(limits), metric) for name, limits in groups.items()}


def _whole_judge(claim: Claim, part: _Part, metric: str, groups: Mapping[str, Judge]) -> Judge:
    """Return what judges all rows of a part, or all of its groups as parts of their own."""
    test = part.test
    if isinstance(test, kinds.BoundTest | kinds.RatioTest):
        return _judge(claim, part, metric)
    if test.every:
        return cache(lambda comparisons: conjunction(groups, comparisons))
    # The two sides of an interaction are limited one by one.
    whole = part if isinstance(test, kinds.InteractionTest) else part.limited(test.where)
    return _judge(claim, whole, metric)


def _judge(claim: Claim, part: _Part, metric: str) -> Judge:
    @cache
    def judge_part(comparisons: int) -> Verdict:
        if reason := all_failed(part.sides):
            return inconclusive(reason)
        verdict = verdict_of(claim, part.test, part.sides, metric, comparisons)
        reasons = filter(None, [verdict.reason, failure_note(part.sides)])
        return replace(verdict, reason="; ".join(reasons))

    return judge_part


def _summary(claim: Claim, concluded: Callable[[str, int], Conclusion]) -> list[Finding]:
    """Judge whether all parts hold, under every reading in which all were tested."""
    assert isinstance(claim.test, kinds.SummaryTest)
    parts = {name: concluded(name, 1) for name in claim.test.claims}
    readings, found = claim.readings, list[Finding]()
    places = {place for part in parts.values() for one in part.findings for place in one.same}
    seen = {
        id(axis.options[name])
        for place in places
        for axis, name in zip(readings.axes.values(), place, strict=True)
        if name != NO_MATTER
    }

    def has(option: Option) -> bool:
        return id(option) in seen

    def part_judge(name: str, reading: Reading) -> Judge:
        def judge_part(comparisons: int) -> Verdict:
            verdict = concluded(name, comparisons).under(reading.names)
            assert verdict is not None  # the part was tested under this reading
            return verdict

        return judge_part

    for reading in readings.all(lambda axis: any(map(has, axis.options.values())), has):
        if any(part.under(reading.names) is None for part in parts.values()):
            continue
        found.append(
            Finding(
                claim.id,
                conjunction({name: part_judge(name, reading) for name in parts}),
                reading=reading.names,
                same=frozenset([readings.places(reading)]),
                post_hoc=reading.post_hoc,
            )
        )
    return found or [_not_run(claim)]
