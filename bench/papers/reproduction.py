"""Reproduction of a paper: experiments and report."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from trackmark.bench.claims.claims_file import read_claims
from trackmark.bench.claims.row_verdicts import (
    SETTINGS,
    VerdictRow,
    count_verdicts,
    verdict_table,
)
from trackmark.bench.experiments.experiment import Experiment, ExperimentError
from trackmark.bench.pages.page_frames import Watch
from trackmark.bench.papers import FOLDER, Effort, check_paper_name
from trackmark.bench.papers.description import Description, read_description, read_sensitivity
from trackmark.bench.papers.evidence import verdict_rows
from trackmark.bench.papers.figures import Drawing, draw_figures
from trackmark.bench.papers.main_table import (
    criteria_table,
    main_table,
    sensitivity_table,
    setting_table,
)
from trackmark.bench.papers.measures import check_measure, paper_module
from trackmark.bench.papers.plan import experiments, requests, sensitivity_requests
from trackmark.bench.papers.runs import Context, StoredRuns
from trackmark.bench.store.layout import RunKey
from trackmark.reports.tables import Table


@dataclass(frozen=True)
class Report:
    """Results of a reproduction."""

    context: Context  # paper, runs and effort
    main: list[Table]  # main tables of the paper with our values
    figures: list[Drawing]  # figures of the paper, drawn from our runs
    verdicts: list[VerdictRow]  # one per claim; empty for a quick report
    criteria: Table  # of the scenes
    settings: Table  # parameters of the settings with their sources
    sensitivity: Table | None = None  # measures for every open choice, if requested
    notes: Mapping[str, str] = field(default_factory=dict)  # sections of `notes.md` by heading

    @property
    def description(self) -> Description:
        """Description of the paper."""
        return self.context.description

    @property
    def counts(self) -> list[str]:
        """Numbers of verdicts by setting: `as-written: 4 hold`; empty for a quick report."""
        counts = [f"{name}: {count_verdicts(self.verdicts, name)}" for name in SETTINGS]
        return counts if self.verdicts else []

    @property
    def tables(self) -> list[Table]:
        """All tables of the report, in reading order."""
        verdicts = [] if not self.verdicts else [verdict_table(self.verdicts)]
        last = [self.sensitivity] if self.sensitivity else []
        return [*self.main, *verdicts, self.criteria, self.settings, *last]


class Reproduction:
    """Reproduction of a paper with `trackmark reproduce`.

    Raises `ExperimentError` if the paper is unknown or an entry in its files is wrong.
    """

    def __init__(self, name: str) -> None:
        check_paper_name(name)
        self.name = name
        self.description = read_description(name)
        self.claims = read_claims(name)
        for claim in self.claims.values():
            try:
                self.description.check_names(claim.trackers, claim.sequences, claim.name)
                check_measure(claim.measure, name)
            except ValueError as error:
                raise ExperimentError(f"bench/papers/{name}/claims.toml: {error}.") from None

    def experiments(self, effort: Effort) -> list[Experiment]:
        """Return the experiments to run, in order."""
        planned = experiments(self.description, requests(self.description, self.claims, effort))
        if effort.everything:
            needed_runs = sensitivity_requests(self.description, read_sensitivity(self.name))
            planned += experiments(self.description, needed_runs, "sensitivity-")
        return planned

    def report(
        self,
        results: Path,
        folder: Path,
        effort: Effort,
        requested: Mapping[str, Collection[RunKey]],
        watch: Watch = lambda *_: None,
    ) -> Report:
        """Judge the requested runs in `results` and write figures into `folder`.

        `watch`: called with the number of judged claims, and of all claims.
        """
        runs = StoredRuns(results, requested, self.description)
        context = Context(self.description, self.claims, runs, folder, effort)
        timing = None if effort.quick else paper_module(self.name, "timing")
        time_table = getattr(timing, "time_table", None)
        times: list[Table] = [time_table(context)] if time_table else []
        sensitivity = None
        if effort.everything:
            sensitivity = sensitivity_table(context, read_sensitivity(self.name))
        return Report(
            context,
            main=[main_table(context), *times],
            figures=draw_figures(context),
            verdicts=[] if effort.quick else verdict_rows(context, watch),
            criteria=criteria_table(self.name),
            settings=setting_table(self.description),
            sensitivity=sensitivity,
            notes=read_notes(self.name),
        )


def read_notes(paper: str) -> dict[str, str]:
    """Return the sections of a paper's `notes.md` by heading."""
    file = FOLDER / paper / "notes.md"
    text = file.read_text("utf-8") if file.is_file() else ""
    sections = [part.partition("\n") for part in text.split("\n## ")[1:]]
    return {heading.strip(): body.strip() for heading, _, body in sections}


def report_data(report: Report, seconds: float) -> dict[str, Any]:
    """Return the report as a dictionary for JSON."""
    return {
        "title": report.description.title,
        "paper": report.description.name,
        "command": report.context.effort.command(report.description.name),
        "quick": report.context.effort.quick,
        "seconds": round(seconds, 1),
        "main": [
            {"caption": table.caption, "rows": table.data.to_dict("records")}
            for table in report.main
        ],
        "claims": [row.for_json() for row in report.verdicts],
    }
