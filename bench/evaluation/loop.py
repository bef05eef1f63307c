"""The only loop over frames: trackers in lock step through a sequence.

Each frame is decoded or rendered once and shown to every tracker. What a tracker does
wrong ends its own run and nobody else's.
"""

from collections.abc import Collection, Iterable
from collections.abc import Sequence as Sized
from dataclasses import dataclass, field
from math import inf, nan
from statistics import median
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.evaluation.observer import UNOBSERVED, Observer
from trackmark.bench.evaluation.record import Run
from trackmark.bench.evaluation.recorder import Recorder
from trackmark.bench.experiments.contestant import Contestant
from trackmark.datasets import Sequence
from trackmark.trackers.base.sharing import SharedFrame


@dataclass(frozen=True)
class Pass:
    """What one pass over a sequence gave."""

    runs: list[Run]  # in the order of the contestants
    # Seconds that the harness itself took, per frame and tracker: everything but decoding and the
    # trackers' own calls. The median over frames, which other load on the machine hardly touches;
    # NaN for a sequence of a single frame.
    overhead: float
    frame_seconds: float  # seconds that it took to decode or render a frame, on average


def run_in_lock_step(
    entries: Iterable[tuple[Contestant, int]],
    sequence: Sequence,
    *,
    share: bool = True,
    keep_arrays: bool = False,
    run_seconds: float = inf,
    rows: Collection[NDArray[np.float64]] = (),
    observer: Observer = UNOBSERVED,
) -> Pass:
    """Run several trackers through a sequence together.

    `entries`: trackers with their repetitions. `sequence`: with truth. `share`: give trackers that
    can share work a common store for each frame. The boxes are the same without. `keep_arrays`:
    keep arrays, masks and maps. `run_seconds`: what a tracker may take for all frames together.
    `rows`: one a tracker; see `Recorder`. `observer`: told what is done.

    Raises `SequenceError` where the sequence has no usable truth or an image can't be read. No run
    is kept then. Raises `NotAttributableError` where a tracker harms the process, and which of
    them did can't be told.
    """
    sequence.check_runnable()
    entries = list(entries)
    kept: Iterable[NDArray[np.float64] | None] = rows or [None] * len(entries)
    recorders = [
        Recorder(
            chosen,
            repetition,
            sequence,
            share=share,
            keep_arrays=keep_arrays,
            alone=len(entries) == 1,
            run_seconds=run_seconds,
            rows=own,
        )
        for (chosen, repetition), own in zip(entries, kept, strict=True)
    ]
    clocks = walk(recorders, sequence, len(sequence), observer)
    last = len(sequence) - 1
    for number, recorder in enumerate(recorders):
        if not recorder.failure:
            observer.calling(number, last)
            recorder.finish(last)
            observer.called(number)
    overhead = median(clocks.own) if clocks.own else nan
    runs = [recorder.result() for recorder in recorders]
    return Pass(runs, overhead, clocks.fetching / (len(sequence) - sequence.first_frame))


@dataclass
class Clocks:
    """What a walk took, in seconds."""

    # To decode or render frames and masks, from the frame of initialisation on.
    fetching: float = 0.0
    # Of the harness itself, by frame, for one tracker.
    own: list[float] = field(default_factory=list)


def walk(
    recorders: Sized[Recorder],
    sequence: Sequence,
    stop: int,
    observer: Observer,
    *,
    to_the_end: bool = True,
) -> Clocks:
    """Show frames to trackers: those before the target is there to trackers that watch.

    `recorders`: the trackers. `sequence`: with truth. `stop`: frame before which it ends.
    `observer`: told what is done. `to_the_end`: go on when all have failed: a run is kept only
    where all frames can be read.
    """
    first = sequence.first_frame
    watchers = []
    for number, recorder in enumerate(recorders if first else ()):
        observer.calling(number, first)
        if recorder.watches(first):
            watchers.append((number, recorder))
        observer.called(number)
    for frame in range(first if watchers else 0):
        observer.reading(frame)
        shown = SharedFrame(sequence[frame], len(watchers))
        for number, recorder in watchers:
            observer.calling(number, frame)
            recorder.show(shown, frame)
            observer.called(number)
    clocks = Clocks()
    began = perf_counter()
    observer.reading(first)
    shown = SharedFrame(sequence[first])
    mask = sequence.mask(first)
    clocks.fetching = perf_counter() - began
    for number, recorder in enumerate(recorders):
        observer.calling(number, first)
        recorder.start(shown, first, mask)
        observer.called(number)
    observer.shown(1)
    for frame in range(first + 1, stop):
        if not to_the_end and all(recorder.failure for recorder in recorders):
            break
        _follow(recorders, sequence, frame, observer, clocks)
    return clocks


def _follow(
    recorders: Sized[Recorder], sequence: Sequence, frame: int, observer: Observer, clocks: Clocks
) -> None:
    began = perf_counter()
    observer.reading(frame)
    image = sequence[frame]
    fetched = perf_counter()
    shown = SharedFrame(image, len(recorders))
    in_trackers, running = 0.0, 0
    for number, recorder in enumerate(recorders):
        if not recorder.failure:
            observer.calling(number, frame)
            in_trackers += recorder.follow(shown, frame)
            observer.called(number)
            running += 1
    reading_masks = _compare(recorders, sequence, frame, observer)
    observer.shown(frame - sequence.first_frame + 1)
    clocks.fetching += fetched - began + reading_masks
    if running:
        clocks.own.append((perf_counter() - fetched - in_trackers - reading_masks) / running)


def _compare(
    recorders: Sized[Recorder], sequence: Sequence, frame: int, observer: Observer
) -> float:
    """Compare the masks of trackers that give any with the true one, which is read once for all.

    Gives the seconds that reading took: none where no tracker segments.
    """
    segmenting = [recorder for recorder in recorders if recorder.segments and not recorder.failure]
    if not segmenting:
        return 0.0
    began = perf_counter()
    observer.reading(frame)
    truth = sequence.mask(frame)
    read = perf_counter()
    if truth is not None:
        for recorder in segmenting:
            recorder.compare(frame, truth)
    return read - began
