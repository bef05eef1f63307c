"""Terminal output of a reproduction: main table, one line per claim, path of the report."""

import textwrap
from pathlib import Path

from trackmark.bench.claims.row_verdicts import SETTINGS, count_verdicts
from trackmark.bench.papers.reproduction import Report
from trackmark.reports.renderers import to_text

WIDTH = 100
"""Maximum length of lines; tables may be wider."""

SHORT = 60


def screen(report: Report, folder: Path) -> str:
    """Return the text that `trackmark reproduce` prints; `folder` contains the full report."""
    lines = textwrap.wrap(report.description.title, WIDTH)
    lines += textwrap.wrap(report.description.finding, WIDTH) if report.verdicts else []
    for table in report.main:
        caption, _, body = to_text(table).partition("\n")
        lines += ["", *textwrap.wrap(caption, WIDTH), body.rstrip("\n")]
    if report.verdicts:
        lines += ["", _row("claim", "", *(setting.replace("-", " ") for setting in SETTINGS))]
        for row in report.verdicts:
            words = [row.verdicts[name].verdict for name in SETTINGS]
            lines.append(_row(row.claim.name, row.claim.short, *words))
        lines += [""]
        lines += [f"{name}: {count_verdicts(report.verdicts, name)}" for name in SETTINGS]
    lines += ["", f"Figures, intervals and reasons: {folder / 'report.html'}"]
    if report.context.effort.quick:
        lines.append(f"Verdicts from all scenes: trackmark reproduce {report.description.name}")
    return "\n".join(lines)


def _row(name: str, words: str, *verdicts: str) -> str:
    columns = "".join(f" {verdict:<14}" for verdict in verdicts)
    return f"{name:<6} {words:<{SHORT}}{columns}".rstrip()
