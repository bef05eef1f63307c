"""One page for all papers: counts of verdicts in both settings, and links to the papers' pages."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote

from trackmark.bench.claims.row_verdicts import SETTINGS, count_words
from trackmark.bench.papers import paper_names
from trackmark.bench.papers.description import read_description
from trackmark.bench.store.files import ResultsError
from trackmark.reports.page.content import Page, PageSection, PageTable
from trackmark.reports.page.page import write_page
from trackmark.reports.tables import MISSING, text_table


def write_front_page(output: Path) -> Path:
    """Write the page of all papers from the reports in the folder of results; return its file.

    Raises
    ------
    ResultsError
        If a report cannot be read.
    OSError
        If the page cannot be written.
    """
    rows, links = [], []
    for name in paper_names():
        rows.append(_row(name, _read(output / name / "report.json")))
        page = f"{name}/report.html"
        links.append(quote(page) if (output / page).is_file() else "")
    heads = ["paper", "title", *(name.replace("-", " ") for name in SETTINGS), "made by"]
    table = text_table("papers", "Claims by verdict; a paper opens its page.", heads, rows, 2)
    section = PageSection("papers", "Papers", sheets=[PageTable(table, links=links)])
    return write_page(output / "report.html", Page("Papers reproduced", [section]))[0]


def _read(path: Path) -> Mapping[str, Any] | None:
    """Return a paper's `report.json`; None if there is none."""
    if not path.is_file():
        return None
    try:
        document: Mapping[str, Any] = json.loads(path.read_text("utf-8"))
        _counts(document, SETTINGS[0])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ResultsError(
            f"{path}: the report cannot be read ({error!r}). Reproduce its paper again."
        ) from error
    return document


def _counts(document: Mapping[str, Any], setting: str) -> str:
    verdicts = [claim["settings"][setting]["verdict"] for claim in document["claims"]]
    return count_words(verdicts) or "no verdicts"


def _row(name: str, document: Mapping[str, Any] | None) -> list[str]:
    if document is None:
        return [name, read_description(name).title, MISSING, MISSING, "not run"]
    counts = [_counts(document, setting) for setting in SETTINGS]
    seconds = float(document["seconds"])
    took = f"{seconds:.0f} s" if seconds < 60 else f"{seconds / 60:.0f} min"
    return [name, document["title"], *counts, f"{document['command']} ({took})"]
