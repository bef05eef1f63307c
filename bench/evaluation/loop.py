"""The only loop over frames: runs trackers in lock step through the segments of a protocol.

Each frame is decoded or rendered once for all trackers. An error of a tracker ends its
own run only. Timing runs execute the loop once to warm up, and then until other load disturbs no
update, at most three times.
"""

import gc
from collections.abc import Callable, Iterable
from collections.abc import Sequence as Sized
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import partial
from math import inf, nan
from statistics import median
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.evaluation.interleaved_timing import one_thread
from trackmark.bench.evaluation.recorder import Recorder, blank_rows, uses_shared_state
from trackmark.bench.evaluation.run_context import SharedState, in_shared_state
from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.experiments.tracker_spec import TrackerFactory, TrackerSpec, parse_tracker
from trackmark.bench.protocols import (
    ONE_PASS,
    STORED_ONE_PASS,
    TIMING,
    parse_protocol,
    stored_protocol,
)
from trackmark.datasets import Sequence
from trackmark.datasets.interface import Frames, Image
from trackmark.trackers import Randomness
from trackmark.trackers.base.call_clock import CallClock
from trackmark.trackers.base.global_generators import preserved_generators
from trackmark.trackers.base.sharing import SharedFrame

WARM_UP_FRAMES = 10
"""Number of frames for a warm-up (compilation, caches) before time is measured."""

MAX_SEGMENT_BYTES = 1 << 28
"""Maximum size of the images that are cached for the next segment [bytes]."""

MAX_TIMED_PASSES = 3
"""Maximum number of passes of a timing run."""


class Observer:
    """Callbacks of the loop, empty by default; `bench.engine.heartbeat.Heartbeat` has others."""

    def rows(self, shape: tuple[int, int]) -> NDArray[np.float64]:
        """Return the buffer for the rows of a run that is alone in its process."""
        return blank_rows(shape)

    def on_frame_read(self, frame: int) -> None:
        """Handle the event before a frame is read."""

    def on_tracker_call(self, entry: int, frame: int) -> None:
        """Handle the event before a tracker is called."""

    def on_tracker_return(self) -> None:
        """Handle the event after a tracker has returned or raised."""

    def on_frames_done(self, frames: int) -> None:
        """Handle the event that all trackers have processed a number of frames."""

    def on_loop_end(self) -> None:
        """Handle the end of the loop."""


NULL_OBSERVER = Observer()


@dataclass(frozen=True)
class PassResult:
    """Runs of one pass over a sequence, and times of the harness."""

    runs: list[Run]  # in the order of the entries
    # Time of the harness per frame and tracker [s], without decoding and the trackers' calls. The
    # median over frames is robust to other load; NaN for a sequence of a single frame.
    overhead: float
    frame_seconds: float  # mean time to decode or render a frame


def evaluate_run(
    tracker: str | TrackerFactory,
    sequence: str | Sequence,
    repetition: int = 0,
    *,
    protocol: str = ONE_PASS,
    keep_arrays: bool = False,
) -> Run:
    """Run one tracker once on one sequence.

    By default the tracker is initialised with the ground truth of the first frame in which the
    target is present, and updated in every later frame (one-pass evaluation). If its specification
    contains `init=REGION`, this region of the sequence replaces the boxes for initialisation and
    scores.

    Parameters
    ----------
    tracker : str or callable
        Specification such as `camshift:window=adaptive`, or a callable that creates a tracker from
        a `numpy.random.SeedSequence`.
    sequence : str or Sequence
        Sequence, or its specification for `datasets.load`.
    repetition : int
        Index of the repetition, from 0, which selects the random numbers.
    protocol : str
        Protocol, for example `supervised:skip=10`; see docs/protocols.md.
    keep_arrays : bool
        True to keep `Estimate.arrays`, masks and maps of every frame (one-pass runs only).

    Returns
    -------
    Run
        Its status is `failed` if the tracker raised an exception or returned an invalid estimate.

    Raises
    ------
    TrackerError, SequenceError, ProtocolError
        For unknown names or parameters, a sequence without ground truth, or an unreadable image.
    """
    loaded = datasets.load(sequence) if isinstance(sequence, str) else sequence
    stored = parse_protocol(protocol).text
    entries = [(parse_tracker(tracker), repetition)]
    return run_protocol(entries, loaded, stored, keep_arrays=keep_arrays).runs[0]


def run_protocol(
    entries: Iterable[tuple[TrackerSpec, int]],
    sequence: Sequence,
    protocol: str = STORED_ONE_PASS,
    *,
    keep_arrays: bool = False,
    run_seconds: float = inf,
    raise_errors: bool = False,
    observer: Observer = NULL_OBSERVER,
) -> PassResult:
    """Run several trackers on a sequence in lock step.

    `entries` are trackers with repetitions; timing runs have one entry. `protocol` is the stored
    name; `timing` measures time in a one-pass run. `keep_arrays` stores arrays, masks and maps of
    one-pass runs. `run_seconds` is the time limit of each tracker for all frames. `raise_errors`
    raises exceptions of trackers instead of storing them in runs. `observer` gets callbacks.

    Timing runs have `times`. Each image is decoded just before the update. OpenCV's threads and
    Python's garbage collector are disabled.

    Raises `SequenceError` if the sequence has no usable ground truth, or if an image is unreadable.
    Raises `NotAttributableError` if one of several trackers exhausts the memory.
    """
    sequence.check_runnable()
    specs = list(entries)
    make = partial(_make_recorders, specs, sequence, protocol, raise_errors=raise_errors)
    make_stored = partial(make, observer.rows, keep_arrays=keep_arrays, run_seconds=run_seconds)
    uses_state = any(uses_shared_state(spec) for spec, _ in specs)
    seeds_state = any(
        spec.is_built_in and spec.randomness is Randomness.PROCESS for spec, _ in specs
    )
    with preserved_generators() if uses_state or seeds_state else nullcontext():
        run = partial(_run, make, make_stored, sequence, protocol, observer)
        return in_shared_state(run, may_share=uses_state and not seeds_state)


def _run(
    make: Callable[..., list[Recorder]],
    make_stored: Callable[..., list[Recorder]],
    sequence: Sequence,
    protocol: str,
    observer: Observer,
    state: SharedState,
) -> PassResult:
    """Run recorders that `make` and `make_stored` create for the warm-up and for the pass."""
    frames, warm_up = sequence.frames, min(WARM_UP_FRAMES, len(sequence) - sequence.first_frame)
    make, make_stored = partial(make, state=state), partial(make_stored, state=state)
    try:
        if protocol == TIMING:
            (warming,) = make()
            with one_thread():
                _SequencePass([warming], sequence, observer, state).run(warm_up, to_the_end=False)
                warming.release()
                return PassResult([_time(make_stored, sequence, observer, state)], nan, nan)
        recorders = make_stored()
        walk = _SequencePass(recorders, sequence, observer, state)
        if stored_protocol(protocol).time_dependent:  # compiles kernels before time is measured
            _SequencePass(make(), sequence, observer, state).run(warm_up, to_the_end=False)
        if any(len(recorder.segments) > 1 for recorder in recorders):
            sequence.frames = FrameCache(frames, MAX_SEGMENT_BYTES)
        walk.run()
        last = len(sequence) - 1
        for recorder in recorders:
            if not recorder.failure:
                observer.on_tracker_call(recorder.entry, last)
                recorder.finish(last)
                observer.on_tracker_return()
    finally:
        sequence.frames = frames
    overhead = median(walk.overheads) if walk.overheads else nan
    runs = [recorder.result() for recorder in recorders]
    return PassResult(runs, overhead, walk.fetching / max(walk.fetched, 1))


def _make_recorders(
    entries: Sized[tuple[TrackerSpec, int]],
    sequence: Sequence,
    protocol: str,
    shared_rows: Callable[[tuple[int, int]], NDArray[np.float64]] = blank_rows,
    **options: Any,
) -> list[Recorder]:
    """Create the recorders; `shared_rows` creates the rows of a run that is alone."""
    alone = len(entries) == 1
    options |= {"alone": alone, "make_rows": shared_rows if alone else blank_rows}
    options["clock"] = CallClock()
    return [
        Recorder(number, *entry, sequence, protocol, **options)
        for number, entry in enumerate(entries)
    ]


def _time(
    make: Callable[[], list[Recorder]], sequence: Sequence, observer: Observer, state: SharedState
) -> Run:
    """Time a tracker in passes over the sequence until other load disturbs none of its updates.

    Returns the run of the pass that other load disturbed least.
    """
    best: Run | None = None
    for _ in range(MAX_TIMED_PASSES):
        (recorder,) = make()
        gc.collect()
        _SequencePass([recorder], sequence, observer, state).run(to_the_end=False)
        recorder.release()
        run = replace(recorder.result(), times=(times := recorder.times()))
        if best is None or times.run_delay_share < best.circumstances["run_delay_share"]:
            best = run
        if run.failure or not times.is_disturbed:
            return run
    assert best is not None
    return best


class _SequencePass:
    """Pass of trackers through their segments in lock step, and times of the harness [s].

    `fetching` is the time to decode or render frames and masks from the init box on; `fetched` is
    the number of frames. `overheads` holds the harness time per tracker, by frame.
    """

    def __init__(
        self,
        recorders: Sized[Recorder],
        sequence: Sequence,
        observer: Observer,
        state: SharedState,
    ) -> None:
        self._recorders, self._whole, self._observer = recorders, sequence, observer
        self._state = state
        self.fetching, self.fetched = 0.0, 0
        self.overheads: list[float] = []

    def run(self, most: int | None = None, *, to_the_end: bool = True) -> None:
        """Run trackers through their segments.

        `most` is the number of frames from the init box on; None for all. `to_the_end` continues if
        all trackers have failed, because runs are only stored if all frames are readable.
        """
        before = 0.0
        # Trackers that start from different regions can have different segments.
        for segments in dict.fromkeys(recorder.segments for recorder in self._recorders):
            group = [recorder for recorder in self._recorders if recorder.segments == segments]
            share = len(group) / len(self._recorders)
            for segment in segments:
                self._numbers = segment.frames(len(self._whole))
                whole = segment.start == 0 and segment.step == 1
                self._view = view = self._whole if whole else self._whole[segment.slice]
                self._active = active = [recorder for recorder in group if not recorder.failure]
                for recorder in active:
                    recorder.begin_segment(segment, view)
                if active:
                    first = view.first_frame
                    self._start(first)
                    self._observer.on_frames_done(int(before + share))
                    for frame in range(first + 1, len(view) if most is None else first + most):
                        if not to_the_end and all(recorder.failure for recorder in active):
                            break
                        self._process_frame(frame, int(before + (frame - first + 1) * share))
                before += len(self._numbers) * share

    def _start(self, first: int) -> None:
        """Pass the frames without target to `Watcher` trackers; initialise all trackers."""
        view, numbers, observer = self._view, self._numbers, self._observer
        watchers = []
        for recorder in self._active if first else ():
            observer.on_tracker_call(recorder.entry, numbers[first])
            if recorder.watches(first):
                watchers.append(recorder)
            observer.on_tracker_return()
        for frame in range(first if watchers else 0):
            observer.on_frame_read(numbers[frame])
            shared_frame = SharedFrame(view[frame], len(watchers))
            for recorder in watchers:
                observer.on_tracker_call(recorder.entry, numbers[frame])
                recorder.show(shared_frame, frame)
                observer.on_tracker_return()
        began = perf_counter()
        observer.on_frame_read(numbers[first])
        shared_frame = SharedFrame(view[first])
        mask = view.mask(first)
        self.fetching += perf_counter() - began
        self.fetched += 1
        for recorder in self._active:
            observer.on_tracker_call(recorder.entry, numbers[first])
            recorder.start(shared_frame, first, mask)
            observer.on_tracker_return()
        self._state.on_frame_done()

    def _process_frame(self, frame: int, done: int) -> None:
        """Process a later frame; `done` is the number of processed frames, including this one."""
        began = perf_counter()
        observer, number = self._observer, self._numbers[frame]
        observer.on_frame_read(number)
        image = self._view[frame]
        fetched = perf_counter()
        shared_frame = SharedFrame(image, len(self._active))
        in_trackers, running = 0.0, 0
        for recorder in self._active:
            if not recorder.failure:
                observer.on_tracker_call(recorder.entry, number)
                in_trackers += recorder.follow(shared_frame, frame)
                observer.on_tracker_return()
                running += 1
        reading_masks = self._compare(frame)
        observer.on_frames_done(done)
        self._state.on_frame_done()
        self.fetching += fetched - began + reading_masks
        self.fetched += 1
        if running:
            overhead = perf_counter() - fetched - in_trackers - reading_masks
            self.overheads.append(overhead / running)

    def _compare(self, frame: int) -> float:
        """Compare masks with the ground-truth mask; return the time to read that mask [s]."""
        segmenting = [r for r in self._active if r.gives_masks and not r.failure]
        if not segmenting:
            return 0.0
        began = perf_counter()
        self._observer.on_frame_read(self._numbers[frame])
        truth = self._view.mask(frame)
        read = perf_counter()
        if truth is not None:
            for recorder in segmenting:
                recorder.compare(frame, truth)
        return read - began


class FrameCache:
    """Cache of decoded or rendered frames, of at most `most` bytes."""

    def __init__(self, frames: Frames, most: int) -> None:
        self.frames = frames
        self._seen: dict[int, Image] = {}
        self._left = most

    def __len__(self) -> int:
        return len(self.frames)

    def __contains__(self, frame: int) -> bool:
        return frame in self._seen

    def __getitem__(self, frame: int) -> Image:
        if frame in self._seen:
            return self._seen[frame]
        image = self.frames[frame]
        self._left -= image.nbytes
        if self._left >= 0:
            self._seen[frame] = image
        return image
