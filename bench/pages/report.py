"""The page of an experiment: what came out, and what to look at."""

import json
import shlex
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from trackmark.bench.evaluation.run_record import Trace
from trackmark.bench.pages.charts import error_charts, share_charts, speed_chart, survival_chart
from trackmark.bench.pages.comparison_section import answers, parts, repetitions
from trackmark.bench.pages.page_frames import Watch
from trackmark.bench.pages.player_runs import Reading, named_by, read_takes, scenes
from trackmark.bench.protocols import STORED_ONCE, TIMING
from trackmark.bench.reporting.by_preset import table_prefix
from trackmark.bench.reporting.failed_runs import with_worst_scores
from trackmark.bench.store.loading import load_results
from trackmark.bench.store.truth import occurring_attributes
from trackmark.datasets.spec_string import format_text
from trackmark.reports.page.content import Page, Place, Section, Sheet
from trackmark.reports.page.page import write_chunk, write_page
from trackmark.reports.tables import MISSING, Cell, Table, complete

_MOST_FAILURES = 200
"""Rows of failed runs that are listed one by one."""

_DEFINITIONS = (
    "Of the frames after the first in which the target is present: overlap is intersection over "
    "union with the truth's box, success the share of frames with at least 0.5, inside that of "
    "frames whose estimated centre lies in the truth's box, centre error the distance of centres."
)


@dataclass(frozen=True)
class _Content:
    """What a page shows: its sections, and the runs that they are of."""

    reading: Reading
    sections: Sequence[Section]


@dataclass(frozen=True)
class Said:
    """How the results are called in commands: what follows `report` and `compare`."""

    results: str = ""  # of the folder; empty where there is none that stays
    others: Sequence[str] = ()

    def command(self, name: str, *options: str) -> str:
        """A command on them, as it is typed."""
        option = ["--results"] if name == "compare" else []
        given = [*option, self.results] if self.results else []
        return shlex.join(["trackmark", name, *given, *self.others, *options])


def write_report_page(
    experiment: Path,
    path: Path,
    tables: Sequence[Table],
    title: str,
    said: Said,
    watch: Watch,
    *,
    full: bool = False,
    plots: str = "",
) -> list[Path]:
    """Write the page of an experiment's results to `path`, and give its files.

    It shows the `tables` of its report under a `title`. `said` is how commands call the results;
    `watch` is told how many frames are read, of how many. `full`: frames of their own size are
    written beside it. `plots`: the suffix of figures that are written beside it, with its other
    tables and all of it in Markdown and LaTeX. Raises `ResultsError` where results can't be read,
    and `OSError` where a file can't be written.
    """
    found = _content(experiment, tables, said)
    keep = partial(write_chunk, path) if full else None
    shown = list(scenes(found.reading, said.results, watch, keep))
    page = Page(title, found.sections, found.reading.shown, shown)
    paths = write_page(path, page)
    if plots:
        from trackmark.bench.pages.paper_export import write_paper  # brings what draws

        paths += write_paper(path.parent, page, plots, {table.name for table in tables})
    return paths


def further_tables(experiment: Path, tables: Sequence[Table], said: Said) -> list[Table]:
    """What the page shows besides these `tables` of a report; see `write_report_page`."""
    names = {table.name for table in tables}
    found = _content(experiment, tables, said)
    shown = [sheet.table for section in found.sections for sheet in section.sheets]
    return [table for table in shown if table.name not in names]


def _content(experiment: Path, tables: Sequence[Table], said: Said) -> _Content:
    runs = with_worst_scores(experiment, load_results(experiment))
    scored = complete(runs[runs["protocol"] == "accuracy"])
    trackers = [str(name) for name in scored["tracker"].unique()]
    reading = read_takes(experiment, trackers)
    protocols = sorted({*map(str, runs["protocol"])} - {STORED_ONCE, TIMING}, key=len, reverse=True)
    overview = _overview(complete(runs), reading, tables, said)
    told = set(overview.words)
    tables = [
        replace(table, notes=[note for note in table.notes if note not in told]) for table in tables
    ]
    kept = {table.name: table for table in tables}
    incomplete = set(scored[scored["status"] != "finished"]["tracker"].astype(str))
    whole = [name for name in trackers if name not in incomplete]
    folder = said.command("report", "--folder", "report")
    finished = scored[scored["status"] == "finished"]
    occurring = occurring_attributes(experiment, finished)
    command = said.command("compare")
    which, differences = answers(experiment, runs, occurring, reading, command)
    opened = ["Open one to see its frames."] if reading.stages else []
    made = [
        overview,
        *([_summary(kept["summary"], reading, said)] if "summary" in kept else []),
        *([_heat(kept["sequences"], scored, reading)] if "sequences" in kept else []),
        Section("frames", "Sequences", words=opened, scenes=True),
        which,
        Section("curves", "Success and precision", charts=share_charts(reading, whole)),
        Section("errors", "Centre error over the frames", charts=error_charts(reading)),
        Section("survival", "Time to failure", charts=survival_chart(scored, reading)),
        parts(scored, occurring, reading, differences),
        Section("speed", "Speed against accuracy", charts=speed_chart(kept, reading)),
        *_others(tables, reading, said, protocols),
        _provenance(runs, reading),
    ]
    made = [
        replace(one, command=one.command or (folder if one.charts or one.sheets else ""))
        for one in made
        if one.charts or one.sheets or one.words
    ]
    return _Content(reading, made)


def _overview(
    scored: pd.DataFrame, reading: Reading, tables: Sequence[Table], said: Said
) -> Section:
    """What was run and where, and first of all what failed."""
    n_trackers, n_sequences = (scored[name].nunique() for name in ("tracker", "sequence"))
    counts = Counter(scored["status"].astype(str))
    n_runs = len(scored) - counts["missing"]
    hosts = sorted({str(one["host"]) for one in reading.circumstances})
    days = sorted({one["date"] for one in reading.circumstances if one["date"]})
    when = f" from {days[0]} to {days[-1]}" if len(set(days)) > 1 else f" on {''.join(days[:1])}"
    words = [
        f"{n_runs} runs: {n_trackers} tracker{'s' if n_trackers != 1 else ''} on "
        f"{n_sequences} sequence{'s' if n_sequences != 1 else ''}; run{when} "
        f"at {', '.join(hosts)}."
        if reading.circumstances
        else f"{n_runs} runs."
    ]
    wrong = {status: count for status, count in counts.items() if status != "finished"}
    words += [
        f"Runs not finished: {', '.join(f'{n} {status}' for status, n in wrong.items())}. Failed "
        "runs count as the worst score; means that need other ones are missing."
        if wrong
        else "All runs finished."
    ]
    if others := sorted(set(map(str, scored["protocol"])) - {STORED_ONCE, TIMING}):
        words.append(
            f"Runs by {', '.join(others)} stand in the player under the tracker's name with the "
            "protocol's behind it: over a frame the box that stood there. Frames that they are not "
            "judged in have no curve; where one was begun again the curve has a triangle. Charts "
            "are of runs in one pass."
        )
    words += dict.fromkeys(note for table in tables for note in table.notes)
    failed = [
        (Place(position, clip.tracker, clip.repetition, clip.end), stage.name, clip.failure)
        for position, stage in enumerate(reading.stages)
        for clip in (*stage.clips, *stage.others)
        if clip.failure and not clip.start  # of a run with segments once
    ]
    if not failed:
        return Section("runs", "What was run", words)
    rows = [
        [reading.shown[place.tracker], name, str(place.repetition), str(place.frame)]
        + [why.partition("\n")[0]]
        for place, name, why in failed[:_MOST_FAILURES]
    ]
    left = len(failed) - len(rows)
    table = _plain(
        "failed",
        f"{len(failed)} run{'s' * (len(failed) > 1)} failed; the last frame with a box opens.",
        ["tracker", "sequence", "repetition", "last box", "what went wrong"],
        rows,
        [f"{left} more are listed by `trackmark results failures`."] if left else [],
    )
    places = [[None, None, place, None] for place, _, _ in failed[:_MOST_FAILURES]]
    command = f"trackmark results failures {shlex.quote(said.results)}" if said.results else ""
    return Section("runs", "What was run", words, [Sheet(table, places=places)], command=command)


def _kind(measure: str) -> str:
    """What makes a frame the worst one by a measure."""
    if measure == "first_loss":
        return "loss"
    return "centre_error" if measure.startswith(("centre_error", "precision")) else "overlap"


def _sheet(table: Table, reading: Reading, protocols: Sequence[str] = ()) -> Sheet:
    """A table of scores; its numbers sort at full precision and open the worst frames.

    `protocols`: others than one pass, that runs are filed under.
    """
    data, columns = table.data, len(table.heads) - table.n_labels
    if "measure" not in data or len(data) != len(table.rows) * columns:
        return Sheet(table)
    values = data["mean"].to_numpy(float).reshape(len(table.rows), columns)
    kinds = [_kind(str(name)) for name in data["measure"][:columns]]
    names = {stage.name for stage in reading.stages}
    stored = next((one for one in protocols if table.name.startswith(table_prefix(one))), "")
    trace: Trace = "revised" if table.name.endswith("-revised") else "online"
    places = []
    for row in data[::columns].to_dict("records"):
        sequence = row.get("sequence")
        sequence = sequence if sequence in names else None
        tracker = named_by(row["tracker"], stored or STORED_ONCE)
        places.append([reading.place(tracker, sequence, kind, trace) for kind in kinds])
    return Sheet(table, values.tolist(), places)


def _summary(table: Table, reading: Reading, said: Said) -> Section:
    sheet = _sheet(table, reading)
    command = said.command("report", "--wide")
    return Section("summary", "Summary", [_DEFINITIONS], [sheet], command=command)


def _others(
    tables: Sequence[Table], reading: Reading, said: Said, protocols: Sequence[str]
) -> list[Section]:
    """All other tables of the report."""
    sheets = [_sheet(table, reading, protocols) for table in tables if table.name != "summary"]
    command = said.command("report", "--wide")
    return [Section("tables", "Every sequence", sheets=sheets, command=command)] if sheets else []


def _heat(table: Table, scored: pd.DataFrame, reading: Reading) -> Section:
    """Sequences by trackers, shaded by the mean overlap."""
    data = table.data[table.data["measure"] == "mean_overlap"]
    means = data.pivot_table("mean", "sequence", "tracker", sort=False, dropna=False)
    means = means.reindex(index=data["sequence"].unique(), columns=pd.unique(data["tracker"]))
    values = means.to_numpy(float)
    rows = [
        [str(name), *(f"{one:.3f}" if np.isfinite(one) else MISSING for one in row)]
        for name, row in zip(means.index, values, strict=True)
    ]
    places = [
        [reading.place(str(name), str(sequence), "overlap") for name in means.columns]
        for sequence in means.index
    ]
    grid = _plain(
        "heat",
        "Mean overlap (intersection over union with the truth's box, from 0 to 1) by sequence and "
        f"tracker: n = {len(means)} sequences, a mean over {repetitions(scored)} each, without "
        "interval. The bluer, the better.",
        ["sequence", *map(str, means.columns)],
        rows,
    )
    grid = replace(grid, data=means.reset_index())
    sheet = Sheet(grid, values.tolist(), places, heat=True)
    return Section("heat", "Sequences by trackers", sheets=[sheet])


def _provenance(runs: pd.DataFrame, reading: Reading) -> Section:
    """What determined the runs, and where they were made."""
    trackers = runs.dropna(subset="tracker_version").drop_duplicates(["tracker", "version"])
    sequences = runs.dropna(subset="fingerprint").drop_duplicates(["sequence", "fingerprint"])
    tables = [
        _plain(
            "trackers",
            "Trackers: parameters, and the digest of source and libraries.",
            ["tracker", "parameters", "version"],
            [
                [str(row.tracker), _told(str(row.parameters)), str(row.tracker_version)[:16]]
                for row in trackers.drop_duplicates(["tracker", "tracker_version"]).itertuples()
            ],
        ),
        _plain(
            "sequences-read",
            "Sequences: where they were read, and their fingerprint.",
            ["sequence", "source", "fingerprint", "frames"],
            [
                [str(row.sequence), str(row.source), str(row.fingerprint)[:16], f"{row.frames:.0f}"]
                for row in sequences.itertuples()
            ],
        ),
        _plain(
            "circumstances",
            "Where and when runs were made.",
            ["host", "date", "platform", "Python", "libraries"],
            [
                [*(str(one[key]) for key in ("host", "date", "platform", "python")), _listed(one)]
                for one in reading.circumstances
            ],
        ),
    ]
    return Section("provenance", "Provenance", sheets=[Sheet(table) for table in tables])


def _plain(
    name: str, caption: str, heads: list[str], rows: list[list[str]], notes: Sequence[str] = ()
) -> Table:
    """A table of texts, the first of which names the row."""
    cells = [[Cell(str(text)) for text in row] for row in rows]
    data = pd.DataFrame(rows, columns=heads)
    return Table(name, caption, heads, 1, cells, list(notes), data)


def _told(parameters: str) -> str:
    """Parameters, stored as JSON, as they are typed."""
    told = json.loads(parameters).items()
    return ", ".join(format_text("", {key: value})[1:] for key, value in told) or MISSING


def _listed(circumstance: Mapping[str, Any]) -> str:
    libraries = circumstance["libraries"].items()
    return ", ".join(f"{name} {number}" for name, number in libraries)
