"""Terminal output of a reproduction: sum lines, main table, failed claims and the page."""

import textwrap
from pathlib import Path

from trackmark.bench.papers import SETTING_LABELS, SETTINGS
from trackmark.bench.papers.reproduction import Report
from trackmark.bench.papers.verdicts import VerdictRow, setting_counts
from trackmark.reports.printable import width
from trackmark.reports.renderers import terminal_lines

_MAX_CLAIMS = 3
"""Maximum number of claims that are listed, unless all are requested."""

_SUMMARY = 44
"""Columns for the summary of a claim."""


def report_lines(
    report: Report, folder: Path, *, verbose: bool = False, quiet: bool = False
) -> list[str]:
    """Return the output of `trackmark reproduce` for a terminal.

    The sum line of each setting comes first, and the last line names the page in `folder`. With
    `verbose`, the output contains the verdicts on all claims. With `quiet`, it has only the sum
    lines, or the title if there are no verdicts.
    """
    title, sums = textwrap.wrap(report.paper.title, width()), setting_counts(report.verdicts)
    if quiet:
        return sums or title
    lines = [*sums, *(textwrap.wrap(report.paper.finding, width()) if sums else title)]
    lines += ["", *terminal_lines(report.main[0])]
    if report.verdicts:
        lines += _claims(report.verdicts, verbose)
    return [*lines, "", f"Report  {folder / 'report.html'}"]


def _claims(rows: list[VerdictRow], verbose: bool) -> list[str]:
    """Return lines on all claims, or on the first of those that do not hold as recommended."""
    failing = [row for row in rows if row.verdicts[SETTINGS[-1]].verdict == "does not hold"]
    listed = rows if verbose else failing[:_MAX_CLAIMS]
    if not listed:
        return []
    heading = "claim" if verbose else f"Does not hold ({len(failing)})"
    lines = ["", _line(heading, "", *SETTING_LABELS.values())]
    lines += [_line(f"  {row.claim.name}", row.claim.summary, *_verdicts(row)) for row in listed]
    n_others = 0 if verbose else len(failing) - len(listed)
    return lines + ([f"  {n_others} more: --verbose"] if n_others else [])


def _verdicts(row: VerdictRow) -> list[str]:
    return [row.verdicts[name].verdict for name in SETTINGS]


def _line(name: str, summary: str, *verdicts: str) -> str:
    """Return a line with a claim; a long summary is shortened."""
    columns = "".join(f" {verdict:<13}" for verdict in verdicts)
    if not summary:
        return f"{name:<{_SUMMARY + 8}}{columns}".rstrip()
    shortened = textwrap.shorten(summary, _SUMMARY, placeholder=" …")
    return f"{name:<7} {shortened:<{_SUMMARY}}{columns}".rstrip()
