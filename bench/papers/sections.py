"""Sections of a report, in the order of its HTML page, Markdown page and terminal output."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from trackmark.bench.papers import paper_file
from trackmark.bench.papers.figures import PaperFigure
from trackmark.bench.papers.paper import Paper, read_sensitivity
from trackmark.bench.papers.runs import Context
from trackmark.bench.papers.settings import clip_command, default_sentences, setting_table
from trackmark.bench.papers.tables import criteria_table, sensitivity_table
from trackmark.bench.papers.verdicts import VerdictRow, setting_counts, verdict_table
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
    "The paper's videos are not included; if you have one, [run the trackers on it](clips.md). "
    "Synthetic scenes, drawn from the paper's descriptions, replace the videos. The paper's "
    "numbers are therefore printed next to ours, but our results need not reach them. Some scenes, "
    "claims and settings were changed after results had been seen; the "
    "[history](history.md#{paper}) lists the changes. There are two settings: `as-written` takes "
    "the text literally; `recommended` differs from `as-written` only in the values that the "
    "section *Settings* lists."
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


def report_sections(
    context: Context,
    main: Sequence[Table],
    figures: Sequence[PaperFigure],
    verdicts: Sequence[VerdictRow],
) -> list[Section]:
    """Return the sections of a report; a quick report has neither verdicts nor differences."""
    paper, options = context.paper, context.options
    notes = read_notes(paper.name)
    about = [f"**Method.** {paper.method}"]
    sections = [
        Section("numbers", "The paper's numbers and ours", tables=main),
        Section("figures", "Figures", figures=figures),
    ]
    if verdicts:
        about.append(f"**Result.** {paper.finding} {notes.get('Result', '')}".rstrip())
        rules = f"{RULES} See [verdicts on claims](../verdicts.md)."
        counts = f"{len(verdicts)} claims. {'; '.join(setting_counts(verdicts))}."
        sections += [
            Section(
                "verdicts",
                "Verdicts",
                [rules, counts],
                [verdict_table(verdicts)],
                fold_title="Rules of the verdicts",
            ),
            Section("differences", "What differs and why", [notes.get("What differs and why", "")]),
        ]
    sensitivity = Section(
        "choices",
        "Sensitivity (no verdicts)",
        [f"Written by `trackmark reproduce {paper.name} --all`."],
        hint="open choices",
    )
    if options.with_sensitivity:
        table = sensitivity_table(context, read_sensitivity(paper))
        sensitivity = replace(sensitivity, paragraphs=[], tables=[table])
    effects = "`--all` adds the sensitivity table; `--quick` omits the verdicts."
    effects = f"{effects} {notes.get('How long it takes', '')}".rstrip()
    criteria, settings = criteria_table(paper.name), setting_section(paper)
    return [
        Section("method", "Method and videos", [*about, VIDEOS.format(paper=paper.name)]),
        *sections,
        Section("scenes", "The scenes", tables=[criteria], hint="criteria, and values"),
        settings,
        sensitivity,
        Section("command", "How to run it", [effects], command=options.command(paper.name)),
        clip_section(paper),
    ]


def setting_section(paper: Paper) -> Section:
    """Return the section on the values of the settings."""
    return Section(
        "parameters",
        "Settings",
        default_sentences(paper),
        [setting_table(paper)],
        hint="parameters that differ",
    )


def clip_section(paper: Paper) -> Section:
    """Return the section on clips of the paper that a reader has."""
    recipe = "[docs/papers/clips.md](clips.md)"
    text = f"Runs the paper's trackers in both settings on a clip. Recipe: {recipe}."
    command = clip_command(paper)
    return Section("clip", "On a clip of the paper", [text], command=command, hint="command")


def read_notes(paper: str) -> dict[str, str]:
    """Return the sections of a paper's `notes.md` by heading."""
    content = paper_file(paper, "notes.md").read_text("utf-8")
    sections = [section.partition("\n") for section in content.split("\n## ")[1:]]
    return {heading.strip(): body.strip() for heading, _, body in sections}
