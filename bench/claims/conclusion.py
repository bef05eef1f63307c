"""What is reported of a claim: one verdict, and how far it depends on how the text is read.

    conclude(claim, findings) -> Conclusion       # .verdict, .readings, .fragile, .for_json()

The verdict is that of the headline reading (the text as written, all lights together, on the
scenes that `kept_scene` says passed the paper's checks before any tracker ran). A claim that is
judged by several metrics is decided where `frames_inside` and `first_loss` agree, or all of them
where it has neither. Where the text names no headline among rival readings, it
is decided only where these agree. A claim that holds in one reading and does not in another is
fragile.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite, isnan
from typing import Any

from bench.claims.findings import Finding
from bench.claims.kinds import NumberTest
from bench.claims.ledger import Claim
from bench.claims.readings import NO_MATTER, in_words
from bench.statistics.verdict_rules import Outcome, Verdict, inconclusive

__all__ = ["Conclusion", "conclude"]

DECIDING = ("frames_inside", "first_loss")


@dataclass(frozen=True)
class Conclusion:
    """A claim after its verdict.

    Attributes
    ----------
    claim : Claim
        What was claimed.
    found : Verdict
        The headline reading's.
    drawn : str
        The same reading's verdict on all scenes that were drawn.
    readings : str
        In how many readings of the text it holds: "7 of 9".
    post_hoc : str
        The same of the readings that were chosen after seeing results; empty for none.
    fragile : bool
        Whether it holds in one reading and does not hold in another.
    findings : tuple of Finding
        All of them.
    """

    claim: Claim
    found: Verdict
    drawn: Outcome
    readings: str
    post_hoc: str
    fragile: bool
    findings: tuple[Finding, ...]

    @property
    def verdict(self) -> Outcome:
        """The headline reading's."""
        return self.found.verdict

    @property
    def reason(self) -> str:
        """Of the verdict."""
        return self.found.reason

    def under(self, choice: Mapping[str, str]) -> Verdict | None:
        """The verdict under a reading, over all lights and the scenes kept.

        The reading is an option by axis; axes that are not named are read as the headline. None
        where the claim was not tested under it.
        """
        readings = self.claim.readings
        wanted = {
            axis: {choice[axis]} if axis in choice else set(names if rival else names[:1])
            for axis, names in readings.columns.items()
            for rival in [axis in readings.rivals]
        }
        found = [one for one in _whole(self.findings) if _is_among(one, list(wanted.values()))]
        return _settled(found, readings.rivals) if found else None

    def for_json(self) -> dict[str, Any]:
        """What a script reads."""
        claim = self.claim
        return {
            "id": claim.id,
            "source": claim.source,
            "text": claim.says,
            "short": claim.short,
            "verdict": self.verdict,
            "effect": self.found.effect,
            "of": self.found.of,
            "statistic": _plain(self.found.statistic),
            "interval": [_plain(limit) for limit in self.found.interval],
            "unit": self.found.unit,
            "cells": self.found.cells,
            "counted": self.found.counted,
            "readings": self.readings,
            "evidence": {
                "reason": self.reason,
                "quote": claim.quote,
                "kind": claim.kind,
                "asserted": claim.asserted,
                "ours": claim.ours,
                "published": [number.model_dump() for number in claim.published],
                "experiment": list(claim.experiment),
                "falsifier": claim.falsifier,
                "all_drawn_scenes": self.drawn,
                "post_hoc": self.post_hoc,
                "fragile": self.fragile,
                "findings": [_finding_for_json(finding) for finding in self.findings],
            },
        }


def conclude(claim: Claim, findings: Sequence[Finding]) -> Conclusion:
    """Draw the conclusion from a claim's findings, which `judge` gave; see the module."""
    headline = [
        finding
        for finding in findings
        if not finding.group
        and finding.light == "both"
        and claim.readings.is_headline(finding.reading)
    ]
    if isinstance(claim.test, NumberTest) and claim.test.groups:
        headline = [_one_by_one(finding, findings) for finding in headline]
    rivals = claim.readings.rivals
    found = _settled([f for f in headline if f.scenes == "kept"], rivals)
    on_drawn = [f for f in headline if f.scenes == "drawn"]
    # What depends on no scene is found once.
    drawn = _settled(on_drawn, rivals).verdict if on_drawn else found.verdict
    known = _by_reading(findings, post_hoc=False)
    hindsight = _by_reading(findings, post_hoc=True)
    seen = {found.verdict, *known, *hindsight}
    return Conclusion(
        claim=claim,
        found=found,
        drawn=drawn,
        readings=_count(known),
        post_hoc=_count(hindsight) if hindsight else "",
        fragile={"holds", "does not hold"} <= seen,
        findings=tuple(findings),
    )


def _one_by_one(whole: Finding, findings: Iterable[Finding]) -> Finding:
    """A finding whose reason says the numbers of groups: their mean would be that of nothing."""
    told = [
        f"{one.group} {_number(one.verdict)}"
        for one in findings
        if one.group and replace(one, group="", verdict=whole.verdict) == whole
    ]
    reason = (
        f"{', '.join(told)}: means with 95 % intervals in parentheses; numbers of other videos, "
        "printed and not judged"
    )
    return replace(whole, verdict=Verdict(whole.verdict.verdict, reason=reason))


def _number(verdict: Verdict) -> str:
    low, high = verdict.interval
    between = "" if isnan(low) else f" ({low:.3f} to {high:.3f})"
    return f"{verdict.statistic:.3f}{between}"


def _whole(findings: Iterable[Finding]) -> list[Finding]:
    """Those over all lights and cells, on the scenes that were kept."""
    return [f for f in findings if not f.group and f.light == "both" and f.scenes == "kept"]


def _is_among(finding: Finding, wanted: Sequence[Collection[str]]) -> bool:
    """Whether a finding is that of a reading with one of these options of every axis."""
    if not finding.same:
        return True
    return any(
        all(name == NO_MATTER or name in names for name, names in zip(one, wanted, strict=True))
        for one in finding.same
    )


def _by_reading(findings: Iterable[Finding], *, post_hoc: bool) -> list[Outcome]:
    """The outcome of each reading of the text, over all lights, as that of the headline."""
    readings: dict[tuple[tuple[str, str], ...], list[Finding]] = {}
    for finding in _whole(findings):
        if finding.post_hoc == post_hoc:
            key = tuple(sorted(finding.reading.items()))
            readings.setdefault(key, []).append(finding)
    return [_decided(found).verdict for found in readings.values()]


def _settled(findings: Sequence[Finding], rivals: Sequence[str]) -> Verdict:
    """One verdict of rival readings'."""
    readings: dict[str, list[Finding]] = {}
    for finding in findings:
        told = [f"{name} {finding.reading[name]}" for name in rivals if finding.reading.get(name)]
        readings.setdefault(", ".join(told), []).append(finding)
    if len(readings) < 2:
        return _decided(findings)
    said = {words: _decided(found) for words, found in readings.items()}
    told_apart = "; ".join(f"{words} {one.verdict}: {one.reason}" for words, one in said.items())
    apart = [
        replace(one, of=", ".join(filter(None, [words, one.of]))) for words, one in said.items()
    ]
    deciding = [name for name in rivals if len({f.reading.get(name) for f in findings}) > 1]
    return _agreed(apart, f"it depends on the {' and the '.join(deciding)}: ", told_apart)


def _agreed(verdicts: Sequence[Verdict], unless: str, reason: str) -> Verdict:
    """One verdict of several on the same claim, which is decided where they agree.

    It has the numbers of the first; where they don't agree, of the first that doesn't hold.
    """
    if len({one.verdict for one in verdicts}) == 1:
        return replace(verdicts[0], reason=reason)
    first = next(one for one in verdicts if one.verdict != "holds")
    return replace(first, verdict="inconclusive", reason=f"{unless}{reason}")


def _decided(findings: Iterable[Finding]) -> Verdict:
    """One verdict of the metrics'."""
    every = list(findings)
    if not every:
        return inconclusive("not run: the headline reading")
    deciding = [f for f in every if f.metric in DECIDING] or every
    told = "; ".join(
        f"{in_words(finding.metric)}: {finding.verdict.reason}".removeprefix(": ")
        for finding in every
    )
    return _agreed([one.verdict for one in deciding], "the metrics do not agree: ", told)


def _count(outcomes: Sequence[Outcome]) -> str:
    if set(outcomes) <= {"not testable"}:
        return ""  # numbers beside numbers: there is nothing to hold
    good = outcomes.count("holds")
    return f"{good} of {len(outcomes)}"


def _finding_for_json(finding: Finding) -> dict[str, Any]:
    labels = {name: getattr(finding, name) for name in ("metric", "light", "scenes", "group")}
    return {
        "reading": finding.told,
        **labels,
        "post_hoc": finding.post_hoc,
        **_verdict_for_json(finding.verdict),
    }


def _verdict_for_json(verdict: Verdict) -> dict[str, Any]:
    return {
        "verdict": verdict.verdict,
        "effect": verdict.effect,
        "statistic": _plain(verdict.statistic),
        "interval": [_plain(limit) for limit in verdict.interval],
        "unit": verdict.unit,
        "cells": verdict.cells,
        "counted": verdict.counted,
        "reason": verdict.reason,
    }


def _plain(value: float) -> float | None:
    """A number for JSON, which has none that are not finite."""
    return value if isfinite(value) else None
