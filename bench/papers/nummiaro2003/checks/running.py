"""Short runs of the tracker, made for one measurement and not kept."""

from bench.evaluation.loop import run_in_lock_step
from bench.evaluation.record import Run
from bench.experiments.contestant import contestant, run_seed
from datasets import Sequence, SequenceError
from datasets.text_form import format_text
from trackers.base.catalogue import create
from trackers.nummiaro2003 import Nummiaro2003

__all__ = ["PRESETS", "runs", "tracker"]

PRESETS = ("as-written", "recommended")


def runs(sequence: Sequence, options: list[dict[str, str]], repetition: int = 0) -> list[Run]:
    """Run the tracker with each set of options, arrays kept.

    Raises
    ------
    SequenceError
        Where one of them fails, with the tracker's text and the reason.
    """
    entries = [(contestant(format_text("nummiaro2003", chosen)), repetition) for chosen in options]
    found = run_in_lock_step(entries, sequence, keep_arrays=True).runs
    for run in found:
        if run.failure:
            reason = run.failure.strip().splitlines()[0]
            raise SequenceError(f"{sequence.name}: {run.identity.tracker} failed: {reason}")
    return found


def tracker(sequence: Sequence, repetition: int, **options: str | float) -> Nummiaro2003:
    """The tracker with the random numbers of a repetition, before any frame."""
    name = "nummiaro2003"
    made = create(name, run_seed(name, sequence.name, repetition), **options)
    assert isinstance(made, Nummiaro2003)
    return made
