"""Interleaved timing: trackers take turns of a few frames, each in its own process.

Other load of the machine thus affects all trackers equally. `time_interleaved` times trackers in
processes of their own (`timed_clips.py`). `take_turns` also times functions of this process.
"""

import gc
import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict
from functools import partial
from itertools import pairwise
from math import inf
from typing import NamedTuple, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.bench.evaluation.timed_clips import Clip, Setup, TurnTime
from trackmark.bench.external.worker_process import WorkerProcess
from trackmark.bench.metrics.times import MAX_RUN_DELAY, run_delay_share
from trackmark.trackers import TrackerError

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


def time_interleaved(setups: Sequence[Setup], clips: Sequence[Clip]) -> NDArray[np.float64]:
    """Time trackers on the same clips, in new processes.

    Return the seconds of the updates, shape (setups, passes, turns), without the warm-up.

    Raises `TurnError` if a tracker cannot be timed.
    """
    timed: list[TimedFunction] = []
    with ExitStack() as stack:
        for setup in setups:
            arguments = json.dumps([asdict(setup), [asdict(clip) for clip in clips]])
            process = WorkerProcess(
                "trackmark.bench.evaluation.timed_clips:TimedClips", [arguments], name=setup.name
            )
            stack.callback(process.close)
            timed.append(partial(_time_in_process, process, setup.revision))
        return take_turns(timed, [clip.n_frames for clip in clips]).seconds


def _time_in_process(
    process: WorkerProcess, revision: str, clip_index: int, start: int, stop: int
) -> TurnTime:
    """Return the time of a turn of a tracker in its process; raise `TurnError` if it fails."""
    try:
        reply = process.ask(TURN_LIMIT, "turn", clip_index=clip_index, start=start, stop=stop)
        time = TurnTime(**reply)
        if 0 < time.seconds < inf:
            return time
        reason = f"{time.seconds!r} is not a duration"
    except TrackerError as error:
        reason = str(error).partition("\n")[0]
    raise TurnError(f"as of {revision}, {reason}" if revision else reason)


TimedFunction: TypeAlias = Callable[[int, int, int], TurnTime]
"""Function of clip, start and stop that returns the time of the updates `start` to `stop`.

A start of 0 creates a new tracker.
"""


class Turns(NamedTuple):
    """Times without run delay (functions, passes, turns) [s]; and clip, start, stop by turn."""

    seconds: NDArray[np.float64]
    turns: list[tuple[int, int, int]]


def take_turns(
    timed: Sequence[TimedFunction],
    n_frames: Sequence[int],
    min_passes: int = _MIN_PASSES,
    seconds: float = _PASSES_SECONDS,
) -> Turns:
    """Time functions that take turns, after a warm-up.

    `n_frames` is the number of frames of each clip. `min_passes` is the minimum number of passes.
    `seconds` is the total time of all passes of the slowest one [s].
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
    timed: Sequence[TimedFunction], turns: Sequence[tuple[int, int, int]], first: int
) -> NDArray[np.float64]:
    """Return the seconds of a pass, shape (functions, turns).

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
    timed: Sequence[TimedFunction], turns: Sequence[tuple[int, int, int]], first: int
) -> NDArray[np.float64]:
    """Return seconds and run delays, by function and turn; the first one rotates."""
    times = np.empty((len(timed), len(turns), 2))
    for i, turn in enumerate(turns):
        for step in range(len(timed)):
            index = (first + i + step) % len(timed)
            times[index, i] = timed[index](*turn)
    return times
