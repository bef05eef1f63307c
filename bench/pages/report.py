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

from trackmark.bench.comparing.comparable_runs import ComparisonError, same_boxes
from trackmark.bench.comparing.comparison import Comparison
from trackmark.bench.comparing.run_summary import answer_on, means_by_tracker
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
    repetition_text,
)
from trackmark.bench.pages.page_frames import Watch
from trackmark.bench.pages.player_runs import Layers, name_on_page, read_runs, scenes
from trackmark.bench.protocols import STORED_ONE_PASS, TIMING
from trackmark.bench.reporting.answer import Answer
from trackmark.bench.reporting.by_preset import table_prefix
from trackmark.bench.reporting.failed_runs import failed_runs, with_worst_scores
from trackmark.bench.reporting.tables import not_repeatable, summary_of
from trackmark.bench.store.data_frames import load_runs
from trackmark.bench.store.truth import find_attributes
from trackmark.datasets.spec_string import format_text
from trackmark.reports.page.cards import GLOSSARY, Fold
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
    page = content.page(title, list(scenes(content.runs, watch, keep)))
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
        self.experiment, self.commands = experiment, commands
        self.tables = {table.name: table for table in tables}
        self.all_runs = with_worst_scores(experiment, load_runs(experiment))
        self.scored = complete(self.all_runs[self.all_runs["protocol"] == STORED_ONE_PASS])
        self.timed = self.all_runs[self.all_runs["protocol"] == TIMING]
        names = [str(name) for name in self.scored["tracker"].unique()]
        if len(names) > CROWDED and "mean_overlap" in self.scored:  # the best ones have colours
            means = self.scored.groupby("tracker", observed=True)["mean_overlap"].mean().fillna(0)
            names.sort(key=lambda name: -means[name])
        self.runs = read_runs(experiment, names, layers)
        is_finished = self.scored["status"] == "finished"
        incomplete = set(self.scored["tracker"][~is_finished].astype(str))
        self.whole = [name for name in names if name not in incomplete]
        self.occurring = find_attributes(experiment, self.scored[is_finished])
        self.failed, self.left_out = failed_runs(self.scored)
        self.summary: Table | None = None
        if len(self.scored):
            summary = self.tables.get("summary")
            self.summary = summary or summary_of(self.scored, self.timed, "")
        self.comparison, self.answer = self._compare()

    def _compare(self) -> tuple[Comparison | None, Answer]:
        """Return the comparison of the trackers, if there is one, and the answer."""
        if self.summary is None:
            return None, Answer("", ("There is no comparison: there are no one-pass runs.",))
        try:
            (heading, details), comparison = answer_on(
                self.all_runs,
                means_by_tracker(self.summary),
                attributes=self.occurring,
                same_boxes=same_boxes(self.experiment, self.all_runs),
                not_repeatable=not_repeatable(self.all_runs),
            )
        except ComparisonError as error:
            return None, Answer("", (f"There is no comparison: {error}",))
        for name, note in [*self.failed.items()][:1]:
            n_failed = (self.scored["status"] == "failed").sum()
            text = f"{n_failed} of {len(self.scored)} runs failed"
            text += " and count as the worst score" * (len(self.failed) > len(self.left_out))
            details = (*details, f"{text}; first: {name}, {note.partition('): ')[2] or note}.")
        return comparison, Answer(heading, details)

    @cached_property
    def protocols(self) -> list[str]:
        """Stored names of the protocols other than one-pass, longest first."""
        stored = {*map(str, self.all_runs["protocol"])} - {STORED_ONE_PASS, TIMING}
        return sorted(stored, key=len, reverse=True)

    def page(self, title: str, filmed: Sequence[PlayerScene]) -> Page:
        """Return the page; `filmed`: the sequences with their frames."""
        heading, details = self.answer
        page = Page(title, [], self.runs.labels, filmed)
        page = replace(page, meta=self._counts(), answer=heading, details=details)
        parts = self._sections(page)
        sections = [
            part for part in parts if part.charts or part.sheets or part.words or part.blocks
        ]
        return replace(page, sections=sections)

    def _sections(self, page: Page) -> Iterator[PageSection]:
        """Yield the sections in the order of the page; hidden ones are only exported."""
        runs, filmed = self.runs, page.scenes
        sheets = {name: self._sheet(table) for name, table in self.tables.items()}
        half = 6 if len(runs.trackers) <= CROWDED else 12
        words, failed = self._words(), self._failures()
        yield PageSection("runs", "What was run", words, failed, hidden=True)
        if self.summary is not None and runs.stages:
            board = leaderboard(self.summary, runs, self.failed)
            exported = [sheets["summary"]] if "summary" in sheets else []
            yield PageSection("summary", "Leaderboard", sheets=exported, blocks=[board], span=7)
        if shares := share_charts(runs, self.whole):
            title = "Success and precision"
            yield PageSection("curves", title, charts=shares, blocks=[shares], span=5)
        if hardest := hardest_moments(runs, filmed):
            yield PageSection("hard", "Hardest moments", blocks=[hardest], span=7)
        if self.summary is not None and len(self.means):
            options: dict[str, Any] = {"sheets": [self._heat_map()], "span": half}
            options |= {"nav": "Sequences", "hidden": not self.means.notna().any(axis=None)}
            options["blocks"] = [heat_table(self.means, self.summary, runs, filmed)]
            yield PageSection("heat", "Sequences by trackers", **options)
        differences: list[PageTable] = []
        if self.comparison is not None:
            limit = next((text for text in self.answer.details if "too few" in text), "")
            which, differences = comparison_section(self.comparison, runs, limit)
            yield replace(which, span=half)
        if self.summary is not None and (speed := speed_charts(self.summary, runs)):
            options = {"charts": speed, "blocks": speed, "span": 6, "nav": "Speed"}
            yield PageSection("speed", "Speed and accuracy", **options)
        if cards := failures(runs, filmed):
            title, block = cards
            caption = (
                "Lost: the centre is outside the true box for ten visible frames in a row. At most "
                "six runs are shown, first the worst of each tracker."
            )
            options = {"caption": caption, "span": 6, "nav": "Failures"}
            yield PageSection("failures", title, blocks=[block], **options)
        yield parts_section(self.scored, self.occurring, runs, differences)
        if survival := survival_charts(self.scored, runs):
            per_tracker = self.scored.groupby("tracker", observed=True).size()
            few = bool(per_tracker.min() < _MIN_RUNS_OF_SURVIVAL)
            options = {"charts": survival, "blocks": survival, "hidden": few}
            yield PageSection("survival", "Time to failure", **options)
        charts = timeline_charts(runs)
        stages = sequence_folds(runs, filmed, charts, self.means, sheets.get("sequences"), page)
        options = {"blocks": [*stages], "charts": [*charts.values()]}
        options["caption"] = "Open a sequence for its overlap by frame and all scores."
        yield PageSection("timelines", "Sequence by sequence", **options)
        exported = [sheet for name, sheet in sheets.items() if name != "summary"]
        folds = [_fold(sheet) for name, sheet in sheets.items() if name != "sequences"]
        blocks = [fold for fold in folds if fold]
        yield PageSection("tables", "All scores", sheets=exported, blocks=blocks, hidden=not blocks)
        yield self._provenance(words, failed)

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
            others = ", ".join(sorted(self.protocols))
            words.append(
                f"The player also shows runs with other protocols ({others}): the protocol "
                "is after the tracker's name. Frames that are not scored have no curve; a triangle "
                "marks a restart. Charts show one-pass runs."
            )
        if self.timed.empty and len(self.scored):
            words.append("Not measured: times without other load (`trackmark run --timing`).")
        notes = [note for table in self.tables.values() for note in table.notes]
        return [*words, *dict.fromkeys(notes)]

    def _counts(self) -> str:
        """Return the numbers of trackers, sequences and runs, and the dates of the runs."""
        runs = complete(self.all_runs)
        status = runs["status"].astype(str)
        counts = {
            "tracker": runs["tracker"].nunique(),
            "sequence": runs["sequence"].nunique(),
            "run": int(((status != "missing") & (runs["protocol"] != TIMING)).sum()),
        }
        parts = [f"{n} {word}{'s' * (n != 1)}" for word, n in counts.items()]
        if n_timed := int(((status != "missing") & (runs["protocol"] == TIMING)).sum()):
            parts[-1] += f" and {n_timed} timing run{'s' * (n_timed != 1)}"
        if n_failed := int((status == "failed").sum()):
            parts[-1] += f", {n_failed} failed"
        days = sorted({entry["date"] for entry in self.runs.circumstances if entry["date"]})
        parts += [" to ".join(map(_day, dict.fromkeys(days[:1] + days[-1:])))] if days else []
        return " · ".join(parts)

    def _failures(self) -> list[PageTable]:
        """Return a table of failed runs, if any; each row opens the last frame with a box."""
        rows, places = [], []
        for number, stage in enumerate(self.runs.stages):
            for clip in (*stage.clips, *stage.others):
                take = clip.take
                if take.failure and not take.start:  # a run with segments counts once
                    place = PlayerPosition(number, take.tracker, take.repetition, clip.end)
                    run = self.runs.labels[take.tracker], stage.name, take.repetition, clip.end
                    rows.append([*map(str, run), take.failure.partition("\n")[0]])
                    places.append([None, None, place, None])
        if not rows:
            return []
        left = len(rows) - _MAX_FAILURES
        table = text_table(
            "failed",
            f"{len(rows)} run{'s' * (len(rows) > 1)} failed; the last frame with a box opens.",
            ["tracker", "sequence", "repetition", "last box", "what went wrong"],
            rows[:_MAX_FAILURES],
            notes=[f"{left} more are listed by `trackmark results failures`."] * (left > 0),
        )
        return [PageTable(table, places=places[:_MAX_FAILURES])]

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
            sequence = row["sequence"] if row.get("sequence") in names else None
            tracker = name_on_page(row["tracker"], [*protocols, STORED_ONE_PASS][0])
            places.append([self.runs.place(tracker, sequence, kind, trace) for kind in kinds])
        return PageTable(table, values.tolist(), places)

    @cached_property
    def means(self) -> pd.DataFrame:
        """Mean overlaps with a row per sequence and a column per tracker."""
        if "sequences" not in self.tables:
            return pd.DataFrame()
        data = self.tables["sequences"].data
        data = data[data["measure"] == "mean_overlap"].astype({"sequence": str, "tracker": str})
        means = data.pivot_table("mean", "sequence", "tracker", sort=False, dropna=False)
        return means.reindex(index=data["sequence"].unique(), columns=data["tracker"].unique())

    def _heat_map(self) -> PageTable:
        """Return the mean overlaps as a table for export."""
        caption = (
            f"Mean overlap with the true box by sequence and tracker: n = {len(self.means)} "
            f"sequences, means over {repetition_text(self.scored)} each."
        )
        texts = self.means.map(lambda mean: f"{mean:.3f}" if np.isfinite(mean) else MISSING)
        rows = texts.reset_index().to_numpy().tolist()
        grid = text_table("heat", caption, ["sequence", *self.means], rows)
        grid = replace(grid, data=self.means.reset_index())
        return PageTable(grid, self.means.to_numpy(float).tolist(), heat=True)

    def _provenance(self, words: Sequence[str], failed: Sequence[PageTable]) -> PageSection:
        """Return the section on versions, sources and hosts of the runs, and on terms."""
        runs = self.all_runs.rename(columns={"version": "run", "tracker_version": "version"})
        runs = runs.assign(
            version=runs["version"].str[:16], fingerprint=runs["fingerprint"].str[:16]
        )
        trackers = runs.dropna(subset="version").drop_duplicates(["tracker", "version"])
        parameters = trackers["parameters"].astype(str).map(_format_parameters)
        sequences = runs.dropna(subset="fingerprint").drop_duplicates(["sequence", "fingerprint"])
        hosts = pd.DataFrame([*self.runs.circumstances]).rename(columns={"python": "Python"})
        if len(hosts):
            libraries = [
                ", ".join(" ".join(entry) for entry in h.items()) for h in hosts["libraries"]
            ]
            hosts["libraries"] = libraries
        sheets = [
            _listed(
                "trackers",
                "Trackers: parameters, and the digest of source and libraries.",
                trackers.assign(parameters=parameters)[["tracker", "parameters", "version"]],
            ),
            _listed(
                "sequences-read",
                "Sequences: where they were read, and their fingerprint.",
                sequences[["sequence", "source", "fingerprint", "frames"]].astype({"frames": int}),
            ),
            _listed(
                "circumstances",
                "Where and when runs were made.",
                hosts.reindex(columns=["host", "date", "platform", "Python", "libraries"]),
            ),
        ]
        commands = [
            self.commands.text("report", "--folder", "report"),
            self.commands.text("compare"),
        ]
        if failed and self.commands.results:
            commands.append(f"trackmark results failures {shlex.quote(self.commands.results)}")
        result = "commands, versions, parameters, fingerprints"
        terms = [f"{name}: {text}" for name, text in GLOSSARY.items()]
        folds = [
            Fold("provenance", "Provenance", result, words, [*failed, *sheets], commands),
            Fold("glossary", "Glossary", "terms of this page", terms),
        ]
        title = "About this report"
        return PageSection("provenance", title, sheets=sheets, blocks=folds, nav="Provenance")


def _fold(sheet: PageTable) -> Fold | None:
    """Return a folded table of scores; None if it has no values."""
    rows, n_labels = sheet.table.rows, sheet.table.n_labels
    if all(cell.text == MISSING for row in rows for cell in row[n_labels:]):
        return None
    name, caption = sheet.table.name, sheet.table.caption.partition(". ")[0]
    title = name.replace("-", " ").capitalize()
    return Fold(f"fold-{name}", title, caption, sheets=[sheet])


def _listed(name: str, caption: str, data: pd.DataFrame) -> PageTable:
    """Return a table of texts with the columns of a data frame."""
    rows = data.astype(str).to_numpy().tolist()
    return PageTable(text_table(name, caption, [*map(str, data)], rows))


def _day(iso: str) -> str:
    """Return a date in words: `24 November 2026`."""
    day = date.fromisoformat(iso)
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
