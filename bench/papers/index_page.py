"""Front page of all papers: their findings and the verdicts in both settings at a glance."""

import json
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote

from trackmark.bench.claims.row_verdicts import SETTINGS, VERDICTS
from trackmark.bench.pages.card_types import PaperRow, VerdictCount
from trackmark.bench.pages.content import Page, PageSection
from trackmark.bench.pages.page import write_page
from trackmark.bench.papers import Effort, paper_names
from trackmark.bench.papers.description import read_description
from trackmark.bench.papers.html_page import NAMES, TONES
from trackmark.bench.store.files import ResultsError


def write_front_page(output: Path) -> Path:
    """Write the page of all papers from their reports in a folder of results; return its file.

    Raises `ResultsError` for an unreadable report, and `OSError`.
    """
    rows = [_row(name, output) for name in paper_names()]
    caption = "As written: the paper taken literally. Recommended: with a few open values changed."
    section = PageSection("papers", "Verdicts in two settings", blocks=[rows], caption=caption)
    judged = sum(bool(row.counts) for row in rows)
    page = Page("trackmark", [section], answer=f"{judged} of {len(rows)} papers reproduced")
    return write_page(output / "report.html", page)[0]


def _row(name: str, output: Path) -> PaperRow:
    """Return the row of a paper; without a report it has the command that writes one."""
    path, description = output / name / "report.json", read_description(name)
    page = f"{name}/report.html"
    address = quote(page) if (output / page).is_file() else ""
    if not path.is_file():
        note = f"Not run. Command: `{Effort().command(name)}`"
        return PaperRow(description.title, address, description.method, {}, note)
    try:
        document: Mapping[str, Any] = json.loads(path.read_text("utf-8"))
        counts = {n: _counts(document, s) for n, s in zip(NAMES, SETTINGS, strict=True)}
        seconds, command = float(document["seconds"]), document["command"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ResultsError(
            f"{path}: the report cannot be read ({error!r}). Reproduce its paper again."
        ) from error
    took = f"{seconds:.0f} s" if seconds < 60 else f"{seconds / 60:.0f} min"
    finding, origin = description.finding, "Made by"
    if not document["claims"]:
        finding, counts, origin = description.method, {}, "Quick report without verdicts:"
    return PaperRow(description.title, address, finding, counts, f"{origin} `{command}` ({took})")


def _counts(document: Mapping[str, Any], setting: str) -> list[VerdictCount]:
    verdicts = Counter(claim["settings"][setting]["verdict"] for claim in document["claims"])
    return [VerdictCount(name, TONES.get(name, "none"), verdicts[name]) for name in VERDICTS]
