"""Page of an experiment: its answer, cards of scores and frames, and tables for export."""

import json
import shlex
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import date
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from trackmark.bench.comparing.comparable_runs import AllFailedError, ComparisonError
from trackmark.bench.comparing.comparison import Comparison
from trackmark.bench.comparing.tables import answer_of
from trackmark.bench.evaluation.run_record import Trace
from trackmark.bench.pages.cards import (
    failures,
    hardest_moments,
    heat_table,
    leaderboard,
    sequence_folds,
)
from trackmark.bench.pages.charts import (
    share_charts,
    speed_charts,
    survival_charts,
    timeline_charts,
)
from trackmark.bench.pages.comparison_section import (
    comparison_section,
    parts_section,
    read_comparison,
    repetition_text,
)
from trackmark.bench.pages.page_frames import Watch
from trackmark.bench.pages.player_runs import Layers, name_on_page, read_runs, scenes
from trackmark.bench.protocols import STORED_ONE_PASS, TIMING
from trackmark.bench.reporting.answer import Answer, Measured, RankedTracker, answer
from trackmark.bench.reporting.by_preset import table_prefix
from trackmark.bench.reporting.failed_runs import failed_runs, with_worst_scores
from trackmark.bench.reporting.tables import summary_of
from trackmark.bench.statistics.units import units_of
from trackmark.bench.store.data_frames import load_runs
from trackmark.bench.store.truth import find_attributes
from trackmark.datasets.spec_string import format_text
from trackmark.reports.page.cards import GLOSSARY, CurvePlot, Fold
from trackmark.reports.page.content import (
    Page,
    PageSection,
    PageTable,
    PlayerPosition,
    PlayerScene,
)
from trackmark.reports.page.page import write_chunk, write_page
from trackmark.reports.page.svg import CROWDED
from trackmark.reports.tables import MISSING, Table, complete, text_table

if TYPE_CHECKING:
    from trackmark.bench.pages.report_figures import FigureFiles

_MAX_FAILURES = 200
"""Maximum number of rows of failed runs."""

_MIN_RUNS_OF_SURVIVAL = 20
"""Minimum number of runs per tracker for the survival plot on the page."""


@dataclass(frozen=True)
class Commands:
    """Commands that a page shows: arguments of `report` and `compare` for its results."""

    results: str = ""  # folder of the results; empty if it is temporary
    others: Sequence[str] = ()

    def text(self, name: str, *options: str) -> str:
        """Return the text of a command on the results."""
        option = ["--results"] if name == "compare" else []
        results = [*option, self.results] if self.results else []
        return shlex.join(["trackmark", name, *results, *self.others, *options])


def write_report_page(
    experiment: Path,
    path: Path,
    tables: Sequence[Table],
    title: str,
    commands: Commands,
    watch: Watch,
    *,
    full: bool = False,
    figures: "FigureFiles | None" = None,
) -> list[Path]:
    """Write the page of an experiment's results, and return its files.

    `tables`: tables of the report. `watch`: called with the number of frames that were read and of
    all frames. `full`: also write frames in full size. `figures`: also write figures, film strips,
    further tables, and the page in Markdown and LaTeX. Raises `ResultsError` if results cannot be
    read and `OSError` if a file cannot be written.
    """
    content = _Content(experiment, tables, commands, "drawn")
    keep = partial(write_chunk, path) if full else None
    page = content.page(title, list(scenes(content.runs, commands.results, watch, keep)))
    paths = write_page(path, page)
    if figures:
        from trackmark.bench.pages.paper_export import write_paper  # imports Matplotlib
        from trackmark.bench.pages.report_figures import write_figures

        paths += write_figures(experiment, path.parent, figures, page, content.runs)
        paths += write_paper(path.parent, page, figures.suffix, {table.name for table in tables})
    return paths


def further_tables(experiment: Path, tables: Sequence[Table], commands: Commands) -> list[Table]:
    """Return the tables that only the page has, not the report with these `tables`."""
    names = {table.name for table in tables}
    content = _Content(experiment, tables, commands, "none")
    stages = content.runs.stages
    page = content.page("", [PlayerScene(stage.name, (1, 1), stage.truth, []) for stage in stages])
    every = [sheet.table for section in page.sections for sheet in section.sheets]
    return [table for table in every if table.name not in names]


class _Content:
    """Runs, tables and commands from which the sections of a page are built."""

    def __init__(
        self, experiment: Path, tables: Sequence[Table], commands: Commands, layers: Layers
    ) -> None:
        self.tables, self.commands = tables, commands
        self.all_runs = with_worst_scores(experiment, load_runs(experiment))
        self.scored = complete(self.all_runs[self.all_runs["protocol"] == STORED_ONE_PASS])
        self.timed = self.all_runs[self.all_runs["protocol"] == TIMING]
        names = [str(name) for name in self.scored["tracker"].unique()]
        if len(names) > CROWDED and "mean_overlap" in self.scored:  # the best ones have colours
            means = self.scored.groupby("tracker", observed=True)["mean_overlap"].mean().fillna(0)
            names.sort(key=lambda name: -means[name])
        self.runs = read_runs(experiment, names, layers)
        unfinished = self.scored[self.scored["status"] != "finished"]
        incomplete = set(unfinished["tracker"].astype(str))
        self.whole = [name for name in names if name not in incomplete]
        finished = self.scored[self.scored["status"] == "finished"]
        self.occurring = find_attributes(experiment, finished)
        self.failed = failed_runs(self.scored).notes
        self.comparison, self.answer = self._compare(experiment)

    def _compare(self, experiment: Path) -> tuple[Comparison | None, Answer]:
        """Return the comparison of the trackers, if there is one, and the answer."""
        if self.scored.empty:
            return None, Answer("", ("There is no comparison: no run is by one pass.",))
        notes = [f"{self._failed_runs()}."] if self.failed else []
        try:
            if len(self.runs.trackers) == 1:
                return None, self._single_answer(notes)
            comparison = read_comparison(experiment, self.all_runs, self.occurring)
        except AllFailedError:
            return None, answer([], Measured(0))._replace(details=tuple(notes))
        except ComparisonError as error:
            return None, Answer("", (f"There is no comparison: {error}",))
        heading, details = answer_of(comparison)
        return comparison, Answer(heading, (*details, *notes))

    def _single_answer(self, notes: Sequence[str]) -> Answer:
        """Return the answer for one tracker."""
        if (self.scored["status"] == "failed").all():
            return answer([], Measured(0))._replace(details=tuple(notes))
        data = summary_of(self.scored, self.timed, "").data
        row = next(row for row in data.to_dict("records") if row["measure"] == "mean_overlap")
        units = units_of([str(name) for name in self.scored["sequence"].unique()])
        interval = (row["low"], row["high"]) if np.isfinite(row["low"]) else None
        tracker = RankedTracker(str(row["tracker"]), row["mean"], interval)
        heading, details = answer([tracker], Measured(len(units), units.kind, units.plural))
        return Answer(heading, (*details, *notes))

    def _failed_runs(self) -> str:
        """Return how many one-pass runs failed, and the first reason."""
        failed = self.scored["status"] == "failed"
        name, note = next(iter(self.failed.items()))
        reason = note.partition("): ")[2] or note
        return (
            f"{failed.sum()} of {len(failed)} runs failed and count as the worst score; first: "
            f"{name}, {reason}"
        )

    @cached_property
    def protocols(self) -> list[str]:
        """Stored names of the protocols other than one-pass, longest first."""
        stored = {*map(str, self.all_runs["protocol"])} - {STORED_ONE_PASS, TIMING}
        return sorted(stored, key=len, reverse=True)

    def page(self, title: str, filmed: Sequence[PlayerScene]) -> Page:
        """Return the page; `filmed`: the sequences with their frames."""
        page = Page(title, [], self.runs.labels, filmed)
        command = self.commands.text("report", "--folder", "report")
        sections = [
            replace(part, command=part.command or (command if part.charts or part.sheets else ""))
            for part in self._sections(page)
            if part.charts or part.sheets or part.words or part.blocks
        ]
        heading, details = self.answer
        return replace(
            page, sections=_filled(sections), meta=self._counts(), answer=heading, details=details
        )

    def _sections(self, page: Page) -> Iterator[PageSection]:
        """Yield the sections in the order of the page; hidden ones are only exported."""
        runs, filmed = self.runs, page.scenes
        named = {table.name: table for table in self.tables}
        sheets = {name: self._sheet(table) for name, table in named.items()}
        half = 6 if len(runs.trackers) <= CROWDED else 12
        wide, limits = self.commands.text("report", "--wide"), self.answer.details
        words, failed = self._words(), self._failures()
        exported = [failed] if failed else []
        yield PageSection("runs", "What was run", words, exported, hidden=True)
        summary = named.get("summary")
        if summary is None and len(self.scored):
            summary = summary_of(self.scored, self.timed, "")
        if summary is not None and runs.stages:
            board = leaderboard(summary, runs, self.failed)
            exported = [sheets["summary"]] if "summary" in named else []
            options: dict[str, Any] = {"sheets": exported, "command": wide, "span": 7}
            yield PageSection("summary", "Leaderboard", blocks=[board], **options)
        if hardest := hardest_moments(runs, filmed):
            yield PageSection("hard", "Hardest moments", blocks=[hardest], span=7)
        if shares := share_charts(runs, self.whole):
            plot = CurvePlot(dict(zip(("Overlap", "Centre error"), shares, strict=True)))
            title = "Success and precision"
            yield PageSection("curves", title, charts=shares, blocks=[plot], span=5)
        means: dict[str, dict[str, float]] = {}
        if "sequences" in named:
            grid = self._heat_map(named["sequences"])
            rows = grid.table.data.set_index("sequence").to_dict("index")
            means = {str(name): {str(key): row[key] for key in row} for name, row in rows.items()}
            options = {"blocks": [heat_table(grid, runs, filmed)], "nav": "Sequences"}
            yield PageSection("heat", "Sequences by trackers", sheets=[grid], span=half, **options)
        differences: list[PageTable] = []
        if self.comparison is not None:
            limit = next((text for text in limits if "too few" in text), "")
            command = self.commands.text("compare")
            which, differences = comparison_section(self.comparison, runs, command, limit)
            yield replace(which, span=half)
        if summary is not None and (speed := speed_charts(summary, runs)):
            options = {"blocks": speed, "span": 6, "nav": "Speed"}
            yield PageSection("speed", "Speed and accuracy", charts=speed, **options)
        if cards := failures(runs, filmed):
            title, block = cards
            caption = (
                "Lost: the centre is outside the true box for ten visible frames in a row. At most "
                "six runs are shown."
            )
            options = {"caption": caption, "span": 6, "nav": "Failures"}
            yield PageSection("failures", title, blocks=[block], **options)
        yield parts_section(self.scored, self.occurring, runs, differences)
        survival = survival_charts(self.scored, runs)
        per_tracker = self.scored.groupby("tracker", observed=True).size()
        enough = survival and per_tracker.min() >= _MIN_RUNS_OF_SURVIVAL
        blocks = survival if enough else []
        yield PageSection(
            "survival", "Time to failure", charts=survival, blocks=blocks, hidden=not enough
        )
        charts = timeline_charts(runs)
        stages = sequence_folds(runs, filmed, charts, means, sheets.get("sequences"), page)
        options = {"blocks": [*stages], "charts": [*charts.values()]}
        options["caption"] = "Open a sequence for its overlap by frame and all scores."
        yield PageSection("timelines", "Sequence by sequence", **options)
        exported = [sheet for name, sheet in sheets.items() if name != "summary"]
        folds = [_fold(sheets[name]) for name in named if name != "sequences"]
        tables = [fold for fold in folds if fold]
        options = {"blocks": tables, "command": wide, "hidden": not tables}
        yield PageSection("tables", "All scores", sheets=exported, **options)
        yield self._provenance(words, [failed] if failed else [])

    def _words(self) -> list[str]:
        """Return sentences on all runs, unfinished runs and protocols."""
        counts = Counter(complete(self.all_runs)["status"].astype(str))
        wrong = [f"{n} {status}" for status, n in counts.items() if status != "finished"]
        hosts = sorted({str(entry["host"]) for entry in self.runs.circumstances})
        words = [f"{self._counts()}. Host: {', '.join(hosts)}." if hosts else self._counts()]
        words += [
            f"Runs not finished: {', '.join(wrong)}. Failed runs count as the worst score. Means "
            "that need missing runs are missing."
            if wrong
            else "All runs finished."
        ]
        if self.protocols:
            words.append(
                f"The player shows runs by {', '.join(sorted(self.protocols))} with the protocol "
                "after the tracker's name. Frames that are not judged have no curve; a triangle "
                "marks a restart. Charts show one-pass runs."
            )
        if not self.timed.empty or self.scored.empty:
            return [*words, *dict.fromkeys(note for table in self.tables for note in table.notes)]
        words.append("Not measured: times without other load (`trackmark run --timing`).")
        return [*words, *dict.fromkeys(note for table in self.tables for note in table.notes)]

    def _counts(self) -> str:
        """Return the numbers of trackers, sequences and runs, and the dates of the runs."""
        runs = complete(self.all_runs)
        n_runs = int((runs["status"].astype(str) != "missing").sum())
        n_failed = int((runs["status"].astype(str) == "failed").sum())
        parts = [
            f"{n} {word}{'s' * (n != 1)}"
            for n, word in (
                (runs["tracker"].nunique(), "tracker"),
                (runs["sequence"].nunique(), "sequence"),
                (n_runs, "run"),
            )
        ]
        if n_failed:
            parts[-1] += f", {n_failed} failed"
        days = sorted({entry["date"] for entry in self.runs.circumstances if entry["date"]})
        parts += (
            [" to ".join(_day(day) for day in dict.fromkeys((days[0], days[-1])))] if days else []
        )
        return " · ".join(parts)

    def _failures(self) -> PageTable | None:
        """Return a table of failed runs; each row opens the last frame with a box."""
        failed = [
            (
                PlayerPosition(position, clip.take.tracker, clip.take.repetition, clip.end),
                stage.name,
                clip,
            )
            for position, stage in enumerate(self.runs.stages)
            for clip in (*stage.clips, *stage.others)
            if clip.take.failure and not clip.take.start  # a run with segments counts once
        ]
        if not failed:
            return None
        rows = []
        for place, name, clip in failed[:_MAX_FAILURES]:
            reason = clip.take.failure.partition("\n")[0]
            tracker = self.runs.labels[place.tracker]
            rows.append([tracker, name, str(place.repetition), str(place.frame), reason])
        left = len(failed) - len(rows)
        table = text_table(
            "failed",
            f"{len(failed)} run{'s' * (len(failed) > 1)} failed; the last frame with a box opens.",
            ["tracker", "sequence", "repetition", "last box", "what went wrong"],
            rows,
            notes=[f"{left} more are listed by `trackmark results failures`."] if left else [],
        )
        places = [[None, None, place, None] for place, _, _ in failed[:_MAX_FAILURES]]
        return PageTable(table, places=places)

    def _sheet(self, table: Table) -> PageTable:
        """Return a table of scores that opens worst frames and is sorted by unrounded values."""
        data, columns = table.data, len(table.heads) - table.n_labels
        if "measure" not in data or len(data) != len(table.rows) * columns:
            return PageTable(table)
        values = data["mean"].to_numpy(float).reshape(len(table.rows), columns)
        kinds = [_worst_frame_kind(str(name)) for name in data["measure"][:columns]]
        names = {stage.name for stage in self.runs.stages}
        protocols = [
            protocol for protocol in self.protocols if table.name.startswith(table_prefix(protocol))
        ]
        trace: Trace = "revised" if table.name.endswith("-revised") else "online"
        places = []
        for row in data[::columns].to_dict("records"):
            sequence = row.get("sequence")
            sequence = sequence if sequence in names else None
            tracker = name_on_page(row["tracker"], [*protocols, STORED_ONE_PASS][0])
            places.append([self.runs.place(tracker, sequence, kind, trace) for kind in kinds])
        return PageTable(table, values.tolist(), places)

    def _heat_map(self, table: Table) -> PageTable:
        """Return the heat map of mean overlaps by sequence and tracker."""
        data = table.data[table.data["measure"] == "mean_overlap"]
        means = data.pivot_table("mean", "sequence", "tracker", sort=False, dropna=False)
        means = means.reindex(index=data["sequence"].unique(), columns=pd.unique(data["tracker"]))
        values = means.to_numpy(float)
        rows = [
            [str(name), *(f"{mean:.3f}" if np.isfinite(mean) else MISSING for mean in row)]
            for name, row in zip(means.index, values, strict=True)
        ]
        places = [
            [self.runs.place(str(name), str(sequence), "overlap") for name in means.columns]
            for sequence in means.index
        ]
        grid = text_table(
            "heat",
            f"Mean overlap with the true box by sequence and tracker: n = {len(means)} sequences, "
            f"means over {repetition_text(self.scored)} each.",
            ["sequence", *map(str, means.columns)],
            rows,
        )
        grid = replace(grid, data=means.reset_index())
        return PageTable(grid, values.tolist(), places, heat=True)

    def _provenance(self, words: Sequence[str], failed: Sequence[PageTable]) -> PageSection:
        """Return the section on versions, sources and hosts of the runs, and on terms."""
        runs = self.all_runs
        trackers = runs.dropna(subset="tracker_version").drop_duplicates(["tracker", "version"])
        sequences = runs.dropna(subset="fingerprint").drop_duplicates(["sequence", "fingerprint"])
        tables = [
            text_table(
                "trackers",
                "Trackers: parameters, and the digest of source and libraries.",
                ["tracker", "parameters", "version"],
                [
                    [
                        str(row.tracker),
                        _format_parameters(str(row.parameters)),
                        str(row.tracker_version)[:16],
                    ]
                    for row in trackers.drop_duplicates(["tracker", "tracker_version"]).itertuples()
                ],
            ),
            text_table(
                "sequences-read",
                "Sequences: where they were read, and their fingerprint.",
                ["sequence", "source", "fingerprint", "frames"],
                [
                    [*map(str, (row.sequence, row.source)), str(row.fingerprint)[:16]]
                    + [f"{row.frames:.0f}"]
                    for row in sequences.itertuples()
                ],
            ),
            text_table(
                "circumstances",
                "Where and when runs were made.",
                ["host", "date", "platform", "Python", "libraries"],
                [
                    [*(str(entry[key]) for key in ("host", "date", "platform", "python"))]
                    + [", ".join(f"{name} {v}" for name, v in entry["libraries"].items())]
                    for entry in self.runs.circumstances
                ],
            ),
        ]
        sheets = [PageTable(table) for table in tables]
        commands = [
            self.commands.text("report", "--folder", "report"),
            self.commands.text("compare"),
        ]
        if failed and self.commands.results:
            commands.append(f"trackmark results failures {shlex.quote(self.commands.results)}")
        folds = [
            Fold(
                "provenance",
                "Provenance",
                "commands, versions, parameters, fingerprints",
                words,
                [*failed, *sheets],
                commands,
            ),
            Fold("glossary", "Glossary", "terms of this page", terms=GLOSSARY),
        ]
        title = "About this report"
        return PageSection("provenance", title, sheets=sheets, blocks=folds, nav="Provenance")


def _filled(sections: Sequence[PageSection]) -> list[PageSection]:
    """Return the sections; those without a neighbour take the whole width."""
    result, alone = [], dict[str, bool]()
    visible = [section for section in sections if not section.hidden]
    for number, section in enumerate(visible):
        halves = number - next((n for n in range(number, -1, -1) if visible[n].span != 6), -1) - 1
        follows = number + 1 < len(visible) and visible[number + 1].span == 6
        alone[section.key] = section.span == 6 and halves % 2 == 0 and not follows
    has_plot = any(section.span == 5 for section in visible)
    for section in sections:
        is_wide = alone.get(section.key, False) or (section.span == 7 and not has_plot)
        result.append(replace(section, span=12) if is_wide else section)
    return result


def _fold(sheet: PageTable) -> Fold | None:
    """Return a folded table of scores; None if it has no values."""
    rows, n_labels = sheet.table.rows, sheet.table.n_labels
    if all(cell.text == MISSING for row in rows for cell in row[n_labels:]):
        return None
    name, caption = sheet.table.name, sheet.table.caption.partition(". ")[0]
    title = name.replace("-", " ").capitalize()
    return Fold(f"fold-{name}", title, caption, sheets=[sheet])


def _day(iso: str) -> str:
    """Return a date in words: `24 November 2026`."""
    try:
        day = date.fromisoformat(iso)
    except ValueError:
        return iso
    return f"{day.day} {day:%B %Y}"


def _worst_frame_kind(measure: str) -> str:
    """Return the criterion of the worst frame for a measure; see `PageRuns.place`."""
    if measure == "first_loss":
        return "loss"
    return "centre_error" if measure.startswith(("centre_error", "precision")) else "overlap"


def _format_parameters(parameters: str) -> str:
    """Convert parameters from JSON to the text of a specification."""
    items: dict[str, Any] = json.loads(parameters)
    return ", ".join(format_text("", {key: items[key]})[1:] for key in items) or MISSING
