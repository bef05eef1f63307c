"""Terminal output of a reproduction: counts of verdicts, main table, failed claims and files."""

import textwrap
from pathlib import Path

from trackmark.bench.claims.row_verdicts import SETTINGS, VerdictRow
from trackmark.bench.papers.reproduction import Report
from trackmark.reports.printable import width
from trackmark.reports.renderers import terminal_lines

_MAX_CLAIMS = 3
"""Maximum number of claims that are listed, unless all are requested."""

_SHORT = 44
"""Columns for the short text of a claim."""


def screen_lines(
    report: Report, folder: Path, *, verbose: bool = False, quiet: bool = False
) -> list[str]:
    """Return the answer of `trackmark reproduce` in lines for a terminal.

    `folder`: folder of the report. `verbose`: with the verdicts on all claims. `quiet`: only the
    counts of verdicts, or the title if there are no verdicts.
    """
    heads = [*textwrap.wrap(report.description.title, width()), *report.counts]
    if quiet:
        return heads
    finding = textwrap.wrap(report.description.finding, width())
    lines = [*heads, *finding] if report.verdicts else heads
    for table in report.main:
        lines += ["", *terminal_lines(table)]
    failing = [row for row in report.verdicts if "does not hold" in _verdicts(row)]
    listed = report.verdicts if verbose else failing[:_MAX_CLAIMS]
    if listed:
        heading = "claim" if verbose else f"Does not hold ({len(failing)})"
        lines += ["", _row(heading, "", *(name.replace("-", " ") for name in SETTINGS))]
        lines += [_row(f"  {row.claim.name}", row.claim.short, *_verdicts(row)) for row in listed]
        others = 0 if verbose else len(failing) - len(listed)
        lines += [f"  {others} more: --verbose"] if others else []
    return [*lines, "", f"Report  {folder / 'report.html'}"]


def _verdicts(row: VerdictRow) -> list[str]:
    return [row.verdicts[name].verdict for name in SETTINGS]


def _row(name: str, words: str, *verdicts: str) -> str:
    """Return a line with a claim; a long text is shortened."""
    columns = "".join(f" {verdict:<13}" for verdict in verdicts)
    if not words:
        return f"{name:<{_SHORT + 8}}{columns}".rstrip()
    short = textwrap.shorten(words, _SHORT, placeholder=" …")
    return f"{name:<7} {short:<{_SHORT}}{columns}".rstrip()
