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
from trackmark.bench.analysis.stored_runs import StoredRun
from trackmark.bench.evaluation.ground_truth import select_ground_truth
from trackmark.bench.evaluation.run_record import Run, Trace
from trackmark.bench.evaluation.scoring import REVISED
from trackmark.bench.metrics.centre_error import centre_error
from trackmark.bench.metrics.overlap import overlap
from trackmark.bench.metrics.preset import FrameState
from trackmark.bench.pages.content import PlayerRun, PlayerScene
from trackmark.bench.pages.page_frames import THUMBNAIL, Filmed, Keep, Watch, film_all
from trackmark.bench.pages.player_layers import maps, numbers, shapes, true_shapes
from trackmark.bench.protocols import STORED_ONE_PASS
from trackmark.bench.store.truth import StoredTruth
from trackmark.reports.charts import PlayerPosition

_SUPERVISION = {
    FrameState.SKIPPED: "skipped",
    FrameState.INITIALISED: "initialised with the true box",
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

    take: PlayerRun
    end: int  # last frame with a box
    overlaps: NDArray[np.float32]  # (n,); NaN if the frame is not judged
    shares: Mapping[str, ThresholdShares]  # `success` and `precision` of finished one-pass runs
    worst: Mapping[tuple[str, Trace], tuple[float, int]]  # badness and frame, by `PageRuns.place`


@dataclass
class SequenceRuns:
    """Runs on a sequence; `truth` contains the ground-truth boxes by which they are judged."""

    row: Mapping[str, Any]
    stored: StoredTruth
    truth: Array
    clips: list[PageRun] = field(default_factory=list)  # of one-pass runs
    others: list[PageRun] = field(default_factory=list)  # of runs by other protocols

    @property
    def name(self) -> str:
        """Name of the sequence."""
        return str(self.row["sequence"])

    def clips_of(self, tracker: int) -> list[PageRun]:
        """Return the one-pass runs of a tracker."""
        return [clip for clip in self.clips if clip.take.tracker == tracker]


@dataclass(frozen=True)
class PageRuns:
    """Scored runs of an experiment."""

    trackers: Sequence[str]  # of one-pass runs
    labels: Sequence[str]  # trackers, then labels of runs by other protocols: `name_on_page`
    stages: Sequence[SequenceRuns]
    circumstances: Sequence[Mapping[str, Any]]  # of all runs, without repetitions

    def place(
        self, tracker: str, sequence: str | None, kind: str, trace: Trace = "online"
    ) -> PlayerPosition | None:
        """Return the worst frame of a tracker's worst run on one sequence or on all.

        `tracker`: one of `labels`. `kind`: `overlap`, `centre_error` or `loss`. `trace`: `online`
        replaces `revised` for runs without revised boxes.
        """
        names = [stage.name for stage in self.stages] if sequence is None else [sequence]
        return self.worst_of(tracker, names, kind, trace)

    def worst_of(
        self, tracker: str, sequences: Sequence[str], kind: str, trace: Trace = "online"
    ) -> PlayerPosition | None:
        """Return the worst frame of a tracker's worst run on several sequences."""
        for wanted in (trace, "online"):
            worst = [self._worst.get((tracker, name, kind, wanted)) for name in sequences]
            if any(worst):
                return max(filter(None, worst), key=itemgetter(0))[1]
        return None

    @cached_property
    def _worst(self) -> dict[tuple[str, str, str, Trace], tuple[float, PlayerPosition]]:
        """Badness and worst frame of the worst run, by tracker, sequence, kind and trace."""
        worst: dict[tuple[str, str, str, Trace], tuple[float, PlayerPosition]] = {}
        for position, stage in enumerate(self.stages):
            for clip in (*stage.clips, *stage.others):
                take = clip.take
                for (kind, trace), (badness, frame) in clip.worst.items():
                    place = PlayerPosition(position, take.tracker, take.repetition, frame)
                    place = place._replace(start=take.start, revised=trace == "revised")
                    key = self.labels[take.tracker], stage.name, kind, trace
                    if key not in worst or badness > worst[key][0]:
                        worst[key] = badness, place
        return worst


def name_on_page(tracker: str, protocol: str) -> str:
    """Return the label of a tracker's runs by a protocol."""
    return tracker if protocol == STORED_ONE_PASS else f"{tracker} ({protocol})"


def collect_runs(
    runs: Iterable[StoredRun], trackers: Sequence[str], with_numbers: bool = False
) -> PageRuns:
    """Score runs for a page.

    `trackers`: trackers in the order of their colours; others follow.
    """
    names, others = list(trackers), list[tuple[Mapping[str, Any], Run]]()
    stages: dict[str, SequenceRuns] = {}
    circumstances: dict[str, Mapping[str, Any]] = {}
    for row, run, stored in runs:
        truth = np.asarray(select_ground_truth(stored, run.identity.init, row["sequence"]).boxes)
        stage = stages.setdefault(row["sequence"], SequenceRuns(row, stored, truth))
        if row["fingerprint"] != stage.row["fingerprint"]:
            continue  # the run is stale: the sequence has changed since; tables report it
        if row["protocol"] == STORED_ONE_PASS:
            if row["tracker"] not in names:
                names.append(row["tracker"])
            number = names.index(row["tracker"])
            stage.clips.append(_judge(truth, _RunPart(run), row, number, with_numbers))
        else:
            others.append((row, run))
        entry = {key: run.circumstances.get(key) for key in ("host", "platform", "python")}
        entry |= {"libraries": run.circumstances.get("libraries") or {}}
        entry |= {"date": str(run.circumstances.get("date", ""))[:10]}
        circumstances[json.dumps(entry, sort_keys=True, default=str)] = entry
    labels = list(names)
    for row, run in others:
        name = name_on_page(row["tracker"], row["protocol"])
        if name not in labels:
            labels.append(name)
        stage, number = stages[row["sequence"]], labels.index(name)
        if run.segments:
            parts = _split_segments(run, stage.truth)
            stage.others += [_judge(stage.truth, part, row, number, False) for part in parts]
        else:
            part = _from_other_protocol(run, stage.truth)
            stage.others.append(_judge(stage.truth, part, row, number, with_numbers))
    return PageRuns(names, labels, list(stages.values()), list(circumstances.values()))


def _present(boxes: Array) -> NDArray[np.bool_]:
    """Return for each frame whether there is a box."""
    return np.asarray(np.isfinite(boxes).all(axis=1))


class _RunPart(NamedTuple):
    """Run over all frames, or a segment of a run.

    `judged`: which frames are scored, shape (n,); None for one-pass runs.
    """

    run: Run
    judged: NDArray[np.bool_] | None = None
    start: int = 0
    start_label: str = ""
    marks: Sequence[int] = ()
    numbers: Mapping[str, Sequence[float | str | None]] = {}


def _split_segments(run: Run, truth: Array) -> Iterator[_RunPart]:
    """Yield the segments of a run; the initialisation of a segment is not judged."""
    n, present = len(truth), _present(truth)
    bounds = np.cumsum([len(frames) for frames in run.segments])[:-1]
    pieces = np.split(run.boxes, bounds)
    for start, (frames, boxes) in enumerate(zip(run.segments, pieces, strict=True)):
        whole, judged = np.full((n, 4), np.nan), np.zeros(n, bool)
        whole[frames], judged[frames] = boxes, True
        judged[frames[present[frames]][:1]] = False
        back = ", backwards" if len(frames) > 1 and frames[1] < frames[0] else ""
        start_label = f"{start + 1}: from frame {frames[0]}{back}"
        part = replace(run, boxes=whole, details={}, arrays={}, segments=())
        yield _RunPart(part, judged, start, start_label)


def _from_other_protocol(run: Run, truth: Array) -> _RunPart:
    """Return a run over all frames by another protocol, with restarts and late estimates."""
    judged, marks = np.ones(len(truth), bool), list[int]()
    judged[np.flatnonzero(_present(truth))[:1]] = False
    numbers_by_name: dict[str, list[float | str | None]] = {}
    if run.source_frames is not None:
        answered = [None if frame < 0 else frame for frame in run.source_frames.tolist()]
        numbers_by_name["estimate for frame"] = answered
    if run.states is not None:
        judged &= np.isin(run.states, (FrameState.TRACKED, FrameState.FAILED))
        marks = np.flatnonzero(run.states == FrameState.INITIALISED).tolist()[1:]
        numbers_by_name["supervision"] = [*map(_SUPERVISION.get, run.states.tolist())]
    return _RunPart(run, judged, marks=marks, numbers=numbers_by_name)


def _judge(
    truth: Array, part: _RunPart, row: Mapping[str, Any], tracker: int, with_numbers: bool
) -> PageRun:
    """Compute the scores of a part of a run by frame."""
    run, one_pass = part.run, part.judged is None
    judged = np.flatnonzero(_present(truth))[1:]
    if part.judged is not None:
        judged = np.flatnonzero(_present(truth) & part.judged)
    exact = overlap(truth[judged], run.boxes[judged])
    overlaps = np.full(len(run.boxes), np.nan, np.float32)
    overlaps[judged] = exact
    shares = {}
    if row["status"] == "finished" and len(judged) and one_pass:
        hits, near = np.nan_to_num(exact)[:, None], centre_error(truth, run.boxes)[judged, None]
        shares["success"] = _threshold_shares(hits, OVERLAPS, hits >= OVERLAPS, judged)
        shares["precision"] = _threshold_shares(near, ERRORS, near <= ERRORS, judged)
    boxes_at = np.flatnonzero(_present(run.boxes))
    end = int(boxes_at[-1]) if len(boxes_at) else 0
    take = PlayerRun(
        tracker,
        int(row["repetition"]),
        run.boxes,
        run.revised,
        run.failure,
        is_round(run),
        shapes(run),
        maps(run),
        {**part.numbers, **(numbers(run) if with_numbers else {})},
        part.start,
        part.start_label,
        [] if part.judged is None else _spans(part.judged),
        part.marks,
    )
    return PageRun(take, end, overlaps, shares, _worst(truth, run, row, judged, end))


def _threshold_shares(
    values: Array, thresholds: Array, hits: NDArray[np.bool_], frames: Frames
) -> ThresholdShares:
    """Return the shares of `hits` (n, k) and the frames with the nearest values (n, 1)."""
    far = np.abs(np.nan_to_num(values, nan=np.inf) - thresholds)
    return ThresholdShares(hits.mean(axis=0), far.min(axis=0), frames[far.argmin(axis=0)])


def _worst(
    truth: Array, run: Run, row: Mapping[str, Any], judged: Frames, end: int
) -> dict[tuple[str, Trace], tuple[float, int]]:
    """Return the badness (larger is worse) and the worst frame of a run, by kind and trace."""
    kinds = "overlap", "centre_error", "loss"
    if run.failure or not len(judged):
        return {(kind, "online"): (inf, end) for kind in kinds}
    traces: tuple[Trace, ...] = ("online",) if run.revised is None else ("online", "revised")
    worst: dict[tuple[str, Trace], tuple[float, int]] = {}
    for trace in traces:
        boxes = run.boxes_in(trace)[judged]
        overlaps = np.nan_to_num(overlap(truth[judged], boxes))
        distance = np.nan_to_num(centre_error(truth[judged], boxes), nan=np.inf, posinf=np.inf)
        first = row["scores"].get(f"{REVISED}first_loss" if trace == "revised" else "first_loss")
        first = len(run.boxes) if first is None else int(first)
        by_overlap = first if first in judged else int(judged[np.argmin(overlaps)])
        worst["overlap", trace] = -float(overlaps.mean()), by_overlap
        worst["centre_error", trace] = float(distance.mean()), int(judged[np.argmax(distance)])
        worst["loss", trace] = -float(first), min(first, int(judged[-1]))
    return worst


def _spans(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return the first and the last frame of each interval of flagged frames."""
    edges = np.diff(np.concatenate([[False], flags, [False]]).astype(int))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1
    return list(zip(starts.tolist(), ends.tolist(), strict=True))


def scenes(
    runs: PageRuns,
    watch: Watch,
    keep: Keep | None = None,
    height: int = THUMBNAIL,
    selected: Sequence[Sequence[int]] | None = None,
) -> Iterator[PlayerScene]:
    """Yield the sequences with all frames, or with the `selected` frames of each, in order.

    See `film_all` for the other parameters.
    """
    frames = selected or [range(len(stage.truth)) for stage in runs.stages]
    rows = [(stage.row, its) for stage, its in zip(runs.stages, frames, strict=True)]
    films = film_all(rows, watch, keep, height)
    for stage, its, filmed in zip(runs.stages, frames, films, strict=True):
        yield _scene(stage, filmed, its)


def _scene(stage: SequenceRuns, filmed: Filmed, frames: Sequence[int]) -> PlayerScene:
    """Return a sequence for the player."""
    stored = stage.stored
    present = np.flatnonzero(_present(stored.boxes))
    return PlayerScene(
        name=stage.name,
        size=stored.image_size or _extent(stored.boxes),
        boxes=stage.truth,
        takes=[clip.take for clip in (*stage.clips, *stage.others)],
        thumbnails=filmed.thumbnails,
        full=filmed.full,
        why=filmed.why,
        frame_numbers=None if len(frames) == len(stage.truth) else frames,
        fps=stored.fps,
        first=int(present[0]) if len(present) else 0,
        shapes={**filmed.shapes, **true_shapes(stored)},
    )


def _extent(boxes: Array) -> tuple[int, int]:
    """Return a size that contains all boxes, for ground truth without image size."""
    ends = (boxes[:, :2] + boxes[:, 2:])[_present(boxes)]
    wide, tall = np.ceil(ends.max(axis=0)).tolist() if len(ends) else (320, 240)
    return max(1, int(wide)), max(1, int(tall))
