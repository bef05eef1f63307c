"""Page of a paper in HTML: its table and figures next to ours, verdicts, and folded details."""

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
from trackmark.bench.papers.figures import Image, PaperFigure
from trackmark.bench.papers.measures import MeasuredRun
from trackmark.bench.papers.player_content import (
    PlayerContent,
    claim_run,
    main_runs,
    player_content,
)
from trackmark.bench.papers.reproduction import Report
from trackmark.bench.papers.runs import Context
from trackmark.bench.papers.tables import main_values
from trackmark.bench.papers.verdicts import VerdictRow, effect_text, setting_counts
from trackmark.reports.tables import MISSING

TONES = {"holds": "good", "does not hold": "bad", "inconclusive": "undecided"}
WIDTH = 320  # of a frame in a strip [px]
MIN_DECIDED = 0.3  # share of the verdicts below which the page says that most are missing


def write_html_page(path: Path, report: Report, progress: Progress = lambda *_: None) -> list[Path]:
    """Write the page of a paper into the report's folder and return its files.

    The folders of the paper's experiments lie next to that folder. `progress`: called with
    the numbers of read frames and of all frames. Raises `OSError` or `ResultsError`.
    """
    context = report.context
    runs = [claim_run(row.claim, s, context) for row in report.verdicts for s in SETTINGS]
    for row in report.paper.main_table.rows:
        for setting in SETTINGS:
            runs += main_runs(row, setting, context)
    player = player_content(runs, context, progress)
    n, labels = context.n_scenes, _tracker_labels(context)
    page = Page(
        report.paper.title,
        [*_sections(report, player)],
        [labels[label] for label in player.reading.labels],
        player.sequences,
        meta=f"{without_markup(report.paper.citation)} · {n} scene{'s' * (n != 1)} per sequence",
        heading=report.paper.finding if report.verdicts else "",
        details=_details(report),
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


def _details(report: Report) -> list[str]:
    """Return the sentences below the heading."""
    if not report.verdicts:
        command = f"trackmark reproduce {report.paper.name}"
        return [f"Quick report on few scenes, without verdicts. For verdicts run: {command}"]
    verdicts = [v.verdict for row in report.verdicts for v in row.verdicts.values()]
    decided = sum(verdict in ("holds", "does not hold") for verdict in verdicts)
    few = decided < MIN_DECIDED * (len(verdicts) - verdicts.count("not testable here"))
    start = ["Most claims could not be decided."] if few else []
    counts = "; ".join(setting_counts(report.verdicts)).capitalize()
    return [*start, f"{len(report.verdicts)} claims. {counts}."]


def _sections(report: Report, player: PlayerContent) -> Iterator[PageSection]:
    """Yield the parts of the page in their order."""
    groups = _groups(report, player)
    if groups:
        counts = [(g["title"], g["tone"], len(g["claims"]), g["key"]) for g in groups]
        cards = [card("verdict_counts", counts=counts)]
        yield PageSection("counts", f"{len(report.verdicts)} claims", cards)
    caption = "A number of ours opens the worst run behind it."
    table = _main_table(report, player)
    title = "The paper's numbers and ours"
    yield PageSection("numbers", title, [table], caption=caption, nav="Table")
    if panels := _panels(report.figures):
        yield PageSection(
            "figures", "Figures", [card("figure_panels", panels=panels)], nav="Figures"
        )
    for times in report.main[1:]:
        yield PageSection(times.name, "Times", [card("page_table", sheet=PageTable(times))])
    if groups:
        caption = (
            "A positive difference supports the claim; “not worse” allows the margin. A claim "
            "unfolds its quote, its worst runs and the reasons of its verdicts."
        )
        cards = [card("verdict_groups", groups=groups)]
        yield PageSection("verdicts", "Verdicts", cards, caption=caption, nav="Verdicts")
    yield PageSection("details", "Details", [*_folds(report)], nav="Details")


def _main_table(report: Report, player: PlayerContent) -> Markup:
    """Return the main table; a value opens its worst run and shows the verdict on its claim."""
    main, verdicts = report.paper.main_table, {row.claim.name: row for row in report.verdicts}
    rows = []
    for row in main.rows:
        values_by_setting = [main_values(row, setting, report.context) for setting in SETTINGS]
        positions = [
            [player.links.get(run) for run in main_runs(row, setting, report.context)]
            for setting in SETTINGS
        ]
        if not main.columns:
            values_by_setting = [[row.separator.join(values)] for values in values_by_setting]
        ours = [
            [
                {
                    "text": values_by_setting[k][i],
                    "share": _share(values_by_setting[k][i]),
                    "position": positions[k][i] if i < len(positions[k]) else None,
                    **_mark(verdicts.get(row.claims[i]) if i < len(row.claims) else None, setting),
                }
                for k, setting in enumerate(SETTINGS)
            ]
            for i in range(len(values_by_setting[0]))
        ]
        rows.append({"labels": row.labels, "paper": row.paper, "ours": ours})
    colours = "Green: a claim on this value holds; red: it does not; yellow: inconclusive."
    videos = "Our videos are not those of the paper: compare orders, not numbers."
    notes = [main.caption, *([colours] if verdicts else []), videos]
    return card(
        "paper_table",
        heading=" / ".join(main.headings),
        columns=main.columns or [""],
        settings=[*SETTING_LABELS.values()],
        rows=rows,
        notes=notes,
        is_paired=any(len(row.paper) > 1 for row in main.rows),
    )


def _mark(row: VerdictRow | None, setting: str) -> dict[str, str]:
    """Return tone and tip of a value that a claim is about."""
    if row is None:
        return {"tone": "", "tip": ""}
    verdict = row.verdicts[setting].verdict
    tip = f"{row.claim.name}, {row.claim.summary}: {verdict}"
    return {"tone": TONES.get(verdict, ""), "tip": tip}


def _share(value: str) -> float | None:
    number = re.fullmatch(r"(\d+) %", value)
    return int(number[1]) / 100 if number else None


def _panels(figures: Sequence[PaperFigure]) -> list[dict[str, Any]]:
    """Return the figures of the paper; all files of a figure share a panel."""
    panels: dict[str, list[PaperFigure]] = {}
    for figure in figures:
        panels.setdefault(figure.label.partition(",")[0], []).append(figure)
    return [_panel(label, files) for label, files in panels.items()]


def _panel(label: str, figures: Sequence[PaperFigure]) -> dict[str, Any]:
    """Return a figure: a strip as frames with one row per tracker, other figures as pictures."""
    figure, strip = figures[0], figures[0].strip
    caption = f"{figure.caption[:1].upper()}{figure.caption[1:].rstrip('.')}."
    panel = {"label": label, "caption": caption, "frames": [], "rows": [], "pictures": []}
    if strip is None:
        pictures = [
            compress_picture(drawing.path.read_bytes()) for drawing in figures if drawing.path
        ]
        description = f"Ours: {figure.description.rstrip('.')}."
        return panel | {"description": description, "pictures": pictures}
    colours = (
        "; green: tracked or lost as in the paper; red: not" if figure.definition.paper else ""
    )
    description = (
        f"Ours: {figure.description} White: true {figure.definition.shape}; solid: as written; "
        f"dashed: recommended; px: centre error{colours}."
    )
    rows = []
    for index, tracker in enumerate(figure.definition.trackers):
        runs = [(label, measured) for name, label, measured in strip.rows if name == tracker.name]
        paper = figure.definition.paper.get(tracker.name, [""] * len(strip.frames))
        tiles = [
            _tile(strip.sequence[frame], frame, runs, state, figure.definition.shape, index)
            for frame, state in zip(strip.frames, paper, strict=True)
        ]
        rows.append((index, tracker.name, tiles))
    frames = [f"frame {number}" for number in figure.definition.frames]
    return panel | {"description": description, "frames": frames, "rows": rows}


def _tile(
    image: Image,
    frame: int,
    runs: Sequence[tuple[str, MeasuredRun]],
    paper: str,
    shape: str,
    tracker: int,
) -> tuple[Markup, list[tuple[str, str, str]]]:
    """Return a frame with the boxes of both settings, and notes: label, text and tone of each.

    `paper`: `tracked` or `lost` in the paper, or empty.
    """
    notes = [("paper", paper, "")] if paper else []
    for setting, measured in runs:
        state = "tracked" if measured.on_target[frame] else "lost"
        outcome = (
            f"{state} ({measured.error[frame]:.0f} px)" if measured.present[frame] else MISSING
        )
        notes.append((setting, outcome, paper and ("good" if state == paper else "bad")))
    frame_image = card(
        "frame_image",
        image=next(encode_images([image], round(WIDTH * image.shape[0] / image.shape[1]), 75))[0],
        size=(image.shape[1], image.shape[0]),
        truth=runs[0][1].truth.boxes[frame],
        boxes=[(tracker, dash, measured.boxes[frame]) for dash, (_, measured) in enumerate(runs)],
        description=", ".join(f"{name}: {outcome}" for name, outcome, _ in notes),
        is_ellipse=shape == "ellipse",
    )
    return frame_image, notes


def _groups(report: Report, player: PlayerContent) -> list[dict[str, Any]]:
    """Return the claims by their verdicts in both settings; groups without claims are left out."""
    groups = {
        "both": ("Holds in both settings", "good"),
        "one": ("Holds in one setting", "undecided"),
        "neither": ("Holds in neither setting", "bad"),
        "inconclusive": ("Inconclusive in both settings", "undecided"),
        "numbers": ("Not testable in both settings", "none"),
    }
    items: dict[str, list[dict[str, Any]]] = {key: [] for key in groups}
    for row in report.verdicts:
        verdicts = [row.verdicts[setting].verdict for setting in SETTINGS]
        key = ("neither", "one", "both")[verdicts.count("holds")]
        if set(verdicts) == {"not testable here"}:
            key = "numbers"
        elif set(verdicts) == {"inconclusive"}:
            key = "inconclusive"
        items[key].append(_item(row, report.context, player))
    return [
        {"key": f"group-{key}", "title": title, "tone": tone, "claims": items[key]}
        for key, (title, tone) in groups.items()
        if items[key]
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
        effect = effect_text(claim, verdict)
        effect = f"difference {effect}" if is_difference and effect != MISSING else effect
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
    """Yield the sections of the report that are folded; the others have sections of the page."""
    for section in report.sections:
        paragraphs = [p for text in section.paragraphs for p in _paragraphs(text)]
        if section.key not in ("numbers", "figures") and (paragraphs or section.tables):
            yield card(
                "fold",
                key=f"fold-{section.key}",
                title=section.fold_title or section.title,
                summary=section.hint or section.command,
                paragraphs=paragraphs,
                tables=[] if section.fold_title else [*map(PageTable, section.tables)],
                commands=[section.command] if section.command else [],
            )


def _paragraphs(markdown: str) -> list[str]:
    """Return the paragraphs and the items of a text in Markdown, without its marks."""
    parts = re.split(r"\n\s*\n|\n(?=[-*] )", markdown.strip())
    return [without_markup(part) for part in parts if part]


def without_markup(markdown: str) -> str:
    """Return a paragraph without bullets, emphasis and the addresses of links."""
    text = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", re.sub(r"^[-*] ", "", markdown))
    return " ".join(re.sub(r"(\*\*|\*)(?=\S)(.*?)(?<=\S)\1", r"\2", text, flags=re.S).split())
