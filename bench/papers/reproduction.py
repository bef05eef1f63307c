"""Reproduction of a paper: experiments and report."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from trackmark.bench.experiments.experiment import Experiment
from trackmark.bench.pages.page_frames import Progress
from trackmark.bench.papers import ReproductionOptions, check_paper_name
from trackmark.bench.papers.evidence import verdict_rows
from trackmark.bench.papers.figures import PaperFigure, draw_figures
from trackmark.bench.papers.main_table import main_table
from trackmark.bench.papers.measures import paper_module
from trackmark.bench.papers.paper import Paper, read_paper, read_sensitivity
from trackmark.bench.papers.plan import plan_experiments, required_cases, sensitivity_cases
from trackmark.bench.papers.runs import Context, PaperRuns
from trackmark.bench.papers.sections import Section, details_sections, page_sections
from trackmark.bench.papers.verdicts import VerdictRow
from trackmark.bench.store.keys import RunKey
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


class Reproduction:
    """Reproduction of a paper with `trackmark reproduce`.

    Raises `ExperimentError` if the paper is unknown or an entry in its files is wrong.
    """

    def __init__(self, name: str) -> None:
        check_paper_name(name)
        self.paper = read_paper(name)

    def experiments(self, options: ReproductionOptions) -> list[Experiment]:
        """Return the experiments to run, in order."""
        paper = self.paper
        repetitions = 1 if options.quick else paper.repetitions
        repetitions = min(repetitions, options.repetitions or repetitions)
        whole = required_cases(paper, replace(options, quick=False))
        cases = required_cases(paper, options)
        planned = plan_experiments(paper, cases, repetitions, whole=whole)
        if options.with_sensitivity:
            table = read_sensitivity(paper)
            repetitions = min(table.repetitions, paper.repetitions)
            cases = sensitivity_cases(table)
            planned += plan_experiments(paper, cases, repetitions, "sensitivity-")
        return planned

    def report(
        self,
        results_root: Path,
        folder: Path,
        options: ReproductionOptions,
        requested: Mapping[str, Collection[RunKey]],
        progress: Progress = lambda *_: None,
    ) -> Report:
        """Judge the requested runs in `results_root` and write figures into `folder`.

        `progress`: called with the number of judged claims, and of all claims.
        """
        paper, quick = self.paper, options.quick
        runs = PaperRuns(results_root, requested, paper.frame_rules)
        context = Context(paper, runs, folder, options)
        time_table = getattr(paper_module(paper.name, "timing"), "time_table", None)
        main = [main_table(context)]
        if time_table and not quick:
            main.append(time_table(context))
        figures = draw_figures(context)
        verdicts = [] if quick else verdict_rows(context, progress)
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
