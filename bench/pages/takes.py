"""Stored runs as the player of a page shows them: boxes, worst frames, curves, thumbnails."""

import json
import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.evaluation.record import Run
from bench.evaluation.reference import reference
from bench.metrics.centre_error import centre_error
from bench.metrics.overlap import overlap
from bench.pages.filming import THUMBNAIL, Filmed, Keep, Watch, film_all
from bench.pages.shown import Film, maps, numbers, shapes, true_shapes
from bench.reporting.outlines import is_round
from bench.reporting.pictures import scored_runs
from bench.store.truth import StoredTruth
from reports.page.film import packed, quantised, squeezed
from reports.page.page import Place, Scene, Take
from reports.plots import share_of

__all__ = [
    "ERRORS",
    "OVERLAPS",
    "Clip",
    "Reading",
    "Stage",
    "Stored",
    "read_takes",
    "scenes",
    "taken",
]

Array = NDArray[np.float64]
OVERLAPS = np.linspace(0.0, 1.0, 51)
ERRORS = np.linspace(0.0, 50.0, 51)
"""Thresholds of success [overlap] and precision [pixels]."""

Stored = tuple[Mapping[str, Any], Run, StoredTruth]
"""A run with its row, as `bench.store.index` has it, and the truth that it was made with."""


@dataclass(frozen=True)
class Clip:
    """What the page knows of a run."""

    tracker: int
    repetition: int
    failure: str
    boxes: NDArray[np.int32]
    revised: NDArray[np.int32] | None
    shapes: dict[int, dict[str, Any]]
    maps: Mapping[str, Film]
    numbers: Mapping[str, Sequence[float | None]]
    round: bool  # see `is_round`
    end: int  # the last frame with a box
    worst: Mapping[str, tuple[float, int]]  # badness and frame, by what it is judged by
    errors: NDArray[np.float32]  # of the centre by frame; NaN where it is not judged


@dataclass
class Stage:
    """What the page knows of a sequence; `truth` is what its runs are judged by."""

    row: Mapping[str, Any]
    stored: StoredTruth
    truth: Array
    clips: list[Clip] = field(default_factory=list)
    success: dict[int, list[Array]] = field(default_factory=dict)  # by tracker
    precision: dict[int, list[Array]] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Of the sequence."""
        return str(self.row["sequence"])


@dataclass(frozen=True)
class Reading:
    """All scored runs of an experiment."""

    trackers: Sequence[str]
    stages: Sequence[Stage]
    circumstances: Sequence[Mapping[str, Any]]  # of all runs, each once

    def place(self, tracker: str, sequence: str | None, kind: str) -> Place | None:
        """The worst frame of a tracker's worst run: of one sequence, or of all.

        `kind`: `overlap`, `centre_error` or `loss`.
        """
        found = self._worst.get((tracker, sequence, kind))
        return None if found is None else found[1]

    @cached_property
    def _worst(self) -> dict[tuple[str, str | None, str], tuple[float, Place]]:
        """How bad the worst runs are, and their worst frames."""
        worst: dict[tuple[str, str | None, str], tuple[float, Place]] = {}
        for position, stage in enumerate(self.stages):
            for clip in stage.clips:
                name = self.trackers[clip.tracker]
                for kind, (badness, frame) in clip.worst.items():
                    place = Place(position, clip.tracker, clip.repetition, frame)
                    for sequence in (stage.name, None):
                        known = worst.get((name, sequence, kind))
                        if known is None or badness > known[0]:
                            worst[name, sequence, kind] = badness, place
        return worst


def read_takes(
    experiment: Path, trackers: Sequence[str], *, detailed: bool = False, **only: str
) -> Reading:
    """Read all scored runs of an experiment, each once.

    `trackers`: in the order of their colours; others follow. `detailed`: with trackers' own
    numbers. `only`: what columns must say. Raises `ResultsError` for a file that can't be read.
    """
    return taken(scored_runs(experiment, **only), trackers, detailed=detailed)


def taken(runs: Iterable[Stored], trackers: Sequence[str], *, detailed: bool = False) -> Reading:
    """What a page knows of runs; `trackers` and `detailed` as of `read_takes`."""
    names = list(trackers)
    stages: dict[str, Stage] = {}
    told: dict[str, Mapping[str, Any]] = {}
    for row, run, stored in runs:
        truth = np.asarray(reference(stored, run.identity.init, row["sequence"]).boxes)
        stage = stages.setdefault(row["sequence"], Stage(row, stored, truth))
        if row["fingerprint"] != stage.row["fingerprint"]:
            continue  # of another version of the sequence: it is stale, and tables say so
        if row["tracker"] not in names:
            names.append(row["tracker"])
        number = names.index(row["tracker"])
        stage.clips.append(_clip(stage, truth, run, row, number, detailed))
        about = {key: run.circumstances.get(key) for key in ("host", "platform", "python")}
        about |= {"libraries": run.circumstances.get("libraries") or {}}
        about |= {"date": str(run.circumstances.get("date", ""))[:10]}
        told[json.dumps(about, sort_keys=True, default=str)] = about
    return Reading(names, list(stages.values()), list(told.values()))


def _clip(
    stage: Stage, truth: Array, run: Run, row: Mapping[str, Any], tracker: int, detailed: bool
) -> Clip:
    judged = np.flatnonzero(np.isfinite(truth).all(axis=1))[1:]
    overlaps = np.nan_to_num(overlap(truth[judged], run.boxes[judged]))
    errors = np.full(len(run.boxes), np.nan)
    errors[judged] = centre_error(truth[judged], run.boxes[judged])
    if row["status"] == "finished" and len(judged):
        success = share_of(overlaps, OVERLAPS, at_least=True)
        stage.success.setdefault(tracker, []).append(success)
        precision = share_of(errors[judged], ERRORS, at_least=False)
        stage.precision.setdefault(tracker, []).append(precision)
    there = np.flatnonzero(np.isfinite(run.boxes).all(axis=1))
    end = int(there[-1]) if len(there) else 0
    return Clip(
        tracker,
        int(row["repetition"]),
        run.failure,
        quantised(run.boxes),
        None if run.revised is None else quantised(run.revised),
        shapes(run),
        maps(run),
        numbers(run) if detailed else {},
        is_round(run),
        end,
        _worst(run, row, judged, overlaps, errors, end),
        errors.astype(np.float32),
    )


def _worst(
    run: Run,
    row: Mapping[str, Any],
    judged: NDArray[np.int64],
    overlaps: Array,
    errors: Array,
    end: int,
) -> dict[str, tuple[float, int]]:
    """How bad a run is (larger is worse) and its worst frame, by what it is judged by."""
    if run.failure or not len(judged):
        return dict.fromkeys(("overlap", "centre_error", "loss"), (inf, end))
    distance = np.nan_to_num(errors[judged], nan=np.inf)
    # Of frames without any overlap the one that is furthest away.
    by_overlap = int(np.lexsort((-distance, overlaps))[0])
    by_error = int(np.argmax(distance))
    first = row["scores"].get("first_loss", len(run.boxes))
    first = len(run.boxes) if first is None else int(first)
    frame = min(first, int(judged[-1]))
    return {
        "overlap": (-float(overlaps.mean()), int(judged[by_overlap])),
        "centre_error": (float(distance.mean()), int(judged[by_error])),
        "loss": (-float(first), frame),
    }


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
    drawn = {0: true_shapes(stored)}
    for clip in stage.clips:
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
