"""The page of a paper in HTML: as the Markdown page, with the frames behind its numbers."""

import re
from collections.abc import Mapping, Sequence
from math import isfinite
from pathlib import Path

from trackmark.bench.claims.row_verdicts import SETTINGS, VerdictRow, count_verdicts, verdict_table
from trackmark.bench.pages.page_frames import Watch
from trackmark.bench.papers.evidence_frames import (
    Footage,
    SceneRow,
    ShownRun,
    claim_scenes,
    film_runs,
    main_runs,
)
from trackmark.bench.papers.markdown_page import RULES, VIDEOS
from trackmark.bench.papers.reproduction import Report
from trackmark.reports.page.content import Card, Page, PageSection, PageTable, Picture
from trackmark.reports.page.film import compress_picture
from trackmark.reports.page.page import write_page
from trackmark.reports.tables import MISSING, text_table

Scenes = Mapping[tuple[str, str], list[SceneRow]]
"""Worst scenes by claim and setting."""
FACTS = ("statement", "paper", "measure", "falsified", "reason", "note")


def write_html_page(path: Path, report: Report, watch: Watch = lambda *_: None) -> list[Path]:
    """Write the page of a paper and return its files.

    Parameters
    ----------
    path : Path
        File in the report's folder; the folders of its experiments lie next to that folder.
    report : Report
        The report.
    watch : callable
        Called with the number of frames read, and of all frames.

    Raises
    ------
    OSError, ResultsError
        If a file cannot be written, or a run cannot be read.
    """
    scenes = {
        (row.claim.name, setting): claim_scenes(row, setting, report.context)
        for row in report.verdicts
        for setting in SETTINGS
    }
    cells = main_runs(report.context)
    linked_runs = [run for rows in scenes.values() for row in rows for run in row.runs]
    linked_runs += [run for row in cells for run in row]
    footage = film_runs(linked_runs, report.context, path.parent.parent, watch)
    sections = [
        section for section in _sections(report, scenes, cells, footage) if _has_content(section)
    ]
    page = Page(report.description.title, sections, footage.reading.labels, footage.scenes)
    return write_page(path, page)


def _has_content(section: PageSection) -> bool:
    return bool(section.words or section.sheets or section.pictures or section.cards)


def _sections(
    report: Report,
    scenes: Scenes,
    cells: Sequence[Sequence[ShownRun | None]],
    footage: Footage,
) -> list[PageSection]:
    """Return the parts of the page in their order."""
    entry, notes = report.description, report.notes
    result = _paragraphs(notes.get("Result", ""))
    quick = ["Quick report: few scenes, and no verdicts."] if report.context.effort.quick else []
    main, *others = report.main
    places = [[None, *map(footage.place, row)] for row in cells]
    counts = [f"{setting}: {count_verdicts(report.verdicts, setting)}." for setting in SETTINGS]
    sensitivity = [PageTable(report.sensitivity)] if report.sensitivity else []
    command = report.context.effort.command(entry.name)
    about = [*quick, *_paragraphs(entry.citation), entry.method, *result, VIDEOS]
    return [
        PageSection("paper", "The paper", about),
        PageSection(
            "numbers",
            "The paper's numbers and ours",
            ["A number of ours opens the worst run behind it."],
            sheets=[PageTable(main, places=places), *map(PageTable, others)],
        ),
        PageSection("figures", "Figures", pictures=_pictures(report)),
        PageSection(
            "verdicts",
            "Verdicts",
            [_plain(RULES), *counts] if report.verdicts else [],
            sheets=[_verdicts(report.verdicts, scenes, footage)] if report.verdicts else [],
        ),
        PageSection(
            "scenes",
            "Scenes behind the verdicts",
            cards=[_card(row, scenes, footage) for row in report.verdicts],
            folded="Quotes and reasons of all claims, and the scenes that speak most against them",
        ),
        PageSection(
            "differences",
            "What differs and why",
            _paragraphs(notes.get("What differs and why", "")),
        ),
        PageSection("criteria", "The scenes", sheets=[PageTable(report.criteria)]),
        PageSection("settings", "Settings", sheets=[PageTable(report.settings)]),
        PageSection(
            "sensitivity", "Sensitivity (no verdicts)", sheets=sensitivity, folded="The table"
        ),
        PageSection(
            "command",
            "How to run it",
            _paragraphs(notes.get("How long it takes", "")) or ["The command of this report:"],
            command=command,
        ),
        PageSection(
            "history",
            "History",
            _paragraphs(notes.get("History", "")),
            folded="Earlier scenes, claims and rules",
        ),
    ]


def _verdicts(rows: Sequence[VerdictRow], scenes: Scenes, footage: Footage) -> PageTable:
    """Return the verdicts: a row leads to the claim's scenes, an estimate opens the worst one."""
    places = []
    for row in rows:
        worst = [scenes[row.claim.name, setting][:1] for setting in SETTINGS]
        written, recommended = (
            footage.place(scene_rows[0].runs[0]) if scene_rows else None for scene_rows in worst
        )
        places.append([None, written, None, recommended, None])
    links = [f"#claim-{row.claim.name}" for row in rows]
    return PageTable(verdict_table(rows), places=places, links=links)


def _card(row: VerdictRow, scenes: Scenes, footage: Footage) -> Card:
    """Return a claim with its reasons and its worst scenes in both settings."""
    claim = row.claim
    facts = {name: text for name in FACTS if (text := str(getattr(claim, name)))}
    facts |= {name: f"{v.verdict}: {v.effect}. {v.reason}." for name, v in row.verdicts.items()}
    sheets = [
        _scenes(row, setting, scene_rows, footage)
        for setting in SETTINGS
        if (scene_rows := scenes[claim.name, setting])
    ]
    quote = f"“{claim.quote}” ({claim.source})"
    return Card(f"claim-{claim.name}", f"{claim.name}: {claim.short}", quote, facts, sheets)


def _scenes(
    row: VerdictRow, setting: str, scene_rows: Sequence[SceneRow], footage: Footage
) -> PageTable:
    """Return the worst scenes of a claim; a number opens its run at the worst frame."""
    claim = row.claim
    columns = claim.trackers if len(scene_rows[0].numbers) == 1 + len(claim.trackers) else ["value"]
    heads = ["scene", "better − worse", *columns]
    first = 0 if claim.worse else 1  # column of the first value that there is
    values = [scene_row.numbers[first:] for scene_row in scene_rows]
    rows = [
        [scene_row.scene, *(f"{v:.4g}" if isfinite(v) else MISSING for v in numbers)]
        for scene_row, numbers in zip(scene_rows, values, strict=True)
    ]
    caption = f"{setting.replace('-', ' ')}: {len(scene_rows)} scenes, worst first"
    unit = row.evidence[setting].unit
    caption += f" [{unit}]" if unit else ""
    name, shown_heads = f"scenes-{claim.name}-{setting}", [heads[0], *heads[1 + first :]]
    places = [[*map(footage.place, scene_row.runs[first:])] for scene_row in scene_rows]
    return PageTable(
        text_table(name, caption[:1].upper() + caption[1:], shown_heads, rows, 1), values, places
    )


def _pictures(report: Report) -> list[Picture]:
    return [
        Picture(
            compress_picture(figure.path.read_bytes()),
            f"{figure.label}. Paper: {figure.caption.rstrip('.')}. Ours: {figure.words}",
        )
        for figure in report.figures
    ]


def _paragraphs(markdown: str) -> list[str]:
    """Return the paragraphs and the items of a text in Markdown, without its marks."""
    parts = re.split(r"\n\s*\n|\n(?=[-*] )", markdown.strip())
    return [_plain(part) for part in parts if part]


def _plain(markdown: str) -> str:
    """Return a paragraph without bullets, emphasis and the addresses of links."""
    text = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", re.sub(r"^[-*] ", "", markdown))
    return " ".join(re.sub(r"(\*\*|\*)(?=\S)(.*?)(?<=\S)\1", r"\2", text, flags=re.S).split())
