"""One page for all papers: verdicts, durations, and where each paper's own page is."""

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import quote

from bench.papers import NO_EVIDENCE, paper_names
from bench.papers.description import read_description
from bench.papers.html_page import plain_table
from bench.papers.screen import OUTCOMES, outcome, tally
from bench.store.files import ResultsError
from reports.page.content import Page, Section, Sheet, Tile
from reports.page.page import write_page
from reports.tables import MISSING

__all__ = ["write_front_page"]

_WORDS = (
    "Each paper's page shows its tables and figures, what every verdict rests on, and the frames "
    "behind it. Claims are the papers' own; those that we added stand on the pages alone."
)


def write_front_page(output: Path) -> Path:
    """Write the page of all papers, from the reports that lie in the folder of results.

    Raises `ResultsError` for a report that can't be read, and `OSError` where the page can't be
    written.
    """
    told = {name: _read(output / name / "report.json") for name in paper_names()}
    rows, values, links = [], [], []
    for name, document in told.items():
        there = document is not None and (output / name / "report.html").is_file()
        links.append(f"{quote(name)}/report.html" if there else "")
        row, numbers = _row(name, document)
        rows.append(row)
        values.append(numbers)
    heads = ["paper", "title", *OUTCOMES]
    heads += ["trackers took", "this took", "reproduce …"]
    table = plain_table("papers", "Claims by verdict; a paper opens its page.", heads, rows)
    table = replace(table, n_labels=2)
    quick = any(document and document.get("quick") for document in told.values())
    title = "Papers reproduced"
    papers = zip(told, told.values(), links, strict=True)
    tiles = [_tile(*one) for one in papers]
    sheet = Sheet(table, values, links=links, folded=True)
    section = Section("papers", "Papers", [_WORDS], tiles=tiles, sheets=[sheet])
    page = Page(f"{NO_EVIDENCE}: {title[:1].lower()}{title[1:]}" if quick else title, [section])
    return write_page(output / "report.html", page)[0]


def _read(path: Path) -> Mapping[str, Any] | None:
    """A report as a script reads it; None where there is none."""
    if not path.is_file():
        return None
    try:
        document = json.loads(path.read_text("utf-8"))
        return document if isinstance(document["claims"], list) else None
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ResultsError(f"{path} can't be read ({error}); reproduce its paper again.") from error


def _tile(name: str, document: Mapping[str, Any] | None, link: str) -> Tile:
    """A paper at a glance."""
    if document is None:
        title, words = read_description(name).title, [f"Not run: `trackmark reproduce {name}`."]
        return Tile(f"{name}: {title}", words=words)
    title = str(document["title"]).removeprefix(f"{NO_EVIDENCE}: ")
    claims = tally(document["claims"])
    took = _duration(document.get("tracking_seconds"))
    words = [f"{sum(claims.values())} claims; trackers took {took}."]
    words += [f"{NO_EVIDENCE}."] if document.get("quick") else []
    return Tile(f"{name}: {title}", link, words, claims)


def _row(name: str, document: Mapping[str, Any] | None) -> tuple[list[str], list[float]]:
    """Texts and numbers of a paper; numbers are what columns are sorted by."""
    if document is None:
        title, nothing = read_description(name).title, [MISSING] * (len(OUTCOMES) + 2)
        blank = [float("nan")] * (len(nothing) + 1)
        return [name, title, *nothing, "not run"], blank
    said = [outcome(one) for one in document["claims"] if not one["evidence"]["ours"]]
    counts = [said.count(one) for one in OUTCOMES]
    times = [document.get("tracking_seconds"), document.get("seconds")]
    title = str(document["title"]).removeprefix(f"{NO_EVIDENCE}: ")  # its command says so, too
    texts = [name, title, *map(str, counts), *map(_duration, times)]
    numbers = [float("nan") if one is None else float(one) for one in [*counts, *times]]
    command = str(document.get("command", MISSING)).removeprefix("trackmark reproduce ")
    return [*texts, command], [*numbers, float("nan")]


def _duration(seconds: float | None) -> str:
    if seconds is None:
        return MISSING
    if seconds < 60:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 3600 else f"{seconds / 3600:.1f} h"
