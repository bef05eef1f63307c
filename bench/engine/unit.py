"""What is performed in one go: a pass over one sequence with some runs in lock step."""

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

from bench.experiments.contestant import Protocol
from bench.experiments.experiment import SequenceSource

__all__ = ["Entry", "Unit"]


class Entry(NamedTuple):
    """One run of a unit.

    Attributes
    ----------
    tracker : str
        Text form, as it was asked for.
    repetition : int
        From 0.
    version : str
        What was planned: `Identity.version` of the run.
    replaces : str
        Version of the stale or failed run that lies in its place and may be replaced;
        empty where nothing lay there.
    """

    tracker: str
    repetition: int
    version: str
    replaces: str = ""


@dataclass(frozen=True)
class Unit:
    """What one process does in one go.

    Attributes
    ----------
    source : SequenceSource
        The sequence.
    entries : tuple of Entry
        Its runs. Timing units hold a single one.
    protocol : {'accuracy', 'timing'}
        What is asked.
    frames : int
        Length of the sequence.
    """

    source: SequenceSource
    entries: tuple[Entry, ...]
    protocol: Protocol
    frames: int

    @property
    def work(self) -> int:
        """Frames times trackers."""
        return self.frames * len(self.entries)

    def split(self, parts: int) -> "list[Unit]":
        """The same work in at most `parts` units of nearly equal size."""
        parts = min(parts, len(self.entries))
        bounds = [len(self.entries) * i // parts for i in range(parts + 1)]
        return [replace(self, entries=self.entries[start:stop]) for start, stop in pairwise(bounds)]
