"""Checking trackers against a baseline: which cells changed, and whether any got worse."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import inf, isfinite
from typing import Any
from xml.etree import ElementTree

import pandas as pd

from bench.comparing.baseline import DECISIVE, Baseline, BaselineCell, BaselineError
from bench.statistics.regression import Change, Judgement, Sample, judge, repetitions_needed
from reports.tables import MISSING, Cell, Table

__all__ = ["Check", "as_data", "as_junit", "check", "table", "wanted"]

MARGIN = 0.01
"""Drop of the mean overlap that means nothing in practice."""


@dataclass(frozen=True)
class Check:
    """A baseline, what is there now, and what became of each cell, in order."""

    before: Baseline
    now: Baseline
    names: Sequence[tuple[str, str]]  # tracker and sequence of every cell
    judgement: Judgement
    same_surroundings: bool  # else boxes may differ though nothing was changed


def check(before: Baseline, now: Baseline) -> Check:
    """Compare what trackers score now with a baseline.

    Raises
    ------
    BaselineError
        For a cell that was not run, or whose sequence is another than it was.
    """
    same = before.made_with == now.made_with
    names = [(tracker, name) for tracker, cells in before.cells.items() for name in cells]
    cells, identical = [], []
    for tracker, name in names:
        old, new = before.cells[tracker][name], now.cells.get(tracker, {}).get(name)
        if new is None:
            raise BaselineError(f"{tracker} was not run on {name}.")
        if new.fingerprint != old.fingerprint:
            raise BaselineError(
                f"{name} is no longer the sequence of the baseline: its pixels or its truth have "
                "changed. Make the baseline anew with `trackmark baseline`."
            )
        cells.append((old.scores[DECISIVE], new.scores[DECISIVE]))
        identical.append(_identical(old, new, same_surroundings=same))
    return Check(before, now, names, judge(cells, identical, MARGIN, before.detect), same)


def _identical(old: BaselineCell, new: BaselineCell, *, same_surroundings: bool) -> bool:
    return same_surroundings and old.boxes == new.boxes


def wanted(found: Check) -> dict[tuple[str, str], float]:
    """Repetitions that cells lack to show a drop of the baseline's `detect`, by cell.

    Infinite where the baseline itself has too few.
    """
    varying = [change for change in found.judgement.changes if isfinite(change.p)]
    lacking = {}
    for name, change in zip(found.names, found.judgement.changes, strict=True):
        tracker, sequence = name
        old, new = (
            one.cells[tracker][sequence].scores[DECISIVE] for one in (found.before, found.now)
        )
        if isfinite(change.p) and change.state == "cannot tell":
            needed = repetitions_needed(old, new, found.before.detect, len(varying))
            if needed > new.n:
                lacking[name] = needed
    return lacking


def table(found: Check, *, whole: bool = False) -> Table:
    """What became of the cells; identical ones are left out unless `whole`."""
    rows, data = [], []
    for (tracker, sequence), change in _in_order(found):
        old, new = _samples(found, tracker, sequence)
        data.append(_row(tracker, sequence, change, old, new))
        if change.state == "identical" and not whole:
            continue
        rows.append(
            [
                Cell(change.state),
                Cell(tracker),
                Cell(sequence),
                Cell(f"{old.mean:.3f}"),
                Cell(f"{new.mean:.3f}"),
                Cell(f"{change.difference:+.3f}"),
                Cell(f"{new.n}"),
                Cell(f"{change.p:.3f}" if isfinite(change.p) else MISSING),
            ]
        )
    return Table(
        name="check",
        caption="Mean overlap before and now; p that there is no drop, corrected by Holm.",
        heads=["", "tracker", "sequence", "before", "now", "change", "runs", "p (drop)"],
        n_labels=3,
        rows=rows,
        notes=_notes(found),
        data=pd.DataFrame(data),
    )


def _notes(found: Check) -> list[str]:
    judgement = found.judgement
    counts = pd.Series([change.state for change in judgement.changes]).value_counts()
    parts = ", ".join(f"{count} {state}" for state, count in counts.items())
    told = [f"{parts}. In all: {judgement.state}."]
    if isfinite(judgement.p):
        told.append(
            f"{_together(judgement)} "
            f"A drop of {judgement.detectable:.3f} of their mean, or of "
            f"{max(change.detectable for change in judgement.changes):.3f} on any one sequence, "
            "is found in 80 % of cases."
        )
    told += [
        f"{tracker} on {name}: {cell.failed} runs failed, which counts as overlap 0: {cell.reason}"
        for tracker, name in found.names
        if (cell := found.now.cells[tracker][name]).failed
    ]
    if short := sum(needed == inf for needed in wanted(found).values()):
        told.append(
            f"{short} cells can't be told however often they are run now: the baseline has too few "
            "runs of them. Make it anew with a larger --budget, or --detect."
        )
    if not found.same_surroundings:
        changed = [
            f"{key} {found.before.made_with.get(key, 'unknown')} -> {value}"
            for key, value in found.now.made_with.items()
            if found.before.made_with.get(key) != value
        ]
        told.append(f"Boxes need not be the same ({', '.join(changed)}): scores alone count.")
    return told


def _together(judgement: Judgement) -> str:
    return (
        f"All that vary together: {judgement.difference:+.4f}, p {judgement.p:.3f} that there "
        "is no drop."
    )


_VERDICTS = {"worse": "regression", "cannot tell": "cannot tell"}


def as_data(found: Check) -> dict[str, Any]:
    """For `--json`; gaps null."""
    judgement = found.judgement
    return {
        "verdict": _VERDICTS.get(judgement.state, "pass"),
        "answer": judgement.state,
        "difference": _or_none(judgement.difference),
        "p": _or_none(judgement.p),
        "detectable": _or_none(judgement.detectable),
        "detect": found.before.detect,
        "same_surroundings": found.same_surroundings,
        "cells": [
            {
                key: _or_none(value) if isinstance(value, float) else value
                for key, value in _row(
                    tracker, sequence, change, *_samples(found, tracker, sequence)
                ).items()
            }
            for (tracker, sequence), change in _in_order(found)
        ],
    }


def as_junit(found: Check, times: Iterable[tuple[str, str, str]] = ()) -> str:
    """JUnit's XML: a test case a cell; worse ones failed, those that can't be told are skipped.

    A drop that only all cells together show is a case of its own.
    `times`: tracker, state and words of those that were clocked, which are cases, too.
    """
    cases: list[tuple[str, str, str, str]] = []
    for (tracker, sequence), change in _in_order(found):
        old, new = _samples(found, tracker, sequence)
        words = f"mean overlap {old.mean:.4f} -> {new.mean:.4f} ({change.state})"
        if reason := found.now.cells[tracker][sequence].reason:
            words += f"; runs failed: {reason}"
        cases.append((tracker, sequence, change.state, words))
    if found.judgement.state == "worse" and all(state != "worse" for _, _, state, _ in cases):
        cases.append(("all", "together", "worse", _together(found.judgement)))
    cases += [(tracker, "time", state, words) for tracker, state, words in times]
    kinds = {"worse": "failure", "slower": "failure", "cannot tell": "skipped"}
    told = [kinds.get(state, "") for _, _, state, _ in cases]
    suite = ElementTree.Element(
        "testsuite",
        name="trackmark check",
        tests=str(len(cases)),
        failures=str(told.count("failure")),
        skipped=str(told.count("skipped")),
    )
    for (tracker, name, _, words), kind in zip(cases, told, strict=True):
        case = ElementTree.SubElement(suite, "testcase", classname=tracker, name=name)
        if kind:
            ElementTree.SubElement(case, kind, message=words)
    return ElementTree.tostring(suite, encoding="unicode", xml_declaration=True) + "\n"


_ORDER = ("worse", "cannot tell", "better", "changed, no worse", "identical")


def _in_order(found: Check) -> list[tuple[tuple[str, str], Change]]:
    """Cells with their changes, the worst first."""
    cells = list(zip(found.names, found.judgement.changes, strict=True))
    return sorted(cells, key=lambda cell: (_ORDER.index(cell[1].state), cell[1].difference))


def _samples(found: Check, tracker: str, sequence: str) -> tuple[Sample, Sample]:
    old, new = (one.cells[tracker][sequence].scores[DECISIVE] for one in (found.before, found.now))
    return old, new


def _row(
    tracker: str, sequence: str, change: Change, old: Sample, new: Sample
) -> dict[str, str | float | int]:
    return {
        "tracker": tracker,
        "sequence": sequence,
        "state": change.state,
        "before": old.mean,
        "now": new.mean,
        "difference": change.difference,
        "low": change.low,
        "high": change.high,
        "p": change.p,
        "runs_before": old.n,
        "runs": new.n,
        "detectable": change.detectable,
    }


def _or_none(value: float) -> float | None:
    return value if isfinite(value) else None
