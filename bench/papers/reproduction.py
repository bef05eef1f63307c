"""Report of a reproduction: tables, figures and verdicts from stored runs."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from trackmark.bench.pages.page_frames import Progress
from trackmark.bench.papers import ReproductionOptions
from trackmark.bench.papers.evidence import verdict_rows
from trackmark.bench.papers.figures import PaperFigure, draw_figures
from trackmark.bench.papers.main_table import main_table
from trackmark.bench.papers.measures import find_in_module
from trackmark.bench.papers.paper import Paper
from trackmark.bench.papers.runs import Context, PaperRuns
from trackmark.bench.papers.sections import Section, details_sections, page_sections
from trackmark.bench.papers.verdicts import VerdictRow
from trackmark.bench.store.database import RunKey
from trackmark.reports.tables import Table


@dataclass(frozen=True)
class Report:
    """Results of a reproduction."""

    context: Context  # paper, runs and options
    main: list[Table]  # main tables of the paper with our values
    figures: list[PaperFigure]  # figures of the paper, drawn from our runs
    verdicts: list[VerdictRow]  # one per claim; empty for a quick report
    sections: list[Section]  # of the page, in reading order
    details: list[Section]  # of the page with details

    @property
    def paper(self) -> Paper:
        """Content of the paper's files."""
        return self.context.paper

    @property
    def tables(self) -> list[Table]:
        """All tables of the report, in reading order."""
        return [table for section in self.sections + self.details for table in section.tables]

    @property
    def pictures(self) -> list[PaperFigure]:
        """Film strips of the page."""
        return [figure for section in self.sections for figure in section.figures]


def make_report(
    paper: Paper,
    results_root: Path,
    folder: Path,
    options: ReproductionOptions,
    requested: Mapping[str, Collection[RunKey]],
    progress: Progress = lambda *_: None,
) -> Report:
    """Judge the requested runs in `results_root` and write figures into `folder`.

    `requested`: keys of the runs by experiment. `progress`: called with the number of judged
    claims, and of all claims.
    """
    runs = PaperRuns(results_root, requested, paper.frame_rules)
    context = Context(paper, runs, folder, options)
    main, time_table = [main_table(context)], find_in_module("timing.time_table", paper.name)
    if time_table and not options.quick:
        main.append(time_table(context))
    figures = draw_figures(context)
    verdicts = [] if options.quick else verdict_rows(context, progress)
    return Report(
        context,
        main,
        figures,
        verdicts,
        page_sections(context, main[0], figures, verdicts),
        details_sections(context, main[1:], figures, verdicts),
    )


def report_data(report: Report, seconds: float) -> dict[str, Any]:
    """Return the report as a dictionary for JSON."""
    return {
        "title": report.paper.title,
        "paper": report.paper.name,
        "command": report.context.options.command(report.paper.name),
        "quick": report.context.options.quick,
        "seconds": round(seconds, 1),
        "main": [
            {"caption": table.caption, "rows": table.records.to_dict("records")}
            for table in report.main
        ],
        "claims": [row.for_json() for row in report.verdicts],
    }
