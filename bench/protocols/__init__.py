"""Protocols: start frames of a tracker, repetitions, and restarts after a failure.

A protocol is a file here. Its docstring is the definition with its source, and it exports a
subclass of `Protocol`, as `PROTOCOL`, whose fields are its knobs. A protocol lists segments, for
each of which a tracker is initialised. It may conduct a run: decide frame by frame whether the
tracker is updated, initialised again or skipped.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cache
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.metrics.native import Truth
from trackmark.datasets.spec_string import close_match, format_text, parse_text
from trackmark.trackers.base.parameters import Parameters, TrackerError

ONCE = "one-pass"
"""Name of the default protocol."""

STORED_ONCE = "accuracy"
"""Name under which its runs are stored, from the time when there was no other protocol."""

TIMING = "timing"
"""Name under which timing runs are stored: one pass with times."""

_FOLDER = Path(__file__).parent


class ProtocolError(ValueError):
    """Invalid protocol; the message names it, and the valid ones."""


@dataclass(frozen=True)
class Segment:
    """Stretch of a run: a tracker is initialised at its start, and goes on to an end.

    With start 0 and step 1 it is the whole sequence: the tracker is initialised in the first frame
    with a target. `moved` is the difference of the init box from the ground truth, in widths and
    heights of that: of the corner to the right and down, of width and height.
    """

    start: int = 0
    step: int = 1  # -1 for a tracker that goes backwards
    moved: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)

    @property
    def slice(self) -> slice:
        """Slice of the frames of a sequence."""
        return slice(self.start, None, self.step)

    def frames(self, n: int) -> range:
        """Return the numbers of its frames in a sequence of n."""
        return range(n)[self.slice]

    def given(self, box: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the init box `[x, y, width, height]` by the box of the ground truth."""
        width, height = box[2:]
        return np.asarray(box + np.array(self.moved) * (width, height, width, height))


class Step(Enum):
    """Action on a tracker at a frame."""

    ASK = "update"
    BEGIN = "initialise a new one with the ground truth"
    SKIP = "do not show the frame"


class Conduct:
    """Actions on one tracker, frame by frame after its first; this one always updates it."""

    states: NDArray[np.int32] | None = None  # (n,): a `bench.metrics.preset.State` per frame
    answered: NDArray[np.int32] | None = None  # (n,): frame of the estimate in each frame's row

    def step(self, frame: int) -> Step:
        """Return the action at a frame; called once per frame, in order."""
        return Step.ASK

    def told(self, frame: int, row: NDArray[np.float64], seconds: float) -> str:
        """Receive an estimate; return the reason if the run fails with it, otherwise "".

        `row`: x, y, width, height [px], visible (1 or 0), confidence (NaN if missing). `seconds`:
        time of the update.
        """
        return ""


class Protocol(Parameters):
    """Base of every protocol. Its fields are the knobs, with type, bounds and meaning."""

    judged: ClassVar[tuple[str, ...]] = ("one pass",)
    """Kinds of presets that judge its runs, see `bench.metrics.preset.Preset.protocol`."""

    preset: ClassVar[str] = "native"
    """Default metrics preset of its tables."""

    segmented: ClassVar[bool] = False
    """True if runs store their frames by segment, even if there is only one."""

    by_values: ClassVar[bool] = False
    """True if its segments depend on numbers of the data, see `segments`."""

    @property
    def name(self) -> str:
        """Name of the file, with hyphens."""
        return type(self).__module__.rpartition(".")[2].replace("_", "-")

    @property
    def text(self) -> str:
        """Canonical text, under which runs are stored: the name and knobs that are not default."""
        fields = type(self).model_fields
        return format_text(
            self.name, {key: value for key, value in self if value != fields[key].default}
        )

    @property
    def clocked(self) -> bool:
        """True if runs depend on the time of updates, so that nothing else may run meanwhile."""
        return False

    def segments(
        self, present: NDArray[np.bool_], values: Mapping[str, NDArray[np.float64]]
    ) -> list[Segment]:
        """Return the segments of a run; by default one, the whole sequence.

        `present`: frames with a target, shape (n,), at least one. `values`: numbers of the data, by
        name and frame.
        """
        return [Segment()]

    def conduct(self, truth: Truth, first: int, size: tuple[int, int]) -> Conduct:
        """Return the conduct of one segment; by default the tracker is asked at every frame.

        `truth`: ground truth of the init box. `first`: frame of initialisation. `size`: width and
        height of the images [px].
        """
        return Conduct()


@cache
def names() -> list[str]:
    """Return the sorted names of the protocols, which are those of their files."""
    return sorted(file.stem.replace("_", "-") for file in _FOLDER.glob("[a-z]*.py"))


def protocol(text: str) -> Protocol:
    """Return the protocol of a text `name:knob=value:…`, or of the stored name of one-pass runs.

    Raises `ProtocolError` for an unknown name or knob, or an invalid value.
    """
    try:
        name, options = parse_text(text)
    except ValueError as error:
        raise ProtocolError(f"protocol {error}") from None
    name = ONCE if name == STORED_ONCE else name
    if name not in names():
        hint = close_match(name, names())
        raise ProtocolError(f"unknown protocol {name!r}.{hint} Known: {', '.join(names())}.")
    made: type[Protocol] = _module(name).PROTOCOL
    try:
        return made.checked(f"protocol {name}", options)
    except TrackerError as error:
        raise ProtocolError(str(error)) from None


def stored_protocol(stored: str) -> Protocol:
    """Return the protocol that stored runs were made by; timing runs are one-pass."""
    return protocol(STORED_ONCE if stored == TIMING else stored)


def title(stored: str) -> str:
    """Return the title of stored runs in tables: `one-pass`, or the text of their protocol."""
    return ONCE if stored == STORED_ONCE else stored


def definition(name: str) -> dict[str, Any]:
    """Return the fields by which `describe` shows a protocol."""
    one = protocol(name)
    summary, _, rest = (_module(one.name).__doc__ or "").strip().partition("\n\n")
    knobs = [
        {"name": key, "default": field.default, "meaning": field.description}
        for key, field in type(one).model_fields.items()
    ]
    return {
        "name": one.name,
        "summary": summary,
        "definition": rest,
        "preset": one.preset,
        "judged": list(one.judged),
        "knobs": knobs,
    }


def _module(name: str) -> ModuleType:
    return import_module(f"trackmark.bench.protocols.{name.replace('-', '_')}")
