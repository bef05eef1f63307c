"""Page of an experiment: its answer, and cards of scores and frames."""

import json
import shlex
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property, partial
from itertools import compress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from trackmark.bench.analysis.by_metrics import table_prefix
from trackmark.bench.analysis.comparison import Comparison, rank_among_published
from trackmark.bench.analysis.decisions import Answer, answer_of, no_winner_reason
from trackmark.bench.analysis.run_checks import (
    ComparisonError,
    corner_boxes,
    same_boxes,
)
from trackmark.bench.analysis.run_summary import answer_on
from trackmark.bench.analysis.run_tables import not_repeatable, summary_of
from trackmark.bench.analysis.score_tables import (
    failed_runs,
    means_by_tracker,
    ranked_trackers,
    with_not_run,
)
from trackmark.bench.analysis.times import time_marks, time_notes, with_times
from trackmark.bench.evaluation.run_record import Trajectory
from trackmark.bench.pages.cards import (
    MAX_ROWS,
    N_SHOWN_PUBLISHED,
    leaderboard,
    lost_runs,
    overlap_matrix,
    pair_differences,
    published_ranking,
    sequence_folds,
    subset_means,
    worst_frames,
)
from trackmark.bench.pages.charts import (
    share_charts,
    speed_charts,
    survival_charts,
    timeline_charts,
)
from trackmark.bench.pages.content import Page, PageSection, PageTable
from trackmark.bench.pages.page import GLOSSARY, card, write_chunk, write_page
from trackmark.bench.pages.page_frames import Progress, with_frames
from trackmark.bench.pages.player_runs import collect_runs, name_on_page
from trackmark.bench.protocols import ONE_PASS, TIMING
from trackmark.bench.store.runs import DEFAULT_METRICS, Runs
from trackmark.datasets.spec_string import format_text
from trackmark.reports.printable import one_line
from trackmark.reports.svg import CROWDED
from trackmark.reports.tables import MISSING, Table, text_table

if TYPE_CHECKING:
    from trackmark.bench.analysis.published_sets import PublishedSet

_MAX_FAILURES = 200
"""Maximum number of rows of failed runs."""

_MIN_RUNS_OF_SURVIVAL = 20
"""Minimum number of runs per tracker for the survival plot on the page."""


class ReportPage:
    """Page of an experiment's results, with the tables of its report.

    `arguments`: arguments of `report` and `compare` that are needed to repeat the report on the
    results. `published` has scores of further trackers; see `compare_runs`. Raises `ResultsError`
    if results cannot be read, and `ComparisonError` if published scores cannot be compared.
    """

    def __init__(
        self,
        runs: Runs,
        tables: Sequence[Table],
        arguments: Sequence[str] = (),
        published: "Path | PublishedSet | None" = None,
    ) -> None:
        self.stored_runs, self._arguments = runs, arguments
        self.tables = {table.name: table for table in tables}
        # Published scores are ranked among scores of the same metrics.
        self.metrics: str = getattr(published, "metrics", DEFAULT_METRICS)
        self.scored = with_not_run(runs.scored(self.metrics, ONE_PASS))
        self.summary: Table | None = None
        ranked: list[str] = []
        if len(self.scored):
            summary = self.tables.get("summary") if self.metrics == DEFAULT_METRICS else None
            self.summary = summary or summary_of(self.scored, runs.timed, "")
            ranked = ranked_trackers(self.summary)
        self.runs = collect_runs(runs.read(runs.evaluated_rows()), ranked)
        self.failed, self.left_out = failed_runs(self.scored)
        self.comparison, sentences = self._compare()
        self.ranking: Comparison | None = None
        if published is not None:
            self.ranking = rank_among_published(runs, published)
            self._citation = getattr(published, "citation", "")
            sentences = answer_of(self.ranking)
        self.sentences = Answer(sentences.heading, (*sentences.details, *self._notes()))
        unfinished = set(self.scored["tracker"][self.scored["status"] != "finished"].astype(str))
        complete = [name for name in ranked if name not in unfinished]
        self.curves = share_charts(self.runs, complete)
        self.speed = [] if self.summary is None else speed_charts(self.summary, self.runs)
        self.survival = survival_charts(self.scored, self.runs)

    def write(
        self, path: Path, title: str, progress: Progress, *, with_full_frames: bool = False
    ) -> list[Path]:
        """Write the page and return its files.

        While frames are read, `progress` gets their number and that of all frames. If
        `with_full_frames`, frames are also written in full size. Raises `OSError` if a file cannot
        be written.
        """
        chunk_writer = partial(write_chunk, path) if with_full_frames else None
        sequences = with_frames(self.runs.sequences, progress, chunk_writer)
        self.runs = replace(self.runs, sequences=sequences)
        page = Page(
            title,
            [*self._sections()],
            self.runs.labels,
            sequences,
            meta=self._counts(),
            heading=self.sentences.heading,
            details=[*self.sentences.details, *self._reason()],
        )
        return write_page(path, page)

    def _compare(self) -> tuple[Comparison | None, Answer]:
        """Return the comparison of the trackers, if there is one, and the answer."""
        if self.summary is None:
            return None, Answer("", ("There is no comparison: there are no one-pass runs.",))
        runs, overlaps = self.stored_runs, means_by_tracker(self.summary, "mean_overlap")
        try:
            sentences, comparison = answer_on(
                runs.scored(self.metrics, ONE_PASS),
                runs.timed,
                overlaps["mean"],
                overlaps["lacking"],
                attributes=runs.attributes,
                same_boxes=same_boxes(runs),
                not_repeatable=not_repeatable(runs.table),
            )
        except ComparisonError as error:
            return None, Answer("", (f"There is no comparison: {error}",))
        return comparison, sentences

    def _reason(self) -> Iterator[Markup]:
        """Yield why there is no clear winner, with a link to the intervals of the pairs."""
        if self.comparison is None or self.ranking is not None:
            return
        if reason := no_winner_reason(self.comparison):
            link = Markup('<a href="#part-pairs">see the intervals of the differences</a>')
            yield Markup("{}: {}.").format(one_line(reason), link)

    def _notes(self) -> Iterator[str]:
        """Yield sentences on boxes that look like corners and on failed runs."""
        if self.comparison is not None:
            yield from corner_boxes(self.stored_runs)
        for name, note in [*self.failed.items()][:1]:
            n_failed = (self.scored["status"] == "failed").sum()
            failed_share = f"{n_failed} of {len(self.scored)} runs failed"
            if len(self.failed) > len(self.left_out):
                failed_share += " and count as the worst score"
            reason = (note.partition("): ")[2] or note).removesuffix(".")
            yield f"{failed_share}; first: {name}, {reason}."

    @cached_property
    def protocols(self) -> list[str]:
        """Stored names of the protocols other than one-pass, longest first."""
        keys = [key for key in self.stored_runs.protocols if key != ONE_PASS]
        return sorted(keys, key=len, reverse=True)

    def _sections(self) -> Iterator[PageSection]:
        """Yield the sections in the order of the page."""
        runs, summary = self.runs, self.summary
        tables = {name: self._without_repetition(table) for name, table in self.tables.items()}
        linked_tables = {name: self._with_positions(table) for name, table in tables.items()}
        half = 6 if len(runs.trackers) <= CROWDED else 12
        if summary is not None and runs.sequences:
            _, measured = with_times(self.scored, self.stored_runs.timed)
            times = time_marks(measured), time_notes(measured)
            board = leaderboard(summary, runs, self.failed, *times, self.ranking)
            yield PageSection("summary", "Leaderboard", [board], span=7)
        if self.curves:
            # The plot is as high as the leaderboard and the frames below it.
            n_rows = min(len(runs.trackers), MAX_ROWS)
            n_rows += N_SHOWN_PUBLISHED if self.ranking is not None else 0
            height = {1: 640, 2: 500, 3: 400}.get(len(runs.sequences), 24 + 42 * n_rows)
            cards = [card("charts", charts=self.curves, height=max(270, min(height, 640)))]
            yield PageSection("curves", "Success and precision", cards, span=5)
        if worst := worst_frames(runs):
            yield PageSection("worst", "Worst frames", [worst], span=7)
        if self.ranking is not None:
            ranking = published_ranking(self.ranking, runs, self._citation)
            yield PageSection("ranking", "Among published trackers", [ranking], nav="Published")
        if summary is not None and self.means.notna().any(axis=None):
            matrix, title = self._matrix(summary), "Sequences by trackers"
            yield PageSection("heat", title, [matrix], span=half, nav="Sequences")
        compared = self.comparison
        if compared is not None and compared.pairs:
            limit = next((text for text in self.sentences.details if "too few" in text), "")
            pairs, title = pair_differences(compared, runs, limit), "Pairwise comparison"
            yield PageSection("pairs", title, [pairs], span=half, nav="Comparison")
        if self.speed:
            cards = [card("chart", chart=chart) for chart in self.speed]
            yield PageSection("speed", "Speed and accuracy", cards, span=6, nav="Speed")
        if lost := lost_runs(runs):
            title, losses = lost
            caption = (
                "Lost: the centre is outside the ground-truth box for ten visible frames in a row. "
                "At most six runs are shown, first one of each tracker."
            )
            options: dict[str, Any] = {"caption": caption, "span": 6, "nav": "Lost runs"}
            yield PageSection("lost", title, [losses], **options)
        if subsets := subset_means(self.scored, self.stored_runs.attributes, runs):
            yield PageSection("subsets", "By parameter and attribute", [subsets])
        n_runs = self.scored.groupby("tracker").size()
        if self.survival and n_runs.min() >= _MIN_RUNS_OF_SURVIVAL:
            cards = [card("chart", chart=chart) for chart in self.survival]
            yield PageSection("survival", "Survival", cards)
        scores, charts = linked_tables.pop("sequences", None), timeline_charts(runs)
        folds = sequence_folds(runs, charts, self.means, scores, self.ranking)
        caption = "Open a sequence for its overlap by frame and all scores."
        yield PageSection("timelines", "Per sequence", [*folds], caption=caption)
        if cards := [_fold(table) for table in linked_tables.values() if _has_values(table.table)]:
            yield PageSection("tables", "All scores", cards)
        yield self._provenance()

    def _paragraphs(self) -> list[str]:
        """Return sentences on unfinished runs, protocols and times."""
        counts = Counter(with_not_run(self.stored_runs.table)["status"])
        wrong = [f"{n} {status}" for status, n in counts.items() if status != "finished"]
        paragraphs = [
            f"Runs not finished: {', '.join(wrong)}. Failed runs count as the worst score. Means "
            "that need missing runs are missing."
            if wrong
            else "All runs finished."
        ]
        if self.protocols:
            protocols = ", ".join(sorted(self.protocols))
            paragraphs.append(
                f"The player also shows runs with other protocols ({protocols}): the protocol "
                "is after the tracker's name. Frames that are not scored have no curve; a triangle "
                "marks a restart. Charts show one-pass runs."
            )
        return paragraphs

    def _counts(self) -> str:
        """Return the numbers of trackers, sequences and runs, and the dates of the runs."""
        runs = self.stored_runs.table
        is_stored, is_timed = runs["status"] != "missing", runs["protocol"] == TIMING
        counts = {
            "tracker": runs["tracker"].nunique(),
            "sequence": runs["sequence"].nunique(),
            "run": (is_stored & ~is_timed).sum(),
            "timing run": (is_stored & is_timed).sum(),
            "failed run": (runs["status"] == "failed").sum(),
        }
        counted = [f"{n} {word}{'s' * bool(n != 1)}" for word, n in counts.items() if n]
        days = sorted({environment["date"] for environment in self.runs.metadata} - {""})
        counted.append(" to ".join(dict.fromkeys(days[:1] + days[-1:])))
        return " · ".join(filter(None, counted))

    def _failures(self) -> list[PageTable]:
        """Return a table of failed runs, if any; each row opens the last frame with a box."""
        rows, positions = [], []
        for index, sequence in enumerate(self.runs.sequences):
            for run in sequence.runs:
                if run.failure and not run.start:  # a run with segments counts once
                    label, last = self.runs.labels[run.tracker], run.worst_frame
                    facts = label, sequence.name, run.repetition, last
                    rows.append([*map(str, facts), run.failure.partition("\n")[0]])
                    positions.append([None, None, run.position(index, last), None])
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
        return [PageTable(table, positions[:_MAX_FAILURES])]

    def _without_repetition(self, table: Table) -> Table:
        """Return the table; of revised boxes of sequences, only rows that are not of online boxes.

        The other rows are those of trackers that revise no boxes.
        """
        online, values = self.tables.get("sequences"), table.records
        if table.name != "sequences-revised" or online is None or not table.rows:
            return table
        online_rows = {tuple(cell.text for cell in row) for row in online.rows}
        is_new = [tuple(cell.text for cell in row) not in online_rows for row in table.rows]
        if len(values) % len(is_new):
            return table
        records = values[np.repeat(is_new, len(values) // len(is_new))]
        return replace(table, rows=[*compress(table.rows, is_new)], records=records)

    def _with_positions(self, table: Table) -> PageTable:
        """Return a table of scores that opens worst frames."""
        values, columns = table.records, len(table.headings) - table.n_labels
        if "measure" not in values or len(values) != len(table.rows) * columns:
            return PageTable(table)
        criteria = [_worst_frame_criterion(str(name)) for name in values["measure"][:columns]]
        names = {sequence.name for sequence in self.runs.sequences}
        protocols = [key for key in self.protocols if table.name.startswith(table_prefix(key))]
        trajectory: Trajectory = "revised" if table.name.endswith("-revised") else "online"
        positions = []
        for row in values[::columns].to_dict("records"):
            sequence = row["sequence"] if row.get("sequence") in names else None
            tracker = name_on_page(row["tracker"], [*protocols, ONE_PASS][0])
            positions.append(
                [
                    self.runs.worst_position(tracker, sequence, criterion, trajectory)
                    for criterion in criteria
                ]
            )
        return PageTable(table, positions)

    @cached_property
    def means(self) -> pd.DataFrame:
        """Mean overlaps with a row per sequence and a column per tracker."""
        if self.ranking is not None:
            means = _means_of(self.ranking)
        elif "sequences" in self.tables:
            rows = self.tables["sequences"].records
            rows = rows[rows["measure"] == "mean_overlap"].astype({"sequence": str, "tracker": str})
            means = rows.pivot_table("mean", "sequence", "tracker", sort=False, dropna=False)
            means = means.reindex(index=rows["sequence"].unique())
        else:
            return pd.DataFrame()
        return means[[name for name in self.runs.trackers if name in means]]

    def _matrix(self, summary: Table) -> Markup:
        """Return the matrix of mean overlaps, with the best published trackers if there are any."""
        means, ranking, note = self.means, self.ranking, ""
        if ranking is None:
            overall = means_by_tracker(summary, "mean_overlap")["mean"]
            mean_of = {name: float(overall[name]) for name in map(str, means)}
        else:
            theirs = _means_of(ranking)[list(ranking.published)]  # the best mean first
            best = theirs.iloc[:, :N_SHOWN_PUBLISHED]
            medians = theirs.median(axis=1).rename("median published")
            means = pd.concat([means, best, medians], axis=1)
            mean_of = {str(name): float(mean) for name, mean in means.mean().items()}
            note = (
                f" Scores: {ranking.measure.title}; those of all {theirs.shape[1]} published "
                'trackers are below, in "Per sequence".'
            )
        return overlap_matrix(means, mean_of, self.runs, note)

    def _provenance(self) -> PageSection:
        """Return the section on versions, sources and hosts of the runs, and on terms."""
        runs, failed = self.stored_runs.table, self._failures()
        runs = runs.assign(
            version=runs["tracker_version"].str[:16], fingerprint=runs["fingerprint"].str[:16]
        )
        trackers = runs.dropna(subset="version").drop_duplicates(["tracker", "version"])
        parameters = trackers["parameters"].astype(str).map(_format_parameters)
        sequences = runs.dropna(subset="fingerprint").drop_duplicates(["sequence", "fingerprint"])
        hosts = [
            {**entry, "libraries": ", ".join(map(" ".join, entry["libraries"].items()))}
            for entry in self.runs.metadata
        ]
        tables = [
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
                "metadata",
                "Where and when runs were made.",
                pd.DataFrame(hosts, columns=["host", "date", "platform", "python", "libraries"]),
            ),
        ]
        folder = [] if self.stored_runs.folder is None else [str(self.stored_runs.folder)]
        option = ["--results"] * bool(folder)
        commands = [
            ["report", *folder, *self._arguments, "--output", "report"],
            ["compare", *option, *folder, *self._arguments],
            *([["results", "failures", *folder]] if failed and folder else []),
        ]
        provenance = card(
            "fold",
            key="provenance",
            title="Provenance",
            summary="commands, versions, parameters, fingerprints",
            paragraphs=self._paragraphs(),
            tables=[*failed, *tables],
            commands=[shlex.join(["trackmark", *command]) for command in commands],
        )
        terms = [f"{name}: {text}" for name, text in GLOSSARY.items()]
        glossary = card(
            "fold", key="glossary", title="Glossary", summary="terms of this page", paragraphs=terms
        )
        cards = [provenance, glossary]
        return PageSection("about", "About this report", cards, nav="Provenance")


def _means_of(comparison: Comparison) -> pd.DataFrame:
    """Return the compared scores with a row per sequence and a column per tracker."""
    scores = {name: [run.mean() for run in row] for name, row in comparison.scores.items()}
    return pd.DataFrame(scores, index=[*comparison.sequences])


def _has_values(table: Table) -> bool:
    """Return whether a cell after the labels has a value."""
    return any(cell.text != MISSING for row in table.rows for cell in row[table.n_labels :])


def _fold(table: PageTable) -> Markup:
    """Return a folded table of scores."""
    name, caption = table.table.name, table.table.caption.partition(". ")[0]
    title = name.replace("-", " ").capitalize()
    return card("fold", key=f"fold-{name}", title=title, summary=caption, tables=[table])


def _listed(name: str, caption: str, values: pd.DataFrame) -> PageTable:
    """Return a table of texts with the columns of a data frame."""
    rows = values.astype(str).to_numpy().tolist()
    return PageTable(text_table(name, caption, [*map(str, values)], rows))


def _worst_frame_criterion(measure: str) -> str:
    """Return the criterion of the worst frame for a measure; see `PageRuns.place`."""
    if measure == "first_loss":
        return "loss"
    return "centre_error" if measure.startswith(("centre_error", "precision")) else "overlap"


def _format_parameters(parameters: str) -> str:
    """Convert parameters from JSON to the text of a specification."""
    return format_text("", json.loads(parameters))[1:] or MISSING
