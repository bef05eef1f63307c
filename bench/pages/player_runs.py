"""Stored runs for pages: boxes for the player, worst frames, and curves for charts."""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf
from operator import itemgetter
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.analysis.outlines import is_round
from trackmark.bench.evaluation.ground_truth import select_ground_truth
from trackmark.bench.evaluation.run_record import Run, Trajectory
from trackmark.bench.evaluation.scoring import REVISED
from trackmark.bench.metrics.boxes import centre_error, overlap
from trackmark.bench.metrics.interface import FrameState
from trackmark.bench.pages.content import PlayerRun, PlayerSequence
from trackmark.bench.pages.page_frames import (
    THUMBNAIL,
    ChunkWriter,
    Progress,
    SequenceFrames,
    encode_frames,
)
from trackmark.bench.pages.player_layers import maps, shapes, tracker_values, true_shapes
from trackmark.bench.protocols import ONE_PASS
from trackmark.bench.store.runs import RunWithTruth
from trackmark.bench.store.truth import StoredTruth
from trackmark.reports.charts import PlayerPosition

_SUPERVISION = {
    FrameState.SKIPPED: "skipped",
    FrameState.INITIALISED: "initialised with the ground-truth box",
    FrameState.FAILED: "failed",
}
"""Labels of the states of frames in supervised runs, except tracking."""

OVERLAPS = np.linspace(0.0, 1.0, 51)
ERRORS = np.linspace(0.0, 50.0, 51)
"""Thresholds of success [overlap] and precision [px]."""

Array: TypeAlias = NDArray[np.float64]
Frames: TypeAlias = NDArray[np.int64]


class ThresholdShares(NamedTuple):
    """Share of frames by threshold, and the frame nearest to each threshold; fields are (k,)."""

    shares: Array
    distances: Array  # difference between the value of this frame and the threshold
    frames: Frames


@dataclass(frozen=True)
class PageRun:
    """Run or segment of a run with its scores by frame."""

    player_run: PlayerRun
    end: int  # last frame with a box
    overlaps: NDArray[np.float32]  # (n,); NaN if the frame is not scored
    shares: Mapping[str, ThresholdShares]  # `success` and `precision` of finished one-pass runs
    worst: Mapping[tuple[str, Trajectory], tuple[float, int]]  # severity and frame, see `_worst`

    @property
    def tracker(self) -> int:
        """Index of the tracker."""
        return self.player_run.tracker

    @property
    def failure(self) -> str:
        """Reason of a failed run."""
        return self.player_run.failure

    @property
    def severity(self) -> float:
        """Negative mean overlap of the online boxes; infinite for failed runs."""
        return self.worst["overlap", "online"][0]

    @property
    def worst_frame(self) -> int:
        """Frame in which the target was lost, or else that of the lowest overlap."""
        return self.worst["overlap", "online"][1]

    def position(self, sequence: int, frame: int) -> PlayerPosition:
        """Return the position of a frame of this run on the sequence with an index."""
        run = self.player_run
        return PlayerPosition(sequence, run.tracker, run.repetition, frame, run.start)


@dataclass
class SequenceRuns:
    """Runs on a sequence; `truth` contains the ground-truth boxes by which they are scored."""

    row: Mapping[str, Any]
    full_truth: StoredTruth
    truth: Array
    one_pass: list[PageRun] = field(default_factory=list)
    other_runs: list[PageRun] = field(default_factory=list)  # by other protocols

    @property
    def name(self) -> str:
        """Name of the sequence."""
        return str(self.row["sequence"])

    def one_pass_of(self, tracker: int) -> list[PageRun]:
        """Return the one-pass runs of a tracker."""
        return [run for run in self.one_pass if run.tracker == tracker]


@dataclass(frozen=True)
class PageRuns:
    """Scored runs of an experiment."""

    trackers: Sequence[str]  # of one-pass runs
    labels: Sequence[str]  # trackers, then labels of runs by other protocols: `name_on_page`
    sequences: Sequence[SequenceRuns]
    metadata: Sequence[Mapping[str, Any]]  # of all runs, without repetitions

    def worst_position(
        self, tracker: str, sequence: str | None, criterion: str, trajectory: Trajectory = "online"
    ) -> PlayerPosition | None:
        """Return the worst frame of a tracker's worst run on one sequence or on all.

        The tracker is one of `labels`, and the criterion `overlap`, `centre_error` or `loss`. For
        runs without revised boxes, the trajectory `online` replaces `revised`.
        """
        names = [runs.name for runs in self.sequences] if sequence is None else [sequence]
        return self.worst_position_on(tracker, names, criterion, trajectory)

    def worst_position_on(
        self,
        tracker: str,
        sequences: Sequence[str],
        criterion: str,
        trajectory: Trajectory = "online",
    ) -> PlayerPosition | None:
        """Return the worst frame of a tracker's worst run on several sequences."""
        for source in (trajectory, "online"):
            worst = [self._worst.get((tracker, name, criterion, source)) for name in sequences]
            if any(worst):
                return max(filter(None, worst), key=itemgetter(0))[1]
        return None

    @cached_property
    def _worst(self) -> dict[tuple[str, str, str, Trajectory], tuple[float, PlayerPosition]]:
        """Severity and worst frame of the worst run.

        Keys are label of the tracker, sequence, criterion and trajectory.
        """
        worst: dict[tuple[str, str, str, Trajectory], tuple[float, PlayerPosition]] = {}
        for index, sequence_runs in enumerate(self.sequences):
            for run in (*sequence_runs.one_pass, *sequence_runs.other_runs):
                for (criterion, trajectory), (severity, frame) in run.worst.items():
                    key = self.labels[run.tracker], sequence_runs.name, criterion, trajectory
                    if key not in worst or severity > worst[key][0]:
                        position = run.position(index, frame)
                        worst[key] = severity, position._replace(revised=trajectory == "revised")
        return worst


def name_on_page(tracker: str, protocol: str) -> str:
    """Return the label of a tracker's runs by a protocol."""
    return tracker if protocol == ONE_PASS else f"{tracker} ({protocol})"


def collect_runs(
    runs: Iterable[RunWithTruth], trackers: Sequence[str], with_tracker_values: bool = False
) -> PageRuns:
    """Compute what a page shows of each run: its boxes, its scores by frame, its worst frame.

    Trackers are coloured in the order of `trackers`; those that are not listed come last.
    """
    names, other_runs = list(trackers), list[tuple[Mapping[str, Any], Run]]()
    by_sequence: dict[str, SequenceRuns] = {}
    metadata: dict[str, Mapping[str, Any]] = {}
    for row, run, full_truth in runs:
        truth = np.asarray(
            select_ground_truth(full_truth, run.identity.init, row["sequence"]).boxes
        )
        sequence_runs = by_sequence.setdefault(
            row["sequence"], SequenceRuns(row, full_truth, truth)
        )
        if row["fingerprint"] != sequence_runs.row["fingerprint"]:
            continue  # the run is stale: the sequence has changed since; tables report it
        if row["protocol"] == ONE_PASS:
            if row["tracker"] not in names:
                names.append(row["tracker"])
            tracker_index = names.index(row["tracker"])
            sequence_runs.one_pass.append(
                _page_run(truth, _Segment(run), row, tracker_index, with_tracker_values)
            )
        else:
            other_runs.append((row, run))
        environment = {key: run.metadata.get(key) for key in ("host", "platform", "python")}
        environment |= {"libraries": run.metadata.get("libraries") or {}}
        environment |= {"date": str(run.metadata.get("date", ""))[:10]}
        metadata[json.dumps(environment, sort_keys=True, default=str)] = environment
    labels = list(names)
    for row, run in other_runs:
        name = name_on_page(row["tracker"], row["protocol"])
        if name not in labels:
            labels.append(name)
        sequence_runs, tracker_index = by_sequence[row["sequence"]], labels.index(name)
        if run.segments:
            segments = _split_segments(run, sequence_runs.truth)
            sequence_runs.other_runs += [
                _page_run(sequence_runs.truth, segment, row, tracker_index, False)
                for segment in segments
            ]
        else:
            segment = _from_other_protocol(run, sequence_runs.truth)
            sequence_runs.other_runs.append(
                _page_run(sequence_runs.truth, segment, row, tracker_index, with_tracker_values)
            )
    return PageRuns(names, labels, list(by_sequence.values()), list(metadata.values()))


def _present(boxes: Array) -> NDArray[np.bool_]:
    """Return for each frame whether there is a box."""
    return np.asarray(np.isfinite(boxes).all(axis=1))


class _Segment(NamedTuple):
    """Run over all frames, or a segment of a run.

    `scored`: which frames are scored, shape (n,); None for one-pass runs.
    """

    run: Run
    scored: NDArray[np.bool_] | None = None
    start: int = 0
    start_label: str = ""
    marks: Sequence[int] = ()
    tracker_values: Mapping[str, Sequence[float | str | None]] = {}


def _split_segments(run: Run, truth: Array) -> Iterator[_Segment]:
    """Yield the segments of a run; the initialisation of a segment is not scored."""
    n, present = len(truth), _present(truth)
    bounds = np.cumsum([len(frames) for frames in run.segments])[:-1]
    boxes_of_segments = np.split(run.boxes, bounds)
    for start, (frames, boxes) in enumerate(zip(run.segments, boxes_of_segments, strict=True)):
        all_boxes, scored = np.full((n, 4), np.nan), np.zeros(n, bool)
        all_boxes[frames], scored[frames] = boxes, True
        scored[frames[present[frames]][:1]] = False
        back = ", backwards" if len(frames) > 1 and frames[1] < frames[0] else ""
        start_label = f"{start + 1}: from frame {frames[0]}{back}"
        run_of_segment = replace(run, boxes=all_boxes, details={}, arrays={}, segments=())
        yield _Segment(run_of_segment, scored, start, start_label)


def _from_other_protocol(run: Run, truth: Array) -> _Segment:
    """Return a run over all frames by another protocol, with restarts and late estimates."""
    scored, marks = np.ones(len(truth), bool), list[int]()
    scored[np.flatnonzero(_present(truth))[:1]] = False
    numbers_by_name: dict[str, list[float | str | None]] = {}
    if run.estimate_frames is not None:
        estimate_frames = [None if frame < 0 else frame for frame in run.estimate_frames.tolist()]
        numbers_by_name["estimate_frame"] = estimate_frames
    if run.states is not None:
        scored &= np.isin(run.states, (FrameState.TRACKED, FrameState.FAILED))
        marks = np.flatnonzero(run.states == FrameState.INITIALISED).tolist()[1:]
        numbers_by_name["supervision"] = [*map(_SUPERVISION.get, run.states.tolist())]
    return _Segment(run, scored, marks=marks, tracker_values=numbers_by_name)


def _page_run(
    truth: Array, segment: _Segment, row: Mapping[str, Any], tracker: int, with_tracker_values: bool
) -> PageRun:
    """Compute the scores of a run or of one of its segments by frame."""
    run, one_pass = segment.run, segment.scored is None
    scored = np.flatnonzero(_present(truth))[1:]
    if segment.scored is not None:
        scored = np.flatnonzero(_present(truth) & segment.scored)
    exact = overlap(truth[scored], run.boxes[scored])
    overlaps = np.full(len(run.boxes), np.nan, np.float32)
    overlaps[scored] = exact
    shares = {}
    if row["status"] == "finished" and len(scored) and one_pass:
        hits, near = np.nan_to_num(exact)[:, None], centre_error(truth, run.boxes)[scored, None]
        shares["success"] = _threshold_shares(hits, OVERLAPS, hits >= OVERLAPS, scored)
        shares["precision"] = _threshold_shares(near, ERRORS, near <= ERRORS, scored)
    boxes_at = np.flatnonzero(_present(run.boxes))
    end = int(boxes_at[-1]) if len(boxes_at) else 0
    player_run = PlayerRun(
        tracker,
        int(row["repetition"]),
        run.boxes,
        run.revised,
        run.failure,
        is_round(run),
        shapes(run),
        maps(run),
        {**segment.tracker_values, **(tracker_values(run) if with_tracker_values else {})},
        segment.start,
        segment.start_label,
        [] if segment.scored is None else _spans(segment.scored),
        segment.marks,
    )
    return PageRun(player_run, end, overlaps, shares, _worst(truth, run, row, scored, end))


def _threshold_shares(
    values: Array, thresholds: Array, hits: NDArray[np.bool_], frames: Frames
) -> ThresholdShares:
    """Return the shares of `hits` (n, k) and the frames with the nearest values (n, 1)."""
    far = np.abs(np.nan_to_num(values, nan=np.inf) - thresholds)
    return ThresholdShares(hits.mean(axis=0), far.min(axis=0), frames[far.argmin(axis=0)])


def _worst(
    truth: Array, run: Run, row: Mapping[str, Any], scored: Frames, end: int
) -> dict[tuple[str, Trajectory], tuple[float, int]]:
    """Return severity and worst frame of a run by criterion and trajectory; larger is worse."""
    criteria = "overlap", "centre_error", "loss"
    if run.failure or not len(scored):
        return {(criterion, "online"): (inf, end) for criterion in criteria}
    trajectories: tuple[Trajectory, ...] = (
        ("online",) if run.revised is None else ("online", "revised")
    )
    worst: dict[tuple[str, Trajectory], tuple[float, int]] = {}
    for trajectory in trajectories:
        boxes = run.boxes_in(trajectory)[scored]
        overlaps = np.nan_to_num(overlap(truth[scored], boxes))
        distance = np.nan_to_num(centre_error(truth[scored], boxes), nan=np.inf, posinf=np.inf)
        first = row["scores"].get(
            f"{REVISED}first_loss" if trajectory == "revised" else "first_loss"
        )
        first = len(run.boxes) if first is None else int(first)
        by_overlap = first if first in scored else int(scored[np.argmin(overlaps)])
        worst["overlap", trajectory] = -float(overlaps.mean()), by_overlap
        worst["centre_error", trajectory] = float(distance.mean()), int(scored[np.argmax(distance)])
        worst["loss", trajectory] = -float(first), min(first, int(scored[-1]))
    return worst


def _spans(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return the first and the last frame of each interval of flagged frames."""
    edges = np.diff(np.concatenate([[False], flags, [False]]).astype(int))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1
    return list(zip(starts.tolist(), ends.tolist(), strict=True))


def player_sequences(
    runs: PageRuns,
    progress: Progress,
    write_chunk: ChunkWriter | None = None,
    height: int = THUMBNAIL,
    selected: Sequence[Sequence[int]] | None = None,
) -> Iterator[PlayerSequence]:
    """Yield the sequences with all frames, or with the `selected` frames of each, in order.

    See `encode_frames` for the other parameters.
    """
    frames = selected or [range(len(sequence.truth)) for sequence in runs.sequences]
    rows = [sequence.row for sequence in runs.sequences]
    encoded = encode_frames([*zip(rows, frames, strict=True)], progress, write_chunk, height)
    for sequence, indices, sequence_frames in zip(runs.sequences, frames, encoded, strict=True):
        yield _player_sequence(sequence, sequence_frames, indices)


def _player_sequence(
    sequence_runs: SequenceRuns, sequence_frames: SequenceFrames, frames: Sequence[int]
) -> PlayerSequence:
    """Return a sequence for the player."""
    truth = sequence_runs.full_truth
    present = np.flatnonzero(_present(truth.boxes))
    return PlayerSequence(
        name=sequence_runs.name,
        size=truth.image_size or _extent(truth.boxes),
        boxes=sequence_runs.truth,
        runs=[
            page_run.player_run for page_run in (*sequence_runs.one_pass, *sequence_runs.other_runs)
        ],
        thumbnails=sequence_frames.thumbnails,
        full=sequence_frames.full,
        reason=sequence_frames.reason,
        frame_numbers=None if len(frames) == len(sequence_runs.truth) else frames,
        fps=truth.fps,
        first=int(present[0]) if len(present) else 0,
        shapes={**sequence_frames.shapes, **true_shapes(truth)},
    )


def _extent(boxes: Array) -> tuple[int, int]:
    """Return a size that contains all boxes, for ground truth without image size."""
    ends = (boxes[:, :2] + boxes[:, 2:])[_present(boxes)]
    wide, tall = np.ceil(ends.max(axis=0)).tolist() if len(ends) else (320, 240)
    return max(1, int(wide)), max(1, int(tall))
