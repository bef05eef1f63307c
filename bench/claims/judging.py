"""From scores to findings: the generic tests of the ledger, and the way to a paper's own checks.

judge(claim, scores, tables={}, checks={}) -> list[Finding]
judge_all(claims, scores, tables={}, checks={}) -> list[Conclusion]
"""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from math import nan

import pandas as pd

from bench.claims import kinds
from bench.claims.conclusion import Conclusion, conclude
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
from bench.claims.verdicts import CELL, in_units, verdict_of
from bench.statistics.outcomes import NOWHERE, Verdict, conjunction, enough_of, undecided

__all__ = ["COLUMNS", "NOT_RUN", "headline_sides", "is_tested", "judge", "judge_all"]

COLUMNS = ("sequence", "scene", "light", "repetition", "frames", "kept_scene")
"""Columns of every table of scores, whatever the paper."""

_DEFAULTS: Mapping[str, int | bool] = {"repetition": 0, "frames": 1, "kept_scene": True}
"""What tables beside the scores need not have."""

NOT_RUN = "nothing was run that tests it"
"""Why a claim is undecided that waits for more to be run."""

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
    known: dict[str, Conclusion] = {}
    for name, claim in claims.items():
        if not isinstance(claim.test, kinds.SummaryTest):
            if is_tested(claim, asked):
                findings = judge(claim, scores, tables, checks)
            else:
                findings = [Finding(claim.id, undecided(NOT_RUN + "."))]
            known[name] = conclude(claim, findings)
    for name, claim in claims.items():
        if isinstance(claim.test, kinds.SummaryTest):
            parts = {part: known[part] for part in claim.test.claims}
            known[name] = conclude(claim, _summary(claim, parts))
    return [known[name] for name in claims]


def is_tested(claim: Claim, asked: Collection[str] | None) -> bool:
    """Whether one of the experiments `asked` tests a claim, or it needs none."""
    return asked is None or not claim.experiment or bool({*claim.experiment} & {*asked})


def judge(
    claim: Claim, scores: pd.DataFrame, tables: Tables | None = None, checks: Checks | None = None
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

    Returns
    -------
    list of Finding
        By reading, light, scenes (kept and all drawn), metric, and group; one undecided where
        nothing was run.

    Raises
    ------
    ValueError
        For a column or a check that is missing, naming it and the claim.
    """
    test = claim.test
    if isinstance(test, kinds.NoTest):
        return [Finding(claim.id, Verdict("not-testable", nan, NOWHERE, 0, test.reason))]
    if isinstance(test, kinds.SummaryTest):
        words = "a summary can't be judged without what it sums up."
        raise ValueError(f"claim {claim.id}: {words}")  # noqa: TRY004 - of the ledger, no type
    if isinstance(test, kinds.CheckTest):
        if test.check not in (checks or {}):
            raise ValueError(f"claim {claim.id}: there is no check {test.check!r}.")
        found = [
            replace(one, verdict=_of_check(one.verdict, test))
            for one in (checks or {})[test.check](Evidence(claim, scores, tables or {}))
        ]
    else:
        parts = test.parts if isinstance(test, kinds.PartsTest) else {"": test}
        frames = {name: _frame(claim, part, scores, tables or {}) for name, part in parts.items()}
        there = {name: frame for name, frame in frames.items() if frame is not None}
        found = list(_judged(claim, parts, there)) if len(there) == len(parts) else []
    return found or [Finding(claim.id, undecided(NOT_RUN + "."))]


def _of_check(verdict: Verdict, test: kinds.CheckTest) -> Verdict:
    """The verdict with the unit that the ledger says, and of scenes, unless it has its own."""
    counted = "scene" if verdict.counted == "cell" else verdict.counted
    return replace(verdict, unit=verdict.unit or test.unit, counted=counted)


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
    return light_rows(table, needed)


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
    def n_metrics(self) -> int:
        """In how many ways it is judged."""
        return 1 if isinstance(self.test, kinds.BoundTest | kinds.RatioTest) else len(self.test.by)

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

    def without(self, cells: "pd.MultiIndex") -> "_Part":
        """The same without some cells, where it has cells at all."""
        if not set(CELL) <= set(self.sides[0]):
            return self
        kept = (side[~pd.MultiIndex.from_frame(side[CELL]).isin(cells)] for side in self.sides)
        return replace(self, sides=tuple(kept))


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


def _judged(claim: Claim, tests: Mapping[str, kinds.PartTest], frames: Tables) -> Iterator[Finding]:
    """Findings by reading, light, and scenes."""
    for reading, same, whole in _parts_by_reading(claim.readings, tests, frames):
        parts = _without_failures(whole)
        lights = sorted(set[str]().union(*(part.lights for part in parts)))
        for light in ("both", *(lights if len(lights) > 1 else ())):
            here = parts if light == "both" else [p.limited({"light": [light]}) for p in parts]
            if not all(part.is_run for part in here):
                continue
            kept = [part.limited({"kept_scene": [True]}) for part in here]
            found = {"kept": list(_verdicts(claim, kept))}
            are_all = all(k.n_rows == h.n_rows for k, h in zip(kept, here, strict=True))
            found["drawn"] = found["kept"] if are_all else list(_verdicts(claim, here))
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


def _without_failures(parts: list[_Part]) -> list[_Part]:
    """Without the cells in which a run failed: its companions would stand for it."""
    failed = [
        side.loc[side["failure"] != "", CELL]
        for part in parts
        for side in part.sides
        if "failure" in side and (side["failure"] != "").any()
    ]
    if not failed:
        return parts
    return [part.without(pd.MultiIndex.from_frame(pd.concat(failed))) for part in parts]


def _verdicts(claim: Claim, parts: list[_Part]) -> Iterator[tuple[str, str, Verdict]]:
    """Metric, group ('' for the whole) and verdict; a claim with parts holds where all do."""
    if len(parts) == 1:
        yield from _whole_and_groups(claim, parts[0])
        return
    said = {
        f"{part.name}, {in_words(metric)}" if part.n_metrics > 1 else part.name: verdict
        for part in parts
        for metric, group, verdict in _whole_and_groups(claim, part)
        if not group
    }
    reasons = [
        f"{name}: {verdict.verdict.replace('-', ' ')}, {verdict.told}"
        for name, verdict in said.items()
    ]
    yield "", "", conjunction(list(said.values()), list(said), " ".join(reasons))
    for name, verdict in said.items():
        yield "", name, verdict


def _whole_and_groups(claim: Claim, part: _Part) -> Iterator[tuple[str, str, Verdict]]:
    test = part.test
    if isinstance(test, kinds.BoundTest | kinds.RatioTest):
        yield "", "", in_units(claim, test, "", verdict_of(claim.id, test, part.sides, ""))
        return
    groups = test.groups
    if not groups and len(test.on) > 1:
        groups = {name: {**test.where, "sequence": [name]} for name in test.on}
    whole = part
    if isinstance(test, kinds.InteractionTest):
        groups = {}  # it has two of its own
    else:
        whole = part.limited(test.where)
    limited_parts = {name: part.limited(limits) for name, limits in groups.items()}
    for metric in test.by:
        by_group = {
            name: in_units(claim, test, metric, verdict_of(claim.id, test, one.sides, metric))
            for name, one in limited_parts.items()
        }
        yield metric, "", _whole(claim, whole, test, metric, by_group)
        for name, verdict in by_group.items():
            yield metric, name, verdict


def _whole(
    claim: Claim, part: _Part, test: kinds.CellTest, metric: str, by_group: Mapping[str, Verdict]
) -> Verdict:
    if isinstance(test, kinds.LostTest):
        return enough_of(list(by_group.values()), list(by_group), test.share, test.least)
    if test.every:
        return conjunction(list(by_group.values()), list(by_group))
    return in_units(claim, test, metric, verdict_of(claim.id, test, part.sides, metric))


def _summary(claim: Claim, parts: Mapping[str, Conclusion]) -> list[Finding]:
    """Whether all parts hold, under every reading that all were tested in."""
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

    for reading in readings.all(lambda axis: any(map(has, axis.options.values())), has):
        told = [part.under(reading.names) for part in parts.values()]
        said = [one for one in told if one is not None]
        if len(said) == len(parts):
            found.append(
                Finding(
                    claim.id,
                    conjunction(said, list(parts)),
                    reading=reading.names,
                    same=frozenset([readings.places(reading)]),
                    post_hoc=reading.post_hoc,
                )
            )
    return found or [Finding(claim.id, undecided(NOT_RUN + "."))]
