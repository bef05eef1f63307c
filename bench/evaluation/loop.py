"""The only loop over frames: runs trackers in lock step through the segments of a protocol.

Each frame is decoded or rendered once for all trackers. An error of a tracker ends its
own run only. Timing runs execute the loop once to warm up, and then until other load disturbs no
update, at most three times.
"""

import gc
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from functools import partial
from math import inf, nan
from time import perf_counter

from trackmark import datasets
from trackmark.bench.evaluation.interleaved_timing import one_thread
from trackmark.bench.evaluation.recorder import NULL_OBSERVER, Observer, Recorder, uses_shared_state
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

MAX_CACHED_BYTES = 1 << 28
"""Maximum size of the images that are kept for the next segment or pass [bytes]."""

MAX_TIMED_PASSES = 3
"""Maximum number of passes of a timing run."""


@dataclass(frozen=True)
class PassResult:
    """Runs of one pass over a sequence."""

    runs: list[Run]  # in the order of the trackers
    reading_seconds: float  # mean time to decode or render a frame; NaN for a timing run


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
    uses_state = any(uses_shared_state(spec) for spec, _ in specs)

    def make_pass(state: SharedState) -> _SequencePass:
        clock = CallClock()
        recorders = [
            Recorder(
                index,
                spec,
                repetition,
                sequence,
                protocol,
                keep_arrays=keep_arrays,
                run_seconds=run_seconds,
                raise_errors=raise_errors,
                observer=observer,
                clock=clock,
                state=state,
            )
            for index, (spec, repetition) in enumerate(specs)
        ]
        return _SequencePass(recorders, sequence, observer, state)

    def run(state: SharedState) -> PassResult:
        if protocol == TIMING:
            with one_thread():
                return PassResult([_time(partial(make_pass, state))], nan)
        if protocol_of_key(protocol).time_dependent:
            make_pass(state).warm_up()
        return make_pass(state).complete()

    with preserved_generators() if uses_state else nullcontext():
        return in_shared_state(run, may_share=uses_state)


def _time(make_pass: "Callable[[], _SequencePass]") -> Run:
    """Time a tracker in passes over the sequence until other load disturbs none of its updates.

    Returns the run of the pass that other load disturbed least.
    """
    make_pass().warm_up()
    best: Run | None = None
    for _ in range(MAX_TIMED_PASSES):
        timed_pass = make_pass()
        (recorder,) = timed_pass.recorders
        gc.collect()
        timed_pass.run(to_the_end=False)
        recorder.release()
        run = replace(recorder.result(), times=(times := recorder.times()))
        if best is None or times.run_delay_share < best.metadata["run_delay_share"]:
            best = run
        if run.failure or not times.is_disturbed:
            return run
    assert best is not None
    return best


class _SequencePass:
    """Pass of trackers through their segments in lock step."""

    def __init__(
        self,
        recorders: list[Recorder],
        sequence: Sequence,
        observer: Observer,
        state: SharedState,
    ) -> None:
        self.recorders = recorders
        self._sequence, self._observer, self._state = sequence, observer, state
        self._n_read, self._reading_seconds = 0, 0.0  # of frames and masks from the init box on

    def warm_up(self) -> None:
        """Run trackers on a few frames, which compiles kernels before time is measured."""
        n_after_init = len(self._sequence) - self._sequence.first_frame
        self.run(min(WARM_UP_FRAMES, n_after_init), to_the_end=False)
        for recorder in self.recorders:
            recorder.release()

    def complete(self) -> PassResult:
        """Run trackers on all frames; return their runs with the corrections of their boxes."""
        last = len(self._sequence) - 1
        is_read_again = any(len(recorder.segments) > 1 for recorder in self.recorders)
        with cached_frames(self._sequence) if is_read_again else nullcontext():
            self.run()
            for recorder in self.recorders:
                recorder.finish(last)
        runs = [recorder.result() for recorder in self.recorders]
        return PassResult(runs, self._reading_seconds / max(self._n_read, 1))

    def run(self, n_frames: int | None = None, *, to_the_end: bool = True) -> None:
        """Run trackers through their segments.

        `n_frames` is the number of frames from the init box on; None for all. `to_the_end`
        continues if all trackers have failed, because runs are only stored if all frames are
        readable.
        """
        n_done = 0.0
        # Trackers that start from different regions can have different segments.
        for segments in dict.fromkeys(recorder.segments for recorder in self.recorders):
            group = [recorder for recorder in self.recorders if recorder.segments == segments]
            share = len(group) / len(self.recorders)
            for segment in segments:
                self._frame_numbers = segment.frames(len(self._sequence))
                is_whole = segment.start == 0 and segment.step == 1
                self._view = view = self._sequence if is_whole else self._sequence[segment.slice]
                self._active = [recorder for recorder in group if not recorder.failure]
                for recorder in self._active:
                    recorder.begin_segment(segment, view)
                if self._active:
                    first = view.first_frame
                    stop = len(view) if n_frames is None else first + n_frames
                    self._start(first, int(n_done))
                    # An initialisation can take as long as its limit, and so can the next update.
                    self._observer.on_frame(self._frame_numbers[first], int(n_done + share))
                    for frame in range(first + 1, stop):
                        if not to_the_end and all(recorder.failure for recorder in self._active):
                            break
                        self._process_frame(frame)
                        done = int(n_done + (frame - first + 1) * share)
                        self._observer.on_frame(self._frame_numbers[frame], done)
                n_done += len(self._frame_numbers) * share

    def _start(self, first: int, n_done: int) -> None:
        """Pass the frames without target to trackers that need them; initialise all trackers."""
        watchers = [recorder for recorder in self._active if first and recorder.watches(first)]
        for frame in range(first if watchers else 0):
            self._observer.on_frame(self._frame_numbers[frame], n_done)
            shared_frame = SharedFrame(self._view[frame], len(watchers))
            for recorder in watchers:
                recorder.show(shared_frame, frame)
        self._observer.on_frame(self._frame_numbers[first], n_done)
        began = perf_counter()
        shared_frame = SharedFrame(self._view[first])
        mask = self._view.mask(first)
        self._reading_seconds += perf_counter() - began
        self._n_read += 1
        for recorder in self._active:
            recorder.start(shared_frame, first, mask)
        self._state.on_frame_done()

    def _process_frame(self, frame: int) -> None:
        """Show a later frame to the trackers, and compare their masks with the ground truth."""
        began = perf_counter()
        image = self._view[frame]
        self._reading_seconds += perf_counter() - began
        self._n_read += 1
        shared_frame = SharedFrame(image, len(self._active))
        for recorder in self._active:
            if not recorder.failure:
                recorder.follow(shared_frame, frame)
        segmenting = [r for r in self._active if r.gives_masks and not r.failure]
        if segmenting:
            began = perf_counter()
            truth = self._view.mask(frame)
            self._reading_seconds += perf_counter() - began
            if truth is not None:
                for recorder in segmenting:
                    recorder.compare(frame, truth)
        self._state.on_frame_done()


@contextmanager
def cached_frames(sequence: Sequence) -> Iterator[None]:
    """Keep the frames of a sequence that are read first, up to `MAX_CACHED_BYTES`."""
    frames = sequence.frames
    sequence.frames = _FrameCache(frames)
    try:
        yield
    finally:
        sequence.frames = frames


class _FrameCache:
    """Frames of a sequence, of which those that were read first are kept."""

    def __init__(self, frames: Frames) -> None:
        self._frames = frames
        self._kept: dict[int, Image] = {}
        self._n_free_bytes = MAX_CACHED_BYTES

    def __len__(self) -> int:
        return len(self._frames)

    def __getitem__(self, frame: int) -> Image:
        if frame in self._kept:
            return self._kept[frame]
        image = self._frames[frame]
        self._n_free_bytes -= image.nbytes
        if self._n_free_bytes >= 0:
            self._kept[frame] = image
        return image
