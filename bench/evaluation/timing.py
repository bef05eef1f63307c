"""Timing runs: one tracker at a time, one thread, warmed up, frames decoded outside."""

import gc
from math import inf, nan
from time import perf_counter, thread_time
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from bench.evaluation.loop import walk
from bench.evaluation.observer import UNOBSERVED, Observer
from bench.evaluation.record import Run
from bench.evaluation.recorder import Recorder
from bench.experiments.contestant import Contestant
from bench.metrics.times import Times
from datasets import Sequence
from trackers import Box, Estimate, Mask
from trackers.base.sharing import SharedFrame

__all__ = ["time_run"]

WARM_UP_FRAMES = 10


def time_run(
    chosen: Contestant,
    repetition: int,
    sequence: Sequence,
    *,
    run_seconds: float = inf,
    rows: NDArray[np.float64] | None = None,
    observer: Observer = UNOBSERVED,
) -> Run:
    """Time one tracker on one sequence.

    A tracker of the same kind first runs through some frames and is thrown away, so that
    neither compilation nor cold caches are measured. OpenCV's own threads are switched off
    for the pass, and so is Python's garbage collector. Parameters are those of
    `bench.evaluation.loop.run_in_lock_step`.

    Gives a run with `times`; `bench.metrics.times.is_disturbed` tells whether they are a speed.

    Raises `SequenceError` as `bench.evaluation.loop.run_in_lock_step`.
    """
    sequence.check_runnable()
    first, n = sequence.first_frame, len(sequence)
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        warming = _Timer(chosen, repetition, sequence)
        walk([warming], sequence, min(n, first + WARM_UP_FRAMES), observer, to_the_end=False)
        gc.collect()
        gc.disable()
        timer = _Timer(chosen, repetition, sequence, run_seconds=run_seconds, rows=rows)
        walk([timer], sequence, n, observer, to_the_end=False)
    finally:
        gc.enable()
        cv2.setNumThreads(threads)
    return timer.result(timer.times())


class _Timer(Recorder):
    """A recorder that clocks the tracker's calls."""

    def __init__(
        self, chosen: Contestant, repetition: int, sequence: Sequence, **limits: Any
    ) -> None:
        super().__init__(
            chosen,
            repetition,
            sequence,
            protocol="timing",
            share=False,
            keep_arrays=False,
            **limits,
        )
        self._wall = np.full(len(sequence), nan)
        self._cpu = np.full(len(sequence), nan)
        self._initialisation = (nan, nan)

    def times(self) -> Times:
        """What the clocks said."""
        return Times(self._wall, self._cpu, *self._initialisation)

    def _initialise(self, shown: SharedFrame, box: Box, mask: Mask | None) -> None:
        tracker = self._tracker()
        self._plain_update = tracker.update
        cpu, wall = thread_time(), perf_counter()
        tracker.init(shown.image, box, mask)
        self._initialisation = (perf_counter() - wall, thread_time() - cpu)

    def _ask(self, shown: SharedFrame, frame: int) -> Estimate:
        image = shown.image
        # The wall clock inside the CPU clock: reading them must not look like waiting.
        cpu, wall = thread_time(), perf_counter()
        estimate = self._plain_update(image)
        wall_end, cpu_end = perf_counter(), thread_time()
        self._wall[frame] = wall_end - wall
        self._cpu[frame] = cpu_end - cpu
        return estimate
