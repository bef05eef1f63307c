"""Pages of a paper in Markdown: the page with its pictures, and the page with details."""

from collections.abc import Iterator, Sequence
from os.path import relpath
from pathlib import Path

from trackmark.bench.output_files import write_file
from trackmark.bench.papers.figures import PaperFigure
from trackmark.bench.papers.reproduction import Report
from trackmark.bench.papers.sections import Section, label_sentences
from trackmark.bench.papers.strips import draw_picture, to_webp
from trackmark.bench.papers.verdicts import setting_counts
from trackmark.reports.renderers import to_markdown

WITHOUT_VERDICTS = (
    "The claims of this paper have not been judged on the present scenes. The numbers below are a "
    "quick look; their caption states the number of scenes."
)
"""Sentence on a page without verdicts, as `reproduce --quick` writes it."""

DETAILS = "-details"
"""Ending of the stem of the page with details."""


def write_markdown_pages(path: Path, pictures: Path, report: Report) -> None:
    """Write the page of a paper, its details next to it, and its film strips into a folder."""
    for figure in report.pictures:
        if figure.strip:
            write_file(picture_file(figure, pictures, report), to_webp(draw_picture(figure.strip)))
    write_file(path, page(report, path, pictures))
    write_file(details_file(path), details_page(report, path))


def details_file(path: Path) -> Path:
    """Return the file of the details of a page."""
    return path.with_stem(f"{path.stem}{DETAILS}")


def picture_file(figure: PaperFigure, pictures: Path, report: Report) -> Path:
    """Return the file of a film strip in the folder of pictures."""
    return pictures / f"{report.paper.name}-{figure.name}.webp"


def page(report: Report, path: Path, pictures: Path) -> str:
    """Return the page of a paper; its links are relative to `path`."""
    contents = ", ".join(section.title.lower() for section in report.details)
    more = f"[Details]({details_file(path).name}): {contents}."
    blocks = [f"# {report.paper.title}", report.paper.citation]
    if report.verdicts:
        sums = "\n".join(f"- {line}" for line in setting_counts(report.verdicts))
        blocks += [f"**{report.paper.finding}**", sums, label_sentences(report.verdicts)]
    else:
        blocks += [report.paper.method, WITHOUT_VERDICTS]
    blocks.append(more)
    for section in report.sections:
        blocks += [f"## {section.title}", *_paragraphs(section)]
        for figure in section.figures:
            file = Path(relpath(picture_file(figure, pictures, report), path.parent)).as_posix()
            blocks += [f"![{alternative_text(figure)}]({file})", f"*{_figure_caption(figure)}*"]
        blocks += _tables(section)
    return "\n\n".join(block for block in blocks if block) + "\n"


def details_page(report: Report, path: Path) -> str:
    """Return the page with details; its links are relative to `path`, the page of the paper."""
    title = report.paper.title.partition(":")[0]
    blocks = [f"# Details: {title}", f"[Results and verdicts]({path.name})"]
    for section in report.details:
        blocks += [f"## {section.title}", *_paragraphs(section)]
        if section.figures:
            blocks.append(_figure_list(section.figures))
        blocks += _tables(section)
    return "\n\n".join(block for block in blocks if block) + "\n"


def section_text(section: Section) -> str:
    """Return a section without figures."""
    return "\n\n".join([f"## {section.title}", *_paragraphs(section), *_tables(section)])


def alternative_text(figure: PaperFigure) -> str:
    """Return the text for readers who cannot see a film strip."""
    assert figure.strip is not None
    rows = "; ".join(row.name for row in figure.strip.rows)
    labels = ", ".join(dict.fromkeys(figure.strip.labels))
    return f"{figure.label}, our scene: {labels}. Rows: {rows}."


def _figure_caption(figure: PaperFigure) -> str:
    return f"{figure.label}: {figure.caption.rstrip('.')}. {figure.description}"


def _paragraphs(section: Section) -> Iterator[str]:
    if section.commands:
        yield "\n".join(f"    {command}" for command in section.commands)
    yield from section.paragraphs


def _tables(section: Section) -> Iterator[str]:
    yield from (to_markdown(table).rstrip("\n") for table in section.tables)


def _figure_list(figures: Sequence[PaperFigure]) -> str:
    rows = []
    for figure in figures:
        file = figure.path.name if figure.path else "report.html"
        rows.append(f"| {figure.label} | {figure.caption} | `{file}`: {figure.description} |")
    return "\n".join(["| paper | what it shows | ours |", "|---|---|---|", *rows])
