"""Verdicts on the claims of a paper: one row per claim, two columns per setting."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any

import pandas as pd

from trackmark.bench.papers import SETTINGS
from trackmark.bench.papers.claim_tests import Evidence, judge
from trackmark.bench.papers.claims import Claim
from trackmark.bench.statistics.verdict_rules import Verdict
from trackmark.reports.tables import MISSING, Cell, Table

VERDICTS = ("holds", "does not hold", "inconclusive", "by construction", "not testable here")

COUNTED = ("holds", "does not hold", "inconclusive")
"""Verdicts that count as main results."""


@dataclass(frozen=True)
class VerdictRow:
    """Claim with its verdicts.

    Attributes
    ----------
    claim : Claim
        The claim.
    verdicts : mapping of str to Verdict
        Verdicts by setting.
    evidence : mapping of str to Evidence
        Values from which the verdicts follow, by setting.
    """

    claim: Claim
    verdicts: Mapping[str, Verdict]
    evidence: Mapping[str, Evidence]

    def for_json(self) -> dict[str, Any]:
        """Return the row for JSON; numbers that are not finite are None."""
        return {
            "id": self.claim.name,
            "source": self.claim.source,
            "quote": self.claim.quote,
            "summary": self.claim.summary,
            "claim": self.claim.statement,
            "paper": self.claim.paper,
            "falsified_if": self.claim.falsified_if,
            "reason": self.claim.reason,
            "settings": {name: self._setting(name) for name in self.verdicts},
        }

    def remarks(self, setting: str) -> list[str]:
        """Return the reason of a verdict that decides nothing, and remarks that limit a verdict.

        By construction has none: pages explain this label, and its reason is always the same.
        """
        verdict = self.verdicts[setting]
        needs_reason = verdict.verdict in ("inconclusive", "not testable here")
        needs_reason |= "too small" in verdict.reason
        remarks = [verdict.reason if needs_reason else "", self.evidence[setting].failed]
        return [*filter(None, remarks)]

    def _setting(self, name: str) -> dict[str, Any]:
        verdict = self.verdicts[name]
        return {
            "verdict": verdict.verdict,
            "effect": verdict.effect,
            "statistic": _finite(verdict.statistic),
            "interval": [_finite(end) for end in verdict.interval],
            "unit": verdict.unit,
            "n": verdict.n_units,
            "counted": verdict.counted,
            "reason": verdict.reason,
            "notes": [*filter(None, [self.evidence[name].failed])],
        }


def estimate_text(claim: Claim, verdict: Verdict) -> str:
    """Return estimate and interval without their unit: `18 of 24, 0.75 [0.53, 0.90]`."""
    if not isfinite(verdict.statistic):
        return MISSING
    if claim.test == "share":
        n_good = verdict.statistic * verdict.n_units
        return f"{n_good:.0f} of {verdict.n_units}, {verdict.estimate}"
    return verdict.estimate


def unit_text(claim: Claim, verdict: Verdict) -> str:
    """Return unit, number of statistical units and margin: `clips, 36 sets, margin 1.5`."""
    if claim.test == "share":
        return f"{verdict.counted}s"
    margin = f"margin {claim.margin:g}" if claim.test.startswith("no-worse") else ""
    return ", ".join(filter(None, [verdict.unit, verdict.n_counted, margin]))


def judge_row(claim: Claim, evidence: Mapping[str, Evidence]) -> VerdictRow:  # name: claims
    """Judge a claim in every setting with evidence."""
    verdicts = {setting: judge(claim, item) for setting, item in evidence.items()}
    return VerdictRow(claim, verdicts, evidence)


def setting_counts(rows: Sequence[VerdictRow]) -> list[str]:
    """Return `as-written: ` and the sum line, by setting; empty without claims."""
    return [f"{setting}: {sum_line(rows, setting)}" for setting in SETTINGS if rows]


def sum_line(rows: Sequence[VerdictRow], setting: str) -> str:
    """Return `Main results reproduced: 2 of 5 (1 by construction, 2 not testable here)`.

    Claims that hold are counted among those that hold, do not hold or are inconclusive.
    """
    counts = Counter(str(row.verdicts[setting].verdict) for row in rows)
    uncounted = ", ".join(f"{counts[label]} {label}" for label in VERDICTS if label not in COUNTED)
    n_counted = sum(counts[label] for label in COUNTED)
    return f"Main results reproduced: {counts['holds']} of {n_counted} ({uncounted})"


def verdict_table(rows: Sequence[VerdictRow], settings: Mapping[str, str]) -> Table:
    """Return a table with claim, unit, result of the paper, and our results and verdicts.

    `settings`: settings that have columns, with their labels. The records have all settings.
    """
    headings = ["claim", "", "unit", "paper"]
    for label in settings.values():
        headings += [label, "verdict"]
    return Table(
        name="verdicts",
        caption=(
            "Estimate [95 % interval]. A positive difference supports the claim. A share of scenes "
            "holds above 0.5."
        ),
        headings=headings,
        n_labels=3,
        rows=[[Cell(text) for text in _cell_texts(row, settings)] for row in rows],
        records=pd.DataFrame([record for row in rows for record in _records(row)]),
    )


def _records(row: VerdictRow) -> list[dict[str, Any]]:
    """Return the unrounded numbers of a claim, one record per setting."""
    claim = row.claim
    return [
        {
            "claim": claim.name,
            "summary": claim.summary,
            "paper": claim.paper,
            "setting": setting,
            "verdict": verdict.verdict,
            "estimate_name": verdict.estimate_name,
            "estimate": verdict.statistic,
            "low": verdict.interval.low,
            "high": verdict.interval.high,
            "unit": verdict.unit,
            "n": verdict.n_units,
            "counted": verdict.counted,
            "reason": verdict.reason,
            "remarks": "; ".join(row.remarks(setting)),
        }
        for setting, verdict in row.verdicts.items()
    ]


def _cell_texts(row: VerdictRow, settings: Iterable[str]) -> list[str]:
    verdicts = [row.verdicts[setting] for setting in settings]
    units = {unit_text(row.claim, verdict): None for verdict in verdicts if verdict.n_units}
    cells = [row.claim.name, row.claim.summary, " / ".join(units), row.claim.paper]
    for setting, verdict in zip(settings, verdicts, strict=True):
        remarks = "; ".join(row.remarks(setting))
        cells.append(estimate_text(row.claim, verdict))
        cells.append(verdict.verdict + (f" ({remarks})" if remarks else ""))
    return cells


def _finite(value: float) -> float | None:
    return float(value) if isfinite(value) else None
