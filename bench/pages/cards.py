"""Cards of a report page, built from the runs, tables and frames of an experiment."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain
from math import isfinite

import numpy as np

from trackmark.bench.comparing.comparison import Comparison, Pair
from trackmark.bench.pages.player_runs import PageRun, PageRuns, SequenceRuns
from trackmark.bench.statistics.rules import MIN_UNITS
from trackmark.reports.page.cards import (
    FailureCard,
    Failures,
    HeatRow,
    HeatTable,
    Leaderboard,
    LeaderRow,
    Loop,
    Loops,
    PairCell,
    PairMatrix,
    SequenceFold,
    Still,
)
from trackmark.reports.page.content import (
    Chart,
    Page,
    PageTable,
    PlayerPosition,
    PlayerScene,
)
from trackmark.reports.page.film import thumbnail
from trackmark.reports.page.svg import CROWDED, TOP
from trackmark.reports.printable import one_line
from trackmark.reports.tables import MISSING, Table

SHOWN_SEQUENCES = 12
"""Maximum number of rows of a heat map that are shown at first."""

_MAX_CARDS = 6  # loops, and cards of failed runs
_REACH = 20  # frames of a loop before and after its hardest moment
_MAX_REASON = 140  # characters


def leaderboard(summary: Table, runs: PageRuns, notes: Mapping[str, str]) -> Leaderboard:
    """Return the trackers by mean overlap.

    `summary`: table of means. `notes`: notes on failed runs by tracker.
    """
    rows = []
    approximately = "~" if any(head.startswith("~") for head in summary.heads) else ""
    for tracker, data in summary.data.groupby("tracker", sort=False, observed=True):
        by_measure = {str(row["measure"]): row for row in data.to_dict("records")}
        overlap = by_measure["mean_overlap"]
        low, high = overlap["low"], overlap["high"]
        success, error, time = (
            by_measure.get(name, {}).get("mean", np.nan)
            for name in ("success_share", "centre_error", "milliseconds")
        )
        row = LeaderRow(
            runs.trackers.index(str(tracker)) if tracker in runs.trackers else len(runs.trackers),
            str(tracker),
            overlap["mean"],
            (low, high) if isfinite(low) else None,
            f"{100 * success:.0f} %" if isfinite(success) else MISSING,
            f"{error:.1f} px" if isfinite(error) else MISSING,
            f"{approximately}{_time(time)}" if isfinite(time) else MISSING,
            runs.place(str(tracker), None, "overlap"),
            notes.get(str(tracker), "").partition(" (")[0],
            bool(overlap["marked"]),
        )
        rows.append(row)
    if all(row.marked for row in rows):
        rows = [replace(row, marked=False) for row in rows]
    rows.sort(key=lambda row: -row.mean if isfinite(row.mean) else np.inf)
    n = len(runs.stages)
    return Leaderboard(rows, f"{n} sequence{'s' * (n != 1)}")


def _time(milliseconds: float) -> str:
    """Return a time with two digits."""
    factor, unit = (1e3, "µs") if milliseconds < 0.1 else (1.0, "ms")
    return f"{float(f'{factor * milliseconds:.2g}'):g} {unit}"


def _shortened(text: str) -> str:
    return text if len(text) <= _MAX_REASON else f"{text[:_MAX_REASON]}…"


def _frames(scene: PlayerScene) -> list[bytes]:
    return [*chain(*scene.thumbnails)]


def poster(scene: PlayerScene) -> bytes:
    """Return a thumbnail of the first frame with the target; empty without frames."""
    frames = _frames(scene)
    return thumbnail(frames[min(scene.first, len(frames) - 1)]) if frames else b""


def _still(
    scene: PlayerScene, frame: int, clips: Sequence[PageRun], labels: Sequence[str]
) -> Still:
    """Return a frame with the true box and the boxes of runs."""
    frames, truth = _frames(scene), scene.boxes[frame]
    boxes = [(clip.take.tracker, clip.take.boxes[frame]) for clip in clips]
    named = ", ".join(one_line(labels[clip.take.tracker]) for clip in clips)
    return Still(
        frames[frame] if frame < len(frames) else b"",
        scene.size,
        truth.tolist() if np.isfinite(truth).all() else None,
        [(index, index, box.tolist()) for index, box in boxes if np.isfinite(box).all()],
        f"{one_line(scene.name)}, frame {frame}: true box and boxes of {named}",
    )


def _first_clips(stage: SequenceRuns, n_trackers: int) -> list[PageRun]:
    """Return the first finished run of each tracker that a crowded picture shows."""
    first: dict[int, PageRun] = {}
    for clip in sorted(stage.clips, key=lambda clip: clip.take.repetition):
        if not clip.take.failure and (n_trackers <= CROWDED or clip.take.tracker < TOP):
            first.setdefault(clip.take.tracker, clip)
    return [first[tracker] for tracker in sorted(first)]


def hardest_moments(runs: PageRuns, filmed: Sequence[PlayerScene]) -> Loops | None:
    """Return the frame with the lowest mean overlap of each sequence, the lowest first."""
    moments = []
    for number, (stage, scene) in enumerate(zip(runs.stages, filmed, strict=True)):
        clips = _first_clips(stage, len(runs.trackers))
        if not clips or not scene.thumbnails:
            continue
        overlaps = np.array([clip.overlaps for clip in clips])
        judged = np.isfinite(overlaps).any(axis=0)
        if judged.any():
            means = np.full(overlaps.shape[1], np.inf)
            means[judged] = np.nanmean(overlaps[:, judged], axis=0)
            frame = int(np.argmin(means))
            moments.append((float(means[frame]), float(means[judged].mean()), number, frame))
    loops = []
    for _, _, number, frame in sorted(moments)[:_MAX_CARDS]:
        stage, scene = runs.stages[number], filmed[number]
        clips = _first_clips(stage, len(runs.trackers))
        worst = min(clips, key=lambda clip: np.nan_to_num(clip.overlaps[frame], nan=np.inf))
        loops.append(
            Loop(
                number,
                stage.name,
                frame,
                max(scene.first, frame - _REACH),
                min(scene.frames - 1, frame + _REACH),
                _still(scene, frame, clips, runs.labels),
                [
                    (clip.take.tracker, runs.labels[clip.take.tracker], _two(clip.overlaps[frame]))
                    for clip in clips
                ],
                PlayerPosition(number, worst.take.tracker, worst.take.repetition, frame),
            )
        )
    return Loops(loops) if loops else None


def _two(value: float) -> str:
    return f"{value:.2f}" if isfinite(value) else MISSING


def heat_table(grid: PageTable, runs: PageRuns, filmed: Sequence[PlayerScene]) -> HeatTable:
    """Return the heat map; many sequences are sorted by their mean overlap, hardest first."""
    values = np.array(grid.values, float).reshape(len(grid.table.rows), -1)
    names = grid.table.heads[1:]
    trackers = [(runs.trackers.index(name) if name in runs.trackers else 0, name) for name in names]
    posters = {scene.name: poster(scene) for scene in filmed}
    order = np.arange(len(values))
    if len(values) > SHOWN_SEQUENCES:
        order = np.argsort(np.nan_to_num(values, nan=0.0).mean(axis=1), kind="stable")
    rows = []
    for number in order.tolist():
        name = grid.table.rows[number][0].text
        image = posters.get(name, b"")
        rows.append(HeatRow(name, image, values[number].tolist(), grid.places[number]))
    means = values.mean(axis=0).tolist() if len(values) else []
    return HeatTable(trackers, rows, means, SHOWN_SEQUENCES)


def pair_matrix(
    comparison: Comparison, runs: PageRuns, places: Mapping[str, PlayerPosition | None], note: str
) -> PairMatrix:
    """Return the answers on all pairs, best tracker first.

    `places`: frames that the pairs open, by label.
    """
    pairs = {(pair.first, pair.second): pair for pair in comparison.pairs}
    names = sorted(
        comparison.scores,
        key=lambda name: -next(s.mean for s in comparison.standings if s.tracker == name),
    )
    rows = [[_pair_cell(comparison, pairs, a, b, places) for b in names] for a in names]
    trackers = [(runs.trackers.index(name), name) for name in names]
    return PairMatrix(trackers, rows, note)


def _pair_cell(
    comparison: Comparison,
    pairs: Mapping[tuple[str, str], Pair],
    first: str,
    second: str,
    places: Mapping[str, PlayerPosition | None],
) -> PairCell | None:
    if first == second:
        return None
    turned = (first, second) not in pairs
    pair = pairs[(second, first) if turned else (first, second)]
    sign = -1.0 if turned else 1.0
    label = str(pair.answer.label)
    if turned:
        label = {"better": "worse", "worse": "better"}.get(label, label)
    difference, won = sign * pair.difference, int((sign * pair.by_unit > 0).sum())
    lost = int((sign * pair.by_unit < 0).sum())
    tip = f"{one_line(first)} minus {one_line(second)}: {difference:+.3f}"
    if pair.interval is not None:
        ends = sorted(sign * end for end in pair.interval)
        tip += " [{:+.3f}, {:+.3f}]".format(*ends)
    tip += f"; {pair.answer.reason}" if pair.answer.reason else ""
    if pair.same_boxes:
        tip += f"; same boxes on {pair.same_boxes} of {len(comparison.sequences)} sequences"
    answer = label if len(comparison.units) >= MIN_UNITS else ""
    return PairCell(answer, difference, won, lost, tip, places.get(pair.label))


def failures(runs: PageRuns, filmed: Sequence[PlayerScene]) -> tuple[str, Failures] | None:
    """Return the title and the cards of the runs that stopped or lost the target."""
    failed, n_runs = [], 0
    for number, stage in enumerate(runs.stages):
        for clip in stage.clips:
            n_runs += 1
            first = -clip.worst["loss", "online"][0]
            if clip.take.failure or first < len(stage.truth):
                frame = clip.end if clip.take.failure else int(first)
                failed.append((not clip.take.failure, frame, number, clip))
    if not failed:
        return None
    lost = sum(is_lost for is_lost, *_ in failed)
    counts = [
        f"{n} {verb}"
        for n, verb in ((len(failed) - lost, "stopped"), (lost, "lost the target"))
        if n
    ]
    title = f"Failures: of {n_runs} runs, {' and '.join(counts)}"
    cards = dict[tuple[int, int], FailureCard]()
    for is_lost, frame, number, clip in sorted(failed, key=lambda entry: entry[:3]):
        key, scene, name = (number, clip.take.tracker), filmed[number], runs.stages[number].name
        if key in cards or len(cards) == _MAX_CARDS:
            continue
        reason = _shortened(clip.take.failure.partition("\n")[0])
        text = f"lost at frame {frame}" if is_lost else f"stopped: {reason}"
        place = PlayerPosition(number, clip.take.tracker, clip.take.repetition, frame)
        still = _still(scene, frame, [clip], runs.labels)
        cards[key] = FailureCard(
            clip.take.tracker, runs.labels[clip.take.tracker], name, text, still, place
        )
    return title, Failures([*cards.values()])


def sequence_folds(
    runs: PageRuns,
    filmed: Sequence[PlayerScene],
    charts: Mapping[str, Chart],
    means: Mapping[str, Mapping[str, float]],
    sheet: PageTable | None,
    page: Page,
) -> Iterator[SequenceFold]:
    """Yield the folded scores of each sequence.

    `charts`: overlap by frame, by sequence. `means`: mean overlap by sequence and tracker. `sheet`:
    table of every sequence. `page`: gives the addresses of the sequences.
    """
    for number, (stage, scene) in enumerate(zip(runs.stages, filmed, strict=True)):
        by_tracker = means.get(stage.name, {})
        finite = {name: mean for name, mean in by_tracker.items() if isfinite(mean)}
        result = f"{scene.frames} frames"
        if finite:
            highest = max(finite, key=lambda name: finite[name])
            result = f"highest: {highest}, {finite[highest]:.2f}"
        yield SequenceFold(
            f"sequence-{number}",
            stage.name,
            poster(scene) if len(runs.stages) <= SHOWN_SEQUENCES else b"",
            result,
            [
                (runs.trackers.index(name), name, mean)
                for name, mean in by_tracker.items()
                if name in runs.trackers
            ],
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
    rows = [table.rows[i][1:] for i in chosen]
    part = Table(
        f"scores-{number}",
        "Mean over repetitions, ± standard deviation. A number opens its worst frame.",
        table.heads[1:],
        table.n_labels - 1,
        rows,
    )
    values, places = sheet.values, sheet.places
    return PageTable(
        part,
        [values[i] for i in chosen] if len(values) else [],
        [places[i] for i in chosen] if places else [],
    )
