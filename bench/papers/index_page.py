"""Front page of all papers: their findings and the verdicts in both settings at a glance."""

import json
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote

from trackmark.bench.claims.row_verdicts import SETTINGS, VERDICTS
from trackmark.bench.pages.content import Page, PageSection
from trackmark.bench.pages.page import card, write_page
from trackmark.bench.papers import Effort, paper_names
from trackmark.bench.papers.description import read_description
from trackmark.bench.papers.html_page import NAMES, TONES
from trackmark.bench.store.files import ResultsError


def write_front_page(output: Path) -> Path:
    """Write the page of all papers from their reports in a folder of results; return its file.

    Raises `ResultsError` for an unreadable report, and `OSError`.
    """
    papers = [_summary(name, output) for name in paper_names()]
    caption = "As written: the paper taken literally. Recommended: with a few open values changed."
    cards = [card("paper_summaries", papers=papers)]
    section = PageSection("papers", "Verdicts in two settings", cards, caption=caption)
    n_reproduced = sum(bool(paper["counts"]) for paper in papers)
    page = Page("trackmark", [section], answer=f"{n_reproduced} of {len(papers)} papers reproduced")
    return write_page(output / "report.html", page)[0]


def _summary(name: str, output: Path) -> dict[str, Any]:
    """Return the summary of a paper; without a report it has the command that writes one."""
    path, description = output / name / "report.json", read_description(name)
    page = f"{name}/report.html"
    summary = {
        "title": description.title,
        "address": quote(page) if (output / page).is_file() else "",
        "finding": description.method,
        "counts": {},
    }
    if not path.is_file():
        return summary | {"note": f"Not run. Command: `{Effort().command(name)}`"}
    try:
        document: Mapping[str, Any] = json.loads(path.read_text("utf-8"))
        counts = {n: _counts(document, s) for n, s in zip(NAMES, SETTINGS, strict=True)}
        seconds, command = float(document["seconds"]), document["command"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ResultsError(
            f"{path}: the report cannot be read ({error!r}). Reproduce its paper again."
        ) from error
    took = f"{seconds:.0f} s" if seconds < 60 else f"{seconds / 60:.0f} min"
    if not document["claims"]:
        return summary | {"note": f"Quick report without verdicts: `{command}` ({took})"}
    note = f"Made by `{command}` ({took})"
    return summary | {"finding": description.finding, "counts": counts, "note": note}


def _counts(document: Mapping[str, Any], setting: str) -> list[tuple[str, str, int, str]]:
    """Return label, tone and number of each verdict; the numbers open nothing."""
    verdicts = Counter(claim["settings"][setting]["verdict"] for claim in document["claims"])
    return [(name, TONES.get(name, "none"), verdicts[name], "") for name in VERDICTS]
