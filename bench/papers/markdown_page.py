"""Page of a paper in Markdown."""

from pathlib import Path

from trackmark.bench.claims.row_verdicts import verdict_table
from trackmark.bench.papers.reproduction import Report
from trackmark.reports.files import write_file
from trackmark.reports.renderers import to_markdown
from trackmark.reports.tables import Table

RULES = (
    "The unit is the scene, and intervals are 95 % confidence intervals. A claim on a share of "
    "scenes holds if its interval lies above 1/2, because the paper shows one run. Differences are "
    "positive if they support the claim. A claim on a difference holds if its interval lies above "
    "0. A claim that a tracker is not worse holds if its interval lies above -margin and the "
    "scenes are enough to show that a difference is small. Numbers that were measured on the "
    "paper's videos are not testable."
)
VIDEOS = (
    "The paper's videos are not available. Synthetic scenes, drawn from the paper's descriptions, "
    "replace them. The paper's numbers are therefore printed next to ours, but our results need "
    "not reach them. There are two settings: `as-written` takes the text literally; `recommended` "
    "differs from `as-written` only in the values that the section *Settings* lists."
)


def write_page(path: Path, report: Report) -> None:
    """Write the page of a paper."""
    write_file(path, lambda file: file.write_text(page(report, path.parent), "utf-8"))


def page(report: Report, folder: Path) -> str:
    """Return the page of a paper in Markdown, with links to figures in the page's `folder`."""
    entry, notes = report.description, report.notes
    parts = [f"# {entry.title}", f"{entry.citation}", f"**Method.** {entry.method}"]
    if report.verdicts:
        parts.append(f"**Result.** {entry.finding} {notes.get('Result', '')}".rstrip())
    parts.append(VIDEOS)
    sections = {
        "The paper's numbers and ours": [*map(markdown, report.main)],
        "Figures": [_figures(report, folder)],
    }
    if report.verdicts:
        counts = f"{len(report.verdicts)} claims. {'; '.join(report.counts)}."
        rules = f"{RULES} See [verdicts on claims](../verdicts.md)."
        sections["Verdicts"] = [rules, counts, markdown(verdict_table(report.verdicts))]
        sections["What differs and why"] = [notes.get("What differs and why", "")]
    sections["The scenes"] = [markdown(report.criteria)]
    sections["Settings"] = [markdown(report.settings)]
    absent = f"Written by `trackmark reproduce {entry.name} --all`."
    sensitivity = markdown(report.sensitivity) if report.sensitivity else absent
    sections["Sensitivity (no verdicts)"] = [sensitivity]
    options = "`--all` adds the sensitivity table; `--quick` omits the verdicts."
    options = f"{options} {notes.get('How long it takes', '')}".rstrip()
    sections["How to run it"] = [f"    trackmark reproduce {entry.name} --all", options]
    sections["History"] = [notes.get("History", "")]
    for number, (title, texts) in enumerate(sections.items(), 1):
        parts += [f"## {number} {title}", *texts]
    return "\n\n".join(part for part in parts if part) + "\n"


def markdown(table: Table) -> str:
    """Return a table in Markdown, with its caption above and its notes below."""
    return to_markdown(table).rstrip("\n")


def _figures(report: Report, folder: Path) -> str:
    rows = []
    for figure in report.figures:
        file = figure.path.name if figure.path else "report.html"
        written = figure.path and figure.path.parent == folder
        link = f"[{file}]({file})" if written else f"`{file}`"
        rows.append(f"| {figure.label} | {figure.caption} | {link}: {figure.words} |")
    return "\n".join(["| paper | what it shows | ours |", "|---|---|---|", *rows])
