"""Timing runs: one tracker at a time, one thread, warmed up, frames decoded outside.

Each is timed twice: *as decoded*, when an image was made just before the update and has taken the
caches, which is what a user waits for; and *warm*, on the same images in memory, which is what the
tracker itself costs and what trackers are compared by. Around and between stands a reference.
"""

import gc
from dataclasses import replace
from math import inf, nan
from statistics import median
from time import perf_counter, thread_time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.evaluation.loop import walk
from trackmark.bench.evaluation.observer import UNOBSERVED, Observer
from trackmark.bench.evaluation.record import Run
from trackmark.bench.evaluation.recorder import Recorder
from trackmark.bench.evaluation.turns import Reference, one_thread
from trackmark.bench.experiments.contestant import Contestant
from trackmark.bench.metrics.times import Times
from trackmark.datasets import Sequence
from trackmark.datasets.interface import Frames, Image
from trackmark.trackers import Box, Estimate, Mask
from trackmark.trackers.base.sharing import SharedFrame

WARM_UP_FRAMES = 10
REFERENCE_CALLS = 15
MOST_BYTES = 1 << 29
"""Of images that are held in memory: a longer sequence is timed warm as far as they reach."""


class Remembered:
    """Frames that are decoded or rendered once, and kept as far as `most` bytes reach."""

    def __init__(self, frames: Frames, most: float = inf) -> None:
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
    compilation is not measured. OpenCV's own threads are switched off for the passes, and so is
    Python's garbage collector. Parameters are those of `bench.evaluation.loop.run_in_lock_step`.

    Gives the run of the first pass, as decoded, with `times` of both;
    `bench.metrics.times.is_disturbed` tells whether they are a speed. Circumstances have
    `reference_seconds`, CPU times of a fixed piece of work before, between and after the passes:
    where they differ, or differ from those of other runs, the machine was not the same.

    Raises `SequenceError` as `bench.evaluation.loop.run_in_lock_step`.
    """
    sequence.check_runnable()
    first, n = sequence.first_frame, len(sequence)
    frames, kept = sequence.frames, Remembered(sequence.frames, MOST_BYTES)
    try:
        with one_thread():
            warming = _Timer(chosen, repetition, sequence)
            walk([warming], sequence, min(n, first + WARM_UP_FRAMES), observer, to_the_end=False)
            gc.collect()
            sequence.frames = kept
            machine = [_reference_seconds()]
            timer, warm = (
                _Timer(chosen, repetition, sequence, run_seconds=run_seconds, rows=own)
                for own in (rows, None)
            )
            walk([timer], sequence, n, observer, to_the_end=False)
            machine.append(_reference_seconds())
            if not timer.failure:
                stop = next((frame for frame in range(first, n) if frame not in kept), n)
                walk([warm], sequence, max(stop, first + 1), observer, to_the_end=False)
                machine.append(_reference_seconds())
    finally:
        sequence.frames = frames
    timer.failure = timer.failure or warm.failure
    run = timer.result(timer.times(warm))
    return replace(run, circumstances={**run.circumstances, "reference_seconds": machine})


def _reference_seconds() -> float:
    """CPU time of the reference, a median."""
    reference, seconds = Reference(), []
    reference.init()
    for _ in range(REFERENCE_CALLS):
        began = thread_time()
        reference.update()
        seconds.append(thread_time() - began)
    return median(seconds)


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

    def times(self, warm: "_Timer") -> Times:
        """What the clocks said, and those of the warm pass."""
        return Times(self._wall, self._cpu, *self._initialisation, warm._wall, warm._cpu)

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
