"""Stored runs for pages: boxes for the player, worst frames, and curves for charts."""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf
from operator import itemgetter
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.analysis.outlines import is_round
from trackmark.bench.evaluation.ground_truth import select_ground_truth
from trackmark.bench.evaluation.run_record import Run, Trajectory
from trackmark.bench.evaluation.scoring import REVISED
from trackmark.bench.metrics.boxes import centre_error, overlap
from trackmark.bench.metrics.interface import FrameState
from trackmark.bench.pages.content import PlayerRun, PlayerSequence, ThresholdShares
from trackmark.bench.pages.player_layers import maps, shapes, tracker_values, true_shapes
from trackmark.bench.protocols import ONE_PASS
from trackmark.bench.store.runs import RunWithTruth
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


@dataclass(frozen=True)
class PageRuns:
    """Scored runs of an experiment."""

    trackers: Sequence[str]  # of one-pass runs
    labels: Sequence[str]  # trackers, then labels of runs by other protocols: `name_on_page`
    sequences: Sequence[PlayerSequence]
    metadata: Sequence[Mapping[str, Any]]  # of all runs, without repetitions

    def worst_position(
        self, tracker: str, sequence: str | None, criterion: str, trajectory: Trajectory = "online"
    ) -> PlayerPosition | None:
        """Return the worst frame of a tracker's worst run on one sequence or on all.

        The tracker is one of `labels`, and the criterion `overlap`, `centre_error` or `loss`. For
        runs without revised boxes, the trajectory `online` replaces `revised`.
        """
        names = [each.name for each in self.sequences] if sequence is None else [sequence]
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
        for index, sequence in enumerate(self.sequences):
            for run in sequence.runs:
                for (criterion, trajectory), (severity, frame) in run.worst.items():
                    key = self.labels[run.tracker], sequence.name, criterion, trajectory
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
    sequences: dict[str, PlayerSequence] = {}
    metadata: dict[str, Mapping[str, Any]] = {}
    for row, run, full_truth in runs:
        name, init = row["sequence"], run.identity.init
        boxes = np.asarray(select_ground_truth(full_truth, init, name).boxes)
        if name not in sequences:
            present = np.flatnonzero(_present(full_truth.boxes))
            sequences[name] = PlayerSequence(
                name,
                full_truth.image_size or _extent(full_truth.boxes),
                boxes,
                row=row,
                fps=full_truth.fps,
                first=int(present[0]) if len(present) else 0,
                shapes=true_shapes(full_truth),
            )
        sequence = sequences[name]
        if row["fingerprint"] != sequence.row["fingerprint"]:
            continue  # the run is stale: the sequence has changed since; tables report it
        if row["protocol"] == ONE_PASS:
            if row["tracker"] not in names:
                names.append(row["tracker"])
            values = tracker_values(run) if with_tracker_values else {}
            tracker = names.index(row["tracker"])
            sequence.one_pass.append(_player_run(run, row, tracker, boxes, tracker_values=values))
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
        sequence, tracker = sequences[row["sequence"]], labels.index(name)
        by_protocol = _segments if run.segments else _run_by_protocol
        sequence.other_runs.extend(by_protocol(run, row, tracker, sequence.boxes))
    return PageRuns(names, labels, list(sequences.values()), list(metadata.values()))


def _present(boxes: Array) -> NDArray[np.bool_]:
    """Return for each frame whether there is a box."""
    return np.asarray(np.isfinite(boxes).all(axis=1))


def _extent(boxes: Array) -> tuple[int, int]:
    """Return a size that contains all boxes, for ground truth without image size."""
    ends = (boxes[:, :2] + boxes[:, 2:])[_present(boxes)]
    wide, tall = np.ceil(ends.max(axis=0)).tolist() if len(ends) else (320, 240)
    return max(1, int(wide)), max(1, int(tall))


def _segments(run: Run, row: Mapping[str, Any], tracker: int, truth: Array) -> Iterator[PlayerRun]:
    """Yield the segments of a run; the initialisation of a segment is not scored."""
    n, present = len(truth), _present(truth)
    bounds = np.cumsum([len(frames) for frames in run.segments])[:-1]
    boxes_of_segments = np.split(run.boxes, bounds)
    for start, (frames, boxes) in enumerate(zip(run.segments, boxes_of_segments, strict=True)):
        all_boxes, scored = np.full((n, 4), np.nan), np.zeros(n, bool)
        all_boxes[frames], scored[frames] = boxes, True
        scored[frames[present[frames]][:1]] = False
        back = ", backwards" if len(frames) > 1 and frames[1] < frames[0] else ""
        label = f"{start + 1}: from frame {frames[0]}{back}"
        segment = replace(run, boxes=all_boxes, details={}, arrays={}, segments=())
        yield _player_run(segment, row, tracker, truth, scored, start=start, start_label=label)


def _run_by_protocol(
    run: Run, row: Mapping[str, Any], tracker: int, truth: Array
) -> Iterator[PlayerRun]:
    """Yield a run over all frames by another protocol, with restarts and late estimates."""
    scored, restarts = np.ones(len(truth), bool), list[int]()
    scored[np.flatnonzero(_present(truth))[:1]] = False
    values: dict[str, list[float | str | None]] = {}
    if run.estimate_frames is not None:
        estimate_frames = [None if frame < 0 else frame for frame in run.estimate_frames.tolist()]
        values["estimate_frame"] = estimate_frames
    if run.states is not None:
        scored &= np.isin(run.states, (FrameState.TRACKED, FrameState.FAILED))
        restarts = np.flatnonzero(run.states == FrameState.INITIALISED).tolist()[1:]
        values["supervision"] = [*map(_SUPERVISION.get, run.states.tolist())]
    yield _player_run(run, row, tracker, truth, scored, restarts=restarts, tracker_values=values)


def _player_run(
    run: Run,
    row: Mapping[str, Any],
    tracker: int,
    truth: Array,
    is_scored: NDArray[np.bool_] | None = None,
    **fields: Any,
) -> PlayerRun:
    """Return a run or a segment with its scores by frame.

    `is_scored`: which frames are scored, shape (n,); by default all but the first with ground
    truth, as in one-pass runs. `fields`: further fields of `PlayerRun`.
    """
    scored = np.flatnonzero(_present(truth))[1:]
    if is_scored is not None:
        scored = np.flatnonzero(_present(truth) & is_scored)
        fields["scored"] = _spans(is_scored)
    exact = overlap(truth[scored], run.boxes[scored])
    overlaps = np.full(len(run.boxes), np.nan, np.float32)
    overlaps[scored] = exact
    shares = {}
    if row["status"] == "finished" and len(scored) and is_scored is None:
        hits, near = np.nan_to_num(exact)[:, None], centre_error(truth, run.boxes)[scored, None]
        shares["success"] = _threshold_shares(hits, OVERLAPS, hits >= OVERLAPS, scored)
        shares["precision"] = _threshold_shares(near, ERRORS, near <= ERRORS, scored)
    return PlayerRun(
        tracker=tracker,
        repetition=int(row["repetition"]),
        boxes=run.boxes,
        revised=run.revised,
        failure=run.failure,
        is_ellipse=is_round(run),
        shapes=shapes(run),
        maps=maps(run),
        overlaps=overlaps,
        shares=shares,
        worst=find_worst_frames(truth, run, row, scored),
        **fields,
    )


def _threshold_shares(
    values: Array, thresholds: Array, hits: NDArray[np.bool_], frames: Frames
) -> ThresholdShares:
    """Return the shares of `hits` (n, k) and the frames with the nearest values (n, 1)."""
    far = np.abs(np.nan_to_num(values, nan=np.inf) - thresholds)
    return ThresholdShares(hits.mean(axis=0), far.min(axis=0), frames[far.argmin(axis=0)])


def find_worst_frames(
    truth: Array, run: Run, row: Mapping[str, Any], scored: Frames
) -> dict[tuple[str, Trajectory], tuple[float, int]]:
    """Return severity and worst frame of a run by criterion and trajectory; larger is worse."""
    criteria = "overlap", "centre_error", "loss"
    if run.failure or not len(scored):
        end = int(np.flatnonzero(_present(run.boxes))[-1:].sum())  # last frame with a box
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
