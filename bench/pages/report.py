"""Page of an experiment: its answer, and cards of scores and frames."""

import json
import shlex
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from trackmark.bench.analysis.by_metrics import table_prefix
from trackmark.bench.analysis.comparable_runs import ComparisonError, same_boxes
from trackmark.bench.analysis.comparison import Comparison
from trackmark.bench.analysis.corner_boxes import corner_boxes
from trackmark.bench.analysis.decisions import Answer
from trackmark.bench.analysis.failed_runs import failed_runs, with_worst_scores
from trackmark.bench.analysis.run_summary import answer_on, means_by_tracker
from trackmark.bench.analysis.run_tables import not_repeatable, summary_of
from trackmark.bench.analysis.stored_runs import judged_runs
from trackmark.bench.analysis.times import time_mark, time_notes, with_times
from trackmark.bench.evaluation.run_record import Trace
from trackmark.bench.pages.card_types import GLOSSARY, Fold
from trackmark.bench.pages.cards import (
    failures,
    hardest_moments,
    heat_table,
    leaderboard,
    pair_matrix,
    sequence_folds,
)
from trackmark.bench.pages.charts import (
    share_charts,
    speed_charts,
    survival_charts,
    timeline_charts,
)
from trackmark.bench.pages.content import Page, PageSection, PageTable, PlayerScene
from trackmark.bench.pages.page import write_chunk, write_page
from trackmark.bench.pages.page_frames import Watch
from trackmark.bench.pages.parts_table import parts_table
from trackmark.bench.pages.player_runs import collect_runs, name_on_page, scenes
from trackmark.bench.protocols import STORED_ONE_PASS, TIMING
from trackmark.bench.store.data_frames import load_runs
from trackmark.bench.store.truth import find_attributes
from trackmark.datasets.spec_string import format_text
from trackmark.reports.charts import PlayerPosition
from trackmark.reports.svg import CROWDED
from trackmark.reports.tables import MISSING, Table, complete, text_table

if TYPE_CHECKING:
    from trackmark.bench.pages.report_figures import FigureFiles

_MAX_FAILURES = 200
"""Maximum number of rows of failed runs."""

_MAX_PAIRED = 30
"""Maximum number of trackers in the table of all pairs."""

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
    all frames. `full`: also write frames in full size. `figures`: also write figures and film
    strips. Raises `ResultsError` if results cannot be read and `OSError` if a file cannot be
    written.
    """
    content = _Content(experiment, tables, commands)
    keep = partial(write_chunk, path) if full else None
    page = content.page(title, list(scenes(content.runs, watch, keep)))
    paths = write_page(path, page)
    if figures:
        from trackmark.bench.pages.report_figures import write_figures  # imports Matplotlib

        charts = [*content.curves, *content.speed, *content.survival]
        paths += write_figures(experiment, path.parent, figures, title, charts, content.runs)
    return paths


class _Content:
    """Runs, tables and commands from which the sections of a page are built."""

    def __init__(self, experiment: Path, tables: Sequence[Table], commands: Commands) -> None:
        self.experiment, self.commands = experiment, commands
        self.tables = {table.name: table for table in tables}
        self.all_runs = with_worst_scores(experiment, load_runs(experiment))
        self.scored = complete(self.all_runs[self.all_runs["protocol"] == STORED_ONE_PASS])
        self.timed = self.all_runs[self.all_runs["protocol"] == TIMING]
        names = [str(name) for name in self.scored["tracker"].unique()]
        if len(names) > CROWDED and "mean_overlap" in self.scored:  # the best ones have colours
            means = self.scored.groupby("tracker")["mean_overlap"].mean().fillna(0)
            names.sort(key=lambda name: -means[name])
        self.runs = collect_runs(judged_runs(experiment), names)
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
        self.curves = share_charts(self.runs, self.whole)
        self.speed: list[Any] = []
        self.time_mark, self.time_notes = "", []
        if self.summary is not None:
            _, measured = with_times(self.scored, self.timed)
            self.time_mark, self.time_notes = time_mark(measured), time_notes(measured)
            self.speed = speed_charts(self.summary, self.runs)
        self.survival = survival_charts(self.scored, self.runs)

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
        details = (*details, *corner_boxes(self.experiment, self.all_runs))
        for name, note in [*self.failed.items()][:1]:
            n_failed = (self.scored["status"] == "failed").sum()
            text = f"{n_failed} of {len(self.scored)} runs failed"
            text += " and count as the worst score" * (len(self.failed) > len(self.left_out))
            reason = (note.partition("): ")[2] or note).removesuffix(".")
            details = (*details, f"{text}; first: {name}, {reason}.")
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
        return replace(page, sections=[*self._sections(page)])

    def _sections(self, page: Page) -> Iterator[PageSection]:
        """Yield the sections in the order of the page."""
        runs, filmed, summary = self.runs, page.scenes, self.summary
        sheets = {name: self._sheet(table) for name, table in self.tables.items()}
        half = 6 if len(runs.trackers) <= CROWDED else 12
        if summary is not None and runs.stages:
            board = leaderboard(summary, runs, self.failed, self.time_mark, self.time_notes)
            yield PageSection("summary", "Leaderboard", blocks=[board], span=7)
        if self.curves:
            yield PageSection("curves", "Success and precision", blocks=[self.curves], span=5)
        if hardest := hardest_moments(runs, filmed):
            yield PageSection("hard", "Hardest moments", blocks=[hardest], span=7)
        if summary is not None and self.means.notna().any(axis=None):
            heat, title = heat_table(self.means, summary, runs, filmed), "Sequences by trackers"
            yield PageSection("heat", title, blocks=[heat], span=half, nav="Sequences")
        compared = self.comparison
        if compared is not None and compared.pairs and len(compared.scores) <= _MAX_PAIRED:
            limit = next((text for text in self.answer.details if "too few" in text), "")
            pairs, title = pair_matrix(compared, runs, limit), "Who beats whom"
            yield PageSection("answers", title, blocks=[pairs], span=half, nav="Comparison")
        if self.speed:
            yield PageSection("speed", "Speed and accuracy", blocks=self.speed, span=6, nav="Speed")
        if cards := failures(runs, filmed):
            title, block = cards
            caption = (
                "Lost: the centre is outside the true box for ten visible frames in a row. At most "
                "six runs are shown, first the worst of each tracker."
            )
            options: dict[str, Any] = {"caption": caption, "span": 6, "nav": "Failures"}
            yield PageSection("failures", title, blocks=[block], **options)
        if parts := parts_table(self.scored, self.occurring, runs):
            yield PageSection("parts", "By parameter and attribute", blocks=[parts])
        n_runs = self.scored.groupby("tracker").size()
        if self.survival and n_runs.min() >= _MIN_RUNS_OF_SURVIVAL:
            yield PageSection("survival", "Time to failure", blocks=self.survival)
        charts = timeline_charts(runs)
        stages = sequence_folds(runs, filmed, charts, self.means, sheets.get("sequences"), page)
        caption = "Open a sequence for its overlap by frame and all scores."
        title = "Sequence by sequence"
        yield PageSection("timelines", title, blocks=[*stages], caption=caption)
        folds = [_fold(sheet) for name, sheet in sheets.items() if name != "sequences"]
        if blocks := [fold for fold in folds if fold]:
            yield PageSection("tables", "All scores", blocks=blocks)
        yield self._provenance()

    def _words(self) -> list[str]:
        """Return sentences on unfinished runs, protocols and times."""
        counts = Counter(complete(self.all_runs)["status"].astype(str))
        wrong = [f"{n} {status}" for status, n in counts.items() if status != "finished"]
        words = [
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
        return words

    def _counts(self) -> str:
        """Return the numbers of trackers, sequences and runs, and the dates of the runs."""
        runs = self.all_runs
        is_stored, is_timed = runs["status"] != "missing", runs["protocol"] == TIMING
        counts = {
            "tracker": runs["tracker"].nunique(),
            "sequence": runs["sequence"].nunique(),
            "run": (is_stored & ~is_timed).sum(),
            "timing run": (is_stored & is_timed).sum(),
            "failed run": (runs["status"] == "failed").sum(),
        }
        parts = [f"{n} {word}{'s' * bool(n != 1)}" for word, n in counts.items() if n]
        days = sorted({entry["date"] for entry in self.runs.circumstances if entry["date"]})
        parts.append(" to ".join(dict.fromkeys(days[:1] + days[-1:])))
        return " · ".join(filter(None, parts))

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
        return [PageTable(table, places[:_MAX_FAILURES])]

    def _sheet(self, table: Table) -> PageTable:
        """Return a table of scores that opens worst frames."""
        data, columns = table.data, len(table.heads) - table.n_labels
        if "measure" not in data or len(data) != len(table.rows) * columns:
            return PageTable(table)
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
        return PageTable(table, places)

    @cached_property
    def means(self) -> pd.DataFrame:
        """Mean overlaps with a row per sequence and a column per tracker."""
        if "sequences" not in self.tables:
            return pd.DataFrame()
        data = self.tables["sequences"].data
        data = data[data["measure"] == "mean_overlap"].astype({"sequence": str, "tracker": str})
        means = data.pivot_table("mean", "sequence", "tracker", sort=False, dropna=False)
        return means.reindex(index=data["sequence"].unique(), columns=data["tracker"].unique())

    def _provenance(self) -> PageSection:
        """Return the section on versions, sources and hosts of the runs, and on terms."""
        runs, failed = self.all_runs, self._failures()
        runs = runs.assign(
            version=runs["tracker_version"].str[:16], fingerprint=runs["fingerprint"].str[:16]
        )
        trackers = runs.dropna(subset="version").drop_duplicates(["tracker", "version"])
        parameters = trackers["parameters"].astype(str).map(_format_parameters)
        sequences = runs.dropna(subset="fingerprint").drop_duplicates(["sequence", "fingerprint"])
        hosts = [
            {**entry, "libraries": ", ".join(map(" ".join, entry["libraries"].items()))}
            for entry in self.runs.circumstances
        ]
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
                pd.DataFrame(hosts, columns=["host", "date", "platform", "python", "libraries"]),
            ),
        ]
        commands = [self.commands.text("report", "--folder", "report")]
        commands.append(self.commands.text("compare"))
        if failed and self.commands.results:
            commands.append(f"trackmark results failures {shlex.quote(self.commands.results)}")
        result, tables = "commands, versions, parameters, fingerprints", [*failed, *sheets]
        terms = [f"{name}: {text}" for name, text in GLOSSARY.items()]
        folds = [
            Fold("provenance", "Provenance", result, self._words(), tables, commands),
            Fold("glossary", "Glossary", "terms of this page", terms),
        ]
        return PageSection("provenance", "About this report", blocks=folds, nav="Provenance")


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


def _worst_frame_kind(measure: str) -> str:
    """Return the criterion of the worst frame for a measure; see `PageRuns.place`."""
    if measure == "first_loss":
        return "loss"
    return "centre_error" if measure.startswith(("centre_error", "precision")) else "overlap"


def _format_parameters(parameters: str) -> str:
    """Convert parameters from JSON to the text of a specification."""
    return format_text("", json.loads(parameters))[1:] or MISSING
