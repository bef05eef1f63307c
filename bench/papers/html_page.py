"""The page of a reproduction: tables, figures, and every claim with what its verdict rests on."""

from collections.abc import Mapping, Sequence
from math import isfinite
from pathlib import Path
from textwrap import shorten
from typing import Any

from bench.claims.readings import Readings
from bench.pages.filming import Watch
from bench.papers import Effort, Report
from bench.papers.footage import Footage, footage_of
from bench.papers.grounds import SHOWN, Ground
from bench.papers.screen import EFFECT, claim_count, outcome
from bench.papers.wording import POST_HOC
from reports.ledger import claim_words, holds_in
from reports.page.content import Card, Page, Picture, Section, Sheet
from reports.page.film import still
from reports.page.page import write_page
from reports.tables import MISSING, Cell, Table

__all__ = ["command_of", "holds", "plain_table", "write_html_page"]

_MOST_READINGS = 60
"""Rows of readings that a claim shows; `report.json` has all."""

_MOST_LETTERS = 400  # of a reason, which says all parts in all rival readings


def write_html_page(
    path: Path,
    report: Report,
    readings: Readings,
    paper: str,
    effort: Effort,
    watch: Watch = lambda *_: None,
) -> list[Path]:
    """Write a reproduction's page, which holds its pictures and frames, and give the files.

    `path`: in the report's folder, beside which lie the results. `watch` is told how many frames
    are read, of how many. Raises `OSError` where a file can't be read or written, `ResultsError`
    where a run can't be read.
    """
    footage = footage_of(report.grounds, path.parent.parent, effort, watch)
    told = {table.name: table for table in [*report.main, *report.tables]}
    shown = [Sheet(table) for name, table in told.items() if name not in ("claims", "verdicts")]
    readings_of = [_axes(readings), *([told["verdicts"]] if "verdicts" in told else [])]
    command = command_of(paper, effort)
    sections = [
        Section("ledger", "Claims", [_mark(effort), claim_count(report.claims)], [_ledger(report)]),
        Section("tables", "Tables beside the paper's", sheets=shown, command=command),
        Section("figures", "Figures", pictures=_pictures(report), command=command),
        Section(
            "claims",
            "Claim by claim",
            _frames_kept(footage),
            cards=[_card(claim, report, footage) for claim in report.claims],
        ),
        Section(
            "readings",
            "What the text leaves open",
            [
                "A verdict is that of the headline reading: the first of every choice. Readings "
                "chosen after seeing results are post hoc, and count apart."
            ],
            [Sheet(table) for table in readings_of],
        ),
        Section("remarks", "Departures, and how it was run", report.remarks, command=command),
    ]
    shown_sections = [one for one in sections if _has(one)]
    trackers = footage.reading.shown
    return write_page(path, Page(report.title, shown_sections, trackers, footage.scenes))


def command_of(paper: str, effort: Effort) -> str:
    """The command that makes a report again, but for recorded sequences."""
    options = [
        *(["--quick"] if effort.quick else []),
        *(["--all"] if effort.everything else []),
        *([f"--seeds {effort.seeds}"] if effort.seeds is not None else []),
    ]
    return " ".join(["trackmark", "reproduce", paper, *options])


def plain_table(
    name: str, caption: str, heads: Sequence[str], rows: Sequence[Sequence[str]]
) -> Table:
    """A table of texts, the first of which names the row."""
    return Table(name, caption, [*heads], 1, [[Cell(text) for text in row] for row in rows])


def _has(section: Section) -> bool:
    return bool(section.words or section.sheets or section.pictures or section.cards)


def _mark(effort: Effort) -> str:
    words = effort.words
    return f"{words[:1].upper()}{words[1:]}." if words else "Run whole: all scenes and seeds."


def _ledger(report: Report) -> Sheet:
    """A row a claim, which leads to what its verdict rests on."""
    rows = [
        [claim["id"], claim_words(claim), _said(claim), claim["effect"] or MISSING, holds(claim)]
        for claim in report.claims
    ]
    heads = ["claim", "what it says", "verdict", EFFECT, "holds in readings"]
    table = plain_table("claims", "Claims; each opens below.", heads, rows)
    return Sheet(table, links=[f"#{_key(claim)}" for claim in report.claims])


def _key(claim: Mapping[str, Any]) -> str:
    return f"claim-{claim['id']}"


def _said(claim: Mapping[str, Any]) -> str:
    return outcome(claim).replace("-", " ")


def holds(claim: Mapping[str, Any]) -> str:
    """In how many readings a claim holds, and whether that is fragile; of what was tested."""
    if outcome(claim) != claim["verdict"]:
        return MISSING
    return holds_in(claim) or MISSING


def _frames_kept(footage: Footage) -> list[str]:
    if not footage.scenes:
        return []
    return [
        f"Of each test the {SHOWN} scenes are shown that speak most against it. A number opens the "
        "worst of its runs at its worst frame. Not to grow too large, the page holds "
        f"{footage.frames} frames: these, and what is around them."
    ]


def _card(claim: Mapping[str, Any], report: Report, footage: Footage) -> Card:
    evidence = claim["evidence"]
    published = [f"{one['label']}: {one['value']:g} {one['unit']}" for one in evidence["published"]]
    facts = {
        "in our words": claim_words(claim),
        "effect": claim["effect"],
        "why": shorten(evidence["reason"], _MOST_LETTERS, placeholder=" … (see by reading)"),
        "holds in": "" if holds(claim) == MISSING else holds(claim),
        "on all scenes drawn": _where_it_differs(claim),
        "published": "; ".join(published),
        "would be false if": evidence["falsifier"],
        "tested by": ", ".join(evidence["experiment"]),
    }
    words = claim["short"] or claim_words(claim)
    return Card(
        _key(claim),
        f"{claim['id']}: {words}",
        _said(claim),
        "" if evidence["ours"] else f"“{evidence['quote']}” ({claim['source']})",
        {name: text for name, text in facts.items() if text},
        [
            *(
                _scenes(f"scenes-{claim['id']}-{number}", ground, footage)
                for number, ground in enumerate(report.grounds.get(claim["id"], ()))
            ),
            *_summed(claim, report),
            *map(Sheet, _by_reading(claim)),
        ],
    )


def _summed(claim: Mapping[str, Any], report: Report) -> list[Sheet]:
    """The claims that a summary rests on, which lead to their scenes."""
    names = report.sums.get(claim["id"], ())
    parts = [one for one in report.claims if one["id"] in names]
    if not parts:
        return []
    rows = [[one["id"], claim_words(one), _said(one), one["effect"] or MISSING] for one in parts]
    heads = ["claim", "what it says", "verdict", EFFECT]
    words = "It sums up these claims, and holds where all of them do; each opens with its scenes."
    table = plain_table(f"summed-{claim['id']}", words, heads, rows)
    return [Sheet(table, links=[f"#{_key(one)}" for one in parts])]


def _scenes(name: str, ground: Ground, footage: Footage) -> Sheet:
    """Scenes that a test rests on; their numbers open the worst frames."""
    shown = len(ground.rows)
    many = f"{shown} of {ground.of}" if shown < ground.of else str(shown)
    many += " scene" if ground.of == 1 else " scenes"
    caption = f"{': '.join(filter(None, [ground.part, many]))}; {ground.order}."
    rows = [
        [scene, *(f"{one.value:.4g}" if isfinite(one.value) else MISSING for one in numbers)]
        for scene, numbers in ground.rows
    ]
    places = []
    for _, numbers in ground.rows:
        runs = [one.run for one in numbers]
        places.append([footage.place(one.run, ground.kind, runs, one.trace) for one in numbers])
    values = [[one.value for one in numbers] for _, numbers in ground.rows]
    table = plain_table(name, caption[:1].upper() + caption[1:], ["scene", *ground.heads], rows)
    return Sheet(table, values, places)


def _where_it_differs(claim: Mapping[str, Any]) -> str:
    drawn = claim["evidence"]["all_drawn_scenes"]
    return "" if drawn == claim["verdict"] else drawn.replace("-", " ")


def _by_reading(claim: Mapping[str, Any]) -> list[Table]:
    """Every reading's verdict over all lights, on the scenes kept; with the parts of each."""
    found = [
        [
            one["reading"] + (POST_HOC if one["post_hoc"] else "") or "as written",
            ", ".join(filter(None, [one["group"], one["metric"].replace("_", " ")])) or "whole",
            one["verdict"].replace("-", " "),
            one["effect"] or MISSING,
        ]
        for one in claim["evidence"]["findings"]
        if (one["light"], one["scenes"]) == ("both", "kept")
    ]
    if outcome(claim) != claim["verdict"] or len(found) < 2:
        return []
    shown = found[:_MOST_READINGS]
    more = f"; the first {len(shown)} of {len(found)}, report.json has all" * (found != shown)
    heads = ["reading", "part", "verdict", EFFECT]
    return [plain_table(f"readings-{claim['id']}", f"By reading{more}.", heads, shown)]


def _pictures(report: Report) -> list[Picture]:
    """Figures as they were drawn; the paper's own are its publisher's."""
    return [
        Picture(
            path.stem.replace("-", " ").capitalize(),
            still(path.read_bytes()),
            "Ours, on other videos.",
        )
        for path in report.pictures
    ]


def _axes(readings: Readings) -> Table:
    """What is open, and how each of it is read."""
    rows = []
    for name, axis in readings.axes.items():
        told = [
            f"{option or 'as the others say'}{POST_HOC if entry.post_hoc else ''}"
            for option, entry in axis.options.items()
        ]
        headline = "none: all must agree" if axis.rivals else told[0]
        over = ", ".join(axis.over) or "all that a claim names"
        rows.append([name, headline, ", ".join(told[0 if axis.rivals else 1 :]) or MISSING, over])
    heads = ["choice", "headline", "other readings", "of"]
    return plain_table("axes", "Choices that the text leaves open.", heads, rows)
