"""Page of a paper in HTML: its table and figures next to ours, verdicts, and folded details."""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from trackmark.bench.claims.row_verdicts import SETTINGS, VerdictRow, effect_text
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.pages import card_types
from trackmark.bench.pages.card_types import Fold, Still
from trackmark.bench.pages.content import Page, PageSection, PageTable
from trackmark.bench.pages.page import write_page
from trackmark.bench.pages.page_frames import Watch
from trackmark.bench.pages.player_frames import compress_picture, encode_film
from trackmark.bench.papers.evidence_frames import (
    Footage,
    claim_run,
    film_runs,
    main_runs,
)
from trackmark.bench.papers.figures import Drawing, Image
from trackmark.bench.papers.main_table import main_values
from trackmark.bench.papers.markdown_page import RULES, VIDEOS
from trackmark.bench.papers.measures import JudgedRun, measure_function
from trackmark.bench.papers.plan import tracker_text
from trackmark.bench.papers.reproduction import Report
from trackmark.bench.papers.runs import Context
from trackmark.datasets.spec_string import parse_text
from trackmark.reports.tables import MISSING

FACTS = {
    "identifier": "name",
    "claim": "statement",
    "refuted if": "falsified",
    "measure": "measure",
    "reason for it": "reason",
    "note": "note",
}
"""Fields of a claim by their headings."""

NAMES = [setting.replace("-", " ") for setting in SETTINGS]
TONES = {"holds": "good", "does not hold": "bad", "inconclusive": "undecided"}
WIDTH = 320  # of a frame in a strip [px]
MIN_DECIDED = 0.3  # share of the verdicts below which the page says that most are missing


def write_html_page(path: Path, report: Report, watch: Watch = lambda *_: None) -> list[Path]:
    """Write the page of a paper into the report's folder and return its files.

    The folders of the paper's experiments lie next to that folder. `watch`: called with the number
    of frames read, and of all frames. Raises `OSError` or `ResultsError`.
    """
    context = report.context
    runs = [claim_run(row.claim, s, context) for row in report.verdicts for s in SETTINGS]
    for row in context.description.main_table.rows:
        for setting in SETTINGS:
            runs += main_runs(row, setting, context)
    footage = film_runs(runs, context, watch)
    n, names = context.scenes, _tracker_names(context)
    page = Page(
        report.description.title,
        [*_sections(report, footage)],
        [names[label] for label in footage.reading.labels],
        footage.scenes,
        meta=f"{plain(report.description.citation)} · {n} scene{'s' * (n != 1)} per sequence",
        answer=report.description.finding if report.verdicts else "",
        details=_details(report),
    )
    return write_page(path, page)


def _tracker_names(context: Context) -> dict[str, str]:
    """Return the name in the paper's tables and the setting of each tracker, by its label."""
    names: dict[str, str] = {}
    for name in context.description.trackers:
        texts = [tracker_text(context.description, name, setting) for setting in SETTINGS]
        for text, setting in zip(texts, NAMES, strict=True):
            is_shared = len(set(texts)) == 1
            names[parse_tracker(text).label] = name if is_shared else f"{name}, {setting}"
    return names


def _details(report: Report) -> list[str]:
    """Return the sentences below the heading."""
    if not report.verdicts:
        command = f"trackmark reproduce {report.description.name}"
        return [f"Quick report on few scenes, without verdicts. For verdicts run: {command}"]
    verdicts = [v.verdict for row in report.verdicts for v in row.verdicts.values()]
    decided = sum(verdict in ("holds", "does not hold") for verdict in verdicts)
    few = decided < MIN_DECIDED * (len(verdicts) - verdicts.count("not testable"))
    start = ["Most claims could not be decided."] if few else []
    return [*start, f"{len(report.verdicts)} claims. {'; '.join(report.counts).capitalize()}."]


def _sections(report: Report, footage: Footage) -> Iterator[PageSection]:
    """Yield the parts of the page in their order."""
    groups = _groups(report, footage)
    if groups:
        counts = [card_types.VerdictCount(g.title, g.tone, len(g.claims), g.key) for g in groups]
        yield PageSection("counts", f"{len(report.verdicts)} claims", blocks=[counts])
    caption = "A number of ours opens the worst run behind it."
    table = _main_table(report, footage)
    title = "The paper's numbers and ours"
    yield PageSection("numbers", title, blocks=[table], caption=caption, nav="Table")
    if panels := _panels(report.figures):
        yield PageSection("figures", "Figures", blocks=[panels], nav="Figures")
    for times in report.main[1:]:
        yield PageSection(times.name, "Times", blocks=[PageTable(times)])
    if groups:
        caption = (
            "A positive difference supports the claim; “not worse” allows the margin. A claim "
            "unfolds its quote, its worst runs and the reasons of its verdicts."
        )
        yield PageSection("verdicts", "Verdicts", blocks=[groups], caption=caption, nav="Verdicts")
    yield PageSection("details", "Details", blocks=[*_folds(report)], nav="Details")


def _main_table(report: Report, footage: Footage) -> card_types.SideTable:
    """Return the main table; a value opens its worst run and shows the verdict on its claim."""
    main, verdicts = report.description.main_table, {row.claim.name: row for row in report.verdicts}
    rows = []
    for row in main.rows:
        texts = [main_values(row, setting, report.context) for setting in SETTINGS]
        places = [
            [footage.places.get(run) for run in main_runs(row, setting, report.context)]
            for setting in SETTINGS
        ]
        if not main.columns:
            texts = [[row.separator.join(values)] for values in texts]
        ours = [
            [
                card_types.SideCell(
                    texts[k][i],
                    _share(texts[k][i]),
                    *_mark(verdicts.get(row.claims[i]) if i < len(row.claims) else None, setting),
                    place=places[k][i] if i < len(places[k]) else None,
                )
                for k, setting in enumerate(SETTINGS)
            ]
            for i in range(len(texts[0]))
        ]
        rows.append(card_types.SideRow(row.labels, row.paper, ours))
    colours = "Green: a claim on this value holds; red: it does not; yellow: inconclusive."
    videos = "Our videos are not those of the paper: compare orders, not numbers."
    notes = [main.caption, *([colours] if verdicts else []), videos]
    return card_types.SideTable(" / ".join(main.heads), main.columns or [""], NAMES, rows, notes)


def _mark(row: VerdictRow | None, setting: str) -> tuple[str, str]:
    """Return tone and tip of a value that a claim is about."""
    if row is None:
        return "", ""
    verdict = row.verdicts[setting].verdict
    return TONES.get(verdict, ""), f"{row.claim.name}, {row.claim.short}: {verdict}"


def _share(text: str) -> float | None:
    number = re.fullmatch(r"(\d+) %", text)
    return int(number[1]) / 100 if number else None


def _panels(figures: Sequence[Drawing]) -> list[card_types.FigurePanel]:
    """Return the figures of the paper; all files of a figure share a panel."""
    panels: dict[str, list[Drawing]] = {}
    for figure in figures:
        panels.setdefault(figure.label.partition(",")[0], []).append(figure)
    return [_panel(label, drawings) for label, drawings in panels.items()]


def _panel(label: str, figures: Sequence[Drawing]) -> card_types.FigurePanel:
    """Return a figure: a strip as frames with one row per tracker, other figures as pictures."""
    figure, strip = figures[0], figures[0].strip
    caption = f"{figure.caption[:1].upper()}{figure.caption[1:].rstrip('.')}."
    if strip is None:
        words = f"Ours: {figure.words.rstrip('.')}."
        pictures = [
            compress_picture(drawing.path.read_bytes()) for drawing in figures if drawing.path
        ]
        return card_types.FigurePanel(label, caption, words, pictures=pictures)
    colours = "; green: on or off as in the paper; red: not" if figure.entry.paper else ""
    words = (
        f"Ours: {figure.words} White: true {figure.entry.shape}; solid: as written; dashed: "
        f"recommended; px: centre error{colours}."
    )
    rows = []
    for number, tracker in enumerate(figure.entry.trackers):
        runs = [(setting, judged) for name, setting, judged in strip.rows if name == tracker]
        paper = figure.entry.paper.get(tracker, [""] * len(strip.frames))
        tiles = [
            _tile(strip.sequence[frame], frame, runs, state, figure.entry.shape, number)
            for frame, state in zip(strip.frames, paper, strict=True)
        ]
        rows.append(card_types.StripRow(tracker, number, tiles))
    frames = [f"frame {number}" for number in figure.entry.frames]
    return card_types.FigurePanel(label, caption, words, frames, rows)


def _tile(
    image: Image,
    frame: int,
    runs: Sequence[tuple[str, JudgedRun]],
    paper: str,
    shape: str,
    tracker: int,
) -> card_types.StripTile:
    """Return a frame with the boxes of both settings; `paper`: its `on` or `off`, or empty."""
    notes = [("paper", paper, "")] if paper else []
    for setting, judged in runs:
        state = "on" if judged.on_target[frame] else "off"
        text = f"{state} ({judged.error[frame]:.0f} px)" if judged.present[frame] else MISSING
        notes.append((setting, text, paper and ("good" if state == paper else "bad")))
    truth, *boxes = (
        rows[frame].tolist()
        for rows in (runs[0][1].truth.boxes, *(judged.boxes for _, judged in runs))
    )
    still = Still(
        next(encode_film([image], round(WIDTH * image.shape[0] / image.shape[1]), 75))[0],
        (image.shape[1], image.shape[0]),
        truth if np.isfinite(truth).all() else None,
        [(tracker, dash, box) for dash, box in enumerate(boxes) if np.isfinite(box).all()],
        ", ".join(f"{name}: {text}" for name, text, _ in notes),
        shape == "ellipse",
    )
    return card_types.StripTile(still, notes)


def _groups(report: Report, footage: Footage) -> list[card_types.VerdictGroup]:
    """Return the claims by their verdicts in both settings; groups without claims are left out."""
    groups = {
        "both": ("Holds in both settings", "good"),
        "one": ("Holds in one setting", "undecided"),
        "neither": ("Holds in neither setting", "bad"),
        "inconclusive": ("Inconclusive in both settings", "undecided"),
        "numbers": ("Not testable", "none"),
    }
    items: dict[str, list[card_types.VerdictItem]] = {key: [] for key in groups}
    for row in report.verdicts:
        verdicts = [row.verdicts[setting].verdict for setting in SETTINGS]
        key = ("neither", "one", "both")[verdicts.count("holds")]
        if "not testable" in verdicts:
            key = "numbers"
        elif set(verdicts) == {"inconclusive"}:
            key = "inconclusive"
        items[key].append(_item(row, report.context, footage))
    return [
        card_types.VerdictGroup(f"group-{key}", *groups[key], claims)
        for key, claims in items.items()
        if claims
    ]


def _item(row: VerdictRow, context: Context, footage: Footage) -> card_types.VerdictItem:
    """Return a claim: its verdicts open the worst runs, and it unfolds quote and reasons."""
    claim, cells = row.claim, []
    facts = {head: text for head, name in FACTS.items() if (text := str(getattr(claim, name)))}
    facts["measure"] = _measure_words(claim.measure, context)
    is_difference = claim.test.startswith(("order", "no-worse"))
    for setting, name in zip(SETTINGS, NAMES, strict=True):
        verdict = row.verdicts[setting]
        effect = effect_text(claim, verdict)
        effect = f"difference {effect}" if is_difference and effect != MISSING else effect
        facts[name] = f"{verdict.verdict}: {effect}; {verdict.reason}"
        tone, remarks = TONES.get(verdict.verdict, "none"), "; ".join(row.remarks(setting))
        place = footage.places.get(claim_run(claim, setting, context))
        cells.append(card_types.VerdictCell(name, verdict.verdict, tone, effect, remarks, place))
    quote = f"“{claim.quote}” ({claim.source})"
    title = f"{claim.short[:1].upper()}{claim.short[1:]}"
    return card_types.VerdictItem(f"claim-{claim.name}", title, claim.paper, cells, quote, facts)


def _measure_words(measure: str, context: Context) -> str:
    """Return the definition of a measure, from its docstring, and its name."""
    in_module = measure.startswith(("scenes.", "timing."))
    name, paper = parse_text(measure)[0], context.description.name
    function = context.function(measure) if in_module else measure_function(name, paper)
    definition = function.__doc__.partition("\n")[0].removeprefix("Return ").rstrip(".")
    return f"{definition} (`{measure}`)"


def _folds(report: Report) -> Iterator[Fold]:
    """Yield the details of the page."""
    notes, effort = report.notes, report.context.effort
    result, differs, times, history = (
        _paragraphs(notes.get(heading, ""))
        for heading in ("Result", "What differs and why", "How long it takes", "History")
    )
    about = [plain(VIDEOS), report.description.method]
    if report.verdicts:
        yield Fold("differences", "What differs and why", words=[*about, RULES, *result, *differs])
    else:
        yield Fold("method", "Method and scenes", words=about)
    yield Fold("scenes", "The scenes", "criteria, and values", sheets=[PageTable(report.criteria)])
    yield Fold("parameters", "Settings", "parameters", sheets=[PageTable(report.settings)])
    if report.sensitivity:
        tables = [PageTable(report.sensitivity)]
        yield Fold("choices", "Sensitivity", "open choices, without verdicts", sheets=tables)
    command = effort.command(report.description.name)
    yield Fold("command", "How to run it", command, times, commands=[command])
    if history:
        yield Fold("history", "History", "earlier scenes, claims and rules", history)


def _paragraphs(markdown: str) -> list[str]:
    """Return the paragraphs and the items of a text in Markdown, without its marks."""
    parts = re.split(r"\n\s*\n|\n(?=[-*] )", markdown.strip())
    return [plain(part) for part in parts if part]


def plain(markdown: str) -> str:
    """Return a paragraph without bullets, emphasis and the addresses of links."""
    text = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", re.sub(r"^[-*] ", "", markdown))
    return " ".join(re.sub(r"(\*\*|\*)(?=\S)(.*?)(?<=\S)\1", r"\2", text, flags=re.S).split())
