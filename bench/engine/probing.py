"""How long trackers take, from the first frames of a sequence; nothing is kept."""

from dataclasses import dataclass
from math import nan

import datasets
from bench.engine.unit import Unit
from bench.evaluation.loop import run_in_lock_step
from bench.evaluation.watch import UNWATCHED, Watch
from bench.experiments.contestant import contestants

__all__ = ["Probed", "probe"]

_SHORTEST = 2


@dataclass(frozen=True)
class Probed:
    """How long frames took.

    Attributes
    ----------
    seconds : tuple of float
        A tracker's own time for a frame, by entry of the unit; NaN where it failed.
    frame_seconds : float
        Time to decode or render a frame.
    """

    seconds: tuple[float, ...]
    frame_seconds: float


def probe(unit: Unit, frames: int, watch: Watch = UNWATCHED) -> Probed:
    """Show a unit's trackers the first frames of its sequence.

    Parameters
    ----------
    unit : Unit
        Whose trackers.
    frames : int
        How many, at least 3.
    watch : Watch
        Told what is done.
    """
    sequence = datasets.load(unit.source.text, truth=unit.source.truth)
    chosen = contestants(entry.tracker for entry in unit.entries)
    entries = [(chosen[entry.tracker], entry.repetition) for entry in unit.entries]
    first = sequence.first_frame
    # The first pass compiles kernels and fills caches; the second is what a beginning costs.
    _, beginning, whole = (
        run_in_lock_step(entries, sequence[first : first + n], watch=watch)
        for n in (_SHORTEST, _SHORTEST, frames)
    )
    counted = max(1, min(frames, len(sequence) - first) - _SHORTEST)
    took = [
        nan if b.failure else float(b.circumstances["seconds"] - a.circumstances["seconds"])
        for a, b in zip(beginning.runs, whole.runs, strict=True)
    ]
    return Probed(tuple(max(0.0, seconds) / counted for seconds in took), whole.frame_seconds)
