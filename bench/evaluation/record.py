"""The record of one run: what determined it, what the tracker said, how it ended."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import Any, Literal, TypeAlias

from numpy.typing import NDArray

__all__ = ["RESERVED_COLUMNS", "Identity", "Protocol", "Run", "Segmentation", "Times", "Trace"]

Protocol: TypeAlias = Literal["accuracy", "timing"]

Trace: TypeAlias = Literal["online", "revised"]
"""What a tracker said of each frame at once, or in the end."""

RESERVED_COLUMNS = frozenset(
    ["frame", "x", "y", "width", "height", "visible", "confidence"]
    + ["wall_seconds", "cpu_seconds", "region_similarity", "contour_accuracy"]
)
"""Columns of our own, of which some runs lack some; a tracker's details have other names."""


@dataclass(frozen=True)
class Identity:
    """Everything that determines a run. Equal identities give equal boxes.

    Attributes
    ----------
    tracker : str
        Canonical text form: name, preset unless it is the default, changed parameters.
    tracker_name : str
        The name alone; the seed depends on it.
    preset : str
        Where the parameters start from.
    parameters : mapping of str to value
        All parameters, the defaults too.
    tracker_version : mapping
        `source` (its sealed version, or a digest of the syntax trees of the tracker's file and
        of the shared modules it imports) and `libraries` (version by distribution).
    sequence : str
        Canonical name.
    fingerprint : str
        The sequence's.
    repetition : int
        From 0.
    protocol : {'accuracy', 'timing'}
        What was asked: boxes, or times.
    init : str
        Truth that the tracker was initialised with and is scored by: `boxes`, or the name
        of one of the sequence's regions.
    """

    tracker: str
    tracker_name: str
    preset: str
    parameters: Mapping[str, Any]
    tracker_version: Mapping[str, Any]
    sequence: str
    fingerprint: str
    repetition: int
    protocol: Protocol
    init: str = "boxes"

    @cached_property
    def digest(self) -> str:
        """16 hexadecimal digits over all of it."""
        return _digest(asdict(self))

    @cached_property
    def version(self) -> str:
        """16 hexadecimal digits over all but the repetition: what a mean may be taken over."""
        return _digest({key: value for key, value in asdict(self).items() if key != "repetition"})


def _digest(determining: Mapping[str, Any]) -> str:
    text = json.dumps(determining, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


@dataclass(frozen=True)
class Times:
    """Times of a timing run, in seconds.

    Attributes
    ----------
    wall, cpu : ndarray of float64, shape (n,)
        Time in `update` alone, by frame; NaN where it was not called.
    initialisation_wall, initialisation_cpu : float
        Time in `init`.
    """

    wall: NDArray[Any]
    cpu: NDArray[Any]
    initialisation_wall: float
    initialisation_cpu: float


@dataclass(frozen=True)
class Segmentation:
    """How a tracker's masks agree with the true ones.

    Attributes
    ----------
    region_similarity, contour_accuracy : ndarray of float64, shape (n,)
        In [0, 1], by frame; NaN where there is no true mask, up to the frame of initialisation,
        before the tracker's first mask, and after a failure. See `bench.metrics.regions`.
    """

    region_similarity: NDArray[Any]
    contour_accuracy: NDArray[Any]


@dataclass(frozen=True)
class Run:
    """One tracker, one sequence, one repetition.

    Attributes
    ----------
    identity : Identity
        What determined it.
    boxes : ndarray of float64, shape (n, 4)
        Online boxes, in pixels. The frame of initialisation holds the given box, frames
        before it and frames after a failure NaN.
    visible : ndarray of bool, shape (n,)
        Whether the tracker said that it sees the target.
    confidence : ndarray of float64, shape (n,)
        In [0, 1], NaN where it gave none.
    details : mapping of str to ndarray of float64, shape (n,)
        The tracker's own numbers, NaN where it gave none.
    failure : str
        Empty for a finished run; else what went wrong (frame, reason and traceback).
    revised : ndarray of float64, shape (n, 4), or None
        Boxes with the tracker's later corrections; None where it made none.
    arrays : mapping of int to mapping of str to ndarray
        By frame, where they were asked for; masks are among them as `mask`.
    segmentation : Segmentation or None
        Of a tracker that gave masks, on a sequence that has them; not in timing runs.
    times : Times or None
        In timing runs.
    circumstances : mapping of str to value
        What did not determine it: date, host, libraries, where the sequence was opened from, …
    output : str
        The end of what a failed tracker printed.
    """

    identity: Identity
    boxes: NDArray[Any]
    visible: NDArray[Any]
    confidence: NDArray[Any]
    details: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    failure: str = ""
    revised: NDArray[Any] | None = None
    arrays: Mapping[int, Mapping[str, NDArray[Any]]] = field(default_factory=dict)
    segmentation: Segmentation | None = None
    times: Times | None = None
    circumstances: Mapping[str, Any] = field(default_factory=dict)
    output: str = ""

    @property
    def status(self) -> Literal["finished", "failed"]:
        """How it ended."""
        return "failed" if self.failure else "finished"

    def boxes_in(self, trace: Trace) -> NDArray[Any]:
        """Boxes of a trace, shape (n, 4); both are the same where nothing was corrected."""
        return self.boxes if trace == "online" or self.revised is None else self.revised

    def __repr__(self) -> str:
        key = self.identity
        return f"<Run {key.tracker} on {key.sequence}, repetition {key.repetition}: {self.status}>"
