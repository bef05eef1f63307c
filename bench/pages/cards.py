"""Cards of a report page, built from the runs, tables and frames of an experiment."""

import textwrap
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from itertools import compress
from math import ceil
from operator import itemgetter
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup
from numpy.typing import NDArray

from trackmark.bench.analysis.comparison import (
    Comparison,
    Pair,
    means_of_subset,
    subsets_of,
)
from trackmark.bench.analysis.score_tables import means_by_tracker, ranked_trackers
from trackmark.bench.analysis.times import TIME, fps_text, time_text
from trackmark.bench.pages.content import PageTable, PlayerRun, PlayerSequence, player_link
from trackmark.bench.pages.page import card
from trackmark.bench.pages.player_frames import thumbnail
from trackmark.bench.pages.player_runs import PageRuns
from trackmark.bench.statistics.rules import MIN_UNITS, interval_or_none, star_marks
from trackmark.bench.statistics.units import units_of
from trackmark.reports.charts import Chart, PlayerPosition
from trackmark.reports.printable import one_line
from trackmark.reports.svg import CROWDED, TOP
from trackmark.reports.tables import MISSING, Table

N_SHOWN_SEQUENCES = 12
"""Maximum number of rows of the overlap matrix that are shown at first."""

MAX_ROWS = 12
"""Maximum number of rows of the leaderboard that are not folded."""

N_SHOWN_PUBLISHED = 5
"""Number of the best published trackers that are not folded."""

_PUBLISHED = " (published)"  # end of the labels of published trackers

_MAX_PAIR_ROWS = 12  # pairs that are not folded
_MAX_PAIRED = 12  # trackers whose pairs are all on the page
_MAX_FRAMES = 6  # of worst frames, and of lost and failed runs
_REACH = 20  # frames of a loop before and after its worst frame
_MAX_REASON = 140  # characters


def leaderboard(
    summary: Table,
    runs: PageRuns,
    notes: Mapping[str, str],
    time_marks: Mapping[str, str],
    time_notes: Sequence[str],
    ranking: Comparison | None,
) -> Markup:
    """Return the trackers by mean overlap, among the published trackers of `ranking` if there are.

    Scores and times come from `summary`, the table of means. `notes` gives the text for trackers
    with failed runs. For `time_marks` and `time_notes`, see `bench.analysis.times`. Of the
    published trackers, all but the best are folded.
    """
    success, error, times = (
        means_by_tracker(summary, name)["mean"]
        for name in ("success_rate", "centre_error", TIME.name)
    )
    overlaps = means_by_tracker(summary, "mean_overlap").to_dict("index")
    rows = [
        {
            "tracker": runs.trackers.index(name),
            "label": name,
            "overlap": overlaps[name],
            "success": success[name],
            "error": error[name],
            "time": time_text(times[name], time_marks.get(name, "")),
            "fps": fps_text(times[name]),
            "position": runs.worst_position(name, None, "overlap"),
            "note": notes.get(name, "").partition(" (")[0],
        }
        for name in ranked_trackers(summary)
    ]
    first_rows, folded = rows[:MAX_ROWS], rows[MAX_ROWS:]
    if ranking is not None:
        first_rows, folded = _among_published(rows, ranking)
    return card(
        "leaderboard",
        first_rows=first_rows,
        folded=folded,
        metrics=ranking.measure.title.removeprefix("mean overlap") if ranking else "",
        n_sequences=len(runs.sequences),
        notes=time_notes,
    )


def _among_published(
    rows: Sequence[dict[str, Any]], ranking: Comparison
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Return the first and the folded rows of a leaderboard with published trackers, by rank."""
    row_of = {row["label"]: row for row in rows}
    ranked: list[dict[str, Any]] = []
    for rank, standing in enumerate(ranking.ranked, 1):
        low, high = standing.interval or (np.nan, np.nan)
        row = row_of.pop(standing.tracker, None) or {
            "tracker": None,
            "label": standing.tracker.removesuffix(_PUBLISHED),
            "note": "published",
            "time": MISSING,
            "position": None,
        }
        row["note"] = f"rank {rank}, {row['note']}".removesuffix(", ")
        row["overlap"] = {"mean": standing.mean, "low": low, "high": high}
        row["overlap"]["marked"] = standing.is_unbeaten
        ranked.append(row)
    ranked += row_of.values()  # all runs of these trackers failed
    folded = [
        *[row for row in ranked if row["tracker"] is None][N_SHOWN_PUBLISHED:],
        *[row for row in ranked if row["tracker"] is not None][MAX_ROWS:],
    ]
    return [row for row in ranked if row not in folded], folded


def poster(sequence: PlayerSequence) -> bytes:
    """Return a thumbnail of the target in its first frame; empty without frames."""
    images, first = sequence.images, sequence.first
    if first >= len(images):
        return thumbnail(images[-1]) if images else b""
    return thumbnail(images[first], sequence.boxes[first] / [*sequence.size, *sequence.size])


def _frame_image(
    sequence: PlayerSequence, frame: int, page_runs: Sequence[PlayerRun], labels: Sequence[str]
) -> Markup:
    """Return a frame with the ground-truth box and the boxes of runs."""
    images = sequence.images
    names = ", ".join(one_line(labels[run.tracker]) for run in page_runs)
    return card(
        "frame_image",
        image=images[frame] if frame < len(images) else b"",
        size=sequence.size,
        truth=sequence.boxes[frame],
        boxes=[(run.tracker, run.tracker, run.boxes[frame]) for run in page_runs],
        description=f"{one_line(sequence.name)}, frame {frame}: ground-truth box and boxes of "
        + names,
    )


def _worst_runs(sequence: PlayerSequence, n_trackers: int) -> list[PlayerRun]:
    """Return the worst finished run of each tracker that a crowded picture shows."""
    worst: dict[int, PlayerRun] = {}
    for run in sorted(sequence.one_pass, key=lambda run: -run.severity):
        if not run.failure and (n_trackers <= CROWDED or run.tracker < TOP):
            worst.setdefault(run.tracker, run)
    return [worst[tracker] for tracker in sorted(worst)]


def worst_frames(runs: PageRuns) -> Markup | None:
    """Return the worst frames of the sequences with the lowest overlaps; None without frames.

    Of each sequence, the candidate is the worst frame of a tracker in which the mean overlap of
    all trackers is lowest.
    """
    candidates = []
    for index, sequence in enumerate(runs.sequences):
        worst_runs = _worst_runs(sequence, len(runs.trackers))
        means = pd.DataFrame([run.overlaps for run in worst_runs]).mean()
        if sequence.thumbnails and means.notna().any():
            worst = min(worst_runs, key=lambda run: means[run.worst_frame])
            severity = means[worst.worst_frame], means.mean(), index
            candidates.append((severity, index, worst_runs, worst))
    excerpts = []
    for _, index, worst_runs, worst in sorted(candidates, key=itemgetter(0))[:_MAX_FRAMES]:
        sequence, frame = runs.sequences[index], worst.worst_frame
        excerpts.append(
            {
                "sequence": sequence.name,
                "first": max(sequence.first, frame - _REACH),
                "last": min(sequence.n_frames - 1, frame + _REACH),
                "frame": _frame_image(sequence, frame, worst_runs, runs.labels),
                "overlaps": [
                    (run.tracker, runs.labels[run.tracker], float(run.overlaps[frame]))
                    for run in worst_runs
                ],
                "position": worst.position(index, frame),
            }
        )
    return card("worst_frames", excerpts=excerpts) if excerpts else None


def published_ranking(comparison: Comparison, runs: PageRuns, source: str) -> Markup:
    """Return the trackers of an experiment and published ones, the best mean first."""
    rows = []
    for standing in comparison.ranked:
        name, is_published = standing.tracker, standing.tracker in comparison.published
        rows.append(
            {
                "tracker": None if is_published else runs.trackers.index(name),
                "label": name.removesuffix(_PUBLISHED),
                "mean": standing.mean,
                "interval": standing.interval,
                "position": None if is_published else runs.worst_position(name, None, "overlap"),
            }
        )
    values = {"title": comparison.measure.title, "n_sequences": len(comparison.sequences)}
    return card("ranking", rows=rows, source=source, **values)


def overlap_matrix(
    means: pd.DataFrame,
    mean_of: Mapping[str, float],
    runs: PageRuns,
    note: str = "",
) -> Markup:
    """Return the matrix of mean overlaps: sequences by trackers, and further columns.

    If there are more than `N_SHOWN_SEQUENCES`, the sequences with the lowest overlap come first.
    `mean_of`: means over all sequences by column.
    """
    posters = {sequence.name: poster(sequence) for sequence in runs.sequences}
    names = [str(name) for name in means]
    trackers = {name: index for index, name in enumerate(runs.trackers)}
    if len(means) > N_SHOWN_SEQUENCES:
        difficulty = means[[name for name in names if name in trackers]].fillna(0.0).mean(axis=1)
        means = means.loc[difficulty.sort_values(kind="stable").index]
    rows = [
        {
            "sequence": str(sequence),
            "thumbnail": posters.get(str(sequence), b""),
            "overlaps": overlaps.tolist(),
            "positions": [
                runs.worst_position(name, str(sequence), "overlap") if name in trackers else None
                for name in names
            ],
        }
        for sequence, overlaps in zip(means.index, means[names].to_numpy(float), strict=True)
    ]
    return card(
        "overlap_matrix",
        trackers=[(trackers.get(name), name) for name in names],
        rows=rows,
        means=[mean_of[name] for name in names],
        n_shown=N_SHOWN_SEQUENCES,
        note=note,
    )


def pair_differences(comparison: Comparison, runs: PageRuns, note: str) -> Markup:
    """Return the differences of pairs with their intervals, grouped by the better-ranked tracker.

    If there are many pairs, the first ones are shown and the others are folded.
    """
    ends = [0.0]
    for pair in comparison.pairs:
        ends += [-abs(pair.difference), abs(pair.difference), *(pair.interval or ())]
    high = max(1, ceil(10 * max(map(abs, ends)))) / 10  # the axis is symmetric
    groups: dict[int, list[dict[str, Any]]] = {}
    for pair in comparison.pairs:
        first, second = sorted(map(runs.trackers.index, (pair.first, pair.second)))
        groups.setdefault(first, []).append(_pair_row(comparison, runs, pair, second, high))
    ordered = [
        (first, runs.trackers[first], sorted(groups[first], key=itemgetter("tracker")))
        for first in sorted(groups)
    ]
    first_groups: list[Any] = []
    folded: list[Any] = []
    n_free = _MAX_PAIR_ROWS
    for first, name, rows in ordered:
        n_shown = len(rows) if len(rows) <= n_free else n_free * (not first_groups)
        first_groups += [(first, name, rows[:n_shown])] if n_shown else []
        if rows[n_shown:] and (not folded or len(comparison.scores) <= _MAX_PAIRED):
            folded.append((first, name, rows[n_shown:]))
        n_free = n_free - n_shown if n_shown else 0
    return card(
        "pair_differences",
        shown=first_groups,
        folded=folded,
        n_folded=sum(len(rows) for *_, rows in folded),
        high=high,
        is_decided=len(comparison.units) >= MIN_UNITS,
        note=note,
    )


def _pair_row(
    comparison: Comparison, runs: PageRuns, pair: Pair, second: int, high: float
) -> dict[str, Any]:
    """Return the difference to the tracker `second`; it opens the largest one of a sequence.

    Positions are shares of an axis from `-high` to `high`.
    """
    name = runs.trackers[second]
    sign, label = 1.0, str(pair.decision.label)
    if pair.first == name:
        sign, label = -1.0, {"better": "worse", "worse": "better"}.get(label, label)
    largest = int(np.argmax(np.abs(pair.differences)))
    behind = pair.second if pair.differences[largest] > 0 else pair.first
    interval = pair.interval and sorted(sign * end for end in pair.interval)
    tip = [pair.decision.reason] if pair.decision.reason else []
    if pair.same_boxes:
        tip.append(f"same boxes on {pair.same_boxes} of {len(comparison.sequences)} sequences")
    return {
        "tracker": second,
        "label": name,
        "decision": label if len(comparison.units) >= MIN_UNITS else "",
        "difference": sign * pair.difference,
        "interval": interval,
        "at": [(end + high) / (2 * high) for end in (sign * pair.difference, *(interval or ()))],
        "wins": f"{int((sign * pair.by_unit > 0).sum())} of {len(pair.by_unit)}",
        "tip": "; ".join(tip),
        "position": runs.worst_position(behind, comparison.sequences[largest], "overlap"),
    }


def lost_runs(runs: PageRuns) -> tuple[str, Markup] | None:
    """Return the title and the card of the runs that failed or lost the target, if any."""
    selected = [
        (run.severity, index, run)
        for index, sequence in enumerate(runs.sequences)
        for run in sequence.one_pass
        if run.failure or -run.worst["loss", "online"][0] < sequence.n_frames
    ]
    if not selected:
        return None
    n_failed = sum(bool(run.failure) for *_, run in selected)
    counts = {"failed": n_failed, "lost the target": len(selected) - n_failed}
    counted = " and ".join(f"{n} {verb}" for verb, n in counts.items() if n)
    worst = dict[tuple[int, int], PlayerRun]()  # by tracker and sequence
    for _, index, run in sorted(selected, key=itemgetter(0), reverse=True):
        worst.setdefault((run.tracker, index), run)
    n_before, ordered = Counter[str](), list[tuple[int, PlayerRun]]()
    while worst and len(ordered) < _MAX_FRAMES:
        # One run of each tracker first, if possible each on another sequence.
        tracker, index = min(
            worst,
            key=lambda pair: (n_before[f"tracker {pair[0]}"], n_before[f"sequence {pair[1]}"]),
        )
        n_before.update([f"tracker {tracker}", f"sequence {index}"])
        ordered.append((index, worst.pop((tracker, index))))
    losses = []
    for index, run in ordered:
        frame = run.worst_frame
        failure = textwrap.shorten(run.failure.partition("\n")[0], _MAX_REASON, placeholder=" …")
        losses.append(
            {
                "label": runs.labels[run.tracker],
                "sequence": runs.sequences[index].name,
                "reason": f"failed: {failure}" if run.failure else f"lost at frame {frame}",
                "frame": _frame_image(runs.sequences[index], frame, [run], runs.labels),
                "position": run.position(index, frame),
            }
        )
    n_runs = sum(len(sequence.one_pass) for sequence in runs.sequences)
    title = f"Lost and failed runs: of {n_runs} run{'s' * (n_runs > 1)}, {counted}"
    return title, card("lost_runs", losses=losses)


def subset_means(
    scored: pd.DataFrame, occurring: Mapping[str, set[str]], runs: PageRuns
) -> Markup | None:
    """Return mean overlaps by parameter value and attribute of the sequences; None without any.

    `occurring`: attributes by sequence.
    """
    if "mean_overlap" not in scored or not runs.trackers:
        return None  # no finished run
    sequences = [sequence.name for sequence in runs.sequences]
    units = units_of(sequences)
    masks = subsets_of(sequences, [occurring.get(name, ()) for name in sequences])
    shared = {parameter for (parameter, _), mask in masks.items() if mask.sum() > 1}
    groups = scored.groupby(["tracker", "sequence"])["mean_overlap"]
    means = groups.mean().where(groups.count() == groups.size())
    by_sequence = [
        means.get(name, pd.Series(dtype=float)).reindex(sequences).to_numpy(float)
        for name in runs.trackers
    ]
    rows: list[dict[str, Any]] = []
    for (parameter, value), mask in masks.items():
        if parameter not in shared:
            continue
        members = [name for name, is_member in zip(sequences, mask, strict=True) if is_member]
        by_unit = [means_of_subset(units, values, mask) for values in by_sequence]
        marks = _subset_marks(by_unit)
        cells = [
            _subset_cell(values, runs.worst_position_on(name, members, "overlap"), is_best=is_best)
            for name, values, is_best in zip(runs.trackers, by_unit, marks, strict=True)
        ]
        label = value if parameter == "attribute" else f"{parameter}={value}"
        rows.append({"label": label, "n_sequences": len(members), "cells": cells})
    if not rows:
        return None
    cells = [cell for row in rows for cell in row["cells"]]
    return card(
        "subset_means",
        trackers=[*enumerate(runs.trackers)],
        rows=rows,
        scope=units.scope if any(cell["interval"] for cell in cells) else "",
        has_marks=any(cell["is_best"] for cell in cells),
    )


def _subset_marks(by_unit: Sequence[NDArray[np.float64]]) -> list[bool]:
    """Return which trackers no other is better than; none if no tracker is better than another.

    `by_unit`: mean overlaps of each tracker, shape (n_units,). Trackers without a mean get no mark.
    """
    is_complete = [bool(np.isfinite(values).all()) for values in by_unit]
    marks = iter(
        star_marks([*compress(by_unit, is_complete)], limit=1.0) if any(is_complete) else []
    )
    marked = [complete and next(marks) for complete in is_complete]
    return [mark and sum(marked) < sum(is_complete) for mark in marked]


def _subset_cell(
    by_unit: NDArray[np.float64], position: PlayerPosition | None, *, is_best: bool
) -> dict[str, Any]:
    """Return the mean of a tracker over a subset, with its interval if there are enough units."""
    mean = float(by_unit.mean()) if len(by_unit) else np.nan
    if not np.isfinite(mean):
        return {"text": MISSING, "interval": "", "position": None, "is_best": False}
    limits = interval_or_none(by_unit, 1, 0.0, 1.0)
    interval = f"[{limits[0]:.3f}, {limits[1]:.3f}]" if limits else ""
    return {
        "text": f"{mean:.3f}",
        "interval": interval,
        "position": position,
        "is_best": is_best,
    }


def sequence_folds(
    runs: PageRuns,
    charts: Mapping[str, Chart],
    means: pd.DataFrame,
    scores: PageTable | None,
    ranking: Comparison | None,
) -> Iterator[Markup]:
    """Yield the folded scores of each sequence.

    A fold has the chart of the sequence from `charts`, the row of the sequence in `means`, which
    are mean overlaps by tracker, and its rows in `scores`, the table of every sequence. It also
    lists the scores of all published trackers of `ranking`, if there are.
    """
    for index, sequence in enumerate(runs.sequences):
        name = sequence.name
        row = means.loc[name] if name in means.index else pd.Series(dtype=float)
        summary = f"{sequence.n_frames} frames"
        if row.notna().any():
            summary = f"highest: {row.idxmax()}, {row.max():.2f}"
        yield card(
            "sequence_fold",
            key=f"sequence-{index}",
            sequence=sequence,
            summary=summary,
            means=[(runs.trackers.index(tracker), tracker, mean) for tracker, mean in row.items()],
            chart=charts.get(name),
            scores=_rows_of(scores, name, index) if scores else None,
            poster=poster(sequence) if len(runs.sequences) <= N_SHOWN_SEQUENCES else b"",
            link=player_link(sequence),
            published=_published_scores(ranking, name) if ranking else "",
        )


def _published_scores(ranking: Comparison, sequence: str) -> str:
    """Return the scores of all published trackers on a sequence in words, the best first."""
    index = list(ranking.sequences).index(sequence) if sequence in ranking.sequences else None
    if index is None:
        return ""
    scores = pd.Series({name: ranking.scores[name][index].mean() for name in ranking.published})
    ranked = scores.sort_values(ascending=ranking.measure.sign < 0, kind="stable")
    listed = ", ".join(f"{name} {value:.2f}" for name, value in ranked.items())
    return f"Published: {listed.replace(_PUBLISHED, '')}."


def _rows_of(scores: PageTable, sequence: str, index: int) -> PageTable | None:
    """Return the rows of a sequence in the table of every sequence."""
    table = scores.table
    selected = [i for i, row in enumerate(table.rows) if row[0].text == sequence]
    if not selected or table.n_labels < 2:
        return None
    caption = (
        "Metrics `native`: mean over repetitions, ± standard deviation, linked to worst frames."
    )
    rows = [table.rows[i][1:] for i in selected]
    scores_of_sequence = Table(
        f"scores-{index}", caption, table.headings[1:], table.n_labels - 1, rows
    )
    return PageTable(
        scores_of_sequence, [scores.positions[i] for i in selected] if scores.positions else ()
    )
