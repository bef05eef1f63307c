"""Page of an experiment: its runs, scores, charts and frames."""

import json
import shlex
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from trackmark.bench.evaluation.run_record import Trace
from trackmark.bench.pages.charts import (
    error_charts,
    share_charts,
    speed_charts,
    survival_charts,
)
from trackmark.bench.pages.comparison_section import (
    comparison_section,
    parts_section,
    repetition_text,
)
from trackmark.bench.pages.page_frames import Watch
from trackmark.bench.pages.player_runs import Layers, name_on_page, read_runs, scenes
from trackmark.bench.protocols import STORED_ONE_PASS, TIMING
from trackmark.bench.reporting.by_preset import table_prefix
from trackmark.bench.reporting.failed_runs import with_worst_scores
from trackmark.bench.store.data_frames import load_results
from trackmark.bench.store.truth import find_attributes
from trackmark.datasets.spec_string import format_text
from trackmark.reports.page.content import Page, PageSection, PageTable, PlayerPosition
from trackmark.reports.page.page import write_chunk, write_page
from trackmark.reports.tables import MISSING, Table, complete, text_table

if TYPE_CHECKING:
    from trackmark.bench.pages.report_figures import FigureFiles

_MAX_FAILURES = 200
"""Maximum number of rows of failed runs."""

_DEFINITIONS = (
    "Of the frames after the first in which the target is present: overlap is intersection over "
    "union with the truth's box, success the share of frames with at least 0.5, inside that of "
    "frames whose estimated centre lies in the truth's box, centre error the distance of centres."
)


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
    sections = content.sections(charts=True)
    keep = partial(write_chunk, path) if full else None
    filmed = list(scenes(content.runs, commands.results, watch, keep))
    page = Page(title, sections, content.runs.labels, filmed)
    paths = write_page(path, page)
    if figures:
        from trackmark.bench.pages.paper_export import write_paper  # imports Matplotlib
        from trackmark.bench.pages.report_figures import write_figures

        timing = content.all_runs[content.all_runs["protocol"] == TIMING]
        incomplete = set(content.runs.trackers) - set(content.whole)
        drawn = page, content.runs, timing, incomplete
        paths += write_figures(experiment, path.parent, figures, *drawn)
        paths += write_paper(path.parent, page, figures.suffix, {table.name for table in tables})
    return paths


def further_tables(experiment: Path, tables: Sequence[Table], commands: Commands) -> list[Table]:
    """Return the tables that only the page has, not the report with these `tables`."""
    names = {table.name for table in tables}
    sections = _Content(experiment, tables, commands, "none").sections(charts=False)
    every = [sheet.table for section in sections for sheet in section.sheets]
    return [table for table in every if table.name not in names]


class _Content:
    """Runs, tables and commands from which the sections of a page are built."""

    def __init__(
        self, experiment: Path, tables: Sequence[Table], commands: Commands, layers: Layers
    ) -> None:
        self.experiment, self.tables, self.commands = experiment, tables, commands
        self.all_runs = with_worst_scores(experiment, load_results(experiment))
        self.scored = complete(self.all_runs[self.all_runs["protocol"] == STORED_ONE_PASS])
        trackers = [str(name) for name in self.scored["tracker"].unique()]
        self.runs = read_runs(experiment, trackers, layers)
        unfinished = self.scored[self.scored["status"] != "finished"]
        incomplete = set(unfinished["tracker"].astype(str))
        self.whole = [name for name in trackers if name not in incomplete]

    @cached_property
    def protocols(self) -> list[str]:
        """Stored names of the protocols other than one-pass, longest first."""
        stored = {*map(str, self.all_runs["protocol"])} - {STORED_ONE_PASS, TIMING}
        return sorted(stored, key=len, reverse=True)

    def sections(self, *, charts: bool) -> list[PageSection]:
        """Return the sections of the page that have contents, in order."""
        command = self.commands.text("report", "--folder", "report")
        return [
            replace(part, command=part.command or (command if part.charts or part.sheets else ""))
            for part in self._all_sections(charts=charts)
            if part.charts or part.sheets or part.words
        ]

    def _all_sections(self, *, charts: bool) -> Iterator[PageSection]:
        overview = self._overview()
        repeated = set(overview.words)
        tables = [
            replace(table, notes=[note for note in table.notes if note not in repeated])
            for table in self.tables
        ]
        named = {table.name: table for table in tables}
        runs, scored, wide = self.runs, self.scored, self.commands.text("report", "--wide")
        finished = scored[scored["status"] == "finished"]
        occurring = find_attributes(self.experiment, finished)
        which, differences = comparison_section(
            self.experiment, self.all_runs, occurring, runs, self.commands.text("compare")
        )
        yield overview
        if "summary" in named:
            sheet = self._sheet(named["summary"])
            yield PageSection("summary", "Summary", [_DEFINITIONS], [sheet], command=wide)
        if "sequences" in named:
            yield self._heat_map(named["sequences"])
        words = ["Open one to see its frames."] if runs.stages else []
        yield PageSection("frames", "Sequences", words=words, scenes=True)
        yield which
        if charts:
            shares = share_charts(runs, self.whole)
            yield PageSection("curves", "Success and precision", charts=shares)
            yield PageSection("errors", "Centre error over the frames", charts=error_charts(runs))
            yield PageSection("survival", "Time to failure", charts=survival_charts(scored, runs))
        yield parts_section(scored, occurring, runs, differences)
        if charts:
            yield PageSection("speed", "Speed against accuracy", charts=speed_charts(named, runs))
        sheets = [self._sheet(table) for table in tables if table.name != "summary"]
        yield PageSection("tables", "Every sequence", sheets=sheets, command=wide)
        yield self._provenance()

    def _overview(self) -> PageSection:
        """Return the section on all runs and failed runs."""
        words = [self._counts()]
        runs = complete(self.all_runs)
        counts = Counter(runs["status"].astype(str))
        wrong = [f"{n} {status}" for status, n in counts.items() if status != "finished"]
        words += [
            f"Runs not finished: {', '.join(wrong)}. Failed runs count as the worst score; means "
            "that need other ones are missing."
            if wrong
            else "All runs finished."
        ]
        if self.protocols:
            words.append(
                f"Runs by {', '.join(sorted(self.protocols))} stand in the player under the "
                "tracker's name with the protocol's behind it: over a frame the box that stood "
                "there. Frames that they are not judged in have no curve; where one was begun "
                "again the curve has a triangle. Charts are of runs in one pass."
            )
        words += dict.fromkeys(note for table in self.tables for note in table.notes)
        sheet = self._failures()
        results = self.commands.results
        command = f"trackmark results failures {shlex.quote(results)}" if results else ""
        if sheet is None:
            return PageSection("runs", "What was run", words)
        return PageSection("runs", "What was run", words, [sheet], command=command)

    def _counts(self) -> str:
        """Return a sentence with the numbers, dates and hosts of the runs."""
        runs = complete(self.all_runs)
        n_runs = int((runs["status"].astype(str) != "missing").sum())
        if not self.runs.circumstances:
            return f"{n_runs} runs."
        n_trackers, n_sequences = (runs[name].nunique() for name in ("tracker", "sequence"))
        circumstances = self.runs.circumstances
        hosts = sorted({str(entry["host"]) for entry in circumstances})
        days = sorted({entry["date"] for entry in circumstances if entry["date"]})
        when = f" from {days[0]} to {days[-1]}" if len(days) > 1 else f" on {''.join(days)}"
        return (
            f"{n_runs} runs: {n_trackers} tracker{'s' * (n_trackers != 1)} on "
            f"{n_sequences} sequence{'s' * (n_sequences != 1)}; run{when} at {', '.join(hosts)}."
        )

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

    def _heat_map(self, table: Table) -> PageSection:
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
            "Mean overlap (intersection over union with the truth's box, from 0 to 1) by sequence "
            f"and tracker: n = {len(means)} sequences, a mean over {repetition_text(self.scored)} "
            "each, without interval. The bluer, the better.",
            ["sequence", *map(str, means.columns)],
            rows,
        )
        grid = replace(grid, data=means.reset_index())
        sheet = PageTable(grid, values.tolist(), places, heat=True)
        return PageSection("heat", "Sequences by trackers", sheets=[sheet])

    def _provenance(self) -> PageSection:
        """Return the section on versions, sources and hosts of the runs."""
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
        return PageSection(
            "provenance", "Provenance", sheets=[PageTable(table) for table in tables]
        )


def _worst_frame_kind(measure: str) -> str:
    """Return the criterion of the worst frame for a measure; see `PageRuns.place`."""
    if measure == "first_loss":
        return "loss"
    return "centre_error" if measure.startswith(("centre_error", "precision")) else "overlap"


def _format_parameters(parameters: str) -> str:
    """Convert parameters from JSON to the text of a specification."""
    items: dict[str, Any] = json.loads(parameters)
    return ", ".join(format_text("", {key: items[key]})[1:] for key in items) or MISSING
