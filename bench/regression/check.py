"""Comparison of trackers with a baseline: changes by sequence and in the mean, and regressions."""

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from math import isfinite, nan
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from trackmark.bench.regression.baseline import DECIMALS, Baseline, BaselineScores
from trackmark.bench.statistics.accuracy_drop import (
    IDENTICAL,
    decide_by_repetitions,
    decide_deterministic,
)
from trackmark.bench.statistics.rules import MARGIN, Decision, p_value
from trackmark.bench.statistics.units import units_of
from trackmark.reports.printable import to_xml
from trackmark.reports.tables import Cell, Table

UNREPEATABLE = "not repeatable"


@dataclass(frozen=True)
class ScoreChange:
    """Change of a tracker on a sequence, or of its mean over sequences.

    Runs are paired by repetition. The single run of a deterministic tracker represents all
    repetitions.
    """

    tracker: str
    sequence: str  # name of the sequence, or the label of the mean
    old: Sequence[float]  # mean overlap by run
    new: Sequence[float]
    same: Sequence[bool]  # whether a pair of runs has equal boxes
    failures: Mapping[int, str]  # reasons of failures by repetition
    change: Decision = IDENTICAL
    p_value: float = nan  # smallest level at which the corrected interval of the change excludes 0
    weights: Sequence[float] | None = None  # of the sequences in both means; None if they are equal

    @property
    def before(self) -> float:
        """Mean overlap of the baseline."""
        return self._mean(self.old)

    @property
    def now(self) -> float:
        """Mean overlap of the current runs."""
        return self._mean(self.new)

    def _mean(self, scores: Sequence[float]) -> float:
        """Return the mean of scores of runs; each sequence has equally many runs."""
        if self.weights is None:
            return float(np.mean(scores))
        n_runs = len(scores) // len(self.weights)
        return float(np.average(scores, weights=np.repeat(self.weights, n_runs)))

    @property
    def differences(self) -> NDArray[np.float64]:
        """Score now minus score before, shape (pairs,); 0 for equal boxes."""
        differences = np.round(np.array(self.new) - np.array(self.old), DECIMALS)
        return np.where(self.same, 0.0, differences)

    @property
    def is_random(self) -> bool:
        """True if the tracker declares randomness, now or in the baseline."""
        return len(self.same) > 1

    @property
    def is_regression(self) -> bool:
        """True if the score is worse or a run failed; a baseline contains no failed runs."""
        return self.change.label == "worse" or bool(self.failures)


@dataclass(frozen=True)
class Check:
    """Result of a check: changes of the trackers of a baseline."""

    baseline: Baseline
    now: BaselineScores
    environment: Mapping[str, str]
    sequences: Sequence[ScoreChange]
    means: Sequence[ScoreChange]  # of the changed stochastic trackers

    @property
    def changes(self) -> Sequence[ScoreChange]:
        """Changes by sequence, then of means, each with the worst first."""
        return [*self.sequences, *self.means]

    @property
    def verdict(self) -> str:
        """`regression`, `inconclusive` or `pass`."""
        if any(row.is_regression for row in self.changes):
            return "regression"
        labels = {row.change.label for row in self.changes}
        return "inconclusive" if "inconclusive" in labels else "pass"


def changed_sequences(before: BaselineScores, now: BaselineScores) -> dict[str, list[str]]:
    """Return for each deterministic tracker the sequences on which its boxes changed.

    Sequences with failed runs are left out.
    """
    changed: dict[str, list[str]] = {}
    for row in _paired(before, now):
        if not (row.is_random or row.same[0] or row.failures):
            changed.setdefault(row.tracker, []).append(row.sequence)
    return changed


def check(
    baseline: Baseline,
    now: BaselineScores,
    environment: Mapping[str, str],
    not_repeatable: Collection[tuple[str, str]] = (),
    families: Mapping[str, str] | None = None,
) -> Check:
    """Compare new scores of the same trackers and sequences with a baseline.

    If `environment`, the platform and libraries of the new scores, differs from the baseline's,
    deterministic trackers may change as much as the baseline's detectable drop. `not_repeatable`
    lists deterministic trackers and sequences whose boxes differ between two new runs; no decision
    is possible on them. If `families` gives the family of every sequence, a family counts once in
    means.
    """
    rows = _paired(baseline.scores, now)
    changed = [row for row in rows if row.is_random and not all(row.same)]
    margin = (
        MARGIN if environment == baseline.environment else max(MARGIN, baseline.detectable_drop)
    )
    sequences = []
    for row in rows:
        if all(row.same):
            change = IDENTICAL
        elif (row.tracker, row.sequence) in not_repeatable:
            change = Decision("inconclusive", float(row.differences[0]), reason=UNREPEATABLE)
        elif row.is_random:
            change = decide_by_repetitions(row.differences, len(changed), baseline.detectable_drop)
        else:
            change = decide_deterministic(float(row.differences[0]), margin)
        p = p_value(row.differences, len(changed)) if change.interval else nan
        sequences.append(replace(row, change=change, p_value=p))
    trackers = list(dict.fromkeys(row.tracker for row in changed))
    means = [
        _mean([row for row in rows if row.tracker == tracker], len(trackers), baseline, families)
        for tracker in trackers
    ]
    return Check(baseline, now, environment, _in_order(sequences), _in_order(means))


def _paired(before: BaselineScores, now: BaselineScores) -> list[ScoreChange]:
    """Return the scores before and now per tracker and sequence, without a decision."""
    rows = []
    for tracker, scores in before.items():
        for name, old in scores.items():
            new = now[tracker][name]
            same = (np.array(old.box_digests) == np.array(new.box_digests)).tolist()
            rows.append(ScoreChange(tracker, name, old.overlap, new.overlap, same, new.failures))
    return rows


def _mean(
    rows: Sequence[ScoreChange],
    comparisons: int,
    baseline: Baseline,
    families: Mapping[str, str] | None,
) -> ScoreChange:
    """Return the change of a tracker's mean over all sequences, or over families of them."""
    names = [row.sequence for row in rows]
    units = units_of(names, families=families or dict(zip(names, names, strict=True)))
    weights = units.means(np.eye(len(rows))).mean(axis=-1)
    by_repetition = np.average([row.differences for row in rows], axis=0, weights=weights)
    old, new, same = (
        list(chain.from_iterable(parts))
        for parts in zip(*((row.old, row.new, row.same) for row in rows), strict=True)
    )
    change = decide_by_repetitions(by_repetition, comparisons, baseline.detectable_drop)
    label = f"mean of {len(units)} {units.plural if len(units) > 1 else units.unit_kind}"
    p = p_value(by_repetition, comparisons) if change.interval else nan
    shares = weights.tolist()
    return ScoreChange(rows[0].tracker, label, old, new, same, {}, change, p, shares)


def _counted(n: int, noun: str = "sequence") -> str:
    return f"{n} {noun}{'s' * (n != 1)}"


_ORDER = ("worse", "inconclusive", "better", "not worse", "identical")


def _in_order(changes: Sequence[ScoreChange]) -> list[ScoreChange]:
    """Sort the changes, the worst first."""
    return sorted(changes, key=lambda row: (_ORDER.index(row.change.label), row.change.mean))


def summary_line(result: Check, where: str, slower: int = 0, *, strict: bool = False) -> str:
    """Return the line PASS or FAIL with the numbers of changed and unchanged scores.

    The line ends with `where`, the file of the baseline. The check also fails if `slower` trackers
    take more time, and with `strict` if scores are inconclusive.
    """
    labels = Counter(row.change.label.replace("identical", "unchanged") for row in result.sequences)
    n = len(result.sequences)
    in_mean = sum(row.change.label == "worse" for row in result.means)
    failed = sum(bool(row.failures) for row in result.sequences)
    kinds = ("worse", "unchanged", "better", "not worse", "inconclusive")
    scores = ", ".join(f"{labels[kind]} {kind}" for kind in kinds if labels[kind])
    scores = scores.replace(" ", f" of {n} scores ", 1)
    bad = [f"{_counted(in_mean, 'tracker')} worse in the mean"] if in_mean else []
    bad += [f"{_counted(failed, 'score')} with failed runs"] if failed else []
    bad += [f"{_counted(slower, 'tracker')} slower"] if slower else []
    fails = bool(bad or labels["worse"]) or (strict and result.verdict == "inconclusive")
    return f"{'FAIL' if fails else 'PASS'}  {'; '.join([scores, *bad])} ({where})"


def table(result: Check, *, with_identical: bool = False) -> Table:
    """Return the table of changes; `with_identical` includes sequences with equal boxes."""
    visible = [row for row in result.sequences if with_identical or row.change.label != "identical"]
    return Table(
        name="check",
        caption="Mean overlap before and now. The intervals of all sequences hold together at 95 "
        "%, and so do the intervals of all means.",
        headings=["", "tracker", "sequence", "before", "now", "change", "same boxes"],
        n_labels=3,
        rows=[_row(row) for row in [*visible, *result.means]],
        ranks=[1, 2, 0, 3],
        notes=_notes(result, with_identical=with_identical),
        records=pd.DataFrame([_record(row) for row in result.changes]),
    )


def _row(row: ScoreChange) -> list[Cell]:
    change = row.change
    values = [
        change.label,
        row.tracker,
        row.sequence,
        f"{row.before:.3f}",
        f"{row.now:.3f}",
        f"{change.mean:+.3f}",
        f"{sum(row.same)} of {len(row.same)} runs",
    ]
    if change.interval is not None:
        values[5] += " [{:+.3f}, {:+.3f}]".format(*change.interval)
    return [Cell(value) for value in values]


def _notes(result: Check, *, with_identical: bool) -> list[str]:
    identical = Counter(row.tracker for row in result.sequences if row.change.label == "identical")
    counts = "; ".join(f"{tracker}  {_counted(n)}" for tracker, n in identical.items())
    notes = [f"identical  {counts}"] if counts and not with_identical else []
    for tracker in result.baseline.scores:
        notes += _regressions(result, tracker)
    notes += [
        f"inconclusive: {row.tracker}, {row.sequence}: {row.change.reason}."
        for row in result.changes
        if row.change.reason
    ]
    notes += [
        f"{tracker} is not repeatable. Declare `randomness = Randomness.GENERATOR`, draw from "
        "`np.random.default_rng(self.seed)` only, and make the baseline again."
        for tracker in result.baseline.scores
        if any(
            (row.tracker, row.change.reason) == (tracker, UNREPEATABLE) for row in result.sequences
        )
    ]
    before = result.baseline.environment
    changes = [
        f"{key} {before.get(key, 'unknown')} -> {value}"
        for key, value in result.environment.items()
        if before.get(key) != value
    ]
    if changes and any(row.change.label != "identical" for row in result.sequences):
        notes.append(
            f"note: {', '.join(changes)} since the baseline; boxes may differ without a change of "
            "the tracker."
        )
    return notes


def _regressions(result: Check, tracker: str) -> list[str]:
    """Return one line per regression of a tracker."""
    rows = [row for row in result.sequences if row.tracker == tracker]
    names = [row.sequence for row in rows if row.change.label == "worse"]
    where = [f"on {', '.join(names)}"] if names else []
    if any(row.tracker == tracker and row.change.label == "worse" for row in result.means):
        where.append("in the mean")
    lines = [f"REGRESSION: {tracker} is worse {' and '.join(where)}."] if where else []
    failed = [(row.sequence, *failure) for row in rows for failure in row.failures.items()]
    if failed:
        sequence, repetition, reason = failed[0]
        lines.append(
            f"REGRESSION: {tracker} failed in {len(failed)} of {sum(len(row.new) for row in rows)} "
            f"runs; the baseline has no failures. {sequence}, repetition {repetition}: {reason}"
        )
    return lines


def check_json(result: Check) -> dict[str, Any]:
    """Return the object of `--json`; missing values are null."""
    return {
        "verdict": result.verdict,
        "detectable_drop": result.baseline.detectable_drop,
        "same_environment": result.environment == result.baseline.environment,
        "scores": [_record(row) for row in result.sequences],
        "means": [_record(row) for row in result.means],
    }


def check_junit(result: Check, times: Iterable[tuple[str, str, str]] = ()) -> str:
    """Return JUnit XML with a test case per sequence and mean; inconclusive cases are skipped.

    `times`: test cases of timed trackers: tracker, state and message.
    """
    cases: list[tuple[str, str, str, str]] = [
        (
            row.tracker,
            row.sequence,
            "worse" if row.is_regression else row.change.label,
            _message(row),
        )
        for row in result.changes
    ]
    cases += [(tracker, "time", state, message) for tracker, state, message in times]
    elements = {"worse": "failure", "slower": "failure", "inconclusive": "skipped"}
    suite = ElementTree.Element("testsuite", name="trackmark check", tests=str(len(cases)))
    for tracker, name, state, message in cases:
        names = {"classname": to_xml(tracker), "name": to_xml(name)}
        case = ElementTree.SubElement(suite, "testcase", names)
        if element := elements.get(state):
            ElementTree.SubElement(case, element, message=to_xml(message))
    suite.set("failures", str(len(suite.findall("*/failure"))))
    suite.set("skipped", str(len(suite.findall("*/skipped"))))
    return ElementTree.tostring(suite, encoding="unicode", xml_declaration=True) + "\n"


def _message(row: ScoreChange) -> str:
    """Return the message of a test case."""
    change = row.change
    message = f"mean overlap {row.before:.4f} -> {row.now:.4f} ({change.label})"
    message += f"; {change.reason}" if change.reason else ""
    failures = [
        f"; repetition {repetition} failed: {reason}" for repetition, reason in row.failures.items()
    ]
    return message + "".join(failures[:1])


def _record(row: ScoreChange) -> dict[str, Any]:
    change = row.change
    low, high = change.interval or (change.mean, change.mean)
    return {
        "tracker": row.tracker,
        "sequence": row.sequence,
        "decision": change.label,
        "reason": change.reason,
        "before": row.before,
        "now": row.now,
        "difference": change.mean,
        "low": low,
        "high": high,
        "p_value": row.p_value if isfinite(row.p_value) else None,
        "runs_before": len(row.old),
        "runs": len(row.new),
        "same_boxes": sum(row.same),
        "failed": len(row.failures),
        "failure": next(iter(row.failures.values()), ""),
        "repetitions_needed": change.needed,
    }
