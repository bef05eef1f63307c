"""The page of a paper: its prose is somebody's, its table and verdicts are what was run."""

from pathlib import Path

from bench.papers import NO_EVIDENCE, Effort, Report
from bench.papers.html_page import command_of, holds
from bench.papers.screen import EFFECT, claim_count, outcome
from bench.store.files import ResultsError
from reports.files import write_file
from reports.ledger import claim_words
from reports.renderers import to_markdown

__all__ = ["BEGIN", "END", "write_page"]

BEGIN = "<!-- From here: written by trackmark reproduce --page. -->"
END = "<!-- To here. -->"
_SKELETON = """# {title}

What the paper says, in a paragraph.

{begin}
{end}

## What to make of it

## What is open

## How to run it

```
trackmark reproduce {paper}
```
"""


def write_page(path: Path, report: Report, paper: str, effort: Effort) -> None:
    """Write the main tables and a line a claim between a page's marks; the rest stays as it is.

    A page that is not there is begun, with a skeleton for its prose.

    Raises
    ------
    ResultsError
        If the page lacks the marks or is not UTF-8.
    OSError
        If the page cannot be read or written.
    """
    try:
        text = path.read_text("utf-8") if path.is_file() else None
    except UnicodeDecodeError as error:
        raise ResultsError(
            f"{path}: not UTF-8 (byte {error.start}). Give another --page."
        ) from None
    if text is None:
        text = _SKELETON.format(title=report.title, begin=BEGIN, end=END, paper=paper)
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not (begin and end):
        raise ResultsError(
            f"{path}: there are no two lines {BEGIN!r} and {END!r} to write between; add them."
        )
    page = f"{before}{BEGIN}\n\n{_results(report, paper, effort)}\n{END}{after}"
    write_file(path, lambda file: file.write_text(page, "utf-8"))


def _results(report: Report, paper: str, effort: Effort) -> str:
    begins = f"**{NO_EVIDENCE}.** What" if effort.quick else "What"
    made = f"{begins} `{command_of(paper, effort)}` found"
    parts = [f"{made}{f' ({effort.words})' if effort.words else ''}:"]
    parts += [to_markdown(table).rstrip("\n") for table in report.main]
    rows = [
        f"| {claim['id']} | {_plain(claim_words(claim))} | {outcome(claim)} | "
        f"{_plain(claim['effect']) or '—'} | {holds(claim)} |"
        for claim in report.claims
    ]
    heads = [f"| claim | what it says | verdict | {EFFECT} | holds in readings |", f"|{'---|' * 5}"]
    return "\n\n".join([*parts, f"{claim_count(report.claims)}.", "\n".join(heads + rows)]) + "\n"


def _plain(text: str) -> str:
    """A sentence as it may stand in a cell of a table."""
    return text.replace("|", "\\|").replace("*", "\\*").replace("\n", " ")
