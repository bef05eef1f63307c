"""Recorder of one run: creates and calls the tracker, validates and stores its estimates.

Exceptions of a tracker are caught only in this module and stored as the failure of its run. Errors
of the machine, such as a full disk, are raised: they are no failure of the tracker.
"""

import os
import sys
import traceback
from collections.abc import Callable, Iterable, Mapping
from itertools import chain
from math import inf, isnan, nan
from time import perf_counter
from typing import Any, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.bench.evaluation.ground_truth import (
    find_segments,
    frames_of_segments,
    select_ground_truth,
)
from trackmark.bench.evaluation.run_context import RunContext, SharedState
from trackmark.bench.evaluation.run_record import RESERVED_COLUMNS, Run
from trackmark.bench.experiments.tracker_spec import TrackerSpec, run_identity
from trackmark.bench.external.plugin import RemoteTracker
from trackmark.bench.external.process import ExternalTrackerError, exception_text
from trackmark.bench.metrics.regions import Segmentation, contour_accuracy, region_similarity
from trackmark.bench.metrics.times import RUN_DELAY_CLOCK, WALL_CLOCK, Times, time_fields
from trackmark.bench.operating_system import MachineError, machine_fault, machine_name
from trackmark.bench.protocols import (
    ONE_PASS,
    TIMING,
    Action,
    Controller,
    Segment,
    protocol_of_key,
)
from trackmark.datasets import Sequence
from trackmark.trackers import (
    Box,
    EarlyFrameTracker,
    Estimate,
    Image,
    Mask,
    RevisingTracker,
    Tracker,
    WeightMapTracker,
)
from trackmark.trackers.base.call_clock import CallClock, CallTime, device_name, synchronise
from trackmark.trackers.base.catalogue import run_seed
from trackmark.trackers.base.estimate_check import MalformedEstimateError, read_box
from trackmark.trackers.base.plain import PlainTracker, read_answer, seed_number
from trackmark.trackers.base.sharing import SharedFrame, SharingTracker

R = TypeVar("R")

MAP = "map."
"""Prefix of the names of maps among the arrays of a run."""

COLUMNS = 6
"""Number of values that are stored per frame: box, visibility, confidence."""

MAX_REASON_CHARACTERS = 1_000
MAX_TRACEBACK_CHARACTERS = 20_000
"""Maximum number of stored characters of the traceback of an exception."""

_FLOAT64 = np.dtype(np.float64)
_NO_MEMORY = -4  # OpenCV's Error::StsNoMem


def uses_shared_state(spec: TrackerSpec) -> bool:
    """Return whether a tracker may change the global generators or the folder of this process.

    The package's trackers have no global generator, or seed it before each use.
    """
    return not spec.is_built_in and not spec.is_isolated


class Observer:
    """Callbacks of a pass over a sequence, empty by default."""

    def on_frame(self, frame: int, n_done: int) -> None:
        """Handle progress: `frame` is the present frame, and `n_done` frames are done."""

    def on_tracker_return(self, run_index: int, seconds: float) -> None:
        """Handle the event that a tracker has returned or raised, after a number of seconds."""

    def on_exhausted_memory(self) -> None:
        """Handle the event that the memory of this process does not suffice for a tracker."""


NULL_OBSERVER = Observer()


class Recorder:
    """One run: a tracker on the segments of a protocol, and its estimates so far.

    `run_index` is the index of the run in its pass. For `protocol`, `keep_arrays`, `run_seconds`
    `raise_errors` and `observer`, see `run_protocol`. `clock` can be shared by runs whose calls do
    not overlap. `state` is the state of the process in the pass. `failure` is empty until the run
    fails. `seconds` is the wall time of all calls of the tracker [s].
    """

    def __init__(
        self,
        run_index: int,
        spec: TrackerSpec,
        repetition: int,
        sequence: Sequence,
        protocol: str,
        *,
        keep_arrays: bool = False,
        run_seconds: float = inf,
        raise_errors: bool = False,
        observer: Observer = NULL_OBSERVER,
        clock: CallClock,
        state: SharedState,
    ) -> None:
        if repetition < 0:
            raise ValueError(f"the repetition is {repetition}. Expected: 0 or more.")
        # Computed before the tracker runs, so that a tracker cannot affect its identity.
        self.identity = run_identity(spec, sequence, repetition, protocol)
        self.run_index = run_index
        self.failure = ""
        self.seconds = 0.0
        self.gives_masks = False  # masks are compared with the ground truth
        self._protocol = protocol_of_key(protocol)
        self.segments = find_segments(self._protocol, sequence, spec.init)
        self._frames = frames_of_segments(self._protocol, self.segments, len(sequence))
        self._spec, self._run_seconds = spec, run_seconds
        self._raise_errors = raise_errors
        self._observer = observer
        # Only one-pass runs store masks, arrays and the boxes of `finish`.
        self._complete = protocol == ONE_PASS
        self._revises = protocol in (ONE_PASS, TIMING)
        self._shares = protocol != TIMING
        self._keep_arrays = keep_arrays and self._complete
        n = sum(len(segment.frames(len(sequence))) for segment in self.segments)
        self._all_rows = np.full((n, COLUMNS), nan)
        self._stop = 0  # end row of the current segment
        self._trackers_begun = 0
        self._clock = clock
        self._updates: list[CallTime] = []
        self._inits: list[float] = []  # seconds
        self._clock_name = RUN_DELAY_CLOCK if self._clock.has_run_delay else WALL_CLOCK
        self._device = ""
        self._first_updates: list[int] = []  # index in `_updates` after each initialisation
        self._external: RemoteTracker | None = None
        self._details: dict[str, NDArray[np.float64]] = {}
        self._arrays: dict[int, dict[str, NDArray[Any]]] = {}
        self._mask: Mask | None = None
        self._segmentation: Segmentation | None = None
        self._revisions: dict[int, Box] = {}
        self._estimates: dict[int, NDArray[np.float64]] = {}  # by frame
        self._first_seen = 0
        self._controller = Controller()
        self._made: Tracker | None = None
        self._state = state
        self._context: RunContext | None = None
        self._process = os.getpid()
        self._printed = ""  # output of trackers in other processes
        self._drawn: set[str] = set()  # names of global generators

    def begin_segment(self, segment: Segment, view: Sequence) -> None:
        """Prepare the next segment, which has a new tracker; `view` is the segment's sequence."""
        self._segment, self._sequence = segment, view
        self.release()
        self._start, self._stop = self._stop, self._stop + len(view)
        self._rows = self._all_rows[self._start : self._stop]
        truth = select_ground_truth(view, self._spec.init, view.name)
        self._truth_boxes = truth.boxes
        self._controller = self._protocol.controller(truth, view.first_frame, view.image_size)

    def watches(self, first: int) -> bool:
        """Create the tracker; return whether it is an `EarlyFrameTracker`."""
        return self._call(first, lambda: isinstance(self._tracker(), EarlyFrameTracker)) or False

    def show(self, shared_frame: SharedFrame, frame: int) -> None:
        """Pass a frame in which the target has not appeared yet to an `EarlyFrameTracker`."""
        tracker = self._tracker()
        if isinstance(tracker, EarlyFrameTracker) and not self.failure:
            self._call(frame, lambda: self._in_context(tracker.watch, shared_frame.image))

    def start(self, shared_frame: SharedFrame, frame: int, mask: Mask | None) -> None:
        """Create and initialise the tracker."""
        box = self._truth_boxes[frame]
        if any(self._segment.perturbation):
            box, mask = self._segment.perturbed_box(box), None  # a mask would reveal the true box
        self._last_box: Iterable[float] = box.tolist()
        self._rows[frame] = (*box, True, nan)
        self._estimates[frame] = self._rows[frame].copy()
        if not self.failure:
            # A tracker numbers the frames that it receives. Only an `EarlyFrameTracker` receives
            # frames before the init box.
            self._first_seen = 0 if isinstance(self._made, EarlyFrameTracker) else frame
            self._call(frame, lambda: self._initialise(shared_frame, box.copy(), mask))

    def follow(self, shared_frame: SharedFrame, frame: int) -> None:
        """Process a frame as the protocol requires."""
        step = self._controller.action(frame)
        if step is Action.UPDATE:
            self._update_tracker(shared_frame, frame)
        elif step is Action.RESTART:
            self.release()
            if self.failure:
                return
            self.start(shared_frame, frame, self._sequence.mask(frame))
        if (answered := self._controller.estimate_frames) is not None and not self.failure:
            if step is Action.UPDATE:
                self._estimates[frame] = self._rows[frame].copy()
            self._rows[frame] = self._estimates[answered[frame]]

    def compare(self, frame: int, truth: Mask) -> None:
        """Compare the last mask of the tracker with the ground-truth mask.

        If the tracker returns masks, but none for this frame, an empty mask is compared.
        """
        if self._segmentation is None:
            n = len(self._rows)
            self._segmentation = Segmentation(np.full(n, nan), np.full(n, nan))
        mask = np.zeros_like(truth) if self._mask is None else self._mask
        self._segmentation.region_similarity[frame] = region_similarity(mask, truth)
        self._segmentation.contour_accuracy[frame] = contour_accuracy(mask, truth)

    def finish(self, frame: int) -> None:
        """Store the corrections of a `RevisingTracker` after the last frame of a one-pass run."""
        if self._complete and not self.failure:
            tracker = self._tracker()
            if isinstance(tracker, RevisingTracker):
                self._call(
                    frame, lambda: self._store_revisions(frame, self._in_context(tracker.finish))
                )
        self.release()

    def result(self) -> Run:
        """Return the run in its current state."""
        boxes, revised = self._all_rows[:, :4].copy(), None
        if self._revisions:
            revised = boxes.copy()
            for frame, box in self._revisions.items():
                revised[frame] = box
        metadata: dict[str, Any] = {"seconds": self.seconds}
        self._note_drawn()
        if self._drawn:
            metadata["generators"] = sorted(self._drawn)
        if self._updates:
            metadata |= time_fields(self.times())
            metadata["clock"] = self._clock_name
            metadata["machine"] = ", ".join(filter(None, [machine_name(), self._device]))
        return Run(
            identity=self.identity,
            boxes=boxes,
            visible=self._all_rows[:, 4] == 1,
            confidence=self._all_rows[:, 5].copy(),
            details=self._details,
            failure=self.failure,
            revised=revised,
            arrays=self._arrays,
            segmentation=self._segmentation,
            states=self._controller.states,
            estimate_frames=self._controller.estimate_frames,
            segments=self._frames,
            metadata=metadata,
            tracker_output=self._printed,
        )

    def times(self) -> Times:
        """Return the times of the calls so far."""
        values = np.fromiter(chain.from_iterable(self._updates), np.float64)
        seconds, run_delay, cpu, children = values.reshape(-1, len(CallTime._fields)).T
        is_first = np.zeros(len(seconds), bool)
        # An initialisation in the last frame has no update.
        is_first[[update for update in self._first_updates if update < len(seconds)]] = True
        return Times(seconds, run_delay, cpu, children, is_first, np.array(self._inits))

    def _call(self, frame: int, call: Callable[[], R]) -> R | None:
        """Return the result of a call of the tracker; None if it raises. Not used for updates."""
        began = perf_counter()
        try:
            return call()
        except KeyboardInterrupt:  # Ctrl-C; every other exception is the tracker's
            raise
        except BaseException as error:  # noqa: BLE001  # an exception is the result of the run
            self._fail(frame, error)
            return None
        finally:
            self._count_seconds(perf_counter() - began)

    def _count_seconds(self, seconds: float) -> None:
        self.seconds += seconds
        self._observer.on_tracker_return(self.run_index, seconds)

    def release(self) -> None:
        """Drop the tracker, which the run no longer needs; its process may fail until its end."""
        self._note_drawn()
        if self._made is not None:
            self._device = device_name(self._made) or self._device
        if isinstance(self._made, RemoteTracker):
            self._clock_name = self._made.clock or self._clock_name
            self._printed += self._made.printed
            try:
                self._made.close()
            except ExternalTrackerError as error:
                if not self.failure:
                    self._fail(len(self._rows) - 1, error)
        self._made = None

    def _tracker(self) -> Tracker:
        if self._made is None:
            key, index = self.identity, self._trackers_begun
            self._trackers_begun += 1
            run = self._spec.name, key.sequence, key.repetition, index
            seed = run_seed(*run, base=self._spec.base_seed)
            if self._state.needs_contexts and uses_shared_state(self._spec):
                self._context = self._state.context(seed_number(seed))
            self._made = self._in_context(self._spec.make, seed)
            if isinstance(self._made, RemoteTracker):
                self._made.keeps_arrays = self._keep_arrays
        return self._made

    def _in_context(self, call: Callable[..., R], *arguments: Any) -> R:
        """Return the result of a call in the context of the run, if the pass needs contexts.

        If the tracker has forked this process, the copy ends: it would be a second harness.
        """
        try:
            if self._context is not None and self._state.needs_contexts:
                with self._context:
                    return call(*arguments)
            return call(*arguments)
        finally:
            if os.getpid() != self._process:
                os._exit(0)

    def _note_drawn(self) -> None:
        """Note which global generators the tracker has drawn from."""
        if self._context is not None:
            self._drawn.update(self._context.generators.drawn)
        if isinstance(self._made, RemoteTracker):
            self._drawn.update(self._made.drawn)

    def _initialise(self, shared_frame: SharedFrame, box: Box, mask: Mask | None) -> None:
        tracker = self._tracker()
        self._external = tracker if isinstance(tracker, RemoteTracker) else None
        self._plain = tracker if isinstance(tracker, PlainTracker) else None
        called: Any = tracker if self._plain is None else self._plain.plain
        self._called = called
        self._has_synchronise = hasattr(type(self._called), "synchronise")
        self._shared = self._shares and isinstance(tracker, SharingTracker)
        self._first_updates.append(len(self._updates))
        argument = self._argument(shared_frame)
        if self._plain is not None:
            init = self._plain.plain_init
        else:
            init = called.init_shared if self._shared else called.init
        _, call = self._in_context(self._timed, init, argument, box, mask)
        self._inits.append(call.seconds)

    def _argument(self, shared_frame: SharedFrame) -> SharedFrame | Image:
        """Return the argument of the tracker's methods for a frame."""
        if self._shared:
            return shared_frame
        if self._plain is not None:
            return self._plain.convert(shared_frame.image)
        return shared_frame.image

    def _update_tracker(self, shared_frame: SharedFrame, frame: int) -> None:
        """Update the tracker and store its estimate."""
        saved = shared_frame.saved_seconds
        seconds = 0.0
        began = perf_counter()
        try:
            update = self._called.update_shared if self._shared else self._called.update
            estimate, call = self._in_context(self._timed, update, self._argument(shared_frame))
            seconds = perf_counter() - began
            if shared_frame.saved_seconds > saved:  # computed by another tracker before
                shared = shared_frame.saved_seconds - saved
                call = call._replace(seconds=call.seconds + shared, cpu=call.cpu + shared)
            self._updates.append(call)
            self._store_estimate(shared_frame, frame, estimate)
        except KeyboardInterrupt:  # Ctrl-C; every other exception is the tracker's
            raise
        except BaseException as error:  # noqa: BLE001  # an exception is the result of the run
            seconds = seconds or perf_counter() - began
            self._fail(frame, error)
        self._count_seconds(seconds)
        if self.failure:
            return
        if self.seconds > self._run_seconds:
            self.fail(frame, f"the run took longer than its limit of {self._run_seconds:g} s")
        elif reason := self._controller.check_estimate(frame, self._rows[frame], call.seconds):
            self.fail(frame, reason)

    def _timed(self, call: Callable[..., R], *arguments: Any) -> tuple[R, CallTime]:
        """Return the result and the times of a call of the tracker."""
        if self._external is not None:
            return call(*arguments), self._external.call_time
        self._clock.start()
        result = call(*arguments)
        if self._has_synchronise or "torch" in sys.modules:
            synchronise(self._called)
        return result, self._clock.stop()

    def _store_estimate(self, shared_frame: SharedFrame, frame: int, estimate: Any) -> None:
        """Validate and store the estimate that `update` returned."""
        if row := _usual_row(estimate):
            self._last_box, self._mask, details = row[:4], None, estimate.details
            self._rows[frame] = row
        else:
            fields = read_answer(self._made, estimate, shared_frame.image.shape)
            self._last_box = fields["box"] or self._last_box
            self._mask, details = fields["mask"], fields["details"]
            self.gives_masks |= self._complete and self._mask is not None
            self._rows[frame] = (*self._last_box, fields["visible"], fields["confidence"])
        for key, value in details.items():
            if key not in self._details:
                if key in RESERVED_COLUMNS or not key.isprintable():
                    raise MalformedEstimateError(
                        f"the name {key!r} of a detail is reserved or not printable text"
                    )
                self._details[key] = np.full(len(self._all_rows), nan)
            self._details[key][self._start + frame] = value
        if isinstance(estimate, Estimate) and estimate.revised:
            self._store_revisions(frame, estimate.revised)
        if self._keep_arrays:
            arrays = estimate.arrays if isinstance(estimate, Estimate) else {}
            self._store_arrays(shared_frame, frame, arrays)

    def _store_arrays(
        self, shared_frame: SharedFrame, frame: int, returned: Mapping[str, NDArray[Any]]
    ) -> None:
        """Store the arrays of an estimate, its mask and maps; maps as uint8, 255 for 1."""
        arrays = {key: np.array(value) for key, value in returned.items()}
        if self._mask is not None:
            arrays["mask"] = np.array(self._mask)
        tracker = self._tracker()
        maps: Mapping[str, NDArray[Any]] = {}
        if isinstance(tracker, WeightMapTracker):
            maps = self._in_context(tracker.maps, shared_frame.image)
        for key, weights in maps.items():
            if np.shape(weights) != shared_frame.image.shape[:2]:
                raise MalformedEstimateError(
                    f"the map {key!r} has shape {np.shape(weights)}. Expected: the image's shape"
                )
            arrays[f"{MAP}{key}"] = np.rint(255 * np.clip(weights, 0, 1)).astype(np.uint8)
        if arrays:
            self._arrays[frame] = arrays

    def _store_revisions(self, frame: int, revised: Mapping[int, Box]) -> None:
        if not self._revises:
            return
        last = frame - self._first_seen
        for earlier, box in revised.items():
            is_integer = isinstance(earlier, int | np.integer) and not isinstance(earlier, bool)
            if not (is_integer and 0 <= earlier <= last):
                raise MalformedEstimateError(
                    f"revised frame {earlier!r} is not one of the processed frames 0 to {last}"
                )
            self._revisions[self._first_seen + int(earlier)] = np.array(read_box(box))

    def fail(self, frame: int, reason: str) -> None:
        """Mark the run as failed, for a reason other than an exception."""
        self.failure = f"{self._sequence.frame_name(frame)}: {reason}"

    def _fail(self, frame: int, error: BaseException) -> None:
        if self._external is not None and isinstance(error, MalformedEstimateError):
            error = self._external.reject(error)
        if self._raise_errors:
            error.add_note(f"{self.identity.tracker} on {self._sequence.name}, frame {frame}")
            raise error
        if _lacks_memory(error):
            self._observer.on_exhausted_memory()
        if fault := machine_fault(error):
            run = f"{self.identity.tracker} on {self._sequence.name}"
            raise MachineError(f"{run}, {self._sequence.frame_name(frame)}: {fault}") from error
        message, stack_trace = exception_text(error), "".join(traceback.format_exception(error))
        if isinstance(error, ExternalTrackerError):  # the stack of the harness is of no interest
            message, stack_trace = str(error).partition("\n")[0], str(error)
        # The relevant parts are the start of a message and the end of a traceback.
        reason = message[:MAX_REASON_CHARACTERS]
        frame_name = self._sequence.frame_name(frame)
        failure = f"{frame_name}: {reason}\n{stack_trace[-MAX_TRACEBACK_CHARACTERS:]}"
        # The text may contain surrogates, for example in file names.
        self.failure = failure.encode("utf-8", "backslashreplace").decode()


def _usual_row(estimate: Any) -> tuple[float, ...] | None:
    """Return the row of a valid `Estimate` whose fields have the usual types; None for others.

    `read_estimate` accepts the same values, but takes 4 µs.
    """
    if type(estimate) is not Estimate:
        return None
    box, confidence = estimate.box, estimate.confidence
    if (
        type(box) is not np.ndarray
        or box.dtype is not _FLOAT64
        or box.shape != (4,)
        or type(estimate.visible) is not bool
        or type(confidence) is not float
        or estimate.mask is not None
        or type(estimate.details) is not dict
        or (estimate.details and not _are_plain(estimate.details))
    ):
        return None
    x, y, width, height = box.tolist()
    is_valid = -inf < x < inf and -inf < y < inf and 0 < width < inf and 0 < height < inf
    if not is_valid or not (0.0 <= confidence <= 1.0 or isnan(confidence)):
        return None
    return x, y, width, height, estimate.visible, confidence


def _are_plain(details: Mapping[Any, Any]) -> bool:
    """Return whether details are floats by text, which need no conversion."""
    return all(type(key) is str and type(details[key]) is float for key in details)


def _lacks_memory(error: BaseException) -> bool:
    """Return whether an exception reports exhausted memory, also from OpenCV."""
    return isinstance(error, MemoryError) or (
        isinstance(error, cv2.error) and error.code == _NO_MEMORY
    )
