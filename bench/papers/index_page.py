"""Front page of all papers: their findings and the verdicts in both settings at a glance."""

import json
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote

from trackmark.bench.pages.content import Page, PageSection
from trackmark.bench.pages.page import card, write_page
from trackmark.bench.papers import SETTING_LABELS, ReproductionOptions, paper_names
from trackmark.bench.papers.html_page import TONES
from trackmark.bench.papers.paper import read_paper
from trackmark.bench.papers.verdicts import VERDICTS
from trackmark.bench.store.database import ResultsError


def write_front_page(results_root: Path) -> Path:
    """Write the page of all papers from their reports in a folder of results; return its file.

    Raises `ResultsError` for an unreadable report, and `OSError`.
    """
    papers = [_summary(name, results_root) for name in paper_names()]
    caption = "As written: printed equations and numbers. Recommended: defaults of the trackers."
    cards = [card("paper_summaries", papers=papers)]
    section = PageSection("papers", "Verdicts in two settings", cards, caption=caption)
    n_reproduced = sum(bool(paper["counts"]) for paper in papers)
    heading = f"{n_reproduced} of {len(papers)} papers reproduced"
    page = Page("trackmark", [section], heading=heading, styles=["paper.css"])
    return write_page(results_root / "report.html", page)[0]


def _summary(name: str, results_root: Path) -> dict[str, Any]:
    """Return the summary of a paper; without a report it has the command that writes one."""
    path, paper = results_root / name / "report.json", read_paper(name)
    page = f"{name}/report.html"
    summary = {
        "title": paper.title,
        "address": quote(page) if (results_root / page).is_file() else "",
        "finding": paper.method,
        "counts": {},
    }
    if not path.is_file():
        return summary | {"note": f"Not run. Command: `{ReproductionOptions().command(name)}`"}
    try:
        document: Mapping[str, Any] = json.loads(path.read_text("utf-8"))
        counts = {label: _counts(document, s) for s, label in SETTING_LABELS.items()}
        seconds, command = float(document["seconds"]), document["command"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ResultsError(
            f"{path}: the report cannot be read ({error!r}). Reproduce its paper again."
        ) from error
    took = f"{seconds:.0f} s" if seconds < 60 else f"{seconds / 60:.0f} min"
    if not document["claims"]:
        return summary | {"note": f"Quick report without verdicts: `{command}` ({took})"}
    note = f"Made by `{command}` ({took})"
    return summary | {"finding": paper.finding, "counts": counts, "note": note}


def _counts(document: Mapping[str, Any], setting: str) -> list[tuple[str, str, int, str]]:
    """Return label, tone and number of each verdict; the numbers open nothing."""
    verdicts = Counter(claim["settings"][setting]["verdict"] for claim in document["claims"])
    return [(name, TONES.get(name, "none"), verdicts[name], "") for name in VERDICTS]
