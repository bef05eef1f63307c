"""The only loop over frames: trackers in lock step through a sequence.

Each frame is decoded or rendered once and shown to every tracker. What a tracker does
wrong ends its own run and nobody else's.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from math import nan
from statistics import median
from time import perf_counter

import datasets
from bench.contestant import Contestant, TrackerMaker, contestant
from bench.record import Run
from bench.recorder import Recorder
from datasets import Sequence
from trackers.base.sharing import SharedFrame

__all__ = ["Pass", "evaluate", "run_in_lock_step"]


def evaluate(
    tracker: str | TrackerMaker,
    sequence: str | Sequence,
    repetition: int = 0,
    *,
    keep_arrays: bool = False,
) -> Run:
    """Run one tracker through one sequence, once (one-pass evaluation).

    The tracker is initialised with the truth of the first frame in which the target is
    present, and updated on every later frame. With `init=REGION` in its text it is
    initialised with, and scored by, that region of the sequence instead of its boxes.

    Parameters
    ----------
    tracker : str or callable
        Text form such as `camshift:window=adaptive`, or a callable that makes a tracker
        from a `numpy.random.SeedSequence`.
    sequence : str or Sequence
        What to run on; text is passed to `datasets.load`.
    repetition : int
        From 0; another repetition has other random numbers.
    keep_arrays : bool
        Keep `Estimate.arrays` and masks of every frame.

    Returns
    -------
    Run
        With status `failed` where the tracker raised or returned a malformed estimate.

    Raises
    ------
    TrackerError, SequenceError
        For what can't be run: unknown names or parameters, no truth, an unreadable image.
    """
    loaded = datasets.load(sequence) if isinstance(sequence, str) else sequence
    chosen = contestant(tracker)
    return run_in_lock_step([(chosen, repetition)], loaded, keep_arrays=keep_arrays).runs[0]


@dataclass(frozen=True)
class Pass:
    """What one pass over a sequence gave.

    Attributes
    ----------
    runs : list of Run
        In the order of the contestants.
    overhead : float
        Seconds that the harness itself took, per frame and tracker: everything but
        decoding and the trackers' own calls. The median over frames, which other load on
        the machine hardly touches; NaN for a sequence of a single frame.
    """

    runs: list[Run]
    overhead: float


def run_in_lock_step(
    entries: Iterable[tuple[Contestant, int]],
    sequence: Sequence,
    *,
    share: bool = True,
    keep_arrays: bool = False,
    progress: Callable[[int], None] | None = None,
) -> Pass:
    """Run several trackers through a sequence together.

    Parameters
    ----------
    entries : iterable of (Contestant, int)
        Trackers with their repetitions.
    sequence : Sequence
        With truth.
    share : bool
        Give trackers that can share work a common store for each frame. The boxes are the
        same without.
    keep_arrays : bool
        Keep arrays and masks.
    progress : callable, optional
        Called with the number of frames done, after each.

    Raises
    ------
    SequenceError
        Where the sequence has no usable truth or an image can't be read. No run is kept then.
    """
    sequence.check_runnable()
    first, n = sequence.first_frame, len(sequence)
    recorders = [
        Recorder(chosen, repetition, sequence, share=share, keep_arrays=keep_arrays)
        for chosen, repetition in entries
    ]
    shown = SharedFrame(sequence[first])
    mask = sequence.mask(first)
    for recorder in recorders:
        recorder.start(shown, first, mask)
    own_seconds = []
    for frame in range(first + 1, n):
        image = sequence[frame]
        began = perf_counter()
        shown = SharedFrame(image, len(recorders))
        in_trackers, running = 0.0, 0
        for recorder in recorders:
            if not recorder.failure:
                in_trackers += recorder.follow(shown, frame)
                running += 1
        if progress is not None:
            progress(frame - first + 1)
        if running:
            own_seconds.append((perf_counter() - began - in_trackers) / running)
    overhead = median(own_seconds) if own_seconds else nan
    return Pass([recorder.result() for recorder in recorders], overhead)
