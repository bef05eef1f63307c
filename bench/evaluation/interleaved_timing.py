"""Interleaved timing: trackers take turns of a few frames, each in its own process.

Other load of the machine thus affects all trackers equally. `time_interleaved` times trackers in
processes of their own (`timed_clips.py`). `take_turns` also times objects of this process that
implement `Timed`.
"""

import gc
import json
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict
from itertools import pairwise
from math import inf
from typing import NamedTuple, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.bench.evaluation.timed_clips import Clip, Setup, TurnTime
from trackmark.bench.external.worker_process import WorkerProcess
from trackmark.trackers import TrackerError
from trackmark.trackers.base.call_clock import MAX_RUN_DELAY, run_delay_share

TURN_LIMIT = 600.0
"""Time limit of a turn, including compilation [s]."""

_TURN_SECONDS = 0.002
_PASSES_SECONDS = 2.0  # time of all passes of the slowest tracker
_MIN_PASSES, _MAX_PASSES = 3, 100  # passes
_MAX_REPEATS = 3  # repetitions of a pass that other load disturbs


class TurnError(Exception):
    """Error: a tracker cannot be timed; the message has one line."""


class Reference:
    """Fixed computations, whose time shows the machine's speed during timing runs."""

    def init(self, *_: object) -> None:
        """Make the input image."""
        random = np.random.default_rng(0)
        self._image = random.integers(0, 256, (240, 320, 3), np.uint8)
        self._weights = random.random(256).astype(np.float32)

    def update(self, *_: object) -> float:
        """Perform typical computations of a tracker."""
        hue = cv2.cvtColor(self._image, cv2.COLOR_BGR2HSV)[..., 0]
        counts = np.bincount(hue.ravel(), minlength=256)
        smooth = cv2.blur(self._weights[hue], (5, 5))
        total = float(smooth.sum())
        for count in counts.tolist() * 10:
            total += count * 0.5
        return total


@contextmanager
def one_thread() -> Iterator[None]:
    """Disable OpenCV's threads and Python's garbage collector."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
        cv2.setNumThreads(threads)


class _TimedProcess:
    """Process that runs a tracker, as a `Timed`."""

    def __init__(self, setup: Setup, clips: Sequence[Clip]) -> None:
        self._revision = setup.revision
        arguments = json.dumps([asdict(setup), [asdict(clip) for clip in clips]])
        self._process = WorkerProcess(
            "trackmark.bench.evaluation.timed_clips:TimedClips", [arguments], name=setup.name
        )
        self.close = self._process.close

    def turn(self, clip_index: int, start: int, stop: int) -> TurnTime:
        """See `Timed`; raises `TurnError`."""
        try:
            reply = self._process.ask(
                TURN_LIMIT, "turn", clip_index=clip_index, start=start, stop=stop
            )
            time = TurnTime(**reply)
            if 0 < time.seconds < inf:
                return time
            reason = f"{time.seconds!r} is not a duration"
        except TrackerError as error:
            reason = str(error).partition("\n")[0]
        raise TurnError(f"as of {self._revision}, {reason}" if self._revision else reason)


def time_interleaved(setups: Sequence[Setup], clips: Sequence[Clip]) -> NDArray[np.float64]:
    """Time trackers on the same clips, in new processes.

    Return the seconds of the updates, shape (setups, passes, turns), without the warm-up.

    Raises `TurnError` if a tracker cannot be timed.
    """
    with ExitStack() as stack:
        processes = []
        for setup in setups:
            processes.append(process := _TimedProcess(setup, clips))
            stack.callback(process.close)
        return take_turns(processes, [clip.n_frames for clip in clips]).seconds


class Timed(Protocol):
    """Object that `take_turns` can time."""

    def turn(self, clip_index: int, start: int, stop: int) -> TurnTime:
        """Return the time of updates `start` to `stop`; 0 creates a new tracker."""
        ...


class Turns(NamedTuple):
    """Times without run delay (objects, passes, turns) [s]; and clip, start, stop of each turn."""

    seconds: NDArray[np.float64]
    turns: list[tuple[int, int, int]]


def take_turns(
    timed: Sequence[Timed],
    n_frames: Sequence[int],
    min_passes: int = _MIN_PASSES,
    seconds: float = _PASSES_SECONDS,
) -> Turns:
    """Time objects that take turns, after a warm-up.

    `n_frames` is the number of frames of each clip. `min_passes` is the minimum number of passes.
    `seconds` is the total time of all passes of the slowest object [s].
    """
    for limit in (2, max(n_frames)):  # compiles kernels, then fills caches
        warming = [(index, 0, min(limit, stop)) for index, stop in enumerate(n_frames)]
        sums = _pass(timed, warming, 0)[..., 0].sum(axis=1)
    passes = min(max(round(seconds / sums.max()), min_passes), _MAX_PASSES)
    # Every turn takes longer than it takes to fill the CPU caches again.
    turns_per_clip = max(1, round(sums.min() / len(n_frames) / _TURN_SECONDS))
    turns = []
    for index, stop in enumerate(n_frames):
        edges = np.linspace(0, stop, min(turns_per_clip, stop) + 1).round().astype(int)
        turns += [(index, *edge) for edge in pairwise(edges.tolist())]
    measured = [_undisturbed_pass(timed, turns, index) for index in range(passes)]
    return Turns(np.stack(measured, axis=1), turns)


def _undisturbed_pass(
    timed: Sequence[Timed], turns: Sequence[tuple[int, int, int]], first: int
) -> NDArray[np.float64]:
    """Return the seconds of a pass, shape (objects, turns).

    A pass that other load disturbs is repeated. If other load disturbs all repetitions, the one
    with the smallest run delay counts.
    """
    best, smallest_share = np.empty(0), inf
    for _ in range(1 + _MAX_REPEATS):
        times = _pass(timed, turns, first)
        share = run_delay_share(*times.sum(axis=(0, 1)).tolist())
        if share < smallest_share:
            best, smallest_share = times[..., 0], share
        if share <= MAX_RUN_DELAY:
            break
    return best


def _pass(
    timed: Sequence[Timed], turns: Sequence[tuple[int, int, int]], first: int
) -> NDArray[np.float64]:
    """Return seconds and run delays, shape (objects, turns, 2); the first one rotates by turns."""
    times = np.empty((len(timed), len(turns), 2))
    for i, turn in enumerate(turns):
        for step in range(len(timed)):
            index = (first + i + step) % len(timed)
            times[index, i] = timed[index].turn(*turn)
    return times
