"""Short runs of the trackers, made for one measurement and not kept."""

from bench.evaluation.loop import run_in_lock_step
from bench.evaluation.record import Run
from bench.experiments.contestant import contestant
from datasets import Sequence, SequenceError

__all__ = ["PRESETS", "runs"]

PRESETS = ("as-written", "recommended")


def runs(sequence: Sequence, trackers: list[str]) -> list[Run]:
    """Run trackers once, arrays kept.

    Parameters
    ----------
    sequence : Sequence
        With truth.
    trackers : list of str
        Text forms.

    Raises
    ------
    SequenceError
        Where one of them fails, with the tracker's text and the reason.
    """
    entries = [(contestant(text), 0) for text in trackers]
    found = run_in_lock_step(entries, sequence, keep_arrays=True).runs
    for run in found:
        if run.failure:
            reason = run.failure.strip().splitlines()[0]
            raise SequenceError(f"{sequence.name}: {run.identity.tracker} failed: {reason}")
    return found
