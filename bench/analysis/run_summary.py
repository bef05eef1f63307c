"""Short summary of stored one-pass runs for a terminal: answer, failed runs and one table."""

import re
import shlex
from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from trackmark.bench.analysis.comparison import (
    Comparison,
    compare_trackers,
    rank_among_published,
)
from trackmark.bench.analysis.decisions import Answer, answer_of
from trackmark.bench.analysis.run_tables import (
    SUMMARY,
    not_repeatable,
    undefined_notes,
    without_undefined,
)
from trackmark.bench.analysis.score_tables import (
    failed_runs,
    mean_table,
    missing_reasons,
    notes_of,
    tracker_means,
    with_not_run,
)
from trackmark.bench.analysis.times import (
    TIME,
    TIMES,
    clock_of,
    fps_text,
    time_marks,
    time_notes,
    time_text,
    with_fps,
    with_times,
)
from trackmark.bench.protocols import ONE_PASS
from trackmark.bench.store.runs import DEFAULT_METRICS, Runs
from trackmark.reports.printable import one_line, wrap
from trackmark.reports.renderers import terminal_lines
from trackmark.reports.tables import MISSING, Cell, Table

if TYPE_CHECKING:
    from trackmark.bench.analysis.published_sets import PublishedSet

MAX_ROWS = 10
"""Maximum number of trackers in a short table."""

_MAX_FAILURES = 3
"""Maximum number of trackers whose first failure is printed."""

_BAR = 10
"""Length of a bar for a mean overlap of 1 [characters]."""

_CODE_LINE = re.compile(r'File "([^"]+)", line (\d+), in (\S+)')


_SHOWN = ["mean_overlap", "success_rate", "centre_error", TIME.name]
"""Measures of the short table; a score is missing if no run has it."""


@dataclass(frozen=True)
class RunSummary:
    """Answer on the one-pass runs of an experiment, and the content of its table."""

    sentences: Answer
    failures: list[str]  # lines on failed runs
    warnings: list[str]
    runs: pd.DataFrame  # runs with a score, and those that are missing
    measured: pd.DataFrame  # runs whose times the table shows
    means: pd.DataFrame  # by tracker, with the reasons `lacking` of missing means
    intervals: Mapping[str, tuple[float, float]]  # of the mean overlaps, by tracker
    undefined: list[str]  # sequences on which the score of all trackers is undefined

    def lines(self, *, quiet: bool = False) -> list[str]:
        """Return the lines for a terminal; if `quiet`, without the table."""
        printed = [self.sentences.heading, *([] if quiet else self.sentences.details)]
        first_lines = [*self.failures, *([""] if self.failures else [])]
        for sentence in printed:
            first_lines += wrap(sentence).splitlines()
        return first_lines if quiet else [*first_lines, "", *terminal_lines(self.table())]

    def table(self) -> Table:
        """Return a table with a row per tracker, the best mean overlap first.

        A narrow terminal shows no bar, a narrower one no centre error.
        """
        rows, marks = [], time_marks(self.measured)
        ranked = self.means.sort_values("mean_overlap", ascending=False, kind="stable")
        for label, row in ranked.head(MAX_ROWS).to_dict("index").items():
            name, mean, time = str(label), row["mean_overlap"], row[TIME.name]
            missing = f" ({row['lacking']})" if row["lacking"] else ""
            interval = self.intervals.get(name)
            cells = [
                name,
                f"{_value_text(mean, '.2f')}{missing}",
                f"{'#' * round(_BAR * mean):.<{_BAR}}" if isfinite(mean) else "",
                "[{:.2f}, {:.2f}]".format(*interval) if interval else MISSING,
                _value_text(100 * row["success_rate"], ".0f", " %"),
                _value_text(row["centre_error"], ".1f", " px"),
                time_text(time, marks.get(name, "")),
                fps_text(time),
            ]
            rows.append([*map(Cell, cells)])
        headings = ["tracker", "overlap", f"{'0':<{_BAR - 1}}1", "95 %", "success", "error"]
        headings += [TIME.heading, "fps"]
        ranks = [0, 9, 3, 1, 4, 2, 5]
        if not self.intervals:
            del headings[3], ranks[2]
            for cells_of_row in rows:
                del cells_of_row[3]
        n_hidden = len(self.means) - len(rows)
        notes = [f"{n_hidden} more trackers: --verbose"] if n_hidden else []
        run_notes = notes_of(self.runs, SUMMARY[0].name)
        notes += [note for note in run_notes if " runs failed (" not in note]
        notes += [*undefined_notes(self.undefined, SUMMARY[0]), *time_notes(self.measured)]
        return Table("short", "", headings, 1, rows, notes, ranks=ranks)


def summarise(runs: Runs, published: "Path | PublishedSet | None" = None) -> RunSummary | None:
    """Return the summary of one-pass runs; None without such runs.

    Times come from timing runs if these exist. With published scores, the answer is the rank among
    them, and the runs are scored by their metrics.
    """
    metrics = getattr(published, "metrics", DEFAULT_METRICS)
    scored = runs.scored(metrics, ONE_PASS)
    if scored.empty:
        return None
    defined, undefined = without_undefined(scored, SUMMARY[0].name)
    defined, measured = with_times(defined, runs.timed)
    defined = with_not_run(defined)
    means, _ = tracker_means(defined, [*SUMMARY, TIME])
    reasons = missing_reasons(defined, means.index, SUMMARY[0].name)
    means = means.where(reasons == "").reindex(columns=_SHOWN).assign(lacking=reasons)
    sentences, comparison = answer_on(scored, runs.timed, means["mean_overlap"], reasons)
    if published is not None:
        sentences = answer_of(rank_among_published(runs, published))
    standings = () if comparison is None else comparison.standings
    return RunSummary(
        sentences,
        failure_lines(scored, runs.folder),
        [*not_repeatable(runs.table).values()],
        defined,
        measured,
        means,
        {entry.tracker: entry.interval for entry in standings if entry.interval},
        undefined,
    )


def answer_on(
    scored: pd.DataFrame,
    timed: pd.DataFrame,
    overlaps: "pd.Series[float]",
    reasons: "pd.Series[str]",
    **details: Any,
) -> tuple[Answer, Comparison | None]:
    """Return which tracker has the best mean overlap, and the comparison of trackers with all runs.

    `scored` are the one-pass runs, `overlaps` their means by tracker, `reasons` why means
    are missing, and `details` further arguments of `compare_trackers`.
    """
    left_out = failed_runs(scored).left_out
    if overlaps.notna().any():
        labels = [*overlaps.index[overlaps.notna()], *left_out]
        comparison = compare_trackers(scored, timed, SUMMARY[0], labels, **details)
        return answer_of(comparison), comparison
    if (reasons == "").any():
        return Answer("There is no answer: no sequence has a target after its first frame."), None
    if len(left_out) < len(overlaps):
        return Answer("There is no answer: no tracker has runs on all sequences."), None
    return Answer("There is no answer: all runs failed."), None


def summarise_times(runs: Runs) -> list[str]:
    """Return lines on timing runs: the fastest tracker, and a table of the times."""
    timed = runs.timed
    lines = failure_lines(timed, runs.folder)
    table = with_fps(mean_table(timed, TIMES, "", DEFAULT_METRICS), timed)
    table = replace(table, caption="", notes=[*table.notes, *time_notes(timed)])
    times = (
        table.records[table.records["measure"] == TIME.name].set_index("tracker")["mean"].dropna()
    )
    if times.empty:
        sentence = "There is no answer: the timing runs failed."
    else:
        clocks = clock_of(timed)
        most_used = max(clocks.values(), key=list(clocks.values()).count)
        comparable = times[[name for name in times.index if clocks.get(name) == most_used]]
        fastest = str(comparable.idxmin())
        verb = "is the fastest" if len(comparable) > 1 else "was timed"
        sentence = f"{fastest} {verb}: {time_text(comparable.min())} ms per frame."
    return [*lines, *([""] if lines else []), sentence, "", *terminal_lines(table)]


def _value_text(value: float, form: str, unit: str = "") -> str:
    return f"{value:{form}}{unit}" if isfinite(value) else MISSING


def failure_lines(runs: pd.DataFrame, folder: Path | None) -> list[str]:
    """Return lines on failed runs: their number, and frame, reason and code line of the first ones.

    The last line names the command that lists all failed runs in the results folder.
    """
    failed = runs[runs["status"] == "failed"]
    if failed.empty:
        return []
    notes = failed_runs(runs, "0").notes
    lines = [f"{len(failed)} of {len(runs)} run{'s' * (len(runs) != 1)} FAILED:"]
    first = failed.drop_duplicates("tracker")
    with_scores = set(runs["tracker"][runs["status"] != "failed"])
    for row in first.head(_MAX_FAILURES).to_dict("records"):
        reason = str(row["failure"]).partition("\n")[0]
        lines.append(one_line(f"        {row['tracker']} on {row['sequence']}, {reason}"))
        if code_line := tracker_line(str(row["failure"])):
            lines.append(one_line(f"        {code_line}"))
        if row["tracker"] in with_scores:  # the answer names the other trackers
            lines.append(f"        {notes[row['tracker']].partition(':')[0]}")
    n_hidden = len(first) - _MAX_FAILURES
    lines += [f"        and runs of {n_hidden} more trackers"] if n_hidden > 0 else []
    return [*lines, f"Log     {shlex.join(['trackmark', 'results', 'failures', str(folder)])}"]


def tracker_line(failure: str) -> str:
    """Return file, line and function of the tracker's own code in a failure; empty if unknown.

    This is the innermost line outside of the harness and of installed packages.
    """
    harness, library = Path(__file__).resolve().parents[1], Path(re.__file__).parents[1]
    adapters = harness.with_name("trackers") / "base"
    for file, line, function in reversed(_CODE_LINE.findall(failure)):
        path = Path(file)
        outside = "site-packages" in path.parts or file.startswith("<")
        if not outside and not {harness, adapters, library} & set(path.resolve().parents):
            folder = Path.cwd()
            path = path.relative_to(folder) if path.is_relative_to(folder) else path
            return f"{path}, line {line}, in {function}"
    return ""
