"""Sections of a report, in the order of its HTML page, Markdown page and terminal output."""

from collections.abc import Sequence
from dataclasses import dataclass

from trackmark.bench.papers.figures import PaperFigure
from trackmark.bench.papers.reproduction import Report
from trackmark.bench.papers.verdicts import verdict_table
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


@dataclass(frozen=True)
class Section:
    """Section of a report. Pages leave out sections without content."""

    key: str
    title: str
    paragraphs: Sequence[str] = ()  # Markdown
    tables: Sequence[Table] = ()
    figures: Sequence[PaperFigure] = ()
    command: str = ""
    hint: str = ""  # content, printed next to the title of a folded section
    fold_title: str = ""  # of the paragraphs, if a page shows the tables elsewhere


def report_sections(report: Report) -> list[Section]:
    """Return the sections of a report; a quick report has neither verdicts nor differences."""
    notes, options, name = report.notes, report.context.options, report.paper.name
    about = [f"**Method.** {report.paper.method}"]
    sections = [
        Section("numbers", "The paper's numbers and ours", tables=report.main),
        Section("figures", "Figures", figures=report.figures),
    ]
    if report.verdicts:
        about.append(f"**Result.** {report.paper.finding} {notes.get('Result', '')}".rstrip())
        counts = f"{len(report.verdicts)} claims. {'; '.join(report.counts)}."
        rules = f"{RULES} See [verdicts on claims](../verdicts.md)."
        differences = [notes.get("What differs and why", "")]
        sections += [
            Section(
                "verdicts",
                "Verdicts",
                [rules, counts],
                [verdict_table(report.verdicts)],
                fold_title="Rules of the verdicts",
            ),
            Section("differences", "What differs and why", differences),
        ]
    absent = f"Written by `trackmark reproduce {name} --all`."
    command = "`--all` adds the sensitivity table; `--quick` omits the verdicts."
    command = f"{command} {notes.get('How long it takes', '')}".rstrip()
    return [
        Section("method", "Method and videos", [*about, VIDEOS]),
        *sections,
        Section("scenes", "The scenes", tables=[report.criteria], hint="criteria, and values"),
        Section("parameters", "Settings", tables=[report.settings], hint="parameters"),
        Section(
            "choices",
            "Sensitivity (no verdicts)",
            [] if report.sensitivity else [absent],
            [report.sensitivity] if report.sensitivity else [],
            hint="open choices",
        ),
        Section("command", "How to run it", [command], command=options.command(name)),
        Section(
            "history",
            "History",
            [notes.get("History", "")],
            hint="earlier scenes, claims and rules",
        ),
    ]
