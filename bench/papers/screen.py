"""What a reproduction prints: the main table, a line a claim, and where the rest is."""

import textwrap
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from bench.claims.judging import NOT_RUN
from bench.papers import Effort, Report
from bench.statistics.rules import MIN_SCENES
from reports.renderers import to_text

__all__ = ["EFFECT", "OUTCOMES", "WIDTH", "claim_count", "outcome", "screen", "tally", "was_run"]

WIDTH = 100
"""Columns of a terminal that every line fits into [characters]; a main table is made to."""

EFFECT = "effect [95 % interval] unit, what it rests on"

_SHORT = 50  # most characters of a claim's short form
_REASON = 2 * WIDTH  # most characters of the reason of an inconclusive verdict


def screen(report: Report, paper: str, effort: Effort, folder: Path) -> str:
    """The answer of `trackmark reproduce`, in a screen and a half; the rest is in the folder."""
    parts = textwrap.wrap(report.title, WIDTH)
    parts += [f"MARKED: {effort.words}."] if effort.words else []
    for table in report.main[:1]:
        caption, _, body = to_text(table).partition("\n")
        parts += ["", *textwrap.wrap(caption, WIDTH), body.rstrip("\n")]
    parts += ["", claim_count(report.claims), ""]
    parts += [_row("claim", EFFECT, "verdict", "holds in")]
    parts += [_line(claim) for claim in report.claims]
    parts += ["", f"Why, in which readings, all tables and figures: {folder / 'report.html'}"]
    return "\n".join([*parts, *_further(paper, effort)])


OUTCOMES = ("holds", "inconclusive", "does not hold", "not testable", "not run")
"""Verdicts on a claim and the absence of one, the best for the paper first."""


def tally(claims: Sequence[Mapping[str, Any]]) -> dict[str, int]:
    """How many claims of the paper there are by verdict: of those that there are any."""
    said = [outcome(claim) for claim in claims if not claim["evidence"]["ours"]]
    return {one: said.count(one) for one in OUTCOMES if one in said}


def claim_count(claims: list[dict[str, Any]]) -> str:
    """How many claims of the paper there are, by verdict: `30 claims: 7 holds, …`.

    The most frequent verdict comes first; claims of ours are only said to be there.
    """
    theirs = [claim for claim in claims if not claim["evidence"]["ours"]]
    counts = Counter(map(outcome, theirs))
    told = ", ".join(f"{count} {verdict}" for verdict, count in counts.most_common())
    beside = len(claims) - len(theirs)
    return f"{len(theirs)} claims: {told}" + (f"; {beside} of ours beside them" if beside else "")


def outcome(claim: Mapping[str, Any]) -> str:
    """Return a claim's verdict, or that its experiment was not run."""
    return str(claim["verdict"]) if was_run(claim) else "not run"


def was_run(claim: Mapping[str, Any]) -> bool:
    """Whether anything was run that tests the claim."""
    return not claim["evidence"]["reason"].startswith(NOT_RUN)


def _line(claim: Mapping[str, Any]) -> str:
    words = claim.get("short") or textwrap.shorten(claim["text"], _SHORT, placeholder=" …")
    fragile = ", fragile" if claim["evidence"]["fragile"] else ""
    readings = claim["readings"].partition(";")[0]
    holds = f"{readings} readings{fragile}" if readings and was_run(claim) else ""
    ours = "ours" if claim["evidence"]["ours"] else ""
    line = _row(claim["id"], words, outcome(claim), ", ".join(filter(None, [holds, ours])))
    detail = claim["effect"]
    if outcome(claim) == "inconclusive":
        reason = textwrap.shorten(claim["evidence"]["reason"], _REASON, placeholder=" …")
        detail = ": ".join(filter(None, [detail, reason]))
    if not detail:
        return line
    indent = " " * len(_row("", "-", "", "").partition("-")[0])
    detail = textwrap.fill(detail, WIDTH, initial_indent=indent, subsequent_indent=indent)
    return f"{line}\n{detail}"


def _row(name: str, words: str, verdict: str, holds: str) -> str:
    return f"{name:<7} {words:<{_SHORT}} {verdict:<13} {holds}".rstrip()


def _further(paper: str, effort: Effort) -> list[str]:
    """What to run for more."""
    if effort.quick:
        return [
            f"A quick look decides few claims: differences and shares need {MIN_SCENES} scenes.",
            f"Evidence, from all scenes and seeds: trackmark reproduce {paper}",
        ]
    if not effort.everything:
        return [f"Sensitivities, ablations and asserted claims: trackmark reproduce {paper} --all"]
    return []
