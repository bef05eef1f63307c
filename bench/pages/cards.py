"""Cards of a report page, built from the runs, tables and frames of an experiment."""

import textwrap
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import isfinite
from operator import itemgetter

import numpy as np
import pandas as pd

from trackmark.bench.analysis.comparison import Comparison, Pair
from trackmark.bench.analysis.run_summary import means_by_tracker
from trackmark.bench.analysis.times import TIME, fps_text, time_text
from trackmark.bench.pages.card_types import (
    FailureCard,
    HeatRow,
    HeatTable,
    Leaderboard,
    LeaderRow,
    Loop,
    PairCell,
    PairMatrix,
    SequenceFold,
    Still,
)
from trackmark.bench.pages.content import Page, PageTable, PlayerScene
from trackmark.bench.pages.player_frames import thumbnail
from trackmark.bench.pages.player_runs import PageRun, PageRuns, SequenceRuns
from trackmark.bench.statistics.rules import MIN_UNITS
from trackmark.reports.charts import Chart, PlayerPosition
from trackmark.reports.printable import one_line
from trackmark.reports.svg import CROWDED, TOP
from trackmark.reports.tables import MISSING, Table

SHOWN_SEQUENCES = 12
"""Maximum number of rows of a heat map that are shown at first."""

_MAX_CARDS = 6  # loops, and cards of failed runs
_REACH = 20  # frames of a loop before and after its hardest moment
_MAX_REASON = 140  # characters


def leaderboard(
    summary: Table,
    runs: PageRuns,
    notes: Mapping[str, str],
    time_mark: str,
    time_notes: Sequence[str],
) -> Leaderboard:
    """Return the trackers by mean overlap.

    Scores and times come from `summary`, the table of means. `notes` gives the text for trackers
    with failed runs. For `time_mark` and `time_notes`, see `bench.analysis.times`.
    """
    rows = []
    for tracker, measures in means_by_tracker(summary).items():
        overlap = measures["mean_overlap"]
        success, error, time = (
            measures.get(name, {}).get("mean", np.nan)
            for name in ("success_share", "centre_error", TIME.name)
        )
        row = LeaderRow(
            runs.trackers.index(tracker),
            tracker,
            overlap["mean"],
            (overlap["low"], overlap["high"]) if isfinite(overlap["low"]) else None,
            f"{100 * success:.0f} %" if isfinite(success) else MISSING,
            f"{error:.1f} px" if isfinite(error) else MISSING,
            time_text(time, time_mark),
            fps_text(time),
            runs.place(tracker, None, "overlap"),
            notes.get(tracker, "").partition(" (")[0],
            bool(overlap["marked"]),
        )
        rows.append(row)
    if all(row.marked for row in rows):
        rows = [replace(row, marked=False) for row in rows]
    rows.sort(key=lambda row: -row.mean if isfinite(row.mean) else np.inf)
    n = len(runs.stages)
    return Leaderboard(rows, f"{n} sequence{'s' * (n != 1)}", time_notes)


def poster(scene: PlayerScene) -> bytes:
    """Return a thumbnail of the first frame with the target; empty without frames."""
    return thumbnail(scene.images[min(scene.first, len(scene.images) - 1)]) if scene.images else b""


def _still(
    scene: PlayerScene, frame: int, clips: Sequence[PageRun], labels: Sequence[str]
) -> Still:
    """Return a frame with the true box and the boxes of runs."""
    frames, truth = scene.images, scene.boxes[frame]
    boxes = [(clip.take.tracker, clip.take.boxes[frame]) for clip in clips]
    named = ", ".join(one_line(labels[clip.take.tracker]) for clip in clips)
    return Still(
        frames[frame] if frame < len(frames) else b"",
        scene.size,
        truth.tolist() if np.isfinite(truth).all() else None,
        [(index, index, box.tolist()) for index, box in boxes if np.isfinite(box).all()],
        f"{one_line(scene.name)}, frame {frame}: true box and boxes of {named}",
    )


def _worst_clips(stage: SequenceRuns, n_trackers: int) -> list[PageRun]:
    """Return the worst finished run of each tracker that a crowded picture shows."""
    worst: dict[int, PageRun] = {}
    for clip in sorted(stage.clips, key=lambda clip: -clip.worst["overlap", "online"][0]):
        if not clip.take.failure and (n_trackers <= CROWDED or clip.take.tracker < TOP):
            worst.setdefault(clip.take.tracker, clip)
    return [worst[tracker] for tracker in sorted(worst)]


def hardest_moments(runs: PageRuns, filmed: Sequence[PlayerScene]) -> list[Loop]:
    """Return for each sequence the worst frame of a tracker with the lowest mean overlap."""
    moments = []
    for number, (stage, scene) in enumerate(zip(runs.stages, filmed, strict=True)):
        clips = _worst_clips(stage, len(runs.trackers))
        means = pd.DataFrame([clip.overlaps for clip in clips]).mean()
        if scene.thumbnails and means.notna().any():
            worst = min(clips, key=lambda clip: means[clip.worst["overlap", "online"][1]])
            frame = worst.worst["overlap", "online"][1]
            moments.append((means[frame], means.mean(), number, frame, clips, worst.take))
    loops = []
    for *_, number, frame, clips, take in sorted(moments, key=itemgetter(0, 1, 2))[:_MAX_CARDS]:
        scene = filmed[number]
        chips = [
            (clip.take.tracker, runs.labels[clip.take.tracker], float(clip.overlaps[frame]))
            for clip in clips
        ]
        loops.append(
            Loop(
                runs.stages[number].name,
                max(scene.first, frame - _REACH),
                min(scene.frames - 1, frame + _REACH),
                _still(scene, frame, clips, runs.labels),
                chips,
                PlayerPosition(number, take.tracker, take.repetition, frame),
            )
        )
    return loops


def heat_table(
    means: pd.DataFrame, summary: Table, runs: PageRuns, filmed: Sequence[PlayerScene]
) -> HeatTable:
    """Return the heat map, best tracker first; many sequences are sorted, hardest first.

    `means`: by sequence and tracker. `summary`: table of means over all sequences.
    """
    posters = {scene.name: poster(scene) for scene in filmed}
    if len(means) > SHOWN_SEQUENCES:
        means = means.loc[means.fillna(0.0).mean(axis=1).sort_values(kind="stable").index]
    overall = means_by_tracker(summary)
    mean_of = {name: float(overall[name]["mean_overlap"]["mean"]) for name in map(str, means)}
    names = sorted(mean_of, key=lambda name: -mean_of[name] if isfinite(mean_of[name]) else np.inf)
    rows = [
        HeatRow(
            str(sequence),
            posters.get(str(sequence), b""),
            values.tolist(),
            [runs.place(name, str(sequence), "overlap") for name in names],
        )
        for sequence, values in zip(means.index, means[names].to_numpy(float), strict=True)
    ]
    trackers = [(runs.trackers.index(name), name) for name in names]
    return HeatTable(trackers, rows, [mean_of[name] for name in names], SHOWN_SEQUENCES)


def pair_matrix(comparison: Comparison, runs: PageRuns, note: str) -> PairMatrix:
    """Return the answers on all pairs, best tracker first."""
    pairs = {(pair.first, pair.second): pair for pair in comparison.pairs}
    means = {standing.tracker: standing.mean for standing in comparison.standings}
    names = sorted(comparison.scores, key=lambda name: -means[name])
    rows = [[_pair_cell(comparison, runs, pairs, a, b) for b in names] for a in names]
    return PairMatrix([(runs.trackers.index(name), name) for name in names], rows, note)


def _pair_cell(
    comparison: Comparison,
    runs: PageRuns,
    pairs: Mapping[tuple[str, str], Pair],
    first: str,
    second: str,
) -> PairCell | None:
    """Return the answer on a pair; it opens the sequence with the largest difference."""
    if first == second:
        return None
    turned = (first, second) not in pairs
    pair = pairs[(second, first) if turned else (first, second)]
    sign, label = 1.0, str(pair.answer.label)
    if turned:
        sign, label = -1.0, {"better": "worse", "worse": "better"}.get(label, label)
    by_unit, position = sign * pair.by_unit, int(np.argmax(np.abs(pair.differences)))
    behind = pair.second if pair.differences[position] > 0 else pair.first
    place = runs.place(behind, comparison.sequences[position], "overlap")
    difference = sign * pair.difference
    tip = f"{one_line(first)} minus {one_line(second)}: {difference:+.3f}"
    if pair.interval is not None:
        tip += " [{:+.3f}, {:+.3f}]".format(*sorted(sign * end for end in pair.interval))
    tip += f"; {pair.answer.reason}" if pair.answer.reason else ""
    if pair.same_boxes:
        tip += f"; same boxes on {pair.same_boxes} of {len(comparison.sequences)} sequences"
    answer = label if len(comparison.units) >= MIN_UNITS else ""
    won, lost = int((by_unit > 0).sum()), int((by_unit < 0).sum())
    return PairCell(answer, difference, won, lost, tip, place)


def failures(runs: PageRuns, filmed: Sequence[PlayerScene]) -> tuple[str, list[FailureCard]] | None:
    """Return the title and the cards of the runs that stopped or lost the target."""
    failed = [
        (clip.worst["overlap", "online"][0], number, clip)
        for number, stage in enumerate(runs.stages)
        for clip in stage.clips
        if clip.take.failure or -clip.worst["loss", "online"][0] < len(stage.truth)
    ]
    if not failed:
        return None
    stopped = sum(bool(clip.take.failure) for *_, clip in failed)
    counts = {"stopped": stopped, "lost the target": len(failed) - stopped}
    parts = " and ".join(f"{n} {verb}" for verb, n in counts.items() if n)
    worst = dict[tuple[int, int], PageRun]()  # by tracker and sequence
    for _, number, clip in sorted(failed, key=itemgetter(0), reverse=True):
        worst.setdefault((clip.take.tracker, number), clip)
    turns, cards = Counter[int](), []
    for (tracker, number), clip in worst.items():
        take, frame = clip.take, clip.worst["overlap", "online"][1]
        reason = textwrap.shorten(take.failure.partition("\n")[0], _MAX_REASON, placeholder=" …")
        card = FailureCard(
            runs.labels[tracker],
            runs.stages[number].name,
            f"stopped: {reason}" if take.failure else f"lost at frame {frame}",
            _still(filmed[number], frame, [clip], runs.labels),
            PlayerPosition(number, tracker, take.repetition, frame),
        )
        cards.append((turns[tracker], card))  # one run of each tracker first
        turns[tracker] += 1
    cards.sort(key=itemgetter(0))
    n_runs = sum(len(stage.clips) for stage in runs.stages)
    title = f"Failures: of {n_runs} run{'s' * (n_runs > 1)}, {parts}"
    return title, [card for _, card in cards[:_MAX_CARDS]]


def sequence_folds(
    runs: PageRuns,
    filmed: Sequence[PlayerScene],
    charts: Mapping[str, Chart],
    means: pd.DataFrame,
    sheet: PageTable | None,
    page: Page,
) -> Iterator[SequenceFold]:
    """Yield the folded scores of each sequence.

    `charts`: overlap by frame, by sequence. `means`: mean overlap by sequence and tracker. `sheet`:
    table of every sequence. `page`: gives the addresses of the sequences.
    """
    for number, (stage, scene) in enumerate(zip(runs.stages, filmed, strict=True)):
        row = means.loc[stage.name] if stage.name in means.index else pd.Series(dtype=float)
        values = {str(tracker): float(mean) for tracker, mean in row.to_dict().items()}
        result = f"{scene.frames} frames"
        if row.notna().any():
            result = f"highest: {row.idxmax()}, {row.max():.2f}"
        yield SequenceFold(
            f"sequence-{number}",
            stage.name,
            poster(scene) if len(runs.stages) <= SHOWN_SEQUENCES else b"",
            result,
            [(runs.trackers.index(k), k, v) for k, v in values.items()],
            charts.get(stage.name),
            _rows_of(sheet, stage.name, number) if sheet else None,
            page.opening(scene),
            scene.why,
        )


def _rows_of(sheet: PageTable, sequence: str, number: int) -> PageTable | None:
    """Return the rows of a sequence in the table of every sequence."""
    table = sheet.table
    chosen = [i for i, row in enumerate(table.rows) if row[0].text == sequence]
    if not chosen or table.n_labels < 2:
        return None
    caption = "Mean over repetitions, ± standard deviation. A number opens its worst frame."
    rows = [table.rows[i][1:] for i in chosen]
    part = Table(f"scores-{number}", caption, table.heads[1:], table.n_labels - 1, rows)
    return PageTable(part, places=[sheet.places[i] for i in chosen] if sheet.places else ())
