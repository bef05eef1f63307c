"""Stored runs as the player of a page shows them: boxes, worst frames, curves, thumbnails."""

import json
import shlex
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.evaluation.ground_truth import reference
from trackmark.bench.evaluation.run_record import Run, Trace
from trackmark.bench.evaluation.scoring import REVISED
from trackmark.bench.metrics.centre_error import centre_error
from trackmark.bench.metrics.overlap import overlap
from trackmark.bench.metrics.preset import State
from trackmark.bench.pages.page_frames import THUMBNAIL, Filmed, Keep, Watch, film_all
from trackmark.bench.pages.player_layers import Film, maps, numbers, shapes, true_shapes
from trackmark.bench.protocols import STORED_ONCE
from trackmark.bench.reporting.pictures import is_round, judged_runs
from trackmark.bench.store.truth import StoredTruth
from trackmark.reports.page.content import Place, Scene, Take
from trackmark.reports.page.film import packed, quantised, squeezed
from trackmark.reports.plots import share_of

_DONE = {
    State.SKIPPED: "not asked",
    State.INITIALISED: "begun with the truth",
    State.FAILED: "failed",
}
"""What supervision does with a tracker, where it does not just go on."""

OVERLAPS = np.linspace(0.0, 1.0, 51)
ERRORS = np.linspace(0.0, 50.0, 51)
"""Thresholds of success [overlap] and precision [pixels]."""

Array = NDArray[np.float64]
Stored = tuple[Mapping[str, Any], Run, StoredTruth]
"""A run with its row, as `bench.store.index` has it, and the truth that it was made with."""


@dataclass(frozen=True)
class Clip:
    """What the page knows of a run."""

    tracker: int
    repetition: int
    start: int  # of a run's segments, the number of this one; 0 for a run over all frames
    begun: str  # how a segment begins; empty for a run over all frames
    asked: NDArray[np.bool_] | None  # frames that it is judged in; None for all
    marks: Sequence[int]  # frames in which it was begun again
    failure: str
    boxes: NDArray[np.int32]
    revised: NDArray[np.int32] | None
    shapes: dict[int, dict[str, Any]]
    maps: Mapping[str, Film]
    numbers: Mapping[str, Sequence[float | str | None]]
    round: bool  # see `is_round`
    end: int  # the last frame with a box
    worst: Mapping[tuple[str, Trace], tuple[float, int]]  # badness and frame, by `Reading.place`
    nearest: Mapping[str, tuple[Array, NDArray[np.int64]]]  # by curve, see `_nearest_to`
    errors: NDArray[np.float32]  # of the centre by frame; NaN where it is not judged


@dataclass
class Stage:
    """What the page knows of a sequence; `truth` is what its runs are judged by."""

    row: Mapping[str, Any]
    stored: StoredTruth
    truth: Array
    clips: list[Clip] = field(default_factory=list)  # of runs in one pass
    others: list[Clip] = field(default_factory=list)  # of runs by other protocols
    success: dict[int, list[Array]] = field(default_factory=dict)  # by tracker
    precision: dict[int, list[Array]] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Of the sequence."""
        return str(self.row["sequence"])


@dataclass(frozen=True)
class Reading:
    """All scored runs of an experiment.

    `trackers`: of runs in one pass. `shown`: these, and those of runs by other protocols, by names
    that say it (see `named_by`).
    """

    trackers: Sequence[str]
    shown: Sequence[str]
    stages: Sequence[Stage]
    circumstances: Sequence[Mapping[str, Any]]  # of all runs, each once

    def place(
        self, tracker: str, sequence: str | None, kind: str, trace: Trace = "online"
    ) -> Place | None:
        """The worst frame of a tracker's worst run: of one sequence, or of all.

        `tracker`: as it is `shown`. `kind`: `overlap`, `centre_error` or `loss`. `trace`: of boxes
        that were revised; the only ones where none were.
        """
        worst = self._worst
        found = worst.get((tracker, sequence, kind, trace))
        if found is None:
            found = worst.get((tracker, sequence, kind, "online"))
        return None if found is None else found[1]

    def worst_of(
        self,
        runs: Iterable[tuple[str, str]],
        kind: str,
        there: Callable[[Place], bool] = lambda _: True,
    ) -> Place | None:
        """As `place`, of some trackers and sequences; of frames that are `there`."""
        known = [self._worst.get((*pair, kind, "online")) for pair in runs]
        found = [one for one in known if one and there(one[1])]
        return max(found, key=lambda one: one[0])[1] if found else None

    @cached_property
    def _worst(self) -> dict[tuple[str, str | None, str, Trace], tuple[float, Place]]:
        """How bad the worst runs are, and their worst frames."""
        worst: dict[tuple[str, str | None, str, Trace], tuple[float, Place]] = {}
        for position, stage in enumerate(self.stages):
            for clip in (*stage.clips, *stage.others):
                name = self.shown[clip.tracker]
                for (kind, trace), (badness, frame) in clip.worst.items():
                    place = Place(position, clip.tracker, clip.repetition, frame)
                    place = place._replace(start=clip.start, revised=trace == "revised")
                    for sequence in (stage.name, None):
                        known = worst.get((name, sequence, kind, trace))
                        if known is None or badness > known[0]:
                            worst[name, sequence, kind, trace] = badness, place
        return worst


def named_by(tracker: str, stored: str) -> str:
    """What a page calls a tracker in runs by a protocol, which are filed under `stored`."""
    return tracker if stored == STORED_ONCE else f"{tracker} ({stored})"


def read_takes(
    experiment: Path, trackers: Sequence[str], *, detailed: bool = False, **only: str
) -> Reading:
    """Read all scored runs of an experiment, each once.

    `trackers`: in the order of their colours; others follow. `detailed`: with trackers' own
    numbers. `only`: what columns must say. Raises `ResultsError` for a file that can't be read.
    """
    return taken(judged_runs(experiment, **only), trackers, detailed=detailed)


def taken(runs: Iterable[Stored], trackers: Sequence[str], *, detailed: bool = False) -> Reading:
    """What a page knows of runs; `trackers` and `detailed` as of `read_takes`."""
    names, others = list(trackers), list[Stored]()
    stages: dict[str, Stage] = {}
    told: dict[str, Mapping[str, Any]] = {}
    for row, run, stored in runs:
        truth = np.asarray(reference(stored, run.identity.init, row["sequence"]).boxes)
        stage = stages.setdefault(row["sequence"], Stage(row, stored, truth))
        if row["fingerprint"] != stage.row["fingerprint"]:
            continue  # of another version of the sequence: it is stale, and tables say so
        if row["protocol"] == STORED_ONCE:
            if row["tracker"] not in names:
                names.append(row["tracker"])
            number = names.index(row["tracker"])
            stage.clips.append(_clip(stage, truth, run, row, number, detailed))
        else:
            others.append((row, run, stored))
        about = {key: run.circumstances.get(key) for key in ("host", "platform", "python")}
        about |= {"libraries": run.circumstances.get("libraries") or {}}
        about |= {"date": str(run.circumstances.get("date", ""))[:10]}
        told[json.dumps(about, sort_keys=True, default=str)] = about
    shown = list(names)
    for row, run, _ in others:
        name = named_by(row["tracker"], row["protocol"])
        if name not in shown:
            shown.append(name)
        stage = stages[row["sequence"]]
        stage.others += _segments(stage, run, row, shown.index(name), detailed)
    return Reading(names, shown, list(stages.values()), list(told.values()))


def _segments(
    stage: Stage, run: Run, row: Mapping[str, Any], tracker: int, detailed: bool
) -> Iterator[Clip]:
    """A run by another protocol as clips: one, or one a segment, told what was done when."""
    n = len(stage.truth)
    present: NDArray[np.bool_] = np.asarray(np.isfinite(stage.truth).all(axis=1))
    if run.segments:
        bounds = np.cumsum([len(frames) for frames in run.segments])[:-1]
        for start, (frames, boxes) in enumerate(
            zip(run.segments, np.split(run.boxes, bounds), strict=True)
        ):
            whole, asked = np.full((n, 4), np.nan), np.zeros(n, bool)
            whole[frames], asked[frames] = boxes, True
            given = frames[present[frames]][:1]  # with a target, where it is begun
            asked[given] = False
            back = ", backwards" if len(frames) > 1 and frames[1] < frames[0] else ""
            begun = f"{start + 1}: from frame {frames[0]}{back}"
            part = replace(run, boxes=whole, details={}, arrays={}, segments=())
            yield _clip(stage, stage.truth, part, row, tracker, False, start, begun, asked)
        return
    told: dict[str, list[float | str | None]] = {}
    asked, marks = np.ones(n, bool), list[int]()
    asked[np.flatnonzero(present)[:1]] = False
    if run.answered is not None:
        told["answer to frame"] = [None if one < 0 else one for one in run.answered.tolist()]
    if run.states is not None:
        asked &= np.isin(run.states, (State.TRACKED, State.FAILED))
        marks = np.flatnonzero(run.states == State.INITIALISED).tolist()[1:]
        told["supervision"] = [_DONE.get(one) for one in run.states.tolist()]
    clip = _clip(stage, stage.truth, run, row, tracker, detailed, asked=asked, marks=marks)
    yield replace(clip, numbers={**told, **clip.numbers})


def _clip(
    stage: Stage,
    truth: Array,
    run: Run,
    row: Mapping[str, Any],
    tracker: int,
    detailed: bool,
    start: int = 0,
    begun: str = "",
    asked: NDArray[np.bool_] | None = None,
    marks: Sequence[int] = (),
) -> Clip:
    """What the page knows of a run, which is judged where it was `asked`."""
    judged = np.flatnonzero(np.isfinite(truth).all(axis=1))[1:]
    if asked is not None:
        judged = np.flatnonzero(np.isfinite(truth).all(axis=1) & asked)
    overlaps = np.nan_to_num(overlap(truth[judged], run.boxes[judged]))
    errors = np.full(len(run.boxes), np.nan)
    errors[judged] = centre_error(truth[judged], run.boxes[judged])
    nearest = {}
    if row["status"] == "finished" and len(judged) and asked is None:
        nearest["success"] = _nearest_to(overlaps, OVERLAPS, judged)
        nearest["precision"] = _nearest_to(errors[judged], ERRORS, judged)
        success = share_of(overlaps, OVERLAPS, at_least=True)
        stage.success.setdefault(tracker, []).append(success)
        precision = share_of(errors[judged], ERRORS, at_least=False)
        stage.precision.setdefault(tracker, []).append(precision)
    there = np.flatnonzero(np.isfinite(run.boxes).all(axis=1))
    end = int(there[-1]) if len(there) else 0
    return Clip(
        tracker,
        int(row["repetition"]),
        start,
        begun,
        asked,
        marks,
        run.failure,
        quantised(run.boxes),
        None if run.revised is None else quantised(run.revised),
        shapes(run),
        maps(run),
        numbers(run) if detailed else {},
        is_round(run),
        end,
        _worst(truth, run, row, judged, end),
        nearest,
        errors.astype(np.float32),
    )


def _worst(
    truth: Array, run: Run, row: Mapping[str, Any], judged: NDArray[np.int64], end: int
) -> dict[tuple[str, Trace], tuple[float, int]]:
    """How bad a run is (larger is worse) and its worst frame, by what it is judged by."""
    kinds = "overlap", "centre_error", "loss"
    if run.failure or not len(judged):
        return {(kind, "online"): (inf, end) for kind in kinds}
    traces: tuple[Trace, ...] = ("online",) if run.revised is None else ("online", "revised")
    found: dict[tuple[str, Trace], tuple[float, int]] = {}
    for trace in traces:
        boxes = run.boxes_in(trace)[judged]
        overlaps = np.nan_to_num(overlap(truth[judged], boxes))
        distance = np.nan_to_num(centre_error(truth[judged], boxes), nan=np.inf, posinf=np.inf)
        # Of frames without any overlap the one that is furthest away.
        by_overlap = int(np.lexsort((-distance, overlaps))[0])
        by_error = int(np.argmax(distance))
        scores = row["scores"]
        first = scores.get(f"{REVISED}first_loss" if trace == "revised" else "first_loss")
        first = len(run.boxes) if first is None else int(first)
        found["overlap", trace] = -float(overlaps.mean()), int(judged[by_overlap])
        found["centre_error", trace] = float(distance.mean()), int(judged[by_error])
        found["loss", trace] = -float(first), min(first, int(judged[-1]))
    return found


def _spans(asked: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last frame of each stretch of frames that are flagged."""
    edges = np.diff(np.concatenate([[False], asked, [False]]).astype(int))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1
    return list(zip(starts.tolist(), ends.tolist(), strict=True))


def scenes(
    reading: Reading,
    results: str,
    watch: Watch,
    keep: Keep | None = None,
    height: int = THUMBNAIL,
    chosen: Sequence[Sequence[int]] | None = None,
) -> Iterator[Scene]:
    """The sequences with their frames, or the `chosen` ones of each, in order.

    `results`: how the folder is named in commands. See `film_all` for the others.
    """
    shown = chosen or [range(len(stage.truth)) for stage in reading.stages]
    rows = [(stage.row, frames) for stage, frames in zip(reading.stages, shown, strict=True)]
    for (_, frames), stage, filmed in zip(
        rows, reading.stages, film_all(rows, watch, keep, height), strict=True
    ):
        yield _scene(stage, results, filmed, frames)


def _scene(stage: Stage, results: str, filmed: Filmed, frames: Sequence[int]) -> Scene:
    row, stored = stage.row, stage.stored
    boxes, takes = [quantised(stage.truth)], list[Take]()
    drawn: dict[int, Mapping[int, Any]] = {0: {**filmed.shapes, **true_shapes(stored)}}
    for clip in (*stage.clips, *stage.others):
        place = len(boxes)
        boxes.append(clip.boxes)
        if clip.revised is not None:
            boxes.append(clip.revised)
        drawn[place] = clip.shapes
        revised = None if clip.revised is None else place + 1
        told = squeezed(json.dumps(clip.numbers).encode()) if clip.numbers else ""
        takes.append(
            Take(
                clip.tracker,
                clip.repetition,
                place,
                revised,
                clip.failure,
                clip.round,
                clip.maps,
                told,
                clip.start,
                clip.begun,
                [] if clip.asked is None else _spans(clip.asked),
                clip.marks,
            )
        )
    drawn = {place: shown for place, shown in drawn.items() if shown}
    present = np.flatnonzero(np.isfinite(stored.boxes).all(axis=1))
    given = ["--truth", row["truth"]] if row["truth"] else []
    show = ["trackmark", "show", row["source"], *given, "--results", results]
    return Scene(
        name=stage.name,
        frames=len(stage.truth),
        size=stored.image_size or _extent(stored.boxes),
        boxes=packed(np.stack(boxes)),
        takes=takes,
        thumbnails=filmed.thumbnails,
        full=filmed.full,
        why=filmed.why,
        kept=None if len(frames) == len(stage.truth) else frames,
        fps=stored.fps,
        first=int(present[0]) if len(present) else 0,
        shapes=squeezed(json.dumps(drawn).encode()) if drawn else "",
        show=shlex.join(show) if results else "",
    )


def _extent(boxes: Array) -> tuple[int, int]:
    """An image that holds all boxes, where nobody knows its size any more."""
    ends = (boxes[:, :2] + boxes[:, 2:])[np.isfinite(boxes).all(axis=1)]
    wide, tall = np.ceil(ends.max(axis=0)).tolist() if len(ends) else (320, 240)
    return max(1, int(wide)), max(1, int(tall))


def _nearest_to(
    values: Array, thresholds: Array, frames: NDArray[np.int64]
) -> tuple[Array, NDArray[np.int64]]:
    """Return the distance of the nearest value to each threshold, shape (k,), and its frame."""
    far = np.abs(np.nan_to_num(values, nan=np.inf)[:, None] - thresholds)
    chosen = np.argmin(far, axis=0)
    return far[chosen, np.arange(len(thresholds))], frames[chosen]
