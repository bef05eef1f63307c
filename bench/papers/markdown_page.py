"""Page of a paper in Markdown."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from trackmark.bench.output_files import write_file
from trackmark.bench.papers.figures import PaperFigure
from trackmark.bench.papers.reproduction import Report
from trackmark.bench.papers.sections import Section
from trackmark.reports.renderers import to_markdown


def write_markdown_page(path: Path, report: Report) -> None:
    """Write the page of a paper."""
    write_file(path, page(report, path.parent))


def page(report: Report, folder: Path) -> str:
    """Return the page of a paper in Markdown, with links to figures in the page's `folder`."""
    about, *sections = report.sections
    parts = [f"# {report.paper.title}", report.paper.citation, *about.paragraphs]
    for number, section in enumerate(sections, 1):
        parts += [f"## {number} {section.title}", *blocks(section, folder)]
    return "\n\n".join(part for part in parts if part) + "\n"


def blocks(section: Section, folder: Path) -> Iterator[str]:
    """Yield the parts of a section. The command is that of the full report."""
    if section.command:
        yield f"    {section.command}"
    yield from section.paragraphs
    if section.figures:
        yield _figures(section.figures, folder)
    yield from (to_markdown(table).rstrip("\n") for table in section.tables)


def _figures(figures: Sequence[PaperFigure], folder: Path) -> str:
    rows = []
    for figure in figures:
        file = figure.path.name if figure.path else "report.html"
        written = figure.path and figure.path.parent == folder
        link = f"[{file}]({file})" if written else f"`{file}`"
        rows.append(f"| {figure.label} | {figure.caption} | {link}: {figure.description} |")
    return "\n".join(["| paper | what it shows | ours |", "|---|---|---|", *rows])
