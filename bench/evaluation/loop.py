"""The only loop over frames: runs trackers in lock step through the segments of a protocol.

Each frame is decoded or rendered once for all trackers. An error of a tracker ends its
own run only. Timing runs execute the loop once to warm up, and then until other load disturbs no
update, at most three times.
"""

import gc
from collections.abc import Callable, Iterable
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import partial
from math import inf, nan
from statistics import median
from time import perf_counter
from typing import Any

from trackmark import datasets
from trackmark.bench.evaluation.interleaved_timing import one_thread
from trackmark.bench.evaluation.recorder import Recorder, uses_shared_state
from trackmark.bench.evaluation.run_context import SharedState, in_shared_state
from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.experiments.tracker_spec import TrackerFactory, TrackerSpec, parse_tracker
from trackmark.bench.protocols import (
    ONE_PASS,
    TIMING,
    parse_protocol,
    protocol_of_key,
)
from trackmark.datasets import Sequence
from trackmark.datasets.interface import Frames, Image
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
    """Callbacks of the loop, empty by default."""

    def on_frame_read(self, frame: int) -> None:
        """Handle the event before a frame is read."""

    def on_tracker_call(self, run_index: int, frame: int) -> None:
        """Handle the event before a tracker is called."""

    def on_tracker_return(self) -> None:
        """Handle the event after a tracker has returned or raised."""

    def on_exhausted_memory(self) -> None:
        """Handle the event that the memory of this process does not suffice for a tracker."""

    def on_frames_done(self, n_frames: int) -> None:
        """Handle the event that all trackers have processed a number of frames."""


NULL_OBSERVER = Observer()


@dataclass(frozen=True)
class PassResult:
    """Runs of one pass over a sequence, and times of the harness."""

    runs: list[Run]  # in the order of the entries
    # Time of the harness per frame and tracker [s], without decoding and the trackers' calls. The
    # median over frames is robust to other load; NaN for a sequence of a single frame.
    overhead: float
    reading_seconds: float  # mean time to decode or render a frame


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
        Protocol, for example `supervised:skip_frames=10`; see docs/protocols.md.
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
    protocol_key = parse_protocol(protocol).key
    runs = [(parse_tracker(tracker), repetition)]
    return run_protocol(runs, loaded, protocol_key, keep_arrays=keep_arrays).runs[0]


def run_protocol(
    runs: Iterable[tuple[TrackerSpec, int]],
    sequence: Sequence,
    protocol: str = ONE_PASS,
    *,
    keep_arrays: bool = False,
    run_seconds: float = inf,
    raise_errors: bool = False,
    observer: Observer = NULL_OBSERVER,
) -> PassResult:
    """Run several trackers on a sequence in lock step.

    `runs` are trackers with repetitions; a timing run is alone. `protocol` is the stored
    name; `timing` measures time in a one-pass run. `keep_arrays` stores arrays, masks and maps of
    one-pass runs. `run_seconds` is the time limit of each tracker for all frames. `raise_errors`
    raises exceptions of trackers instead of storing them in runs. `observer` gets callbacks.

    Timing runs have `times`. Each image is decoded just before the update. OpenCV's threads and
    Python's garbage collector are disabled.

    Raises `SequenceError` if the sequence has no usable ground truth, or if an image is unreadable.
    """
    sequence.check_runnable()
    specs = list(runs)
    make = partial(
        _make_recorders,
        specs,
        sequence,
        protocol,
        raise_errors=raise_errors,
        on_exhausted_memory=observer.on_exhausted_memory,
    )
    make_stored = partial(make, keep_arrays=keep_arrays, run_seconds=run_seconds)
    uses_state = any(uses_shared_state(spec) for spec, _ in specs)
    with preserved_generators() if uses_state else nullcontext():
        run = partial(_run, make, make_stored, sequence, protocol, observer)
        return in_shared_state(run, may_share=uses_state)


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
        whole_pass = _SequencePass(recorders, sequence, observer, state)
        if protocol_of_key(protocol).time_dependent:  # compiles kernels before time is measured
            _SequencePass(make(), sequence, observer, state).run(warm_up, to_the_end=False)
        if any(len(recorder.segments) > 1 for recorder in recorders):
            sequence.frames = FrameCache(frames, MAX_SEGMENT_BYTES)
        whole_pass.run()
        last = len(sequence) - 1
        for recorder in recorders:
            observer.on_tracker_call(recorder.run_index, last)
            recorder.finish(last)
            observer.on_tracker_return()
    finally:
        sequence.frames = frames
    overhead = median(whole_pass.overheads) if whole_pass.overheads else nan
    runs = [recorder.result() for recorder in recorders]
    return PassResult(runs, overhead, whole_pass.fetching / max(whole_pass.fetched, 1))


def _make_recorders(
    runs: list[tuple[TrackerSpec, int]],
    sequence: Sequence,
    protocol: str,
    **options: Any,
) -> list[Recorder]:
    """Create the recorders, which share a clock."""
    options["clock"] = CallClock()
    return [Recorder(index, *run, sequence, protocol, **options) for index, run in enumerate(runs)]


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
        if best is None or times.run_delay_share < best.metadata["run_delay_share"]:
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
        recorders: list[Recorder],
        sequence: Sequence,
        observer: Observer,
        state: SharedState,
    ) -> None:
        self._recorders, self._sequence, self._observer = recorders, sequence, observer
        self._state = state
        self.fetching, self.fetched = 0.0, 0
        self.overheads: list[float] = []

    def run(self, n_frames: int | None = None, *, to_the_end: bool = True) -> None:
        """Run trackers through their segments.

        `n_frames` is the number of frames from the init box on; None for all. `to_the_end`
        continues if all trackers have failed, because runs are only stored if all frames are
        readable.
        """
        before = 0.0
        # Trackers that start from different regions can have different segments.
        for segments in dict.fromkeys(recorder.segments for recorder in self._recorders):
            group = [recorder for recorder in self._recorders if recorder.segments == segments]
            share = len(group) / len(self._recorders)
            for segment in segments:
                self._frame_numbers = segment.frames(len(self._sequence))
                is_whole = segment.start == 0 and segment.step == 1
                self._view = view = self._sequence if is_whole else self._sequence[segment.slice]
                self._active = active = [recorder for recorder in group if not recorder.failure]
                for recorder in active:
                    recorder.begin_segment(segment, view)
                if active:
                    first = view.first_frame
                    stop = len(view) if n_frames is None else first + n_frames
                    self._start(first)
                    self._observer.on_frames_done(int(before + share))
                    for frame in range(first + 1, stop):
                        if not to_the_end and all(recorder.failure for recorder in active):
                            break
                        self._process_frame(frame, int(before + (frame - first + 1) * share))
                before += len(self._frame_numbers) * share

    def _start(self, first: int) -> None:
        """Pass the frames without target to trackers that need them; initialise all trackers."""
        view, frame_numbers, observer = self._view, self._frame_numbers, self._observer
        watchers = []
        for recorder in self._active if first else ():
            observer.on_tracker_call(recorder.run_index, frame_numbers[first])
            if recorder.watches(first):
                watchers.append(recorder)
            observer.on_tracker_return()
        for frame in range(first if watchers else 0):
            observer.on_frame_read(frame_numbers[frame])
            shared_frame = SharedFrame(view[frame], len(watchers))
            for recorder in watchers:
                observer.on_tracker_call(recorder.run_index, frame_numbers[frame])
                recorder.show(shared_frame, frame)
                observer.on_tracker_return()
        began = perf_counter()
        observer.on_frame_read(frame_numbers[first])
        shared_frame = SharedFrame(view[first])
        mask = view.mask(first)
        self.fetching += perf_counter() - began
        self.fetched += 1
        for recorder in self._active:
            observer.on_tracker_call(recorder.run_index, frame_numbers[first])
            recorder.start(shared_frame, first, mask)
            observer.on_tracker_return()
        self._state.on_frame_done()

    def _process_frame(self, frame: int, done: int) -> None:
        """Process a later frame; `done` is the number of processed frames, including this one."""
        began = perf_counter()
        observer, frame_number = self._observer, self._frame_numbers[frame]
        observer.on_frame_read(frame_number)
        image = self._view[frame]
        fetched = perf_counter()
        shared_frame = SharedFrame(image, len(self._active))
        in_trackers, running = 0.0, 0
        for recorder in self._active:
            if not recorder.failure:
                observer.on_tracker_call(recorder.run_index, frame_number)
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
        self._observer.on_frame_read(self._frame_numbers[frame])
        truth = self._view.mask(frame)
        read = perf_counter()
        if truth is not None:
            for recorder in segmenting:
                recorder.compare(frame, truth)
        return read - began


class FrameCache:
    """Cache of decoded or rendered frames, of at most `n_bytes`."""

    def __init__(self, frames: Frames, n_bytes: int) -> None:
        self.frames = frames
        self._seen: dict[int, Image] = {}
        self._left = n_bytes

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
