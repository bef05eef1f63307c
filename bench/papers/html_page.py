"""The page of a reproduction: tables, figures, and every claim with what its verdict rests on."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import isfinite
from pathlib import Path
from textwrap import shorten
from typing import Any

from bench.claims.readings import Readings, in_words
from bench.pages.filming import Watch
from bench.papers import Effort, Report
from bench.papers.footage import Footage, footage_of
from bench.papers.grounds import SHOWN, Ground
from bench.papers.report import AMOUNT
from bench.papers.screen import EFFECT, claim_count, outcome, tally, was_run
from bench.papers.tables import RunTable
from bench.papers.wording import POST_HOC
from reports.ledger import claim_words, holds_in
from reports.page.content import Card, Page, Picture, Section, Sheet
from reports.page.film import still
from reports.page.page import write_page
from reports.tables import MISSING, Cell, Table

__all__ = ["command_of", "holds", "plain_table", "write_html_page"]

_MOST_READINGS = 60
"""Rows of readings that a claim shows; `report.json` has all."""

_MOST_OPEN = 16
"""Rows of the first table, up to which it is not folded."""

_MOST_REMARKS = 3  # that are not folded

_UNTESTABLE = "not testable"

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
    sections = [one for one in _sections(report, readings, footage, paper, effort) if _has(one)]
    trackers = footage.reading.shown
    return write_page(path, Page(report.title, sections, trackers, footage.scenes))


def _sections(
    report: Report, readings: Readings, footage: Footage, paper: str, effort: Effort
) -> list[Section]:
    told = {table.name: table for table in [*report.main, *report.tables]}
    apart = ("claims", "verdicts")
    shown = [_sheet(table, footage) for name, table in told.items() if name not in apart]
    if shown and len(shown[0].table.rows) <= _MOST_OPEN:
        shown[0] = replace(shown[0], folded=False)  # what a reader of the paper looks for
    readings_of = [Sheet(_axes(readings), folded=True)]
    readings_of += [_verdicts(told["verdicts"])] if "verdicts" in told else []
    command = command_of(paper, effort)
    remarks = [one for one in report.remarks if not one.startswith(AMOUNT)]  # it stands above
    return [
        Section(
            "ledger",
            "Claims",
            [_mark(effort), claim_count(report.claims)],
            sheets=[_ledger(report)],
            tally=tally(report.claims),
        ),
        Section("tables", "Tables beside the paper's", sheets=shown, command=command),
        Section(
            "figures",
            "Figures",
            ["Ours, on other videos than the paper's. One is enlarged by a click."],
            pictures=_pictures(report),
            command=command,
        ),
        Section(
            "claims",
            "Claim by claim",
            _frames_kept(footage),
            cards=[_card(claim, report, footage) for claim in report.claims],
            folded="All claims with their quotes, what their verdicts rest on, and the readings",
        ),
        Section(
            "readings",
            "What the text leaves open",
            [
                "A verdict is that of the headline reading: the first of every choice. Readings "
                "chosen after seeing results are post hoc, and count apart."
            ],
            sheets=readings_of,
        ),
        Section(
            "remarks",
            "Departures, and how it was run",
            remarks[:_MOST_REMARKS],
            further=remarks[_MOST_REMARKS:],
            command=command,
        ),
    ]


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
    if section.key == "figures":
        return bool(section.pictures)
    return bool(section.words or section.sheets or section.cards)


def _mark(effort: Effort) -> str:
    words = effort.words
    return f"{words[:1].upper()}{words[1:]}." if words else "Run whole: all scenes and seeds."


def _ledger(report: Report) -> Sheet:
    """A row a claim, which leads to what its verdict rests on."""
    rows = [
        [
            claim["id"],
            claim["short"] or claim_words(claim),
            outcome(claim),
            claim["effect"] or MISSING,
            holds(claim),
        ]
        for claim in report.claims
    ]
    heads = ["claim", "what it says", "verdict", EFFECT, "holds in readings"]
    table = plain_table("claims", "Claims; each opens below.", heads, rows)
    return Sheet(table, links=[f"#{_key(claim)}" for claim in report.claims], badges=2)


def _sheet(table: Table, footage: Footage) -> Sheet:
    """A table of the paper, folded; what runs scored opens the worst frame that is there."""
    if not isinstance(table, RunTable):
        return Sheet(table, folded=True)
    kinds = [
        "centre_error" if "px" in head else "overlap" for head in table.heads[table.n_labels :]
    ]
    places = [
        [footage.worst(files, kind) for files, kind in zip(row, kinds, strict=True)]
        for row in table.runs
    ]
    return Sheet(table, places=places, folded=True)


def _verdicts(table: Table) -> Sheet:
    """Verdicts by reading, of claims that were tested; what is as in the first is not repeated."""
    rows, untold = [], []
    for row in table.rows:
        name, first, *others = (cell.text for cell in row)
        if {first, *others} == {MISSING}:
            untold.append(name)
        else:
            rows.append([name, first, *("=" if text == first else text for text in others)])
    notes = [f"Tested in no reading that was run: {', '.join(untold)}."] if untold else []
    caption = f"{table.caption}; = where verdict and numbers are those of the first."
    made = plain_table(table.name, caption, table.heads, rows)
    return Sheet(replace(made, notes=notes), folded=True)


def _key(claim: Mapping[str, Any]) -> str:
    return f"claim-{claim['id']}"


def holds(claim: Mapping[str, Any]) -> str:
    """In how many readings a claim holds, and whether that is fragile; of what was tested."""
    if not was_run(claim):
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
        outcome(claim),
        "" if evidence["ours"] else f"“{evidence['quote']}” ({claim['source']})",
        {name: text for name, text in facts.items() if text},
        [
            *(
                _scenes(f"scenes-{claim['id']}-{number}", ground, footage)
                for number, ground in enumerate(report.grounds.get(claim["id"], ()))
            ),
            *_summed(claim, report),
            *_by_reading(claim),
        ],
    )


def _summed(claim: Mapping[str, Any], report: Report) -> list[Sheet]:
    """The claims that a summary rests on, which lead to their scenes."""
    names = report.sums.get(claim["id"], ())
    parts = [one for one in report.claims if one["id"] in names]
    if not parts:
        return []
    rows = [[one["id"], claim_words(one), outcome(one), one["effect"] or MISSING] for one in parts]
    heads = ["claim", "what it says", "verdict", EFFECT]
    words = "It sums up these claims, and holds where all of them do; each opens with its scenes."
    table = plain_table(f"summed-{claim['id']}", words, heads, rows)
    return [Sheet(table, links=[f"#{_key(one)}" for one in parts], badges=2)]


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
    for text in ground.copied:
        its = [i for i, head in enumerate(ground.heads) if head.startswith(f"{text}: ")]
        opened = {place.tracker for row in places for i in its if (place := row[i])}
        named = " or ".join(footage.reading.shown[one] for one in sorted(opened))
        caption += f" Runs of {text} are those of {named}, which does the same."
    table = plain_table(name, caption[:1].upper() + caption[1:], ["scene", *ground.heads], rows)
    return Sheet(table, values, places)


def _where_it_differs(claim: Mapping[str, Any]) -> str:
    drawn = claim["evidence"]["all_drawn_scenes"]
    return "" if drawn == claim["verdict"] else drawn


def _by_reading(claim: Mapping[str, Any]) -> list[Sheet]:
    """Every reading's verdict over all lights, on the scenes kept.

    Parts of the claim, and numbers that nothing here can judge, stand apart, folded, with why.
    """
    named = len({one["metric"] for one in claim["evidence"]["findings"]}) > 1
    found = [
        (
            one["reading"] + (POST_HOC if one["post_hoc"] else "") or "as written",
            ", ".join(filter(None, [one["group"], in_words(one["metric"]) if named else ""])),
            one["verdict"],
            one["effect"] or MISSING,
            one["reason"],
        )
        for one in claim["evidence"]["findings"]
        if (one["light"], one["scenes"]) == ("both", "kept")
    ]
    if not was_run(claim) or len(found) < 2:
        return []
    judged = [row for row in found if row[2] != _UNTESTABLE]
    whole = [[row[0], *row[2:4]] for row in judged if not row[1]]
    parts = [[*row] for row in judged if row[1]]
    others = [[row[0], row[1] or "whole", row[3]] for row in found if row[2] == _UNTESTABLE]
    name, made = f"readings-{claim['id']}", list[Sheet]()
    if whole and (len(whole) > 1 or not parts):
        table = _rows_of(name, "By reading", ["reading", "verdict", EFFECT], whole)
        made.append(Sheet(table, badges=1))
    if parts:
        heads = ["reading", "part", "verdict", EFFECT, "why"]
        table = _rows_of(f"{name}-parts", "By reading and part", heads, parts)
        made.append(Sheet(table, badges=2, folded=bool(made)))
    if others:
        words = "By reading, not testable: numbers that nothing here judges"
        table = _rows_of(f"{name}-untestable", words, ["reading", "part", EFFECT], others)
        made.append(Sheet(table, folded=True))
    return made


def _rows_of(name: str, words: str, heads: Sequence[str], rows: Sequence[Sequence[str]]) -> Table:
    """A table of the first rows; its caption says where there are more."""
    if len(rows) > _MOST_READINGS:
        words += f"; the first {_MOST_READINGS} of {len(rows)}, report.json has all"
    return plain_table(name, f"{words}.", heads, rows[:_MOST_READINGS])


def _pictures(report: Report) -> list[Picture]:
    """Figures as they were drawn; the paper's own are its publisher's."""
    return [
        Picture(still(path.read_bytes()), *report.captions[path.stem]) for path in report.pictures
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
