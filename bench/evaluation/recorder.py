"""One tracker in a pass: made, asked frame by frame, its answers checked and kept.

Here, and only here, a tracker's exceptions are caught: they are the result of its run.
"""

import traceback
from collections.abc import Callable, Mapping
from math import inf, isnan, nan
from statistics import median
from time import perf_counter, thread_time
from typing import Any, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.bench.evaluation.observer import NotAttributableError
from trackmark.bench.evaluation.record import RESERVED_COLUMNS, Run
from trackmark.bench.evaluation.reference import reference
from trackmark.bench.experiments.contestant import Contestant, identify, run_seed
from trackmark.bench.metrics.regions import Segmentation, contour_accuracy, region_similarity
from trackmark.bench.metrics.times import Times
from trackmark.bench.protocols import STORED_ONCE
from trackmark.datasets import Sequence
from trackmark.trackers import Box, Estimate, Finisher, Mapper, Mask, Tracker, Watcher
from trackmark.trackers.base.sharing import SharedFrame, SharingTracker

R = TypeVar("R")

MAP = "map."
"""What the names of maps begin with among the arrays of a run."""

COLUMNS = 6
"""Box, visibility, confidence: what is kept of every frame."""

LONGEST_REASON = 1_000
LONGEST_TRACEBACK = 20_000
"""Characters that are kept of what a tracker raises."""

_NUMBERS = "fiubO"  # kinds of arrays: real numbers, or objects that become some

_NO_MEMORY = -4  # OpenCV's Error::StsNoMem

# Ctrl-C is the user's; everything else that escapes a tracker, sys.exit too, is its own.
_OURS = (KeyboardInterrupt, GeneratorExit)


class MalformedEstimateError(ValueError):
    """What a tracker returned is no estimate."""


class Recorder:
    """One tracker in a pass, and what it has said so far.

    `chosen`: the tracker. `repetition`: from 0. `sequence`: its images are not asked for here.
    `protocol`: what is asked. `share`: let the tracker share work on a frame, where it can.
    `keep_arrays`: keep arrays, masks and maps. `alone`: whether no other tracker runs in this
    process meanwhile. If one does, a lack of memory may be its doing. `run_seconds`: what the
    tracker may take for all frames together. `rows`: where boxes, visibility and confidence are
    kept, frame by frame; see `bench.store.unfinished`, shape (n, 6).

    `failure` says why the tracker is no longer asked, and is empty while it is; `seconds` what it
    has taken so far by the wall clock; `segments` whether it has given a mask that counts (none
    does in timing runs).
    """

    def __init__(
        self,
        chosen: Contestant,
        repetition: int,
        sequence: Sequence,
        *,
        protocol: str = STORED_ONCE,
        share: bool,
        keep_arrays: bool,
        alone: bool = True,
        run_seconds: float = inf,
        rows: NDArray[np.float64] | None = None,
    ) -> None:
        self.failure = ""
        self.seconds = 0.0
        self._updates: list[float] = []  # seconds of CPU that each took
        self.segments = False
        if repetition < 0:
            raise ValueError(f"repetition is {repetition}; they count from 0.")
        # Settled before the tracker runs: what changes meanwhile is not what was run.
        self.identity = identify(chosen, sequence, repetition, protocol)
        self._chosen = chosen
        self._sequence = sequence
        self._given = reference(sequence, chosen.init, sequence.name).boxes
        self._share = share
        self._keep_arrays = keep_arrays
        self._alone = alone
        self._run_seconds = run_seconds
        self._rows = np.full((len(sequence), COLUMNS), nan) if rows is None else rows
        self._boxes = self._rows[:, :4]
        self._details: dict[str, NDArray[np.float64]] = {}
        self._arrays: dict[int, dict[str, NDArray[Any]]] = {}
        self._mask: Mask | None = None
        self._segmentation: Segmentation | None = None
        self._revisions: dict[int, Box] = {}
        self._first_seen = 0
        self._begun = 0  # trackers before this one, in the same run
        self._update: Callable[[SharedFrame], Estimate]
        self._made: Tracker | None = None

    def watches(self, first: int) -> bool:
        """Make the tracker; tell whether it is shown the frames before `first`."""
        return self._try(first, lambda: isinstance(self._tracker(), Watcher)) or False

    def show(self, shown: SharedFrame, frame: int) -> None:
        """Show a frame in which the target is not there yet to a tracker that watches."""
        tracker = self._tracker()
        if isinstance(tracker, Watcher) and not self.failure:
            self._try(frame, lambda: tracker.watch(shown.image))

    def start(self, shown: SharedFrame, frame: int, mask: Mask | None) -> None:
        """Make the tracker and give it the target."""
        box = self._given[frame]
        self._rows[frame] = (*box, True, nan)
        if not self.failure:
            # A tracker counts the frames that it is shown, and of those before its first box only
            # one that watches is shown any.
            self._first_seen = 0 if isinstance(self._made, Watcher) else frame
            self._try(frame, lambda: self._initialise(shown, box.copy(), mask))

    def follow(self, shown: SharedFrame, frame: int) -> float:
        """Ask for the next estimate; give the seconds that the tracker took."""
        asked = answered = perf_counter()
        cpu = thread_time()
        try:
            estimate = self._ask(shown, frame)
            answered = perf_counter()
            self._updates.append(thread_time() - cpu)
            self._take(shown, frame, estimate)
        except _OURS:
            raise
        except BaseException as error:  # noqa: BLE001  # what a tracker raises is its result
            self._fail(frame, error)
        self.seconds += answered - asked
        if self.seconds > self._run_seconds and not self.failure:
            self.fail(frame, f"the run took longer than its limit of {self._run_seconds:g} s")
        return answered - asked

    def compare(self, frame: int, truth: Mask) -> None:
        """Keep how the mask that `follow` was given agrees with the true one.

        A tracker that segments, and gives no mask for a frame, is taken to have lost the target.
        """
        if self._segmentation is None:
            n = len(self._boxes)
            self._segmentation = Segmentation(np.full(n, nan), np.full(n, nan))
        mask = np.zeros_like(truth) if self._mask is None else self._mask
        self._segmentation.region_similarity[frame] = region_similarity(mask, truth)
        self._segmentation.contour_accuracy[frame] = contour_accuracy(mask, truth)

    def finish(self, frame: int) -> None:
        """Tell a tracker that wants to know it that `frame` was the last one."""
        tracker = self._tracker()
        if isinstance(tracker, Finisher):
            self._try(frame, lambda: self._take_revision(frame, tracker.finish()))

    def result(self, times: Times | None = None) -> Run:
        """The run as it stands."""
        revised = None
        if self._revisions:
            revised = self._boxes.copy()
            for frame, box in self._revisions.items():
                revised[frame] = box
        return Run(
            identity=self.identity,
            boxes=self._boxes.copy(),
            visible=self._rows[:, 4] == 1,
            confidence=self._rows[:, 5].copy(),
            details=self._details,
            failure=self.failure,
            revised=revised,
            arrays=self._arrays,
            segmentation=self._segmentation,
            times=times,
            circumstances={"seconds": self.seconds}
            | ({"update_seconds": median(self._updates)} if self._updates else {}),
        )

    def _try(self, frame: int, call: Callable[[], R]) -> R | None:
        """Let the tracker do something before it is asked; None where it raises."""
        began = perf_counter()
        try:
            return call()
        except _OURS:
            raise
        except BaseException as error:  # noqa: BLE001  # what a tracker raises is its result
            self._fail(frame, error)
            return None
        finally:
            self.seconds += perf_counter() - began

    def _tracker(self) -> Tracker:
        if self._made is None:
            key = self.identity
            seed = run_seed(self._chosen.name, key.sequence, key.repetition, self._begun)
            self._made = self._chosen.make(seed)
        return self._made

    def _initialise(self, shown: SharedFrame, box: Box, mask: Mask | None) -> None:
        tracker = self._tracker()
        if self._share and isinstance(tracker, SharingTracker):
            self._update = tracker.update_shared
            tracker.init_shared(shown, box, mask)
        else:
            plain = tracker.update
            self._update = lambda shown: plain(shown.image)
            tracker.init(shown.image, box, mask)

    def _ask(self, shown: SharedFrame, frame: int) -> Estimate:
        """Call the tracker; the call alone counts as the tracker's time."""
        return self._update(shown)

    def _take(self, shown: SharedFrame, frame: int, estimate: Estimate) -> None:
        """Check an estimate and keep it."""
        box, confidence = _checked(estimate)
        self._mask = _checked_mask(estimate.mask, shown.image.shape[:2])
        self.segments |= self._mask is not None and self.identity.protocol == STORED_ONCE
        self._rows[frame] = (*box, bool(estimate.visible), confidence)
        for key, value in estimate.details.items():
            if key not in self._details:
                if not isinstance(key, str) or key in RESERVED_COLUMNS or not key.isprintable():
                    raise MalformedEstimateError(f"a detail can't be called {key!r}")
                self._details[key] = np.full(len(self._boxes), nan)
            self._details[key][frame] = value
        if estimate.revised:
            self._take_revision(frame, estimate.revised)
        if self._keep_arrays:
            self._keep(shown, frame, estimate)

    def _keep(self, shown: SharedFrame, frame: int, estimate: Estimate) -> None:
        """Keep what is larger than numbers: arrays, the mask, and maps, in 255ths."""
        kept = {key: np.array(value) for key, value in estimate.arrays.items()}
        if estimate.mask is not None:
            kept["mask"] = np.array(estimate.mask)
        tracker = self._tracker()
        maps = tracker.maps(shown.image) if isinstance(tracker, Mapper) else {}
        for key, weights in maps.items():
            if np.shape(weights) != shown.image.shape[:2]:
                raise MalformedEstimateError(
                    f"the map {key!r} is of shape {np.shape(weights)}, not the image's"
                )
            kept[f"{MAP}{key}"] = np.rint(255 * np.clip(weights, 0, 1)).astype(np.uint8)
        if kept:
            self._arrays[frame] = kept

    def _take_revision(self, frame: int, revised: Mapping[int, Box]) -> None:
        last = frame - self._first_seen
        for earlier, box in revised.items():
            whole = isinstance(earlier, int | np.integer) and not isinstance(earlier, bool)
            if not (whole and 0 <= earlier <= last):
                raise MalformedEstimateError(
                    f"revised frame {earlier!r} is not one of the frames 0 to {last} seen so far"
                )
            self._revisions[self._first_seen + int(earlier)] = np.array(checked_box(box))

    def fail(self, frame: int, reason: str) -> None:
        """Count the run as failed, for what the tracker did elsewhere than in its answers."""
        self.failure = f"{self._sequence.frame_name(frame)}: {reason}"

    def _fail(self, frame: int, error: BaseException) -> None:
        if not self._alone and _lacks_memory(error):
            raise NotAttributableError("the memory is exhausted") from error
        # The traceback module guards against errors that can't even be printed.
        said = " ".join(traceback.format_exception_only(error)).strip().replace("\n", " ")
        trace = "".join(traceback.format_exception(error))
        # What is wrong stands at the beginning of what is said, and at the end of a traceback.
        reason = said[:LONGEST_REASON]
        text = f"{self._sequence.frame_name(frame)}: {reason}\n{trace[-LONGEST_TRACEBACK:]}"
        # The name of a file, for one, may hold what no text file can.
        self.failure = text.encode("utf-8", "backslashreplace").decode()


def _lacks_memory(error: BaseException) -> bool:
    """Whether memory is exhausted; OpenCV has an error of its own for it."""
    return isinstance(error, MemoryError) or (
        isinstance(error, cv2.error) and error.code == _NO_MEMORY
    )


def checked_box(box: Any) -> list[float]:
    """The four numbers of a box.

    Raises `MalformedEstimateError` unless it is four finite numbers with positive width and
    height.
    """
    plain = np.asarray(box) if isinstance(box, np.ndarray) else None
    if plain is None or plain.shape != (4,) or plain.dtype.kind not in _NUMBERS:
        raise MalformedEstimateError(f"the box is {box!r}, not an array [x, y, width, height]")
    # Checked as it is kept: what is finite in another type need not be as float64.
    numbers = [float(number) for number in plain.tolist()]
    x, y, width, height = numbers
    # A NaN fails every comparison, so these also tell finite from not.
    if not (-inf < x < inf and -inf < y < inf and 0 < width < inf and 0 < height < inf):
        raise MalformedEstimateError(f"the box {numbers} is not finite with a positive size")
    return numbers


def _checked(estimate: Any) -> tuple[list[float], float]:
    """Box and confidence of an estimate."""
    if not isinstance(estimate, Estimate):
        raise MalformedEstimateError(f"update returned {estimate!r}, not an Estimate")
    confidence = float(estimate.confidence)
    if not (0.0 <= confidence <= 1.0 or isnan(confidence)):
        raise MalformedEstimateError(f"the confidence {confidence} is not in [0, 1]")
    return checked_box(estimate.box), confidence


def _checked_mask(mask: Any, shape: tuple[int, ...]) -> Mask | None:
    """The mask as a plain array; None where the tracker gave none."""
    if mask is None:
        return None
    if not isinstance(mask, np.ndarray):
        raise MalformedEstimateError(f"the mask is {type(mask).__name__}, not an array of bool")
    if mask.dtype != np.bool_ or mask.shape != shape:
        raise MalformedEstimateError(
            f"the mask is {mask.dtype} of shape {mask.shape}, not bool of the image's shape {shape}"
        )
    return np.asarray(mask)
