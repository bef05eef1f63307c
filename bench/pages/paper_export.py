"""Export of a page for a paper: its tables as files, and the page in Markdown and LaTeX."""

import hashlib
import re
from collections.abc import Collection
from pathlib import Path
from urllib.parse import quote

from trackmark.reports.files import write_file
from trackmark.reports.page.content import Page, PageSection
from trackmark.reports.renderers import (
    OR_NUMBERS,
    breakable,
    in_latex,
    in_markdown,
    to_latex,
    to_markdown,
)
from trackmark.reports.write import write_tables

_MAX_FLOATS = 10
"""Number of floats before `\\clearpage`: LaTeX stores only about fifty unplaced ones."""

_FIGURE = r"""\begin{figure}[htbp]
\centering
\includegraphics[width=\linewidth]{%s}
\caption{%s}
\end{figure}"""


def write_paper(folder: Path, page: Page, suffix: str, written: Collection[str]) -> list[Path]:
    """Write the tables of a page, `report.md` and `report.tex` into a folder; return the files.

    `written`: names of tables that exist already. `report.tex` can be included in a document that
    uses booktabs and graphicx. Both contain the figures in the folder with this `suffix`. LaTeX
    includes the PDF instead of an SVG, and copies of figures whose names are not ASCII. Raises
    `OSError` if a file cannot be written.
    """
    tables = [sheet.table for section in page.sections for sheet in section.sheets]
    paths = write_tables(folder, [table for table in tables if table.name not in written])
    texts = {"report.md": _markdown, "report.tex": _latex}
    return paths + [
        _write(folder / name, render(page, folder, suffix)) for name, render in texts.items()
    ]


def _write(path: Path, text: str) -> Path:
    return write_file(path, lambda file: file.write_text(text, encoding="utf-8"))


def _figures(section: PageSection, folder: Path, suffix: str) -> list[tuple[str, str]]:
    """Return the names of the existing figures of a section with their captions."""
    named = [
        (chart.figure, f"{chart.title}: {chart.words}".removeprefix(": "))
        for chart in section.charts
    ]
    named += [(sheet.table.name, sheet.table.caption) for sheet in section.sheets if sheet.heat]
    files = [(f"{name}{suffix}", words) for name, words in named]
    return [(name, words) for name, words in files if (folder / name).is_file()]


def _printed_sections(page: Page) -> list[PageSection]:
    """Return the sections of a page that do not list sequences."""
    return [section for section in page.sections if not section.scenes]


def _markdown(page: Page, folder: Path, suffix: str) -> str:
    parts = [f"# {in_markdown(page.title)}"]
    parts += map(in_markdown, filter(None, [page.answer, *page.details]))
    for section in _printed_sections(page):
        parts += [f"## {in_markdown(section.title)}", *map(in_markdown, section.words)]
        parts += [to_markdown(sheet.table).rstrip("\n") for sheet in section.sheets]
        for name, words in _figures(section, folder, suffix):
            parts += [f"![{in_markdown(words)}]({quote(name)})", in_markdown(words)]
    return "\n\n".join(parts) + "\n"


def _ascii_file(folder: Path, name: str) -> str:
    """Return the file name of a figure; copy the file if its name is not ASCII."""
    if name.isascii():
        return name
    digest = hashlib.sha256(name.encode()).hexdigest()[:8]
    stem = re.sub(r"[^A-Za-z0-9]+", "-", Path(name).stem).strip("-") or "figure"
    copy = f"{stem}-{digest}{Path(name).suffix}"
    write_file(folder / copy, lambda file: file.write_bytes((folder / name).read_bytes()))
    return copy


def _latex(page: Page, folder: Path, suffix: str) -> str:
    suffix = ".pdf" if suffix == ".svg" else suffix
    parts = [OR_NUMBERS, r"\begingroup\sloppy"]
    answer = filter(None, [page.answer, *page.details])
    parts += [breakable(in_latex(text)) for text in answer]
    n_floats = 0
    for section in _printed_sections(page):
        words = [breakable(in_latex(text)) for text in section.words]
        floats = [to_latex(sheet.table) for sheet in section.sheets]
        for name, caption in _figures(section, folder, suffix):
            floats.append(_FIGURE % (_ascii_file(folder, name), breakable(in_latex(caption))))
        parts += [rf"\section*{{{in_latex(section.title)}}}", *words]
        for text in floats:
            n_floats += text.count(r"\caption")
            parts += [text, *([r"\clearpage"] if n_floats > _MAX_FLOATS else [])]
            n_floats %= _MAX_FLOATS + 1
    return "\n\n".join([*parts, r"\endgroup"]) + "\n"
