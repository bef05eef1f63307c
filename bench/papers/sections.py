"""Sections of a paper's page and of its details page, in reading order.

The Markdown pages, the HTML page and the terminal output show the same sections.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from trackmark.bench.papers import paper_file
from trackmark.bench.papers.development import read_sensitivity
from trackmark.bench.papers.figures import PaperFigure
from trackmark.bench.papers.main_table import shown_settings
from trackmark.bench.papers.paper import Paper
from trackmark.bench.papers.real_video import paper_table
from trackmark.bench.papers.runs import Context
from trackmark.bench.papers.settings import clip_command
from trackmark.bench.papers.strips import COLOUR_SENTENCE
from trackmark.bench.papers.tables import (
    candidate_table,
    chain_sentences,
    chain_table,
    choice_table,
    criteria_table,
    sensitivity_table,
)
from trackmark.bench.papers.verdicts import VerdictRow, verdict_table
from trackmark.reports.tables import Table

RULES = (
    "The unit is the scene, and intervals are 95 % confidence intervals. A claim on a share of "
    "scenes holds if its interval lies above 1/2, because the paper shows one run. Differences are "
    "positive if they support the claim. A claim on a difference holds if its interval lies above "
    "0. A claim that a tracker is not worse holds if its interval lies above -margin and the "
    "scenes are enough to show that a difference is small. See "
    "[verdicts on claims](../verdicts.md)."
)
VIDEOS = (
    "The paper's videos are not included; if you have one, [run the trackers on it](clips.md). "
    "Synthetic scenes, drawn from the paper's descriptions, replace the videos. The paper's "
    "numbers are therefore printed next to ours, but our results need not reach them."
)
SETTINGS_SENTENCE = (
    "*As written* takes the printed equations and numbers literally. *Recommended* is the default "
    "preset of each tracker."
)
LABEL_SENTENCES = {
    "by construction": (
        "*By construction*: a criterion that selected the scenes uses the result of the claim, so "
        "the claim is not counted."
    ),
    "not testable here": (
        "*Not testable here*: our scenes cannot show the claim; the table states the reason. "
        "*Ceiling*: all compared trackers keep nearly every target. *Floor*: they keep nearly none."
    ),
}
"""Explanations of verdicts that are not counted, by their labels."""

DIFFERS, DECIDED = "What differs and why", "Decided after results had been seen"
WITHOUT_CLAIM = "Statements that are not judged"
"""Headings in `notes.md`."""

REAL_VIDEO = "Real video"
"""Heading of the section that `tools.real_video` replaces in the pages of the papers."""


@dataclass(frozen=True)
class Section:
    """Section of a report. Pages leave out sections without content."""

    key: str
    title: str
    paragraphs: Sequence[str] = ()  # Markdown
    tables: Sequence[Table] = ()
    figures: Sequence[PaperFigure] = ()
    commands: Sequence[str] = ()


def label_sentences(verdicts: Sequence[VerdictRow]) -> str:
    """Return explanations of the labels that verdicts have and that are not counted."""
    labels = {verdict.verdict for row in verdicts for verdict in row.verdicts.values()}
    return " ".join(text for label, text in LABEL_SENTENCES.items() if label in labels)


def page_sections(
    context: Context,
    main: Table,
    figures: Sequence[PaperFigure],
    verdicts: Sequence[VerdictRow],
) -> list[Section]:
    """Return the sections of a paper's page after the answer.

    A quick report has no verdicts, and no notes on differences and decisions.
    """
    paper, notes = context.paper, read_notes(context.paper.name)
    of_page = {figure.name: figure for figure in figures if figure.name in paper.pictures}
    strips = [of_page[name] for name in paper.pictures if name in of_page]
    sections = [
        Section("numbers", "The paper's results and ours", [SETTINGS_SENTENCE], [main]),
        Section("pictures", "Pictures", [COLOUR_SENTENCE] if strips else [], figures=strips),
    ]
    if verdicts:
        table = verdict_table(verdicts, shown_settings(paper))
        sections.append(Section("verdicts", "Verdicts", tables=[table]))
        sections.append(Section("differences", DIFFERS, [notes.get(DIFFERS, "")]))
    sections += [real_video_section(paper), chain_section(paper)]
    if verdicts:
        sections.append(Section("decided", DECIDED, [notes.get(DECIDED, "")]))
    return [*sections, command_section(context, notes)]


def details_sections(
    context: Context,
    main: Sequence[Table],
    figures: Sequence[PaperFigure],
    verdicts: Sequence[VerdictRow],
) -> list[Section]:
    """Return the sections of a paper's details page; `main`: tables in addition to the main one."""
    paper, notes = context.paper, read_notes(context.paper.name)
    sensitivity = read_sensitivity(paper)
    if not sensitivity.rows:
        reason = "No choice moves the main measure on development data by more than 0.02."
    else:
        reason = f"Not measured; `trackmark reproduce {paper.name} --all` measures it."
    tables = (
        [sensitivity_table(context, sensitivity)]
        if sensitivity.rows and context.options.with_sensitivity
        else []
    )
    history = f"The [history](history.md#{paper.name}) lists changes of scenes and claims."
    return [
        Section("method", "Method and videos", [paper.citation, paper.method, VIDEOS, history]),
        *([Section("rules", "Rules of the verdicts", [RULES])] if verdicts else []),
        *(
            [Section("not-judged", WITHOUT_CLAIM, [notes[WITHOUT_CLAIM]])]
            if WITHOUT_CLAIM in notes
            else []
        ),
        Section("scenes", "Criteria of the scenes", tables=[criteria_table(paper.name)]),
        Section("choices", "Choices of the trackers", tables=[choice_table(paper)]),
        Section("considered", "Values that were not taken", tables=[candidate_table(paper)]),
        Section("sensitivity", "Sensitivity", [] if tables else [reason], tables),
        *(Section(table.name, table.name.capitalize(), tables=[table]) for table in main),
        Section("figures", "Figures", figures=figures),
    ]


def real_video_section(paper: Paper) -> Section:
    """Return the section on recorded sequences of OTB."""
    text = (
        "No claim is judged on these numbers, and they choose no default and no scene. "
        "[Real video](../real-video.md) has more trackers."
    )
    return Section("real-video", REAL_VIDEO, [text], [paper_table(paper)])


def chain_section(paper: Paper) -> Section:
    """Return the section on the values that differ between the text and the defaults."""
    tables = [chain_table(paper)] if paper.chain else []
    return Section("parameters", "From the text to the default", chain_sentences(paper), tables)


def command_section(context: Context, notes: Mapping[str, str]) -> Section:
    """Return the section on the command of the report, and on clips that a reader has."""
    paper, options = context.paper, context.options
    effects = "`--all` adds the sensitivity table; `--quick` omits the verdicts."
    clip = (
        "The second command runs the paper's trackers in both settings on a clip of the paper that "
        "you have, as [described here](clips.md)."
    )
    paragraphs = [f"{effects} {notes.get('How long it takes', '')}".rstrip(), clip]
    commands = [options.command(paper.name), clip_command(paper)]
    return Section("command", "How to run it", paragraphs, commands=commands)


def read_notes(paper: str) -> dict[str, str]:
    """Return the sections of a paper's `notes.md` by heading."""
    content = paper_file(paper, "notes.md").read_text("utf-8")
    sections = [section.partition("\n") for section in content.split("\n## ")[1:]]
    return {heading.strip(): body.strip() for heading, _, body in sections}
