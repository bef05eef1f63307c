"""Page of a paper in HTML, in the order of its Markdown page; details are folded."""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from markupsafe import Markup

from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.pages.content import Page, PageSection, PageTable
from trackmark.bench.pages.page import card, write_page
from trackmark.bench.pages.page_frames import Progress
from trackmark.bench.pages.player_frames import compress_picture, encode_images
from trackmark.bench.papers import SETTING_LABELS, SETTINGS
from trackmark.bench.papers.figures import PaperFigure
from trackmark.bench.papers.main_table import MainCell, main_caption, main_cell, shown_settings
from trackmark.bench.papers.player_content import (
    PlayerContent,
    claim_run,
    main_runs,
    player_content,
)
from trackmark.bench.papers.reproduction import Report
from trackmark.bench.papers.runs import Context
from trackmark.bench.papers.sections import SETTINGS_SENTENCE, label_sentences
from trackmark.bench.papers.strips import COLOUR_SENTENCE, PAPER, Strip, StripRow
from trackmark.bench.papers.verdicts import (
    VERDICTS,
    VerdictRow,
    estimate_text,
    setting_counts,
    unit_text,
)
from trackmark.reports.tables import MISSING

TONES = {"holds": "good", "does not hold": "bad", "inconclusive": "undecided"}
QUALITY = 75  # of the frames in a strip


def write_html_page(path: Path, report: Report, progress: Progress = lambda *_: None) -> list[Path]:
    """Write the page of a paper into the report's folder and return its files.

    The folders of the paper's experiments lie next to that folder. `progress`: called with
    the numbers of read frames and of all frames. Raises `OSError` or `ResultsError`.
    """
    context = report.context
    runs = [claim_run(row.claim, s, context) for row in report.verdicts for s in SETTINGS]
    for row in report.paper.main_table.rows:
        for setting in shown_settings(report.paper):
            runs += main_runs(row, setting, context)
    player = player_content(runs, context, progress)
    labels = _tracker_labels(context)
    heading, details = report.paper.finding, label_sentences(report.verdicts)
    if not report.verdicts:
        command = f"trackmark reproduce {report.paper.name}"
        heading = ""
        details = f"Quick report on few scenes, without verdicts. For verdicts run: {command}"
    page = Page(
        report.paper.title,
        [*_sections(report, player)],
        [labels[label] for label in player.reading.labels],
        player.sequences,
        heading=without_markup(heading),
        sums=setting_counts(report.verdicts),
        details=[without_markup(details)],
        styles=["paper.css"],
    )
    return write_page(path, page)


def _tracker_labels(context: Context) -> dict[str, str]:
    """Return the name in the paper's tables and the setting of each tracker, by its label."""
    labels: dict[str, str] = {}
    for tracker in context.paper.trackers.values():
        specs = {label: tracker.spec(setting) for setting, label in SETTING_LABELS.items()}
        for label, spec in specs.items():
            is_shared = len(set(specs.values())) == 1
            name = tracker.name if is_shared else f"{tracker.name}, {label}"
            labels[parse_tracker(spec).label] = name
    return labels


def _sections(report: Report, player: PlayerContent) -> Iterator[PageSection]:
    """Yield the parts of the page in their order."""
    table, caption = _main_table(report, player), "A number of ours opens the worst run behind it."
    by_key = {section.key: section for section in report.sections}
    yield PageSection("numbers", by_key["numbers"].title, [table], caption=caption, nav="Table")
    figures = [*report.pictures, *(f for f in report.figures if f not in report.pictures)]
    if panels := _panels(figures):
        cards = [card("figure_panels", panels=panels)]
        yield PageSection("figures", "Pictures", cards, nav="Pictures")
    if groups := _groups(report, player):
        caption = (
            "A positive difference supports the claim; “not worse” allows the margin. A claim "
            "unfolds its quote, its worst runs and the reasons of its verdicts."
        )
        cards = [card("verdict_groups", groups=groups)]
        yield PageSection("verdicts", "Verdicts", cards, caption=caption, nav="Verdicts")
    if section := by_key.get("differences"):
        cards = [card("texts", paragraphs=_paragraphs(section.paragraphs))]
        yield PageSection(section.key, section.title, cards, nav="Differences")
    yield PageSection("details", "Details", [*_folds(report)], nav="Details")


def _main_table(report: Report, player: PlayerContent) -> Markup:
    """Return the main table; a value opens its worst run and shows the verdict on its claim."""
    main, verdicts = report.paper.main_table, {row.claim.name: row for row in report.verdicts}
    settings, rows = shown_settings(report.paper), []
    for row in main.rows:
        ours = []
        for setting in settings:
            cell = main_cell(row, setting, report.context)
            positions = [player.links.get(run) for run in main_runs(row, setting, report.context)]
            values = [
                {
                    "text": text,
                    "position": positions[i] if i < len(positions) else None,
                    **_mark(verdicts.get(row.claims[i]) if i < len(row.claims) else None, setting),
                }
                for i, text in enumerate(cell.values)
            ]
            ours.append({"values": values, "total": cell.total})
        theirs = MainCell.parse(row.paper)
        unlinked = {"tone": "", "tip": "", "position": None}
        values = [{"text": text, **unlinked} for text in theirs.values]
        cells: list[dict[str, Any]] = [{"values": values, "total": theirs.total}, *ours]
        digits = max(len(value["text"]) for cell in cells for value in cell["values"])
        rows.append({"labels": row.labels, "cells": cells, "digits": digits})
    colours = "Green: a claim on this value holds; red: it does not; yellow: inconclusive."
    notes = [main_caption(report.context), *([colours] if verdicts else []), SETTINGS_SENTENCE]
    return card(
        "paper_table",
        headings=main.headings,
        columns=["paper", *settings.values()],
        rows=rows,
        notes=[without_markup(note) for note in notes],
    )


def _mark(row: VerdictRow | None, setting: str) -> dict[str, str]:
    """Return tone and tip of a value that a claim is about."""
    if row is None:
        return {"tone": "", "tip": ""}
    verdict = row.verdicts[setting].verdict
    tip = f"{row.claim.name}, {row.claim.summary}: {verdict}"
    return {"tone": TONES.get(verdict, ""), "tip": tip}


def _panels(figures: Sequence[PaperFigure]) -> list[dict[str, Any]]:
    """Return the figures of the paper; all files of a figure share a panel."""
    panels: dict[str, list[PaperFigure]] = {}
    for figure in figures:
        panels.setdefault(figure.label.partition(",")[0], []).append(figure)
    return [_panel(label, of_panel) for label, of_panel in panels.items()]


def _panel(label: str, figures: Sequence[PaperFigure]) -> dict[str, Any]:
    """Return the figures of a panel: a film strip, or pictures."""
    (figure, *_) = figures
    caption = figure.caption
    panel: dict[str, Any] = {"label": label, "n_columns": 0, "rows": [], "pictures": []}
    panel["caption"] = f"{caption[:1].upper()}{caption[1:].rstrip('.')}."
    description = f"Ours: {without_markup(figure.description).rstrip('.')}."
    if figure.strip is None:
        pictures = [compress_picture(drawn.path.read_bytes()) for drawn in figures if drawn.path]
        return panel | {"description": description, "pictures": pictures}
    notes = [note for row in figure.strip.rows for of_tile in row.notes for note in of_tile]
    has_states = any(note.tone for note in notes)
    states = " Green: tracked or lost as in the paper; red: not." if has_states else ""
    return panel | {
        "description": f"{description} {COLOUR_SENTENCE}{states}",
        "n_columns": len(figure.strip.labels),
        "rows": [(row.name, [*_tiles(figure.strip, row)]) for row in figure.strip.rows],
    }


def _tiles(strip: Strip, row: StripRow) -> Iterator[dict[str, Any]]:
    """Yield image, description and notes of each frame in a row of a strip."""
    for column, label in enumerate(strip.labels):
        tile = strip.tile(row, column)
        notes = row.notes[column] if row.notes else ()
        states = [f"{note.label}: {note.remark}" for note in notes]
        yield {
            "image": next(encode_images([tile], tile.shape[0], QUALITY))[0],
            "size": tile.shape[1::-1],
            "description": ", ".join([f"{row.name}, {label}", *states]),
            "notes": [note for note in notes if note.label != PAPER],  # in the image
        }


def _groups(report: Report, player: PlayerContent) -> list[dict[str, Any]]:
    """Return the claims by their verdicts in the setting recommended."""
    items: dict[str, list[dict[str, Any]]] = {label: [] for label in VERDICTS}
    for row in report.verdicts:
        label = row.verdicts[SETTINGS[-1]].verdict
        items[label].append(_item(row, report.context, player))
    return [
        {
            "key": f"group-{label.replace(' ', '-')}",
            "title": f"{label[:1].upper()}{label[1:]}, {SETTING_LABELS[SETTINGS[-1]]}",
            "tone": TONES.get(label, "none"),
            "claims": claims,
        }
        for label, claims in items.items()
        if claims
    ]


def _item(row: VerdictRow, context: Context, player: PlayerContent) -> dict[str, Any]:
    """Return a claim: its verdicts open the worst runs, and it unfolds quote and reasons."""
    claim, cells = row.claim, []
    facts = {
        "identifier": claim.name,
        "claim": claim.statement,
        "refuted if": claim.falsified_if,
        "measure": claim.measure.definition,
        "reason for it": claim.reason,
    }
    is_difference = claim.test.startswith(("order", "no-worse"))
    for setting, name in SETTING_LABELS.items():
        verdict = row.verdicts[setting]
        effect = estimate_text(claim, verdict)
        if effect != MISSING:
            difference = "difference " if is_difference else ""
            effect = f"{difference}{effect} ({unit_text(claim, verdict)})"
        facts[name] = f"{verdict.verdict}: {effect}; {verdict.reason}"
        tone, remarks = TONES.get(verdict.verdict, "none"), "; ".join(row.remarks(setting))
        cells.append(
            {
                "setting": name,
                "verdict": verdict.verdict,
                "tone": tone,
                "effect": effect,
                "reason": remarks,
                "position": player.links.get(claim_run(claim, setting, context)),
            }
        )
    return {
        "key": f"claim-{claim.name}",
        "title": f"{claim.summary[:1].upper()}{claim.summary[1:]}",
        "paper": claim.paper,
        "cells": cells,
        "quote": f"“{claim.quote}” ({claim.source})",
        "facts": {heading: fact for heading, fact in facts.items() if fact},
    }


def _folds(report: Report) -> Iterator[Markup]:
    """Yield the sections that are folded: the rest of the page, and its details."""
    open_sections = ("numbers", "pictures", "verdicts", "differences", "figures")
    for section in report.sections + report.details:
        paragraphs = _paragraphs(section.paragraphs)
        if section.key not in open_sections and (paragraphs or section.tables):
            yield card(
                "fold",
                key=f"fold-{section.key}",
                title=section.title,
                paragraphs=paragraphs,
                tables=[*map(PageTable, section.tables)],
                commands=section.commands,
            )


def _paragraphs(blocks: Sequence[str]) -> list[str]:
    """Return the paragraphs and the items of Markdown, without their marks."""
    paragraphs = re.split(r"\n\s*\n|\n(?=[-*] )", "\n\n".join(blocks))
    return [without_markup(paragraph) for paragraph in paragraphs if paragraph.strip()]


def without_markup(markdown: str) -> str:
    """Return a paragraph without bullets, emphasis and the addresses of links."""
    text = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", re.sub(r"^[-*] ", "", markdown))
    return " ".join(re.sub(r"(\*\*|\*)(?=\S)(.*?)(?<=\S)\1", r"\2", text, flags=re.S).split())
